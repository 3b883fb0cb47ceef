//! `cbvh robot`: checks a robot from a URDF file in configurations of its joints, and along edges between them.

mod page;

use crate::asking::files::{self, numbers, parse_placed, read_lines, stem};
use crate::asking::mesh::{How, LoadedMesh};
use crate::asking::runner::Run;
use crate::asking::{self, RunArguments};
use crate::console::{self, Failure, Record, counted, record, shown, significant, tell_warning};
use crate::options::{not_negative, positive};
use crate::view::output::PageArguments;
use bvh_format::checksum::Hasher;
use bvh_query::{Distance, MotionOptions, OwnedShape, PenetrationOptions, Pose, QueryError, ReadAhead};
use cbvh_robot::{Edge, NearPair, Robot, RobotDistance, RobotError, RobotMotion, RobotOptions};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::time::Instant;

const HELP: &str = "\
Examples:
  cbvh robot panda.urdf --srdf panda.srdf configurations.txt
  cbvh robot panda.urdf --srdf panda.srdf --obstacle \"table.obj@1 0 0 0.5  0 1 0 0  0 0 1 -0.2\" configurations.txt --mode distance
  cbvh robot panda.urdf --srdf panda.srdf configurations.txt --mode near --margin 0.05 --json
  cbvh robot panda.urdf --srdf panda.srdf --obstacle cell.cbvh edges.txt --edges --jobs 4 --json > results.jsonl
  cbvh robot arm.urdf --package-dir ros/src --joints \"0 0.4 -1.2 0\"
  cbvh robot panda.urdf --srdf panda.srdf --obstacle cell.cbvh edges.txt --edges --view robot.html

Each line of FILE has one number for each joint value, in the order of the joints in the URDF file: radians for joints that turn and \
metres for those that slide. Fixed joints and joints that mimic others have none; a planar joint has three (x, y, theta), and a \
floating one seven (x, y, z, and a quaternion: qx, qy, qz, qw). With --edges, a line has two such configurations, and the joint values go \
straight from the first, at time 0, to the second, at time 1. # starts a comment. Limits of joints are not checked.

The query is about all pairs of bodies (links and obstacles) that can move against each other, but for those that the SRDF disables. \
Neighbours across a moving joint are checked, unless they are disabled. Meshes are surfaces: a body inside a mesh without \
touching it is free, unless --solid fills the obstacles. Boxes, cylinders, spheres and capsules of the URDF are solid.

One result is printed per line, in the order of FILE. collide: 1 if any two bodies touch, 0 if not. distance: the distance of the \
nearest two bodies in metres (17 digits), 0 if they touch, inf if there are no pairs. near: how many pairs of bodies overlap or are at most \
--margin apart, and the least signed distance of these, which is minus a depth where bodies overlap, or inf. --edges: free, hit FREE_UNTIL TOUCHING_AT, or near \
FREE_UNTIL AT, as cbvh motion prints them, and as certain: no two bodies touch at any moment before FREE_UNTIL; at TOUCHING_AT \
they do, or are at most --clearance apart; near means that they are so close that it cannot be decided within --tolerance.

--json prints one object per line of FILE: configuration (with --edges: edge), its number in the file, from 0. collide has collide \
(true or false), and if true a and b, the names of the first two bodies that touch, and pairs, all of them. distance has a and b, and the fields of \
cbvh query --mode distance --json, with points in the world; distance is null if there are no pairs. \
near has pairs, each with a, b, distance (signed), lower and upper (its certified bounds), point_a, point_b, normal (from a to b) in the world, \
gradient (the derivative of the distance by each joint value), and signed (false if a body has no inside, and so no depth). --edges has answer (free, hit or near) and, unless \
it is free, free_until, touching_at or at, and at that time joints (the joint values), a, b, and the fields of a distance.

An obstacle is a mesh file or a .cbvh file. POSE places it in the world: 12 numbers, the rows of the 3 by 4 matrix [R | t], or 7: \
x y z of the position, then x y z w of a unit quaternion. Without @POSE, it is in the world's frame. Its name is that of its file \
without folders and extension, with #2, #3 and so on if the name is taken. --profile, --triangles and --round are about obstacles only.

--bench prints one object: the query, the times, positives (contact, or hits) and answers_xxh3, a hash of the results, which is the \
same for every --isa and --jobs. It is null if --budget cut the run short. Tests of nodes and triangles are not counted, and are null. \
--out writes the lines, each with its nanoseconds.

