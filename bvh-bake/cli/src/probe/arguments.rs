//! The arguments of `cbvh probe`.

use crate::asking::AskingArguments;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh probe part.cbvh points.txt --mode side
  cbvh probe part.obj near.txt,far.txt --mode closest --out raw_%s.txt
  cbvh probe room.cbvh --mode ray --probe \"0 0 1.5  1 0 0\"

With --mode closest and side, each line of FILE is a point, 3 numbers. With --mode ray it is the origin and the direction of \
a ray, 6 numbers; the direction may have any length. With --mode segment it is both ends of a segment, 6 numbers. All are in \
the frame of the mesh, in mesh units. # starts a comment.

closest is the distance to the surface, whether the point is inside or outside. side is defined for meshes that are closed \
and consistently oriented; for others it is undefined, except on the surface. A ray or a segment that only touches an edge or \
a corner hits the mesh.

On a terminal, the answers are printed one per line, and the timing after them. Otherwise, and with --json, one JSON object \
is printed per file: the fields of cbvh query for one mesh, where poses is the name of the file. positives counts points on \
the mesh with --mode closest, points inside it with side, rays that hit it with ray, and segments that meet it with segment. \
--out writes one line per question: with --mode closest the distance; with side 1 inside, 0 on the mesh, -1 outside, 2 \
undefined; with ray the parameter of the first hit in units of the direction, or -1; with segment 1 if it meets the mesh, 0 \
if not; then nanoseconds. %s stands for the name of the file. answers_xxh3 is the same for every --isa and --jobs. It is null \
if --budget cut the run short.";

/// What `probe` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ProbeArguments {
    /// The mesh: a .cbvh file, or a mesh file that is baked in memory first
    pub(super) a: PathBuf,
    /// Files of points, rays or segments, separated by commas
    #[arg(value_name = "FILE[,FILE...]", required_unless_present = "one", conflicts_with = "one")]
    pub(super) files: Option<String>,
    /// The question
    #[arg(long, value_enum, default_value = "closest")]
    pub(super) mode: Mode,
    #[command(flatten)]
    pub(super) asking: AskingArguments,
    /// Ask about one point, ray or segment, given as 3 or 6 numbers, and print the answer for a person
    #[arg(id = "one", long = "probe", value_name = "3 OR 6 NUMBERS", allow_hyphen_values = true)]
    pub(super) probe: Option<String>,
}

/// A question about one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// How far is the mesh from a point?
    Closest,
    /// Is a point inside the mesh, on it or outside?
    Side,
    /// Where does a ray first hit the mesh?
    Ray,
    /// Does a segment meet the mesh?
    Segment,
}

impl Mode {
    /// Returns the name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Closest => "closest",
            Self::Side => "side",
            Self::Ray => "ray",
            Self::Segment => "segment",
        }
    }
}
