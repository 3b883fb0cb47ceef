//! What commands that ask have in common: meshes, files of questions, the run, and how answers are told.

pub(crate) mod files;
pub(crate) mod mesh;
mod runner;

use crate::console::{self, Failure, Record, hex, record, significant};
use crate::options::{LayoutArguments, not_negative, threads, whole};
use crate::process;
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Distance, Object, Querier, QueryError};
use cbvh_measure::spread::quantile;
use clap::{Args, ValueEnum};
use files::write_file;
use mesh::{How, LoadedMesh};
use runner::Limits;
pub(crate) use runner::Run;
use serde_json::{Value, json};
use std::path::Path;

/// What every answer has, whatever the question.
pub(crate) trait Answer {
    /// Returns whether the answer counts among the positives.
    fn is_positive(&self) -> bool;

    /// Returns the answer as a number, of which `--bench` prints the sum.
    fn value(&self) -> f64;

    /// Returns the line that is printed.
    fn line(&self) -> String {
        significant(self.value())
    }

    /// Returns all that the answer has, as a JSON object.
    fn json(&self) -> Value;

    /// Hashes what the line tells.
    fn hash(&self, hasher: &mut Hasher);
}

/// Returns the backend of `--isa`. `auto` leaves the choice to `CBVH_ISA` or to the CPU.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// Returns the name of a mode on the command line.
pub(crate) fn mode_name(mode: &impl ValueEnum) -> String {
    mode.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// Asks about all files of questions and tells the answers as the arguments say. A question is called `noun`, `blame` names
/// the file that an error is about, and `bench` makes the line of `--bench` for a file of this stem.
pub(crate) fn ask_files<T: Sync, A: Answer + Clone + Send>(
    arguments: &AskingArguments,
    backend: Backend,
    noun: &str,
    files: &[(String, Vec<T>)],
    ask: impl Fn(&mut Querier, &T) -> Result<A, QueryError> + Sync,
    blame: impl Fn(QueryError) -> Failure,
    bench: impl Fn(&str, &Run<A>) -> Record,
) -> Result<(), Failure> {
    for (stem, questions) in files {
        let run = runner::run(questions, &ask, backend, &arguments.limits()).map_err(&blame)?;
        if let Some(out) = &arguments.out {
            let lines =
                run.answers.iter().map(|(answer, nanoseconds)| format!("{} {nanoseconds}\n", answer.line()));
            write_file(Path::new(&out.replacen("%s", stem, 1)), &lines.collect::<String>())?;
        }
        let answers = || run.answers.iter().map(|(answer, _)| answer);
        if arguments.bench {
            console::json(&bench(stem, &run))?;
        } else if arguments.json {
            let file = (files.len() > 1).then_some((noun, &**stem));
            console::lines((0..).zip(answers()).map(|(number, answer)| {
                let mut record = answer.json();
                record[noun] = json!(number);
                if let Some((noun, stem)) = file {
                    record[format!("{noun}s")] = json!(stem);
                }
                record
            }))?;
        } else {
            console::lines(answers().map(Answer::line))?;
        }
    }
    Ok(())
}

/// Returns all that a distance has, as a JSON object.
pub(crate) fn distance_json(of: &Distance) -> Value {
    json!({
        "distance": of.distance, "lower": of.lower, "upper": of.upper, "point_a": of.point_a, "point_b": of.point_b,
        "object_a": of.object_a, "triangle_a": of.triangle_a, "object_b": of.object_b, "triangle_b": of.triangle_b,
    })
}

/// The options for asking. Each command has an argument `one`, which asks a single question and excludes what only files
/// need.
#[derive(Debug, Args)]
pub(crate) struct AskingArguments {
    /// The instruction set: auto, scalar, avx2 or avx512. auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// The number of threads that share the questions
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads, allow_negative_numbers = true,
          conflicts_with = "one")]
    jobs: u16,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Query only the object of this name, in each mesh that has one
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Write raw answers and times to this file; %s stands for the name of the file of questions
    #[arg(long, value_name = "raw_%s.txt", conflicts_with = "one")]
    pub(crate) out: Option<String>,
    /// Stop each file after this many seconds
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true, conflicts_with = "one")]
    pub(crate) budget: Option<f64>,
    /// Untimed questions before the timed ones, taken from the end of the file
    #[arg(long, value_name = "N", default_value = "3", value_parser = whole::<usize>, allow_negative_numbers = true,
          conflicts_with = "one")]
    warm: usize,
    /// Ask only the first N questions of each file; 0 asks all
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole::<usize>, allow_negative_numbers = true,
          conflicts_with = "one")]
    pub(crate) limit: usize,
    /// How the system reads .cbvh files from the disk
    #[arg(long, value_enum, value_name = "HOW", default_value = "usual")]
    read_ahead: ReadAhead,
    /// Print one JSON object per question, with all that the answer has
    #[arg(long)]
    pub(crate) json: bool,
    /// Print one JSON object per file, with the times of its questions, and no answers
    #[arg(long, conflicts_with_all = ["one", "json"])]
    pub(crate) bench: bool,
}

