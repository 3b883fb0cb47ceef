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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