--view writes a page that shows the robot among its obstacles where the first line puts it, and needs nothing but a browser. It has a \
slider for each joint value, colours the bodies that touch, and lists all lines of FILE. An edge is played to its goal or to where \
it hits. The page needs no FILE; the joint values are then 0, or the limits nearest to 0.";

/// What `robot` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct RobotArguments {
    /// The URDF file of the robot
    urdf: PathBuf,
    /// Configurations of the joints, or edges with --edges, one per line
    #[arg(required_unless_present_any = ["one", "view"], conflicts_with = "one")]
    file: Option<PathBuf>,
    /// An SRDF file, whose disabled pairs are not checked
    #[arg(long, value_name = "SRDF")]
    srdf: Option<PathBuf>,
    /// A folder that contains packages, for package:// paths of the URDF; may be given several times
    #[arg(long, value_name = "DIR")]
    package_dir: Vec<PathBuf>,
    /// Let the URDF name meshes outside of its package, of the folder above it and of --package-dir
    #[arg(long)]
    allow_outside: bool,
    /// A mesh that stands in the world, and its pose there; may be given several times
    #[arg(long, value_name = "MESH@POSE")]
    obstacle: Vec<String>,
    /// Obstacles are full: what is inside touches them. Their meshes must be closed
    #[arg(long, requires = "obstacle")]
    solid: bool,
    /// Check edges: straight motions of all joint values between two configurations
    #[arg(long)]
    edges: bool,
    /// The query
    #[arg(long, value_enum, default_value = "collide")]
    mode: Mode,
    /// With --mode near: bodies that are at most this far apart are near, in metres
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    margin: Option<f64>,
    /// With --edges: bodies that are at most this far apart count as a hit, in metres
    #[arg(long, value_name = "C", default_value = "0", value_parser = not_negative, allow_negative_numbers = true, requires = "edges")]
    clearance: f64,
    /// With --edges: how far beyond the clearance the result may be near, in metres [default: 1e-6 of the smaller shape's diagonal]
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true, requires = "edges")]
    tolerance: Option<f64>,
    #[command(flatten)]
    run: RunArguments,
    /// Write raw results and times to this file
    #[arg(long, value_name = "raw.txt")]
    out: Option<PathBuf>,
    /// Print one JSON object about all lines, with their times, and no results
    #[arg(long, conflicts_with = "json")]
    bench: bool,
    /// Check one configuration (with --edges: one edge), given as a line of FILE, and print the result for a person
    #[arg(id = "one", long = "joints", value_name = "NUMBERS", allow_hyphen_values = true, conflicts_with_all = asking::OF_FILES)]
    joints: Option<String>,
    /// Write a page that shows the robot, with a slider for each joint value
    #[arg(long, value_name = "PAGE.html")]
    view: Option<PathBuf>,
    #[command(flatten)]
    page: PageArguments,
}

impl RobotArguments {
    /// Returns whether there are questions. A page needs none.
    fn asks(&self) -> bool {
        self.file.is_some() || self.joints.is_some()
    }
}

/// A question about all pairs of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Do any two bodies touch?
    Collide,
    /// How far apart are the nearest two bodies?
    Distance,
    /// Which bodies are near, how far apart are they, and how does that change with the joint values?
    Near,
}

