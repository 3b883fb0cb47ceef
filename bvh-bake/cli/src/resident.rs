//! How much memory this process holds, and how to hold less.

use std::sync::atomic::{AtomicU64, Ordering};

/// The largest size told so far: the system's sums are rough, and its largest one may shrink again by a few pages.
static MOST: AtomicU64 = AtomicU64::new(0);

/// The largest resident size so far in bytes; `None` where the system does not tell it in `/proc`.
pub(crate) fn peak_bytes() -> Option<u64> {
    let peak = status_bytes("VmHWM:")?;
    Some(MOST.fetch_max(peak, Ordering::Relaxed).max(peak))
}

/// The resident size now in bytes; `None` where the system does not tell it in `/proc`.
pub(crate) fn current_bytes() -> Option<u64> {
    let current = status_bytes("VmRSS:")?;
    MOST.fetch_max(current, Ordering::Relaxed);
    Some(current)
}

fn status_bytes(label: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(label))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// From now on large blocks that are freed go back to the system at once. The allocator of the GNU C library else
/// keeps more and more of them for later: half as much again in a bake.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "no safe function sets what the C library keeps")]
    {
        const LARGE: i32 = 1 << 20;
        // SAFETY: `mallopt` takes two integers by value and may be called at any time; a value out of range makes it
        // return 0 and change nothing.
        let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE) };
    }
}
