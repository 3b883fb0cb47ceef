//! A row: one question put to one layout of one pair of meshes.

use cbvh_measure::spread::Spread;
use cbvh_measure::table::{self, Cell, Cells};

/// The mean counts of complete walks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walked {
    pub(super) node_tests: f64,
    pub(super) packet_tests: f64,
    /// The share of the pairs of nodes let through that tight bounds would have stopped.
    pub(super) in_vain: Option<f64>,
}

/// A row.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) pair: String,
    pub(super) profile: &'static str,
    pub(super) triangles: &'static str,
    pub(super) question: &'static str,
    pub(super) poses: u64,
    /// Times over the poses.
    pub(super) cold: Option<Spread>,
    pub(super) walked: Option<Walked>,
}

impl Cells for Row {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let mut cells = vec![
            ("pair", Cell::text(&self.pair)),
            ("profile", Cell::text(self.profile)),
            ("triangles", Cell::text(self.triangles)),
            ("question", Cell::text(self.question)),
            ("poses", Cell::Count(self.poses)),
        ];
        cells.extend(table::times(["cold_ns_median", "cold_ns_q1", "cold_ns_q3", "cold_ns_p90"], self.cold));
        cells.extend([
            ("walked_node_tests", Cell::number(self.walked.map(|walked| walked.node_tests))),
            ("walked_packet_tests", Cell::number(self.walked.map(|walked| walked.packet_tests))),
            ("in_vain", Cell::number(self.walked.and_then(|walked| walked.in_vain))),
        ]);
        cells
    }
}
