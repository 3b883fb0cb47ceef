//! What a run comes to: the JSON line, the raw lines and the hash of the answers.

use super::cold::Means;
use super::number::significant;
use super::runner::{Answer, Run, Timed};
use super::{Question, Side, Sides};
use crate::output::hex;
use crate::resident;
use bvh_format::checksum::Hasher;
use bvh_query::Backend;
use serde::Serialize;

/// The JSON line of a pose file: the peers' fields and ours.
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
    queries: usize,
    requested: usize,
    total_s: f64,
    query_sum_s: f64,
    ns_median: u64,
    ns_mean: f64,
    ns_p10: u64,
    ns_p90: u64,
    ns_max: u64,
    positives: u64,
    sum: f64,
    peak_rss_mb: Option<f64>,
    /// The peers measure it; here the file is all there is, and the next two fields tell it.
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
    pub(crate) fn new(
        sides: &Sides<'_>,
        question: &Question,
        backend: Backend,
        stem: &str,
        run: &Run,
        cold: Option<Means>,
    ) -> Self {
        let answers = &run.answers;
        let mut times: Vec<u64> = answers.iter().map(|&(_, nanoseconds)| nanoseconds).collect();
        times.sort_unstable();
        let nanoseconds: u64 = times.iter().sum();
        let count = answers.len();
        let (bytes_a, stored_a) = sides.a.bytes_and_stored();
        let (bytes_b, stored_b) = sides.b.bytes_and_stored();
        let complete = count == run.requested && question.is_exact();
        Self {
            peer: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            mode: question.mode.name(),
            poses: stem.to_owned(),
            tris_a: sides.a.triangles(),
            tris_b: sides.b.triangles(),
            build_a_s: sides.a.build_seconds,
            build_b_s: sides.b.build_seconds,
            queries: count,
            requested: run.requested,
            total_s: run.total_seconds,
            query_sum_s: nanoseconds as f64 * 1e-9,
            ns_median: quantile(&times, 0.5),
            ns_mean: if count == 0 { 0.0 } else { nanoseconds as f64 / count as f64 },
            ns_p10: quantile(&times, 0.1),
            ns_p90: quantile(&times, 0.9),
            ns_max: times.last().copied().unwrap_or(0),
            positives: answers.iter().filter(|(answer, _)| answer.is_contact()).count() as u64,
            sum: answers.iter().map(|(answer, _)| answer.value()).sum(),
            peak_rss_mb: resident::peak_bytes().map(|bytes| bytes as f64 / 1048576.0),
            rss_bytes_per_tri: -1.0,
            api_bytes_per_tri_a: bytes_a as f64 / stored_a as f64,
            api_bytes_per_tri_b: bytes_b as f64 / stored_b as f64,
            isa: backend.name(),
            profile: both(sides, |side| side.shape().objects().first().map_or("", |o| o.profile.name())),
            triangle_encoding: both(sides, |side| {
                side.shape().objects().first().map_or("", |object| object.triangle_encoding.name())
            }),
            answers_xxh3: complete.then(|| hex(hash(answers))),
            node_tests: run.stats.node_tests,
            triangle_tests: run.stats.packet_tests,
            exact_tests: run.stats.exact_tests,
            file_bytes_per_tri: (bytes_a + bytes_b) as f64 / (stored_a + stored_b) as f64,
            jobs: run.jobs,
            cold,
        }
    }
}

impl Record {
    /// The name of the pose file.
    pub(super) fn poses(&self) -> &str {
        &self.poses
    }
}

impl Answer {
    /// True for contact, and for a yes to `within`.
    fn is_contact(&self) -> bool {
        match *self {
            Self::Flag(flag) => flag,
            Self::Count(count) => count > 0,
            Self::Length(length) => length <= 0.0,
        }
    }

    /// The answer as a number.
    fn value(&self) -> f64 {
        match *self {
            Self::Flag(flag) => f64::from(u8::from(flag)),
            Self::Count(count) => count as f64,
            Self::Length(length) => length,
        }
    }
}

/// A sorted time at a fraction of the way, counted as the peers do.
pub(crate) fn quantile(sorted: &[u64], fraction: f64) -> u64 {
    let index = (fraction * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0)
}

/// What both sides have, or each side's.
fn both(sides: &Sides<'_>, of: impl Fn(&Side) -> &str) -> String {
    let (a, b) = (of(sides.a), of(sides.b));
    if a == b { a.to_owned() } else { format!("{a}+{b}") }
}

/// XXH3-64 of the answers without times: a byte for yes or no, a `u64` for a count, the bits of a distance.
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

/// The raw lines: value, space, nanoseconds.
pub(crate) fn raw(answers: &[Timed]) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    pub(crate) fn quantiles_are_those_of_the_peers() {
        let times: Vec<u64> = (0..10).collect();
        let found = [0.1, 0.5, 0.9, 1.0].map(|fraction| quantile(&times, fraction));
        assert_eq!(found, [1, 5, 9, 9]);
        assert_eq!(quantile(&[], 0.5), 0);
    }
}
