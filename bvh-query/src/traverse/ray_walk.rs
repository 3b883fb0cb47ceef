//! The walk of a ray or a segment along the boxes that an open file keeps for it ([`crate::file::ray_tree`]).
//!
//! ```text
//! next := the root
//! loop:
//!     if next is a node: keep the children whose boxes the segment meets, farthest first; else visitor.leaf(next)
//!     next := the last child that was kept and is entered before the limit; if there is none: end
//! ```
//!
//! A line has the points p + t q. Along an axis it is within a box for t from (lo - p) / q to (hi - p) / q, and within the box where
//! this holds for all three (T. L. Kay, J. T. Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986). Of each axis, the end that the
//! line meets first is in the first eight lanes of a register, and the other end in the others, with the opposite sign. So the
//! largest of three registers holds the entries and the negated exits of eight boxes.
//!
//! Error, with u = 2^-24: let the points of the line be off by e. Boxes are moved outward by w = 3u |p| + 8e, which is more than twice
//! what rounding p and w to f32 takes and e. The remaining errors are relative: a rounded difference, a rounded inverse and a product
//! make an end of the interval wrong by 3u of itself. To cover this, entries are made less, and exits greater, by 8u, which is part of
//! the inverse. The signs are right, so this also holds for ends before the start, which count as 0. Where shapes reach r around their
//! triangles, boxes are first moved by r, of which w has 3u more.
//!
//! An inverse beyond the range of f32 is the largest f32, or infinite. Where the line is within the slab of an axis by w / 2 or more, the
//! exit is then beyond all t that matter: w is at least the least normal f32, and t goes up to 1, or w is at least 2^-44 of the size of
//! the object, see [`crate::query::probe`]. Where the line is outside, it never enters. `max` returns its second operand for NaN, so
//! that the product of zero and an infinite inverse changes nothing.

use crate::error::QueryError;
use crate::file::ray_tree::{RayChild, RayTree};
use crate::isa::{Isa, Lanes, Task};
use crate::numerics::U;

/// What a question does with the leaf packets that a ray meets.
pub(crate) trait RayVisitor {
    /// Returns the limit: what the ray enters later is not visited; a negative one if no more need be known.
    fn limit(&self) -> f32;

    /// Visits a leaf packet by its place and the number of its triangles.
    fn leaf<I: Isa>(&mut self, isa: I, leaf: (u32, u8)) -> Result<(), QueryError>;
}

/// A line as the test of boxes needs it.
pub(crate) struct BoxFilter {
    /// Which ends of boxes the line meets first and last along each axis.
    near: [usize; 3],
    far: [usize; 3],
    /// What is subtracted from these ends, and what the differences are multiplied by.
    subtracted: [[f32; 2]; 3],
    inverse: [[f32; 2]; 3],
    /// The greatest parameter.
    end: f32,
}

impl BoxFilter {
    /// The line through a point around the object's origin, whose points are off by `error` and go up to a parameter `end`. `inverse` has
    /// the inverses of the components of its direction. The object reaches so far around its triangles.
    #[inline(always)]
    pub(crate) fn new(point: &[f64; 3], inverse: &[f64; 3], [error, reach]: [f64; 2], end: f32) -> Self {
        /// 8u.
        const SLACK: f64 = 1.0 / (1 << 21) as f64;
        let least = 8.0 * error + f64::from(f32::MIN_POSITIVE);
        let (mut near, mut far) = ([0; 3], [0; 3]);
        let (mut subtracted, mut of_one) = ([[0.0; 2]; 3], [[0.0; 2]; 3]);
        for axis in 0..3 {
            let (p, most) = (point[axis], f64::from(f32::MAX));
            let outward = 3.0 * f64::from(U) * (p.abs() + reach) + least + reach;
            let ends = [(p + outward) as f32, (p - outward) as f32];
            let inverse = inverse[axis].clamp(-most, most);
            let descends = usize::from(inverse < 0.0);
            (near[axis], far[axis]) = (axis + 3 * descends, axis + 3 - 3 * descends);
            subtracted[axis] = [ends[descends], ends[1 - descends]];
            of_one[axis] = [((1.0 - SLACK) * inverse) as f32, (-(1.0 + SLACK) * inverse) as f32];
        }
        Self { near, far, subtracted, inverse: of_one, end }
    }
}

