//! `cbvh probe`: asks a mesh about files of points, rays or segments, or about one.

mod answer;
mod question;

use crate::asking::files::read_all;
use crate::asking::mesh::{blame, load_one};
use crate::asking::{self, Answer as _, AskingArguments, Record, Run};
use crate::console::{self, Failure};
use answer::Answer;
use bvh_query::Querier;
use clap::{Args, ValueEnum};
use question::Question;
use std::path::{Path, PathBuf};

const HELP: &str = "\
Examples:
  cbvh probe part.cbvh points.txt --mode side
  cbvh probe part.obj near.txt,far.txt --mode closest --json
  cbvh probe room.cbvh --mode ray --probe \"0 0 1.5  1 0 0\"

With --mode closest and side, each line of FILE is a point, 3 numbers. With --mode ray it is the origin and the direction of \
a ray, 6 numbers; the direction may have any length. With --mode segment it is both ends of a segment, 6 numbers. All are in \
the frame of the mesh, in mesh units. # starts a comment.

closest is the distance to the surface, whether the point is inside or outside. side is defined for meshes that are closed \
and consistently oriented; for others it is undefined, except on the surface. A ray or a segment that only touches an edge or \
a corner hits the mesh.

One answer is printed per line, in the order of the questions: with --mode closest the distance; with side 1 inside, 0 on \
the mesh, -1 outside, 2 undefined; with ray the parameter of the first hit in units of the direction, or -1; with segment 1 \
if it meets the mesh, 0 if not. --json prints one object per question: probe, its number in the file, from 0; probes, the \
name of the file, if there are several; distance (closest), side, hit and t (ray) or meets (segment); and of a closest point \
and of a hit lower, upper, point, object and triangle. --bench prints one object per file: the fields of cbvh query --bench \
for one mesh; positives counts points on the mesh with --mode closest, points inside it with side, rays that hit it with ray, \
and segments that meet it with segment. --out writes the lines, each with its nanoseconds; %s stands for the name of the \
file.";

/// What `probe` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ProbeArguments {
    /// The mesh: a .cbvh file, or a mesh file that is baked in memory first
    a: PathBuf,
    /// Files of points, rays or segments, separated by commas
    #[arg(value_name = "FILE[,FILE...]", required_unless_present = "one", conflicts_with = "one")]
    files: Option<String>,
    /// The question
    #[arg(long, value_enum, default_value = "closest")]
    mode: Mode,
    #[command(flatten)]
    asking: AskingArguments,
    /// Ask about one point, ray or segment, given as 3 or 6 numbers, and print the answer for a person
    #[arg(id = "one", long = "probe", value_name = "3 OR 6 NUMBERS", allow_hyphen_values = true)]
    probe: Option<String>,
}

/// A question about one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
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
    fn name(self) -> &'static str {
        match self {
            Self::Closest => "closest",
            Self::Side => "side",
            Self::Ray => "ray",
            Self::Segment => "segment",
        }
    }
}

/// Answers the question about files of points, rays or segments, or about one.
pub(crate) fn run(arguments: &ProbeArguments) -> Result<(), Failure> {
    let (mode, options) = (arguments.mode, &arguments.asking);
    let backend = asking::backend(&options.isa)?;
    let load = || load_one(&arguments.a, &options.how());
    if let Some(probe) = &arguments.probe {
        let question = question::parse_one(probe, mode)?;
        let mesh = load()?;
        let answer = question.ask(&mut Querier::with_backend(backend), mesh.shape());
        let answer = answer.map_err(|error| blame(&mesh, None, error))?;
        if options.json {
            let mut record = answer.json();
            record["probe"] = 0.into();
            return console::json(&record);
        }
        return console::text(&answer.describe(&mesh));
    }
    let (files, read) = (arguments.files.as_deref(), |file: &Path| question::read(file, mode));
    let files = read_all(files, "files of points, rays or segments", options, read)?;
    let mut mesh = load()?;
    mesh.check()?;
    let ask = |querier: &mut Querier, question: &Question| question.ask(querier, mesh.shape());
    let bench = |stem: &str, run: &Run<Answer>| Record::new(&mesh, None, mode.name(), backend, stem, run);
    asking::ask_files(options, backend, "probe", &files, ask, |error| blame(&mesh, None, error), bench)
}
