//! The slab filter: bounds 16 pairs of nodes along the directions of their turning slabs, and along the line between them.
//!
//! Along a direction `x`, a node reaches no further than `alpha` times its slab along `u` plus the reach of its box
//! along `x - alpha u`. That holds for every `alpha`; the projection `x . u` leaves the least rest. With a box of
//! centre `c` and half sides `h`, and a slab of half width `w` whose middle is `m` from the centre,
//!
//! ```text
//! |x . (v - c) - alpha m| <= |alpha| w + sum |x - alpha u|_i h_i          for every point v of the node
//! ```
//!
//! so that two nodes are apart along `x` by the distance of the middles of two such intervals, less both radii.
//!
//! Rounding: let u = 2^-24, let M_A and M_B bound the coordinates of all nodes, and let t be the translation. Radii are
//! sums of positive terms with at most 12 roundings, which a factor of 1 + 2^-20 covers. `spec/numerics.md` counts the
//! other roundings, in any order and fused or not: less than u (64 M_A + 112 M_B + 16 |t|) along a direction of length
//! 1, where |t| is the sum of its coordinates' magnitudes. `prepare` computes this once per query.

use crate::isa::{Isa, Lanes};
use crate::traverse::align::{U, round_up};
use crate::traverse::node_filter::Measure;
use crate::traverse::placement::Placement;
use bvh_format::quantize::STEP_U8;
use bvh_format::slabs::Group;
use bvh_format::turning::{BIAS, TurningCodes};
use bytemuck::Zeroable;

/// Four rows of four children.
#[derive(Clone, Copy, Zeroable)]
#[repr(C, align(64))]
struct Rows([f32; 16]);

impl Rows {
    const ZERO: Self = Self([0.0; 16]);

    #[inline(always)]
    fn row(&self, row: usize) -> &[f32; 4] {
        &self.0.as_chunks::<4>().0[row & 3]
    }

    #[inline(always)]
    fn row_mut(&mut self, row: usize) -> &mut [f32; 4] {
        &mut self.0.as_chunks_mut::<4>().0[row & 3]
    }
}

/// The boxes and turning slabs of four children, in the frame of their object.
#[derive(Clone, Copy, Zeroable)]
pub(crate) struct TurningGroup {
    /// The centre of the box; in the last row the middle of the slab along its direction, from that centre.
    centre: Rows,
    /// Half of the box's sides; in the last row half of the slab's width.
    half: Rows,
    /// The slab's direction, of length 1 but for rounding. Zero without a slab.
    direction: Rows,
}

/// What the other side sees of four children.
#[derive(Clone, Copy, Zeroable)]
pub(crate) struct Seen {
    direction: Rows,
    centre: Rows,
}

