//! Flags that stop questions.

use crate::entry::{entry, hand_out};
use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::StopHandle;
use bvh_query::Stop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// All flags that are open. What has a flag keeps it.
static STOPS: Table<Arc<AtomicBool>> = Table::new(Kind::Stop);

/// Returns the flag of a handle; none if the handle is 0.
pub(crate) fn of(stop: StopHandle) -> Result<Option<Arc<dyn Stop>>, Failure> {
    let share = || -> Result<Arc<dyn Stop>, Failure> { Ok(STOPS.share("stop", stop.id)?) };
    (stop.id != 0).then(share).transpose()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_stop_new(stop: *mut StopHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { hand_out(("stop", stop), &STOPS, || Ok(Arc::default())) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_free(stop: StopHandle) -> i32 {
    entry(|| STOPS.free("stop", stop.id))
}

fn store(stop: StopHandle, is_set: bool) -> i32 {
    entry(|| {
        // Nothing else is read that depends on it.
        STOPS.share("stop", stop.id)?.store(is_set, Ordering::Relaxed);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_set(stop: StopHandle) -> i32 {
    store(stop, true)
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_stop_clear(stop: StopHandle) -> i32 {
    store(stop, false)
}
