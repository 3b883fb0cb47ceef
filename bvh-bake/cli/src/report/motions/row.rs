//! A row of the report: one way to ask about the motions of one pair of meshes.

use super::errors::Errors;
use super::method::Method;
use cbvh_measure::spread::Spread;
use cbvh_measure::table::{self, Cell, Cells};

/// A row.
#[derive(Debug, Clone)]
pub(in crate::report) struct Row {
    pub(super) pair: String,
    pub(super) method: Method,
    pub(super) motions: u64,
    /// Certified hits.
    pub(super) hits: u64,
    pub(super) errors: Errors,
    /// How many rounds fitted into the time.
    pub(super) rounds: u64,
    pub(super) time: Option<Spread>,
    /// The mean time, in nanoseconds.
    pub(super) mean: Option<f64>,
}

impl Row {
    /// The share of the certified hits that are missed; `None` if there are none.
    pub(super) fn missed_share(&self) -> Option<f64> {
        (self.hits > 0).then(|| self.errors.missed as f64 / self.hits as f64)
    }

    /// The median time in nanoseconds.
    pub(super) fn nanoseconds(&self) -> Option<f64> {
        self.time.map(|time| time.median)
    }
}

impl Cells for Row {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let mut cells = vec![
            ("pair", Cell::text(&self.pair)),
            ("method", Cell::text(self.method.name())),
            ("samples", Cell::count(self.method.samples().map(u64::from))),
            ("motions", Cell::Count(self.motions)),
            ("hits", Cell::Count(self.hits)),
            ("missed", Cell::Count(self.errors.missed)),
            ("missed_share", Cell::number(self.missed_share())),
            ("late_median", Cell::number(self.errors.late_median)),
            ("late_max", Cell::number(self.errors.late_max)),
            ("undecided", Cell::count(self.errors.undecided)),
            ("rounds", Cell::Count(self.rounds)),
        ];
        cells.extend(table::times(["ns_median", "ns_q1", "ns_q3", "ns_p90"], self.time));
        cells.push(("ns_mean", Cell::number(self.mean)));
        cells
    }
}
