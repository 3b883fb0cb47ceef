//! Flags that stop questions and bakes, by hand or after a time.

use crate::entry::{entry, hand_out};
use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::StopHandle;
use bvh_query::Stop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

/// All flags that are open. What has a flag keeps it.
static STOPS: Table<Arc<Flag>> = Table::new(Kind::Stop);

/// A flag, and the time from which on it counts as set, too. Nothing else is read that depends on them.
struct Flag {
    is_set: AtomicBool,
    /// In nanoseconds since some moment, or `NEVER`.
    until: AtomicU64,
}

/// A time that never comes: five hundred years.
const NEVER: u64 = u64::MAX;

/// Returns the nanoseconds since the first call.
fn now() -> u64 {
    static FIRST: LazyLock<Instant> = LazyLock::new(Instant::now);
    nanoseconds(FIRST.elapsed())
}

fn nanoseconds(time: Duration) -> u64 {
    time.as_nanos().try_into().unwrap_or(NEVER)
}

impl Flag {
    fn new() -> Self {
        Self { is_set: AtomicBool::new(false), until: AtomicU64::new(NEVER) }
    }
}

impl Stop for Flag {
    fn is_set(&self) -> bool {
        // The clock takes longer than a flag, and few flags have a time.
        let until = self.until.load(Ordering::Relaxed);
        self.is_set.load(Ordering::Relaxed) || until != NEVER && now() >= until
    }
}

/// Returns the flag of a handle; none if the handle is 0.
pub(crate) fn of(stop: StopHandle) -> Result<Option<Arc<dyn Stop>>, Failure> {
    in_argument("stop", stop)
}

/// Returns the flag of a handle as `of` does, from an argument with a name.
pub(crate) fn in_argument(name: &str, stop: StopHandle) -> Result<Option<Arc<dyn Stop>>, Failure> {
    let share = || -> Result<Arc<dyn Stop>, Failure> { Ok(STOPS.share(name, stop.id)?) };
    (stop.id != 0).then(share).transpose()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_stop_new(stop: *mut StopHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { hand_out(("stop", stop), &STOPS, || Ok(Arc::new(Flag::new()))) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_free(stop: StopHandle) -> i32 {
    entry(|| STOPS.free("stop", stop.id))
}

/// Changes a flag.
fn change(stop: StopHandle, change: impl FnOnce(&Flag) -> Result<(), Failure>) -> i32 {
    entry(|| change(&*STOPS.share("stop", stop.id)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_set(stop: StopHandle) -> i32 {
    change(stop, |flag| {
        flag.is_set.store(true, Ordering::Relaxed);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_set_after(stop: StopHandle, seconds: f64) -> i32 {
    change(stop, |flag| {
        if seconds.is_nan() || seconds < 0.0 {
            return Err(Failure::argument("seconds", "at least 0", format!("{seconds:?}")));
        }
        let time = Duration::try_from_secs_f64(seconds).map_or(NEVER, nanoseconds);
        flag.until.store(now().saturating_add(time), Ordering::Relaxed);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_clear(stop: StopHandle) -> i32 {
    change(stop, |flag| {
        flag.is_set.store(false, Ordering::Relaxed);
        flag.until.store(NEVER, Ordering::Relaxed);
        Ok(())
    })
}
