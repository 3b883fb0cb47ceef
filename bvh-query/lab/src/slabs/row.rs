//! A row: one variant on one pair in one set of poses.

use super::variant::{Topic, Variant};
use super::walk::Counts;
use cbvh_measure::rounds::Question;
use cbvh_measure::spread::quantile;
use cbvh_measure::table::{Cell, Cells};

/// Nanoseconds per node test, and per packet test for contact and for distance (spec/rationale.md, "How trees are
/// compared"). They weigh tests against each other; slab tests are not in them.
const NODE_COST: f64 = 151.0;
const PACKET_COSTS: [f64; 2] = [100.0, 170.0];

/// A median and a mean over poses. Where walks were given up, both are lower bounds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Figure {
    pub(super) median: f64,
    pub(super) mean: f64,
}

impl Figure {
    fn of(mut values: Vec<u64>) -> Self {
        values.sort_unstable();
        let mean = values.iter().sum::<u64>() as f64 / values.len().max(1) as f64;
        Self { median: quantile(&values, 0.5) as f64, mean }
    }
}

/// A row.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) topic: Topic,
    pub(super) base: &'static str,
    pub(super) variant: String,
    pub(super) pair: String,
    pub(super) poses: String,
    pub(super) question: Question,
    pub(super) count: u64,
    pub(super) given_up: u64,
    /// Tests of up to 16 pairs of nodes.
    pub(super) node_tests: Figure,
    /// Tests of up to 16 pairs of triangles.
    pub(super) packet_tests: Figure,
    /// Pairs of nodes that take the slab test.
    pub(super) slab_pairs: Figure,
}

impl Row {
    pub(super) fn new(
        variant: &Variant,
        pair: &str,
        poses: &str,
        question: Question,
        counts: &[Counts],
    ) -> Self {
        let figure = |of: fn(&Counts) -> u64| Figure::of(counts.iter().map(of).collect());
        Self {
            topic: variant.topic,
            base: variant.base,
            variant: variant.name.clone(),
            pair: pair.to_owned(),
            poses: poses.to_owned(),
            question,
            count: counts.len() as u64,
            given_up: counts.iter().filter(|counts| counts.given_up).count() as u64,
            node_tests: figure(|counts| counts.node_tests),
            packet_tests: figure(|counts| counts.packet_tests),
            slab_pairs: figure(|counts| counts.slab_pairs),
        }
    }

    /// Returns what the mean tests of nodes and packets take, in nanoseconds.
    pub(super) fn cost(&self) -> f64 {
        let packet = PACKET_COSTS[usize::from(self.question != Question::Collide)];
        NODE_COST * self.node_tests.mean + packet * self.packet_tests.mean
    }
}

impl Cells for Row {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let number = |value| Cell::number(Some(value));
        vec![
            ("topic", Cell::text(self.topic.name())),
            ("base", Cell::text(self.base)),
            ("variant", Cell::text(&self.variant)),
            ("pair", Cell::text(&self.pair)),
            ("poses", Cell::text(&self.poses)),
            ("question", Cell::text(self.question.name())),
            ("count", Cell::Count(self.count)),
            ("given_up", Cell::Count(self.given_up)),
            ("node_tests_median", number(self.node_tests.median)),
            ("node_tests_mean", number(self.node_tests.mean)),
            ("packet_tests_median", number(self.packet_tests.median)),
            ("packet_tests_mean", number(self.packet_tests.mean)),
            ("slab_pairs_median", number(self.slab_pairs.median)),
            ("slab_pairs_mean", number(self.slab_pairs.mean)),
        ]
    }
}

/// Returns the geometric mean; counts of 0 count as 1.
pub(super) fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let logarithms: Vec<f64> = values.map(|value| value.max(1.0).ln()).collect();
    (logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64).exp()
}
