//! The whole report: where and how it was measured, the pairs, and the rows.

use super::arguments::ReportArguments;
use super::kind::Kind;
use crate::asking::files::stem;
use bvh_query::{Backend, Bvh};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::Pair;
use cbvh_measure::pin::Pinned;
use cbvh_measure::poses::diagonal;
use cbvh_measure::table;
use serde::Serialize;
use std::path::Path;

/// Rounds and items of `--quick`.
const QUICK: (usize, usize) = (2, 10);

/// The largest number of items per pair, 0 for all.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Limit {
    Poses(usize),
    Motions(usize),
}

/// How much is measured.
#[derive(Debug, Serialize)]
pub(super) struct Settings {
    pub(super) quick: bool,
    pub(super) rounds: usize,
    #[serde(flatten)]
    pub(super) limit: Limit,
    pub(super) isa: &'static str,
}

impl Settings {
    pub(super) fn new<K: Kind>(arguments: &ReportArguments, backend: Backend) -> Self {
        let asked = (usize::from(arguments.rounds), arguments.limit);
        let (rounds, limit) = if arguments.quick { QUICK } else { asked };
        Self { quick: arguments.quick, rounds, limit: K::limit(limit), isa: backend.name() }
    }

    /// Returns the largest number of items per pair, 0 for all.
    pub(super) fn limit(&self) -> usize {
        match self.limit {
            Limit::Poses(limit) | Limit::Motions(limit) => limit,
        }
    }
}

/// One mesh of a pair.
#[derive(Debug, Serialize)]
pub(super) struct SideRecord {
    pub(super) mesh: String,
    pub(super) triangles: u64,
    /// The diagonal of its box, mesh units.
    pub(super) diagonal: f64,
    /// The layout that `cbvh bake` chooses by itself.
    pub(super) chosen_layout: String,
}

/// A pair and what it was asked about.
#[derive(Debug, Serialize)]
pub(super) struct PairRecord<I> {
    pub(super) name: String,
    pub(super) a: SideRecord,
    pub(super) b: SideRecord,
    #[serde(flatten)]
    pub(super) items: I,
    /// The processor that the measuring thread was bound to.
    pub(super) pinned: Option<Pinned>,
}

impl<I> PairRecord<I> {
    /// Describes a pair, of which each mesh has a chosen layout.
    pub(super) fn new(
        pair: &Pair,
        meshes: [&Bvh; 2],
        chosen: [String; 2],
        items: I,
        pinned: Option<Pinned>,
    ) -> Self {
        let side = |path: &Path, bvh: &Bvh, chosen_layout: String| SideRecord {
            mesh: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            triangles: bvh.all().triangles(),
            diagonal: diagonal(bvh),
            chosen_layout,
        };
        let [chosen_a, chosen_b] = chosen;
        Self {
            name: pair.name.clone(),
            a: side(&pair.a, meshes[0], chosen_a),
            b: side(&pair.b, meshes[1], chosen_b),
            items,
            pinned,
        }
    }
}

/// Returns the names of a pair's files.
pub(super) fn files_of(pair: &Pair) -> String {
    pair.files.iter().map(|file| stem(file)).collect::<Vec<_>>().join(", ")
}

/// The results of a pair.
pub(super) struct Measured<K: Kind> {
    pub(super) record: PairRecord<K::Items>,
    pub(super) rows: Vec<K::Row>,
    /// Wrong answers, one line each.
    pub(super) wrong: Vec<String>,
}

/// All of it.
#[derive(Serialize)]
#[serde(bound = "")]
pub(super) struct Report<K: Kind> {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) settings: Settings,
    pub(super) pairs: Vec<PairRecord<K::Items>>,
    /// Answers that are not what they must be, one line each.
    pub(super) wrong: Vec<String>,
    #[serde(serialize_with = "table::objects")]
    pub(super) rows: Vec<K::Row>,
}

impl<K: Kind> Report<K> {
    /// A report without pairs.
    pub(super) fn new(settings: Settings) -> Self {
        let origin = Origin::of("cbvh report");
        Self { origin, settings, pairs: Vec::new(), wrong: Vec::new(), rows: Vec::new() }
    }

    pub(super) fn add(&mut self, measured: Measured<K>) {
        self.pairs.push(measured.record);
        self.rows.extend(measured.rows);
        self.wrong.extend(measured.wrong);
    }

    /// Returns the rows of a pair.
    pub(super) fn of<'a>(&'a self, pair: &'a str) -> impl Iterator<Item = &'a K::Row> {
        self.rows.iter().filter(move |row| K::pair_of(row) == pair)
    }
}
