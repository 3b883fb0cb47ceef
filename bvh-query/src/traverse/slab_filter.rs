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
use crate::numerics::{F32_SLACK, GAP_UNDERFLOW, U, round_up};
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
        let low = sum(isa, I::F32x16::select(down, at_hi, at_lo));
        let high = sum(isa, I::F32x16::select(down, at_lo, at_hi));
        let mut step = [0.0; 4];
        isa.store4(high.sub(low).mul(isa.splat4(STEP_U8)), &mut step);
        let unit = isa.load4(&step.map(bvh_format::quantize::round_step_up));
        let (lo, hi) = (code_lo.mul_add(unit, low), code_hi.neg_mul_add(unit, high));
        let mut scale = [0.0; 4];
        let inverse = isa.splat4(1.0).div(sum(isa, vector.mul(vector)).sqrt());
        isa.store4(I::F32x4::select(isa.splat4(0.0).lt(any), inverse, isa.splat4(0.0)), &mut scale);
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
fn sum<I: Isa>(isa: I, rows: I::F32x16) -> I::F32x4 {
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
        self.slack = round_up(
            f64::from(U) * (64.0 * a + 112.0 * b + 16.0 * t) + 6.0 * placement.error + GAP_UNDERFLOW,
        );
        self.least_square = if a + b + t < MAX_MAGNITUDES { LEAST_SQUARE } else { f32::INFINITY };
    }

    /// Tests four nodes of A against four of B: raises the bounds that the node test has found.
    #[inline(always)]
    pub(crate) fn run<I: Isa>(
        &self,
        isa: I,
        measure: Measure,
        (a, b): (&TurningGroup, &TurningGroup),
        limit: f32,
        bounds: &mut [f32; 16],
    ) -> u16 {
        // In the frame of the other side. That takes less time than to find what was computed before.
        let (zero, translation) = (isa.splat(0.0), isa.load(&self.translation.0));
        let u_a_in_b = turn(isa, &self.to_b, &a.direction, zero);
        let u_b_in_a = turn(isa, &self.to_a, &b.direction, zero);
        let c_b = turn(isa, &self.columns, &b.centre, translation);
        let (u_a_in_b, u_b_in_a, c_b) = (repeat(isa, &u_a_in_b), tile(isa, &u_b_in_a), tile(isa, &c_b));
        let (u_a, u_b) = (repeat(isa, &a.direction), tile(isa, &b.direction));
        let (half_a, half_b) = (repeat(isa, &a.half), tile(isa, &b.half));
        let (middle_a, middle_b) = (isa.repeat(a.centre.row(3)), isa.tile(b.centre.row(3)));
        let (width_a, width_b) = (isa.repeat(a.half.row(3)), isa.tile(b.half.row(3)));
        let c_a = repeat(isa, &a.centre);
        let to_b = [c_b[0].sub(c_a[0]), c_b[1].sub(c_a[1]), c_b[2].sub(c_a[2])];
        let (slack, outward) = (isa.splat(self.slack), isa.splat(1.0 + F32_SLACK));
        // Along A's direction, then along B's.
        let cosine = dot::<I>(u_a, u_b_in_a);
        let share = cosine.abs();
        let distance = cosine.mul_add(middle_b, dot::<I>(u_a, to_b)).sub(middle_a);
        let radius = rest::<I>(u_a_in_b, cosine, u_b, half_b, share.mul_add(width_b, width_a));
        let gap = radius.neg_mul_add(outward, distance.abs());
        let distance = cosine.neg_mul_add(middle_a, dot::<I>(u_b_in_a, to_b)).add(middle_b);
        let radius = rest::<I>(u_b_in_a, cosine, u_a, half_a, share.mul_add(width_a, width_b));
        let gap = gap.max(radius.neg_mul_add(outward, distance.abs())).sub(slack);
        if measure != Measure::Distance {
            return I::F32x16::bits(gap.le(isa.splat(limit)));
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
        let gap = I::F32x16::select(is_normal, along_line, gap).max(gap);
        // No direction is longer than 1 by more than 2^-19.
        let gap = gap.mul(isa.splat(1.0 - 1.0 / (1 << 18) as f32)).max(isa.load(bounds));
        isa.store(gap, bounds);
        I::F32x16::bits(gap.le(isa.splat(limit)))
    }
}

/// The least square of a distance between centres that is used, 2^-60.
const LEAST_SQUARE: f32 = f32::from_bits((127 - 60) << 23);
/// The largest sum of the magnitudes of coordinates of A, of B and of the translation for which the line between
/// centres is tested: 2^60 mesh units. Products along it are then below 2^127. A product that overflows could have the
/// sign of a gap where there is none.
const MAX_MAGNITUDES: f64 = (1u64 << 60) as f64;

/// Three rows of nodes of A, in the lanes of their pairs.
#[inline(always)]
fn repeat<I: Isa>(isa: I, rows: &Rows) -> [I::F32x16; 3] {
    [isa.repeat(rows.row(0)), isa.repeat(rows.row(1)), isa.repeat(rows.row(2))]
}

/// Three rows of nodes of B, in the lanes of their pairs.
#[inline(always)]
fn tile<I: Isa>(isa: I, rows: &Rows) -> [I::F32x16; 3] {
    [isa.tile(rows.row(0)), isa.tile(rows.row(1)), isa.tile(rows.row(2))]
}

#[inline(always)]
fn dot<I: Isa>(p: [I::F32x16; 3], q: [I::F32x16; 3]) -> I::F32x16 {
    p[2].mul_add(q[2], p[1].mul_add(q[1], p[0].mul(q[0])))
}

/// Adds to a radius how far a box of half sides `half` reaches along `x - alpha u`.
#[inline(always)]
fn rest<I: Isa>(
    x: [I::F32x16; 3],
    alpha: I::F32x16,
    u: [I::F32x16; 3],
    half: [I::F32x16; 3],
    radius: I::F32x16,
) -> I::F32x16 {
    let mut sum = radius;
    for axis in 0..3 {
        sum = alpha.neg_mul_add(u[axis], x[axis]).abs().mul_add(half[axis], sum);
    }
    sum
}

/// Multiplies the vectors of four nodes by a matrix of three columns and adds a vector.
#[inline(always)]
fn turn<I: Isa>(isa: I, columns: &[Rows; 3], from: &Rows, add: I::F32x16) -> Rows {
    let mut sum = add;
    for j in 0..3 {
        sum = isa.tile(from.row(j)).mul_add(isa.load(&columns[j].0), sum);
    }
    let mut turned = Rows::ZERO;
    isa.store(sum, &mut turned.0);
    turned
}

#[cfg(test)]
mod tests;
