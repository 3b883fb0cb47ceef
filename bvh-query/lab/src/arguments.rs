//! The command line.

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
    /// Search for wrong answers for hours: pairs near the boundary of contact, and forged files
    Search(SearchArguments),
    /// Measure what the stages of a question about two meshes take, in ticks of the CPU's counter
    #[cfg(feature = "stages")]
    Stages(StagesArguments),
}

/// The search does the rounds that its record lacks. The number of a round determines everything in it. Each round adds
/// a line of JSON to the record, so the search may be killed at any time. A wrong answer, a panic, or a round that takes
/// minutes is a finding. Findings are shrunk and kept in the record. If there are any, the exit code is 1.
#[derive(Debug, Args)]
pub(crate) struct SearchArguments {
    /// The record; it is created if it does not exist
    #[arg(long, value_name = "FILE", default_value = "target/search.jsonl")]
    pub(crate) record: PathBuf,
    /// The time to search
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) hours: f64,
    /// The number of threads, up to 256
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) threads: u16,
    /// The largest number of rounds to do [default: as many as the time allows]
    #[arg(long, value_name = "N")]
    pub(crate) rounds: Option<usize>,
    /// Repeat this round, without a record, and print what it finds
    #[arg(long, value_name = "ROUND")]
    pub(crate) again: Option<u64>,
}

/// Every pose is asked once before anything is measured. Then each round asks all poses with the clock of the stages, and
/// all of them again without. The fastest time of each pose counts. The table has averages over all
/// poses: how often a stage was entered, its ticks without those of stages within it, and its share.
#[cfg(feature = "stages")]
#[derive(Debug, Args)]
pub(crate) struct StagesArguments {
    /// The file of A
    #[arg(value_name = "A.cbvh")]
    pub(crate) a: PathBuf,
    /// The file of B
    #[arg(value_name = "B.cbvh")]
    pub(crate) b: PathBuf,
    /// The poses of B, one per line: the 12 numbers of a 3 by 4 matrix, row by row
    #[arg(value_name = "POSES")]
    pub(crate) poses: PathBuf,
    /// The question
    #[arg(long, value_name = "QUESTION", default_value = "collide", value_parser = ["collide", "distance", "contacts"])]
    pub(crate) ask: String,
    /// The number of times in a row that a pose is asked; the first of several does not count
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,
    /// The number of rounds
    #[arg(long, value_name = "N", default_value = "20", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) rounds: u32,
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
