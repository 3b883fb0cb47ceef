//! The command line.

use bvh_bake::Effort;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Exact collision and distance queries between triangle meshes.
#[derive(Debug, Parser)]
#[command(name = "cbvh", version, after_help = EXIT_CODES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 usage; 2 the system (missing file, disk full, permission); 3 an input is invalid; 4 a limit \
was reached. Errors are one line on standard error. CBVH_ISA=scalar|avx2|avx512 forces a backend for queries.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bake meshes into a .cbvh file
    Bake(BakeArguments),
    /// Show what is in a .cbvh file
    Dump(DumpArguments),
    /// Check a .cbvh file: structure and checksums, the whole file
    Validate(ValidateArguments),
    /// Check that a file's triangles are the mesh's and that every bound contains its triangles
    Verify(VerifyArguments),
    /// Ask two meshes whether they touch, where, and how far apart they are
    Query(QueryArguments),
    /// Measure speed against error over all layouts or against size, or ask hard cases with known answers
    Report(ReportArguments),
}

const BAKE_HELP: &str = "\
Examples:
  cbvh bake rock.obj -o rock.cbvh
  cbvh bake part.stl -o part.cbvh --triangles quantized --max-error 0.01
  cbvh bake arm.obj hand.ply -o robot.cbvh --split-objects --json

Several inputs are baked as one mesh: triangle ids run on from file to file. The output appears whole or not at \
all. It is left alone if it is up to date: same inputs, same options, same version, undamaged; --force bakes it all \
the same.

--max-memory: the whole process stays within SIZE, whatever the size of the mesh. OBJ, STL and PLY are read piece by \
piece, and up to 200 bytes a triangle go to scratch files, which have no names and vanish however the process ends. \
The output is the same to the byte. A SIZE that is too small for any way is refused with exit code 4.

On a terminal a line on standard error shows the stage, how much of it is done, triangles a second, bytes spilled to \
scratch files, the time so far and about how much is left. --json prints one object on standard output, and, unless \
-q is given, on standard error an object a line as stages end: read, prepare, build, assemble, prove, write. These \
lines have stage, seconds, triangles, triangles_per_second, bytes_read, bytes_written, spilled_bytes (those written \
to scratch files), resident_bytes and peak_rss_bytes; seconds and bytes add up to stage_seconds, bytes_read, \
bytes_written and scratch_written_bytes of the object. A bake that is up to date, and many assets, have none.

Many assets:
  cbvh bake meshes -o baked --jobs 8
  cbvh bake --manifest in.jsonl --out-manifest out.jsonl --max-memory 4GiB --shard 3/16

A line of in.jsonl is {\"input\": \"rock.obj\", \"output\": \"rock.cbvh\"} and may have profile, triangles, max_error, \
effort, split_objects and ids, for which the options given here are the defaults. Paths are relative to the manifest, \
folders of outputs are made. Assets are baked side by side within --jobs and --max-memory, and one that fails does not \
stop the others. out.jsonl has a line for each asset in the order of the input: its line, exit_code, and the fields of \
--json or an error; until it is whole, lines are in out.jsonl.part as assets are done. --json prints one object with \
counts and sums, which add up over shards. The exit code is 3 if an input is invalid, else 4 if a limit was reached, \
else 2 if the system is to blame, else 1 if an output is its own input, else 0. A manifest with a wrong line, and two \
assets with one output, are refused before the work with exit code 3.";

/// What `bake` takes.
#[derive(Debug, Args)]
#[command(after_help = BAKE_HELP)]
pub(crate) struct BakeArguments {
    /// Meshes: OBJ, STL, PLY, glTF; or one folder, whose meshes are baked each by itself
    #[arg(required_unless_present = "manifest", conflicts_with = "manifest", value_name = "IN")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write, or for a folder of meshes the folder to write to
    #[arg(
        short,
        long,
        value_name = "OUT.cbvh",
        required_unless_present = "manifest",
        conflicts_with = "manifest"
    )]
    pub(crate) output: Option<PathBuf>,
    /// Bake many assets: a JSON object a line, with "input", "output" and, if they differ, options
    #[arg(long, value_name = "IN.jsonl", requires = "out_manifest")]
    pub(crate) manifest: Option<PathBuf>,
    /// What came of each asset, a JSON object a line, with --manifest or a folder
    #[arg(long, value_name = "OUT.jsonl")]
    pub(crate) out_manifest: Option<PathBuf>,
    /// Only the I-th of N parts of the assets, I from 1 to N: every N-th asset, from the I-th on
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub(crate) shard: Option<Shard>,
    #[command(flatten)]
    pub(crate) layout: LayoutArguments,
    /// Time for a better tree: fast, default, or high, which takes about twice as long. Answers are the same
    #[arg(long, value_name = "E", default_value = "default", value_parser = effort)]
    pub(crate) effort: Effort,
    /// How far a vertex may move, in mesh units; only with --triangles quantized [default: 1e-5 of the diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = positive, allow_negative_numbers = true)]
    pub(crate) max_error: Option<f64>,
    /// Stay within this much memory, such as 512MiB or 2GB; what does not fit goes to scratch files
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub(crate) max_memory: Option<u64>,
    /// Where scratch files go, with --max-memory [default: beside the output]
    #[arg(long, value_name = "DIR", requires = "max_memory")]
    pub(crate) scratch: Option<PathBuf>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// One tree for each object of the input, to be queried by name
    #[arg(long)]
    pub(crate) split_objects: bool,
    /// Leave out the original triangle numbers
    #[arg(long)]
    pub(crate) no_ids: bool,
    /// Bake even if the output is up to date
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object, and one for each stage on standard error
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors (and what --json asks for)
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// How nodes and triangles are written.
#[derive(Debug, Args)]
pub(crate) struct LayoutArguments {
    /// Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f16, dop14-u4, dop26-u4, dop26-u8, dop14-f16-wide,
    /// dop26-u8-wide or dop14-f32
    #[arg(long, value_name = "P", default_value = "auto", value_parser = profile)]
    pub(crate) profile: Choice<Profile>,
    /// Triangles: auto, f32 (fastest), packed (the same values in fewer bytes) or quantized (vertices moved a little)
    #[arg(long, value_name = "T", default_value = "auto", value_parser = triangles)]
    pub(crate) triangles: Choice<TriangleEncoding>,
}

