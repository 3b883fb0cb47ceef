//! Keeps the measuring thread on one processor.

/// The processor that a thread was bound to, and how many it might have had.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub(super) struct Pinned {
    pub(super) processor: usize,
    pub(super) allowed: usize,
}

/// Binds the calling thread to the last processor it may run on: the first has more of the system's work.
/// `None` where the system has no such call, or refuses.
#[cfg(target_os = "linux")]
pub(super) fn pin() -> Option<Pinned> {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
    let may = sched_getaffinity(None).ok()?;
    let processor = (0..CpuSet::MAX_CPU).rev().find(|&processor| may.is_set(processor))?;
    let mut only = CpuSet::new();
    only.set(processor);
    sched_setaffinity(None, &only).ok()?;
    Some(Pinned { processor, allowed: may.count() as usize })
}

/// Does nothing here.
#[cfg(not(target_os = "linux"))]
pub(super) fn pin() -> Option<Pinned> {
    None
}