impl TurningGroup {
    /// Decodes the turning slabs of four children, given their fixed slabs.
    #[inline(always)]
    pub(crate) fn decode<I: Isa>(&mut self, isa: I, codes: &TurningCodes, group: &Group) {
        let (lo, hi) = (isa.load(&group.lo[0]), isa.load(&group.hi[0]));
        let half = isa.splat(0.5);
        isa.store(lo.add(hi).mul(half), &mut self.centre.0);
        isa.store(hi.sub(lo).mul(half), &mut self.half.0);
        let mut rows = Rows::ZERO;
        isa.store(isa.codes_u8(&codes.0), &mut rows.0);
        let [code_lo, code_hi, a, b] =
            [isa.load4(rows.row(0)), isa.load4(rows.row(1)), isa.load4(rows.row(2)), isa.load4(rows.row(3))];
        let any = code_lo.add(code_hi).add(a.add(b));
        let (bias, unit) = (isa.splat4(f32::from(BIAS)), isa.splat4(1.0 / 256.0));
        let (a, b) = (a.sub(bias), b.sub(bias));
        let mut n = Rows::ZERO;
        isa.store4(a.add(b).mul(unit), n.row_mut(0));
        isa.store4(a.sub(b).mul(unit), n.row_mut(1));
        let inward = isa.splat4(2.0 * f32::from(BIAS)).sub(a.abs().max(b.abs()).mul(isa.splat4(2.0)));
        isa.store4(inward.mul(unit), n.row_mut(2));
        let vector = isa.load(&n.0);
        let (at_lo, at_hi) = (vector.mul(lo), vector.mul(hi));
        let down = vector.lt(isa.splat(0.0));
        let low = sum(isa, I::V::select(down, at_hi, at_lo));
        let high = sum(isa, I::V::select(down, at_lo, at_hi));
        let mut step = [0.0; 4];
        isa.store4(high.sub(low).mul(isa.splat4(STEP_U8)), &mut step);
        let unit = isa.load4(&step.map(bvh_format::quantize::round_step_up));
        let (lo, hi) = (code_lo.mul_add(unit, low), code_hi.neg_mul_add(unit, high));
        let mut scale = [0.0; 4];
        let inverse = isa.splat4(1.0).div(sum(isa, vector.mul(vector)).sqrt());
        isa.store4(I::H::select(isa.splat4(0.0).lt(any), inverse, isa.splat4(0.0)), &mut scale);
        let direction = vector.mul(isa.tile(&scale));
        isa.store(direction, &mut self.direction.0);
        let along_centre = sum(isa, direction.mul(isa.load(&self.centre.0)));
        let half_scale = isa.load4(&scale).mul(isa.splat4(0.5));
        isa.store4(lo.add(hi).mul(half_scale).sub(along_centre), self.centre.row_mut(3));
        isa.store4(hi.sub(lo).mul(half_scale), self.half.row_mut(3));
    }
}

/// The sums of the first three rows.
#[inline(always)]
fn sum<I: Isa>(isa: I, rows: I::V) -> I::H {
    let mut stored = Rows::ZERO;
    isa.store(rows, &mut stored.0);
    isa.load4(stored.row(0)).add(isa.load4(stored.row(1))).add(isa.load4(stored.row(2)))
}

/// The slab test for one pose.
pub(crate) struct SlabFilter {
    rotation: [[f32; 3]; 3],
    /// Columns of the rotation's transpose, which turns directions of A's frame to B's, each element repeated four times.
    to_b: [Rows; 3],
    /// The same of the transpose of the rotation's inverse: the rotation but for how far that is off.
    to_a: [Rows; 3],
    /// The same of the rotation.
    columns: [Rows; 3],
    translation: Rows,
    /// Bound on the error of a gap.
    slack: f32,
    /// The least square of a distance between centres for which the line between them is looked along.
    least_square: f32,
}

impl SlabFilter {
    pub(crate) const NONE: Self = Self {
        rotation: [[0.0; 3]; 3],
        to_b: [Rows::ZERO; 3],
        to_a: [Rows::ZERO; 3],
        columns: [Rows::ZERO; 3],
        translation: Rows::ZERO,
        slack: 0.0,
        least_square: f32::INFINITY,
    };

    /// Prepares a pose. `magnitudes` bound the coordinates of A's and of B's nodes.
    pub(crate) fn prepare(&mut self, placement: &Placement, inverse: &Placement, magnitudes: (f32, f32)) {
        let (r, s) = (&placement.rotation, &inverse.rotation);
        self.rotation = r.map(|row| row.map(|x| x as f32));
        for lane in 0..12 {
            let row = lane / 4;
            for j in 0..3 {
                self.to_b[j].0[lane] = r[j][row] as f32;
                self.to_a[j].0[lane] = s[j][row] as f32;
                self.columns[j].0[lane] = r[row][j] as f32;
            }
            self.translation.0[lane] = placement.translation[row] as f32;
        }
        let t = placement.translation.iter().map(|x| x.abs()).sum::<f64>();
        let (a, b) = (f64::from(magnitudes.0), f64::from(magnitudes.1));
        self.slack = round_up(U * (64.0 * a + 112.0 * b + 16.0 * t) + 6.0 * placement.error + UNDERFLOW);
        self.least_square = if a + b + t < MAX_MAGNITUDES { LEAST_SQUARE } else { f32::INFINITY };
    }