/// A named choice, or leave it to the baker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Choice<T> {
    Auto,
    Named(T),
}

impl<T: Copy> Choice<T> {
    /// As the baker's options have it.
    pub(crate) fn named(self) -> Option<T> {
        match self {
            Self::Auto => None,
            Self::Named(choice) => Some(choice),
        }
    }
}

const DUMP_HELP: &str = "\
Examples:
  cbvh dump rock.cbvh
  cbvh dump rock.cbvh --page 3
  cbvh dump rock.cbvh --treelet 0 --json

Treelets are numbered through the whole file, in the order of pages and of slots in a page.

The file is read piece by piece, in some 10 MiB of memory and a byte for each ten thousand of the file. --max-memory \
SIZE is a promise to stay within SIZE; one that is too small is refused with exit code 4.";

/// What `dump` takes.
#[derive(Debug, Args)]
#[command(after_help = DUMP_HELP)]
pub(crate) struct DumpArguments {
    /// The file
    pub(crate) file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Decode this treelet: links and slabs of each child
    #[arg(long, value_name = "N", conflicts_with = "page")]
    pub(crate) treelet: Option<u64>,
    /// Decode this page: anchors, links to other pages, treelets
    #[arg(long, value_name = "N")]
    pub(crate) page: Option<u32>,
    /// Stay within this much memory, such as 64MiB
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub(crate) max_memory: Option<u64>,
}

const VALIDATE_HELP: &str = "\
Example:
  cbvh validate rock.cbvh --json

Exit code 3 if the file is invalid. With --json the object says so too: rule, offset, expected, found.

The file is read piece by piece, in some 10 MiB of memory whatever its size. --max-memory SIZE is a promise to stay \
within SIZE; one that is too small is refused with exit code 4.";

