//! Bounds the distance of the triangles of a leaf packet from a node much smaller than they are.
//!
//! The k-DOP of a packet says little about a node inside it: where one triangle is larger than the whole other mesh, the
//! node test lets through every node of that mesh down to its leaves. So each triangle is bounded by itself, along the
//! direction from its closest point to the centre of the node. Whatever the direction is, the gap of the projections on
//! it is at most its length times the distance.
//!
//! Rounding: everything is computed in f64 from decoded slab ends, which are exact, so only three errors are charged.
//! Coefficients of the form are rounded to f32 (`form_error`). A placed vertex is off by `Placement::error` along each
//! axis, and so is the offset. Three products and two sums for each of two projections round by less than 2^-49 of the
//! coordinates, whose magnitudes `Placement::error` is 2^-48 of.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::numerics::SLACK;
use crate::traverse::align::form_error;
use crate::traverse::cached_node::{CachedNode, ChildRef};
use crate::traverse::forms::{Form, upper_form};
use crate::traverse::node_cache::NodeCache;
use crate::traverse::pending::Entry;
use crate::traverse::placement::{ObjectPair, Placement};
use bvh_format::kdop::DirectionSet;
use bvh_format::object::Object;
use bvh_format::vec3::dot;

type Point = [f64; 3];

/// The triangles of a leaf packet are bounded one by one if the packet is this many times larger than the node it meets.
const EXTENT_RATIO_TO_TEST_TRIANGLES: f32 = 8.0;

/// The number of visits without these bounds after triangles were not beyond the limit. A walk in which they never are
/// therefore takes at most twice as long.
const VISITS_AFTER_FAILED_BOUNDS: u32 = 4;

/// The leaf packets of A and of B that a walk bounded last, and when it bounds the next.
#[derive(Default)]
pub(crate) struct LargeLeaves {
    leaf_a: LargeLeaf,
    leaf_b: LargeLeaf,
    /// How many small nodes large leaf packets still meet before triangles are bounded again.
    unbounded_visits: u32,
}

impl LargeLeaves {
    /// Forgets all packets, before a walk.
    pub(crate) fn start(&mut self) {
        (self.leaf_a.of, self.leaf_b.of) = (None, None);
        self.unbounded_visits = 0;
    }

    /// Returns whether an entry is a leaf packet against a much smaller node and its triangles are certainly beyond
    /// `limit` of that node. After a test without success, it returns false for some visits without a test.
    #[inline(always)]
    pub(crate) fn are_beyond(
        &mut self,
        pair: &ObjectPair<'_>,
        nodes: &NodeCache,
        reaches: (f32, f32),
        entry: Entry,
        limit: f32,
    ) -> Result<bool, QueryError> {
        let (a, b) = (nodes.child(entry.a), nodes.child(entry.b));
        let is_large = a.is_leaf() && a.extent > EXTENT_RATIO_TO_TEST_TRIANGLES * b.extent
            || b.is_leaf() && b.extent > EXTENT_RATIO_TO_TEST_TRIANGLES * a.extent;
        if !is_large {
            return Ok(false);
        }
        if self.unbounded_visits > 0 {
            self.unbounded_visits -= 1;
            return Ok(false);
        }
        let beyond = self.bound_triangles(pair, nodes, reaches, entry, limit)?;
        self.unbounded_visits = if beyond { 0 } else { VISITS_AFTER_FAILED_BOUNDS };
        Ok(beyond)
    }

    /// Returns whether the triangles of the leaf packet of an entry are certainly beyond `limit` of the other node.
    #[inline(never)]
    fn bound_triangles(
        &mut self,
        pair: &ObjectPair<'_>,
        nodes: &NodeCache,
        (reach_a, reach_b): (f32, f32),
        entry: Entry,
        limit: f32,
    ) -> Result<bool, QueryError> {
        if let Some(leaf) = nodes.leaf(entry.a) {
            self.leaf_a.hold((pair.bvh_a, pair.object_a), (entry.a, leaf), None)?;
            let set = pair.object_b.profile().directions();
            let small =
                SmallNode { node: nodes.get(entry.b.node()), child: entry.b.child(), set, reach: reach_b };
            return Ok(self.leaf_a.is_beyond_b(pair.placement, &small, limit));
        }
        let Some(leaf) = nodes.leaf(entry.b) else { return Ok(false) };
        self.leaf_b.hold((pair.bvh_b, pair.object_b), (entry.b, leaf), Some(pair.placement))?;
        let set = pair.object_a.profile().directions();
        let small =
            SmallNode { node: nodes.get(entry.a.node()), child: entry.a.child(), set, reach: reach_a };
        Ok(self.leaf_b.is_beyond_a(pair.placement, &small, limit))
    }
}

/// The triangles of one leaf packet, in A's frame.
struct LargeLeaf {
    of: Option<ChildRef>,
    triangles: [[Point; 3]; 4],
    count: usize,
}