/// Answers the question about each line of a file, or about one configuration or edge.
pub(crate) fn run(arguments: &RobotArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.run.isa)?;
    if arguments.edges && arguments.mode != Mode::Collide {
        return Err(Failure::usage("--edges requires --mode collide"));
    }
    let margin = match (arguments.mode, arguments.margin) {
        (Mode::Near, None) => return Err(Failure::usage("--mode near requires --margin D")),
        (Mode::Collide | Mode::Distance, Some(_)) => {
            return Err(Failure::usage("--margin requires --mode near"));
        }
        (_, margin) => margin.unwrap_or(0.0),
    };
    let obstacles =
        arguments.obstacle.iter().map(|text| parse_obstacle(text)).collect::<Result<Vec<_>, _>>()?;
    page::check(arguments, &obstacles)?;
    let start = Instant::now();
    let robot = &mut read_robot(arguments)?;
    robot.set_backend(backend);
    let mut build_seconds = start.elapsed().as_secs_f64();
    // A mistake in the questions is reported before obstacles are baked.
    let questions = read_questions(arguments, robot)?;
    let start = Instant::now();
    for (path, pose) in &obstacles {
        add_obstacle(robot, path, pose, arguments)?;
    }
    build_seconds += start.elapsed().as_secs_f64();
    if questions.is_empty() {
        return page::write_alone(robot, arguments);
    }
    page::refuse_large(robot, arguments)?;

    // Contact is a matter of one pair, unless the others are to be told.
    let list = arguments.run.json || arguments.file.is_none();
    let options = MotionOptions::new().clearance(arguments.clearance).tolerance(arguments.tolerance);
    let ask = |robot: &mut Robot, question: &Question| {
        let answer = question.ask(robot, (arguments.mode, margin), list, &options);
        answer.map_err(|error| blame(&error, question, arguments))
    };
    let words = if arguments.edges { ["edge", "edges"] } else { ["configuration", "configurations"] };
    let Some(file) = &arguments.file else {
        let answer = ask(robot, &questions[0])?;
        page::write(robot, arguments, questions.iter().zip([&answer]))?;
        return match arguments.run.json {
            true => console::json(&Record::of(words[0], &0).with(asking::Answer::json(&answer))),
            false => console::text(&answer.describe()),
        };
    };
    // The threads need not find the pairs again.
    let robot = &robot.snapshot();
    let run = Run::shared(&questions, (|| robot.clone(), |_: &mut Robot| None), ask, &arguments.run)?;
    if let Some(out) = &arguments.out {
        run.write_raw(out)?;
    }
    page::write(&mut robot.clone(), arguments, questions.iter().zip(run.answers()))?;
    if !arguments.bench {
        return run.tell(words, None, arguments.run.json);
    }
    let mode = if arguments.edges { "motion".to_owned() } else { asking::mode_name(&arguments.mode) };
    let about = record! {
        peer: "cbvh",
        version: env!("CARGO_PKG_VERSION"),
        mode: mode,
        robot: stem(&arguments.urdf),
        poses: stem(file),
        joints: robot.joints().len(),
        links: robot.links().count(),
        obstacles: obstacles.len(),
        pairs: robot.clone().pairs().len(),
        build_s: build_seconds,
    };
    console::json(&about.with(run.bench(robot.backend(), true)))
}

/// Parses the file and the pose of an obstacle.
fn parse_obstacle(text: &str) -> Result<(PathBuf, Pose), Failure> {
    // A path may have the sign, too, but no pose has it.
    let Some((file, pose)) = text.rsplit_once('@') else { return Ok((text.into(), Pose::IDENTITY)) };
    let expected = "expected 12 numbers, or 7, after @";
    let pose = files::parse_option(&format!("--obstacle {file}"), pose, expected, parse_placed)?;
    Ok((file.into(), pose))
}

/// Reads the robot, and tells what was read otherwise than its author may have meant.
fn read_robot(arguments: &RobotArguments) -> Result<Robot, Failure> {
    let mut options =
        RobotOptions::new().packages(arguments.package_dir.clone()).allow_outside(arguments.allow_outside);
    options.srdf.clone_from(&arguments.srdf);
    let robot = Robot::from_urdf(&arguments.urdf, &options);
    let robot = robot.map_err(|error| from_robot(error, &arguments.urdf))?;
    robot.warnings().iter().for_each(|warning| tell_warning(warning));
    if robot.joints().is_empty() && arguments.asks() {
        let what =
            "expected a robot with joints that move, found none; cbvh scene queries shapes without joints";
        return Err(Failure::invalid(&arguments.urdf, what));
    }
    Ok(robot)
}

/// Classifies an error of reading a robot or of changing it.
fn from_robot(error: RobotError, urdf: &Path) -> Failure {
    match error {
        RobotError::Io { path, source } => Failure::from_input(&path, &source),
        RobotError::TooLong { .. } => Failure::Limit(error.to_string()),
        RobotError::NoMesh { .. } => Failure::System(format!("{error}: --package-dir DIR")),
        RobotError::Mesh { path, link, source } => {
            Failure::from_bake(format_args!("{}: link {link}", path.display()), &source)
        }
        RobotError::Outside { .. } => {
            Failure::Invalid(format!("{error}: --package-dir DIR or --allow-outside"))
        }
        // It names its file.
        RobotError::Description { .. } => Failure::Invalid(error.to_string()),
        RobotError::Backend(error) => error.into(),
        error => Failure::invalid(urdf, error),
    }
}

