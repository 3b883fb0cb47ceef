//! `cbvh scene`: runs queries about a scene of many placed meshes, for frames of moving ones.

pub(crate) mod file;
mod record;

use crate::asking::files::refuse_overwriting;
use crate::asking::runner::Run;
use crate::asking::{self, RunArguments};
use crate::console::{self, Failure};
use crate::options::not_negative;
use bvh_query::{
    Backend, OwnedShape, Pose, Querier, QueryError, Relation, Scene, SceneDistance, SceneError, ScenePair,
};
use clap::{Args, ValueEnum};
use file::{Frame, LoadedScene};
use record::Told;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh scene cell.scene frames.txt --mode collide
  cbvh scene cell.scene frames.txt --mode pairs --list
  cbvh scene cell.scene frames.txt --mode within --within 0.05 --jobs 4 --json > results.jsonl
  cbvh scene factory.cbvh --mode pairs --list

SCENE is a file made by cbvh bake --scene, or a text file. FRAMES move all instances of a baked scene; without FRAMES they \
stand where the file says. A text file has one item per line; # starts a comment, and file names are relative to it:

  mesh NAME FILE              a mesh file, which is baked in memory first, or a .cbvh file
  sphere NAME R               a ball
  capsule NAME R LENGTH       a capsule along z; LENGTH is between the centres of its caps
  box NAME X Y Z              a solid box with these sides
  cylinder NAME R LENGTH      a solid prism along z around a cylinder, at most 0.002 R larger
  cloud NAME FILE R           the points of a file, three numbers per line, each a ball
  instance NAME SHAPE POSE    a shape in the world; POSE has 12 numbers, the rows of the 3 by 4 matrix [R | t], or 7: x y z \
of the position, then x y z w of a unit quaternion
  moving NAME...              the instances that frames move, in the order of their poses
  allow NAME NAME             two instances that may touch; this pair is never checked
  margin NAME R               an instance that reaches R farther on all sides

Write names and files with spaces in quotes: \"left arm\".

Each line of FRAMES has 12 numbers for each moving instance. The query is about all pairs in which at least one instance \
moves; in a baked scene, about all pairs whose groups meet. A text file in which nothing moves takes no FRAMES: it is one \
frame, and the query is about all its pairs.

One result is printed per line, in the order of the frames: 0 or 1 (collide), the number of pairs (pairs, within, relation) \
or the distance of the nearest pair (17 digits; inf if there are no pairs). relation finds the pairs that touch, and those \
in which one instance is inside the other, wholly or in part. --list prints the pairs for a person; with --mode distance it \
prints the distances of all pairs, the nearest first.

--json prints one object per frame: frame, its number in the file, from 0; and collide (true or false), or pairs, each with \
the names a and b (and relation, as cbvh query numbers it). With --mode distance it has, for the nearest pair, a, b, \
distance, lower, upper, point_a and point_b in the world, object_a, triangle_a, object_b and triangle_b; the distance is \
null if there are no pairs. With --list it also has others, the distances of the other pairs.

--bench prints one object: the query, the times of the frames, and answers_xxh3, a hash of the results, which is the \
same for every --isa and --jobs. It is null if --budget cut the run short. --out writes the lines, each with its \
nanoseconds. They include moving the instances and, with --list, the distances of all pairs.";

/// What `scene` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct SceneArguments {
    /// A scene file, or a .cbvh file made by cbvh bake --scene
    scene: PathBuf,
    /// The poses of the moving instances, one frame per line
    frames: Option<PathBuf>,
    /// The query
    #[arg(long, value_enum, default_value = "collide")]
    mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    within: Option<f64>,
    #[command(flatten)]
    run: RunArguments,
    /// Write raw results and times to this file
    #[arg(long, value_name = "raw.txt")]
    out: Option<PathBuf>,
    /// Print the pairs of each frame for a person, with their names
    #[arg(long)]
    list: bool,
    /// Print one JSON object about all frames, with their times, and no results
    #[arg(long, conflicts_with_all = ["list", "json"])]
    bench: bool,
}

/// A question about all pairs of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Does any pair touch?
    Collide,
    /// Which pairs touch?
    Pairs,
    /// How far apart is the nearest pair?
    Distance,
    /// Which pairs are at most --within apart?
    Within,
    /// Which pairs touch, or have one inside the other?
    Relation,
}

/// Answers the question about each frame.
pub(crate) fn run(arguments: &SceneArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.run.isa)?;
    let mode = arguments.mode;
    let within = asking::within(mode == Mode::Within, arguments.within)?;
    let question = Question { mode, within, all_distances: arguments.list.then_some(backend) };
    refuse_overwriting(&arguments.out, [&arguments.scene].into_iter().chain(&arguments.frames))?;
    let is_baked = file::is_baked_scene(&arguments.scene)?;
    let (mut scene, mut frames) = if is_baked {
        let mut scene = file::open(&arguments.scene, backend)?;
        if arguments.frames.is_none() {
            scene.moving.clear();
        }
        let frames = file::read_frames(arguments.frames.as_deref(), &scene.names_of_moving())?;
        (scene, frames)
    } else {
        let text = file::read(&arguments.scene)?;
        refuse_overwriting(&arguments.out, text.files())?;
        let frames = file::read_frames(arguments.frames.as_deref(), &text.moving)?;
        (file::load(&arguments.scene, &text, &arguments.run.layout, backend)?, frames)
    };
    if arguments.run.limit > 0 {
        frames.truncate(arguments.run.limit);
    }
    let run = if arguments.run.jobs > 1 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(arguments.run.jobs)).build();
        let pool = pool.map_err(|error| Failure::from_threads(arguments.run.jobs, error))?;
        scene.scene.set_parallel(true);
        pool.install(|| ask(&mut scene, &frames, &question, arguments))
    } else {
        ask(&mut scene, &frames, &question, arguments)
    }?;
    let run = run.map(|answer| Told { scene: &scene, mode, answer });
    if let Some(out) = &arguments.out {
        run.write_raw(out)?;
    }
    if arguments.bench {
        return console::json(&record::bench(arguments, &scene, backend, &run));
    }
    if arguments.list && !arguments.run.json {
        return console::lines((1..).zip(run.answers()).map(|(number, told)| told.list(number)));
    }
    run.tell(["frame", "frames"], None, arguments.run.json)
}

