//! Counts the tests of complete walks with and without slabs along directions of the nodes' own.
//!
//! Pairs that the fixed slabs let through take the slab test, if one of both nodes has a slab. For distance the fixed
//! test also takes the distance between the boxes, as a query does.

use super::separation::{Side, SlabRule};
use super::slab::Slab;
use crate::placed::{Aligned, Frame, Placed};
use crate::tree::Tree;
use crate::walk;
use bvh_format::kdop::DirectionSet;
use bvh_query::Pose;

/// How pairs of nodes are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rule {
    /// The fixed directions: those of the tree, or the first of them.
    pub(super) set: DirectionSet,
    /// Whether B's directions are tested, too.
    pub(super) two_frames: bool,
    pub(super) slab: Option<SlabRule>,
}

/// What a walk counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    /// Tests of up to 16 pairs of nodes each.
    pub(super) node_tests: u64,
    /// Tests of up to 16 pairs of triangles each.
    pub(super) packet_tests: u64,
    /// Pairs of nodes that take the slab test.
    pub(super) slab_pairs: u64,
    /// Whether the walk was given up. The counts are less than those of a complete walk.
    pub(super) given_up: bool,
}

/// A tree with the slabs of its nodes.
#[derive(Clone, Copy)]
pub(super) struct Slabbed<'a> {
    pub(super) tree: &'a Tree,
    pub(super) slabs: &'a [Option<Slab>],
}

impl<'a> Slabbed<'a> {
    fn side(&self, number: u32) -> Side<'a> {
        let number = number as usize;
        Side { node: &self.tree.nodes[number], slab: self.slabs[number].as_ref() }
    }
}

/// Visits all pairs of nodes that are not certainly more than `limit` apart (mesh units; 0 for overlap).
pub(super) fn walk(a: Slabbed<'_>, b: Slabbed<'_>, pose: &Pose, limit: f64, rule: Rule) -> Counts {
    let placed = Placed::new(a.tree, b.tree, pose, [rule.set; 2]);
    let mut slab_pairs = 0;
    let (mut seen_a, mut seen_b) = (Vec::new(), Vec::new());
    let tests = walk::walk(a.tree, b.tree, |[side_a, side_b], stack| {
        see(&mut seen_b, b.tree, side_b, &placed.along_a);
        if rule.two_frames {
            see(&mut seen_a, a.tree, side_a, &placed.along_b);
        }
        for (place_b, &child_b) in side_b.iter().enumerate() {
            for (place_a, &child_a) in side_a.iter().enumerate() {
                let (of_a, of_b) = (a.side(child_a), b.side(child_b));
                let beyond = |frame: &Frame, own: Side<'_>, other: &Aligned| {
                    let bound = &own.node.bound;
                    frame.gap(bound, other) > limit || limit > 0.0 && frame.box_gap(bound, other) > limit
                };
                if beyond(&placed.along_a, of_a, &seen_b[place_b])
                    || rule.two_frames && beyond(&placed.along_b, of_b, &seen_a[place_a])
                {
                    continue;
                }
                let packets = of_a.node.triangles > 0 && of_b.node.triangles > 0;
                let slab_rule = rule.slab.filter(|rule| {
                    (of_a.slab.is_some() || of_b.slab.is_some()) && (packets || !rule.packets_only)
                });
                if let Some(slab_rule) = slab_rule {
                    slab_pairs += 1;
                    if slab_rule.apart(of_a, of_b, &placed, limit) {
                        continue;
                    }
                }
                stack.push((child_a, child_b));
            }
        }
    });
    Counts {
        node_tests: tests.node_tests,
        packet_tests: tests.packet_tests,
        slab_pairs,
        given_up: tests.given_up,
    }
}

fn see(seen: &mut Vec<Aligned>, tree: &Tree, side: &[u32], frame: &Frame) {
    seen.clear();
    seen.extend(side.iter().map(|&child| frame.aligned(&tree.nodes[child as usize].bound)));
}