impl AskingArguments {
    /// Refuses what only files of questions need.
    pub(crate) fn require_no_files(&self) -> Result<(), Failure> {
        if self.bench || self.out.is_some() {
            return Err(Failure::Usage("--bench and --out require a file of questions (see --help)".into()));
        }
        Ok(())
    }

    /// Returns how meshes are prepared.
    pub(crate) fn how(&self) -> How<'_> {
        let (layout, object) = (&self.layout, self.object.as_deref());
        How { layout, object, read_ahead: self.read_ahead.into() }
    }

    /// Returns the limits of a run.
    pub(crate) fn limits(&self) -> Limits {
        Limits { jobs: usize::from(self.jobs), warm: self.warm, budget: self.budget }
    }
}

/// How the system reads a file from the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ReadAhead {
    /// As the system chooses: some pages around each page that is touched
    Usual,
    /// Only the pages that queries touch
    Sparse,
    /// The whole file, in the background
    Whole,
}

impl From<ReadAhead> for bvh_query::ReadAhead {
    fn from(how: ReadAhead) -> Self {
        match how {
            ReadAhead::Usual => Self::Usual,
            ReadAhead::Sparse => Self::Sparse,
            ReadAhead::Whole => Self::Whole,
        }
    }
}

/// Returns how many questions were asked, and how long they took, as the fields of `--bench`.
pub(crate) fn times(nanoseconds: impl Iterator<Item = u64>, requested: usize, total_s: f64) -> Record {
    let mut times: Vec<u64> = nanoseconds.collect();
    times.sort_unstable();
    let (sum, queries) = (times.iter().sum::<u64>(), times.len());
    record! {
        queries: queries,
        requested: requested,
        total_s: total_s,
        query_sum_s: sum as f64 * 1e-9,
        ns_median: quantile(&times, 0.5),
        ns_mean: if queries == 0 { 0.0 } else { sum as f64 / queries as f64 },
        ns_p10: quantile(&times, 0.1),
        ns_p90: quantile(&times, 0.9),
        ns_max: times.last().copied().unwrap_or(0),
    }
}

/// Returns the largest resident size so far in MiB.
pub(crate) fn peak_rss_mb() -> Option<f64> {
    process::peak_bytes().map(|bytes| bytes as f64 / 1048576.0)
}

/// Returns the line of `--bench` for a file of questions, about one mesh or two: the fields that programs of this protocol
/// share, and further ones. The hash of the answers is null if there may be others.
pub(crate) fn bench<A: Answer>(
    mesh_a: &LoadedMesh,
    mesh_b: Option<&LoadedMesh>,
    mode: &str,
    backend: Backend,
    stem: &str,
    run: &Run<A>,
    is_exact: bool,
) -> Record {
    let answers = || run.answers.iter().map(|(answer, _)| answer);
    let (bytes_a, stored_a) = mesh_a.bytes_and_stored();
    let (bytes_b, stored_b) = mesh_b.map_or((0, 0), LoadedMesh::bytes_and_stored);
    let mut hasher = Hasher::default();
    answers().for_each(|answer| answer.hash(&mut hasher));
    let is_complete = is_exact && run.answers.len() == run.requested;
    record! {
        peer: "cbvh",
        version: env!("CARGO_PKG_VERSION"),
        mode: mode,
        poses: stem,
        tris_a: mesh_a.triangles(),
        build_a_s: mesh_a.build_seconds,
        api_bytes_per_tri_a: bytes_a as f64 / stored_a as f64,
    }
    .with(mesh_b.map(|mesh_b| {
        record! {
            tris_b: mesh_b.triangles(),
            build_b_s: mesh_b.build_seconds,
            api_bytes_per_tri_b: bytes_b as f64 / stored_b as f64,
        }
    }))
    .with(times(run.answers.iter().map(|&(_, ns)| ns), run.requested, run.total_seconds))
    .with(record! {
        positives: answers().filter(|answer| answer.is_positive()).count(),
        sum: answers().map(Answer::value).sum::<f64>(),
        peak_rss_mb: peak_rss_mb(),
        // Not measured: a query needs the bytes of the files, which `api_bytes_per_tri_a` and `_b` give.
        rss_bytes_per_tri: -1.0,
        isa: backend.name(),
        profile: of_both(mesh_a, mesh_b, |object| object.profile().name()),
        triangle_encoding: of_both(mesh_a, mesh_b, |object| object.triangle_encoding().name()),
        answers_xxh3: is_complete.then(|| hex(hasher.finish())),
        node_tests: run.stats.node_tests,
        triangle_tests: run.stats.packet_tests,
        exact_tests: run.stats.exact_tests,
        file_bytes_per_tri: (bytes_a + bytes_b) as f64 / (stored_a + stored_b) as f64,
        jobs: run.jobs,
    })
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
