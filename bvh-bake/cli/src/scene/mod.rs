//! `cbvh scene`: asks a scene of many placed meshes about frames of moving ones.

mod file;
mod record;

use crate::asking::files::write_file;
use crate::asking::mesh::is_baked;
use crate::asking::runner::add;
use crate::asking::{self, RunArguments};
use crate::console::{self, Failure, significant};
use crate::options::not_negative;
use bvh_query::{
    Backend, Pose, Querier, QueryError, QueryStats, Relation, Scene, SceneDistance, SceneError, ScenePair,
    SceneShape,
};
use clap::{Args, ValueEnum};
use file::{Frame, LoadedScene};
use std::path::PathBuf;
use std::time::Instant;

const HELP: &str = "\
Examples:
  cbvh scene cell.scene frames.txt --mode collide
  cbvh scene cell.scene frames.txt --mode pairs --list
  cbvh scene cell.scene frames.txt --mode within --within 0.05 --jobs 4 --json > answers.jsonl
  cbvh scene factory.cbvh --mode pairs --list

SCENE is a file that cbvh bake --scene made, all of whose instances move, or, without FRAMES, stand where the file says. Or it is a text file, one item per line; # starts a comment. File names are relative to it:

  mesh NAME FILE              a mesh file, which is baked in memory first, or a .cbvh file
  instance NAME MESH POSE     a mesh in the world; POSE has 12 numbers, the rows of the 3 by 4 matrix [R | t], or 7: x y z \
of the position, then x y z w of a unit quaternion
  moving NAME...              the instances that frames move, in the order of their poses
  allow NAME NAME             two instances that may touch, and are never asked about

Names and files with spaces are written in quotes: \"left arm\".

Each line of FRAMES has 12 numbers for each moving instance. All pairs of which at least one instance moves are asked \
about, and of a baked scene all pairs whose groups meet. \
In a scene without moving instances there is one frame, without FRAMES, and all pairs are asked about.

One answer is printed per line, in the order of the frames: 0 or 1 (collide), the number of pairs (pairs, within, relation) \
or the distance of the nearest pair (17 digits; inf if there are no pairs). --list prints for a person which pairs they are, and for distance the distances of all pairs, the nearest first. \
relation finds the pairs that touch or of which one is inside the other, wholly or in part.

--json prints one object per frame: frame, its number in the file, from 0; collide (true or false), or pairs, each with the \
names a and b (and relation, as cbvh query numbers it), or of the nearest pair a, b, distance, lower, upper, point_a and \
point_b in the world, object_a, triangle_a, object_b and triangle_b; the distance is null if there are no pairs. --bench \
prints one object: what was asked, the times of the frames, and answers_xxh3, which is the same for every --isa and --jobs; \
it is null if --budget cut the run short. --out writes the lines, each with nanoseconds, which include moving the instances and, with --list, the distances of all pairs.";

/// What `scene` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct SceneArguments {
    /// The meshes, where they are, and what moves
    scene: PathBuf,
    /// The poses of the moving instances, one frame per line
    frames: Option<PathBuf>,
    /// The question
    #[arg(long, value_enum, default_value = "collide")]
    mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    within: Option<f64>,
    #[command(flatten)]
    run: RunArguments,
    /// Write raw answers and times to this file
    #[arg(long, value_name = "raw.txt")]
    out: Option<PathBuf>,
    /// Print the pairs of each frame for a person, with their names
    #[arg(long)]
    list: bool,
    /// Print one JSON object about all frames, with their times, and no answers
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
    let question = Question::new(arguments, backend)?;
    let extension = arguments.scene.extension().unwrap_or_default().to_ascii_lowercase();
    let is_baked = is_baked(&arguments.scene)?;
    if !is_baked && (extension == "glb" || extension == "gltf") {
        let name = arguments.scene.display();
        return Err(Failure::Invalid(format!(
            "{name}: expected a scene file, found glTF; bake it first: cbvh bake {name} --scene -o scene.cbvh"
        )));
    }
    let (mut scene, mut frames) = if is_baked {
        let mut scene = file::open(&arguments.scene, backend)?;
        let frames = if let Some(path) = &arguments.frames {
            file::read_frames(Some(path), &scene.names_of_moving())?
        } else {
            scene.moving.clear();
            file::as_it_stands()
        };
        (scene, frames)
    } else {
        let text = file::read(&arguments.scene)?;
        let frames = file::read_frames(arguments.frames.as_deref(), &text.moving)?;
        (file::load(&arguments.scene, &text, &arguments.run.layout, backend)?, frames)
    };
    if arguments.run.limit > 0 {
        frames.truncate(arguments.run.limit);
    }
    let run = if arguments.run.jobs > 1 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(arguments.run.jobs)).build();
        let pool = pool.map_err(|error| {
            Failure::System(format!("--jobs {}: cannot start threads: {error}", arguments.run.jobs))
        })?;
        scene.scene.set_parallel(true);
        pool.install(|| Run::new(&mut scene, &frames, &question, arguments))
    } else {
        Run::new(&mut scene, &frames, &question, arguments)
    }?;
    if let Some(out) = &arguments.out {
        write_file(out, &record::raw(&run))?;
    }
    if arguments.bench {
        return console::json(&record::bench(arguments, &scene, backend, &question, &run));
    }
    let answers = run.answers.iter().map(|(answer, _)| answer);
    if arguments.run.json {
        console::lines((0..).zip(answers).map(|(number, answer)| record::json(&scene, number, answer)))
    } else if arguments.list {
        console::lines(
            (1..).zip(answers).map(|(number, answer)| record::list(&scene, &question, number, answer)),
        )
    } else {
        console::lines(answers.map(|answer| significant(answer.value())))
    }
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
    Nearest(Option<SceneDistance>, Vec<(ScenePair, f64)>),
}

