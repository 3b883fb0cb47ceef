//! What happens when the process is told to end: what is half-written goes, and then the process as usual.
//!
//! Scratch files have no names, so the output under its other name is all there is to remove.

/// From now on an interrupt or a request to terminate leaves nothing behind.
#[cfg(unix)]
pub(crate) fn leave_nothing() -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            bvh_bake::discard_unfinished();
            // So that whoever waits for the process sees which signal ended it.
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// Elsewhere the next bake removes what is left.
#[cfg(not(unix))]
pub(crate) fn leave_nothing() -> std::io::Result<()> {
    Ok(())
}
