//! The command line.

use crate::search::Kind;
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
    /// Search for wrong answers for hours: pairs near the boundary of contact, and forged files
    Search(SearchArguments),
}

/// Writes hard.md and hard.json. Each case is a pair of small meshes in a pose with an exactly known answer; it is
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
