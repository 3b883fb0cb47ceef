//! The arguments of `cbvh report`.

use clap::Args;
use std::path::PathBuf;

const REPORT_HELP: &str = "\
Examples:
  cbvh report pairs.txt --out report
  cbvh report pairs.txt --meshes meshes --poses poses/%s_d1.txt,poses/%s_d5.txt --out report
  cbvh report pairs.txt --motions --out report
  cbvh report pairs.txt --motions=edges/%s.txt --out report
  cbvh report pairs.txt --quick --out report

PAIRS is a text file with one pair of meshes per line: NAME A B [FILE[,FILE...]]; # starts a comment. Meshes are in any \
format that bake reads, or .cbvh files, whose triangles are baked again. FILEs have poses or, with --motions, motions, as \
query and motion read them. File names are relative to the list. For a pair without poses, 60 are made, always the same \
ones: overlapping, and with gaps of 1e-6, 0.5 %, 1 % and 5 % of A's diagonal. For a pair without motions, 60 are made, \
too: long ways, short ways, slides and turns on the spot.

The command writes report.html for people, report.svg with its plots, and report.csv and report.json with the same \
figures. If an answer is wrong, the exit code is 3 and the files are written nevertheless.

Without --motions, it bakes each pair in every profile with every encoding of triangles, and asks for contact and for \
distances with allowed errors of 0, 0.1 %, 1 % and 10 %. All answers are compared with those of dop14-f32.

With --motions, it bakes each pair as bake does without options, and asks about each motion in 16 ways: by 10, 30, 100, \
300, 1000, 3000 and 10000 equally spaced poses until one touches, in the order of time and in an order that is spread from \
the start, and by certified answers, for the first contact and for any. It tells how many of the certified contacts samples \
miss, how late they are with the others, and how long each way takes. A sample that touches where the motion is certified \
free is a wrong answer. Each way asks about all motions of a pair once, and again for as many of the rounds as fit into 10 seconds; \
report.csv has their number. A pair takes some minutes at most, unless one round of 10000 samples takes longer.

Queries run on one thread that is bound to one processor. On a machine that does other work the times include the \
effects of that work.";

/// What `report` takes.
#[derive(Debug, Args)]
#[command(after_help = REPORT_HELP)]
pub(crate) struct ReportArguments {
    /// The list of the pairs of meshes to report on
    pub(crate) pairs: PathBuf,
    /// The folder to write to; made if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The folder of the meshes [default: that of PAIRS]
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Option<PathBuf>,
    /// Files of poses for each pair, besides those in PAIRS; %s stands for the pair's name
    #[arg(long, value_name = "FILE[,FILE...]")]
    pub(crate) poses: Option<String>,
    /// Report on motions instead of layouts. FILEs are files of motions for each pair, besides those in PAIRS; %s stands for
    /// the pair's name
    #[arg(long, value_name = "FILE[,FILE...]", num_args = 0..=1, require_equals = true, conflicts_with = "poses")]
    pub(crate) motions: Option<Option<String>>,
    /// The largest number of poses or motions per pair, spread evenly over all; 0 asks all
    #[arg(long, value_name = "N", default_value = "100")]
    pub(crate) limit: usize,
    /// Rounds in which all layouts, or all ways to ask, take turns
    #[arg(long, value_name = "N", default_value = "7", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(crate) rounds: u16,
    /// Backend: auto, scalar, avx2 or avx512; auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// Ask only about ten poses or motions in two rounds: good for trying the command, too few to quote
    #[arg(long, conflicts_with_all = ["limit", "rounds"])]
    pub(crate) quick: bool,
}
