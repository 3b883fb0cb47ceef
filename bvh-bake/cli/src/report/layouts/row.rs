//! A row of the report: one question put to one layout of one pair of meshes.

use super::layout::Layout;
use cbvh_measure::rounds::{Question, Work};
use cbvh_measure::spread::Spread;
use cbvh_measure::table::{self, Cell, Cells};

/// Figures of a layout that do not depend on the question.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Size {
    /// Bytes per triangle of both files together.
    pub(super) node_bytes: f64,
    pub(super) triangle_bytes: f64,
    pub(super) id_bytes: f64,
    pub(super) file_bytes: f64,
    /// Mean over the nodes of decoded width over tight width.
    pub(super) width_inflation: f64,
    /// Mean over the nodes of decoded over tight box volume.
    pub(super) volume_inflation: f64,
    /// The farthest that a vertex was moved, mesh units.
    pub(super) vertex_error: f64,
}

/// How far distances are from the exact ones.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    /// Relative errors, over the poses in which the meshes are apart.
    pub(super) median: Option<f64>,
    pub(super) max: Option<f64>,
    /// The largest error over all poses, mesh units.
    pub(super) max_length: Option<f64>,
}

/// A row.
#[derive(Debug, Clone)]
pub(in crate::report) struct Row {
    pub(super) pair: String,
    pub(super) layout: Layout,
    pub(super) question: Question,
    pub(super) poses: u64,
    pub(super) touching: u64,
    pub(super) time: Option<Spread>,
    pub(super) work: Work,
    pub(super) size: Size,
    pub(super) errors: Errors,
    /// For distances: no other row of the pair is at least as fast with at most this error.
    pub(super) pareto_error: Option<bool>,
    /// For exact questions to layouts without loss: no other one is at least as fast with at most these bytes.
    pub(super) pareto_bytes: Option<bool>,
}

impl Row {
    /// The median time in nanoseconds.
    pub(super) fn nanoseconds(&self) -> Option<f64> {
        self.time.map(|time| time.median)
    }

    /// True if no error was allowed.
    pub(super) fn is_exact(&self) -> bool {
        self.question.rel_err().unwrap_or(0.0) == 0.0
    }
}

impl Cells for Row {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let number = |value: f64| Cell::number(Some(value));
        let mut cells = vec![
            ("pair", Cell::text(&self.pair)),
            ("layout", Cell::Text(self.layout.name())),
            ("profile", Cell::text(self.layout.profile.name())),
            ("triangles", Cell::text(self.layout.triangles.name())),
            ("turning_slabs", Cell::flag(self.layout.has_turning_slabs())),
            ("question", Cell::text(self.question.name())),
            ("rel_err", Cell::number(self.question.rel_err())),
            ("poses", Cell::Count(self.poses)),
            ("touching", Cell::Count(self.touching)),
        ];
        cells.extend(table::times(["ns_median", "ns_q1", "ns_q3", "ns_p90"], self.time));
        cells.extend(table::work(self.work));
        cells.extend([
            ("node_bytes_per_tri", number(self.size.node_bytes)),
            ("triangle_bytes_per_tri", number(self.size.triangle_bytes)),
            ("id_bytes_per_tri", number(self.size.id_bytes)),
            ("file_bytes_per_tri", number(self.size.file_bytes)),
            ("width_inflation", number(self.size.width_inflation)),
            ("volume_inflation", number(self.size.volume_inflation)),
            ("vertex_error", number(self.size.vertex_error)),
            ("distance_error_median", Cell::number(self.errors.median)),
            ("distance_error_max", Cell::number(self.errors.max)),
            ("distance_error_max_length", Cell::number(self.errors.max_length)),
            ("pareto_error", Cell::flag(self.pareto_error)),
            ("pareto_bytes", Cell::flag(self.pareto_bytes)),
        ]);
        cells
    }
}
