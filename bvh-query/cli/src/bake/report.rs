//! What a bake prints when it has ended: a summary for people, or one JSON object.

use super::screen::Screen;
use crate::console::{Record, counted, hex, length, names, record, shown, tell_json};
use crate::open_edges;
use crate::process;
use bvh_bake::{BakeReport, FileSummary, Options, Outcome, Progress, Stage, Step, StoredFile, Traffic};
use bvh_format::Layout;
use bvh_format::header::version_name;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What a bake has done.
pub(crate) struct Report {
    pub(crate) input: String,
    pub(crate) output: String,
    outcome: Outcome,
    stages: Vec<StageLine>,
    pub(crate) seconds: f64,
    /// Why the output may be coarse, although the bake succeeded.
    coarseness: Option<String>,
}

impl Report {
    pub(super) fn new(
        inputs: &[PathBuf],
        output: &Path,
        options: &Options,
        outcome: Outcome,
        stages: Vec<StageLine>,
        seconds: f64,
    ) -> Self {
        let input = names(inputs);
        let coarseness = match &outcome {
            Outcome::Baked(report) => coarseness(&input, options, report),
            Outcome::UpToDate(_) => None,
        };
        Self { input, output: output.display().to_string(), outcome, stages, seconds, coarseness }
    }

    /// Returns what may be wrong with the output, although the bake succeeded, one line each.
    pub(crate) fn warnings(&self) -> Vec<&str> {
        let of_readers = self.baked().map_or(&[][..], |baked| &baked.warnings);
        of_readers.iter().chain(&self.coarseness).map(String::as_str).collect()
    }

    /// Returns the facts about the file.
    pub(crate) fn file(&self) -> &FileSummary {
        match &self.outcome {
            Outcome::Baked(report) => &report.file,
            Outcome::UpToDate(file) => file,
        }
    }

    /// Returns the facts about the bake; `None` if it was skipped.
    pub(crate) fn baked(&self) -> Option<&BakeReport> {
        match &self.outcome {
            Outcome::Baked(report) => Some(report),
            Outcome::UpToDate(_) => None,
        }
    }

    /// Returns what `--json` prints. Fields that are unknown because the bake was skipped are null.
    pub(crate) fn json(&self) -> Record {
        let (file, baked) = (self.file(), self.baked());
        let traffic = baked.map(|baked| baked.traffic);
        let stages = self.stages.iter().map(|line| (line.stage, line.seconds));
        record! {
            input: self.input,
            output: self.output,
            format_version: version_name(file.version),
            profile: file.profile.name(),
            triangle_encoding: file.triangle_encoding.name(),
            reason: baked.map_or("the output was up to date", |baked| &baked.reason),
            triangles_in: file.triangles_in,
            triangles: file.triangles,
            degenerate: file.degenerate,
            duplicates: file.duplicates,
            objects: file.objects,
            instances: file.instances,
            // The number of closed objects, or null if the file does not state which are.
            closed: file.closed,
            // The edges that leave objects open, or null if the file does not state which are closed, or was up to date.
            open_edges: baked.and_then(|baked| baked.open_edges.as_ref()).map(open_edges::json),
            file_bytes: file.file_bytes,
            node_bytes: file.node_bytes,
            triangle_bytes: file.triangle_bytes,
            id_bytes: file.id_bytes,
            bytes_per_tri: file.bytes_per_tri(),
            max_vertex_rounding: file.max_vertex_rounding,
            max_quantization_error: file.max_quantization_error,
            width_inflation: baked.map(|baked| baked.width_inflation),
            volume_inflation: baked.map(|baked| baked.volume_inflation),
            mean_children: baked.map(|baked| baked.mean_children),
            bake_seconds: baked.map(|baked| baked.seconds),
            seconds: self.seconds,
            warning: self.coarseness,
            warnings: baked.map(|_| self.warnings()),
            stage_seconds: baked.map(|_| stages.collect::<BTreeMap<_, _>>()),
            // Bytes read from all files: the sum of the next three fields.
            bytes_read: traffic.map(|traffic| traffic.read()),
            input_read_bytes: traffic.map(|traffic| traffic.input_read),
            scratch_read_bytes: traffic.map(|traffic| traffic.scratch_read),
            output_read_bytes: traffic.map(|traffic| traffic.output_read),
            // Bytes written to all files: the sum of the next two fields.
            bytes_written: traffic.map(|traffic| traffic.written()),
            scratch_written_bytes: traffic.map(|traffic| traffic.scratch_written),
            output_written_bytes: traffic.map(|traffic| traffic.output_written),
            // The most bytes in scratch files at any time.
            scratch_bytes: traffic.map(|traffic| traffic.scratch_most),
            peak_rss_bytes: process::peak_bytes(),
            content_xxh3: hex(file.content_xxh3),
            skipped: baked.is_none(),
        }
    }