    /// What B sees of four nodes of A.
    #[inline(always)]
    pub(crate) fn see_a<I: Isa>(&self, isa: I, group: &TurningGroup, seen: &mut Seen) {
        let zero = isa.splat(0.0);
        isa.store(turn(isa, &self.to_b, &group.direction, zero), &mut seen.direction.0);
    }

    /// What A sees of four nodes of B.
    #[inline(always)]
    pub(crate) fn see_b<I: Isa>(&self, isa: I, group: &TurningGroup, seen: &mut Seen) {
        let zero = isa.splat(0.0);
        isa.store(turn(isa, &self.to_a, &group.direction, zero), &mut seen.direction.0);
        let centre = turn(isa, &self.columns, &group.centre, isa.load(&self.translation.0));
        isa.store(centre, &mut seen.centre.0);
    }

    /// Tests four nodes of A against four of B: raises the bounds that the node test has found.
    #[inline(always)]
    pub(crate) fn run<I: Isa>(
        &self,
        isa: I,
        measure: Measure,
        (a, seen_a): (&TurningGroup, &Seen),
        (b, seen_b): (&TurningGroup, &Seen),
        limit: f32,
        bounds: &mut [f32; 16],
    ) -> u16 {
        let (u_a, u_b) = (repeat(isa, &a.direction), tile(isa, &b.direction));
        let (half_a, half_b) = (repeat(isa, &a.half), tile(isa, &b.half));
        let (middle_a, middle_b) = (isa.repeat(a.centre.row(3)), isa.tile(b.centre.row(3)));
        let (width_a, width_b) = (isa.repeat(a.half.row(3)), isa.tile(b.half.row(3)));
        let (u_a_in_b, u_b_in_a) = (repeat(isa, &seen_a.direction), tile(isa, &seen_b.direction));
        let (c_a, c_b) = (repeat(isa, &a.centre), tile(isa, &seen_b.centre));
        let to_b = [c_b[0].sub(c_a[0]), c_b[1].sub(c_a[1]), c_b[2].sub(c_a[2])];
        let (slack, outward) = (isa.splat(self.slack), isa.splat(1.0 + 1.0 / (1 << 20) as f32));
        // Along A's direction, then along B's.
        let cosine = dot::<I>(u_a, u_b_in_a);
        let share = cosine.abs();
        let distance = cosine.mul_add(middle_b, dot::<I>(u_a, to_b)).sub(middle_a);
        let radius = rest::<I>(u_a_in_b, cosine, u_b, half_b, share.mul_add(width_b, width_a));
        let gap = radius.neg_mul_add(outward, distance.abs());
        let distance = cosine.neg_mul_add(middle_a, dot::<I>(u_b_in_a, to_b)).add(middle_b);
        let radius = rest::<I>(u_b_in_a, cosine, u_a, half_a, share.mul_add(width_a, width_b));
        let gap = gap.max(radius.neg_mul_add(outward, distance.abs())).sub(slack);
        if measure == Measure::Overlap {
            return I::V::bits(gap.le(isa.splat(limit)));
        }
        // Along the line between the centres, at first not normalised. Where squares might underflow or overflow it has no say.
        let square = dot::<I>(to_b, to_b);
        let inverse = isa.splat(1.0).div(square.sqrt());
        let r = &self.rotation;
        let mut to_b_in_b = to_b;
        for axis in 0..3 {
            let column = [isa.splat(r[0][axis]), isa.splat(r[1][axis]), isa.splat(r[2][axis])];
            to_b_in_b[axis] = dot::<I>(to_b, column);
        }
        let (alpha_a, alpha_b) = (dot::<I>(to_b, u_a), dot::<I>(to_b, u_b_in_a));
        let distance = alpha_b.mul_add(middle_b, alpha_a.neg_mul_add(middle_a, square));
        let rest_a = rest::<I>(to_b, alpha_a, u_a, half_a, alpha_a.abs().mul(width_a));
        let rest_b = rest::<I>(to_b_in_b, alpha_b, u_b, half_b, alpha_b.abs().mul(width_b));
        let along_line = rest_a.add(rest_b).neg_mul_add(outward, distance).mul(inverse).sub(slack);
        let is_normal = isa.splat(self.least_square).le(square);
        let gap = I::V::select(is_normal, along_line, gap).max(gap);
        // No direction is longer than 1 by more than 2^-19.
        let gap = gap.mul(isa.splat(1.0 - 1.0 / (1 << 18) as f32)).max(isa.load(bounds));
        isa.store(gap, bounds);
        I::V::bits(gap.le(isa.splat(limit)))
    }
}

