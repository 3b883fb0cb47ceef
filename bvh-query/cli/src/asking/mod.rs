//! The common part of the commands that run queries: meshes, files of queries, the run, and how results are
//! printed.

pub(crate) mod files;
pub(crate) mod mesh;
pub(crate) mod runner;

use crate::console::{self, Failure, Record, record, significant};
use crate::options::{LayoutArguments, not_negative, threads, whole};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Distance, Object, Querier, QueryError, ReadAhead, Shape};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use mesh::{How, LoadedMesh};
use runner::Run;
use std::path::{Path, PathBuf};

/// The common part of all answers.
pub(crate) trait Answer {
    /// Returns whether the answer counts among the positives.
    fn is_positive(&self) -> bool;

    /// Returns the answer as a number, of which `--bench` prints the sum.
    fn value(&self) -> f64;

    /// Returns the line that is printed.
    fn line(&self) -> String {
        significant(self.value())
    }

    /// Returns everything that the answer has.
    fn json(&self) -> Record;

    /// Hashes what the line tells.
    fn hash(&self, hasher: &mut Hasher);

    /// Returns further fields of `--bench`.
    fn counts<'a>(_: impl Iterator<Item = &'a Self>) -> Option<Record>
    where
        Self: 'a,
    {
        None
    }
}

/// Returns the backend of `--isa`. `auto` leaves the choice to `CBVH_ISA` or to the CPU.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// Returns the name of a mode on the command line.
pub(crate) fn mode_name(mode: &impl ValueEnum) -> String {
    mode.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// Returns the distance of `--within`, which only the mode of this name takes and requires.
pub(crate) fn within(is_mode: bool, within: Option<f64>) -> Result<f64, Failure> {
    match within {
        None if is_mode => Err(Failure::usage("--mode within requires --within D")),
        Some(_) if !is_mode => Err(Failure::usage("--within requires --mode within")),
        within => Ok(within.unwrap_or(0.0)),
    }
}

/// One mesh or two, and how to ask about them.
pub(crate) struct Session<'a> {
    arguments: &'a AskingArguments,
    backend: Backend,
    /// What a question and several of them are called.
    words: [&'static str; 2],
    mode: String,
    /// Whether answers are the same on every backend and with every number of threads.
    is_exact: bool,
    a: LoadedMesh,
    b: Option<LoadedMesh>,
}

impl<'a> Session<'a> {
    /// Loads the meshes. The tuple has the names of questions and of the mode, and whether answers are exact.
    pub(crate) fn load(
        arguments: &'a AskingArguments,
        (backend, words, mode, is_exact): (Backend, [&'static str; 2], String, bool),
        a: &Path,
        b: Option<&Path>,
    ) -> Result<Self, Failure> {
        let how = arguments.how();
        let a = LoadedMesh::load(a, &how)?;
        let b = b.map(|path| LoadedMesh::load(path, &how)).transpose()?;
        mesh::refuse_unknown_object(&a, b.as_ref(), &how)?;
        if let Some(b) = &b {
            mesh::point_out_units([&a, b].map(|mesh| (mesh.size(), &*mesh.path)));
        }
        Ok(Self { arguments, backend, words, mode, is_exact, a, b })
    }

    /// Returns the meshes; the second is the first if there is only one.
    pub(crate) fn meshes(&self) -> [&LoadedMesh; 2] {
        [&self.a, self.b.as_ref().unwrap_or(&self.a)]
    }

    /// Returns what is queried.
    #[inline]
    pub(crate) fn shapes(&self) -> [Shape<'_>; 2] {
        self.meshes().map(LoadedMesh::shape)
    }

    /// Asks one question.
    pub(crate) fn ask<A>(&self, ask: impl Fn(&mut Querier) -> Result<A, QueryError>) -> Result<A, Failure> {
        ask(&mut Querier::with_backend(self.backend))
            .map_err(|error| mesh::blame(&self.a, self.b.as_ref(), error))
    }

    /// Tells one answer, which is `text` for a person.
    pub(crate) fn tell_one(&self, answer: &impl Answer, text: &str) -> Result<(), Failure> {
        if !self.arguments.run.json {
            return console::text(text);
        }
        console::json(&Record::of(self.words[0], &0).with(answer.json()))
    }

    /// Asks about all files of questions and tells the answers as the arguments say.
    pub(crate) fn ask_files<T: Sync, A: Answer + Clone + Send>(
        &self,
        files: &[(String, Vec<T>)],
        ask: impl Fn(&mut Querier, &T) -> Result<A, QueryError> + Sync,
    ) -> Result<(), Failure> {
        for mesh in std::iter::once(&self.a).chain(&self.b) {
            mesh.check()?;
        }
        let AskingArguments { run: limits, bench, .. } = self.arguments;
        for (stem, questions) in files {
            let run = Run::new(questions, &ask, self.backend, limits);
            let run = run.map_err(|error| mesh::blame(&self.a, self.b.as_ref(), error))?;
            if let Some(out) = self.arguments.raw_file(stem) {
                run.write_raw(&out)?;
            }
            if *bench {
                console::json(&self.bench(stem, &run))?;
            } else {
                run.tell(self.words, Some(&**stem).filter(|_| files.len() > 1), limits.json)?;
            }
        }
        Ok(())
    }

    /// Returns the line of `--bench` for a file of questions, about one mesh or two: the fields that programs of this protocol
    /// share, and further ones.
    fn bench<A: Answer>(&self, stem: &str, run: &Run<A>) -> Record {
        let (mesh_a, mesh_b) = (&self.a, self.b.as_ref());
        let (bytes_a, stored_a) = mesh_a.bytes_and_stored();
        let (bytes_b, stored_b) = mesh_b.map_or((0, 0), LoadedMesh::bytes_and_stored);
        record! {
            peer: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            mode: self.mode,
            poses: stem,
            tris_a: mesh_a.triangles(),
            build_a_s: mesh_a.build_seconds(),
            api_bytes_per_tri_a: bytes_a as f64 / stored_a as f64,
        }
        .with(mesh_b.map(|mesh_b| {
            record! {
                tris_b: mesh_b.triangles(),
                build_b_s: mesh_b.build_seconds(),
                api_bytes_per_tri_b: bytes_b as f64 / stored_b as f64,
            }
        }))
        .with(run.bench(self.backend, self.is_exact))
        .with(record! {
            // Not measured: a query needs the bytes of the files, which `api_bytes_per_tri_a` and `_b` give.
            rss_bytes_per_tri: -1.0,
            profile: of_both(mesh_a, mesh_b, |object| object.profile().name()),
            triangle_encoding: of_both(mesh_a, mesh_b, |object| object.triangle_encoding().name()),
            file_bytes_per_tri: (bytes_a + bytes_b) as f64 / (stored_a + stored_b) as f64,
        })
    }
}

/// Returns all that a distance has.
pub(crate) fn distance_json(of: &Distance) -> Record {
    record! {
        distance: of.distance, lower: of.lower, upper: of.upper, point_a: of.point_a, point_b: of.point_b,
        object_a: of.object_a, triangle_a: of.triangle_a, object_b: of.object_b, triangle_b: of.triangle_b,
    }
}

/// The options of a run of questions. A frame of a scene is one question.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// The number of threads: they share the queries of a file, or the pairs of each frame of a scene
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) jobs: u16,
    #[command(flatten)]
    pub(crate) layout: LayoutArguments,
    /// Stop after this many seconds, for each file of queries
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) budget: Option<f64>,
    /// Untimed queries before the timed ones, taken from the end of the file
    #[arg(long, value_name = "N", default_value = "3", value_parser = whole::<usize>, allow_negative_numbers = true)]
    pub(crate) warm: usize,
    /// Run only the first N queries of each file; 0 runs all
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole::<usize>, allow_negative_numbers = true)]
    pub(crate) limit: usize,
    /// Print one JSON object per query, with everything that the result has
    #[arg(long)]
    pub(crate) json: bool,
}