/// What `validate` takes.
#[derive(Debug, Args)]
#[command(after_help = VALIDATE_HELP)]
pub(crate) struct ValidateArguments {
    /// The file
    pub(crate) file: PathBuf,
    /// Stay within this much memory, such as 64MiB
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub(crate) max_memory: Option<u64>,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

const VERIFY_HELP: &str = "\
Example:
  cbvh verify rock.cbvh rock.obj

Give the same meshes in the same order as to bake. Exit code 3 if anything differs.

File and mesh are read piece by piece. What does not fit into 1.5 GiB of memory, or what --max-memory says, goes to \
scratch files: up to 240 bytes a triangle, which have no names and vanish however the process ends. With --max-memory \
the whole process stays within SIZE; one that is too small is refused with exit code 4. glTF meshes are read whole.";

/// What `verify` takes.
#[derive(Debug, Args)]
#[command(after_help = VERIFY_HELP)]
pub(crate) struct VerifyArguments {
    /// The file
    pub(crate) file: PathBuf,
    /// The mesh, or the meshes, it was baked from
    #[arg(required = true, value_name = "MESH")]
    pub(crate) meshes: Vec<PathBuf>,
    /// Stay within this much memory, such as 64MiB; what does not fit goes to scratch files
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub(crate) max_memory: Option<u64>,
    /// Where scratch files go [default: the system's directory for temporary files]
    #[arg(long, value_name = "DIR")]
    pub(crate) scratch: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

const QUERY_HELP: &str = "\
Examples:
  cbvh query a.cbvh b.cbvh poses.txt --mode collide
  cbvh query a.obj b.obj near.txt,far.txt --mode distance --out raw_%s.txt
  cbvh query a.cbvh b.cbvh --mode distance --pose \"1 0 0 2  0 1 0 0  0 0 1 0\" --witness w.obj

A pose file has 12 numbers a line, the rows of a 3x4 matrix that places B in A's frame; # starts a comment. Each \
pose file gives one JSON line. --out writes one line a query: 0 or 1, a count, or a distance, then nanoseconds; %s \
stands for the pose file's name. answers_xxh3 is the same for every --isa and --jobs; it is null if the budget cut \
the run short, or if --rel-err or --abs-err leave a choice of answers.

With --cold, both sides being .cbvh files, the line also has the means over the queries of: open_ns_mean; disk_faults_mean, \
faults that waited for the disk; read_bytes_mean, what the disk was asked for; resident_bytes_mean, whole pages of \
both files in memory after the answer; and touched_bytes_mean, whole pages that the same query touches when asked again. \
What the system does not tell is null.";

/// What `query` takes.
#[derive(Debug, Args)]
#[command(after_help = QUERY_HELP)]
pub(crate) struct QueryArguments {
    /// One side: a .cbvh file, or a mesh that is baked in memory first
    pub(crate) a: PathBuf,
    /// The other side, placed by the poses
    pub(crate) b: PathBuf,
    /// Pose files, separated by commas
    #[arg(value_name = "POSES[,POSES...]", required_unless_present = "pose", conflicts_with = "pose")]
    pub(crate) poses: Option<String>,
    /// What to ask
    #[arg(long, value_enum, default_value = "collide")]
    pub(crate) mode: Mode,
    /// For --mode within: the distance asked about, mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) within: Option<f64>,
    /// For --mode distance: the answer may exceed the least distance by this fraction of it
    #[arg(long, value_name = "R", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) rel_err: Option<f64>,
    /// For --mode distance: the answer may exceed the least distance by this, mesh units
    #[arg(long, value_name = "E", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) abs_err: Option<f64>,
    /// Backend: auto, scalar, avx2 or avx512; auto is the fastest that there is, or what CBVH_ISA says
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// Threads over the poses
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: u16,
    #[command(flatten)]
    pub(crate) layout: LayoutArguments,
    /// Only the object of this name, on each side that has one
    #[arg(long, value_name = "NAME")]
    pub(crate) object: Option<String>,
    /// Write raw answers and times here; %s stands for the pose file's name
    #[arg(long, value_name = "raw_%s.txt", conflicts_with = "pose")]
    pub(crate) out: Option<String>,
    /// Stop each pose file after so many seconds
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) budget: Option<f64>,
    /// Queries before the clock starts, from the end of the pose file
    #[arg(long, value_name = "N", default_value = "3")]
    pub(crate) warm: usize,
    /// Ask only the first N poses of each file; 0 asks all
    #[arg(long, value_name = "N", default_value = "0")]
    pub(crate) limit: usize,
    /// Ask about files that are in memory nowhere: before each query the system is asked to forget them, and the time
    /// is that of opening them and of the first answer
    #[arg(long, conflicts_with_all = ["pose", "jobs", "warm"])]
    pub(crate) cold: bool,
    /// How the system reads .cbvh files from their disk
    #[arg(long, value_enum, value_name = "HOW", default_value = "usual")]
    pub(crate) read_ahead: ReadAhead,
    /// One pose instead of files, as 12 numbers; the answer is for a person
    #[arg(long, value_name = "12 NUMBERS", allow_hyphen_values = true)]
    pub(crate) pose: Option<String>,
    /// With --pose and --mode distance: write the closest points' segment and both triangles as OBJ
    #[arg(long, value_name = "OBJ")]
    pub(crate) witness: Option<PathBuf>,
}

/// How a file is read from its disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReadAhead {
    /// As the system does: around each page that is touched
    Usual,
    /// No more than queries touch
    Sparse,
    /// All of it, in the background
    Whole,
}

