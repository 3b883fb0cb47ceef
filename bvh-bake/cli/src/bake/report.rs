//! What a bake prints when it has ended: a summary for people, or one JSON object.

use super::stages::{self, StageLine};
use crate::console::{hex, length, plural};
use crate::process::resident;
use bvh_bake::{BakeReport, Options, Outcome};
use bvh_format::header::version_name;
use serde::Serialize;
use std::collections::BTreeMap;

/// What `--json` prints. Fields that are unknown because the bake was skipped are null.
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
    instances: u64,
    /// The number of closed objects, or null if the file does not state which are.
    closed: Option<u64>,
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
    /// What may be wrong with the output, although the bake succeeded.
    pub(crate) warning: Option<String>,
    stage_seconds: Option<BTreeMap<&'static str, f64>>,
    #[serde(skip)]
    stages: Vec<StageLine>,
    /// Bytes read from all files: the sum of the next three fields.
    bytes_read: Option<u64>,
    input_read_bytes: Option<u64>,
    scratch_read_bytes: Option<u64>,
    output_read_bytes: Option<u64>,
    /// Bytes written to all files: the sum of the next two fields.
    bytes_written: Option<u64>,
    scratch_written_bytes: Option<u64>,
    output_written_bytes: Option<u64>,
    /// The most bytes in scratch files at any time.
    scratch_bytes: Option<u64>,
    peak_rss_bytes: Option<u64>,
    content_xxh3: String,
    pub(crate) skipped: bool,
}

impl Report {
    pub(super) fn new(
        input: String,
        output: String,
        options: &Options,
        outcome: &Outcome,
        stages: Vec<StageLine>,
        seconds: f64,
    ) -> Self {
        let (file, baked) = match outcome {
            Outcome::Baked(report) => (&report.file, Some(report)),
            Outcome::UpToDate(file) => (file, None),
        };
        let traffic = baked.map(|baked| baked.traffic);
        let warning = baked.and_then(|baked| warning(&input, options, baked));
        Self {
            input,
            output,
            format_version: version_name(file.version),
            profile: file.profile.name(),
            triangle_encoding: file.triangle_encoding.name(),
            reason: baked.map_or("the output was up to date".into(), |baked| baked.reason.clone()),
            triangles_in: file.triangles_in,
            triangles: file.triangles,
            degenerate: file.degenerate,
            duplicates: file.duplicates,
            vertices: baked.map(|baked| baked.vertices),
            objects: file.objects,
            instances: file.instances,
            closed: file.closed,
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
            warning,
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

    /// Returns the summary for people.
    pub(super) fn to_text(&self) -> String {
        if self.skipped {
            return format!("{}: up to date, content {}\n", self.output, self.content_xxh3);
        }
        let mut text = format!("{} -> {}\n", self.input, self.output);
        let mut line = |label: &str, value: String| text.push_str(&format!("  {label:<12} {value}\n"));
        let vertices = self.vertices.unwrap_or(0);
        let left_out = match self.duplicates {
            0 => String::new(),
            count => format!(" ({count} exact {} left out)", plural(count, "duplicate")),
        };
        line("triangles", format!("{}{left_out}, {} of zero area", self.triangles, self.degenerate));
        line("vertices", format!("{vertices} in {} {}", self.objects, plural(self.objects, "object")));
        if self.instances > 0 {
            line("instances", self.instances.to_string());
        }
        match (self.closed, self.objects) {
            (None, _) => {}
            (Some(closed), 1) => line("surface", if closed == 1 { "closed" } else { "open" }.to_owned()),
            (Some(closed), objects) => {
                line("surfaces", format!("{closed} closed, {} open", objects - closed))
            }
        }
        let because = if self.reason.is_empty() { String::new() } else { format!(": {}", self.reason) };
        line("layout", format!("{}, triangles {}{because}", self.profile, self.triangle_encoding));
        let per_triangle = |bytes: u64| bytes as f64 / self.triangles as f64;
        line(
            "bytes",
            format!(
                "{}, {:.2} per triangle: nodes {:.2}, triangles {:.2}, ids {:.2}",
                self.file_bytes,
                self.bytes_per_tri,
                per_triangle(self.node_bytes),
                per_triangle(self.triangle_bytes),
                per_triangle(self.id_bytes)
            ),
        );
        let moved = length(self.max_vertex_rounding);
        line("rounding", format!("vertices moved by at most {moved}"));
        if self.max_quantization_error > 0.0 {
            let moved = length(self.max_quantization_error);
            line("quantisation", format!("vertices moved by at most {moved}"));
        }
        if let (Some(width), Some(volume)) = (self.width_inflation, self.volume_inflation) {
            line("bounds", format!("{width:.4} times the width of tight ones, {volume:.4} times the volume"));
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

/// Returns a warning if quantisation may have collapsed triangles that matter.
fn warning(input: &str, options: &Options, report: &BakeReport) -> Option<String> {
    let (advised, file) = (report.advised_max_error?, &report.file);
    let allowed = options.max_error.unwrap_or(file.max_quantization_error);
    Some(format!(
        "{input}: a max error of {allowed:?} is coarse for this mesh: of {} triangles {} now have no area and {} equal \
         others; a max error of at most {advised:.1e} keeps nearly all of them",
        file.triangles_in, file.degenerate, file.duplicates
    ))
}
