//! The arguments of `cbvh scene`.

use crate::options::{LayoutArguments, not_negative, threads, whole};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh scene cell.scene frames.txt --mode collide
  cbvh scene cell.scene frames.txt --mode pairs --list
  cbvh scene cell.scene frames.txt --mode within --within 0.05 --jobs 4 --json
  cbvh scene factory.cbvh --mode pairs --list

SCENE is a file that cbvh bake --scene made, all of whose instances move, or, without FRAMES, stand where the file says. Or it is a text file, one item per line; # starts a comment. File names are relative to it:

  mesh NAME FILE              a mesh file, which is baked in memory first, or a .cbvh file
  instance NAME MESH POSE     a mesh in the world; POSE has 12 numbers, the rows of the 3 by 4 matrix [R | t]
  moving NAME...              the instances that frames move, in the order of their poses
  allow NAME NAME             two instances that may touch, and are never asked about

Each line of FRAMES has 12 numbers for each moving instance. All pairs of which at least one instance moves are asked \
about, and of a baked scene all pairs whose groups meet. \
In a scene without moving instances there is one frame, without FRAMES, and all pairs are asked about.

On a terminal, a summary is printed. Otherwise, and with --json, one JSON object. --list prints the pairs of each frame. \
--out writes one line per frame: 0 or 1 (collide), a number of pairs (pairs, within) or a distance, then nanoseconds, \
which include moving the instances. answers_xxh3 is the same for every --isa and --jobs. It is null if --budget cut the \
run short.";

/// What `scene` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct SceneArguments {
    /// The meshes, where they are, and what moves
    pub(super) scene: PathBuf,
    /// The poses of the moving instances, one frame per line
    pub(super) frames: Option<PathBuf>,
    /// The question
    #[arg(long, value_enum, default_value = "collide")]
    pub(super) mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) within: Option<f64>,
    /// The number of threads that share the pairs of a frame
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads, allow_negative_numbers = true)]
    pub(super) jobs: u16,
    /// The instruction set: auto, scalar, avx2 or avx512. auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(super) isa: String,
    #[command(flatten)]
    pub(super) layout: LayoutArguments,
    /// Write raw answers and times to this file
    #[arg(long, value_name = "raw.txt")]
    pub(super) out: Option<PathBuf>,
    /// Stop after this many seconds
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) budget: Option<f64>,
    /// Untimed frames before the timed ones, taken from the end
    #[arg(long, value_name = "N", default_value = "3", value_parser = whole::<usize>, allow_negative_numbers = true)]
    pub(super) warm: usize,
    /// Ask only the first N frames; 0 asks all
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole::<usize>, allow_negative_numbers = true)]
    pub(super) limit: usize,
    /// Print the pairs of each frame, with their names
    #[arg(long, conflicts_with = "json")]
    pub(super) list: bool,
    /// Print one JSON object, as always when standard output is not a terminal
    #[arg(long)]
    pub(super) json: bool,
}

/// A question about all pairs of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// Does any pair touch?
    Collide,
    /// Which pairs touch?
    Pairs,
    /// How far apart is the nearest pair?
    Distance,
    /// Which pairs are at most --within apart?
    Within,
}

impl Mode {
    /// Returns the name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Pairs => "pairs",
            Self::Distance => "distance",
            Self::Within => "within",
        }
    }
}