impl From<ReadAhead> for bvh_query::ReadAhead {
    fn from(how: ReadAhead) -> Self {
        match how {
            ReadAhead::Usual => Self::Usual,
            ReadAhead::Sparse => Self::Sparse,
            ReadAhead::Whole => Self::Whole,
        }
    }
}

const REPORT_HELP: &str = "\
Examples:
  cbvh report pairs.txt --out report
  cbvh report pairs.txt --meshes meshes --poses poses/%s_d1.txt,poses/%s_d5.txt --out report
  cbvh report pairs.txt --quick --out report
  cbvh report --hard --out hard --peers peers/out
  cbvh report --scaling --out scaling --largest 1000000

PAIRS is a text file with a pair of meshes a line: NAME A B [POSES[,POSES...]]; # starts a comment. Meshes are in any \
format that bake reads, or .cbvh files, whose triangles are baked again. Names of files are relative to the list. A pair \
without poses gets 60 that are made up, the same each time: overlapping, and with gaps of 1e-6, 0.5 %, 1 % and 5 % of \
A's diagonal.

Written are report.csv and report.json (the same figures), report.svg and report.html, for people. Each pair is baked \
in every profile with every encoding of triangles, with other ways to split nodes and with other orders of pages, and \
asked for contact and for distances with allowed errors of 0, 0.1 %, 1 % and 10 %. Answers are held against those of \
dop14-f32; a wrong one ends with exit code 3, after the files are written. What no file can have (other predictors, \
other branching with the same codes, larger leaves) is modelled, and called so.

Queries run on one processor that the thread is bound to. On a machine that has other work, what is measured is that \
work, too.

--hard writes hard.md, for people, and hard.csv and hard.json, with every answer. Each case is a pair of small meshes in \
a pose, with the exact truth known beforehand; it is asked in every profile, in both triangle encodings without loss, \
on every backend of this CPU, and in a fifth of these with corners, triangles and sides in other orders. A wrong answer \
ends with exit code 3, after the files are written.

--peers: other libraries are asked the same, one process a question, by the programs DIR/bin/peer_*: those take two \
OBJ files, a pose file, --mode, --bv and --out as query does. Their wrong answers are listed and do not change the \
exit code.

--scaling needs no files and writes scaling.csv and scaling.json (the same figures), scaling.svg and scaling.html, for \
people. A closed ball with bumps is made of about 1,000, 3,000, 10,000 and so on up to --largest triangles, baked as \
bake does by itself, and asked against itself in random poses with gaps of 1e-6, 1 % and 5 % of its diagonal, 100 of \
each. How times and tests grow is told as the slope between logarithms: 0.5 for the square root, near 0 for the \
logarithm. With the largest ball of at most about 300,000 triangles follow batches on one thread and on two, and paths \
with and without a tracker. Answers that must agree and do not end with exit code 3, after the files are written.";

/// What `report` takes.
#[derive(Debug, Args)]
#[command(after_help = REPORT_HELP)]
pub(crate) struct ReportArguments {
    /// Report on speed against error for the pairs of meshes in this list
    #[arg(required_unless_present_any = ["hard", "scaling"], conflicts_with_all = ["hard", "scaling"])]
    pub(crate) pairs: Option<PathBuf>,
    /// Report on the hard cases, which are built in
    #[arg(long, conflicts_with = "scaling")]
    pub(crate) hard: bool,
    /// Report on how time grows with the number of triangles, on several threads and along paths
    #[arg(long)]
    pub(crate) scaling: bool,
    /// With --scaling: the most triangles of a mesh, from 1000 to 100000000
    #[arg(long, value_name = "N", default_value = "10000000", conflicts_with_all = ["pairs", "hard"],
          value_parser = clap::value_parser!(u64).range(1000..=100_000_000))]
    pub(crate) largest: u64,
    /// The folder to write to; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The folder of the meshes [default: that of PAIRS]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["hard", "scaling"])]
    pub(crate) meshes: Option<PathBuf>,
    /// Files of poses for each pair, besides those in PAIRS; %s stands for the pair's name
    #[arg(long, value_name = "FILE[,FILE...]", conflicts_with_all = ["hard", "scaling"])]
    pub(crate) poses: Option<String>,
    /// Ask only so many poses of each pair, spread evenly over all, or of each gap; 0 asks all
    #[arg(long, value_name = "N", default_value = "100", conflicts_with = "hard")]
    pub(crate) limit: usize,
    /// Rounds in which all variants, or all sizes, take turns
    #[arg(long, value_name = "N", default_value = "7", conflicts_with = "hard",
          value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(crate) rounds: u16,
    /// Bytes to read through before a cold query [default: 5/4 of the largest cache]
    #[arg(long, value_name = "SIZE", value_parser = size, conflicts_with_all = ["hard", "scaling"])]
    pub(crate) sweep: Option<u64>,
    /// Backend: auto, scalar, avx2 or avx512; auto is the fastest that there is, or what CBVH_ISA says
    #[arg(long, value_name = "ISA", default_value = "auto", conflicts_with = "hard")]
    pub(crate) isa: String,
    /// A few poses, two rounds and a small sweep: to try the command, not to quote
    #[arg(long, conflicts_with = "hard")]
    pub(crate) quick: bool,
    /// With --hard: a build of programs that ask other libraries
    #[arg(long, value_name = "DIR", conflicts_with_all = ["pairs", "scaling"])]
    pub(crate) peers: Option<PathBuf>,
}

