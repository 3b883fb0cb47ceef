//! The resident memory of this process, and how to keep it small.

use std::sync::atomic::{AtomicU64, Ordering};

/// The largest size returned so far. The system counts roughly, and its peak may shrink again by a few pages.
static PEAK: AtomicU64 = AtomicU64::new(0);

/// Returns the largest resident size so far in bytes, or `None` if the system does not tell it in `/proc`.
pub(crate) fn peak_bytes() -> Option<u64> {
    let peak = status_bytes("VmHWM:")?;
    Some(PEAK.fetch_max(peak, Ordering::Relaxed).max(peak))
}

/// Returns the current resident size in bytes, or `None` if the system does not tell it in `/proc`.
pub(crate) fn current_bytes() -> Option<u64> {
    let current = status_bytes("VmRSS:")?;
    PEAK.fetch_max(current, Ordering::Relaxed);
    Some(current)
}

fn status_bytes(label: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(label))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// Makes the allocator return large freed blocks to the system at once. The GNU C library would otherwise keep more and
/// more of them, which adds half as much memory to a bake.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "no safe function limits what the C library keeps")]
    {
        /// The size in bytes from which the allocator takes a block from the system and returns it at once.
        const LARGE_BYTES: i32 = 1 << 20;
        // SAFETY: `mallopt` takes two integers by value and may be called at any time. A value out of range makes it
        // return 0 and change nothing.
        let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES) };
    }
}
