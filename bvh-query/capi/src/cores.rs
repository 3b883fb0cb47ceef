//! All cores, or the calling thread alone.
//!
//! A thread of the pool that waits for others takes up other work meanwhile, and that may be another path of the question
//! that it is in. A function of the caller that asks the library something would then be called again on its own thread
//! before it has returned, while it holds a lock or uses a querier. So what is asked on a thread of the pool, which is to
//! say by a function of the caller, takes that thread alone. Answers and files are the same.

use crate::status::{Failure, Status};

/// Returns whether a question may use all cores.
pub(crate) fn may_use_all() -> bool {
    rayon::current_thread_index().is_none()
}

/// Does work that uses all cores by itself: on a thread of the pool it is done by another thread, alone.
pub(crate) fn work<R: Send>(work: impl FnOnce() -> Result<R, Failure> + Send) -> Result<R, Failure> {
    if may_use_all() {
        return work();
    }
    on_thread(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        pool.map_err(|error| refused(&error))?.install(work)
    })
}

/// Does the same on a thread of its own: work that needs more stack than a caller has to have.
pub(crate) fn work_apart<R: Send>(apart: impl FnOnce() -> Result<R, Failure> + Send) -> Result<R, Failure> {
    if may_use_all() { on_thread(apart) } else { work(apart) }
}

fn on_thread<R: Send>(work: impl FnOnce() -> Result<R, Failure> + Send) -> Result<R, Failure> {
    std::thread::scope(|scope| {
        let thread =
            std::thread::Builder::new().spawn_scoped(scope, work).map_err(|error| refused(&error))?;
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn refused(error: &dyn std::fmt::Display) -> Failure {
    Failure::new(Status::System, format!("a thread: {error}"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails may panic")]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn on_a_thread_of_the_pool_work_takes_up_no_other_work() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let lock = std::sync::Mutex::new(0);
        let both = || std::thread::sleep(Duration::from_millis(1));
        let inner = || {
            assert!(!may_use_all());
            let mut held = lock.lock().unwrap();
            *held += work(|| {
                assert_eq!(rayon::current_num_threads(), 1);
                rayon::join(both, both);
                Ok(1)
            })
            .unwrap();
        };
        pool.scope(|scope| (0..20).for_each(|_| scope.spawn(|_| inner())));
        assert_eq!(*lock.lock().unwrap(), 20);
        assert!(may_use_all());
    }
}
