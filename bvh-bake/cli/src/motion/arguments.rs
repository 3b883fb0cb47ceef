//! The arguments of `cbvh motion`.

use crate::asking::AskingArguments;
use crate::options::{not_negative, positive};
use clap::Args;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh motion room.cbvh robot.cbvh edges.txt --clearance 0.01
  cbvh motion a.obj b.obj edges.txt --out raw.txt --json
  cbvh motion a.cbvh b.cbvh --motion \"1 0 0 9  0 1 0 0  0 0 1 0   1 0 0 0  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a file of motions has 24 numbers: the pose of B in the frame of A at the start and at the end, each the rows of \
a 3 by 4 matrix. The origin of B's frame moves on a line, and B turns about one axis the shorter way, both at a constant \
rate, from time 0 to time 1. # starts a comment.

An answer is certain at every moment: free, a hit with the time until which the way is surely free and a time at which the \
meshes touch (or are at most --clearance apart), or near, if B comes so near that neither can be told within --tolerance.

On a terminal, the answers are printed one per line, and the timing after them. Otherwise, and with --json, one JSON object \
is printed per file: the fields of cbvh query, hits and near. --out writes one line per motion: free NS, hit FREE_UNTIL \
TOUCHING_AT NS, or near FREE_UNTIL AT NS. answers_xxh3 is the same for every --isa and --jobs.";

/// What `motion` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct MotionArguments {
    /// The first mesh: a .cbvh file, or a mesh file that is baked in memory first
    pub(super) a: PathBuf,
    /// The second mesh, which moves
    pub(super) b: PathBuf,
    /// Files of motions, separated by commas
    #[arg(value_name = "MOTIONS[,MOTIONS...]", required_unless_present = "one", conflicts_with = "one")]
    pub(super) motions: Option<String>,
    /// Meshes that come as near as this count as a hit, in mesh units
    #[arg(long, value_name = "C", default_value = "0", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) clearance: f64,
    /// How near B may come to a hit without a certain answer, in mesh units [default: 1e-6 of the larger diagonal]
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    pub(super) tolerance: Option<f64>,
    #[command(flatten)]
    pub(super) asking: AskingArguments,
    /// Ask about one motion, given as 24 numbers, and print the answer for a person
    #[arg(id = "one", long = "motion", value_name = "24 NUMBERS", allow_hyphen_values = true)]
    pub(super) motion: Option<String>,
    /// With --motion: write the closest triangles at a hit and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    pub(super) witness: Option<PathBuf>,
}
