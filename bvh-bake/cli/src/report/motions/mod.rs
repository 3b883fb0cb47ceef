//! Speed against error of the ways to ask about a motion: how many contacts samples miss, how late they are with the
//! others, and how long that takes beside a certified answer.

mod asked;
mod errors;
mod figure;
mod findings;
mod measured;
mod method;
mod row;
mod table;
mod text;

use super::document::{self, Limit, Measured, Settings};
use super::kind::{Kind, Subject};
use crate::asking::motions;
use crate::console::{Failure, plural};
use bvh_query::{Motion, MotionAnswer};
use cbvh_measure::plot;
use row::Row;
use serde::Serialize;
use std::path::Path;

/// The report of motions.
pub(super) struct Motions;

type Report = document::Report<Motions>;
type PairRecord = document::PairRecord<MotionsAsked>;

/// The motions that a pair was asked about, and how many are certified to end how.
#[derive(Debug, Serialize)]
pub(super) struct MotionsAsked {
    /// The names of the files, or how the motions were made.
    motions_from: String,
    motions: usize,
    free: usize,
    hits: usize,
    undecided: usize,
}

impl MotionsAsked {
    fn new(motions_from: String, certified: &[MotionAnswer]) -> Self {
        let count = |is: fn(&MotionAnswer) -> bool| certified.iter().filter(|answer| is(answer)).count();
        Self {
            motions_from,
            motions: certified.len(),
            free: count(|answer| matches!(answer, MotionAnswer::Free)),
            hits: count(errors::is_hit),
            undecided: count(|answer| matches!(answer, MotionAnswer::Near { .. })),
        }
    }
}

impl Kind for Motions {
    type Item = Motion;
    type Items = MotionsAsked;
    type Row = Row;

    const TITLE: &'static str = "How many samples for these motions?";
    const ABOUT: &'static str = text::ABOUT;
    const RIGHT: &'static str = text::RIGHT;

    fn limit(count: usize) -> Limit {
        Limit::Motions(count)
    }

    fn read(path: &Path) -> Result<Vec<Motion>, Failure> {
        motions::read(path)
    }

    fn measure(subject: &Subject<'_>, given: Vec<Motion>) -> Result<Measured<Self>, Failure> {
        measured::measure(subject, given)
    }

    fn pair_of(row: &Row) -> &str {
        &row.pair
    }

    fn sentences(report: &Report, pair: &PairRecord) -> Vec<String> {
        findings::sentences(report, pair)
    }

    fn figure(report: &Report, pair: &str) -> plot::Figure {
        figure::of_pair(report, pair)
    }

    fn items(items: &MotionsAsked) -> String {
        let MotionsAsked { motions, motions_from, .. } = items;
        format!("{motions} {} ({motions_from})", plural(*motions as u64, "motion"))
    }

    fn tables(report: &Report, pair: &str) -> String {
        table::of_pair(report, pair)
    }

    fn methods(settings: &Settings) -> String {
        text::methods(settings)
    }
}