/// Bakes or opens an obstacle, and puts it where it stands.
fn add_obstacle(
    robot: &mut Robot,
    path: &Path,
    pose: &Pose,
    arguments: &RobotArguments,
) -> Result<(), Failure> {
    let how = How { layout: &arguments.run.layout, object: None, read_ahead: ReadAhead::Usual };
    let mesh = LoadedMesh::load(path, &how)?;
    mesh.check()?;
    let refused = |error: QueryError| Failure::invalid(path, error);
    let shape = OwnedShape::from(mesh.bvh);
    let shape = if arguments.solid { shape.solid().map_err(refused)? } else { shape };
    let stem = stem(path);
    let name = (2..).map(|number| format!("{stem}#{number}"));
    let name = std::iter::once(stem.clone()).chain(name).find(|name| robot.body(name).is_err());
    let added = robot.add_obstacle(name.unwrap_or(stem), shape, pose);
    added.map_err(|error| Failure::invalid(path, error))
}

/// A configuration or an edge, and the number of its line.
struct Question {
    line: usize,
    asked: Asked,
}

enum Asked {
    Configuration(Vec<f64>),
    Edge(Edge),
}

/// Reads the questions of the file, or the one of `--joints`.
fn read_questions(arguments: &RobotArguments, robot: &Robot) -> Result<Vec<Question>, Failure> {
    let names = robot.joints().join(", ");
    let count = robot.joints().len();
    let expected = match arguments.edges {
        false => format!("expected {}, the values of {names}", counted(count as u64, "number")),
        true => format!("expected {} numbers, two configurations of {names}", 2 * count),
    };
    let parse = |text: &str| parse(text, robot, arguments.edges, &expected);
    let Some(file) = &arguments.file else {
        let Some(text) = &arguments.joints else { return Ok(Vec::new()) };
        let asked = files::parse_option("--joints", text, &expected, parse)?;
        return Ok(vec![Question { line: 1, asked }]);
    };
    let none = format!("{expected}, in at least one line, found none");
    let mut questions = read_lines(file, &none, parse)?;
    if arguments.run.limit > 0 {
        questions.truncate(arguments.run.limit);
    }
    Ok(questions.into_iter().map(|(line, asked)| Question { line, asked }).collect())
}

/// Parses a configuration or an edge of a robot. Returns `None` if the text is blank.
fn parse(text: &str, robot: &Robot, is_edge: bool, expected: &str) -> Result<Option<Asked>, String> {
    let mut from = numbers(text)?;
    let count = robot.joints().len();
    if from.is_empty() {
        return Ok(None);
    }
    if from.len() != count * if is_edge { 2 } else { 1 } {
        return Err(format!("{expected}, found {}", from.len()));
    }
    let to = from.split_off(count);
    robot.check(&from).map_err(|error| error.to_string())?;
    if !is_edge {
        return Ok(Some(Asked::Configuration(from)));
    }
    robot.check(&to).map_err(|error| format!("end: {error}"))?;
    let edge = Edge::straight(&from, &to).and_then(|edge| robot.check_edge(&edge).map(|()| edge));
    edge.map(|edge| Some(Asked::Edge(edge))).map_err(|error| error.to_string())
}

/// Turns an error about a question into one of its line.
fn blame(error: &RobotError, question: &Question, arguments: &RobotArguments) -> Failure {
    let text = match &arguments.file {
        Some(file) => format!("{}: line {}: {error}", file.display(), question.line),
        None => format!("--joints: {error}"),
    };
    match error {
        RobotError::Pair { source: QueryError::Budget { .. }, .. } => Failure::Limit(text),
        _ => Failure::Invalid(text),
    }
}

/// An answer about a configuration or an edge.
#[derive(Debug, Clone)]
enum Answer {
    /// Whether any two bodies touch, and which, if they are to be told.
    Collide(bool, Vec<[String; 2]>),
    /// The nearest two bodies; none if there are no pairs.
    Distance(Option<RobotDistance>),
    /// The bodies that are near.
    Near(Vec<NearPair>),
    Motion(RobotMotion),
}

