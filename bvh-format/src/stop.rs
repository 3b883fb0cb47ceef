//! What can stop a bake or a query that is under way. Bakes and queries share it, so that one flag stops both.

use std::fmt;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stops bakes and queries: a flag that another thread, a timer or a signal handler sets, or a function that returns whether to stop,
/// such as one that looks at the time.
///
/// ```
/// use bvh_format::Stop;
/// use std::sync::Arc;
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use std::time::{Duration, Instant};
///
/// let flag = Arc::new(AtomicBool::new(false));
/// let end = Instant::now() + Duration::from_secs(5);
/// let by_flag: Arc<dyn Stop> = flag.clone();
/// let by_time: Arc<dyn Stop> = Arc::new(move || Instant::now() > end); // nothing goes on after five seconds
/// assert!(!by_flag.is_set() && !by_time.is_set());
/// flag.store(true, Ordering::Relaxed); // on any thread
/// assert!(by_flag.is_set());
/// ```
pub trait Stop: Send + Sync {
    /// Returns whether to stop. Threads of a query call it before the first visit and after each 256 visits. Threads of a bake call it
    /// before and after each piece of their work, which takes at most some tenths of a second.
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

/// Flags and functions are equal only to themselves.
impl PartialEq for dyn Stop {
    fn eq(&self, other: &Self) -> bool {
        ptr::addr_eq(self, other)
    }
}

impl fmt::Debug for dyn Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stop").finish_non_exhaustive()
    }
}