/// The options that only files of questions need. An argument that asks a single question excludes them.
pub(crate) const OF_FILES: [&str; 6] = ["jobs", "out", "budget", "warm", "limit", "bench"];

/// The options of commands that ask about one mesh or two.
#[derive(Debug, Args)]
pub(crate) struct AskingArguments {
    #[command(flatten)]
    pub(crate) run: RunArguments,
    /// Query only the object of this name, in each mesh that has one
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Write raw results and times to this file; %s stands for the name of the file of queries
    #[arg(long, value_name = "raw_%s.txt")]
    pub(crate) out: Option<String>,
    /// How the system reads .cbvh files from the disk
    #[arg(long, value_name = "HOW", default_value = "usual", value_parser = read_ahead())]
    read_ahead: ReadAhead,
    /// Print one JSON object per file, with the times of its queries, and no results
    #[arg(long, conflicts_with = "json")]
    bench: bool,
}

impl AskingArguments {
    /// Refuses what only files of questions need.
    pub(crate) fn require_no_files(&self) -> Result<(), Failure> {
        if self.bench || self.out.is_some() {
            return Err(Failure::usage("--bench and --out require a file of queries"));
        }
        Ok(())
    }

    /// Returns the file for the raw results of a file of queries, if they are to be written.
    fn raw_file(&self, stem: &str) -> Option<PathBuf> {
        self.out.as_ref().map(|out| out.replacen("%s", stem, 1).into())
    }

    /// Returns how meshes are prepared.
    pub(crate) fn how(&self) -> How<'_> {
        let (layout, object) = (&self.run.layout, self.object.as_deref());
        How { layout, object, read_ahead: self.read_ahead }
    }
}

/// Parses how the system reads a file from the disk.
fn read_ahead() -> impl TypedValueParser<Value = ReadAhead> {
    let value = |name, help| PossibleValue::new(name).help(help);
    let values = [
        value("usual", "As the system chooses: some pages around each page that is touched"),
        value("sparse", "Only the pages that queries touch"),
        value("whole", "The whole file, in the background"),
    ];
    PossibleValuesParser::new(values).map(|name| match &*name {
        "sparse" => ReadAhead::Sparse,
        "whole" => ReadAhead::Whole,
        _ => ReadAhead::Usual,
    })
}

/// Returns the quantile of sorted values at a fraction from 0 to 1, by the rule of the peers' protocol; 0 if there are
/// none.
pub(crate) fn quantile(sorted: &[u64], fraction: f64) -> u64 {
    let index = (fraction * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_follow_the_protocol() {
        let times: Vec<u64> = (0..10).collect();
        let found = [0.1, 0.5, 0.9, 1.0].map(|fraction| quantile(&times, fraction));
        assert_eq!(found, [1, 5, 9, 9]);
        assert_eq!(quantile(&[], 0.5), 0);
    }
}