impl Question {
    fn ask(
        &self,
        robot: &mut Robot,
        (mode, margin): (Mode, f64),
        list: bool,
        options: &MotionOptions,
    ) -> Result<Answer, RobotError> {
        Ok(match &self.asked {
            Asked::Edge(edge) => Answer::Motion(robot.motion(edge, options)?),
            Asked::Configuration(joints) => match mode {
                Mode::Distance => Answer::Distance(robot.distance(joints)?),
                Mode::Near => {
                    Answer::Near(robot.near_pairs(joints, margin, &PenetrationOptions::default())?)
                }
                Mode::Collide if list => {
                    let pairs = robot.pairs_in_contact(joints)?;
                    Answer::Collide(!pairs.is_empty(), pairs)
                }
                Mode::Collide => Answer::Collide(robot.collide(joints)?, Vec::new()),
            },
        })
    }
}

/// The names of answers that are not free.
const HIT: &str = "hit";
const NEAR: &str = "near";

/// How a motion ends that is not free: its name, the time until which it is free and the time at which it is not, and the joint
/// values and the nearest bodies at that time.
struct End<'a> {
    kind: &'static str,
    times: [f64; 2],
    joints: &'a [f64],
    bodies: &'a [String; 2],
    nearest: Distance,
}

impl<'a> End<'a> {
    fn of(motion: &'a RobotMotion) -> Option<Self> {
        match motion {
            RobotMotion::Hit { free_until, touching_at, joints, bodies, nearest, points } => {
                let times = [*free_until, *touching_at];
                Some(Self { kind: HIT, times, joints, bodies, nearest: in_world(nearest, points) })
            }
            RobotMotion::Near { free_until, at, joints, bodies, nearest, points } => {
                let times = [*free_until, *at];
                Some(Self { kind: NEAR, times, joints, bodies, nearest: in_world(nearest, points) })
            }
            _ => None,
        }
    }
}

/// Returns a distance with its points in the world.
fn in_world(nearest: &Distance, [a, b]: &[[f64; 3]; 2]) -> Distance {
    let mut nearest = *nearest;
    (nearest.point_a, nearest.point_b) = (*a, *b);
    nearest
}

/// Returns the names of two bodies as fields.
fn names([a, b]: &[String; 2]) -> Record {
    record! { a: a, b: b }
}

/// Returns two bodies that are near each other as fields.
fn near(NearPair { bodies, nearest: of, gradient, .. }: &NearPair) -> Record {
    names(bodies).with(record! {
        distance: of.distance, lower: of.lower, upper: of.upper, point_a: of.point_a, point_b: of.point_b,
        normal: of.normal, gradient: gradient, signed: of.is_signed,
    })
}

/// Returns the least signed distance of bodies that are near each other.
fn least(pairs: &[NearPair]) -> f64 {
    pairs.iter().fold(f64::INFINITY, |least, pair| least.min(pair.nearest.distance))
}

impl Answer {
    /// Returns the answer for a person.
    fn describe(&self) -> String {
        let nearest = |bodies: &[String; 2], of: &Distance| {
            let [a, b] = bodies.each_ref().map(|name| shown(name));
            let touch = if of.distance == 0.0 { " (they touch)" } else { "" };
            let point = asking::mesh::point;
            format!(
                "{a} and {b}: distance {:?}{touch}\n  certainly {:?} to {:?}\n  on {a} {}\n  on {b} {}\n",
                of.distance,
                of.lower,
                of.upper,
                point(of.point_a),
                point(of.point_b)
            )
        };
        match self {
            Self::Collide(_, pairs) if pairs.is_empty() => "no bodies touch\n".to_owned(),
            Self::Collide(_, pairs) => {
                let line = |[a, b]: &[String; 2]| format!("  {}  {}\n", shown(a), shown(b));
                let lines: String = pairs.iter().map(line).collect();
                format!("{} of bodies in contact\n{lines}", counted(pairs.len() as u64, "pair"))
            }
            Self::Distance(None) => "no pairs of bodies can move against each other\n".to_owned(),
            Self::Distance(Some(of)) => nearest(&of.bodies, &in_world(&of.nearest, &of.points)),
            Self::Near(pairs) => {
                let line = |NearPair { bodies: [a, b], nearest, .. }: &NearPair| {
                    format!("  {}  {}  {:?}\n", shown(a), shown(b), nearest.distance)
                };
                let lines: String = pairs.iter().map(line).collect();
                format!("{} of bodies within the margin\n{lines}", counted(pairs.len() as u64, "pair"))
            }
            Self::Motion(motion) => match End::of(motion) {
                None => "free\n".to_owned(),
                Some(End { kind, times: [free_until, at], bodies, nearest: of, .. }) => {
                    let what = if kind == HIT { "hit" } else { "undecided" };
                    format!("free until {free_until:?}, {what} at {at:?}\n{}", nearest(bodies, &of))
                }
            },
        }
    }
}

