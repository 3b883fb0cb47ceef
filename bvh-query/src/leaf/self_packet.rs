//! Leaf packets of one mesh that meet others of it, and which of 16 pairs of their triangles certainly do not meet, or only
//! in the hull of their common corners.
//!
//! Three tests decide nearly all pairs of neighbours:
//!
//! - If all corners of B that A lacks are certainly on one side of A's plane, B meets this plane in the hull of the common
//!   corners alone.
//! - If the triangles have one common corner, and each has the other two certainly on both sides of the other's plane, then
//!   the signs tell whether they have another point in common, as `narrow::self_contact` explains.
//! - The plane through an edge of A, perpendicular to A, meets A in this edge alone. If all corners of B that are not ends of
//!   the edge are certainly beyond it, the triangles meet in the hull of the common ends alone. This decides neighbours in
//!   one plane.
//!
//! Error. The corners of one object are exact: `f32` values times a power of two that makes the object about 1 in size, unless
//! a product underflows, which is noticed. Let u = 2^-24, E the largest component of a triangle's edges from its first
//! corner, and D that of the difference between a corner and another point. Each edge and each difference is rounded once. A
//! component of the face's normal is at most 2 E^2 and is off by less than 8.1u E^2. The height sums three products of such a
//! component and one of the difference, with four roundings each, so it is off by less than 3 D (8.1 + 8.1) u E^2, which is
//! below 50u D E^2. The normal of an edge, at most 2 E long, is at most 8 E^3 and is off by less than
//! (2 (16.2 + 4 + 4) + 8) u E^3, so that the height beyond it is off by less than 3 D (56.4 + 32) u E^3, which is below
//! 270u D E^3. What underflows is less than 2^-120 in all, as D and E are at most about 2.
//!
//! Vertices that are predicted from their offsets are within d of the corners along each axis. Where corners are the same, so are
//! the vertices, and filters compare the corners with a charge: with E' = E + 2d and D' = D + 2d, a height is a sum of six
//! products of two edges and a difference, so it changes by at most 6 (E'^2 D' - E^2 D), below 12d E'^2 + 24d E' D'. A height
//! beyond an edge is a sum of twelve products, one of whose edges may be twice as long, so it changes by less than
//! 48d E'^3 + 144d E'^2 D'. At least a ninth more is charged for roundings. Corrected vertices may differ where corners do not, and are
//! always compared exactly.

use crate::isa::{Isa, Lanes};
use crate::leaf::frame::scale_of;
use crate::leaf::local::{repeat, tile};
use crate::leaf::math::{Corners, Vec3, cross, dot, edges, largest, max3, min3, sub};
use crate::leaf::placed_packet::load4;
use crate::narrow::Triangle;
use crate::numerics::{CUBE_UNDERFLOW, U};
use crate::traverse::packet_tree::{BEFORE, Boxes};
use bvh_format::leaf::{PACKET, Packet};
use bvh_format::object::Object;

/// Four triangles, and what the tests need of them.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct SelfPacket {
    /// The boxes of its triangles, around the origin of the shape. They are one monotone function of the exact coordinates,
    /// so that what overlaps exactly overlaps here.
    pub(crate) boxes: Boxes,
    /// Around the origin of the object: `[corner][axis]`.
    corners: [[[f32; 4]; 3]; 3],
    /// Perpendicular to each face, not normalised.
    normal: [[f32; 4]; 3],
    /// The largest magnitude of a component of the edges from the first corner.
    edge: [f32; 4],
    /// The place of the object in the shape.
    object: u32,
    /// How far the vertices are from the corners, at most.
    left_out: f32,
    /// Whether filters may compare the corners: scaling has kept them, and those of different vertices differ.
    is_comparable: bool,
    /// Whether the corners are the vertices, scaled.
    is_exact: bool,
}

/// The frame in which the packets of an object are compared.
#[derive(Clone, Copy)]
pub(crate) struct SelfFrame {
    /// The place of the object in the shape.
    object: u32,
    origin: [f64; 3],
    origin_of_shape: [f64; 3],
    /// Units of the frame in a mesh unit, a power of two.
    scale: f32,
    /// How far vertices are from their offsets, in mesh units.
    left_out: f64,
    /// Whether vertices are sums of the origin and their offsets.
    are_sums: bool,
    /// Whether vertices with the same offsets may differ.
    are_corrected: bool,
}

