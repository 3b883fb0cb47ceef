//! The command `cbvh`: bakes meshes into `.cbvh` files, shows what files contain, checks them and queries them.
//!
//! Each folder is what a person does with the command: `bake` one output, or many `assets`; `dump`; `check`; `query`;
//! `motion`; `probe`; `scene`; `report`. They stand on `asking` (what commands that ask questions have in common), `options` (what
//! several commands accept), `process` (memory and signals) and `console` (what is printed, and how a command ends). Imports
//! lead from the former to the latter only. What scripts may rely on is in `cbvh --help` and in the help of each command.

mod arguments;
mod asking;
mod assets;
mod bake;
mod check;
mod console;
mod dump;
mod motion;
mod options;
mod probe;
mod process;
mod query;
mod report;
mod scene;

use arguments::{Arguments, Command};
use std::process::ExitCode;

fn main() -> ExitCode {
    let result = Arguments::of_process().and_then(|arguments| match arguments.command {
        Command::Bake(arguments) if assets::are_many(&arguments) => assets::run(&arguments),
        Command::Bake(arguments) => bake::run(&arguments),
        Command::Dump(arguments) => dump::run(&arguments),
        Command::Validate(arguments) => check::validate(&arguments),
        Command::Verify(arguments) => check::verify(&arguments),
        Command::Query(arguments) => query::run(&arguments),
        Command::Motion(arguments) => motion::run(&arguments),
        Command::Probe(arguments) => probe::run(&arguments),
        Command::Scene(arguments) => scene::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}
