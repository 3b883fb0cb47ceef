//! The progress line of a bake, on standard error if that is a terminal.

use crate::console::spinner;
use crate::process::lock;
use bvh_bake::{Progress, Step};
use indicatif::{FormattedDuration, HumanBytes, HumanCount, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::{self, Display, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The line on the terminal.
pub(crate) struct Screen {
    pub(crate) spinner: ProgressBar,
    pub(crate) progress: Progress,
    /// Whether stages that have ended are told as JSON.
    pub(crate) tells_stages: bool,
    step: Arc<Mutex<Option<Begun>>>,
}

/// The step that runs now.
#[derive(Clone, Copy)]
struct Begun {
    step: Step,
    since: Instant,
    /// The triangles that the step had done before, for other objects.
    triangles: u64,
}

impl Screen {
    /// Shows the progress of a bake.
    pub(crate) fn new(json: bool, quiet: bool) -> Self {
        let (spinner, progress) = (spinner(quiet), Progress::default());
        let step: Arc<Mutex<Option<Begun>>> = Arc::default();
        if !spinner.is_hidden() {
            let (progress, step, start) = (progress.clone(), step.clone(), Instant::now());
            let draw = move |_: &ProgressState, line: &mut dyn Write| {
                if let Some(begun) = *lock(&step) {
                    // Writing to text in memory cannot fail.
                    let _ = write!(line, "{}", Line::now(&progress, begun, start.elapsed()));
                }
            };
            if let Ok(style) = ProgressStyle::with_template("{spinner} {bake}") {
                spinner.set_style(style.with_key("bake", draw));
            }
        }
        Self { spinner, progress, tells_stages: json && !quiet, step }
    }

    /// Notes that a step begins.
    pub(crate) fn begin(&self, step: Step) {
        if !self.spinner.is_hidden() {
            let triangles = self.progress.triangles(step);
            *lock(&self.step) = Some(Begun { step, since: Instant::now(), triangles });
            // Draws at once, so that even a step shorter than the spinner's interval is shown.
            self.spinner.force_draw();
        }
    }
}

/// What the line says.
struct Line {
    name: &'static str,
    share: Option<f64>,
    triangles_per_second: f64,
    spilled: u64,
    elapsed: Duration,
    /// How long the step has run.
    running: Duration,
}

/// The share of a step from which on the time left is shown. Before that, too little is done to tell.
const MIN_SHARE: f64 = 0.02;

impl Line {
    fn now(progress: &Progress, begun: Begun, elapsed: Duration) -> Self {
        let Begun { step, since, triangles } = begun;
        let triangles = progress.triangles(step).saturating_sub(triangles);
        let running = since.elapsed();
        Self {
            name: step.name(),
            share: progress.share(step),
            triangles_per_second: triangles as f64 / running.as_secs_f64().max(1e-3),
            spilled: progress.traffic().scratch_written,
            elapsed,
            running,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        if let Some(share) = self.share {
            write!(f, " {:.0} %", (share * 100.0).floor())?;
        }
        if self.triangles_per_second >= 1.0 {
            write!(f, ", {} triangles/s", HumanCount(self.triangles_per_second as u64))?;
        }
        if self.spilled > 0 {
            write!(f, ", {} spilled", HumanBytes(self.spilled))?;
        }
        write!(f, ", {}", FormattedDuration(self.elapsed))?;
        match self.share.filter(|share| (MIN_SHARE..1.0).contains(share)) {
            Some(share) => {
                let left = self.running.mul_f64((1.0 - share) / share);
                write!(f, ", about {} left in this step", FormattedDuration(left))
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_shows_what_is_known() {
        let mut line = Line {
            name: "building bricks",
            share: Some(0.5),
            triangles_per_second: 1.24e6,
            spilled: 812 << 20,
            elapsed: Duration::from_secs(72),
            running: Duration::from_secs(5),
        };
        assert_eq!(
            line.to_string(),
            "building bricks 50 %, 1,240,000 triangles/s, 812.00 MiB spilled, 00:01:12, about 00:00:05 left in this step"
        );
        (line.share, line.triangles_per_second, line.spilled) = (Some(1.0), 0.0, 0);
        assert_eq!(line.to_string(), "building bricks 100 %, 00:01:12");
        line.share = None;
        assert_eq!(line.to_string(), "building bricks, 00:01:12");
    }
}