/// A question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mode {
    /// Do they touch?
    Collide,
    /// How many pairs of triangles touch?
    Contacts,
    /// How far apart are they?
    Distance,
    /// Are they at most --within apart?
    Within,
}

impl Mode {
    /// The name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Contacts => "contacts",
            Self::Distance => "distance",
            Self::Within => "within",
        }
    }
}

pub(crate) fn profile(name: &str) -> Result<Choice<Profile>, String> {
    if name == "auto" {
        return Ok(Choice::Auto);
    }
    let names: Vec<_> = Profile::ALL.into_iter().map(Profile::name).collect();
    Profile::from_name(name).map(Choice::Named).ok_or_else(|| format!("expected auto, {}", names.join(", ")))
}

pub(crate) fn triangles(name: &str) -> Result<Choice<TriangleEncoding>, String> {
    if name == "auto" {
        return Ok(Choice::Auto);
    }
    let encoding = TriangleEncoding::ALL.into_iter().find(|encoding| encoding.name() == name);
    encoding.map(Choice::Named).ok_or_else(|| "expected auto, f32, packed or quantized".to_owned())
}

/// Every `count`-th asset, from number `index` on, which is 1 to `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) index: u64,
    pub(crate) count: u64,
}

impl Shard {
    /// Whether the asset with this number, from 0 on, belongs to it.
    pub(crate) fn has(self, number: u64) -> bool {
        number % self.count == self.index - 1
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let parsed = text.split_once('/').and_then(|(index, count)| {
        let shard = Shard { index: index.parse().ok()?, count: count.parse().ok()? };
        (1..=shard.count).contains(&shard.index).then_some(shard)
    });
    parsed.ok_or_else(|| "expected I/N with I from 1 to N, such as 1/4".to_owned())
}

pub(crate) fn effort(name: &str) -> Result<Effort, String> {
    Effort::from_name(name).ok_or_else(|| "expected fast, default or high".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "expected a number above 0".to_owned())
}

fn not_negative(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value >= 0.0);
    value.ok_or_else(|| "expected a number of at least 0".to_owned())
}

/// Bytes: a number and a unit, 1000s with `kB`, `MB`, `GB`, `TB`, 1024s with `KiB`, `MiB`, `GiB`, `TiB`.
fn size(text: &str) -> Result<u64, String> {
    let expected = || "expected a size such as 512MiB, 2GB or 100000000".to_owned();
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1048576.0,
        "g" | "gib" => 1073741824.0,
        "t" | "tib" => 1099511627776.0,
        _ => return Err(expected()),
    };
    let bytes = number.parse::<f64>().map_err(|_| expected())? * factor;
    // Beyond 2^53 bytes no budget is one.
    if bytes < 9007199254740992.0 { Ok(bytes as u64) } else { Err(expected()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn shards_are_numbered_from_one() {
        assert_eq!(shard("3/16"), Ok(Shard { index: 3, count: 16 }));
        for wrong in ["", "1", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", "1/99999999999999999999"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
        let of = |index| (0..10).filter(move |&number| Shard { index, count: 3 }.has(number));
        assert_eq!(of(1).collect::<Vec<_>>(), [0, 3, 6, 9]);
        assert_eq!((1..=3).map(|index| of(index).count()).sum::<usize>(), 10);
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!(size("512MiB"), Ok(512 << 20));
        assert_eq!(size("1.5 GiB"), Ok(3 << 29));
        assert_eq!(size("2GB"), Ok(2_000_000_000));
        assert_eq!(size("7"), Ok(7));
        for wrong in ["", "MiB", "-1", "1XB", "1e3", "1.2.3", "99999999999999999999"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
