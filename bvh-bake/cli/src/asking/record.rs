//! The line that `--bench` prints: how many questions were asked of what, how long they took, and a hash of the answers.

use super::Answer;
use super::mesh::LoadedMesh;
use super::runner::Run;
use crate::console::hex;
use crate::process::resident;
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Object};
use cbvh_measure::spread::quantile;
use serde::Serialize;

/// How many questions were asked, and how long they took.
#[derive(Serialize)]
pub(crate) struct Times {
    queries: usize,
    requested: usize,
    total_s: f64,
    query_sum_s: f64,
    ns_median: u64,
    ns_mean: f64,
    ns_p10: u64,
    ns_p90: u64,
    ns_max: u64,
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

/// The JSON line of a file of questions: the fields that programs of this protocol share, and further ones.
#[derive(Serialize)]
pub(crate) struct Record {
    peer: &'static str,
    version: &'static str,
    mode: &'static str,
    /// The stem of the file, whatever its lines are.
    poses: String,
    tris_a: u64,
    build_a_s: f64,
    api_bytes_per_tri_a: f64,
    #[serde(flatten)]
    of_b: Option<OfB>,
    #[serde(flatten)]
    times: Times,
    pub(crate) positives: u64,
    sum: f64,
    peak_rss_mb: Option<f64>,
    /// Not measured: a query needs the bytes of the files, which `api_bytes_per_tri_a` and `_b` give.
    rss_bytes_per_tri: f64,
    isa: &'static str,
    profile: String,
    triangle_encoding: String,
    /// A hash of the answers without times; `None` if there may be others.
    pub(crate) answers_xxh3: Option<String>,
    node_tests: u64,
    triangle_tests: u64,
    exact_tests: u64,
    file_bytes_per_tri: f64,
    jobs: usize,
}

/// The fields of a second mesh.
#[derive(Serialize)]
struct OfB {
    tris_b: u64,
    build_b_s: f64,
    api_bytes_per_tri_b: f64,
}

impl Record {
    /// Describes the answers about a file, which are about one mesh or two.
    pub(crate) fn new<A: Answer>(
        mesh_a: &LoadedMesh,
        mesh_b: Option<&LoadedMesh>,
        mode: &'static str,
        backend: Backend,
        stem: &str,
        run: &Run<A>,
    ) -> Self {
        let answers = || run.answers.iter().map(|(answer, _)| answer);
        let (bytes_a, stored_a) = mesh_a.bytes_and_stored();
        let (bytes_b, stored_b) = mesh_b.map_or((0, 0), LoadedMesh::bytes_and_stored);
        Self {
            peer: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            mode,
            poses: stem.to_owned(),
            tris_a: mesh_a.triangles(),
            build_a_s: mesh_a.build_seconds,
            api_bytes_per_tri_a: bytes_a as f64 / stored_a as f64,
            of_b: mesh_b.map(|mesh_b| OfB {
                tris_b: mesh_b.triangles(),
                build_b_s: mesh_b.build_seconds,
                api_bytes_per_tri_b: bytes_b as f64 / stored_b as f64,
            }),
            times: Times::new(run.answers.iter().map(|&(_, ns)| ns), run.requested, run.total_seconds),
            positives: answers().filter(|answer| answer.is_positive()).count() as u64,
            sum: answers().map(Answer::value).sum(),
            peak_rss_mb: resident::peak_bytes().map(|bytes| bytes as f64 / 1048576.0),
            rss_bytes_per_tri: -1.0,
            isa: backend.name(),
            profile: of_both(mesh_a, mesh_b, |object| object.profile().name()),
            triangle_encoding: of_both(mesh_a, mesh_b, |object| object.triangle_encoding().name()),
            answers_xxh3: (run.answers.len() == run.requested).then(|| hex(hash(answers()))),
            node_tests: run.stats.node_tests,
            triangle_tests: run.stats.packet_tests,
            exact_tests: run.stats.exact_tests,
            file_bytes_per_tri: (bytes_a + bytes_b) as f64 / (stored_a + stored_b) as f64,
            jobs: run.jobs,
        }
    }
}

/// Returns a word about the first object of a mesh, and after a plus sign that of the other mesh if it differs.
fn of_both(
    mesh_a: &LoadedMesh,
    mesh_b: Option<&LoadedMesh>,
    word: impl Fn(&Object) -> &'static str,
) -> String {
    let of = |mesh: &LoadedMesh| mesh.shape().objects().first().map_or("", &word);
    let word_a = of(mesh_a);
    match mesh_b.map(of) {
        Some(word_b) if word_b != word_a => format!("{word_a}+{word_b}"),
        _ => word_a.to_owned(),
    }
}

/// Returns XXH3-64 of the answers without their times.
fn hash<'a, A: Answer + 'a>(answers: impl Iterator<Item = &'a A>) -> u64 {
    let mut hasher = Hasher::default();
    answers.for_each(|answer| answer.hash(&mut hasher));
    hasher.finish()
}