impl asking::Answer for Answer {
    fn is_positive(&self) -> bool {
        match self {
            Self::Collide(flag, _) => *flag,
            Self::Distance(_) => self.value() <= 0.0,
            Self::Near(pairs) => !pairs.is_empty(),
            Self::Motion(motion) => matches!(motion, RobotMotion::Hit { .. }),
        }
    }

    /// Returns 1 for contact, the distance, infinite if there are no pairs, the number of bodies that are near, or the time of a hit.
    fn value(&self) -> f64 {
        match self {
            Self::Collide(flag, _) => f64::from(u8::from(*flag)),
            Self::Distance(of) => of.as_ref().map_or(f64::INFINITY, |of| of.nearest.distance),
            Self::Near(pairs) => pairs.len() as f64,
            Self::Motion(RobotMotion::Hit { touching_at, .. }) => *touching_at,
            Self::Motion(_) => 0.0,
        }
    }

    fn line(&self) -> String {
        match self {
            Self::Collide(..) | Self::Distance(_) => significant(self.value()),
            Self::Near(pairs) => format!("{} {}", pairs.len(), significant(least(pairs))),
            Self::Motion(motion) => {
                End::of(motion).map_or("free".to_owned(), |End { kind, times: [free_until, at], .. }| {
                    format!("{kind} {} {}", significant(free_until), significant(at))
                })
            }
        }
    }

    fn json(&self) -> Record {
        match self {
            Self::Collide(flag, pairs) => {
                let first = pairs.first();
                let all =
                    |first| names(first).with(record! { pairs: pairs.iter().map(names).collect::<Vec<_>>() });
                record! { collide: flag }.with(first.map(all))
            }
            Self::Distance(None) => record! { distance: None::<f64> },
            Self::Distance(Some(of)) => {
                names(&of.bodies).with(asking::distance_json(&in_world(&of.nearest, &of.points)))
            }
            Self::Near(pairs) => record! { pairs: pairs.iter().map(near).collect::<Vec<_>>() },
            Self::Motion(motion) => {
                let Some(End { kind, times: [free_until, at], joints, bodies, nearest }) = End::of(motion)
                else {
                    return record! { answer: "free" };
                };
                record! { answer: kind, free_until: free_until }
                    .with(Record::of(if kind == HIT { "touching_at" } else { "at" }, &at))
                    .with(record! { joints: joints })
                    .with(names(bodies))
                    .with(asking::distance_json(&nearest))
            }
        }
    }

    /// Hashes a byte for contact, the bits of a distance, for bodies that are near the bits of their distances and derivatives, and for
    /// a motion a byte for the kind and the bits of both times.
    fn hash(&self, hasher: &mut Hasher) {
        match self {
            Self::Collide(flag, _) => hasher.update(&[u8::from(*flag)]),
            Self::Distance(_) => hasher.update(&self.value().to_bits().to_le_bytes()),
            Self::Near(pairs) => {
                for NearPair { bodies, nearest, gradient, .. } in pairs {
                    bodies.iter().for_each(|name| hasher.update(name.as_bytes()));
                    let numbers = std::iter::once(&nearest.distance).chain(gradient);
                    numbers.for_each(|number| hasher.update(&number.to_bits().to_le_bytes()));
                }
                hasher.update(&(pairs.len() as u64).to_le_bytes());
            }
            Self::Motion(motion) => {
                let (kind, times) = End::of(motion).map_or(("", [0.0; 2]), |end| (end.kind, end.times));
                hasher.update(&[u8::from(kind == HIT) + 2 * u8::from(kind == NEAR)]);
                times.iter().for_each(|time| hasher.update(&time.to_bits().to_le_bytes()));
            }
        }
    }

    fn counts<'a>(answers: impl Iterator<Item = &'a Self>) -> Option<Record> {
        let kinds: Option<Vec<&str>> = answers
            .map(|answer| match answer {
                Self::Motion(motion) => Some(End::of(motion).map_or("", |end| end.kind)),
                _ => None,
            })
            .collect();
        let kinds = kinds?;
        let count = |of: &str| kinds.iter().filter(|kind| **kind == of).count();
        Some(record! { hits: count(HIT), near: count(NEAR) })
    }
}
