//! The progress line of a bake, on standard error if that is a terminal.

use crate::console::spinner;
use bvh_bake::{Progress, Stage, Step};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::{self, Display, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The line on the terminal.
pub(crate) struct Screen {
    spinner: ProgressBar,
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
    pub(crate) fn new(progress: &Progress, quiet: bool) -> Self {
        let spinner = spinner(quiet);
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
        Self { spinner, step }
    }

    /// Notes that a step begins.
    pub(crate) fn begin(&self, step: Step, progress: &Progress) {
        if !self.spinner.is_hidden() {
            *lock(&self.step) =
                Some(Begun { step, since: Instant::now(), triangles: progress.triangles(step) });
            // Draws at once, so that even a step shorter than the spinner's interval is shown.
            self.spinner.force_draw();
        }
    }

    /// Hides the line while something else is written.
    pub(crate) fn suspend(&self, write: impl FnOnce()) {
        self.spinner.suspend(write);
    }

    /// Returns the line itself.
    pub(crate) fn spinner(&self) -> &ProgressBar {
        &self.spinner
    }

    /// Removes the line.
    pub(crate) fn clear(self) {
        self.spinner.finish_and_clear();
    }
}

fn lock(step: &Mutex<Option<Begun>>) -> MutexGuard<'_, Option<Begun>> {
    step.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the line says.
struct Line {
    name: &'static str,
    share: Option<f64>,
    triangles_per_second: f64,
    spilled: u64,
    elapsed: Duration,
    left: Option<Duration>,
}

impl Line {
    fn now(progress: &Progress, begun: Begun, elapsed: Duration) -> Self {
        let Begun { step, since, triangles } = begun;
        let triangles = progress.triangles(step).saturating_sub(triangles);
        Self {
            name: step.name(),
            share: progress.share(step),
            triangles_per_second: triangles as f64 / since.elapsed().as_secs_f64().max(1e-3),
            spilled: progress.traffic().scratch_written,
            elapsed,
            left: left(elapsed, done(|step| progress.share(step))),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        if let Some(share) = self.share {
            write!(f, " {:.0} %", (share * 100.0).floor())?;
        }
        match self.triangles_per_second {
            rate @ 1e6.. => write!(f, ", {:.1} M triangles/s", rate / 1e6)?,
            rate @ 1e3.. => write!(f, ", {:.0} k triangles/s", rate / 1e3)?,
            rate @ 1.0.. => write!(f, ", {rate:.0} triangles/s")?,
            _ => {}
        }
        match self.spilled as f64 / 1048576.0 {
            mebibytes @ 10240.0.. => write!(f, ", {:.1} GiB spilled", mebibytes / 1024.0)?,
            mebibytes if mebibytes > 0.0 => write!(f, ", {mebibytes:.0} MiB spilled")?,
            _ => {}
        }
        write!(f, ", {}", clock(self.elapsed))?;
        match self.left {
            Some(left) => write!(f, ", about {} left", clock(left)),
            None => Ok(()),
        }
    }
}

/// Returns a time in minutes and seconds.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

/// The usual share of each step in the time of a bake, in percent. Measured with 2 million triangles as STL and PLY, in
/// memory and within 200 MiB, on two cores of an Intel Xeon, family 6, model 167, 2026-11-21. Reading text takes longer.
const USUAL: [(Step, f64); Step::ALL.len()] = [
    (Step::Read, 23.0),
    (Step::Bake(Stage::Prepare), 10.0),
    (Step::Bake(Stage::Build), 48.0),
    (Step::Bake(Stage::Encode), 9.0),
    (Step::Bake(Stage::Prove), 7.0),
    (Step::Write, 3.0),
];

/// Estimates the share of all steps that is done, from 0 to 1, by their usual shares.
fn done(share: impl Fn(Step) -> Option<f64>) -> f64 {
    let all: f64 = USUAL.iter().map(|(_, usual)| usual).sum();
    USUAL.iter().map(|&(step, usual)| usual * share(step).unwrap_or(0.0)).sum::<f64>() / all
}

/// Estimates the time left at the speed so far. Returns `None` while too little is done to tell.
fn left(elapsed: Duration, done: f64) -> Option<Duration> {
    (done >= 0.02).then(|| elapsed.mul_f64((1.0 - done).max(0.0) / done))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_shows_what_is_known() {
        let seconds = Duration::from_secs;
        let mut line = Line {
            name: "building bricks",
            share: Some(0.439),
            triangles_per_second: 1.24e6,
            spilled: 812 << 20,
            elapsed: seconds(72),
            left: Some(seconds(5)),
        };
        assert_eq!(
            line.to_string(),
            "building bricks 43 %, 1.2 M triangles/s, 812 MiB spilled, 1:12, about 0:05 left"
        );
        (line.share, line.triangles_per_second, line.spilled, line.left) = (None, 0.0, 0, None);
        assert_eq!(line.to_string(), "building bricks, 1:12");
        (line.triangles_per_second, line.spilled) = (45_600.0, 25 << 29);
        assert_eq!(line.to_string(), "building bricks, 46 k triangles/s, 12.5 GiB spilled, 1:12");
    }

    #[test]
    fn the_time_left_shrinks_to_nothing() {
        let until = |last: Step, share: f64| {
            done(|step| match step {
                step if step < last => Some(1.0),
                step if step == last => Some(share),
                _ => None,
            })
        };
        assert_eq!((until(Step::Read, 0.0), until(Step::Write, 1.0)), (0.0, 1.0));
        let mut before = 0.0;
        for step in Step::ALL {
            for share in [0.1, 0.5, 1.0] {
                let now = until(step, share);
                assert!(now > before, "{step:?} {share}");
                before = now;
            }
        }
        let minute = Duration::from_secs(60);
        assert_eq!((left(minute, 0.01), left(minute, 1.0)), (None, Some(Duration::ZERO)));
        assert_eq!(left(minute, 0.75), Some(Duration::from_secs(20)));
    }
}