/// A walk of a tree.
pub(crate) struct RayWalk<'a, V> {
    pub(crate) tree: &'a RayTree,
    pub(crate) filter: BoxFilter,
    /// Room for children that are kept: their entries in the upper halves, and what they are in the lower ones.
    pub(crate) stack: &'a mut Vec<u64>,
    pub(crate) visitor: &'a mut V,
}

/// Returns eight numbers followed by eight others.
#[inline(always)]
fn sides<I: Isa>(isa: I, [near, far]: [f32; 2]) -> I::F32x16 {
    isa.halves(&[near; 8], &[far; 8])
}

impl<V: RayVisitor> Task for RayWalk<'_, V> {
    /// The number of node tests.
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { tree, filter, stack, visitor } = self;
        if stack.len() < tree.most_pending {
            stack.resize(tree.most_pending, 0);
        }
        let (nodes, stack) = (tree.nodes(), &mut stack[..]);
        let BoxFilter { near, far, subtracted, inverse, end } = filter;
        let subtracted = [sides(isa, subtracted[0]), sides(isa, subtracted[1]), sides(isa, subtracted[2])];
        let inverse = [sides(isa, inverse[0]), sides(isa, inverse[1]), sides(isa, inverse[2])];
        let zero = isa.splat(0.0);
        let mut limit = visitor.limit();
        let mut bounds = sides(isa, [0.0, -limit.min(end)]);
        let (mut next, mut kept, mut tests) = (RayChild::node(0), 0, 0);
        loop {
            if let Some(number) = next.as_node() {
                let Some(node) = nodes.get(number) else { unreachable!("a child is a node of its tree") };
                tests += 1;
                let mut entries = bounds;
                for axis in 0..3 {
                    let ends = isa.halves(&node.ends[near[axis] % 6], &node.ends[far[axis] % 6]);
                    entries = ends.sub(subtracted[axis]).mul(inverse[axis]).max(entries);
                }
                let exits = zero.sub(isa.swap_halves(entries));
                let met = I::F32x16::bits(entries.le(exits)) & 0xff;
                if met != 0 && met & (met - 1) == 0 {
                    next = node.children[met.trailing_zeros() as usize & 7];
                    continue;
                }
                let mut entry = [0.0; 16];
                isa.store(entries, &mut entry);
                let mut keys = Keys { entry: &entry, children: &node.children, met };
                if let Some(first) = keys.next()
                    && let Some(second) = keys.next()
                {
                    if kept + 8 > stack.len() {
                        unreachable!("a walk keeps seven children of each node above at most");
                    }
                    let bottom = kept;
                    stack[kept] = first.max(second);
                    let mut nearest = first.min(second);
                    kept += 1;
                    while let Some(key) = keys.next() {
                        let farther = key.max(nearest);
                        nearest = key.min(nearest);
                        // Farther ones below.
                        let mut at = kept;
                        while at > bottom && stack[at - 1] < farther {
                            stack[at] = stack[at - 1];
                            at -= 1;
                        }
                        stack[at] = farther;
                        kept += 1;
                    }
                    next = RayChild::from_bits(nearest as u32);
                    continue;
                }
            } else {
                visitor.leaf(isa, next.as_leaf())?;
                let new = visitor.limit();
                if new < limit {
                    if new < 0.0 {
                        return Ok(tests);
                    }
                    limit = new;
                    bounds = sides(isa, [0.0, -limit.min(end)]);
                }
            }
            loop {
                if kept == 0 {
                    return Ok(tests);
                }
                kept -= 1;
                let Some(key) = stack.get(kept) else { unreachable!("what was kept is on the stack") };
                if f32::from_bits((key >> 32) as u32) <= limit {
                    next = RayChild::from_bits(*key as u32);
                    break;
                }
            }
        }
    }
}

/// The children of a node that a segment meets: entries in the upper halves, which are in order as they are not negative, and what the
/// children are in the lower ones.
struct Keys<'a> {
    entry: &'a [f32; 16],
    children: &'a [RayChild; 8],
    /// A bit for each child that is left.
    met: u16,
}

impl Keys<'_> {
    #[inline(always)]
    fn next(&mut self) -> Option<u64> {
        if self.met == 0 {
            return None;
        }
        let lane = self.met.trailing_zeros() as usize & 7;
        self.met &= self.met - 1;
        // Zero may have a sign.
        let entry = self.entry[lane].to_bits() & !(1 << 31);
        Some(u64::from(entry) << 32 | u64::from(self.children[lane].bits()))
    }
}