impl Default for LargeLeaf {
    fn default() -> Self {
        Self { of: None, triangles: [[[0.0; 3]; 3]; 4], count: 0 }
    }
}

/// A node, with what projecting it takes.
struct SmallNode<'a> {
    node: &'a CachedNode,
    child: usize,
    set: DirectionSet,
    /// A bound on its slab ends.
    reach: f32,
}

impl SmallNode<'_> {
    /// Returns a slab end by its row: lower ends from 0 on, upper ends from 16 on.
    fn end(&self, row: usize) -> f64 {
        f64::from(self.node.group.rows()[row & 31][self.child & 3])
    }

    /// Returns the centre of its box.
    fn centre(&self) -> Point {
        [0, 1, 2].map(|axis| (self.end(axis) + self.end(16 + axis)) / 2.0)
    }

    /// Evaluates a form over its slab ends.
    fn evaluate(&self, form: &Form) -> f64 {
        let term = |j: usize| f64::from(form.coefficients[j]) * self.end(usize::from(form.rows[j]));
        term(0) + term(1) + term(2)
    }

    /// Returns an upper bound of its points along `d`.
    fn upper(&self, d: Point) -> f64 {
        let form = upper_form(d, self.set);
        self.evaluate(&form) + form_error(form.coefficients, self.reach, 0.0)
    }
}

impl LargeLeaf {
    /// Decodes a packet, unless it is the one held. A packet of B is placed in A's frame by `place`.
    fn hold(
        &mut self,
        (bvh, object): (&Bvh, &Object),
        (at, leaf): (ChildRef, LeafPacket),
        place: Option<&Placement>,
    ) -> Result<(), QueryError> {
        if self.of == Some(at) {
            return Ok(());
        }
        self.of = None;
        self.count = usize::from(leaf.triangles).min(4);
        for lane in 0..self.count {
            let corners = bvh.triangle(object, leaf, lane as u8)?.map(|corner| corner.map(f64::from));
            self.triangles[lane] = match place {
                Some(placement) => corners.map(|corner| placement.place(corner)),
                None => corners,
            };
        }
        self.of = Some(at);
        Ok(())
    }

    /// Returns whether every triangle of the packet, which is A's, is certainly farther than `limit` from a node of B.
    fn is_beyond_b(&self, placement: &Placement, b: &SmallNode<'_>, limit: f32) -> bool {
        let centre = placement.place(b.centre());
        self.triangles[..self.count].iter().all(|triangle| {
            let Some(d) = direction(triangle, centre) else { return false };
            let from_b = placement.seen_from_b(d);
            let lower_b = dot(d, placement.translation) - b.upper([-from_b[0], -from_b[1], -from_b[2]]);
            let upper_a = triangle.iter().map(|&corner| dot(d, corner)).fold(f64::NEG_INFINITY, f64::max);
            lower_b - upper_a - 6.0 * placement.error > f64::from(limit)
        })
    }

    /// Returns whether every triangle of the packet, which is B's, is certainly farther than `limit` from a node of A.
    fn is_beyond_a(&self, placement: &Placement, a: &SmallNode<'_>, limit: f32) -> bool {
        let centre = a.centre();
        self.triangles[..self.count].iter().all(|triangle| {
            let Some(d) = direction(triangle, centre) else { return false };
            let upper_b = triangle.iter().map(|&corner| dot(d, corner)).fold(f64::NEG_INFINITY, f64::max);
            let lower_a = -a.upper([-d[0], -d[1], -d[2]]);
            lower_a - upper_b - 6.0 * placement.error > f64::from(limit)
        })
    }
}

/// Returns the direction from the closest point of a triangle to a point, at most of length 1; none if the point is on the
/// triangle.
fn direction(triangle: &[Point; 3], point: Point) -> Option<Point> {
    let closest = closest_point(triangle, point);
    let d = [0, 1, 2].map(|axis| point[axis] - closest[axis]);
    let length = dot(d, d).sqrt();
    let unit = d.map(|x| x / length * (1.0 - SLACK));
    unit.iter().all(|x| x.is_finite()).then_some(unit)
}

/// Returns the closest point of a triangle, to within rounding: Ericson, Real-Time Collision Detection, 5.1.5.
fn closest_point([a, b, c]: &[Point; 3], p: Point) -> Point {
    let sub = |p: Point, q: &Point| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let from = |base: &Point, s: f64, u: Point| [0, 1, 2].map(|i| base[i] + s * u[i]);
    let (ab, ac) = (sub(*b, a), sub(*c, a));
    let ap = sub(p, a);
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return from(a, d1 / (d1 - d3), ab);
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return from(a, d2 / (d2 - d6), ac);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return from(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(*c, b));
    }
    let scale = 1.0 / (va + vb + vc);
    from(&from(a, vb * scale, ab), vc * scale, ac)
}
