//! Bounds on the distances of 16 triangle pairs.
//!
//! The closest features are guessed in plain f32, without regard to rounding. Then the guess is certified. Upper bound:
//! both points of the guess are convex combinations of corners, so they lie on the triangles, except for the error of
//! the coordinates. Lower bound: all six corners are projected onto the line between the two points. The gap of the
//! projections is a lower bound for any line, and the distance itself if the guess was right. Intersecting triangles
//! give no gap. Degenerate triangles are not special.
//!
//! Error: with every coordinate within e (`Local`) a point of a triangle is within sqrt(3) e, and the distance of two
//! within 4 e. Combinations and projections of coordinates of magnitude r or less round by at most 16u r. Products of
//! coordinates that are dust in the local frame underflow. Those with a direction of length 1 lose less than 2^-140,
//! which is charged. A guess whose square is below 2^-100 is not certified but taken as 0 to 2^-50. Above that, all
//! that underflows is less than 2^-95 of a length that `r` is not far below.

use crate::isa::{Isa, Lanes};
use crate::leaf::local::{Local, repeat, tile};
use crate::leaf::math::{Corners, Vec3, add, along, dot, edges, max3, min3, project, splat4, sub};
use crate::leaf::placed_packet::load4;
use crate::leaf::queue::TriangleQueue;
use crate::numerics::U;

/// Bounds on 16 distances, in units of the local frame.
pub(crate) struct Bounds {
    pub(crate) lower: [f32; 16],
    pub(crate) upper: [f32; 16],
    /// The direction from the point on A to the point on B.
    pub(crate) direction: [[f32; 16]; 3],
}

/// The least squared distance of a guess that is certified: 2^-100, in squares of the frame's unit.
const MIN_CERTIFIED_SQUARE: f32 = f32::from_bits((127 - 100) << 23);

/// The error of a bound: see above. `Local` charges 2^-140 to every coordinate.
#[inline(always)]
fn slack(local: &Local<'_>) -> f32 {
    4.0 * local.error + 16.0 * U * local.reach
}

/// Lanes whose triangles may be closer than `limit`, looking along `direction` (at most of length 1)
/// alone.
///
/// An offset may overflow: packets of tiny meshes are more than 2^128 of their units apart. Its product with a direction
/// is then infinite or NaN, and so is the slack, so that no gap exceeds it.
#[inline(always)]
pub(crate) fn near_along<I: Isa>(isa: I, local: &Local<'_>, direction: [f32; 3], limit: f32) -> u16 {
    let axis = splat4(isa, direction);
    let (mut upper_a, mut lower_b) = ([0.0; 4], [0.0; 4]);
    isa.store4(max3(project(&local.a.quads(isa), axis)), &mut upper_a);
    let lower = min3(project(&local.b.quads(isa), axis));
    isa.store4(lower.add(local.offset_along(isa, axis)), &mut lower_b);
    let gap = isa.tile(&lower_b).sub(isa.repeat(&upper_a));
    !I::F32x16::bits(isa.splat(limit + slack(local)).lt(gap))
}

/// Lanes whose triangles may be closer than `limit`, looking along three directions of each pair: from centroid to
/// centroid, and the normals of both faces. Whatever a direction is, the gap of the projections on it is at most
/// its length times the distance.
#[inline(always)]
pub(crate) fn near<I: Isa>(isa: I, local: &Local<'_>, limit: f32) -> u16 {
    let (a, b) = local.lanes(isa);
    let limit = (limit + slack(local)) * (1.0 + 64.0 * U);
    let limit = isa.splat(limit * limit);
    let (face_a, face_b) = (local.a, local.b);
    let normal = repeat(isa, &face_a.normal);
    let ends = [isa.repeat(&face_a.lo), isa.repeat(&face_a.hi)];
    let mut far = far_along(isa, gap(ends, ends_of(&b, normal)), isa.repeat(&face_a.squared), limit);
    let normal = load4(isa, &face_b.normal);
    let shift = local.offset_along(isa, normal);
    let (mut lo, mut hi, mut sum) = ([0.0; 4], [0.0; 4], [[0.0; 4]; 3]);
    isa.store4(isa.load4(&face_b.lo).add(shift), &mut lo);
    isa.store4(isa.load4(&face_b.hi).add(shift), &mut hi);
    for axis in 0..3 {
        let shift = isa.splat4(3.0 * local.offset[axis]);
        isa.store4(isa.load4(&face_b.sum[axis]).add(shift), &mut sum[axis]);
    }
    let (normal, ends) = (tile(isa, &face_b.normal), [isa.tile(&lo), isa.tile(&hi)]);
    far |= far_along(isa, gap(ends, ends_of(&a, normal)), isa.tile(&face_b.squared), limit);
    let between = sub(tile(isa, &sum), repeat(isa, &face_a.sum));
    far |= far_along(isa, gap(ends_of(&a, between), ends_of(&b, between)), dot(between, between), limit);
    !far
}

