//! Speed against error of the ways to ask about a motion: how many contacts samples miss, how late they are with the
//! others, and how long that takes beside a certified answer.
//!
//! The ways take turns in rounds. Ten thousand samples take thousands of times as long as a certified answer, so each way
//! asks in the first round, and then in as many more as fit into its share of time.

mod errors;
mod method;
mod section;

use super::meshes::{bake_both, layout_of};
use super::{Cells, Kind, Limit, Measured, PairRecord, SideRecord, Subject, files_of};
use crate::asking::motions;
use crate::console::Failure;
use bvh_bake::Options;
use bvh_query::{Backend, Bvh, Motion, MotionAnswer, MotionOptions, Querier, QueryError};
use cbvh_measure::motions::{MADE, mixed};
use cbvh_measure::pin::pinned;
use cbvh_measure::rounds::{order, take_turn};
use cbvh_measure::spread::{Spread, mean_of_rounds};
use cbvh_measure::table::{self, Cell};
use errors::{Errors, is_hit, judge};
use method::{Asker, Method, Said};

pub(super) const KIND: Kind<Motion> =
    Kind { words: section::WORDS, limit: Limit::Motions, read: motions::read, measure };

/// The number of motions that are made for a pair without any.
const MADE_MOTIONS: usize = 60;
/// For how long each way asks about the motions of a pair, in seconds, unless one round takes longer.
const MAX_SECONDS: f64 = 10.0;

/// What is said in one way, and how long that takes.
#[derive(Debug, Clone, Default)]
struct Asked {
    /// By motion.
    said: Vec<Said>,
    /// Nanoseconds by round and motion.
    rounds: Vec<Vec<u64>>,
}

impl Asked {
    /// Returns whether one more round like those before fits into the time.
    fn has_time(&self) -> bool {
        let spent: u64 = self.rounds.iter().flatten().sum();
        let count = self.rounds.len() as f64;
        count == 0.0 || spent as f64 * (1.0 + 1.0 / count) <= MAX_SECONDS * 1e9
    }

    fn add(&mut self, answers: Vec<(Said, u64)>) {
        if self.rounds.is_empty() {
            self.said = answers.iter().map(|&(said, _)| said).collect();
        }
        self.rounds.push(answers.into_iter().map(|(_, nanoseconds)| nanoseconds).collect());
    }
}

