//! The laboratory: measures cbvh itself, for those who develop it. What users ask is in `cbvh report`.
//!
//! Each experiment is a module with a function `run` that writes its files and returns a summary. `README.md` says what
//! each measures and how long it takes.

mod arguments;
/// What the tests of queries share: oracles, and all questions about a file of any bytes.
#[path = "../../tests/common/mod.rs"]
mod common;
/// The comparison of answers with the exact oracle, as the tests make it.
#[path = "../../tests/answers/exact"]
#[allow(dead_code, reason = "the search asks about poses, and the tests walk to the boundary")]
mod exact {
    pub(crate) mod ask;
}
mod output;
mod search;

use arguments::{Arguments, Experiment};
use clap::Parser;
use std::process::ExitCode;

/// Why an experiment failed, as one line.
type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    let result = match &Arguments::parse().experiment {
        Experiment::Search(arguments) => search::run(arguments),
    };
    match result.and_then(|summary| output::print(&summary)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            output::tell(&format!("error: {failure}"));
            ExitCode::FAILURE
        }
    }
}
