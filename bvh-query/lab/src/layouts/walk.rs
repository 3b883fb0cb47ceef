//! Counts the tests of a complete walk, including those that tight bounds would save.
//!
//! Bounds are let through within a limit, 0 for contact and the true distance for distance. Nodes are tested along the
//! directions of both sides from the start; a query does so after its first tests.

use crate::placed::{Aligned, Frame, Placed};
use crate::tree::Tree;
use crate::walk;
use bvh_format::kdop::Kdop;
use bvh_query::Pose;

/// What a walk counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    /// Tests of up to 16 pairs of nodes each.
    pub(super) node_tests: u64,
    /// Tests of up to 16 pairs of triangles each.
    pub(super) packet_tests: u64,
    /// Pairs of nodes whose bounds are within the limit.
    pub(super) through: u64,
    /// The pairs among them whose tight bounds are not within the limit.
    pub(super) in_vain: u64,
}

impl Counts {
    /// Returns the sums.
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            node_tests: self.node_tests + other.node_tests,
            packet_tests: self.packet_tests + other.packet_tests,
            through: self.through + other.through,
            in_vain: self.in_vain + other.in_vain,
        }
    }
}

/// Visits all pairs of nodes whose bounds are at most `limit` apart (mesh units; 0 for overlap). Returns `None` if the walk
/// does not end in reasonable time.
pub(super) fn walk(a: &Tree, b: &Tree, pose: &Pose, limit: f64) -> Option<Counts> {
    let placed = Placed::new(a, b, pose, [a.set, b.set]);
    let mut counts = Counts::default();
    let tests = walk::walk(a, b, |[side_a, side_b], stack| {
        let seen = |tree: &Tree, side: &[u32], frame: &Frame| -> Vec<[Aligned; 2]> {
            let nodes = side.iter().map(|&child| &tree.nodes[child as usize]);
            nodes.map(|node| [frame.aligned(&node.bound), frame.aligned(&node.tight)]).collect()
        };
        let (seen_a, seen_b) = (seen(a, side_a, &placed.along_b), seen(b, side_b, &placed.along_a));
        for (&child_b, seen_b) in side_b.iter().zip(&seen_b) {
            let node_b = &b.nodes[child_b as usize];
            for (&child_a, seen_a) in side_a.iter().zip(&seen_a) {
                let node_a = &a.nodes[child_a as usize];
                let gap = |bound_a: &Kdop, bound_b: &Kdop, which: usize| {
                    let along_a = placed.along_a.gap(bound_a, &seen_b[which]);
                    along_a.max(placed.along_b.gap(bound_b, &seen_a[which]))
                };
                if gap(&node_a.bound, &node_b.bound, 0) <= limit {
                    counts.through += 1;
                    counts.in_vain += u64::from(gap(&node_a.tight, &node_b.tight, 1) > limit);
                    stack.push((child_a, child_b));
                }
            }
        }
    });
    let Counts { through, in_vain, .. } = counts;
    let found = Counts { node_tests: tests.node_tests, packet_tests: tests.packet_tests, through, in_vain };
    (!tests.given_up).then_some(found)
}
