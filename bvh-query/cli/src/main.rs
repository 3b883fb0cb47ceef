//! The command `cbvh`: bakes meshes into `.cbvh` files, shows what files contain, checks them and queries them.
//!
//! Each of these modules does one thing that a person does with the command: `bake` one output, or many `assets`;
//! `dump`; `check`; `query`; `motion`; `probe`; `scene`; `robot`; `clash`; `view`; `suite`; `report`. They import these modules, which do not import them:
//! `asking` (the common part of commands that run queries), `options` (options of several commands), `process`
//! (memory, mapped files and signals) and `console` (output and exit codes). `cbvh --help` and the help of each
//! command state what scripts may rely on.

mod asking;
mod assets;
mod bake;
mod check;
mod clash;
mod console;
mod dump;
#[cfg(test)]
mod generated;
mod motion;
mod open_edges;
mod options;
mod probe;
mod process;
mod query;
mod report;
mod robot;
mod scene;
mod suite;
mod view;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use console::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::try_parse().map_err(|error| failure(&error));
    let result = arguments.and_then(|arguments| match arguments.command {
        Command::Bake(arguments) if bake::are_many(&arguments) => assets::run(&arguments),
        Command::Bake(arguments) => bake::run(&arguments),
        Command::Dump(arguments) => dump::run(&arguments),
        Command::Validate(arguments) => check::validate(&arguments),
        Command::Verify(arguments) => check::verify(&arguments),
        Command::Query(arguments) => query::run(&arguments),
        Command::Motion(arguments) => motion::run(&arguments),
        Command::Probe(arguments) => probe::run(&arguments),
        Command::Scene(arguments) => scene::run(&arguments),
        Command::Robot(arguments) => robot::run(&arguments),
        Command::Clash(arguments) => clash::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Suite(arguments) => suite::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 wrong usage; 2 the system refused (a missing file, a full disk, a missing permission); 3 an input \
is invalid; 4 a limit was reached; 5 clash --fail-on found one. Each error is one line on standard error. The environment variable CBVH_ISA=scalar, \
avx2, avx512, neon or simd128 selects the instruction set of queries.";

/// Exact collision and distance queries between triangle meshes.
#[derive(Debug, Parser)]
#[command(name = "cbvh", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Bake meshes into a .cbvh file
    Bake(bake::BakeArguments),
    /// Show what a .cbvh file contains
    Dump(dump::DumpArguments),
    /// Check the structure and the checksums of a whole .cbvh file
    Validate(check::ValidateArguments),
    /// Check that a .cbvh file has the triangles of a mesh and that every bound contains its triangles
    Verify(check::VerifyArguments),
    /// Check whether and where two meshes touch, how far apart they are, and whether one is inside the other
    Query(query::QueryArguments),
    /// Check whether a motion between two poses is free at every moment, and find when it first touches
    Motion(motion::MotionArguments),
    /// Compute how far points are from a mesh and which of them are inside it, and find what rays and segments hit
    Probe(probe::ProbeArguments),
    /// Find which of many placed meshes touch, or how far apart they are
    Scene(scene::SceneArguments),
    /// Check a robot by the values of its joints: whether it touches itself or obstacles, how near it comes, and which motions are free
    Robot(robot::RobotArguments),
    /// Find the parts of an assembly that touch, overlap, contain or come near each other, and how deep or how near
    Clash(clash::ClashArguments),
    /// Write a page that shows meshes, a motion or a scene in a browser, and runs queries there
    View(view::ViewArguments),
    /// Run the queries of the public suite (spec/suite), one line in and one line out
    Suite(suite::SuiteArguments),
    /// Measure speed against error on your own meshes: for each layout, or for ways to check motions
    Report(report::ReportArguments),
}

/// Prints help and the version; turns everything else into one line.
fn failure(error: &clap::Error) -> Failure {
    let text = error.render().to_string();
    if !error.use_stderr() {
        return console::text(&text).err().unwrap_or(Failure::Nothing);
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return Failure::Usage(
            "expected a command: bake, dump, validate, verify, query, motion, probe, scene, robot, clash, view, suite or report (see cbvh --help)"
                .into(),
        );
    }
    // The usage that follows takes several lines.
    let said = text.split("\n\nUsage:").next().unwrap_or(&text);
    let said = said.split("\n\nFor more").next().unwrap_or(said);
    let said = said.strip_prefix("error: ").unwrap_or(said);
    let paragraphs: Vec<String> =
        said.split("\n\n").map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    Failure::usage(paragraphs.join("; "))
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
