//! Removes unfinished files when a signal ends the process, and says so.
//!
//! Scratch files have no names and vanish by themselves. The output, which is written under a temporary name, is all that
//! has to be removed.

use crate::console::Failure;
use indicatif::ProgressBar;

/// Starts a thread that waits for an interrupt or a request to terminate. It removes unfinished files, prints one line,
/// and then lets the signal end the process as usual, so that its parent sees which signal it was.
#[cfg(unix)]
pub(crate) fn remove_unfinished_files(spinner: &ProgressBar) -> Result<(), Failure> {
    use crate::console::tell_line;
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::low_level::{emulate_default_handler, signal_name};
    let failed = |error| Failure::System(format!("cannot wait for signals: {error}"));
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]).map_err(failed)?;
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

/// Does nothing on other systems: the next bake of the same output removes what is left.
#[cfg(not(unix))]
pub(crate) fn remove_unfinished_files(_: &ProgressBar) -> Result<(), Failure> {
    Ok(())
}
