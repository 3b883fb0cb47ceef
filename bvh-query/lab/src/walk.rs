//! Walks two trees in memory completely, in the order in which queries open nodes, and counts the tests.
//!
//! A walk visits what a query must visit in whatever order: all pairs of nodes that `test` lets through. Queries of
//! meshes that touch stop at the first contact and do less; queries for a distance do not know it at the start and do
//! more.

use crate::tree::{Node, Tree};
use bvh_format::kdop::Kdop;

/// Nodes this many times larger than their partner are opened alone, as in a query.
const MUCH_LARGER: f32 = 2.0;
/// The number of node tests after which a walk is given up: some thousand times what good bounds need, half a second.
const MAX_NODE_TESTS: u64 = 1 << 17;

/// What a walk counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Tests {
    /// Tests of up to 16 pairs of nodes each.
    pub(crate) node_tests: u64,
    /// Tests of up to 16 pairs of triangles each.
    pub(crate) packet_tests: u64,
    /// Whether the walk was given up, because it would have taken too long.
    pub(crate) given_up: bool,
}

/// Visits pairs of nodes. `test` gets the nodes of both sides of a node test, and pushes the pairs that it lets through.
pub(crate) fn walk(a: &Tree, b: &Tree, mut test: impl FnMut([&[u32]; 2], &mut Vec<(u32, u32)>)) -> Tests {
    let mut tests = Tests::default();
    let mut stack = vec![(0u32, 0u32)];
    while let Some((at_a, at_b)) = stack.pop() {
        if tests.node_tests > MAX_NODE_TESTS {
            tests.given_up = true;
            break;
        }
        let (node_a, node_b) = (&a.nodes[at_a as usize], &b.nodes[at_b as usize]);
        let (leaf_a, leaf_b) = (node_a.triangles > 0, node_b.triangles > 0);
        if leaf_a && leaf_b {
            tests.packet_tests += u64::from(node_a.triangles.div_ceil(4) * node_b.triangles.div_ceil(4));
            continue;
        }
        // The root counts as larger than anything, as in a query.
        let extent = |at: u32, node: &Node| if at == 0 { f32::INFINITY } else { extent(&node.bound) };
        let (extent_a, extent_b) = (extent(at_a, node_a), extent(at_b, node_b));
        let a_is_small = extent_b > MUCH_LARGER * extent_a;
        let b_is_small = extent_a > MUCH_LARGER * extent_b && !a_is_small;
        let (own_a, own_b) = ([at_a], [at_b]);
        let side_a = if !leaf_a && (leaf_b || !a_is_small) { &node_a.children[..] } else { &own_a };
        let side_b = if !leaf_b && (leaf_a || !b_is_small) { &node_b.children[..] } else { &own_b };
        tests.node_tests += (side_a.len().div_ceil(4) * side_b.len().div_ceil(4)) as u64;
        test([side_a, side_b], &mut stack);
    }
    tests
}

/// The largest side of a node's box.
fn extent(bound: &Kdop) -> f32 {
    (0..3).map(|slab| bound.hi[slab] - bound.lo[slab]).fold(0.0, f32::max)
}
