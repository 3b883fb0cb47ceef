//! The time, triangles, bytes and memory of each stage of a bake.

use crate::process::resident;
use bvh_bake::{Progress, Stage, Step, Traffic};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// One stage as `--json` prints it. Seconds and bytes add up over the stages of a bake.
#[derive(Serialize, Debug, Clone, PartialEq)]
pub(crate) struct StageLine {
    stage: &'static str,
    pub(crate) seconds: f64,
    /// Triangles of the input up to `prepare`, and stored triangles from `build` on.
    triangles: u64,
    triangles_per_second: f64,
    /// Bytes read from all files.
    bytes_read: u64,
    /// Bytes written to all files.
    bytes_written: u64,
    /// The part of `bytes_written` that went to scratch files.
    spilled_bytes: u64,
    /// Resident memory when the stage ended.
    resident_bytes: Option<u64>,
    /// The largest resident memory since the process began.
    peak_rss_bytes: Option<u64>,
}

/// Returns the name of a stage, which scripts rely on.
pub(crate) fn key(step: Step) -> &'static str {
    match step {
        Step::Read => "read",
        Step::Bake(Stage::Prepare) => "prepare",
        Step::Bake(Stage::Build) => "build",
        Step::Bake(Stage::Encode) => "assemble",
        Step::Bake(Stage::Prove) => "prove",
        Step::Write => "write",
    }
}

/// Measures the stages of a bake. The figures of several objects add up.
pub(crate) struct Stages {
    progress: Progress,
    /// Indexed by the number of the step.
    taken: [Taken; Step::ALL.len()],
    open: Option<(Step, Instant, Traffic)>,
    /// The number of stages that have been reported.
    told: usize,
}

#[derive(Default)]
struct Taken {
    time: Duration,
    read: u64,
    written: u64,
    spilled: u64,
    resident: Option<u64>,
    peak: Option<u64>,
}

impl Stages {
    pub(crate) fn new(progress: &Progress) -> Self {
        Self { progress: progress.clone(), taken: Default::default(), open: None, told: 0 }
    }

    /// Notes that a step begins. Tells the stages that have ended for all objects.
    pub(crate) fn begin(&mut self, step: Step, tell: &mut dyn FnMut(&StageLine)) {
        self.close();
        self.open = Some((step, Instant::now(), self.progress.traffic()));
        let has_ended = |before: Step| before < step && self.progress.share(before) == Some(1.0);
        while let Some(&before) = Step::ALL.get(self.told).filter(|&&before| has_ended(before)) {
            tell(&self.line(before));
            self.told += 1;
        }
    }

    /// Notes that all steps have ended. Tells the remaining stages and returns all of them.
    pub(crate) fn finish(mut self, tell: &mut dyn FnMut(&StageLine)) -> Vec<StageLine> {
        self.close();
        let lines: Vec<StageLine> = Step::ALL.iter().map(|&step| self.line(step)).collect();
        lines[self.told..].iter().for_each(tell);
        lines
    }

    fn close(&mut self) {
        let Some((step, since, before)) = self.open.take() else { return };
        let traffic = self.progress.traffic();
        let taken = &mut self.taken[number(step)];
        taken.time += since.elapsed();
        taken.read += traffic.read() - before.read();
        taken.written += traffic.written() - before.written();
        taken.spilled += traffic.scratch_written - before.scratch_written;
        (taken.resident, taken.peak) = (resident::current_bytes(), resident::peak_bytes());
    }

    fn line(&self, step: Step) -> StageLine {
        let taken = &self.taken[number(step)];
        let (seconds, triangles) = (taken.time.as_secs_f64(), self.progress.triangles(step));
        StageLine {
            stage: key(step),
            seconds,
            triangles,
            triangles_per_second: if seconds > 0.0 { triangles as f64 / seconds } else { 0.0 },
            bytes_read: taken.read,
            bytes_written: taken.written,
            spilled_bytes: taken.spilled,
            resident_bytes: taken.resident,
            peak_rss_bytes: taken.peak,
        }
    }
}

fn number(step: Step) -> usize {
    Step::ALL.iter().position(|&other| other == step).unwrap_or(0)
}

/// Returns the seconds of each stage by name.
pub(crate) fn seconds(lines: &[StageLine]) -> BTreeMap<&'static str, f64> {
    lines.iter().map(|line| (line.stage, line.seconds)).collect()
}

/// Returns the seconds of each stage for people, in order.
pub(crate) fn to_text(lines: &[StageLine]) -> String {
    let texts: Vec<String> = lines.iter().map(|line| format!("{} {:.2}", line.stage, line.seconds)).collect();
    texts.join(", ")
}