/// Lanes whose triangles may be closer than `limit` while B moves from its place in the first frame to that in the
/// second one. Tests directions that are the same at both ends: A's axes, the normals of A's faces and, midway between
/// both ends, the normals of B's faces and the line from centroid to centroid.
#[inline(always)]
pub(crate) fn swept_near<I: Isa>(isa: I, [start, end]: [&Local<'_>; 2], limit: f32) -> u16 {
    let ((a, from), (_, to)) = (start.lanes(isa), end.lanes(isa));
    let limit = (limit + slack(start).max(slack(end))) * (1.0 + 64.0 * U);
    let plain = isa.splat(limit);
    let mut far = 0;
    for axis in 0..3 {
        let of_a = [a[0][axis], a[1][axis], a[2][axis]];
        let of_b = [[from[0][axis], from[1][axis], from[2][axis]], [to[0][axis], to[1][axis], to[2][axis]]];
        let ends_b = join([min3(of_b[0]), max3(of_b[0])], [min3(of_b[1]), max3(of_b[1])]);
        far |= I::F32x16::bits(plain.lt(gap([min3(of_a), max3(of_a)], ends_b)));
    }
    let squared = isa.splat(limit * limit);
    let normal = repeat(isa, &start.a.normal);
    let ends = [isa.repeat(&start.a.lo), isa.repeat(&start.a.hi)];
    let ends_b = join(ends_of(&from, normal), ends_of(&to, normal));
    far |= far_along(isa, gap(ends, ends_b), isa.repeat(&start.a.squared), squared);
    if !far == 0 {
        return 0;
    }
    let normal = tile_sum(isa, &start.b.normal, &end.b.normal);
    let ends_b = join(ends_of(&from, normal), ends_of(&to, normal));
    far |= far_along(isa, gap(ends_of(&a, normal), ends_b), dot(normal, normal), squared);
    let (of_a, shift) =
        (repeat(isa, &start.a.sum), [0, 1, 2].map(|k| 3.0 * (start.offset[k] + end.offset[k])));
    let of_b = tile_sum(isa, &start.b.sum, &end.b.sum);
    let shift = [isa.splat(shift[0]), isa.splat(shift[1]), isa.splat(shift[2])];
    let between = sub(add(of_b, shift), add(of_a, of_a));
    let ends_b = join(ends_of(&from, between), ends_of(&to, between));
    far |= far_along(isa, gap(ends_of(&a, between), ends_b), dot(between, between), squared);
    !far
}

/// The sum of vectors of B at both ends, in the lanes of their pairs.
#[inline(always)]
fn tile_sum<I: Isa>(isa: I, start: &[[f32; 4]; 3], end: &[[f32; 4]; 3]) -> Vec3<I::F32x16> {
    add(tile(isa, start), tile(isa, end))
}

/// The least interval that holds two.
#[inline(always)]
fn join<V: Lanes>([lo, hi]: [V; 2], [other_lo, other_hi]: [V; 2]) -> [V; 2] {
    [lo.min(other_lo), hi.max(other_hi)]
}

/// The least and the greatest of the corners' projections.
#[inline(always)]
fn ends_of<V: Lanes>(corners: &Corners<V>, direction: Vec3<V>) -> [V; 2] {
    let along = project(corners, direction);
    [min3(along), max3(along)]
}

/// The gap of two intervals, negative if they overlap.
#[inline(always)]
fn gap<V: Lanes>([lo_a, hi_a]: [V; 2], [lo_b, hi_b]: [V; 2]) -> V {
    lo_b.sub(hi_a).max(lo_a.sub(hi_b))
}

/// Lanes where a gap, over the length of its direction, exceeds a limit. Squares below 2^-100 may have underflown, and
/// tell nothing; those that overflow compare as they should.
#[inline(always)]
fn far_along<I: Isa>(isa: I, gap: I::F32x16, squared: I::F32x16, limit_squared: I::F32x16) -> u16 {
    let (gap, least) = (gap.max(isa.splat(0.0)), isa.splat(MIN_CERTIFIED_SQUARE));
    let gap_squared = gap.mul(gap);
    let far = I::F32x16::bits(limit_squared.mul(squared).lt(gap_squared));
    far & I::F32x16::bits(least.le(gap_squared)) & I::F32x16::bits(least.le(squared))
}

/// The best guess so far.
#[derive(Clone, Copy)]
pub(super) struct Guess<V> {
    squared: V,
    pub(super) direction: Vec3<V>,
}

impl<V: Lanes> Guess<V> {
    /// Nothing is guessed yet.
    #[inline(always)]
    pub(super) fn none<I: Isa<F32x16 = V>>(isa: I) -> Self {
        Self { squared: isa.splat(f32::INFINITY), direction: [isa.splat(0.0); 3] }
    }

    #[inline(always)]
    pub(super) fn improve(&mut self, direction: Vec3<V>) {
        let squared = dot(direction, direction);
        let closer = squared.lt(self.squared);
        self.squared = V::select(closer, squared, self.squared);
        for axis in 0..3 {
            self.direction[axis] = V::select(closer, direction[axis], self.direction[axis]);
        }
    }
}

/// Bounds the distances of all pairs in a queue.
#[inline(always)]
pub(crate) fn bounds<I: Isa>(isa: I, queue: &TriangleQueue) -> Bounds {
    let (a, b) = queue.corners(isa);
    let guess = closest(isa, &a, &b);
    let gap = min3(project(&b, guess.direction)).sub(max3(project(&a, guess.direction)));
    certify(isa, slack_of(isa, queue), gap, guess)
}

/// Lanes of two queues, of the same pairs in the same order, whose triangles may be closer than `limit` while B moves
/// from its place in the first queue to that in the second one. Tests the line between the closest points, with B
/// midway between both.
#[inline(always)]
pub(crate) fn swept_bounds<I: Isa>(isa: I, [start, end]: [&TriangleQueue; 2], limit: f32) -> u16 {
    let ((a, from), (_, to)) = (start.corners(isa), end.corners(isa));
    let half = isa.splat(0.5);
    let mut middle = from;
    for corner in 0..3 {
        for axis in 0..3 {
            middle[corner][axis] = from[corner][axis].add(to[corner][axis]).mul(half);
        }
    }
    let slack = slack_of(isa, start).max(slack_of(isa, end));
    let Guess { squared, direction } = closest(isa, &a, &middle);
    let near = min3(project(&from, direction)).min(min3(project(&to, direction)));
    let gap = near.sub(max3(project(&a, direction)));
    let limit = slack.add(isa.splat(limit)).mul(isa.splat(1.0 + 64.0 * U));
    start.filled() & !far_along(isa, gap, squared, limit.mul(limit))
}

/// The error of the bounds of the pairs in a queue.
#[inline(always)]
fn slack_of<I: Isa>(isa: I, queue: &TriangleQueue) -> I::F32x16 {
    queue.error(isa).mul_add(isa.splat(4.0), queue.reach(isa).mul(isa.splat(16.0 * U)))
}

/// Guesses the closest points of pairs of triangles.
#[inline(always)]
fn closest<I: Isa>(isa: I, a: &Corners<I::F32x16>, b: &Corners<I::F32x16>) -> Guess<I::F32x16> {
    let (zero, one) = (isa.splat(0.0), isa.splat(1.0));
    let mut guess = Guess::none(isa);
    let (edges_a, edges_b) = (edges(a), edges(b));
    let (inverse_a, inverse_b) = (inverse_squares(one, edges_a), inverse_squares(one, edges_b));
    for i in 0..3 {
        for j in 0..3 {
            // Closest points of two segments: Ericson, Real-Time Collision Detection, 5.1.9.
            let (edge_a, edge_b) = (edges_a[i], edges_b[j]);
            let between = sub(a[i], b[j]);
            let across = dot(edge_a, edge_b);
            let (along_a, along_b) = (dot(edge_a, between), dot(edge_b, between));
            let (s, t) = (along_a.mul(inverse_a[i]), along_b.mul(inverse_b[j]));
            let (slope_a, slope_b) = (across.mul(inverse_a[i]), across.mul(inverse_b[j]));
            // s minimises over both lines, then t over the segment of B, then s again.
            let parallel = slope_a.neg_mul_add(slope_b, one);
            let first = clamp(zero, one, slope_a.mul(t).sub(s).div(parallel));
            let on_b = clamp(zero, one, slope_b.mul_add(first, t));
            let on_a = clamp(zero, one, slope_a.mul_add(on_b, zero.sub(s)));
            let point_b = along([zero; 3], on_b, edge_b);
            guess.improve(sub(point_b, along(between, on_a, edge_a)));
        }
    }
    points_on_face(isa, a, &edges_a, b, &mut guess, false);
    points_on_face(isa, b, &edges_b, a, &mut guess, true);
    guess
}

/// Between 0 and 1. NaN, from edges of no length, ends as 0: `max` returns its second operand.
#[inline(always)]
pub(super) fn clamp<V: Lanes>(zero: V, one: V, value: V) -> V {
    value.max(zero).min(one)
}

/// Returns the inverse of the squared length of each edge.
#[inline(always)]
pub(super) fn inverse_squares<V: Lanes>(one: V, edges: Corners<V>) -> Vec3<V> {
    let [x, y, z] = edges;
    [one.div(dot(x, x)), one.div(dot(y, y)), one.div(dot(z, z))]
}

/// Each of some points against the face of `t`. `towards` tells that the points are A's.
#[inline(always)]
pub(super) fn points_on_face<I: Isa, const N: usize>(
    isa: I,
    t: &Corners<I::F32x16>,
    edges: &Corners<I::F32x16>,
    points: &[Vec3<I::F32x16>; N],
    guess: &mut Guess<I::F32x16>,
    towards: bool,
) {
    let (zero, one) = (isa.splat(0.0), isa.splat(1.0));
    let edge_1 = edges[0];
    let edge_2 = sub(t[2], t[0]);
    let (d11, d12, d22) = (dot(edge_1, edge_1), dot(edge_1, edge_2), dot(edge_2, edge_2));
    let inverse = one.div(d12.neg_mul_add(d12, d11.mul(d22)));
    for &point in points {
        let v = sub(point, t[0]);
        let (p1, p2) = (dot(v, edge_1), dot(v, edge_2));
        let first = p2.neg_mul_add(d12, p1.mul(d22)).mul(inverse);
        let second = p1.neg_mul_add(d12, p2.mul(d11)).mul(inverse);
        // Into the triangle: what lies outside is the business of the edges.
        let first = first.max(zero).min(one);
        let second = second.max(zero).min(one.sub(first));
        let foot = along(along([zero; 3], first, edge_1), second, edge_2);
        guess.improve(if towards { sub(foot, v) } else { sub(v, foot) });
    }
}

/// Bounds distances, given the gaps of the projections on the guessed directions.
#[inline(always)]
pub(super) fn certify<I: Isa>(isa: I, slack: I::F32x16, gap: I::F32x16, guess: Guess<I::F32x16>) -> Bounds {
    let least = isa.splat(MIN_CERTIFIED_SQUARE);
    let length = guess.squared.max(least).sqrt();
    let n = guess.direction;
    let shrink = isa.splat(1.0 - 16.0 * U);
    let zero = isa.splat(0.0);
    let lower = gap.div(length).mul(shrink).sub(slack).max(zero);
    let lower = I::F32x16::select(least.le(guess.squared), lower, zero);
    let upper = length.mul_add(isa.splat(1.0 + 16.0 * U), slack);
    let mut bounds = Bounds { lower: [0.0; 16], upper: [0.0; 16], direction: [[0.0; 16]; 3] };
    isa.store(lower, &mut bounds.lower);
    isa.store(upper, &mut bounds.upper);
    for axis in 0..3 {
        isa.store(n[axis], &mut bounds.direction[axis]);
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::place::LeafPacket;
    use crate::isa::{Backend, Task};
    use crate::leaf::frame::LocalFrame;
    use crate::leaf::placed_packet::PlacedPacket;
    use crate::leaf::queue::TrianglePair;
    use crate::leaf::separating_axes::{Sides, face_planes};
    use bvh_format::leaf::Packet;

    const LEAF: LeafPacket = LeafPacket { page: 0, packet: 0, triangles: 4 };

    /// What all filters say of two packets with B's first corner at `offset`.
    struct Filters {
        offset: [f64; 3],
        direction: [f32; 3],
        limit: f32,
    }

    struct Found {
        near: [u16; 4],
        planes: Sides,
        bounds: Bounds,
    }

    impl Task for Filters {
        type Output = Found;

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> Found {
            let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let triangle = |x: f32| [[x, 0.0, 0.0], [x, 1.0, 0.25], [x - 0.5, 0.25, 1.0]];
            let packet = Packet::new(&[triangle(0.0), triangle(0.25), triangle(0.5), triangle(1.0)]);
            let frame = LocalFrame {
                rotation: unit.map(|row| row.map(f64::from)),
                translation: self.offset,
                rotation32: unit,
                scale: 1.0,
                error: f32::MIN_POSITIVE,
            };
            let (mut a, mut b) = (PlacedPacket::NONE, PlacedPacket::NONE);
            a.place_a(isa, &frame, &packet);
            b.place_b(isa, &frame, &packet);
            let local = Local::new(&frame, &a, &b);
            let mut queue = TriangleQueue::default();
            for lane in 0..16 {
                queue.push(&local, TrianglePair::in_lane(LEAF, LEAF, lane));
            }
            Found {
                near: [
                    near_along(isa, &local, self.direction, self.limit),
                    near(isa, &local, self.limit),
                    swept_near(isa, [&local, &local], self.limit),
                    swept_bounds(isa, [&queue, &queue], self.limit),
                ],
                planes: face_planes(isa, &local, LEAF, LEAF),
                bounds: bounds(isa, &queue),
            }
        }
    }

    /// Offsets beyond the range of f32, and products of them beyond it, are infinite or NaN, and decide nothing.
    #[test]
    fn what_overflows_is_never_discarded() {
        let lengths = [0.0, 2.0, 60.0, 64.0, 100.0, 127.0, 127.9, 128.0, 200.0];
        let lengths = || lengths.iter().flat_map(|&l: &f64| [l.exp2() - 1.0, 1.0 - l.exp2()]);
        let directions = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.7, -0.7, 0.0], [0.5, 0.5, -0.7]];
        let mut decided = 0;
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            for x in lengths() {
                for (y, z) in lengths().flat_map(|y| lengths().map(move |z| (y, z))) {
                    let far = [x, y, z].iter().map(|c| c * c).sum::<f64>().sqrt();
                    for (number, direction) in directions.into_iter().enumerate() {
                        // All triangles are within 4 of the first corners of their packets.
                        let limit = if number == 0 { f32::INFINITY } else { (1.001 * far + 8.0) as f32 };
                        let what = format!("{backend}: {x:e} {y:e} {z:e}, {direction:?}, {limit:e}");
                        let found = backend.run(Filters { offset: [x, y, z], direction, limit });
                        assert_eq!(found.near, [0xffff; 4], "{what}");
                        assert!(found.planes.overlap == 0 || far < 8.0, "{what}");
                        let Bounds { lower, upper, .. } = found.bounds;
                        assert!(
                            lower.iter().all(|&lower| f64::from(lower) <= far + 8.0),
                            "{what}: {lower:?}"
                        );
                        assert!(
                            upper.iter().all(|&upper| f64::from(upper) >= far - 8.0),
                            "{what}: {upper:?}"
                        );
                        decided += u32::from(found.planes.apart != 0);
                    }
                }
            }
        }
        assert!(decided > 0);
    }
}
