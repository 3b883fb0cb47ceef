//! What one kind of report has that others do not. Everything else is shared.

use super::document::{Limit, Measured, PairRecord, Report, Settings};
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use bvh_query::Backend;
use cbvh_measure::pairs::Pair;
use cbvh_measure::plot::Figure;
use cbvh_measure::table::Cells;
use serde::Serialize;
use std::path::Path;

/// A pair to measure.
pub(super) struct Subject<'a> {
    pub(super) pair: &'a Pair,
    pub(super) meshes: &'a [Mesh; 2],
    pub(super) settings: &'a Settings,
    pub(super) backend: Backend,
    pub(super) tell: &'a (dyn Fn(&str) + Sync),
}

/// A kind of report.
pub(super) trait Kind: Sized {
    /// What is asked about: a pose or a motion.
    type Item;
    /// What the report says about the items of a pair.
    type Items: Serialize;
    type Row: Cells;

    /// The title of the page.
    const TITLE: &'static str;
    /// What the page is about, as HTML.
    const ABOUT: &'static str;
    /// What is known if no answer is wrong, as HTML.
    const RIGHT: &'static str;

    /// Says how many items per pair are asked about at most.
    fn limit(count: usize) -> Limit;
    /// Reads a file of items.
    fn read(file: &Path) -> Result<Vec<Self::Item>, Failure>;
    /// Measures a pair with the given items, or with items that are made if there are none.
    fn measure(subject: &Subject<'_>, given: Vec<Self::Item>) -> Result<Measured<Self>, Failure>;

    /// Returns the name of a row's pair.
    fn pair_of(row: &Self::Row) -> &str;
    /// Returns what is found about a pair, the most important sentence first.
    fn sentences(report: &Report<Self>, pair: &PairRecord<Self::Items>) -> Vec<String>;
    /// Returns the plots of a pair.
    fn figure(report: &Report<Self>, pair: &str) -> Figure;
    /// Says what was asked about, in a phrase.
    fn items(items: &Self::Items) -> String;
    /// Returns the tables of a pair, as HTML.
    fn tables(report: &Report<Self>, pair: &str) -> String;
    /// Says how it was measured and what the figures do not tell, as two HTML lists with their headings.
    fn methods(settings: &Settings) -> String;
}
