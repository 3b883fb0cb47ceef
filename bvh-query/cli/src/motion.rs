//! `cbvh motion`: checks whether motions between two poses are free, and when they first touch.

use crate::asking::files::{self, read_all, read_motions, refuse_overwriting, write_file};
use crate::asking::mesh;
use crate::asking::{self, Answer, AskingArguments, Session};
use crate::console::{Failure, Record, record, significant};
use crate::options::{not_negative, positive};
use bvh_format::checksum::Hasher;
use bvh_query::{Distance, Motion, MotionAnswer, MotionOptions, Querier, RigidPath as _, Shape};
use clap::Args;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh motion room.cbvh robot.cbvh edges.txt --clearance 0.01
  cbvh motion a.obj b.obj edges.txt --json > results.jsonl
  cbvh motion a.cbvh b.cbvh --motion \"1 0 0 9  0 1 0 0  0 0 1 0   1 0 0 0  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a file of motions has 24 numbers: the pose of B in the frame of A at the start and at the end, each the rows of \
a 3 by 4 matrix. The origin of B's frame moves on a line, and B turns about one axis the shorter way, both at a constant \
rate, from time 0 to time 1. # starts a comment.

Results hold for every moment of the motion. free: the meshes do not touch. hit: the motion is certified free until the \
first time, and at the second time the meshes touch, or are at most --clearance apart. near: the motion is certified free \
until the first time, and at the second time B is so close that neither free nor hit can be certified within --tolerance.

One result is printed per line, in the order of the motions: free, hit FREE_UNTIL TOUCHING_AT, or near FREE_UNTIL AT, the \
times with 17 digits. --json prints one object per motion: motion, its number in the file, from 0; motions, the name of the \
file, if there are several; answer (free, hit or near), free_until, touching_at or at, and at that time the fields of cbvh \
query --mode distance --json. --bench prints one object per file: the fields of cbvh query --bench, hits and near. --out \
writes the lines, each with its nanoseconds; %s stands for the name of the file.";

/// What `motion` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct MotionArguments {
    /// The first mesh: a .cbvh file, or a mesh file that is baked in memory first
    a: PathBuf,
    /// The second mesh, which moves
    b: PathBuf,
    /// Files of motions, separated by commas
    #[arg(value_name = "MOTIONS[,MOTIONS...]", required_unless_present = "one", conflicts_with = "one")]
    motions: Option<String>,
    /// Meshes that are at most this far apart count as a hit, in mesh units
    #[arg(long, value_name = "C", default_value = "0", value_parser = not_negative, allow_negative_numbers = true)]
    clearance: f64,
    /// How far beyond the clearance the result may be near, in mesh units [default: 1e-6 of the smaller diagonal]
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    #[command(flatten)]
    asking: AskingArguments,
    /// Query one motion, given as 24 numbers, and print the result for a person
    #[arg(id = "one", long = "motion", value_name = "24 NUMBERS", allow_hyphen_values = true, conflicts_with_all = asking::OF_FILES)]
    motion: Option<String>,
    /// With --motion: write the closest triangles at a hit and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    witness: Option<PathBuf>,
}

/// Answers the question about files of motions or about one motion.
pub(crate) fn run(arguments: &MotionArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.asking.run.isa)?;
    // Clap cannot check this: where files exclude --motion, it also waives what requires --motion.
    if arguments.witness.is_some() && arguments.motion.is_none() {
        return Err(Failure::usage("--witness requires --motion"));
    }
    let options = MotionOptions::new().clearance(arguments.clearance).tolerance(arguments.tolerance);
    let what = (backend, ["motion", "motions"], "motion".to_owned(), true);
    let session = || Session::load(&arguments.asking, what, &arguments.a, Some(&arguments.b));
    let ask = |querier: &mut Querier, [a, b]: [Shape<'_>; 2], motion: &Motion| {
        querier.motion(a, b, motion, &options)
    };
    let meshes = [&arguments.a, &arguments.b];
    let Some(motion) = &arguments.motion else {
        let files = arguments.motions.as_deref();
        let files = read_all(files, "files of motions", &arguments.asking, &meshes, read_motions)?;
        let session = session()?;
        return session.ask_files(&files, |querier, motion| ask(querier, session.shapes(), motion));
    };
    refuse_overwriting(&arguments.witness, meshes)?;
    let motion = files::one_motion(motion)?;
    let session = session()?;
    let answer = session.ask(|querier| ask(querier, session.shapes(), &motion))?;
    let mut text = "free\n".to_owned();
    if let Some((kind, [free_until, at], distance)) = end(&answer) {
        text = match (kind, distance.distance) {
            (HIT, _) => format!("free until {free_until:?}, hit at {at:?}\n"),
            (_, apart) => {
                format!("free until {free_until:?}, {apart:?} mesh units apart at {at:?}, undecided\n")
            }
        };
        let moves = session.meshes().map(|mesh| mesh.shape().max_move());
        text.push_str(&mesh::describe(session.meshes(), distance, moves));
        if let Some(path) = &arguments.witness {
            write_file(path, &mesh::obj(session.meshes(), &motion.pose(at), distance)?)?;
        }
    } else if arguments.witness.is_some() {
        text.push_str("no witness, because the motion is free\n");
    }
    session.tell_one(&answer, &text)
}

/// The names of answers that are not free.
const HIT: &str = "hit";
const NEAR: &str = "near";

/// Returns what an answer has unless the motion is free: its name, the time until which the motion is free and the time at
/// which it is not, and the distance at that time.
fn end(answer: &MotionAnswer) -> Option<(&'static str, [f64; 2], &Distance)> {
    match answer {
        MotionAnswer::Free => None,
        MotionAnswer::Hit { free_until, touching_at, nearest } => {
            Some((HIT, [*free_until, *touching_at], nearest))
        }
        MotionAnswer::Near { free_until, at, nearest } => Some((NEAR, [*free_until, *at], nearest)),
    }
}

impl Answer for MotionAnswer {
    fn is_positive(&self) -> bool {
        matches!(self, Self::Hit { .. })
    }

    /// Returns the time of a hit.
    fn value(&self) -> f64 {
        if let Self::Hit { touching_at, .. } = self { *touching_at } else { 0.0 }
    }

    fn line(&self) -> String {
        end(self).map_or("free".to_owned(), |(kind, [free_until, at], _)| {
            format!("{kind} {} {}", significant(free_until), significant(at))
        })
    }

    fn json(&self) -> Record {
        let Some((kind, [free_until, at], nearest)) = end(self) else { return record! { answer: "free" } };
        record! { answer: kind, free_until: free_until }
            .with(Record::of(if kind == HIT { "touching_at" } else { "at" }, &at))
            .with(asking::distance_json(nearest))
    }

    /// Hashes a byte for the kind, and the bits of both times.
    fn hash(&self, hasher: &mut Hasher) {
        let (kind, times) = end(self).map_or(("", [0.0; 2]), |(kind, times, _)| (kind, times));
        hasher.update(&[u8::from(kind == HIT) + 2 * u8::from(kind == NEAR)]);
        times.iter().for_each(|time| hasher.update(&time.to_bits().to_le_bytes()));
    }

    fn counts<'a>(answers: impl Iterator<Item = &'a Self>) -> Option<Record> {
        let kinds: Vec<&str> = answers.filter_map(end).map(|(kind, ..)| kind).collect();
        let count = |of: &str| kinds.iter().filter(|kind| **kind == of).count();
        Some(record! { hits: count(HIT), near: count(NEAR) })
    }
}
