//! The whole report: where and how it was measured, the pairs, and the rows.

use super::arguments::ReportArguments;
use super::layout::Layout;
use super::row::Row;
use crate::query::stem;
use bvh_query::{Backend, Bvh};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::Pair;
use cbvh_measure::pin::Pinned;
use cbvh_measure::poses::{GAPS, diagonal};
use cbvh_measure::table;
use serde::Serialize;
use std::path::Path;

/// Rounds and poses of `--quick`.
const QUICK: (usize, usize) = (2, 10);

/// How much is measured.
#[derive(Debug, Serialize)]
pub(super) struct Settings {
    pub(super) quick: bool,
    pub(super) rounds: usize,
    /// The largest number of poses per pair, 0 for all.
    pub(super) poses: usize,
    pub(super) isa: &'static str,
}

impl Settings {
    pub(super) fn new(arguments: &ReportArguments, backend: Backend) -> Self {
        let asked = (usize::from(arguments.rounds), arguments.limit);
        let (rounds, poses) = if arguments.quick { QUICK } else { asked };
        Self { quick: arguments.quick, rounds, poses, isa: backend.name() }
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

/// A pair and the poses it was asked about.
#[derive(Debug, Serialize)]
pub(super) struct PairRecord {
    pub(super) name: String,
    pub(super) a: SideRecord,
    pub(super) b: SideRecord,
    /// The names of the files, or how the poses were made.
    pub(super) poses_from: String,
    pub(super) poses: usize,
    /// The processor that the measuring thread was bound to.
    pub(super) pinned: Option<Pinned>,
}

impl PairRecord {
    pub(super) fn new(
        pair: &Pair,
        meshes: [&Bvh; 2],
        chosen: [Layout; 2],
        poses: usize,
        are_made: bool,
        pinned: Option<Pinned>,
    ) -> Self {
        let side = |path: &Path, bvh: &Bvh, chosen: Layout| SideRecord {
            mesh: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            triangles: bvh.all().triangles(),
            diagonal: diagonal(bvh),
            chosen_layout: chosen.name(),
        };
        let poses_from = if are_made {
            let gaps: Vec<String> = GAPS[1..].iter().map(|gap| gap.to_string()).collect();
            format!("made: a fifth overlaps, the others have gaps of {} of A's diagonal", gaps.join(", "))
        } else {
            pair.poses.iter().map(|file| stem(file)).collect::<Vec<_>>().join(", ")
        };
        Self {
            name: pair.name.clone(),
            a: side(&pair.a, meshes[0], chosen[0]),
            b: side(&pair.b, meshes[1], chosen[1]),
            poses_from,
            poses,
            pinned,
        }
    }
}

/// The results of a pair.
pub(super) struct Measured {
    pub(super) record: PairRecord,
    pub(super) rows: Vec<Row>,
    /// Wrong answers, one line each.
    pub(super) wrong: Vec<String>,
}

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) settings: Settings,
    pub(super) pairs: Vec<PairRecord>,
    /// Answers that are not what they must be, one line each.
    pub(super) wrong: Vec<String>,
    #[serde(serialize_with = "table::objects")]
    pub(super) rows: Vec<Row>,
}

impl Report {
    /// A report without pairs.
    pub(super) fn new(settings: Settings) -> Self {
        let origin = Origin::of("cbvh report");
        Self { origin, settings, pairs: Vec::new(), wrong: Vec::new(), rows: Vec::new() }
    }

    pub(super) fn add(&mut self, measured: Measured) {
        self.pairs.push(measured.record);
        self.rows.extend(measured.rows);
        self.wrong.extend(measured.wrong);
    }

    /// Returns the rows of a pair.
    pub(super) fn of<'a>(&'a self, pair: &'a str) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.pair == pair)
    }
}
