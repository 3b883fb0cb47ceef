//! The command line.

use crate::search::Kind;
use bvh_query::Backend;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Measures cbvh itself. What users ask is in `cbvh report`.
#[derive(Debug, Parser)]
#[command(name = "cbvh-lab", version, after_help = "bvh-query/lab/README.md says how long each takes.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) experiment: Experiment,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Experiment {
    /// Ask cbvh and other libraries hard questions with known answers
    Hard(HardArguments),
    /// Measure how time grows with the number of triangles, on several threads, and along paths
    Scaling(ScalingArguments),
    /// Measure layouts with cold caches, and count how many pairs of nodes their trees let through in vain
    Layouts(LayoutArguments),
    /// Search for wrong answers for hours: pairs near the boundary of contact, and forged files
    Search(SearchArguments),
}

/// Writes hard.md, hard.csv and hard.json. Each case is a pair of small meshes in a pose with an exactly known answer; it is
/// asked in every profile, in both lossless triangle encodings, on every backend of this CPU, and in a fifth of these with
/// corners, triangles and sides in other orders. A wrong answer of cbvh ends with exit code 1, after the files are written.
#[derive(Debug, Args)]
pub(crate) struct HardArguments {
    /// The folder to write to; made if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// A build of programs that ask other libraries: DIR/bin/peer_*. They take two OBJ files, a pose file, --mode, --bv
    /// and --out as `cbvh query` does. Their wrong answers are listed and do not change the exit code
    #[arg(long, value_name = "DIR")]
    pub(crate) peers: Option<PathBuf>,
    /// Ask only about every N-th case
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=250))]
    pub(crate) every: u16,
}

/// Writes scaling.csv, scaling.json, scaling.svg and scaling.md. A closed ball with bumps is made of about 1,000, 3,000, 10,000
/// and so on up to --largest triangles, baked with default options, and asked against itself in random poses with gaps of
/// 1e-6, 1 % and 5 % of its diagonal. Batches and paths follow with the largest ball of at most 300,000 triangles. Answers
/// that must agree and do not end with exit code 1, after the files are written.
#[derive(Debug, Args)]
pub(crate) struct ScalingArguments {
    /// The folder to write to; made if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The largest number of triangles of a ball, from 1000 to 100000000
    #[arg(long, value_name = "N", default_value = "10000000",
          value_parser = clap::value_parser!(u64).range(1000..=100_000_000))]
    pub(crate) largest: u64,
    /// Poses per gap
    #[arg(long, value_name = "N", default_value = "100", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub(crate) poses: u16,
    /// Poses per path
    #[arg(long, value_name = "N", default_value = "1000", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub(crate) path_poses: u16,
    /// Rounds in which all sizes take turns
    #[arg(long, value_name = "N", default_value = "7", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(crate) rounds: u16,
    /// Backend: scalar, avx2 or avx512 [default: the fastest one of this CPU, unless CBVH_ISA names one]
    #[arg(long, value_name = "ISA", value_parser = backend)]
    pub(crate) isa: Option<Backend>,
}

/// Writes layouts.csv, layouts.json and layouts.md. Each pair is baked in every profile with both lossless triangle encodings
/// and asked for contact and distance after the caches were swept. Both trees are also walked in memory to the end, which
/// tells the share of node pairs that tight bounds would have stopped.
#[derive(Debug, Args)]
pub(crate) struct LayoutArguments {
    /// The list of pairs, one per line: NAME A B [POSES[,POSES...]], as `cbvh report` takes it
    pub(crate) pairs: PathBuf,
    /// The folder to write to; made if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The folder of the meshes [default: that of PAIRS]
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Option<PathBuf>,
    /// Files of poses for each pair, besides those in PAIRS; %s stands for the pair's name
    #[arg(long, value_name = "FILE[,FILE...]")]
    pub(crate) poses: Option<String>,
    /// Poses per pair, spread evenly over all
    #[arg(long, value_name = "N", default_value = "20", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub(crate) limit: u16,
    /// Mebibytes to read through before a query [default: 5/4 of the largest cache]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=65_536))]
    pub(crate) sweep: Option<u64>,
    /// Backend: scalar, avx2 or avx512 [default: the fastest one of this CPU, unless CBVH_ISA names one]
    #[arg(long, value_name = "ISA", value_parser = backend)]
    pub(crate) isa: Option<Backend>,
}

/// Goes on where the record ends, and saves it at least once a minute, so that it may be killed at any time. Everything in a
/// round follows from its kind and number. A wrong answer, a panic and a round of minutes are findings: they are shrunk,
/// kept in the record, and end with exit code 1 at the end.
#[derive(Debug, Args)]
pub(crate) struct SearchArguments {
    /// The record, a JSON file; made if it does not exist
    #[arg(long, value_name = "FILE", default_value = "target/lab/search.json")]
    pub(crate) record: PathBuf,
    /// The time to search
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) hours: f64,
    /// The kinds of rounds, which share the time
    #[arg(long, value_name = "KIND[,KIND...]", value_delimiter = ',', default_values = ["pairs", "hostile", "probes", "motions"])]
    pub(crate) kinds: Vec<Kind>,
    /// The number of threads, up to 256
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) threads: u16,
    /// The largest number of rounds of this run [default: as many as the time allows]
    #[arg(long, value_name = "N")]
    pub(crate) rounds: Option<u64>,
    /// Run only this round of each kind again, without a record, and print what it finds
    #[arg(long, value_name = "ROUND")]
    pub(crate) again: Option<u64>,
}

fn backend(name: &str) -> Result<Backend, String> {
    Backend::from_name(name).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
