//! The command line as a whole. The arguments of each command are defined beside the command.

use crate::bake::BakeArguments;
use crate::check::{ValidateArguments, VerifyArguments};
use crate::console::{self, Failure};
use crate::dump::DumpArguments;
use crate::motion::MotionArguments;
use crate::probe::ProbeArguments;
use crate::query::QueryArguments;
use crate::report::ReportArguments;
use crate::scene::SceneArguments;
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 wrong usage; 2 the system refused (a missing file, a full disk, a missing permission); 3 an input \
is invalid; 4 a limit was reached. Each error is one line on standard error. The environment variable CBVH_ISA=scalar, \
avx2 or avx512 selects the instruction set of queries.";

/// Exact collision and distance queries between triangle meshes.
#[derive(Debug, Parser)]
#[command(name = "cbvh", version, after_help = EXIT_CODES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bake meshes into a .cbvh file
    Bake(BakeArguments),
    /// Show what a .cbvh file contains
    Dump(DumpArguments),
    /// Check the structure and the checksums of a whole .cbvh file
    Validate(ValidateArguments),
    /// Check that a .cbvh file has the triangles of a mesh and that every bound contains its triangles
    Verify(VerifyArguments),
    /// Ask whether two meshes touch, where, how far apart they are, and whether one is inside the other
    Query(QueryArguments),
    /// Ask whether the way between two poses is free at every moment, and where it ends
    Motion(MotionArguments),
    /// Ask how far a mesh is from points, which of them are inside, and what rays and segments hit
    Probe(ProbeArguments),
    /// Ask a scene of many placed meshes which of them touch, or how far apart they are
    Scene(SceneArguments),
    /// Measure speed against error on some meshes: of each layout, or of samples and certified answers about motions
    Report(ReportArguments),
}

impl Arguments {
    /// Parses the command line of this process.
    pub(crate) fn of_process() -> Result<Self, Failure> {
        Self::try_parse().map_err(|error| failure(&error))
    }
}

/// Prints help and the version; turns everything else into one line.
fn failure(error: &clap::Error) -> Failure {
    let text = error.render().to_string();
    if !error.use_stderr() {
        return match console::text(&text) {
            Ok(()) => Failure::Nothing,
            Err(failure) => failure,
        };
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return Failure::Usage(
            "expected a command: bake, dump, validate, verify, query, motion, probe, scene or report (see cbvh --help)"
                .into(),
        );
    }
    // The usage that follows takes several lines.
    let said = text.split("\n\nUsage:").next().unwrap_or(&text);
    let said = said.split("\n\nFor more").next().unwrap_or(said);
    let said = said.strip_prefix("error: ").unwrap_or(said);
    let paragraphs: Vec<String> =
        said.split("\n\n").map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    Failure::Usage(format!("{} (see --help)", paragraphs.join("; ")))
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
