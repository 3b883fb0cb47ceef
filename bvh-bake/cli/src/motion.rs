//! `cbvh motion`: asks whether the way between two poses is free, and where it ends.

use crate::asking::files::{self, read_all, read_motions, write_file};
use crate::asking::mesh::{self, LoadedMesh, blame, load_both};
use crate::asking::{self, Answer, AskingArguments, Run};
use crate::console::{self, Failure, record, significant};
use crate::options::{not_negative, positive};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Motion, MotionAnswer, MotionOptions, Path as _, Querier};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh motion room.cbvh robot.cbvh edges.txt --clearance 0.01
  cbvh motion a.obj b.obj edges.txt --json > answers.jsonl
  cbvh motion a.cbvh b.cbvh --motion \"1 0 0 9  0 1 0 0  0 0 1 0   1 0 0 0  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a file of motions has 24 numbers: the pose of B in the frame of A at the start and at the end, each the rows of \
a 3 by 4 matrix. The origin of B's frame moves on a line, and B turns about one axis the shorter way, both at a constant \
rate, from time 0 to time 1. # starts a comment.

An answer is certain at every moment: free, a hit with the time until which the way is surely free and a time at which the \
meshes touch (or are at most --clearance apart), or near, if B comes so near that neither can be told within --tolerance.

One answer is printed per line, in the order of the motions: free, hit FREE_UNTIL TOUCHING_AT, or near FREE_UNTIL AT, the \
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
    /// Meshes that come as near as this count as a hit, in mesh units
    #[arg(long, value_name = "C", default_value = "0", value_parser = not_negative, allow_negative_numbers = true)]
    clearance: f64,
    /// How near B may come to a hit without a certain answer, in mesh units [default: 1e-6 of the larger diagonal]
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    #[command(flatten)]
    asking: AskingArguments,
    /// Ask about one motion, given as 24 numbers, and print the answer for a person
    #[arg(id = "one", long = "motion", value_name = "24 NUMBERS", allow_hyphen_values = true)]
    motion: Option<String>,
    /// With --motion: write the closest triangles at a hit and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    witness: Option<PathBuf>,
}

/// Answers the question about files of motions or about one motion.
pub(crate) fn run(arguments: &MotionArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.asking.isa)?;
    // Clap cannot check this: where files exclude --motion, it also waives what requires --motion.
    if arguments.witness.is_some() && arguments.motion.is_none() {
        return Err(Failure::Usage("--witness requires --motion (see --help)".into()));
    }
    let options = MotionOptions::new().clearance(arguments.clearance).tolerance(arguments.tolerance);
    let meshes = || load_both(&arguments.a, &arguments.b, &arguments.asking.how());
    if let Some(motion) = &arguments.motion {
        let motion = files::one_motion(motion)?;
        let [a, b] = &meshes()?;
        return once([a, b], &motion, &options, backend, arguments);
    }
    let files = arguments.motions.as_deref();
    let files = read_all(files, "files of motions", &arguments.asking, read_motions)?;
    let [mut a, mut b] = meshes()?;
    a.check()?;
    b.check()?;
    let ask = |querier: &mut Querier, motion: &Motion| querier.motion(a.shape(), b.shape(), motion, &options);
    let bench = |stem: &str, run: &Run<MotionAnswer>| {
        let near = run.answers.iter().filter(|(answer, _)| matches!(answer, MotionAnswer::Near { .. }));
        let hits = run.answers.iter().filter(|(answer, _)| answer.is_positive());
        let record = asking::bench(&a, Some(&b), "motion", backend, stem, run, true);
        record.with(record! { hits: hits.count(), near: near.count() })
    };
    asking::ask_files(
        &arguments.asking,
        backend,
        "motion",
        &files,
        ask,
        |error| blame(&a, Some(&b), error),
        bench,
    )
}

/// Asks about one motion, prints the answer, and writes its witness as OBJ.
fn once(
    [a, b]: [&LoadedMesh; 2],
    motion: &Motion,
    options: &MotionOptions,
    backend: Backend,
    arguments: &MotionArguments,
) -> Result<(), Failure> {
    let answer = Querier::with_backend(backend).motion(a.shape(), b.shape(), motion, options);
    let answer = answer.map_err(|error| blame(a, Some(b), error))?;
    let (mut text, end) = match &answer {
        MotionAnswer::Free => ("free\n".to_owned(), None),
        MotionAnswer::Hit { free_until, touching_at, contact } => {
            (format!("free until {free_until:?}, hit at {touching_at:?}\n"), Some((*touching_at, contact)))
        }
        MotionAnswer::Near { free_until, at, distance } => {
            let apart = distance.distance;
            let text =
                format!("free until {free_until:?}, {apart:?} mesh units apart at {at:?}, undecided\n");
            (text, Some((*at, distance)))
        }
    };
    match (end, &arguments.witness) {
        (Some((at, distance)), witness_file) => {
            text.push_str(&mesh::describe([a, b], distance));
            if let Some(path) = witness_file {
                write_file(path, &mesh::obj([a, b], &motion.pose(at), distance)?)?;
            }
        }
        (None, Some(_)) => text.push_str("no witness, because the way is free\n"),
        (None, None) => {}
    }
    if arguments.asking.json {
        let mut record = answer.json();
        record["motion"] = 0.into();
        return console::json(&record);
    }
    console::text(&text)
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
        match self {
            Self::Free => "free".to_owned(),
            Self::Hit { free_until, touching_at, .. } => {
                format!("hit {} {}", significant(*free_until), significant(*touching_at))
            }
            Self::Near { free_until, at, .. } => {
                format!("near {} {}", significant(*free_until), significant(*at))
            }
        }
    }

    fn json(&self) -> Value {
        let (answer, free_until, when, at, distance) = match self {
            Self::Free => return json!({ "answer": "free" }),
            Self::Hit { free_until, touching_at, contact } => {
                ("hit", free_until, "touching_at", touching_at, contact)
            }
            Self::Near { free_until, at, distance } => ("near", free_until, "at", at, distance),
        };
        let mut record = asking::distance_json(distance);
        record["answer"] = json!(answer);
        record["free_until"] = json!(free_until);
        record[when] = json!(at);
        record
    }

    /// Hashes a byte for the kind, and the bits of both times.
    fn hash(&self, hasher: &mut Hasher) {
        let (kind, times) = match self {
            Self::Free => (0, [0.0; 2]),
            Self::Hit { free_until, touching_at, .. } => (1, [*free_until, *touching_at]),
            Self::Near { free_until, at, .. } => (2, [*free_until, *at]),
        };
        hasher.update(&[kind]);
        times.iter().for_each(|time| hasher.update(&time.to_bits().to_le_bytes()));
    }
}