/// More than underflow adds to a gap, in mesh units, 2^-110: 60 products lose 2^-150 each, and along the line between
/// centres that is divided by their distance.
const UNDERFLOW: f64 = f64::from_bits((1023 - 110) << 52);
/// The least square of a distance between centres that is used, 2^-60.
const LEAST_SQUARE: f32 = f32::from_bits((127 - 60) << 23);
/// The largest sum of the magnitudes of coordinates of A, of B and of the translation for which the line between
/// centres is tested: 2^60 mesh units. Products along it are then below 2^127. A product that overflows could have the
/// sign of a gap where there is none.
const MAX_MAGNITUDES: f64 = (1u64 << 60) as f64;

/// Three rows of nodes of A, in the lanes of their pairs.
#[inline(always)]
fn repeat<I: Isa>(isa: I, rows: &Rows) -> [I::V; 3] {
    [isa.repeat(rows.row(0)), isa.repeat(rows.row(1)), isa.repeat(rows.row(2))]
}

/// Three rows of nodes of B, in the lanes of their pairs.
#[inline(always)]
fn tile<I: Isa>(isa: I, rows: &Rows) -> [I::V; 3] {
    [isa.tile(rows.row(0)), isa.tile(rows.row(1)), isa.tile(rows.row(2))]
}

#[inline(always)]
fn dot<I: Isa>(p: [I::V; 3], q: [I::V; 3]) -> I::V {
    p[2].mul_add(q[2], p[1].mul_add(q[1], p[0].mul(q[0])))
}

/// Adds to a radius how far a box of half sides `half` reaches along `x - alpha u`.
#[inline(always)]
fn rest<I: Isa>(x: [I::V; 3], alpha: I::V, u: [I::V; 3], half: [I::V; 3], radius: I::V) -> I::V {
    let mut sum = radius;
    for axis in 0..3 {
        sum = alpha.neg_mul_add(u[axis], x[axis]).abs().mul_add(half[axis], sum);
    }
    sum
}

