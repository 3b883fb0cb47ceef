//! Bakes one pair of meshes, asks about its motions in every way and judges the answers.

use super::asked::{Asked, ask};
use super::errors::{is_hit, judge};
use super::method::Method;
use super::row::Row;
use super::{Motions, MotionsAsked, PairRecord};
use crate::console::Failure;
use crate::report::baked::{bake_both, layout_of};
use crate::report::document::{Measured, files_of};
use crate::report::kind::Subject;
use bvh_bake::Options;
use bvh_query::{Backend, Bvh, Motion, MotionAnswer, MotionOptions, Querier, QueryError};
use cbvh_measure::motions::{MADE, mixed};
use cbvh_measure::pairs::spread_evenly;
use cbvh_measure::pin::pinned;
use cbvh_measure::spread::{Spread, mean_of_rounds};

/// The number of motions that are made for a pair without any.
const MADE_MOTIONS: usize = 60;

/// Measures all ways to ask about the given motions, or about motions that are made.
pub(super) fn measure(subject: &Subject<'_>, given: Vec<Motion>) -> Result<Measured<Motions>, Failure> {
    let Subject { pair, settings, backend, tell, .. } = *subject;
    let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", pair.name));
    tell("baking");
    let [(a, report_a), (b, report_b)] = bake_both(subject, &Options::default())?;
    let (motions_from, all) = if given.is_empty() {
        tell("making motions");
        let made = mixed(&mut Querier::with_backend(backend), &a, &b, MADE_MOTIONS).map_err(failed)?;
        (format!("made: {MADE}"), made)
    } else {
        (files_of(pair), given)
    };
    let motions = spread_evenly(&all, settings.limit());
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
    let items = MotionsAsked::new(motions_from, &certified);
    let chosen = [&report_a, &report_b].map(layout_of);
    let record = PairRecord::new(pair, [&a, &b], chosen, items, pinned);
    Ok(Measured { record, rows, wrong })
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
        pair: pair.to_owned(),
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