    /// Returns the summary for people.
    pub(super) fn to_text(&self) -> String {
        let (file, content) = (self.file(), hex(self.file().content_xxh3));
        let Some(baked) = self.baked() else {
            return format!("{}: up to date, content {content}\n", shown(&self.output));
        };
        let mut text = format!("{} -> {}\n", shown(&self.input), shown(&self.output));
        let mut line = |label: &str, value: String| text.push_str(&format!("  {label:<12} {value}\n"));
        let left_out = match file.duplicates {
            0 => String::new(),
            count => format!(" ({} left out)", counted(count, "exact duplicate")),
        };
        line("triangles", format!("{}{left_out}, {} of zero area", file.triangles, file.degenerate));
        line("objects", file.objects.to_string());
        if file.instances > 0 {
            line("instances", file.instances.to_string());
        } else if let Some([x, y, z]) = sides(Path::new(&self.output)) {
            line("size", format!("{x} by {y} by {z} mesh units"));
        }
        let why = match &baked.open_edges {
            Some(edges) if !edges.is_empty() => format!(": {edges}"),
            _ => String::new(),
        };
        match (file.closed, file.objects) {
            (None, _) => {}
            (Some(1), 1) => line("surface", "closed".to_owned()),
            (Some(_), 1) => line("surface", format!("open{why}")),
            (Some(closed), objects) => {
                line("surfaces", format!("{closed} closed, {} open{why}", objects - closed));
            }
        }
        let because = if baked.reason.is_empty() { String::new() } else { format!(": {}", baked.reason) };
        let [nodes, triangles] = [file.profile.name(), file.triangle_encoding.name()];
        line("layout", format!("{nodes}, triangles {triangles}{because}"));
        let (bytes, all) = (file.file_bytes, file.bytes_per_tri());
        let [nodes, triangles, ids] = [file.node_bytes, file.triangle_bytes, file.id_bytes]
            .map(|bytes| format!("{:.2}", bytes as f64 / file.triangles as f64));
        let split = format!("nodes {nodes}, triangles {triangles}, ids {ids}");
        line("bytes", format!("{bytes}, {all:.2} per triangle: {split}"));
        let moved = |by: f64| format!("vertices moved by at most {}", length(by));
        line("rounding", moved(file.max_vertex_rounding));
        if file.max_quantization_error > 0.0 {
            line("quantisation", moved(file.max_quantization_error));
        }
        line("content", content);
        let (traffic, mebibytes) = (&baked.traffic, |bytes: u64| bytes as f64 / 1048576.0);
        if traffic.scratch_most > 0 {
            let [most, written] = [traffic.scratch_most, traffic.scratch_written].map(mebibytes);
            line("scratch", format!("{most:.1} MiB at most, {written:.1} MiB written"));
        }
        let stage = |line: &StageLine| format!("{} {:.2}", line.stage, line.seconds);
        let stages = self.stages.iter().map(stage).collect::<Vec<_>>().join(", ");
        line("took", format!("{:.2} s{}: {stages}", self.seconds, process::memory_in_words()));
        text
    }
}

/// Returns the sides of the box around all objects of a file, rounded; `None` if the file cannot be read any more.
fn sides(path: &Path) -> Option<[f32; 3]> {
    let layout = Layout::read_from(&StoredFile::open(path, None).ok()?).ok()?;
    let records = || layout.objects.iter().map(|object| object.record());
    Some([0, 1, 2].map(|axis| {
        let end = |box_end: f32, origin: f64| origin + f64::from(box_end);
        let ends = records().map(|of| {
            let origin = of.origin[axis].get();
            [end(of.box_lo[axis].get(), origin), end(of.box_hi[axis].get(), origin)]
        });
        let [lo, hi] = ends.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]).unwrap_or_default();
        (hi - lo) as f32
    }))
}

