//! The arguments of `cbvh query`.

use crate::asking::AskingArguments;
use crate::options::not_negative;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh query a.cbvh b.cbvh poses.txt --mode collide
  cbvh query a.obj b.obj near.txt,far.txt --mode distance --out raw_%s.txt
  cbvh query bin.cbvh part.cbvh poses.txt --mode relation
  cbvh query a.cbvh b.cbvh --mode distance --pose \"1 0 0 2  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a pose file has 12 numbers: the rows of the 3 by 4 matrix that places B in the frame of A. The first three \
numbers of a row are the rotation and the fourth is the translation, in mesh units. # starts a comment.

collide is about surfaces: a mesh that is inside another without touching it does not collide. relation tells: 0 touching, \
1 apart, 2 A inside B, 3 B inside A, 4 mixed (some parts of a mesh are inside the other and some are not, or some of each \
mesh are), 5 undefined, because a mesh that is not closed would have to contain something. positives counts all but 1 and 5.

On a terminal, the answers are printed one per line, and the timing after them. Otherwise, and with --json, one JSON \
object is printed per pose file. --out writes one line per query: 0 or 1, a count, a distance, or the number of a \
relation, then nanoseconds; %s stands for the name of the pose file. answers_xxh3 is the same for every --isa and \
--jobs. It is null if --budget cut the run short, or if --rel-err or --abs-err leave a choice of answers.

With --cold, the object also has the means over the queries of open_ns_mean, the time of opening both files; \
disk_faults_mean, the page faults that waited for the disk; read_bytes_mean, the bytes read from the disk; \
resident_bytes_mean, the bytes of both files in memory after the answer, in whole pages; and touched_bytes_mean, the \
bytes that the same query touches when it is asked again, in whole pages. A figure that the system does not provide is \
null.";

/// What `query` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct QueryArguments {
    /// The first mesh: a .cbvh file, or a mesh file that is baked in memory first
    pub(super) a: PathBuf,
    /// The second mesh, which the poses place
    pub(super) b: PathBuf,
    /// Pose files, separated by commas
    #[arg(value_name = "POSES[,POSES...]", required_unless_present = "one", conflicts_with = "one")]
    pub(super) poses: Option<String>,
    /// The question
    #[arg(long, value_enum, default_value = "collide")]
    pub(super) mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) within: Option<f64>,
    /// With --mode distance: the answer may exceed the least distance by this fraction of it
    #[arg(long, value_name = "R", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) rel_err: Option<f64>,
    /// With --mode distance: the answer may exceed the least distance by this length, in mesh units
    #[arg(long, value_name = "E", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) abs_err: Option<f64>,
    #[command(flatten)]
    pub(super) asking: AskingArguments,
    /// Time queries of files evicted from the page cache: the system is asked to evict both files before each query, and
    /// the time includes opening them
    #[arg(long, conflicts_with_all = ["one", "jobs", "warm"])]
    pub(super) cold: bool,
    /// Ask about one pose, given as 12 numbers, and print the answer for a person
    #[arg(id = "one", long = "pose", value_name = "12 NUMBERS", allow_hyphen_values = true)]
    pub(super) pose: Option<String>,
    /// With --pose and --mode distance: write both closest triangles and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    pub(super) witness: Option<PathBuf>,
}

/// A question about two meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// Do they touch? This is about surfaces: a mesh inside another does not touch it, and relation tells
    Collide,
    /// How many pairs of triangles touch?
    Contacts,
    /// How far apart are they?
    Distance,
    /// Are they at most --within apart?
    Within,
    /// Do they touch and, if not, is one inside the other?
    Relation,
}

impl Mode {
    /// Returns the name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Contacts => "contacts",
            Self::Distance => "distance",
            Self::Within => "within",
            Self::Relation => "relation",
        }
    }
}
