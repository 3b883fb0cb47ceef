//! The command line.

use crate::search::Kind;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Experiments for developers of cbvh. To measure your own meshes, use `cbvh report`.
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

/// Writes hard.md and hard.json. Each case is a pair of small meshes in a pose whose answer is known exactly. It is
/// asked in every profile, in both lossless triangle encodings and on every backend of this CPU. In a fifth of these,
/// it is also asked with corners, triangles and sides in other orders. If an answer of cbvh is wrong, the exit code is
/// 1; the files are still written.
#[derive(Debug, Args)]
pub(crate) struct HardArguments {
    /// The folder to write to; it is created if it does not exist
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

/// The search continues from its record. It saves the record at least once a minute, so it may be killed at any time.
/// The kind and number of a round determine everything in it. A wrong answer, a panic, or a round that takes minutes is
/// a finding. Findings are shrunk and kept in the record. If there are any, the exit code is 1.
#[derive(Debug, Args)]
pub(crate) struct SearchArguments {
    /// The record, a JSON file; it is created if it does not exist
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
