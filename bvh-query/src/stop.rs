//! What can stop a query that is under way.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stops queries: a flag that another thread, a timer or a signal handler sets, or a function that returns whether to stop, such as
/// one that looks at the time. See [`Querier::set_stop`](crate::Querier::set_stop).
///
/// ```
/// use bvh_query::{Querier, Stop};
/// use std::sync::Arc;
/// use std::time::{Duration, Instant};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut querier = Querier::new()?;
/// let end = Instant::now() + Duration::from_secs(5);
/// let stop: Arc<dyn Stop> = Arc::new(move || Instant::now() > end);
/// querier.set_stop(Some(stop.clone())); // no query goes on after five seconds
/// assert!(!stop.is_set());
/// # Ok(())
/// # }
/// ```
pub trait Stop: Send + Sync {
    /// Returns whether queries have to stop. Threads of a query call it before the first visit and after each 256 visits.
    fn is_set(&self) -> bool;
}

impl Stop for AtomicBool {
    fn is_set(&self) -> bool {
        // Nothing else is read that depends on it.
        self.load(Ordering::Relaxed)
    }
}

impl<F: Fn() -> bool + Send + Sync> Stop for F {
    fn is_set(&self) -> bool {
        self()
    }
}

impl fmt::Debug for dyn Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stop").finish_non_exhaustive()
    }
}
