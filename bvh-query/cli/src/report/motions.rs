//! Speed against error of the methods for motions: how many contacts samples miss, how late they find the others, and
//! how long they take compared with a certified answer.
//!
//! The methods take turns in rounds. Ten thousand samples take thousands of times as long as a certified answer, so
//! each method takes part in the first round, and then in as many more as fit into its share of time.

use super::page::{Column, Table, Words, figure, micro, percent};
use super::plot::{Panel, Series};
use super::timing::{order, take_turn, times};
use super::ways::{Method, SAMPLES, Said, is_hit, judge};
use super::{Kind, Measured, Subject, made};
use crate::asking::files::read_motions;
use crate::console::{Failure, Record, counted, record};
use bvh_query::{
    Backend, Bvh, Motion, MotionAnswer, MotionOptions, Pose, Querier, QueryError, RigidPath as _,
};

pub(super) const KIND: Kind<Motion> = Kind {
    words: Words {
        title: "How many samples for these motions?",
        about: ABOUT,
        right: RIGHT,
        methods: METHODS,
    },
    items: "motions",
    read: read_motions,
    make: made::motions,
    made: made::MOTIONS,
    measure,
};

const ABOUT: &str = "\
Programs often test a motion by samples: they check poses along the motion until one touches. Samples miss contacts between \
them, and find others late. cbvh certifies its results for every moment between start and end. This page tells for each pair \
of meshes what samples miss, how late they are, and how long they take compared with the certified queries.";

const RIGHT: &str = "\
No result contradicts another: where a motion is certified free, no sample touches.";

const METHODS: &str = "\
<li>Samples are equally spaced poses with both ends, checked with <code>Querier::collide</code> until one touches.</li>
<li>Certified results are those of <code>Querier::motion</code>, which finds the first contact, and of \
<code>Querier::is_free</code>, which looks for any. Both may leave a motion undecided if the meshes come nearer than a \
millionth of the smaller mesh's diagonal without touching.</li>
<li>A certified contact is missed if all samples are free. A contact is late by the time between the end of the part that is \
certified free and the contact found, as a fraction of the motion; only contacts that are not missed count.</li>
<li>Times are those of single motions on one thread, with the poses of samples made as they are needed. All ways to check take turns \
in rounds, as many as fit into 10 seconds per pair, but at least one; <code>report.csv</code> has their number. A median is \
taken over the motions of a round and then over the rounds.</li>
<li>The figures are of these motions on one machine on one day. Other motions need more samples, or fewer.</li>";

/// For how long each method asks about the motions of a pair, in seconds, unless one round takes longer.
const MAX_SECONDS: f64 = 10.0;

/// What one method says about each motion, and nanoseconds by round and motion.
type Asked = (Vec<Said>, Vec<Vec<u64>>);

/// Returns whether one more round like those before fits into the time.
fn has_time(rounds: &[Vec<u64>]) -> bool {
    let spent: u64 = rounds.iter().flatten().sum();
    let count = rounds.len() as f64;
    count == 0.0 || spent as f64 * (1.0 + 1.0 / count) <= MAX_SECONDS * 1e9
}

