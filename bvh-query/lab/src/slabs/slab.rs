//! One more slab per child, along a direction of its own.
//!
//! Its ends are coded inward from what the child's own box reaches along the direction, in steps of the box's reach
//! divided by the largest code.

use super::direction::DirectionCode;
use super::patch::Patch;
use super::vector::{Vector, dot, length};
use crate::tree::{Node, Tree};
use bvh_format::kdop::Kdop;

/// A slab that contains the triangles below a node: `ends[0] <= n . x <= ends[1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slab {
    /// The direction as stored, of any length but zero.
    pub(super) n: Vector,
    pub(super) length: f64,
    pub(super) ends: [f64; 2],
    /// The width as a share of what the box of the node reaches along n.
    pub(super) share: f64,
}

/// Which of a patch's directions the slab has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wish {
    Normal,
    Axis,
    /// The one along which the slab is narrower.
    Narrower,
}

/// Which nodes have a slab.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Owners {
    All,
    Leaves,
    Treelets,
}

/// How slabs are made and stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Making {
    pub(super) wish: Wish,
    /// Whether all children of a treelet share one direction.
    pub(super) one_per_treelet: bool,
    pub(super) code: DirectionCode,
    /// Bits of the code of an end.
    pub(super) end_bits: u32,
    pub(super) owners: Owners,
    /// The most triangles below a node with a slab.
    pub(super) max_triangles: u32,
    /// The largest share of the box's reach that a slab may have.
    pub(super) max_share: f64,
}

impl Making {
    /// What other ways are compared with: 2 x 8 bits for the direction and 8 for each end.
    pub(super) const USUAL: Self = Self {
        wish: Wish::Narrower,
        one_per_treelet: false,
        code: DirectionCode::Octahedral(8),
        end_bits: 8,
        owners: Owners::All,
        max_triangles: u32::MAX,
        max_share: 1.0,
    };

    /// Returns the slabs of all nodes that have one. The root has none: no treelet holds it.
    pub(super) fn slabs(&self, tree: &Tree, patches: &[Patch]) -> Vec<Option<Slab>> {
        let mut slabs = vec![None; tree.nodes.len()];
        for (parent, patch) in tree.nodes.iter().zip(patches) {
            let children = || parent.children.iter().map(|&child| child as usize);
            if self.one_per_treelet {
                let along = |&n: &Vector| -> f64 {
                    let owners = children().filter(|&child| self.owns(&tree.nodes[child]));
                    owners.map(|child| self.slab(tree, &tree.nodes[child], n).share).sum()
                };
                let Some(n) = self.narrowest(patch, along) else { continue };
                for child in children().filter(|&child| self.owns(&tree.nodes[child])) {
                    slabs[child] = Some(self.slab(tree, &tree.nodes[child], n));
                }
                continue;
            }
            for child in children().filter(|&child| self.owns(&tree.nodes[child])) {
                let node = &tree.nodes[child];
                let width = |&n: &Vector| {
                    let slab = self.slab(tree, node, n);
                    (slab.ends[1] - slab.ends[0]) / slab.length
                };
                slabs[child] = self.narrowest(&patches[child], width).map(|n| self.slab(tree, node, n));
            }
        }
        for slab in &mut slabs {
            *slab = slab.filter(|slab| slab.share <= self.max_share);
        }
        slabs
    }

    fn owns(&self, node: &Node) -> bool {
        let kind = match self.owners {
            Owners::All => true,
            Owners::Leaves => node.triangles > 0,
            Owners::Treelets => node.triangles == 0,
        };
        kind && node.below <= self.max_triangles
    }

    /// Returns the stored direction, of those wished for, with the least width.
    fn narrowest(&self, patch: &Patch, width: impl Fn(&Vector) -> f64) -> Option<Vector> {
        let wished = match self.wish {
            Wish::Normal => vec![patch.normal],
            Wish::Axis => vec![patch.axis],
            Wish::Narrower => vec![patch.normal, patch.axis],
        };
        let stored = wished.into_iter().map(|direction| self.code.stored(direction));
        stored.map(|n| (width(&n), n)).min_by(|p, q| p.0.total_cmp(&q.0)).map(|(_, n)| n)
    }

    /// Returns the slab of a node along n.
    fn slab(&self, tree: &Tree, node: &Node, n: Vector) -> Slab {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in tree.corners_below(node).as_flattened() {
            let along = dot(n, corner.map(f64::from));
            (least, most) = (least.min(along), most.max(along));
        }
        // Sums of f64 products may round to within the box's reach.
        let (low, high) = (reach(&node.bound, n.map(|c| -c)), reach(&node.bound, n));
        let (low, high) = ((-low).min(least), high.max(most));
        let last = f64::from((1u32 << self.end_bits) - 1);
        let step = (high - low) / last;
        // The largest code, or the one before where a rounded product would be too large.
        let moved = |inward: f64, fits: &dyn Fn(f64) -> bool| {
            let code = if step > 0.0 { (inward / step).floor().clamp(0.0, last) } else { 0.0 };
            [code, code - 1.0].map(|code| code * step).into_iter().find(|&moved| moved > 0.0 && fits(moved))
        };
        let up = moved(least - low, &|moved| low + moved <= least).unwrap_or(0.0);
        let down = moved(high - most, &|moved| high - moved >= most).unwrap_or(0.0);
        let ends = [low + up, high - down];
        let share = if high > low { (ends[1] - ends[0]) / (high - low) } else { 1.0 };
        Slab { n, length: length(n), ends, share }
    }
}

/// Returns how far the box of a node reaches along x.
pub(super) fn reach(bound: &Kdop, x: Vector) -> f64 {
    let end = |axis: usize| f64::from(if x[axis] < 0.0 { bound.lo[axis] } else { bound.hi[axis] });
    x[0] * end(0) + x[1] * end(1) + x[2] * end(2)
}
