//! Tests whether slabs along directions of their own, with boxes, keep two nodes apart.
//!
//! Along a direction x a node reaches no further than alpha times its slab along n, and the box's reach along what
//! remains of x, x - alpha n; a negative alpha swaps the slab's ends. That holds for every alpha.

use super::slab::{Slab, reach};
use super::vector::{Vector, dot, minus, plus, times, turned, unit};
use crate::placed::Placed;
use crate::tree::Node;

/// The directions to test, as bits.
pub(super) const N_A: u8 = 1;
pub(super) const N_B: u8 = 2;
/// n_A - n_B, both of length 1.
pub(super) const DIFFERENCE: u8 = 4;
/// n_A + n_B.
pub(super) const SUM: u8 = 8;
/// From the centre of A's box to that of B's.
pub(super) const CENTRES: u8 = 16;
pub(super) const ALL: u8 = 31;

/// Which factors of a slab are tried along directions that are not its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Factors {
    /// 0: the box alone.
    None,
    /// The cosine: the least length of the rest.
    Projection,
    /// 1 or -1.
    Whole,
    /// The better one of projection and whole.
    Both,
}

/// What is tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlabRule {
    pub(super) directions: u8,
    pub(super) factors: Factors,
    /// Whether B is looked for on the side of A on which the centre of its box is, and not on the other one.
    pub(super) one_side: bool,
    /// Whether only pairs of leaf packets are tested.
    pub(super) packets_only: bool,
}

impl SlabRule {
    pub(super) const USUAL: Self =
        Self { directions: ALL, factors: Factors::Both, one_side: false, packets_only: false };

    /// Returns true if a direction keeps the nodes apart by more than `limit` mesh units. At least one has a slab.
    pub(super) fn apart(&self, a: Side<'_>, b: Side<'_>, placed: &Placed, limit: f64) -> bool {
        let (rotation, t) = (&placed.rotation, placed.translation);
        let back = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[j][i]));
        let n_a = a.slab.map(|slab| times(slab.n, 1.0 / slab.length));
        let n_b = b.slab.map(|slab| turned(rotation, times(slab.n, 1.0 / slab.length)));
        let both = n_a.zip(n_b);
        let towards_b = minus(plus(turned(rotation, b.centre()), t), a.centre());
        let tried = |direction: u8| match direction {
            _ if self.directions & direction == 0 => None,
            N_A => n_a,
            N_B => n_b,
            DIFFERENCE => both.map(|(n_a, n_b)| unit(minus(n_a, n_b))),
            SUM => both.map(|(n_a, n_b)| unit(plus(n_a, n_b))),
            _ => Some(unit(towards_b)),
        };
        [N_A, N_B, DIFFERENCE, SUM, CENTRES].into_iter().any(|direction| {
            let Some(x) = tried(direction) else { return false };
            // A slab counts along its own direction, whatever factors are tried along others.
            let (own_a, own_b) = (direction == N_A, direction == N_B);
            let seen_b = turned(&back, x);
            let near = if dot(x, towards_b) < 0.0 { -1.0 } else { 1.0 };
            [near, -near].into_iter().take(if self.one_side { 1 } else { 2 }).any(|sign| {
                let upper_a = a.upper(times(x, sign), own_a, self.factors);
                let upper_b = b.upper(times(seen_b, -sign), own_b, self.factors);
                sign * dot(x, t) - upper_b - upper_a > limit
            })
        })
    }
}

/// A node with its slab.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) node: &'a Node,
    pub(super) slab: Option<&'a Slab>,
}

impl Side<'_> {
    fn centre(&self) -> Vector {
        let bound = &self.node.bound;
        [0, 1, 2].map(|axis| (f64::from(bound.lo[axis]) + f64::from(bound.hi[axis])) / 2.0)
    }

    /// Returns an upper bound of x . p over the points p of the node's triangles, mesh units, for x of length 1 in the node's
    /// frame. `own` says that x is the slab's direction.
    pub(super) fn upper(&self, x: Vector, own: bool, factors: Factors) -> f64 {
        let bound = &self.node.bound;
        let whole = reach(bound, x);
        let Some(slab) = self.slab else { return whole };
        let cosine = dot(x, slab.n) / slab.length;
        let with = |factor: f64| {
            let alpha = factor / slab.length;
            let end = if alpha < 0.0 { slab.ends[0] } else { slab.ends[1] };
            alpha * end + reach(bound, minus(x, times(slab.n, alpha)))
        };
        match factors {
            _ if own => whole.min(with(cosine)),
            Factors::None => whole,
            Factors::Projection => whole.min(with(cosine)),
            Factors::Whole => whole.min(with(cosine.signum())),
            Factors::Both => whole.min(with(cosine)).min(with(cosine.signum())),
        }
    }
}
