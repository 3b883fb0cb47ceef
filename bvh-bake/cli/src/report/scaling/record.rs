//! The whole report on scaling: where and how it was measured, the rows, and a few lines of them for the terminal.

use super::row::{Part, Row, gap_name};
use crate::arguments::ReportArguments;
use crate::report::origin::Origin;
use crate::report::pin::Pinned;
use crate::report::plot::micro;
use bvh_query::Backend;
use serde::Serialize;
use std::path::Path;

/// Poses of a gap, and of a path.
const POSES: usize = 100;
const PATH_POSES: usize = 1000;

/// How much of everything.
#[derive(Debug, Serialize)]
pub(super) struct Settings {
    pub(super) quick: bool,
    pub(super) largest: u64,
    pub(super) rounds: usize,
    /// Of each gap.
    pub(super) poses: usize,
    pub(super) path_poses: usize,
    pub(super) isa: &'static str,
}

impl Settings {
    pub(super) fn new(arguments: &ReportArguments, backend: Backend) -> Self {
        let settings = Self {
            quick: arguments.quick,
            largest: arguments.largest,
            rounds: usize::from(arguments.rounds),
            poses: if arguments.limit == 0 { POSES } else { arguments.limit.min(POSES) },
            path_poses: PATH_POSES,
            isa: backend.name(),
        };
        if !arguments.quick {
            return settings;
        }
        Self { rounds: 2, poses: settings.poses.min(10), path_poses: 100, ..settings }
    }
}

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Record {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) settings: Settings,
    /// The processor of single queries and of paths.
    pub(super) pinned: Option<Pinned>,
    /// Answers that do not agree, a line each.
    pub(super) wrong: Vec<String>,
    pub(super) rows: Vec<Row>,
}

impl Record {
    /// Without rows.
    pub(super) fn new(settings: Settings, pinned: Option<Pinned>) -> Self {
        Self { origin: Origin::here(), settings, pinned, wrong: Vec::new(), rows: Vec::new() }
    }

    /// The rows of a part.
    pub(super) fn of(&self, part: Part) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(move |row| row.part == part)
    }

    /// How each line grows, from its first to its last size.
    pub(super) fn findings(&self) -> Vec<String> {
        let line = |row: &Row| {
            let sizes = || self.of(Part::Size).filter(|s| (s.question, s.gap) == (row.question, row.gap));
            let (first, last) = (sizes().next()?, sizes().last()?);
            Some(format!(
                "{}, {}: {} \u{b5}s at {} triangles, {} \u{b5}s at {}; slope {:.3}, of node tests {:.3}",
                row.question,
                row.gap.map_or(String::new(), gap_name),
                micro(first.time()?),
                first.mesh.as_ref()?.triangles,
                micro(last.time()?),
                last.mesh.as_ref()?.triangles,
                row.growth?,
                row.node_growth?
            ))
        };
        self.of(Part::Growth).filter_map(line).collect()
    }

    /// A few lines for the terminal.
    pub(super) fn summary(&self, page: &Path) -> String {
        let mut text =
            format!("{}: {} rows, {} wrong answers\n", page.display(), self.rows.len(), self.wrong.len());
        for finding in self.findings() {
            text.push_str(&format!("  {finding}\n"));
        }
        for row in self.of(Part::Batch).filter(|row| row.threads == Some(2)) {
            let speedup = row.speedup.unwrap_or_default();
            text.push_str(&format!("  batch, {}: {speedup:.2} times as fast on 2 threads\n", row.question));
        }
        text
    }
}