impl SelfFrame {
    pub(crate) fn new(place: u32, object: &Object, origin_of_shape: [f64; 3]) -> Self {
        let record = object.record();
        let sides = [0, 1, 2].map(|i| f64::from(record.box_hi[i].get()) - f64::from(record.box_lo[i].get()));
        let scale = scale_of(sides.into_iter().fold(0.0, f64::max)) as f32;
        let vertices = object.vertices();
        Self {
            object: place,
            origin: object.origin(),
            origin_of_shape,
            scale,
            left_out: object.volumes().left_out,
            are_sums: vertices.are_sums(),
            are_corrected: vertices.are_corrected(),
        }
    }
}

impl SelfPacket {
    pub(crate) const NONE: Self = Self {
        boxes: Boxes::EMPTY,
        corners: [[[0.0; 4]; 3]; 3],
        normal: [[0.0; 4]; 3],
        edge: [0.0; 4],
        object: 0,
        left_out: 0.0,
        is_comparable: false,
        is_exact: false,
    };

    /// Makes this a packet of an object.
    #[inline(always)]
    pub(crate) fn place<I: Isa>(&mut self, isa: I, frame: &SelfFrame, packet: &Packet, triangles: u8) {
        self.enclose(isa, frame, packet, triangles);
        let (scale, back) = (isa.splat4(frame.scale), isa.splat4(1.0 / frame.scale));
        let mut lost = isa.splat4(0.0);
        for corner in 0..3 {
            for axis in 0..3 {
                let stored = isa.load4(&packet.corners[corner][axis]);
                let scaled = stored.mul(scale);
                lost = lost.max(scaled.mul(back).sub(stored).abs());
                isa.store4(scaled, &mut self.corners[corner][axis]);
            }
        }
        self.is_comparable = I::F32x4::bits(lost.le(isa.splat4(0.0))) & 0xf == 0xf && !frame.are_corrected;
        self.is_exact = self.is_comparable && frame.are_sums;
        // Rounded up; far below 1, as the object is about 1 in size.
        self.left_out = if frame.are_sums { 0.0 } else { (frame.left_out as f32).next_up() * frame.scale };
        self.object = frame.object;
        let [p, q, r] = [0, 1, 2].map(|corner| load4(isa, &self.corners[corner]));
        let (edge_1, edge_2) = (sub(q, p), sub(r, p));
        let normal = cross(edge_1, edge_2);
        for axis in 0..3 {
            isa.store4(normal[axis], &mut self.normal[axis]);
        }
        isa.store4(largest(edge_1).max(largest(edge_2)), &mut self.edge);
    }

    /// Returns a triangle around the origin of its object, in a unit of its own.
    #[inline(always)]
    pub(crate) fn triangle(&self, lane: u8) -> Triangle {
        let mut triangle = [[0.0; 3]; 3];
        for corner in 0..3 {
            for axis in 0..3 {
                triangle[corner][axis] = f64::from(self.corners[corner][axis][usize::from(lane & 3)]);
            }
        }
        triangle
    }

    /// Returns whether the triangles of both packets are vertices in one unit and around one origin.
    #[inline(always)]
    pub(crate) fn are_exact(&self, other: &Self) -> bool {
        self.object == other.object && self.is_exact && other.is_exact
    }

    /// Returns whether filters may compare both packets.
    #[inline(always)]
    fn are_comparable(&self, other: &Self) -> bool {
        self.object == other.object && self.is_comparable && other.is_comparable
    }

    /// The normals of the edges from each corner to the next, in the plane of the face, outward.
    #[inline(always)]
    fn edge_normals<I: Isa>(&self, isa: I) -> [[[f32; 4]; 3]; 3] {
        let corners = [0, 1, 2].map(|corner| load4(isa, &self.corners[corner]));
        let (edges, normal) = (edges(&corners), load4(isa, &self.normal));
        let mut normals = [[[0.0; 4]; 3]; 3];
        for (edge, to) in edges.iter().zip(&mut normals) {
            let outward = cross(*edge, normal);
            for axis in 0..3 {
                isa.store4(outward[axis], &mut to[axis]);
            }
        }
        normals
    }

    /// Computes the boxes.
    #[inline(always)]
    pub(crate) fn enclose<I: Isa>(&mut self, isa: I, frame: &SelfFrame, packet: &Packet, triangles: u8) {
        for axis in 0..3 {
            let corners = &packet.corners;
            let of: Vec3<I::F32x4> =
                [isa.load4(&corners[0][axis]), isa.load4(&corners[1][axis]), isa.load4(&corners[2][axis])];
            let (lo, hi) = (&mut self.boxes.lo[axis], &mut self.boxes.hi[axis]);
            isa.store4(min3(of), lo);
            isa.store4(max3(of), hi);
            let (origin, from) = (frame.origin[axis], frame.origin_of_shape[axis]);
            if origin != from {
                for end in lo.iter_mut().chain(hi.iter_mut()) {
                    *end = ((origin + f64::from(*end)) - from) as f32;
                }
            }
            if !frame.are_sums {
                // The ends are rounded by half a step, and so is each of these sums.
                for (lo, hi) in lo.iter_mut().zip(hi.iter_mut()) {
                    *lo = ((f64::from(*lo) - frame.left_out) as f32).next_down();
                    *hi = ((f64::from(*hi) + frame.left_out) as f32).next_up();
                }
            }
            for place in usize::from(triangles)..PACKET {
                (lo[place], hi[place]) = (f32::INFINITY, f32::NEG_INFINITY);
            }
        }
    }