impl Answer {
    fn of(pairs: Vec<ScenePair>) -> Self {
        Self::Pairs(pairs.into_iter().map(|pair| (pair, None)).collect())
    }

    /// Returns the answer as a number: the distance of no pairs is infinite.
    fn value(&self) -> f64 {
        match self {
            Self::Flag(flag) => f64::from(u8::from(*flag)),
            Self::Pairs(pairs) => pairs.len() as f64,
            Self::Nearest(nearest, _) => nearest.map_or(f64::INFINITY, |of| of.nearest.distance),
        }
    }

    /// Returns true if a pair touches, is near enough or has anything in common.
    fn is_positive(&self) -> bool {
        match self {
            Self::Nearest(..) => self.value() <= 0.0,
            _ => self.value() > 0.0,
        }
    }
}

impl Question {
    /// Takes the question from the command line.
    fn new(arguments: &SceneArguments, backend: Backend) -> Result<Self, Failure> {
        match (arguments.mode, arguments.within) {
            (Mode::Within, None) => {
                Err(Failure::Usage("--mode within requires --within D (see --help)".into()))
            }
            (mode, Some(_)) if mode != Mode::Within => {
                Err(Failure::Usage("--within requires --mode within (see --help)".into()))
            }
            (mode, within) => {
                let all_distances = (arguments.list && !arguments.run.json).then_some(backend);
                Ok(Self { mode, within: within.unwrap_or(0.0), all_distances })
            }
        }
    }

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
                let others = match self.all_distances {
                    Some(backend) => others(scene, found.map(|of| of.pair), backend)?,
                    None => Vec::new(),
                };
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
        let (SceneShape::Open(a), SceneShape::Open(b)) = (scene.shape(pair.a)?, scene.shape(pair.b)?) else {
            continue;
        };
        let Ok(pose) = Pose::relative(scene.pose(pair.a)?, scene.pose(pair.b)?) else { continue };
        if Some(pair) != nearest {
            found.push((pair, querier.distance(a.shape(), b.shape(), &pose)?.distance));
        }
    }
    found.sort_by(|(_, one), (_, other)| one.total_cmp(other));
    Ok(found)
}

/// The results of a run.
struct Run {
    /// The answers and their nanoseconds, in the order of the frames. There are fewer than frames if the budget ended.
    answers: Vec<(Answer, u64)>,
    requested: usize,
    total_seconds: f64,
    stats: QueryStats,
    /// The number of pairs that were asked about.
    pairs_asked: u64,
}

impl Run {
    fn new(
        scene: &mut LoadedScene,
        frames: &[Frame],
        question: &Question,
        arguments: &SceneArguments,
    ) -> Result<Self, Failure> {
        let budget = arguments.run.budget.unwrap_or(f64::INFINITY);
        let start = Instant::now();
        for frame in frames.iter().rev().take(arguments.run.warm) {
            if start.elapsed().as_secs_f64() >= budget / 4.0 {
                break;
            }
            // The timed part meets the same error again, with its frame.
            let _ = question.ask(scene, &frame.poses);
        }
        let mut run = Self {
            answers: Vec::with_capacity(frames.len()),
            requested: frames.len(),
            total_seconds: 0.0,
            stats: QueryStats::default(),
            pairs_asked: 0,
        };
        let start = Instant::now();
        for (number, frame) in (1..).zip(frames) {
            let before = Instant::now();
            let answer = question.ask(scene, &frame.poses);
            let nanoseconds = before.elapsed().as_nanos() as u64;
            let answer = answer.map_err(|error| blame(&error, number, frame.line, arguments))?;
            run.answers.push((answer, nanoseconds));
            add(&mut run.stats, scene.scene.stats());
            run.pairs_asked += scene.scene.pairs_asked();
            if start.elapsed().as_secs_f64() > budget {
                break;
            }
        }
        run.total_seconds = start.elapsed().as_secs_f64();
        Ok(run)
    }
}

/// Turns an error about a frame into one of the file that caused it.
fn blame(error: &SceneError, number: usize, line: usize, arguments: &SceneArguments) -> Failure {
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
