//! The whole report on scaling: where and how it was measured, the rows, and a few lines for the terminal.

use super::row::{Part, Row, gap_name};
use crate::arguments::ScalingArguments;
use bvh_query::Backend;
use cbvh_measure::origin::Origin;
use cbvh_measure::pin::Pinned;
use cbvh_measure::table::{self, micro};
use serde::Serialize;
use std::path::Path;

/// How much is measured.
#[derive(Debug, Serialize)]
pub(super) struct Settings {
    pub(super) largest: u64,
    pub(super) rounds: usize,
    /// Poses per gap.
    pub(super) poses: usize,
    pub(super) path_poses: usize,
    pub(super) isa: &'static str,
}

impl Settings {
    pub(super) fn new(arguments: &ScalingArguments, backend: Backend) -> Self {
        Self {
            largest: arguments.largest,
            rounds: usize::from(arguments.rounds),
            poses: usize::from(arguments.poses),
            path_poses: usize::from(arguments.path_poses),
            isa: backend.name(),
        }
    }
}

/// The whole report.
#[derive(Debug, Serialize)]
pub(super) struct Record {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) settings: Settings,
    /// The processor that single queries and paths were bound to.
    pub(super) pinned: Option<Pinned>,
    /// Answers that do not agree, one line each.
    pub(super) wrong: Vec<String>,
    #[serde(serialize_with = "table::objects")]
    pub(super) rows: Vec<Row>,
}

impl Record {
    /// A record without rows.
    pub(super) fn new(settings: Settings, pinned: Option<Pinned>) -> Self {
        Self { origin: Origin::of("cbvh-lab scaling"), settings, pinned, wrong: Vec::new(), rows: Vec::new() }
    }

    /// Returns the rows of a part.
    pub(super) fn of(&self, part: Part) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(move |row| row.part == part)
    }

    /// Says how each line grows from its first to its last size.
    pub(super) fn findings(&self) -> Vec<String> {
        let line = |row: &Row| {
            let line = |row: &Row| (row.without_slabs, row.question, row.gap);
            let sizes = || self.of(Part::Size).filter(|size| line(size) == line(row));
            let (first, last) = (sizes().next()?, sizes().last()?);
            Some(format!(
                "{}, {}{}: {} \u{b5}s at {} triangles, {} \u{b5}s at {}; slope {:.3}, of node tests {:.3}",
                row.question,
                row.gap.map_or(String::new(), gap_name),
                if row.without_slabs { ", without turning slabs" } else { "" },
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
