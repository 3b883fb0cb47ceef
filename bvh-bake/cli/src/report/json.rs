//! The whole report: where and how it was measured, the pairs, and the rows.

use super::machine;
use super::measure::{Baked, Question};
use super::origin::Origin;
use super::pairs::Pair;
use super::pin::Pinned;
use super::row::Row;
use super::scatter::{GAPS, diagonal};
use super::speed::Measured;
use crate::arguments::ReportArguments;
use crate::error::Failure;
use crate::query::stem;
use bvh_query::{Backend, Pose};
use serde::Serialize;
use std::path::Path;

/// The largest sweep that is made without being asked for.
const MOST_SWEPT: u64 = 2 << 30;
/// What is swept where the system does not tell its caches.
const UNKNOWN_CACHE: u64 = 64 << 20;
/// What `--quick` sweeps.
const QUICK_SWEEP: u64 = 8 << 20;

/// How much of everything.
#[derive(Debug, Serialize)]
pub(super) struct Settings {
    pub(super) quick: bool,
    pub(super) rounds: usize,
    /// Poses of a pair at most, 0 for all; and of those for cold queries, from disk, and for models.
    pub(super) poses: usize,
    pub(super) cold_poses: usize,
    pub(super) disk_poses: usize,
    pub(super) model_poses: usize,
    pub(super) sweep_bytes: u64,
    pub(super) isa: &'static str,
}

impl Settings {
    pub(super) fn new(arguments: &ReportArguments, backend: Backend) -> Self {
        let largest = machine::caches().iter().map(|cache| cache.bytes).max().unwrap_or(UNKNOWN_CACHE);
        let sweep_bytes = (largest + largest / 4).min(MOST_SWEPT);
        let settings = Self {
            quick: arguments.quick,
            rounds: usize::from(arguments.rounds),
            poses: arguments.limit,
            cold_poses: 40,
            disk_poses: 10,
            model_poses: 16,
            sweep_bytes: arguments.sweep.unwrap_or(sweep_bytes),
            isa: backend.name(),
        };
        if !arguments.quick {
            return settings;
        }
        let sweep_bytes = arguments.sweep.unwrap_or(QUICK_SWEEP);
        Self { rounds: 2, poses: 10, cold_poses: 2, disk_poses: 2, model_poses: 5, sweep_bytes, ..settings }
    }
}

/// A side of a pair.
#[derive(Debug, Serialize)]
pub(super) struct SideRecord {
    pub(super) mesh: String,
    pub(super) triangles: u64,
    /// Of the box, mesh units.
    pub(super) diagonal: f64,
}

/// A pair and the poses it was asked in.
#[derive(Debug, Serialize)]
pub(super) struct PairRecord {
    pub(super) name: String,
    pub(super) a: SideRecord,
    pub(super) b: SideRecord,
    /// Names of the files, or what was made up.
    pub(super) poses_from: String,
    pub(super) poses: usize,
    pub(super) pinned: Option<Pinned>,
}

impl PairRecord {
    pub(super) fn new(
        pair: &Pair,
        bake: &Baked,
        poses: &[Pose],
        made_up: bool,
        pinned: Option<Pinned>,
    ) -> Self {
        let name =
            |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let side = |path, bvh: &bvh_query::Bvh| SideRecord {
            mesh: name(path),
            triangles: bvh.all().triangles(),
            diagonal: diagonal(bvh),
        };
        let from = if made_up {
            let gaps: Vec<String> = GAPS[1..].iter().map(|gap| gap.to_string()).collect();
            format!("made up: overlapping, and gaps of {} of A's diagonal", gaps.join(", "))
        } else {
            let files: Vec<String> = pair.poses.iter().map(|file| stem(file)).collect();
            files.join(", ")
        };
        Self {
            name: pair.name.clone(),
            a: side(&pair.a, &bake.a),
            b: side(&pair.b, &bake.b),
            poses_from: from,
            poses: poses.len(),
            pinned,
        }
    }
}

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) settings: Settings,
    pub(super) questions: Vec<&'static str>,
    pub(super) pairs: Vec<PairRecord>,
    /// Answers that are not what they must be.
    pub(super) wrong: Vec<String>,
    pub(super) rows: Vec<Row>,
}

impl Report {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            origin: Origin::here(),
            settings,
            questions: vec![Question::Collide.name(), Question::Distance(0.0).name()],
            pairs: Vec::new(),
            wrong: Vec::new(),
            rows: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, measured: Measured) {
        self.pairs.push(measured.record);
        self.rows.extend(measured.rows);
        self.wrong.extend(measured.wrong);
    }

    /// True if what is swept is more than the largest cache, as far as one knows.
    pub(super) fn is_cold(&self) -> bool {
        let largest = self.origin.machine.caches.iter().map(|cache| cache.bytes).max();
        largest.is_some_and(|largest| self.settings.sweep_bytes > largest)
    }

    /// A few lines for the terminal.
    pub(super) fn summary(&self, page: &Path) -> String {
        let mut text = format!(
            "{}: {} pairs, {} rows, {} wrong answers\n",
            page.display(),
            self.pairs.len(),
            self.rows.len(),
            self.wrong.len()
        );
        for pair in &self.pairs {
            for line in super::html::findings(self, &pair.name).iter().take(2) {
                text.push_str(&format!("  {}: {line}\n", pair.name));
            }
        }
        text
    }
}

/// A report as one JSON object.
pub(super) fn text(report: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(report).map_err(|e| Failure::System(format!("JSON: {e}")))?;
    Ok(text + "\n")
}
