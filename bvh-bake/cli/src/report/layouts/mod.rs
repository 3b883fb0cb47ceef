//! Which layout suits these meshes: how fast each one answers, how many bytes it takes, and with what error.
//!
//! Each pair is baked in every profile with every encoding of triangles, asked in all its poses, and judged.

mod answers;
mod best;
mod figure;
mod layout;
mod measured;
mod pareto;
mod row;
mod tables;
mod text;

use super::document::{self, Limit, Measured, Settings};
use super::kind::{Kind, Subject};
use crate::asking::poses;
use crate::console::{Failure, plural};
use bvh_query::Pose;
use cbvh_measure::plot;
use cbvh_measure::rounds::Question;
use row::Row;
use serde::Serialize;
use std::path::Path;

/// What is asked: contact, the exact distance, and distances with an allowed relative error.
const QUESTIONS: [Question; 5] = [
    Question::Collide,
    Question::Distance(0.0),
    Question::Distance(1e-3),
    Question::Distance(1e-2),
    Question::Distance(1e-1),
];
/// The index of the exact distance in `QUESTIONS`.
const EXACT_DISTANCE: usize = 1;

/// The report of layouts.
pub(super) struct Layouts;

type Report = document::Report<Layouts>;
type PairRecord = document::PairRecord<Poses>;

/// The poses that a pair was asked about.
#[derive(Debug, Serialize)]
pub(super) struct Poses {
    /// The names of the files, or how the poses were made.
    poses_from: String,
    poses: usize,
}

impl Kind for Layouts {
    type Item = Pose;
    type Items = Poses;
    type Row = Row;

    const TITLE: &'static str = "Which layout for these meshes?";
    const ABOUT: &'static str = text::ABOUT;
    const RIGHT: &'static str = text::RIGHT;

    fn limit(count: usize) -> Limit {
        Limit::Poses(count)
    }

    fn read(file: &Path) -> Result<Vec<Pose>, Failure> {
        poses::read(file)
    }

    fn measure(subject: &Subject<'_>, given: Vec<Pose>) -> Result<Measured<Self>, Failure> {
        measured::measure(subject, given)
    }

    fn pair_of(row: &Row) -> &str {
        &row.pair
    }

    fn sentences(report: &Report, pair: &PairRecord) -> Vec<String> {
        best::sentences(report, pair)
    }

    fn figure(report: &Report, pair: &str) -> plot::Figure {
        figure::of_pair(report, pair)
    }

    fn items(items: &Poses) -> String {
        let Poses { poses, poses_from } = items;
        format!("{poses} {} ({poses_from})", plural(*poses as u64, "pose"))
    }

    fn tables(report: &Report, pair: &str) -> String {
        tables::all(report, pair)
    }

    fn methods(settings: &Settings) -> String {
        text::methods(settings)
    }
}
