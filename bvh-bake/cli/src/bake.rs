//! `cbvh bake`: meshes into a file.

mod screen;
mod stages;

use crate::arguments::{BakeArguments, Choice, LayoutArguments};
use crate::error::{self, Failure};
use crate::output::{self, hex};
use crate::{manifest, resident, signals};
use bvh_bake::{BakeError, FileOptions, Options, Outcome, Progress, Step, bake_files};
use bvh_format::leaf::TriangleEncoding;
use screen::Screen;
pub(crate) use screen::spinner;
use serde::Serialize;
use stages::{StageLine, Stages};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(crate) fn run(arguments: &BakeArguments) -> Result<(), Failure> {
    if arguments.max_error.is_some() && !is_quantized(arguments.layout.triangles) {
        return Err(Failure::Usage("--max-error goes with --triangles quantized only (see --help)".into()));
    }
    if let Some(jobs) = arguments.jobs {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build_global();
        pool.map_err(|error| Failure::System(format!("--jobs {jobs}: cannot start threads: {error}")))?;
    }
    let options = Options {
        max_error: arguments.max_error,
        effort: arguments.effort,
        split_objects: arguments.split_objects,
        ids: !arguments.no_ids,
        ..options(&arguments.layout)
    };
    let file_options = FileOptions {
        force: arguments.force,
        max_memory: arguments.max_memory,
        scratch: arguments.scratch.clone(),
    };
    if arguments.max_memory.is_some() {
        resident::give_back();
    }
    if manifest::is_asked(arguments) {
        return manifest::run(arguments, &options, &file_options);
    }
    let Some(output) = &arguments.output else {
        return Err(Failure::Usage("expected --output <OUT.cbvh>, found none (see --help)".into()));
    };
    if arguments.shard.is_some() || arguments.out_manifest.is_some() {
        return Err(Failure::Usage(
            "--shard and --out-manifest go with --manifest or one folder only (see --help)".into(),
        ));
    }
    let progress = Progress::default();
    let screen = Screen::new(&progress, arguments.quiet);
    let tells_stages = arguments.json && !arguments.quiet;
    leave_nothing()?;
    let baked =
        bake(&arguments.inputs, output, &options, &file_options, &progress, &mut |event| match event {
            Event::Begins(step) => screen.begin(step, &progress),
            Event::Ended(line) if tells_stages => screen.suspend(|| error::tell_json(line)),
            Event::Ended(_) => {}
        });
    screen.clear();
    let report = baked.map_err(|error| Failure::from_bake(&names(&arguments.inputs), &error))?;
    if arguments.json {
        output::json(&report)
    } else if arguments.quiet {
        Ok(())
    } else {
        output::text(&report.to_text())
    }
}

/// What is to be seen of a bake while it goes on.
pub(crate) enum Event<'a> {
    /// A step begins.
    Begins(Step),
    /// A stage has ended for all objects.
    Ended(&'a StageLine),
}

/// Bakes meshes into one file, and reports on it.
pub(crate) fn bake(
    inputs: &[PathBuf],
    output: &Path,
    options: &Options,
    file_options: &FileOptions,
    progress: &Progress,
    watch: &mut dyn FnMut(Event),
) -> Result<Report, BakeError> {
    let start = Instant::now();
    let mut stages = Stages::new(progress);
    let outcome = bake_files(inputs, output, options, file_options, progress, &mut |step| {
        watch(Event::Begins(step));
        stages.begin(step, &mut |line| watch(Event::Ended(line)));
    })?;
    let stages = match outcome {
        Outcome::Baked(_) => stages.finish(&mut |line| watch(Event::Ended(line))),
        Outcome::UpToDate(_) => Vec::new(),
    };
    let seconds = start.elapsed().as_secs_f64();
    Ok(Report::new(names(inputs), output.display().to_string(), &outcome, stages, seconds))
}

/// From now on a signal that ends the process leaves nothing half-written.
pub(crate) fn leave_nothing() -> Result<(), Failure> {
    signals::leave_nothing().map_err(|error| Failure::System(format!("cannot wait for signals: {error}")))
}

/// Whether vertices may move, and `max_error` has a meaning.
pub(crate) fn is_quantized(triangles: Choice<TriangleEncoding>) -> bool {
    triangles.named() == Some(TriangleEncoding::Quantized)
}

/// The part of the options that `query` has too.
pub(crate) fn options(layout: &LayoutArguments) -> Options {
    Options { profile: layout.profile.named(), triangles: layout.triangles.named(), ..Options::default() }
}