/// Multiplies the vectors of four nodes by a matrix of three columns and adds a vector.
#[inline(always)]
fn turn<I: Isa>(isa: I, columns: &[Rows; 3], from: &Rows, add: I::V) -> I::V {
    let mut sum = add;
    for j in 0..3 {
        sum = isa.tile(from.row(j)).mul_add(isa.load(&columns[j].0), sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{Backend, Task};
    use crate::pose::Pose;
    use crate::traverse::decode::decode_group;
    use crate::traverse::placement::POSE_ERROR;
    use bvh_format::kdop::Kdop;
    use bvh_format::leaf::{Packet, TriangleEncoding};
    use bvh_format::page::{Page, PageShape, PageWriter, TightBound, WrittenPage};
    use bvh_format::profile::Profile;
    use bvh_format::slabs::NodeSlabs;
    use bvh_format::turning::{TurningDirection, TurningSlab, decode_turning};
    use cbvh_testkit::Random;

    type Point = [f64; 3];

    const PROFILE: Profile = Profile::Dop26U8Wide;

    /// Four flat patches of up to four triangles in one treelet. Some have no turning slab.
    struct Node {
        page: WrittenPage,
        triangles: Vec<Vec<[[f32; 3]; 3]>>,
    }

    impl Node {
        fn new(random: &mut Random, centre: Point, size: f64) -> Self {
            let mut triangles = Vec::new();
            for _ in 0..4 {
                let (at, normal) = (random.point(), random.point());
                let square: f64 = normal.iter().map(|c| c * c).sum::<f64>().max(1e-3);
                let corner = |random: &mut Random| {
                    let p = random.point();
                    let along = 0.97 * (0..3).map(|i| p[i] * normal[i]).sum::<f64>() / square;
                    [0, 1, 2].map(|i| (centre[i] + size * (2.0 * at[i] + p[i] - along * normal[i])) as f32)
                };
                let patch: Vec<_> =
                    (0..4).map(|_| [corner(random), corner(random), corner(random)]).collect();
                triangles.push(patch);
            }
            Self::of_patches(triangles, |patch| {
                let [a, b, c] = patch[0].map(|corner| corner.map(f64::from));
                let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
                let normal =
                    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
                (random.signed() > -0.8).then_some(TurningDirection::near(normal))
            })
        }

        /// A treelet of patches. `direction` chooses the directions of their turning slabs.
        fn of_patches(
            triangles: Vec<Vec<[[f32; 3]; 3]>>,
            mut direction: impl FnMut(&[[[f32; 3]; 3]]) -> Option<TurningDirection>,
        ) -> Self {
            let mut writer =
                PageWriter::new(PROFILE, 1.0, PageShape { roots: 1, treelets: 1, ..PageShape::default() });
            writer.root(&Kdop::of_points(triangles.iter().flatten().flatten().copied()), None);
            writer.begin_treelet();
            for patch in &triangles {
                let around = |direction| TurningSlab::around(direction, [&Packet::new(patch)]);
                let turning = direction(patch).map(around);
                let kdop = Kdop::of_points(patch.as_flattened().iter().copied());
                writer.leaf(&TightBound { kdop, turning }, patch.iter().map(|&corners| (corners, 0)));
            }
            Self { page: writer.finish(TriangleEncoding::F32, false), triangles }
        }

        fn magnitude(&self) -> f32 {
            let coordinates = self.triangles.iter().flatten().flatten().flatten();
            coordinates.fold(0.0, |most, c| if c.abs() > most { c.abs() } else { most })
        }

        /// Corners and points within the triangles of a child.
        fn points(&self, child: usize, random: &mut Random) -> Vec<Point> {
            let mut points = Vec::new();
            for triangle in &self.triangles[child] {
                let corners = triangle.map(|corner| corner.map(f64::from));
                points.extend(corners);
                let (p, q) = (random.signed().abs(), random.signed().abs());
                let weights = [p * q, p * (1.0 - q), 1.0 - p];
                points.push([0, 1, 2].map(|i| (0..3).map(|k| weights[k] * corners[k][i]).sum()));
            }
            points
        }
    }

    /// Where the corners of boxes that reach furthest along their slabs meet, no gap is left for a bound that is too large.
    #[test]
    fn bounds_hold_to_the_last_bit_where_extreme_corners_meet() {
        let random = &mut Random::new(5);
        let (mut found, mut near) = (0, 0);
        for round in 0..4_000 {
            let size = 10f64.powi(round % 21 - 10);
            let far = size * [0.0, 1.0, 30.0, 1e3][(round / 2 % 4) as usize];
            let direction = TurningDirection::near(random.point());
            let n = direction.vector().map(f64::from);
            let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
            let unit = n.map(|c| c / length);
            // One patch, four times: two triangles with the corners of the box that reach furthest both ways.
            let patch = |random: &mut Random| {
                // In every other round all lies on the line between the centres.
                let half = if round % 2 == 0 { random.point() } else { unit };
                let centre = random.point();
                let corner = |sign: f64| {
                    [0, 1, 2]
                        .map(|i| (far * centre[i] + size * half[i].abs() * (sign * n[i]).signum()) as f32)
                };
                let (low, high) = (corner(-1.0), corner(1.0));
                let inside =
                    [0, 1, 2].map(|i| low[i] + (high[i] - low[i]) * random.signed().abs() as f32 * 0.5);
                vec![[low, high, inside]]
            };
            let nodes = [0, 1].map(|_| Node::of_patches(vec![patch(random); 4], |_| Some(direction)));
            // A turn around the direction, and B's lowest corner above A's highest one.
            let (sin, cos) = (3.0 * random.signed()).sin_cos();
            let [x, y, z] = unit;
            let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
            let rotation = [0, 1, 2].map(|i| {
                [0, 1, 2]
                    .map(|j| cos * f64::from(i == j) + sin * cross[i][j] + (1.0 - cos) * unit[i] * unit[j])
            });
            let gap = [0.0, 1e-7, 1e-3, 1.0][(round / 8 % 4) as usize] * size;
            let corner = |node: &Node, at: usize| node.triangles[0][0][at].map(f64::from);
            let (p, q) = (corner(&nodes[0], 1), corner(&nodes[1], 0));
            let turned = rotation.map(|row: [f64; 3]| row[0] * q[0] + row[1] * q[1] + row[2] * q[2]);
            let translation = [0, 1, 2].map(|i| p[i] + gap * unit[i] - turned[i]);
            let (test, placement) = prepared(&nodes, rotation, translation);
            let b = placement.place(q);
            let least = (0..3).map(|i| (p[i] - b[i]) * (p[i] - b[i])).sum::<f64>().sqrt();
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let run = |measure| Run { test: &test, nodes: [&nodes[0], &nodes[1]], measure, limit: 0.0 };
                let (overlap, _) = backend.run(run(Measure::Overlap));
                let (_, bounds) = backend.run(run(Measure::Distance));
                assert!(
                    bounds.iter().all(|&bound| f64::from(bound) <= least),
                    "{round}: {bounds:?} > {least}"
                );
                assert!(gap > 0.0 || overlap == 0xffff, "{round}");
                found += 1;
                near += u32::from(f64::from(bounds[0]) > 0.98 * least && gap > 0.0);
            }
        }
        assert!(near > found / 8, "{near} of {found}");
    }

    /// Nodes so large that products along the line between their centres overflow: the slab of B lies far from the centre of
    /// its box, which is near that of A's.
    #[test]
    fn bounds_hold_where_products_overflow() {
        let mut found = 0.0f64;
        for exponent in 30..=118 {
            let h = 2f32.powi(exponent);
            let direction = TurningDirection::near([1.0; 3]);
            let flat = |h: f32, at: f32| {
                vec![[[at - h, at + h, at + h], [at + h, at - h, at + h], [at + h, at + h, at - h]]]
            };
            let nodes = [flat(h / 1024.0, 0.0), flat(h, h / 1024.0)]
                .map(|patch| Node::of_patches(vec![patch; 4], |_| Some(direction)));
            let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let (test, _) = prepared(&nodes, unit, [0.0; 3]);
            // Both planes are perpendicular to (1, 1, 1).
            let h = f64::from(h);
            let least = ((h + 3.0 * h / 1024.0) - h / 1024.0) / 3f64.sqrt();
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let nodes = [&nodes[0], &nodes[1]];
                let run = Run { test: &test, nodes, measure: Measure::Distance, limit: 0.0 };
                let (_, bounds) = backend.run(run);
                let what = format!("2^{exponent}, {backend}: {} > {least:e}", bounds[0]);
                assert!(bounds.iter().all(|&bound| f64::from(bound) <= least), "{what}");
                found = found.max(f64::from(bounds[0]) / least);
            }
        }
        assert!(found > 0.5, "{found}");
    }

    /// Decodes the turning slabs of a treelet whose fixed slabs are given.
    struct Decode<'a>(&'a TurningCodes, &'a Group);

    impl Task for Decode<'_> {
        type Output = TurningGroup;

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> TurningGroup {
            let mut decoded = TurningGroup::zeroed();
            decoded.decode(isa, self.0, self.1);
            decoded
        }
    }

    /// Codes of any value, and boxes of any size and place.
    #[test]
    fn slabs_are_those_of_the_reference_decoder_to_the_last_bit() {
        let random = &mut Random::new(21);
        for round in 0..5_000 {
            let mut treelet = [0; 128];
            treelet.iter_mut().for_each(|byte| *byte = (random.signed() * 128.0 + 128.0) as u8);
            if round % 3 == 0 {
                [28, 92, 56, 120].iter().for_each(|row| treelet[row + round as usize % 4] = 0);
            }
            let size = 2f64.powi(round % 60 - 30);
            let mut group = Group::ZERO;
            let mut nodes = [NodeSlabs::default(); 4];
            for (child, node) in nodes.iter_mut().enumerate() {
                for row in 0..3 {
                    let (p, q) = ((random.signed() * size) as f32, (random.signed() * size) as f32);
                    (node.lo[row], node.hi[row]) = (p.min(q), p.max(q));
                    (group.lo[0][4 * row + child], group.hi[0][4 * row + child]) =
                        (node.lo[row], node.hi[row]);
                }
            }
            let codes = TurningCodes::read(&treelet);
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let decoded = backend.run(Decode(&codes, &group));
                for (child, node) in nodes.iter().enumerate() {
                    let slab = decode_turning(PROFILE, &treelet, child, node);
                    let n = slab.map_or([0.0; 3], |slab| slab.direction.vector());
                    let scale = if slab.is_some() {
                        1.0 / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt()
                    } else {
                        0.0
                    };
                    let centre = [0, 1, 2].map(|row| (node.lo[row] + node.hi[row]) * 0.5);
                    let [x, y, z] = [0, 1, 2].map(|row| n[row] * scale * centre[row]);
                    let (lo, hi) = slab.map_or((0.0, 0.0), |slab| (slab.lo, slab.hi));
                    let middle = (lo + hi) * (scale * 0.5) - ((x + y) + z);
                    let width = (hi - lo) * (scale * 0.5);
                    let found = [decoded.centre.row(3)[child], decoded.half.row(3)[child]];
                    if slab.is_some() {
                        assert_eq!(found.map(f32::to_bits), [middle, width].map(f32::to_bits), "{backend}");
                    } else {
                        assert_eq!(found, [0.0; 2], "{backend}");
                    }
                    for row in 0..3 {
                        assert_eq!(decoded.direction.row(row)[child], n[row] * scale, "{backend}");
                        assert_eq!(
                            decoded.centre.row(row)[child].to_bits(),
                            centre[row].to_bits(),
                            "{backend}"
                        );
                    }
                }
            }
        }
    }

    /// Decodes both nodes and tests all pairs of their children.
    struct Run<'a> {
        test: &'a SlabFilter,
        nodes: [&'a Node; 2],
        measure: Measure,
        limit: f32,
    }

    impl Task for Run<'_> {
        type Output = (u16, [f32; 16]);

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> Self::Output {
            let mut decoded = [TurningGroup::zeroed(); 2];
            for side in 0..2 {
                let page = Page::new(&self.nodes[side].page.bytes, PROFILE);
                let (mut parent, mut group) = (Group::of_one(&page.anchor_slabs(0)), Group::ZERO);
                decode_group(isa, (PROFILE, 1.0), (page.treelet(0), 0), (&parent, 0), &mut group);
                parent = group;
                let codes = TurningCodes::read(page.treelet(0).first_chunk().expect("128 bytes"));
                decoded[side].decode(isa, &codes, &parent);
            }
            let (mut seen_a, mut seen_b) = (Seen::zeroed(), Seen::zeroed());
            self.test.see_a(isa, &decoded[0], &mut seen_a);
            self.test.see_b(isa, &decoded[1], &mut seen_b);
            let mut bounds = [f32::NEG_INFINITY; 16];
            let (a, b) = ((&decoded[0], &seen_a), (&decoded[1], &seen_b));
            let mask = self.test.run(isa, self.measure, a, b, self.limit, &mut bounds);
            (mask, bounds)
        }
    }

    fn prepared(nodes: &[Node; 2], rotation: [[f64; 3]; 3], translation: Point) -> (SlabFilter, Placement) {
        let pose = Pose::new(rotation, translation).unwrap();
        let magnitudes = (nodes[0].magnitude(), nodes[1].magnitude());
        let all = f64::from(magnitudes.0) + f64::from(magnitudes.1);
        let whole = 9.0 * all + translation.iter().map(|t| t.abs()).sum::<f64>();
        let placement = Placement { rotation: *pose.rotation(), translation, error: POSE_ERROR * whole };
        let mut test = SlabFilter::NONE;
        test.prepare(&placement, &placement.inverse(), magnitudes);
        (test, placement)
    }

    /// A matrix as far from a rotation as a pose may be, and nodes of any size, near the origin and far from it.
    #[test]
    fn bounds_hold_for_all_points_of_both_nodes() {
        let random = &mut Random::new(99);
        let (mut apart, mut pairs) = (0, 0);
        for round in 0..3_000 {
            let size = 10f64.powi(round % 31 - 15) * 3f64.powi(-(round % 7));
            let far = if round % 3 == 0 { 0.0 } else { size * 10f64.powi(round % 5) };
            let centres = [random.point(), random.point()].map(|p| p.map(|c| c * far));
            let nodes = centres.map(|centre| Node::new(random, centre, size));
            let (sin, cos) = (3.0 * random.signed()).sin_cos();
            let shear = if round % 2 == 0 { 0.9e-6 } else { -0.9e-6 };
            let rotation = [[cos, -sin, shear * cos], [sin, cos, shear * sin], [0.0, 0.0, 1.0]];
            // A point of A and one of B meet, or are a part of the size apart.
            let points: Vec<Vec<Point>> = (0..8).map(|i| nodes[i / 4].points(i % 4, random)).collect();
            let (of_a, of_b) = ((round % 4) as usize, 4 + (round / 4 % 4) as usize);
            let gap = [0.0, 1e-6, 1e-3, 1.0][(round / 7 % 4) as usize] * size;
            let towards = random.point().map(|c| c * gap);
            let turned =
                |p: Point| rotation.map(|row: [f64; 3]| row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
            let (p, q) = (points[of_a][(round % 16) as usize], turned(points[of_b][(round % 13) as usize]));
            let translation = [0, 1, 2].map(|i| p[i] - q[i] + towards[i]);
            let (test, placement) = prepared(&nodes, rotation, translation);
            let mut masks = Vec::new();
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let run = |measure| Run { test: &test, nodes: [&nodes[0], &nodes[1]], measure, limit: 0.0 };
                let ((overlap, _), (mask, bounds)) =
                    (backend.run(run(Measure::Overlap)), backend.run(run(Measure::Distance)));
                for lane in 0..16 {
                    let mut least = f64::INFINITY;
                    for a in &points[lane / 4] {
                        for b in &points[4 + lane % 4] {
                            let b = placement.place(*b);
                            let d = (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt();
                            least = least.min(d);
                        }
                    }
                    assert!(f64::from(bounds[lane]) <= least, "{round} {lane}: {} > {least}", bounds[lane]);
                    assert_eq!(mask >> lane & 1 == 1, bounds[lane] <= 0.0);
                    // Whoever says that nodes do not overlap knows a distance.
                    assert!(least > 0.0 || overlap >> lane & 1 == 1, "{round} {lane}");
                    pairs += 1;
                    apart += u32::from(overlap >> lane & 1 == 0);
                }
                masks.push(overlap);
            }
            // Pairs that meet are met on all backends.
            let meeting = if gap == 0.0 { 1 << (4 * of_a + of_b - 4) } else { 0 };
            assert!(masks.iter().all(|mask| mask & meeting == meeting));
        }
        // The test is worth something.
        assert!(apart > pairs / 3, "{apart} of {pairs}");
    }
}