/// Returns a warning if quantisation may have collapsed triangles that matter.
fn coarseness(input: &str, options: &Options, report: &BakeReport) -> Option<String> {
    let (advised, file) = (report.advised_max_error?, &report.file);
    let allowed = options.max_error.unwrap_or(file.max_quantization_error);
    Some(format!(
        "{input}: a max error of {allowed:?} is coarse for this mesh: of {} triangles {} now have no area and {} equal \
         others; a max error of at most {advised:.1e} keeps nearly all of them",
        file.triangles_in, file.degenerate, file.duplicates
    ))
}

/// One stage as `--json` prints it. Seconds and bytes add up over the stages of a bake.
#[derive(Default, Clone, Serialize)]
pub(crate) struct StageLine {
    stage: &'static str,
    seconds: f64,
    /// Triangles of the input up to `prepare`, and stored triangles from `build` on.
    triangles: u64,
    triangles_per_second: f64,
    /// Bytes read from all files, and written to them.
    bytes_read: u64,
    bytes_written: u64,
    /// The part of `bytes_written` that went to scratch files.
    spilled_bytes: u64,
    /// Resident memory when the stage ended, and the largest since the process began.
    resident_bytes: Option<u64>,
    peak_rss_bytes: Option<u64>,
}

/// Returns the name of a stage, which scripts rely on.
fn key(step: Step) -> &'static str {
    match step {
        Step::Read => "read",
        Step::Bake(Stage::Prepare) => "prepare",
        Step::Bake(Stage::Build) => "build",
        Step::Bake(Stage::Encode) => "assemble",
        Step::Bake(Stage::Prove) => "prove",
        Step::Write => "write",
        // A step that a later library adds.
        _ => step.name(),
    }
}

/// Measures the stages of a bake. The figures of several objects add up.
pub(crate) struct Stages<'a> {
    progress: &'a Progress,
    /// Where steps that begin and stages that have ended are shown.
    screen: Option<&'a Screen>,
    lines: BTreeMap<Step, StageLine>,
    open: Option<(Step, Instant, Traffic)>,
    /// The number of stages that have been reported.
    told: usize,
}

impl<'a> Stages<'a> {
    pub(crate) fn new(progress: &'a Progress, screen: Option<&'a Screen>) -> Self {
        Self { progress, screen, lines: BTreeMap::new(), open: None, told: 0 }
    }

    /// Notes that a step begins. Tells the stages that have ended for all objects.
    pub(crate) fn begin(&mut self, step: Step) {
        self.screen.iter().for_each(|screen| screen.begin(step));
        self.close();
        self.open = Some((step, Instant::now(), self.progress.traffic()));
        let has_ended = |before: Step| before < step && self.progress.share(before) == Some(1.0);
        while let Some(&before) = Step::ALL.get(self.told).filter(|&&before| has_ended(before)) {
            self.tell(&self.line(before));
            self.told += 1;
        }
    }

    /// Notes that all steps have ended. Tells the remaining stages and returns all of them.
    pub(crate) fn finish(mut self) -> Vec<StageLine> {
        self.close();
        let lines: Vec<StageLine> = Step::ALL.iter().map(|&step| self.line(step)).collect();
        lines[self.told..].iter().for_each(|line| self.tell(line));
        lines
    }

    fn tell(&self, line: &StageLine) {
        if let Some(screen) = self.screen.filter(|screen| screen.tells_stages) {
            screen.spinner.suspend(|| tell_json(line));
        }
    }

    fn close(&mut self) {
        let Some((step, since, before)) = self.open.take() else { return };
        let traffic = self.progress.traffic();
        let line = self.lines.entry(step).or_default();
        line.seconds += since.elapsed().as_secs_f64();
        line.bytes_read += traffic.read() - before.read();
        line.bytes_written += traffic.written() - before.written();
        line.spilled_bytes += traffic.scratch_written - before.scratch_written;
        // The system takes longer to tell this than to bake a small mesh.
        if self.screen.is_some_and(|screen| screen.tells_stages) {
            (line.resident_bytes, line.peak_rss_bytes) = (process::current_bytes(), process::peak_bytes());
        }
    }

    fn line(&self, step: Step) -> StageLine {
        let line = self.lines.get(&step).cloned().unwrap_or_default();
        let triangles = self.progress.triangles(step);
        let triangles_per_second = if line.seconds > 0.0 { triangles as f64 / line.seconds } else { 0.0 };
        StageLine { stage: key(step), triangles, triangles_per_second, ..line }
    }
}
