//! The command `cbvh`: bakes meshes into `.cbvh` files, looks into them, checks them and queries them.
//!
//! Each command is a module with a function `run`, which prints through `output` and returns what went
//! wrong; this file turns that into one line and an exit code. What scripts may rely on is in
//! `cbvh --help` and in the help of each command.

mod arguments;
mod bake;
mod dump;
mod error;
mod from_disk;
mod manifest;
mod opened;
mod output;
mod query;
mod report;
mod resident;
mod signals;
mod validate;
mod verify;

use arguments::{Arguments, Command};
use clap::Parser;
use error::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let result =
        Arguments::try_parse().map_err(Failure::from_clap).and_then(|arguments| match arguments.command {
            Command::Bake(arguments) => bake::run(&arguments),
            Command::Dump(arguments) => dump::run(&arguments),
            Command::Validate(arguments) => validate::run(&arguments),
            Command::Verify(arguments) => verify::run(&arguments),
            Command::Query(arguments) => query::run(&arguments),
            Command::Report(arguments) => report::run(&arguments),
        });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}
