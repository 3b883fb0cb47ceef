//! Walks two trees in memory completely and counts the tests, including those that tight bounds would save.
//!
//! A walk visits what a query must visit in whatever order: all pairs of nodes whose bounds are within a limit, 0 for
//! contact and the true distance for distance. Queries of meshes that touch stop at the first contact and do less;
//! queries for a distance do not know it at the start and do more. Nodes are tested along the directions of both sides
//! from the start; a query does so after its first tests.

use super::tree::{Node, Tree};
use bvh_format::kdop::{DirectionSet, FACTORS, Kdop};
use bvh_format::realign::{Form, upper_form};
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_query::Pose;

/// Nodes this many times larger than their partner are opened alone, as in a query.
const MUCH_LARGER: f32 = 2.0;
/// The number of node tests after which a walk is given up: some thousand times what good bounds need, half a second.
const MAX_NODE_TESTS: u64 = 1 << 17;

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
    let placed = Placed::new(a, b, pose);
    let mut counts = Counts::default();
    let mut stack = vec![(0u32, 0u32)];
    while let Some((at_a, at_b)) = stack.pop() {
        if counts.node_tests > MAX_NODE_TESTS {
            return None;
        }
        let (node_a, node_b) = (&a.nodes[at_a as usize], &b.nodes[at_b as usize]);
        let (leaf_a, leaf_b) = (node_a.triangles > 0, node_b.triangles > 0);
        if leaf_a && leaf_b {
            counts.packet_tests += u64::from(node_a.triangles.div_ceil(4) * node_b.triangles.div_ceil(4));
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
        counts.node_tests += (side_a.len().div_ceil(4) * side_b.len().div_ceil(4)) as u64;
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
    }
    Some(counts)
}

/// The largest side of a node's box.
fn extent(bound: &Kdop) -> f32 {
    (0..3).map(|slab| bound.hi[slab] - bound.lo[slab]).fold(0.0, f32::max)
}

/// The slab ends along the other side's directions, lower and upper.
type Aligned = [[f64; 2]; 13];

/// A pose of one tree beside another, seen from both.
struct Placed {
    /// B along A's directions.
    along_a: Frame,
    /// A along B's directions.
    along_b: Frame,
}

impl Placed {
    fn new(a: &Tree, b: &Tree, pose: &Pose) -> Self {
        let (r, origin) = (pose.rotation(), pose.place(b.origin));
        let t = [0, 1, 2].map(|axis| origin[axis] - a.origin[axis]);
        let inverse = [0, 1, 2].map(|i| [0, 1, 2].map(|j| r[j][i]));
        let back = inverse.map(|row| -(0..3).map(|axis| row[axis] * t[axis]).sum::<f64>());
        Self { along_a: Frame::new(r, t, a.set, b.set), along_b: Frame::new(&inverse, back, b.set, a.set) }
    }
}

/// The directions of one side, along which the other's nodes are seen.
struct Frame {
    /// Per direction the form of the other's upper end along it, and what the pose adds.
    axes: Vec<(Form, f64)>,
    /// Lengths of the directions.
    lengths: Vec<f64>,
    /// Slabs of the other side.
    slabs: usize,
}

impl Frame {
    fn new(rotation: &[[f64; 3]; 3], translation: [f64; 3], own: DirectionSet, other: DirectionSet) -> Self {
        let axis = |direction: &[f64; 3]| {
            let seen = [0, 1, 2].map(|i| (0..3).map(|j| rotation[j][i] * direction[j]).sum());
            let offset: f64 = (0..3).map(|i| direction[i] * translation[i]).sum();
            (upper_form(seen, other), offset)
        };
        let directions = &FACTORS[..own.slabs()];
        let length = |d: &[f64; 3]| d.iter().map(|c| c * c).sum::<f64>().sqrt();
        Self {
            axes: directions.iter().map(axis).collect(),
            lengths: directions.iter().map(length).collect(),
            slabs: other.slabs(),
        }
    }

    fn aligned(&self, bound: &Kdop) -> Aligned {
        let group = Group::of_one(&NodeSlabs::from_kdop(bound, self.slabs));
        let rows = group.rows();
        let mut aligned = [[0.0; 2]; 13];
        for (ends, (form, offset)) in aligned.iter_mut().zip(&self.axes) {
            let end = |form: Form| -> f64 {
                let term = |j: usize| {
                    f64::from(form.coefficients[j]) * f64::from(rows[usize::from(form.rows[j])][0])
                };
                term(0) + term(1) + term(2) + offset
            };
            *ends = [end(form.mirrored()), end(*form)];
        }
        aligned
    }

    /// Returns a lower bound of the distance between a node of this side and one of the other side. It is negative
    /// where they overlap along all directions of this side.
    fn gap(&self, own: &Kdop, other: &Aligned) -> f64 {
        let along = |slab: usize| {
            let [lo, hi] = other[slab];
            (lo - f64::from(own.hi[slab])).max(f64::from(own.lo[slab]) - hi) / self.lengths[slab]
        };
        (0..self.lengths.len()).map(along).fold(f64::NEG_INFINITY, f64::max)
    }
}
