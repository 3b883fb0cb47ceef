//! A line on standard error that shows progress while a command works.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// The time between two drawings of the line.
const TICK: Duration = Duration::from_millis(100);

/// Returns a line with a message and the elapsed time. It stays hidden if standard error is not a terminal, or if the
/// command is quiet.
pub(crate) fn spinner(quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let spinner = ProgressBar::with_draw_target(None, target);
    if !spinner.is_hidden() {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
            spinner.set_style(style);
        }
        spinner.enable_steady_tick(TICK);
    }
    spinner
}
