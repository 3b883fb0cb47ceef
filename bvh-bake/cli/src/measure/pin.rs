//! Binds the measuring thread to one processor.

/// The processor that a thread was bound to, and how many it might have used.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Pinned {
    /// The number of the processor.
    pub processor: usize,
    /// How many processors the thread was allowed to run on before.
    pub allowed: usize,
}

/// Runs `work` on a thread of its own that is bound to one processor, if the system allows that, and returns the
/// processor with the result. Other threads go on using all processors.
pub fn pinned<T: Send>(work: impl FnOnce() -> T + Send) -> (Option<Pinned>, T) {
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| (pin(), work()));
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Binds the calling thread to the last processor it may run on: the first has more of the system's work.
/// `None` where the system has no such call, or refuses.
#[cfg(target_os = "linux")]
fn pin() -> Option<Pinned> {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
    let may = sched_getaffinity(None).ok()?;
    let processor = (0..CpuSet::MAX_CPU).rev().find(|&processor| may.is_set(processor))?;
    let mut only = CpuSet::new();
    only.set(processor);
    sched_setaffinity(None, &only).ok()?;
    Some(Pinned { processor, allowed: may.count() as usize })
}

/// This system has no call that binds threads.
#[cfg(not(target_os = "linux"))]
fn pin() -> Option<Pinned> {
    None
}
