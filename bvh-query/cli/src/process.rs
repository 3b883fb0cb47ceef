//! This process and the system: its resident memory, how to keep it small, mapped files, locks, and signals.

use crate::console::Failure;
#[cfg(any(unix, windows))]
use crate::console::tell_line;
use bvh_query::{Bvh, Files, OpenError, ReadAhead};
use indicatif::ProgressBar;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

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
    if cfg!(windows) {
        // Wine has this file, but it describes another process.
        return None;
    }
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(label))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// Locks a mutex. Poison is ignored: a thread that panics leaves nothing half-changed behind the locks of the command.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the largest resident size so far as the end of a sentence; nothing if it is unknown.
pub(crate) fn memory_in_words() -> String {
    peak_bytes().map_or(String::new(), |bytes| format!(", {:.0} MiB of memory", bytes as f64 / 1048576.0))
}

/// Maps a file that a person names. The README says that a mapped file must not change while it is open. Only here and in [`files`], the
/// command promises that nobody changes it.
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
pub(crate) fn map(path: &Path, read_ahead: ReadAhead) -> Result<Bvh, OpenError> {
    // WebAssembly cannot map files.
    if cfg!(target_family = "wasm") {
        return Bvh::read(path);
    }
    // SAFETY: the command never writes to a file that it maps, and those who run it are told that nobody else may.
    unsafe { Bvh::map_with(path, read_ahead) }
}

/// The most files that stay mapped at a time, where many are mapped at first need.
const MAX_OPEN_FILES: usize = 1000;

/// Returns a set of files that are mapped when they are first needed, with the same promise as [`map`].
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
pub(crate) fn files() -> Files {
    if cfg!(target_family = "wasm") {
        return Files::new(MAX_OPEN_FILES);
    }
    // SAFETY: as for `map`.
    unsafe { Files::mapped(MAX_OPEN_FILES) }
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

/// Returns whether the process ignores the end of its terminal, as `nohup` has it do.
#[cfg(unix)]
#[allow(unsafe_code, reason = "no safe function tells what a signal does")]
fn ignores_hangup() -> bool {
    // SAFETY: zeros are a valid `sigaction`, whose fields are numbers and a handler that may be null. With no new action,
    // `sigaction` only writes the present one to `action`, which is valid for it.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut action) == 0
            && action.sa_sigaction == libc::SIG_IGN
    }
}

/// Starts a thread that waits for an interrupt, a request to terminate or the end of the terminal. It removes unfinished
/// files, prints one line, and then lets the signal end the process as usual, so that its parent sees which signal it was.
#[cfg(unix)]
pub(crate) fn remove_unfinished_files(spinner: &ProgressBar) -> Result<(), Failure> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::low_level::{emulate_default_handler, signal_name};
    let failed = |error| Failure::System(format!("cannot wait for signals: {error}"));
    let hangup = (!ignores_hangup()).then_some(SIGHUP);
    let mut signals =
        signal_hook::iterator::Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup)).map_err(failed)?;
    let spinner = spinner.clone();
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
            bvh_bake::discard_unfinished();
            spinner.finish_and_clear();
            let name = signal_name(signal).unwrap_or("a signal");
            tell_line(&format!("stopped by {name}; no unfinished file was left behind"));
            // Reached only if the process survives: then nothing can be done about it.
            let _ = emulate_default_handler(signal);
        }
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).map_err(failed)?;
    Ok(())
}

/// Starts a thread that waits until the console asks the process to end: by Ctrl-C, by Ctrl-Break, or because its window is
/// closed. The thread removes unfinished files, prints one line, and ends the process with the code that it would
/// otherwise have.
#[cfg(windows)]
pub(crate) fn remove_unfinished_files(spinner: &ProgressBar) -> Result<(), Failure> {
    /// `STATUS_CONTROL_C_EXIT`.
    const STOPPED: i32 = 0xC000_013A_u32 as i32;
    let spinner = spinner.clone();
    #[expect(clippy::exit, reason = "the console has asked for it, and nobody else may end the process")]
    let stop = move || {
        bvh_bake::discard_unfinished();
        spinner.finish_and_clear();
        tell_line("stopped by the console; no unfinished file was left behind");
        std::process::exit(STOPPED)
    };
    ctrlc::set_handler(stop).map_err(|error| Failure::System(format!("cannot wait for Ctrl-C: {error}")))
}

/// Does nothing on other systems: the next bake of the same output removes what is left.
#[cfg(not(any(unix, windows)))]
pub(crate) fn remove_unfinished_files(_: &ProgressBar) -> Result<(), Failure> {
    Ok(())
}
