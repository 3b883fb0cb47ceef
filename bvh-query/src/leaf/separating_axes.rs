//! Finds which of 16 triangle pairs are apart and which intersect, by separating axes in two stages.
//!
//! Stage one tests the two face planes of each pair of triangles and decides most pairs. The remaining pairs are
//! queued, so that stage two, the nine cross products of edges, has full lanes. Axes are not normalised. Pairs that
//! neither stage decides go to exact arithmetic.
//!
//! A pair is apart if its projections on one axis certainly are. It intersects if its projections on all eleven axes
//! certainly overlap in more than a point. Corners of either triangle are then strictly on both sides of the other's
//! plane, so both triangles have area and their planes cross. The differences of their points form a body whose facets
//! are perpendicular to these axes, since a facet comes from a face and a corner or from two edges (Gottschalk, Lin,
//! Manocha, OBBTree, SIGGRAPH 1996, show this for boxes). The origin is strictly inside all of its facets.
//!
//! Error. Let e bound the error of every coordinate, r the sum of the magnitudes of a coordinate of A and one of B
//! (`Local`), and E the largest edge component. A product of two edge components is off by 4 E e + 4u E^2. A component
//! of the axis is off by twice that, and by u of itself. A projection sums three products of an axis component (at most
//! 2 E^2) and a coordinate or difference (at most r). The height of a corner over a face of B is such a projection,
//! too. Its three parts, along the corner, the offset and the corner of the face, are at most r together, and their two
//! sums lose 12u E^2 r more. Together that stays below `E r (48 e + 112 u E)`. Squares of numbers below 2^-75 vanish.
//! 2^-120 is added for them; the frame's unit makes it far less than any projection that matters.

use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes};
use crate::leaf::local::{Local, repeat, tile, valid_lanes};
use crate::leaf::math::{Corners, Vec3, cross, dot, edges, largest_of, max3, min3, project};
use crate::leaf::placed_packet::{PlacedPacket, load4};
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::numerics::{CUBE_UNDERFLOW, U};

/// Stage two: the candidates of a queue, in the order of arrival, that no edge axis separates.
#[inline(always)]
pub(crate) fn drain<I: Isa>(isa: I, queue: &mut TriangleQueue) -> Survivors {
    let (a, b) = queue.corners(isa);
    let edges = edge_axes(isa, &a, &b, queue.error(isa), queue.reach(isa));
    let (mask, certain) = (queue.filled() & !edges.apart, queue.straddling() & edges.overlap);
    Survivors { candidates: queue.take(), mask, certain }
}

/// Candidates left by stage two.
pub(crate) struct Survivors {
    candidates: [Option<TrianglePair>; 16],
    mask: u16,
    certain: u16,
}

impl Iterator for Survivors {
    /// A candidate, and whether it certainly intersects.
    type Item = (TrianglePair, bool);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        if self.mask == 0 {
            return None;
        }
        let at = self.mask.trailing_zeros() as usize;
        self.mask &= self.mask - 1;
        let candidate = self.candidates[at & 15]?;
        Some((candidate, self.certain >> at & 1 != 0))
    }
}

/// The lanes whose projections are certainly apart on one of several axes, and those whose projections certainly
/// overlap in more than a point on all of them.
#[derive(Clone, Copy)]
pub(crate) struct Sides {
    pub(crate) apart: u16,
    pub(crate) overlap: u16,
}

/// Stage one: both face planes of the pairs of two packets. Lanes that hold no pair are apart.
#[inline(always)]
pub(crate) fn face_planes<I: Isa>(isa: I, local: &Local<'_>, a: LeafPacket, b: LeafPacket) -> Sides {
    let (lanes_a, lanes_b) = local.lanes(isa);
    let (mut error_a, mut error_b, mut offset_b) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    isa.store4(error(isa, local, local.a), &mut error_a);
    isa.store4(error(isa, local, local.b), &mut error_b);
    let along = local.offset_along(isa, load4(isa, &local.b.normal));
    isa.store4(isa.load4(&local.b.lo).add(along), &mut offset_b);
    // All corners of a face have the same projection on its normal, but for the error.
    let (offset, error) = (isa.repeat(&local.a.lo), isa.repeat(&error_a));
    let of_a = sides(isa, repeat(isa, &local.a.normal), offset, error, &lanes_b);
    let (offset, error) = (isa.tile(&offset_b), isa.tile(&error_b));
    let of_b = sides(isa, tile(isa, &local.b.normal), offset, error, &lanes_a);
    let none = !valid_lanes(a.triangles, b.triangles);
    Sides { apart: of_a.apart | of_b.apart | none, overlap: of_a.overlap & of_b.overlap }
}

/// The errors of projections on the normals of four faces.
#[inline(always)]
fn error<I: Isa>(isa: I, local: &Local<'_>, packet: &PlacedPacket) -> I::F32x4 {
    let edge = isa.load4(&packet.edge);
    let relative = edge.mul_add(isa.splat4(112.0 * U), isa.splat4(48.0 * local.error));
    edge.mul(isa.splat4(local.reach)).mul_add(relative, isa.splat4(CUBE_UNDERFLOW))
}

/// Where three points are: all certainly on one side of a plane, or certainly on both.
#[inline(always)]
fn sides<I: Isa>(
    isa: I,
    normal: Vec3<I::F32x16>,
    offset: I::F32x16,
    error: I::F32x16,
    points: &Corners<I::F32x16>,
) -> Sides {
    let heights = project(points, normal);
    let (lowest, highest) = (min3(heights).sub(offset), max3(heights).sub(offset));
    let below_error = isa.splat(0.0).sub(error);
    let apart = I::F32x16::bits(error.lt(lowest)) | I::F32x16::bits(highest.lt(below_error));
    Sides { apart, overlap: I::F32x16::bits(lowest.lt(below_error)) & I::F32x16::bits(error.lt(highest)) }
}

/// Stage two: the nine cross products of edges.
#[inline(always)]
fn edge_axes<I: Isa>(
    isa: I,
    a: &Corners<I::F32x16>,
    b: &Corners<I::F32x16>,
    error: I::F32x16,
    reach: I::F32x16,
) -> Sides {
    let (edges_a, edges_b) = (edges(a), edges(b));
    let edge = largest_of(&edges_a).max(largest_of(&edges_b));
    let relative = edge.mul_add(isa.splat(112.0 * U), error.mul(isa.splat(48.0)));
    // Two projections are compared, each with its error.
    let both = edge.mul(reach).mul(isa.splat(2.0));
    let error = both.mul_add(relative, isa.splat(2.0 * CUBE_UNDERFLOW));
    let below_error = isa.splat(0.0).sub(error);
    let mut sides = Sides { apart: 0, overlap: u16::MAX };
    for i in 0..3 {
        for j in 0..3 {
            let axis = cross(edges_a[i], edges_b[j]);
            // Both ends of an edge project to one value; the third corner is the one before it.
            let (a0, a1) = (dot(axis, a[i]), dot(axis, a[(i + 2) % 3]));
            let (b0, b1) = (dot(axis, b[j]), dot(axis, b[(j + 2) % 3]));
            let gap_up = b0.min(b1).sub(a0.max(a1));
            let gap_down = a0.min(a1).sub(b0.max(b1));
            let gap = gap_up.max(gap_down);
            sides.apart |= I::F32x16::bits(error.lt(gap));
            sides.overlap &= I::F32x16::bits(gap.lt(below_error));
        }
    }
    sides
}
