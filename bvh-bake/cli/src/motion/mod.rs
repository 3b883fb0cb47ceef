//! `cbvh motion`: asks whether the way between two poses is free, and where it ends, timing each motion.

mod arguments;
pub(crate) mod file;

pub(crate) use arguments::MotionArguments;

use crate::console::{self, Failure, plural};
use crate::query::listing::time;
use crate::query::number::significant;
use crate::query::record::{Record, Summed};
use crate::query::runner::{self, Limits, Run};
use crate::query::side::{How, Side, Sides};
use crate::query::{once, stem, write_file};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Motion, MotionAnswer, MotionOptions, Path as _, Querier, ReadAhead};
use serde::Serialize;
use std::fmt::Write;
use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};

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
    let backend = crate::query::backend(&arguments.isa)?;
    // Clap cannot check this: where files exclude --motion, it also waives what requires --motion.
    if arguments.witness.is_some() && arguments.motion.is_none() {
        return Err(Failure::Usage("--witness requires --motion (see --help)".into()));
    }
    let options = MotionOptions::new().clearance(arguments.clearance).tolerance(arguments.tolerance);
    let how =
        How { layout: &arguments.layout, object: arguments.object.as_deref(), read_ahead: ReadAhead::Usual };
    let sides = || -> Result<(Side, Side), Failure> {
        let (mut a, mut b) = (Side::load(&arguments.a, &how)?, Side::load(&arguments.b, &how)?);
        a.check()?;
        b.check()?;
        Ok((a, b))
    };
    if let Some(motion) = &arguments.motion {
        let motion = file::parse_one(motion)?;
        let (a, b) = sides()?;
        return once(&Sides { a: &a, b: &b }, &motion, &options, backend, arguments.witness.as_deref());
    }
    let files = arguments.motions.as_deref().unwrap_or_default().split(',').filter(|name| !name.is_empty());
    let files: Vec<PathBuf> = files.map(PathBuf::from).collect();
    if files.is_empty() {
        return Err(Failure::Usage("expected files of motions, found none (see --help)".into()));
    }
    if files.len() > 1 && arguments.out.as_ref().is_some_and(|out| !out.contains("%s")) {
        let text = "--out: expected %s in the name, because there are several files (see --help)";
        return Err(Failure::Usage(text.into()));
    }
    let motions = files.iter().map(|file| file::read(file)).collect::<Result<Vec<_>, _>>()?;
    let (a, b) = sides()?;
    let sides = Sides { a: &a, b: &b };
    let limits = Limits { jobs: usize::from(arguments.jobs), warm: arguments.warm, budget: arguments.budget };
    for (file, mut motions) in files.iter().zip(motions) {
        if arguments.limit > 0 {
            motions.truncate(arguments.limit);
        }
        let ask = |querier: &mut Querier, motion: &Motion| {
            let (a, b) = sides.shapes();
            querier.motion(a, b, motion, &options)
        };
        let run = runner::run(&motions, ask, backend, &limits).map_err(|error| sides.blame(error))?;
        tell(arguments, &sides, backend, &stem(file), &run)?;
    }
    Ok(())
}

/// Writes the raw answers about a file, if asked to, and prints the answers for a person or the JSON line.
fn tell(
    arguments: &MotionArguments,
    sides: &Sides<'_>,
    backend: Backend,
    stem: &str,
    run: &Run<MotionAnswer>,
) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        let lines: String =
            run.answers.iter().map(|(answer, ns)| format!("{} {ns}\n", raw(answer))).collect();
        write_file(Path::new(&out.replacen("%s", stem, 1)), &lines)?;
    }
    let count =
        |is: fn(&MotionAnswer) -> bool| run.answers.iter().filter(|(answer, _)| is(answer)).count() as u64;
    let hits = count(|answer| matches!(answer, MotionAnswer::Hit { .. }));
    let near = count(|answer| matches!(answer, MotionAnswer::Near { .. }));
    if arguments.json || !stdout().is_terminal() {
        let times = run.answers.iter().filter_map(|(answer, _)| match answer {
            MotionAnswer::Hit { touching_at, .. } => Some(*touching_at),
            _ => None,
        });
        let complete = run.answers.len() == run.requested;
        let summed = Summed {
            mode: "motion",
            positives: hits,
            sum: times.sum(),
            answers: complete.then(|| hash(run)),
        };
        return console::json(&MotionRecord {
            record: Record::new(sides, summed, backend, stem, run),
            hits,
            near,
        });
    }
    let mut text = String::new();
    for (number, (answer, _)) in (1..).zip(&run.answers) {
        // Writing to text in memory cannot fail.
        let _ = writeln!(text, "motion {number}: {}", in_words(answer));
    }
    let mut times: Vec<u64> = run.answers.iter().map(|&(_, nanoseconds)| nanoseconds).collect();
    times.sort_unstable();
    let [median, p90, slowest] =
        [0.5, 0.9, 1.0].map(|fraction| time(cbvh_measure::spread::quantile(&times, fraction)));
    let _ = writeln!(
        text,
        "{stem}: answered {} of {} {}, {hits} hit, {near} near; per motion: median {median}, 90 % below {p90}, slowest \
         {slowest} ({}, {} {})",
        run.answers.len(),
        run.requested,
        plural(run.requested as u64, "motion"),
        backend.name(),
        run.jobs,
        plural(run.jobs as u64, "thread"),
    );
    console::text(&text)
}

/// Asks about one motion and prints the answer.
fn once(
    sides: &Sides<'_>,
    motion: &Motion,
    options: &MotionOptions,
    backend: Backend,
    witness: Option<&Path>,
) -> Result<(), Failure> {
    let (a, b) = sides.shapes();
    let answer = Querier::with_backend(backend).motion(a, b, motion, options);
    let answer = answer.map_err(|error| sides.blame(error))?;
    let mut text = format!("{}\n", in_words(&answer));
    let (at, distance) = match &answer {
        MotionAnswer::Free => {
            if witness.is_some() {
                text.push_str("no witness, because the way is free\n");
            }
            return console::text(&text);
        }
        MotionAnswer::Hit { touching_at, contact, .. } => (*touching_at, contact),
        MotionAnswer::Near { at, distance, .. } => (*at, distance),
    };
    text.push_str(&once::describe(sides, distance));
    if let Some(path) = witness {
        write_file(path, &once::witness_obj(sides, &motion.pose(at), distance)?)?;
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

/// Returns a raw line, without nanoseconds.
fn raw(answer: &MotionAnswer) -> String {
    match answer {
        MotionAnswer::Free => "free".to_owned(),
        MotionAnswer::Hit { free_until, touching_at, .. } => {
            format!("hit {} {}", significant(*free_until), significant(*touching_at))
        }
        MotionAnswer::Near { free_until, at, .. } => {
            format!("near {} {}", significant(*free_until), significant(*at))
        }
    }
}

/// Returns XXH3-64 of the answers without their times: a byte for the kind, and the bits of both times.
fn hash(run: &Run<MotionAnswer>) -> u64 {
    let mut hasher = Hasher::default();
    for (answer, _) in &run.answers {
        let (kind, times) = match answer {
            MotionAnswer::Free => (0, [0.0; 2]),
            MotionAnswer::Hit { free_until, touching_at, .. } => (1, [*free_until, *touching_at]),
            MotionAnswer::Near { free_until, at, .. } => (2, [*free_until, *at]),
        };
        hasher.update(&[kind]);
        times.iter().for_each(|time| hasher.update(&time.to_bits().to_le_bytes()));
    }
    hasher.finish()
}
