//! The results of a run as data: the JSON line, the raw lines and the hash of the answers.

use super::cold::Means;
use super::number::significant;
use super::question::{Answer, Question, Run, Timed};
use super::runner;
use super::side::{Side, Sides};
use crate::console::hex;
use crate::process::resident;
use bvh_format::checksum::Hasher;
use bvh_query::Backend;
use cbvh_measure::spread::quantile;
use serde::Serialize;

/// How many questions were asked, and how long they took.
#[derive(Serialize)]
pub(crate) struct Times {
    pub(crate) queries: usize,
    pub(crate) requested: usize,
    total_s: f64,
    query_sum_s: f64,
    pub(crate) ns_median: u64,
    ns_mean: f64,
    ns_p10: u64,
    pub(crate) ns_p90: u64,
    pub(crate) ns_max: u64,
}

impl Times {
    /// Sums up the nanoseconds of questions.
    pub(crate) fn new(nanoseconds: impl Iterator<Item = u64>, requested: usize, total_s: f64) -> Self {
        let mut times: Vec<u64> = nanoseconds.collect();
        times.sort_unstable();
        let (sum, queries) = (times.iter().sum::<u64>(), times.len());
        Self {
            queries,
            requested,
            total_s,
            query_sum_s: sum as f64 * 1e-9,
            ns_median: quantile(&times, 0.5),
            ns_mean: if queries == 0 { 0.0 } else { sum as f64 / queries as f64 },
            ns_p10: quantile(&times, 0.1),
            ns_p90: quantile(&times, 0.9),
            ns_max: times.last().copied().unwrap_or(0),
        }
    }
}

/// What the answers of a file come to.
pub(crate) struct Summed {
    pub(crate) mode: &'static str,
    pub(crate) positives: u64,
    pub(crate) sum: f64,
    /// A hash of the answers without times; `None` if there may be others.
    pub(crate) answers: Option<u64>,
}

/// The JSON line of a file of poses or motions: the fields that programs of this protocol share, and further ones.
#[derive(Serialize)]
pub(crate) struct Record {
    peer: &'static str,
    version: &'static str,
    mode: &'static str,
    poses: String,
    tris_a: u64,
    tris_b: u64,
    build_a_s: f64,
    build_b_s: f64,
    #[serde(flatten)]
    times: Times,
    positives: u64,
    sum: f64,
    peak_rss_mb: Option<f64>,
    /// Not measured: a query needs the bytes of the files, which the next two fields give.
    rss_bytes_per_tri: f64,
    api_bytes_per_tri_a: f64,
    api_bytes_per_tri_b: f64,
    isa: &'static str,
    profile: String,
    triangle_encoding: String,
    answers_xxh3: Option<String>,
    node_tests: u64,
    triangle_tests: u64,
    exact_tests: u64,
    file_bytes_per_tri: f64,
    jobs: usize,
    #[serde(flatten)]
    cold: Option<Means>,
}

impl Record {
    /// Describes the answers about poses.
    pub(super) fn of_poses(
        sides: &Sides<'_>,
        question: &Question,
        backend: Backend,
        stem: &str,
        run: &Run,
        cold: Option<Means>,
    ) -> Self {
        let answers = &run.answers;
        let complete = answers.len() == run.requested && question.is_exact();
        let summed = Summed {
            mode: question.mode.name(),
            positives: answers.iter().filter(|(answer, _)| answer.is_positive()).count() as u64,
            sum: answers.iter().map(|(answer, _)| answer.value()).sum(),
            answers: complete.then(|| hash(answers)),
        };
        Self { cold, ..Self::new(sides, summed, backend, stem, run) }
    }

    pub(crate) fn new<A>(
        sides: &Sides<'_>,
        summed: Summed,
        backend: Backend,
        stem: &str,
        run: &runner::Run<A>,
    ) -> Self {
        let (bytes_a, stored_a) = sides.a.bytes_and_stored();
        let (bytes_b, stored_b) = sides.b.bytes_and_stored();
        Self {
            peer: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            mode: summed.mode,
            poses: stem.to_owned(),
            tris_a: sides.a.triangles(),
            tris_b: sides.b.triangles(),
            build_a_s: sides.a.build_seconds,
            build_b_s: sides.b.build_seconds,
            times: Times::new(run.answers.iter().map(|&(_, ns)| ns), run.requested, run.total_seconds),
            positives: summed.positives,
            sum: summed.sum,
            peak_rss_mb: resident::peak_bytes().map(|bytes| bytes as f64 / 1048576.0),
            rss_bytes_per_tri: -1.0,
            api_bytes_per_tri_a: bytes_a as f64 / stored_a as f64,
            api_bytes_per_tri_b: bytes_b as f64 / stored_b as f64,
            isa: backend.name(),
            profile: both(sides, |side| side.shape().objects().first().map_or("", |o| o.profile().name())),
            triangle_encoding: both(sides, |side| {
                side.shape().objects().first().map_or("", |object| object.triangle_encoding().name())
            }),
            answers_xxh3: summed.answers.map(hex),
            node_tests: run.stats.node_tests,
            triangle_tests: run.stats.packet_tests,
            exact_tests: run.stats.exact_tests,
            file_bytes_per_tri: (bytes_a + bytes_b) as f64 / (stored_a + stored_b) as f64,
            jobs: run.jobs,
            cold: None,
        }
    }
}

impl Record {
    /// Returns the name of the pose file.
    pub(super) fn poses(&self) -> &str {
        &self.poses
    }

    /// Returns the name of the backend.
    pub(super) fn isa(&self) -> &'static str {
        self.isa
    }

    /// Returns the number of answers that are contact or yes.
    pub(super) fn positives(&self) -> u64 {
        self.positives
    }
}

/// Returns the value of both sides, or the two values joined by a plus sign.
fn both(sides: &Sides<'_>, of: impl Fn(&Side) -> &str) -> String {
    let (a, b) = (of(sides.a), of(sides.b));
    if a == b { a.to_owned() } else { format!("{a}+{b}") }
}

/// Returns XXH3-64 of the answers without their times: a byte for yes or no, a `u64` for a count, the bits of a distance.
fn hash(answers: &[Timed]) -> u64 {
    let mut hasher = Hasher::default();
    for (answer, _) in answers {
        match answer {
            Answer::Flag(flag) => hasher.update(&[u8::from(*flag)]),
            Answer::Count(count) => hasher.update(&count.to_le_bytes()),
            Answer::Length(length) => hasher.update(&length.to_bits().to_le_bytes()),
        }
    }
    hasher.finish()
}

/// Returns the raw lines: value, space, nanoseconds.
pub(super) fn raw(answers: &[Timed]) -> String {
    let mut text = String::with_capacity(answers.len() * 32);
    for (answer, nanoseconds) in answers {
        let value = match answer {
            Answer::Flag(flag) => u8::from(*flag).to_string(),
            Answer::Count(count) => count.to_string(),
            Answer::Length(length) => significant(*length),
        };
        text.push_str(&format!("{value} {nanoseconds}\n"));
    }
    text
}