    /// Returns a bit for each pair of triangles that may be in contact, each pair once: bit `4 * a + b`.
    #[inline(always)]
    pub(crate) fn undecided<I: Isa>(&self, isa: I, other: &Self, is_same: bool) -> u16 {
        let overlapping = self.boxes.overlapping(isa, &other.boxes) & if is_same { BEFORE } else { u16::MAX };
        if overlapping == 0 || !self.are_comparable(other) {
            return overlapping;
        }
        let (apart, common) = apart(isa, self, other);
        let undecided = overlapping & !apart;
        if undecided == 0 { 0 } else { undecided & !beside(isa, self, other, &common) }
    }
}

/// The lanes in which a corner of one triangle is certainly above or below the plane of the other, and those in which it is
/// one of the other's corners.
#[derive(Clone, Copy, Default)]
struct EdgeSide {
    above: u16,
    below: u16,
    common: u16,
}

/// The lanes in which two corners are the same: `[corner of A][corner of B]`.
type Common = [[u16; 3]; 3];

/// The corners of both packets, as 16 lanes each.
#[inline(always)]
fn lanes<I: Isa>(isa: I, a: &SelfPacket, b: &SelfPacket) -> (Corners<I::F32x16>, Corners<I::F32x16>) {
    let (a, b) = (&a.corners, &b.corners);
    (
        [repeat(isa, &a[0]), repeat(isa, &a[1]), repeat(isa, &a[2])],
        [tile(isa, &b[0]), tile(isa, &b[1]), tile(isa, &b[2])],
    )
}

/// The pairs that certainly do not meet beyond the hull of their common corners, by the planes of their faces.
#[inline(always)]
fn apart<I: Isa>(isa: I, a: &SelfPacket, b: &SelfPacket) -> (u16, Common) {
    let (corners_a, corners_b) = lanes(isa, a, b);
    let (edge_a, edge_b) = (isa.repeat(&a.edge), isa.tile(&b.edge));
    let left_out = a.left_out;
    let error = |edge: I::F32x16| HeightError::of_face(isa, edge, left_out);
    let (error_a, error_b) = (error(edge_a), error(edge_b));
    let (normal_a, normal_b) = (repeat(isa, &a.normal), tile(isa, &b.normal));
    let (mut of_a, mut of_b) = ([EdgeSide::default(); 3], [EdgeSide::default(); 3]);
    let (mut common, mut once, mut twice) = ([[0; 3]; 3], 0, 0);
    for i in 0..3 {
        for j in 0..3 {
            let between = sub(corners_b[j], corners_a[i]);
            let distance = largest(between);
            let equal = I::F32x16::bits(distance.le(isa.splat(0.0)));
            common[i][j] = equal;
            of_a[i].common |= equal;
            of_b[j].common |= equal;
            twice |= once & equal;
            once |= equal;
            if i == 0 {
                (of_b[j].above, of_b[j].below) = sides(isa, dot(between, normal_a), distance, error_a);
            }
            if j == 0 {
                // The difference points from A to B.
                (of_a[i].below, of_a[i].above) = sides(isa, dot(between, normal_b), distance, error_b);
            }
        }
    }
    let crossed = once & !twice & turned_away(&of_a, &of_b);
    (on_one_side(&of_a) | on_one_side(&of_b) | crossed, common)
}