/// Paths for messages.
pub(crate) fn names(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// What `--json` prints. Fields that a skipped bake does not know are null.
#[derive(Serialize)]
pub(crate) struct Report {
    pub(crate) input: String,
    pub(crate) output: String,
    format_version: String,
    profile: &'static str,
    triangle_encoding: &'static str,
    reason: String,
    pub(crate) triangles_in: u64,
    pub(crate) triangles: u64,
    pub(crate) degenerate: u64,
    pub(crate) duplicates: u64,
    vertices: Option<u64>,
    objects: u64,
    pub(crate) file_bytes: u64,
    node_bytes: u64,
    triangle_bytes: u64,
    id_bytes: u64,
    bytes_per_tri: f64,
    max_vertex_rounding: f64,
    max_quantization_error: f64,
    width_inflation: Option<f64>,
    volume_inflation: Option<f64>,
    mean_children: Option<f64>,
    bake_seconds: Option<f64>,
    pub(crate) seconds: f64,
    stage_seconds: Option<BTreeMap<&'static str, f64>>,
    #[serde(skip)]
    stages: Vec<StageLine>,
    /// Of all files: the sum of the three by file.
    bytes_read: Option<u64>,
    input_read_bytes: Option<u64>,
    scratch_read_bytes: Option<u64>,
    output_read_bytes: Option<u64>,
    /// To all files: the sum of the two by file.
    bytes_written: Option<u64>,
    scratch_written_bytes: Option<u64>,
    output_written_bytes: Option<u64>,
    /// The most at one time.
    scratch_bytes: Option<u64>,
    peak_rss_bytes: Option<u64>,
    content_xxh3: String,
    pub(crate) skipped: bool,
}

impl Report {
    fn new(input: String, output: String, outcome: &Outcome, stages: Vec<StageLine>, seconds: f64) -> Self {
        let (file, baked) = match outcome {
            Outcome::Baked(report) => (&report.file, Some(report)),
            Outcome::UpToDate(file) => (file, None),
        };
        let (major, minor) = file.version;
        let traffic = baked.map(|baked| baked.traffic);
        Self {
            input,
            output,
            format_version: format!("{major}.{minor}"),
            profile: file.profile.name(),
            triangle_encoding: file.triangle_encoding.name(),
            reason: baked.map_or("the output was up to date".into(), |baked| baked.reason.clone()),
            triangles_in: file.triangles_in,
            triangles: file.triangles,
            degenerate: file.degenerate,
            duplicates: file.duplicates,
            vertices: baked.map(|baked| baked.vertices),
            objects: file.objects,
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
            seconds,
            stage_seconds: baked.map(|_| stages::seconds(&stages)),
            stages,
            bytes_read: traffic.map(|traffic| traffic.read()),
            input_read_bytes: traffic.map(|traffic| traffic.input_read),
            scratch_read_bytes: traffic.map(|traffic| traffic.scratch_read),
            output_read_bytes: traffic.map(|traffic| traffic.output_read),
            bytes_written: traffic.map(|traffic| traffic.written()),
            scratch_written_bytes: traffic.map(|traffic| traffic.scratch_written),
            output_written_bytes: traffic.map(|traffic| traffic.output_written),
            scratch_bytes: traffic.map(|traffic| traffic.scratch_most),
            peak_rss_bytes: resident::peak_bytes(),
            content_xxh3: hex(file.content_xxh3),
            skipped: baked.is_none(),
        }
    }

    fn to_text(&self) -> String {
        if self.skipped {
            return format!("{}: up to date, content {}\n", self.output, self.content_xxh3);
        }
        let mut text = format!("{} -> {}\n", self.input, self.output);
        let mut line = |label: &str, value: String| text.push_str(&format!("  {label:<12} {value}\n"));
        let vertices = self.vertices.unwrap_or(0);
        let left_out = match self.duplicates {
            0 => String::new(),
            duplicates => format!(" ({duplicates} exact duplicates left out)"),
        };
        line("triangles", format!("{}{left_out}, {} of zero area", self.triangles, self.degenerate));
        line("vertices", format!("{vertices} in {} {}", self.objects, plural(self.objects, "object")));
        let because = if self.reason.is_empty() { String::new() } else { format!(": {}", self.reason) };
        line("layout", format!("{}, triangles {}{because}", self.profile, self.triangle_encoding));
        let each = |bytes: u64| bytes as f64 / self.triangles as f64;
        line(
            "bytes",
            format!(
                "{}, {:.2} a triangle: nodes {:.2}, triangles {:.2}, ids {:.2}",
                self.file_bytes,
                self.bytes_per_tri,
                each(self.node_bytes),
                each(self.triangle_bytes),
                each(self.id_bytes)
            ),
        );
        let moved = self.max_vertex_rounding;
        line("rounding", format!("vertices moved by at most {moved:e}"));
        if self.max_quantization_error > 0.0 {
            line("quantisation", format!("vertices moved by at most {:e}", self.max_quantization_error));
        }
        if let (Some(width), Some(volume)) = (self.width_inflation, self.volume_inflation) {
            line("bounds", format!("{width:.4} times as wide as tight ones, {volume:.4} times the volume"));
        }
        line("content", self.content_xxh3.clone());
        let memory = match self.peak_rss_bytes {
            Some(bytes) => format!(", {:.0} MiB of memory", bytes as f64 / 1048576.0),
            None => String::new(),
        };
        let mebibytes = |bytes: Option<u64>| bytes.unwrap_or(0) as f64 / 1048576.0;
        let [inputs, scratch, output] =
            [self.input_read_bytes, self.scratch_read_bytes, self.output_read_bytes].map(mebibytes);
        let all = mebibytes(self.bytes_read);
        line("read", format!("{all:.1} MiB: inputs {inputs:.1}, scratch {scratch:.1}, output {output:.1}"));
        let [scratch, output] = [self.scratch_written_bytes, self.output_written_bytes].map(mebibytes);
        let all = mebibytes(self.bytes_written);
        line("written", format!("{all:.1} MiB: scratch {scratch:.1}, output {output:.1}"));
        if let Some(most @ 1..) = self.scratch_bytes {
            line("scratch", format!("{:.1} MiB at most", mebibytes(Some(most))));
        }
        line("took", format!("{:.2} s{memory}: {}", self.seconds, stages::to_text(&self.stages)));
        text
    }
}

/// `word`, with an s unless there is one.
pub(crate) fn plural(count: u64, word: &str) -> String {
    if count == 1 { word.to_owned() } else { format!("{word}s") }
}