/// Asks in all ways, in up to so many rounds.
fn ask(
    methods: &[Method],
    meshes: [&Bvh; 2],
    motions: &[Motion],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Asked>, QueryError> {
    let askers: Vec<Asker> = methods.iter().map(|&method| Asker::new(method)).collect();
    let mut queriers: Vec<Querier> = methods.iter().map(|_| Querier::with_backend(backend)).collect();
    let mut all = vec![Asked::default(); methods.len()];
    for round in 0..rounds {
        for number in order(round, methods.len()) {
            if !all[number].has_time() {
                continue;
            }
            let querier = &mut queriers[number];
            let answers = take_turn(motions, |motion| askers[number].ask(querier, meshes, motion))?;
            all[number].add(answers);
        }
    }
    Ok(all)
}

/// A row: one way to ask about the motions of one pair of meshes.
#[derive(Debug, Clone)]
struct Row {
    method: Method,
    motions: u64,
    /// Certified hits.
    hits: u64,
    errors: Errors,
    /// How many rounds fitted into the time.
    rounds: u64,
    time: Option<Spread>,
    /// The mean time, in nanoseconds.
    mean: Option<f64>,
}

impl Row {
    /// The share of the certified hits that are missed; `None` if there are none.
    fn missed_share(&self) -> Option<f64> {
        (self.hits > 0).then(|| self.errors.missed as f64 / self.hits as f64)
    }

    /// The median time in nanoseconds.
    fn nanoseconds(&self) -> Option<f64> {
        self.time.map(|time| time.median)
    }

    fn cells(&self, pair: &str) -> Cells {
        let mut cells = vec![
            ("pair", Cell::text(pair)),
            ("method", Cell::text(self.method.name())),
            ("samples", Cell::count(self.method.samples().map(u64::from))),
            ("motions", Cell::Count(self.motions)),
            ("hits", Cell::Count(self.hits)),
            ("missed", Cell::Count(self.errors.missed)),
            ("missed_share", Cell::number(self.missed_share())),
            ("late_median", Cell::number(self.errors.late_median)),
            ("late_max", Cell::number(self.errors.late_max)),
            ("undecided", Cell::count(self.errors.undecided)),
            ("rounds", Cell::Count(self.rounds)),
        ];
        cells.extend(table::times(["ns_median", "ns_q1", "ns_q3", "ns_p90"], self.time));
        cells.push(("ns_mean", Cell::number(self.mean)));
        cells
    }
}

/// Measures all ways to ask about the given motions, or about motions that are made.
fn measure(subject: &Subject<'_>, given: Vec<Motion>) -> Result<Measured, Failure> {
    let Subject { pair, settings, backend, tell, .. } = *subject;
    let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", pair.name));
    tell("baking");
    let [(a, report_a), (b, report_b)] = bake_both(subject, &Options::default())?;
    let (from, all) = if given.is_empty() {
        tell("making motions");
        let made = mixed(&mut Querier::with_backend(backend), &a, &b, MADE_MOTIONS).map_err(failed)?;
        (format!("made: {MADE}"), made)
    } else {
        (files_of(pair), given)
    };
    let motions = settings.some_of(&all);
    tell("measuring");
    let methods: Vec<Method> = Method::all().collect();
    let (pinned, answers) = pinned(|| {
        let certified = certified([&a, &b], &motions, backend)?;
        Ok((certified, ask(&methods, [&a, &b], &motions, backend, settings.rounds)?))
    });
    let (certified, asked) = answers.map_err(failed)?;
    let (mut rows, mut wrong) = (Vec::new(), Vec::new());
    for (&method, asked) in methods.iter().zip(&asked) {
        let (row, contradictions) = row(&pair.name, method, &certified, asked);
        rows.push(row);
        wrong.extend(contradictions);
    }
    let count = |is: fn(&MotionAnswer) -> bool| certified.iter().filter(|answer| is(answer)).count();
    let free = count(|answer| matches!(answer, MotionAnswer::Free));
    let undecided = count(|answer| matches!(answer, MotionAnswer::Near { .. }));
    let items = serde_json::json!({
        "motions_from": from, "motions": motions.len(), "free": free, "hits": count(is_hit), "undecided": undecided,
    });
    let section = section::section(&pair.name, &rows, [free, undecided], &from);
    let [a, b] = [(&pair.a, &a, &report_a), (&pair.b, &b, &report_b)]
        .map(|(path, bvh, report)| SideRecord::new(path, bvh, layout_of(report)));
    let record = PairRecord { name: pair.name.clone(), a, b, items, pinned, section };
    Ok(Measured { record, rows: rows.iter().map(|row| row.cells(&pair.name)).collect(), wrong })
}

/// Returns the certified answers, which the others are compared with.
fn certified(
    [a, b]: [&Bvh; 2],
    motions: &[Motion],
    backend: Backend,
) -> Result<Vec<MotionAnswer>, QueryError> {
    let mut querier = Querier::with_backend(backend);
    let options = MotionOptions::new();
    motions.iter().map(|motion| querier.motion(a, b, motion, &options)).collect()
}

/// Returns the row of one way to ask, and a line for each contradiction.
fn row(pair: &str, method: Method, certified: &[MotionAnswer], asked: &Asked) -> (Row, Vec<String>) {
    let (errors, contradictions) = judge(pair, method, certified, &asked.said);
    let row = Row {
        method,
        motions: certified.len() as u64,
        hits: certified.iter().filter(|answer| is_hit(answer)).count() as u64,
        errors,
        rounds: asked.rounds.len() as u64,
        time: Spread::of_rounds(&asked.rounds),
        mean: mean_of_rounds(&asked.rounds),
    };
    (row, contradictions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_end_with_the_time() {
        let seconds = |seconds: &[u64]| {
            let rounds = seconds.iter().map(|second| vec![second * 1_000_000_000]).collect();
            Asked { said: Vec::new(), rounds }.has_time()
        };
        assert!(seconds(&[]) && seconds(&[5]) && seconds(&[2, 2, 2, 2]));
        assert!(!seconds(&[6]) && !seconds(&[5, 5]) && !seconds(&[100]));
    }
}