/// Asks by all methods, in up to this many rounds.
fn ask(
    methods: &[Method],
    meshes: [&Bvh; 2],
    motions: &[Motion],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Asked>, QueryError> {
    let times: Vec<Vec<f64>> = methods.iter().map(|method| method.times()).collect();
    let mut queriers: Vec<Querier> = methods.iter().map(|_| Querier::with_backend(backend)).collect();
    let mut all: Vec<Asked> = vec![Asked::default(); methods.len()];
    for round in 0..rounds {
        for number in order(round, methods.len()) {
            let (said, taken) = &mut all[number];
            if !has_time(taken) {
                continue;
            }
            let (querier, method) = (&mut queriers[number], methods[number]);
            let (answers, nanoseconds) =
                take_turn(motions, |motion| method.ask(&times[number], querier, meshes, motion))?;
            if round == 0 {
                *said = answers;
            }
            taken.push(nanoseconds);
        }
    }
    Ok(all)
}

/// Measures all methods on the motions of a pair.
fn measure(subject: &Subject<'_>, motions: &[Motion]) -> Result<Measured, Failure> {
    let Subject { pair, baked: [(a, _), (b, _)], backend, rounds, .. } = *subject;
    let methods: Vec<Method> = Method::all().collect();
    let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", pair.name));
    let (mut querier, options) = (Querier::with_backend(backend), MotionOptions::new());
    let certified = motions.iter().map(|motion| querier.motion(a, b, motion, &options));
    let certified = certified.collect::<Result<Vec<MotionAnswer>, QueryError>>().map_err(failed)?;
    let asked = ask(&methods, [a, b], motions, backend, rounds).map_err(failed)?;
    let count = |is: fn(&MotionAnswer) -> bool| certified.iter().filter(|answer| is(answer)).count();
    let free = count(|answer| matches!(answer, MotionAnswer::Free));
    let undecided = count(|answer| matches!(answer, MotionAnswer::Near { .. }));
    let hits = count(is_hit);
    let (mut rows, mut wrong) = (Vec::new(), Vec::new());
    for (&method, (said, rounds)) in methods.iter().zip(&asked) {
        let (errors, contradictions) = judge(&pair.name, method, &certified, said);
        wrong.extend(contradictions);
        let nanoseconds: u64 = rounds.iter().flatten().sum();
        let row = record! {
            pair: pair.name,
            method: method.name(),
            samples: method.samples(),
            motions: certified.len(),
            hits: hits,
            missed: errors.missed,
            missed_share: (hits > 0).then(|| errors.missed as f64 / hits as f64),
            late_median: errors.late_median,
            late_max: errors.late_max,
            undecided: errors.undecided,
            rounds: rounds.len(),
        };
        let mean = nanoseconds as f64 / (rounds.len() * motions.len()) as f64;
        rows.push(row.with(times(rounds)).with(record! { ns_mean: mean }));
    }
    let title = "Errors and times: what each way to ask misses, how late it is with other contacts, how long it takes";
    let named = methods.iter().map(|method| method.in_words()).zip(0..).collect();
    Ok(Measured {
        sentences: sentences(&methods, &rows, [free, undecided]),
        panels: panels(&pair.name, &methods, &rows),
        tables: vec![Table { title: title.to_owned(), columns: &COLUMNS, rows: named }],
        rows,
        wrong,
        seen: seen(motions, &certified),
        counts: vec![("free", free), ("hits", hits), ("undecided", undecided)],
        ..Measured::default()
    })
}

/// Returns the pose in which the first motion that hits touches or, if none does, the start of the first one.
fn seen(motions: &[Motion], certified: &[MotionAnswer]) -> Option<Pose> {
    let hit = motions.iter().zip(certified).find_map(|(motion, answer)| match answer {
        MotionAnswer::Hit { touching_at, .. } => Some(motion.pose(*touching_at)),
        _ => None,
    });
    hit.or_else(|| motions.first().map(|motion| motion.pose(0.0)))
}

/// The number of samples that the sentences tell of first.
const USUAL_SAMPLES: u32 = 100;

/// Returns the sentences about a pair, the most important one first.
fn sentences(methods: &[Method], rows: &[Record], [free, undecided]: [usize; 2]) -> Vec<String> {
    let row = |method: Method| methods.iter().position(|&other| other == method).map(|place| &rows[place]);
    let time = |row: &Record| row.number("ns_median").unwrap_or_default();
    let missed = |row: &Record| row.number("missed").unwrap_or_default();
    // How many times as long as the other way.
    let ratio = |row: &Record, other: &Record| figure(time(row) / time(other));
    let (Some(motion), Some(is_free)) = (row(Method::Motion), row(Method::IsFree)) else { return Vec::new() };
    let count = |name| motion.number(name).unwrap_or_default() as u64;
    let (motions, hits) = (count("motions"), count("hits"));
    let mut sentences = vec![format!(
        "{}: {hits} certified hits, {free} free, {undecided} undecided. The median time is {} \u{b5}s for the certified \
         first contact and {} \u{b5}s for the certified yes or no.",
        counted(motions, "motion"),
        micro(time(motion)),
        micro(time(is_free))
    )];
    if hits == 0 {
        sentences.push("There is no contact to miss.".to_owned());
        return sentences;
    }
    // The usual number of samples, and the one from which on all miss none.
    let misses_none = |&samples: &u32| row(Method::Ordered(samples)).is_some_and(|row| missed(row) == 0.0);
    let enough = SAMPLES.into_iter().rev().take_while(misses_none).last();
    for samples in [USUAL_SAMPLES, enough.unwrap_or(SAMPLES[SAMPLES.len() - 1])] {
        let Some(row) = row(Method::Ordered(samples)) else { continue };
        let late = row.number("late_median").zip(row.number("late_max")).map(|(median, max)| {
            let [median, max] = [median, max].map(percent);
            format!(", find the others late by {median} of the motion in the median and {max} at worst")
        });
        let late = late.unwrap_or_default();
        sentences.push(format!(
            "{samples} samples miss {} of {hits} contacts{late}, and take {} \u{b5}s, {} times as long as the certified first \
             contact and {} times as long as the certified yes or no.",
            missed(row),
            micro(time(row)),
            ratio(row, motion),
            ratio(row, is_free)
        ));
    }
    sentences.dedup();
    sentences
}

/// Returns the plots of a pair: time against the share of contacts missed, and against how late the others are found.
fn panels(pair: &str, methods: &[Method], rows: &[Record]) -> Vec<Panel> {
    let panel = |title: &str, x, field: &str| {
        let series = |(kind, [_, name]): (usize, [&'static str; 2])| {
            let of = methods.iter().zip(rows).filter(|(method, _)| method.kind() == kind);
            let points = of.filter_map(|(method, row)| {
                let at = (100.0 * row.number(field)?, row.number("ns_median")? / 1000.0);
                Some((at, Some(method.in_words())))
            });
            Series { name, is_joined: true, points: points.collect() }
        };
        let series = Method::KINDS.into_iter().enumerate().map(series).collect();
        let title = format!("{pair}: time against {title}");
        Panel { title, x, y: "median time per motion, \u{b5}s", series }
    };
    vec![
        panel("contacts missed", "contacts missed, % of the certified ones", "missed_share"),
        panel("how late contacts are found", "late in the median, % of the motion", "late_median"),
    ]
}

/// The columns of the table.
const COLUMNS: [Column; 8] = [
    ("contacts missed", "missed", figure),
    ("share missed", "missed_share", percent),
    ("late, median", "late_median", percent),
    ("late, largest", "late_max", percent),
    ("undecided", "undecided", figure),
    ("median, \u{b5}s", "ns_median", micro),
    ("90 %, \u{b5}s", "ns_p90", micro),
    ("mean, \u{b5}s", "ns_mean", micro),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_end_with_the_time() {
        let seconds = |seconds: &[u64]| {
            has_time(&seconds.iter().map(|second| vec![second * 1_000_000_000]).collect::<Vec<_>>())
        };
        assert!(seconds(&[]) && seconds(&[5]) && seconds(&[2, 2, 2, 2]));
        assert!(!seconds(&[6]) && !seconds(&[5, 5]) && !seconds(&[100]));
    }
}
