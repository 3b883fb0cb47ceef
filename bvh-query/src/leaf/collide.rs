//! Which of 16 triangle pairs may intersect: separating axes in two stages.
//!
//! Stage one looks at the two face planes of each pair of a packet pair and settles most of them.
//! The remaining pairs are queued, so that stage two, the nine cross products of edges, has full lanes.
//! Axes are not normalised. The pairs that stage two cannot separate go to exact arithmetic.
//!
//! Error. Let e bound the error of every coordinate, r the sum of the magnitudes of a coordinate of
//! A and one of B (`Local`), and E the largest edge component. A product of two edge components is
//! off by 4 E e + 4u E^2, a component of the axis by twice that and u of itself; a projection sums
//! three products of an axis component (at most 2 E^2) and a coordinate or difference (at most r).
//! Together that stays below `E r (48 e + 112 u E)`. Squares of numbers below 2^-75 vanish; the frame's
//! unit makes 2^-120 far less than any projection that matters, and it is added.

use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes};
use crate::leaf::local::{Local, U, repeat, tile, valid_lanes};
use crate::leaf::math::{Corners, Vec3, cross, dot, edges, largest, largest_of, max3, min3, project, sub};
use crate::leaf::queue::{TrianglePair, TriangleQueue};

/// A bound of all underflows of a projection together: 2^-120, in cubes of the frame's unit.
const UNDERFLOW: f32 = f32::from_bits((127 - 120) << 23);

/// Stage two: the candidates of a queue, in the order of arrival, that no edge axis separates.
#[inline(always)]
pub(crate) fn drain<I: Isa>(isa: I, queue: &mut TriangleQueue) -> Survivors {
    let (a, b) = queue.corners(isa);
    let mask = queue.filled() & !edge_axes(isa, &a, &b, queue.error(isa), queue.reach(isa));
    Survivors { candidates: queue.take(), mask }
}

/// Candidates left by stage two.
pub(crate) struct Survivors {
    candidates: [Option<TrianglePair>; 16],
    mask: u16,
}

impl Iterator for Survivors {
    type Item = TrianglePair;

    fn next(&mut self) -> Option<TrianglePair> {
        if self.mask == 0 {
            return None;
        }
        let at = self.mask.trailing_zeros() as usize;
        self.mask &= self.mask - 1;
        self.candidates[at]
    }
}

/// Stage one: the lanes of a packet pair that neither face plane separates.
#[inline(always)]
pub(crate) fn face_planes<I: Isa>(isa: I, local: &Local, a: LeafPacket, b: LeafPacket) -> u16 {
    let (lanes_a, lanes_b) = local.lanes(isa);
    let plane_a = Plane::new(isa, &Local::quads(isa, &local.a), local);
    let (offset, error) = (isa.repeat(&plane_a.offset), isa.repeat(&plane_a.error));
    let apart_a = one_sided(isa, repeat(isa, &plane_a.normal), offset, error, &lanes_b);
    let plane_b = Plane::new(isa, &Local::quads(isa, &local.b), local);
    let (offset, error) = (isa.tile(&plane_b.offset), isa.tile(&plane_b.error));
    let apart_b = one_sided(isa, tile(isa, &plane_b.normal), offset, error, &lanes_a);
    valid_lanes(a.triangles, b.triangles) & !(apart_a | apart_b)
}

/// The planes of four triangles: normal, offset and the error of a projection.
struct Plane {
    normal: [[f32; 4]; 3],
    offset: [f32; 4],
    error: [f32; 4],
}

impl Plane {
    #[inline(always)]
    fn new<I: Isa>(isa: I, corners: &Corners<I::H>, local: &Local) -> Self {
        let (edge_1, edge_2) = (sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let normal = cross(edge_1, edge_2);
        let edge = largest(edge_1).max(largest(edge_2));
        let relative = edge.mul_add(isa.splat4(112.0 * U), isa.splat4(48.0 * local.error));
        let error = edge.mul(isa.splat4(local.reach)).mul_add(relative, isa.splat4(UNDERFLOW));
        let mut plane = Self { normal: [[0.0; 4]; 3], offset: [0.0; 4], error: [0.0; 4] };
        for axis in 0..3 {
            isa.store4(normal[axis], &mut plane.normal[axis]);
        }
        isa.store4(dot(normal, corners[0]), &mut plane.offset);
        isa.store4(error, &mut plane.error);
        plane
    }
}

/// Lanes whose three points are all certainly on one side of the plane.
#[inline(always)]
fn one_sided<I: Isa>(isa: I, normal: Vec3<I::V>, offset: I::V, error: I::V, points: &Corners<I::V>) -> u16 {
    let heights = project(points, normal);
    let above = I::V::bits(error.lt(min3(heights).sub(offset)));
    let below = I::V::bits(max3(heights).sub(offset).lt(isa.splat(0.0).sub(error)));
    above | below
}

/// The lanes that one of the nine cross products of edges separates.
#[inline(always)]
fn edge_axes<I: Isa>(isa: I, a: &Corners<I::V>, b: &Corners<I::V>, error: I::V, reach: I::V) -> u16 {
    let (edges_a, edges_b) = (edges(a), edges(b));
    let edge = largest_of(&edges_a).max(largest_of(&edges_b));
    let relative = edge.mul_add(isa.splat(112.0 * U), error.mul(isa.splat(48.0)));
    // Two projections are compared, each with its error.
    let both = edge.mul(reach).mul(isa.splat(2.0));
    let error = both.mul_add(relative, isa.splat(2.0 * UNDERFLOW));
    let mut apart = 0;
    for i in 0..3 {
        for j in 0..3 {
            let axis = cross(edges_a[i], edges_b[j]);
            // Both ends of an edge project to one value; the third corner is the one before it.
            let (a0, a1) = (dot(axis, a[i]), dot(axis, a[(i + 2) % 3]));
            let (b0, b1) = (dot(axis, b[j]), dot(axis, b[(j + 2) % 3]));
            let gap_up = b0.min(b1).sub(a0.max(a1));
            let gap_down = a0.min(a1).sub(b0.max(b1));
            apart |= I::V::bits(error.lt(gap_up.max(gap_down)));
        }
    }
    apart
}
