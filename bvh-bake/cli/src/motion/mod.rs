//! `cbvh motion`: asks whether the way between two poses is free, and where it ends, timing each motion.

mod arguments;

pub(crate) use arguments::MotionArguments;

use crate::asking::files::{read_all, write_file};
use crate::asking::mesh::{LoadedMesh, blame, load_both};
use crate::asking::runner::{self, Run};
use crate::asking::{self, Answer, AskingArguments, Record, motions, witness};
use crate::console::{self, Failure, significant};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Motion, MotionAnswer, MotionOptions, Path as _, Querier};
use serde::Serialize;
use std::path::Path;

/// The JSON line: that of a query, and how many motions end how.
#[derive(Serialize)]
struct MotionRecord {
    #[serde(flatten)]
    record: Record,
    hits: u64,
    near: u64,
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
        let motion = motions::parse_one(motion)?;
        let [a, b] = &meshes()?;
        return once([a, b], &motion, &options, backend, arguments.witness.as_deref());
    }
    let files = arguments.motions.as_deref();
    let files = read_all(files, "files of motions", &arguments.asking, motions::read)?;
    let [mut a, mut b] = meshes()?;
    a.check()?;
    b.check()?;
    for (stem, motions) in &files {
        let ask =
            |querier: &mut Querier, motion: &Motion| querier.motion(a.shape(), b.shape(), motion, &options);
        let run = runner::run(motions, ask, backend, &arguments.asking.limits());
        let run = run.map_err(|error| blame(&a, Some(&b), error))?;
        let record = Record::new(&a, Some(&b), "motion", backend, stem, &run);
        tell(&arguments.asking, record, stem, &run)?;
    }
    Ok(())
}

/// Writes and prints the answers about a file.
fn tell(
    arguments: &AskingArguments,
    record: Record,
    stem: &str,
    run: &Run<MotionAnswer>,
) -> Result<(), Failure> {
    let near = run.answers.iter().filter(|(answer, _)| matches!(answer, MotionAnswer::Near { .. })).count();
    let record = MotionRecord { hits: record.positives, near: near as u64, record };
    asking::tell(arguments, stem, run, &record, || {
        let MotionRecord { record, hits, near } = &record;
        record.listing(run, "motion", &format!("{hits} hit, {near} near"), in_words)
    })
}

/// Asks about one motion and prints the answer.
fn once(
    [a, b]: [&LoadedMesh; 2],
    motion: &Motion,
    options: &MotionOptions,
    backend: Backend,
    witness_file: Option<&Path>,
) -> Result<(), Failure> {
    let answer = Querier::with_backend(backend).motion(a.shape(), b.shape(), motion, options);
    let answer = answer.map_err(|error| blame(a, Some(b), error))?;
    let mut text = format!("{}\n", in_words(&answer));
    let (at, distance) = match &answer {
        MotionAnswer::Free => {
            if witness_file.is_some() {
                text.push_str("no witness, because the way is free\n");
            }
            return console::text(&text);
        }
        MotionAnswer::Hit { touching_at, contact, .. } => (*touching_at, contact),
        MotionAnswer::Near { at, distance, .. } => (*at, distance),
    };
    text.push_str(&witness::describe([a, b], distance));
    if let Some(path) = witness_file {
        write_file(path, &witness::obj([a, b], &motion.pose(at), distance)?)?;
    }
    console::text(&text)
}

/// Returns an answer in words.
fn in_words(answer: &MotionAnswer) -> String {
    match answer {
        MotionAnswer::Free => "free".to_owned(),
        MotionAnswer::Hit { free_until, touching_at, .. } => {
            format!("free until {free_until:?}, hit at {touching_at:?}")
        }
        MotionAnswer::Near { free_until, at, distance } => {
            format!(
                "free until {free_until:?}, {:?} mesh units apart at {at:?}, undecided",
                distance.distance
            )
        }
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

    fn raw(&self) -> String {
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
