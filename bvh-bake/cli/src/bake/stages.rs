//! What each stage of a bake took: time, triangles, bytes and memory.

use crate::resident;
use bvh_bake::{Progress, Stage, Step, Traffic};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// What a stage took, as `--json` tells it. Seconds and bytes add up over the stages of a bake.
#[derive(Serialize, Debug, Clone, PartialEq)]
pub(crate) struct StageLine {
    stage: &'static str,
    pub(crate) seconds: f64,
    /// Of the input up to `prepare`; those stored from `build` on.
    triangles: u64,
    triangles_per_second: f64,
    /// Of all files.
    bytes_read: u64,
    /// To all files.
    bytes_written: u64,
    /// Of those written the bytes that went to scratch files.
    spilled_bytes: u64,
    /// When the stage ended.
    resident_bytes: Option<u64>,
    /// Since the process began.
    peak_rss_bytes: Option<u64>,
}

/// The name of a stage that scripts rely on.
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

/// Notes what the stages of a bake take. What they take for several objects adds up.
pub(crate) struct Stages {
    progress: Progress,
    /// By number of the step.
    taken: [Taken; Step::ALL.len()],
    open: Option<(Step, Instant, Traffic)>,
    /// How many stages have been told of.
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

    /// A step begins. Tells of those that have ended, which are all before it but for objects that are still to come.
    pub(crate) fn begin(&mut self, step: Step, tell: &mut dyn FnMut(&StageLine)) {
        self.close();
        self.open = Some((step, Instant::now(), self.progress.traffic()));
        let has_ended = |before: Step| before < step && self.progress.share(before) == Some(1.0);
        while let Some(&before) = Step::ALL.get(self.told).filter(|&&before| has_ended(before)) {
            tell(&self.line(before));
            self.told += 1;
        }
    }

    /// All steps have ended. Tells of those that are still to be told of, and returns all.
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

/// Seconds by name of the stage.
pub(crate) fn seconds(lines: &[StageLine]) -> BTreeMap<&'static str, f64> {
    lines.iter().map(|line| (line.stage, line.seconds)).collect()
}

/// Seconds for people, in order.
pub(crate) fn to_text(lines: &[StageLine]) -> String {
    let texts: Vec<String> = lines.iter().map(|line| format!("{} {:.2}", line.stage, line.seconds)).collect();
    texts.join(", ")
}
