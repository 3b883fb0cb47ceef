//! `cbvh query`: asks two meshes about files of poses, or about one pose.

mod question;

use crate::asking::files::{read_all, write_file};
use crate::asking::mesh::{blame, load_both};
use crate::asking::{self, Answer as _, AskingArguments, Record, Run, poses, witness};
use crate::console::{self, Failure};
use crate::options::not_negative;
use bvh_query::{Pose, Querier};
use clap::{Args, ValueEnum};
use question::{Answer, Question};
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh query a.cbvh b.cbvh poses.txt --mode collide > answers.txt
  cbvh query a.obj b.obj near.txt,far.txt --mode distance --json
  cbvh query bin.cbvh part.cbvh poses.txt --mode relation
  cbvh query a.cbvh b.cbvh --mode distance --pose \"1 0 0 2  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a pose file has 12 numbers: the rows of the 3 by 4 matrix that places B in the frame of A. The first three \
numbers of a row are the rotation and the fourth is the translation, in mesh units. # starts a comment.

One answer is printed per line, in the order of the poses: collide and within 0 or 1, contacts the number of pairs of \
triangles, distance the distance in mesh units (17 digits), relation a number. About one pose, the answer is printed for a \
person.

collide is about surfaces: a mesh that is inside another without touching it does not collide. relation tells: 0 touching, \
1 apart, 2 A inside B, 3 B inside A, 4 mixed (some parts of a mesh are inside the other and some are not, or some of each \
mesh are), 5 undefined, because a mesh that is not closed would have to contain something.

--json prints one object per pose: pose, its number in the file, from 0; poses, the name of the file, if there are several; \
and collide, within (true or false), relation, contacts and pairs (the triangles), or distance, lower, upper, point_a, \
point_b, object_a, triangle_a, object_b, triangle_b. The true distance lies between lower and upper, and points are in the \
frame of A.

--bench prints one object per file: what was asked, the times of the queries, positives (all answers of relation but 1 and 5) \
and answers_xxh3, which is the same for every --isa and --jobs. It is null if --budget cut the run short, or if --rel-err or \
--abs-err leave a choice of answers. --out writes the lines, each with its nanoseconds; %s stands for the name of the file.";

/// What `query` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct QueryArguments {
    /// The first mesh: a .cbvh file, or a mesh file that is baked in memory first
    a: PathBuf,
    /// The second mesh, which the poses place
    b: PathBuf,
    /// Pose files, separated by commas. Without them, B is where its file says
    #[arg(value_name = "POSES[,POSES...]", conflicts_with = "one")]
    poses: Option<String>,
    /// The question
    #[arg(long, value_enum, default_value = "collide")]
    mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    within: Option<f64>,
    /// With --mode distance: the answer may exceed the least distance by this fraction of it
    #[arg(long, value_name = "R", value_parser = not_negative, allow_negative_numbers = true)]
    rel_err: Option<f64>,
    /// With --mode distance: the answer may exceed the least distance by this length, in mesh units
    #[arg(long, value_name = "E", value_parser = not_negative, allow_negative_numbers = true)]
    abs_err: Option<f64>,
    #[command(flatten)]
    asking: AskingArguments,
    /// Ask about one pose, given as 12 numbers, and print the answer for a person
    #[arg(id = "one", long = "pose", value_name = "12 NUMBERS", allow_hyphen_values = true)]
    pose: Option<String>,
    /// With --mode distance about one pose: write both closest triangles and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    witness: Option<PathBuf>,
}

/// A question about two meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
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
    fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Contacts => "contacts",
            Self::Distance => "distance",
            Self::Within => "within",
            Self::Relation => "relation",
        }
    }
}

/// Answers the question about pose files or about one pose.
pub(crate) fn run(arguments: &QueryArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.asking.isa)?;
    let question = Question::new(arguments)?;
    let Some(files) = &arguments.poses else {
        arguments.asking.require_no_files()?;
        let pose = arguments.pose.as_deref().map_or(Ok(Pose::IDENTITY), poses::parse_one)?;
        return once(arguments, &question, &pose, Querier::with_backend(backend));
    };
    let files = read_all(Some(files), "pose files", &arguments.asking, poses::read)?;
    let [mut a, mut b] = load_both(&arguments.a, &arguments.b, &arguments.asking.how())?;
    a.check()?;
    b.check()?;
    let ask = |querier: &mut Querier, pose: &Pose| question.ask(querier, [&a, &b], pose);
    let bench = |stem: &str, run: &Run<Answer>| {
        let mut record = Record::new(&a, Some(&b), question.mode.name(), backend, stem, run);
        if !question.is_exact() {
            record.answers_xxh3 = None;
        }
        record
    };
    asking::ask_files(
        &arguments.asking,
        backend,
        "pose",
        &files,
        ask,
        |error| blame(&a, Some(&b), error),
        bench,
    )
}

/// Asks about one pose, prints the answer, and writes the witness of a distance as OBJ.
fn once(
    arguments: &QueryArguments,
    question: &Question,
    pose: &Pose,
    mut querier: Querier,
) -> Result<(), Failure> {
    let [a, b] = &load_both(&arguments.a, &arguments.b, &arguments.asking.how())?;
    let answer = question.ask(&mut querier, [a, b], pose).map_err(|error| blame(a, Some(b), error))?;
    if let (Some(path), Answer::Distance(distance)) = (&arguments.witness, &answer) {
        write_file(path, &witness::obj([a, b], pose, distance)?)?;
    }
    if arguments.asking.json {
        let mut record = answer.json();
        record["pose"] = 0.into();
        return console::json(&record);
    }
    console::text(&question.describe([a, b], &answer))
}