/// Asks about all frames in turn.
fn ask(
    scene: &mut LoadedScene,
    frames: &[Frame],
    question: &Question,
    arguments: &SceneArguments,
) -> Result<Run<Answer>, Failure> {
    let ask = |scene: &mut LoadedScene, frame: &Frame| {
        question.ask(scene, &frame.poses).map_err(|error| blame(&error, frame, arguments))
    };
    let stats = |scene: &mut LoadedScene| {
        scene.pairs_asked += scene.scene.pairs_asked();
        scene.scene.stats()
    };
    Run::in_turn(scene, frames, ask, stats, &arguments.run)
}

/// A question with its parameter.
#[derive(Debug, Clone, Copy)]
struct Question {
    mode: Mode,
    /// The distance of `Mode::Within`, in mesh units.
    within: f64,
    /// With which backend to ask for the distances of all pairs, if they are wanted.
    all_distances: Option<Backend>,
}

/// An answer about a frame.
#[derive(Debug, Clone, PartialEq)]
enum Answer {
    /// Whether any pair touches.
    Flag(bool),
    /// The pairs that touch, or that are near enough, or that have anything in common; and these with how they lie.
    Pairs(Vec<(ScenePair, Option<Relation>)>),
    /// The nearest pair and its distance, with points in the world, `None` if there are no pairs; and with `--list` the
    /// distances of the other pairs, the nearest first.
    Nearest(Option<SceneDistance>, Option<Vec<(ScenePair, f64)>>),
}

impl Answer {
    fn of(pairs: Vec<ScenePair>) -> Self {
        Self::Pairs(pairs.into_iter().map(|pair| (pair, None)).collect())
    }
}

impl Question {
    fn ask(&self, loaded: &mut LoadedScene, frame: &[Pose]) -> Result<Answer, SceneError> {
        let LoadedScene { scene, moving, .. } = loaded;
        scene.set_poses(moving.iter().copied().zip(frame.iter().copied()))?;
        Ok(match self.mode {
            Mode::Collide => Answer::Flag(scene.collide()?),
            Mode::Pairs => Answer::of(scene.pairs_in_contact()?),
            Mode::Within => Answer::of(scene.pairs_within(self.within)?),
            Mode::Relation => {
                let related = scene.relations()?.into_iter();
                Answer::Pairs(related.map(|(pair, relation)| (pair, Some(relation))).collect())
            }
            Mode::Distance => {
                let mut found = scene.distance()?;
                let others = |backend| others(scene, found.map(|of| of.pair), backend);
                let others = self.all_distances.map(others).transpose()?;
                if let Some(SceneDistance { pair, nearest: distance, .. }) = &mut found {
                    let world = scene.pose(pair.a)?;
                    distance.point_a = world.place(distance.point_a);
                    distance.point_b = world.place(distance.point_b);
                }
                Answer::Nearest(found, others)
            }
        })
    }
}

/// Returns the distances of all pairs but the nearest one, the nearest first.
fn others(
    scene: &mut Scene,
    nearest: Option<ScenePair>,
    backend: Backend,
) -> Result<Vec<(ScenePair, f64)>, SceneError> {
    let mut found = Vec::new();
    let mut querier = Querier::with_backend(backend);
    for pair in scene.pairs_within(f64::MAX)? {
        let shape = |id| -> Result<OwnedShape, SceneError> {
            let shape = scene.shape(id)?.opened()?;
            let radius = shape.shape().radius() + scene.margin(id)?;
            Ok(shape.rounded(radius)?)
        };
        let (a, b) = (shape(pair.a)?, shape(pair.b)?);
        let Ok(pose) = Pose::relative(scene.pose(pair.a)?, scene.pose(pair.b)?) else { continue };
        if Some(pair) != nearest {
            found.push((pair, querier.distance(&a, &b, &pose)?.distance));
        }
    }
    found.sort_by(|(_, one), (_, other)| one.total_cmp(other));
    Ok(found)
}

/// Turns an error about a frame into one of the file that caused it.
fn blame(error: &SceneError, frame: &Frame, arguments: &SceneArguments) -> Failure {
    let Frame { number, line, .. } = frame;
    match error {
        SceneError::Pair { source: QueryError::Budget { .. }, .. } => {
            Failure::Limit(format!("frame {number}: {error}"))
        }
        SceneError::Pose { .. } => {
            let frames = arguments.frames.as_ref().unwrap_or(&arguments.scene);
            Failure::invalid(frames, format_args!("line {line}: {error}"))
        }
        _ => Failure::invalid(&arguments.scene, format_args!("frame {number}: {error}")),
    }
}