/// The pairs that certainly do not meet beyond the hull of their common corners, by planes through their edges.
#[inline(always)]
fn beside<I: Isa>(isa: I, a: &SelfPacket, b: &SelfPacket, common: &Common) -> u16 {
    let (corners_a, corners_b) = lanes(isa, a, b);
    let (normals_a, normals_b) = (a.edge_normals(isa), b.edge_normals(isa));
    let (edge_a, edge_b) = (isa.repeat(&a.edge), isa.tile(&b.edge));
    let left_out = a.left_out;
    let error = |edge: I::F32x16| HeightError::of_edge(isa, edge, left_out);
    let (error_a, error_b) = (error(edge_a), error(edge_b));
    let (mut beside_a, mut beside_b) = ([u16::MAX; 3], [u16::MAX; 3]);
    for i in 0..3 {
        for j in 0..3 {
            let between = sub(corners_b[j], corners_a[i]);
            let distance = largest(between);
            let (above, _) = sides(isa, dot(between, repeat(isa, &normals_a[i])), distance, error_a);
            beside_a[i] &= above | common[i][j] | common[(i + 1) % 3][j];
            // The difference points from A to B.
            let (_, above) = sides(isa, dot(between, tile(isa, &normals_b[j])), distance, error_b);
            beside_b[j] &= above | common[i][j] | common[i][(j + 1) % 3];
        }
    }
    // A triangle without any corner of its own may be a duplicate.
    let own = |of: fn(&Common, usize) -> u16| !(of(common, 0) & of(common, 1) & of(common, 2));
    let own_a = own(|common, i| common[i][0] | common[i][1] | common[i][2]);
    let own_b = own(|common, j| common[0][j] | common[1][j] | common[2][j]);
    let beside_a = (beside_a[0] | beside_a[1] | beside_a[2]) & own_b;
    let beside_b = (beside_b[0] | beside_b[1] | beside_b[2]) & own_a;
    beside_a | beside_b
}

/// The error of a height: a part for each unit of the distance, and a constant part.
#[derive(Clone, Copy)]
struct HeightError<V> {
    per_distance: V,
    constant: V,
}

impl<V: Lanes> HeightError<V> {
    /// Over the plane of a face with edges of this size.
    #[inline(always)]
    fn of_face<I: Isa<F32x16 = V>>(isa: I, edge: V, left_out: f32) -> Self {
        let wide = edge.add(isa.splat(2.0 * left_out));
        let rounding = wide.mul(wide).mul(isa.splat(50.0 * U));
        let per_distance = wide.mul_add(isa.splat(32.0 * left_out), rounding);
        let own = wide.mul(wide).mul(isa.splat(16.0 * left_out));
        Self { per_distance, constant: Self::constant(isa, per_distance, own, left_out) }
    }

    /// Over the plane through an edge, perpendicular to a face with edges of this size.
    #[inline(always)]
    fn of_edge<I: Isa<F32x16 = V>>(isa: I, edge: V, left_out: f32) -> Self {
        let wide = edge.add(isa.splat(2.0 * left_out));
        let square = wide.mul(wide);
        let rounding = square.mul(wide.mul(isa.splat(270.0 * U)));
        let per_distance = square.mul_add(isa.splat(160.0 * left_out), rounding);
        let own = square.mul(wide).mul(isa.splat(64.0 * left_out));
        Self { per_distance, constant: Self::constant(isa, per_distance, own, left_out) }
    }

    /// The distance is that of corners, and that of vertices may be larger.
    #[inline(always)]
    fn constant<I: Isa<F32x16 = V>>(isa: I, per_distance: V, own: V, left_out: f32) -> V {
        per_distance.mul_add(isa.splat(2.0 * left_out), own.add(isa.splat(CUBE_UNDERFLOW)))
    }
}

/// Returns the lanes of heights that are certainly above 0, and of those certainly below.
#[inline(always)]
fn sides<I: Isa>(
    isa: I,
    height: I::F32x16,
    distance: I::F32x16,
    error: HeightError<I::F32x16>,
) -> (u16, u16) {
    let error = error.per_distance.mul_add(distance, error.constant);
    let below_error = isa.splat(0.0).sub(error);
    (I::F32x16::bits(error.lt(height)), I::F32x16::bits(height.lt(below_error)))
}

/// The lanes in which all corners but the common ones are on one side, and there is one.
#[inline(always)]
fn on_one_side([p, q, r]: &[EdgeSide; 3]) -> u16 {
    let above = (p.above | p.common) & (q.above | q.common) & (r.above | r.common);
    let below = (p.below | p.common) & (q.below | q.common) & (r.below | r.common);
    (above | below) & !(p.common & q.common & r.common)
}

/// The lanes in which, if only one corner is common, the edges opposite to it do not cross as seen from it.
#[inline(always)]
fn turned_away(a: &[EdgeSide; 3], b: &[EdgeSide; 3]) -> u16 {
    let (mut certain, mut first_a, mut second_b) = (u16::MAX, 0, 0);
    for i in 0..3 {
        certain &= a[i].above | a[i].below | a[i].common;
        certain &= b[i].above | b[i].below | b[i].common;
        first_a |= a[i].common & a[(i + 1) % 3].above;
        second_b |= b[i].common & b[(i + 2) % 3].above;
    }
    certain & (first_a ^ second_b)
}
