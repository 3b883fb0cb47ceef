//! Finds the closest of the 42 candidates for the closest points of two triangles. [`super::distance`] says what they are.
//!
//! The lanes of a register belong to the three corners of a triangle, or to the edges that begin there. A row of candidates is
//! what one corner, edge or face of a triangle makes with the corners or edges of the other one.

use super::{Point, Triangle, largest_of, negated, reciprocal_exponent};
use crate::isa::Isa;
use crate::isa::corners::{Corners, Three};
use crate::isa::scalar::Scalar;

/// A vector for each corner, by coordinate.
pub(super) type Vectors<C> = [C; 3];

/// A point of a triangle: `corner + along * (next - corner) + across * (previous - corner)`.
///
/// It lies in the relative interior of the feature that its nonzero weights span: both weights are at least 0, and
/// their exact sum is below 1.
#[derive(Clone, Copy)]
pub(super) struct Foot {
    pub(super) corner: usize,
    pub(super) along: f64,
    pub(super) across: f64,
}

impl Foot {
    pub(super) fn corner(corner: usize) -> Self {
        Self { corner, along: 0.0, across: 0.0 }
    }

    pub(super) fn edge(corner: usize, along: f64) -> Self {
        Self { corner, along, across: 0.0 }
    }
}

/// The feet of two features: the closest points, if no other feet are closer.
#[derive(Clone, Copy)]
pub(super) struct Feet {
    pub(super) squared: f64,
    pub(super) foot_a: Foot,
    pub(super) foot_b: Foot,
}

/// The gaps between two triangles, and their edges, in multiples of `unit`; each coordinate is rounded once.
pub(super) struct Differences<C> {
    /// From each corner of `a`, what leads to the corners of `b`.
    pub(super) gaps: [Vectors<C>; 3],
    /// From each corner of `b`, what leads to the corners of `a`.
    back: [Vectors<C>; 3],
    /// From each corner to the next one.
    pub(super) edges_a: Vectors<C>,
    pub(super) edges_b: Vectors<C>,
    /// The largest coordinate of all, in mesh units.
    pub(super) size: f64,
    /// The power of two that turns a length back to mesh units.
    pub(super) unit: f64,
}

impl<C: Corners> Differences<C> {
    #[inline(always)]
    pub(super) fn new(isa: impl Isa<F64x3 = C>, a: &Triangle, b: &Triangle) -> Self {
        let (mut gaps, mut back) = (gaps_from(isa, a, b), gaps_from(isa, b, a));
        let (mut edges_a, mut edges_b) = (edges(isa, a), edges(isa, b));
        let [from_p, from_q, from_r] = gaps;
        let size = magnitude(from_p).max(magnitude(from_q)).max(magnitude(from_r));
        let size = size.max(magnitude(edges_a)).max(magnitude(edges_b)).largest();
        let scale = reciprocal_exponent(size);
        let by = isa.corners([scale; 3]);
        for vectors in gaps.iter_mut().chain(&mut back).chain([&mut edges_a, &mut edges_b]) {
            for coordinate in vectors {
                *coordinate = coordinate.mul(by);
            }
        }
        Self { gaps, back, edges_a, edges_b, size, unit: 1.0 / scale }
    }

    /// Returns the closest of all candidates. Of equally close ones it is the first, so that the result is a function of the input.
    ///
    /// In order, the rows are: 3 of the corners of `a` with corners, 3 of the edges of `a` with corners, 3 of the edges of `b` with
    /// corners of `a`, 3 of the edges of `a` with edges, and the faces of `a` and of `b` with the corners of the other one.
    #[inline(always)]
    pub(super) fn closest(&self, isa: impl Isa<F64x3 = C>) -> Feet {
        let (none, one) = (isa.corners([0.0; 3]), isa.corners([1.0; 3]));
        let infinity = isa.corners([f64::INFINITY; 3]);
        let smallest = isa.corners([f64::MIN_POSITIVE; 3]);
        let mut rows = [infinity; ROWS];
        for i in 0..3 {
            rows[i] = dot(self.gaps[i], self.gaps[i]);
        }
        // The weights on an edge that give the feet of the perpendiculars from corners, and these perpendiculars.
        let mut along = [none; 6];
        let mut perpendicular = [[none; 3]; 6];
        let mut bases = [0; 2];
        let mut inverses = [[0.0; 3]; 2];
        for (side, (edges, gaps)) in
            [(self.edges_a, &self.gaps), (self.edges_b, &self.back)].into_iter().enumerate()
        {
            let squares = dot(edges, edges);
            // 1 over the edge's squared length, or 0 if that square is not a normal number.
            let inverse = C::select(squares.lt(smallest), none, one.div(squares));
            bases[side] = largest_of(squares.all());
            inverses[side] = inverse.all();
            for i in 0..3 {
                let edge = everywhere(isa, point(&edges, i));
                let foot = dot(gaps[i], edge).mul(isa.corners([inverse.of(i); 3]));
                let to_corner = less(gaps[i], foot, edge);
                rows[3 + 3 * side + i] =
                    C::select(is_between(isa, foot), dot(to_corner, to_corner), infinity);
                along[3 * side + i] = foot;
                perpendicular[3 * side + i] = to_corner;
            }
        }
        let (mut s, mut t) = ([none; 3], [none; 3]);
        for i in 0..3 {
            // An edge of `b` begins at the corner of its lane.
            let (edge, from) = (everywhere(isa, point(&self.edges_a, i)), perpendicular[i]);
            let slope = dot(self.edges_b, edge).mul(isa.corners([inverses[0][i]; 3]));
            let across = less(self.edges_b, slope, edge);
            // NaN or infinite, and so not inside, if `across` is zero.
            t[i] = none.sub(dot(from, across)).div(dot(across, across));
            s[i] = along[i].add(t[i].mul(slope));
            let shortest = less(from, none.sub(t[i]), across);
            let inside = C::and(is_between(isa, t[i]), is_between(isa, s[i]));
            rows[9 + i] = C::select(inside, dot(shortest, shortest), infinity);
        }
        // Of a face, the longest edge is projected out first, so what is left is the triangle's least height, which is as
        // small as a sliver is thin.
        let mut faces = [[none; 2]; 2];
        for (side, edges) in [&self.edges_a, &self.edges_b].into_iter().enumerate() {
            let base = bases[side];
            let (edge, previous) = (point(edges, base), point(edges, (base + 2) % 3));
            let apex = negated(previous);
            let slope = super::dot(apex, edge) * inverses[side][base];
            let height = super::add_scaled(apex, -slope, edge);
            let whole = super::dot(height, height);
            if whole < f64::MIN_POSITIVE {
                continue;
            }
            let (height, line) = (everywhere(isa, height), 3 * side + base);
            let across = dot(perpendicular[line], height).mul(isa.corners([1.0 / whole; 3]));
            let foot = along[line].sub(across.mul(isa.corners([slope; 3])));
            // If the rounded sum is less than 1, so is the exact one.
            let inside = C::and(C::and(none.lt(across), none.lt(foot)), across.add(foot).lt(one));
            let shortest = less(perpendicular[line], across, height);
            rows[12 + side] = C::select(inside, dot(shortest, shortest), infinity);
            faces[side] = [foot, across];
        }
        let (row, column, squared) = first_least(isa, &rows);
        let on_face = |side: usize| {
            let [along, across] = &faces[side & 1];
            Foot { corner: bases[side & 1], along: along.of(column), across: across.of(column) }
        };
        let on_edge = |row: usize| Foot::edge(row % 3, along[row - 3].of(column));
        let (foot_a, foot_b) = match row {
            0..3 => (Foot::corner(row), Foot::corner(column)),
            3..6 => (on_edge(row), Foot::corner(column)),
            6..9 => (Foot::corner(column), on_edge(row)),
            9..12 => (Foot::edge(row - 9, s[row - 9].of(column)), Foot::edge(column, t[row - 9].of(column))),
            12 => (on_face(0), Foot::corner(column)),
            _ => (Foot::corner(column), on_face(1)),
        };
        Feet { squared, foot_a, foot_b }
    }
}

impl Differences<Three> {
    /// Returns the differences between a point, instead of `a`, and `b`, given what leads from the point to the corners of `b`.
    pub(super) fn with_point_as_a(&self, gaps: Triangle) -> Self {
        let by_axis = [0, 1, 2].map(|axis| Scalar.corners(gaps.map(|gap| gap[axis])));
        Self {
            gaps: [by_axis; 3],
            back: gaps.map(|gap| everywhere(Scalar, negated(gap))),
            edges_a: everywhere(Scalar, [0.0; 3]),
            ..*self
        }
    }
}

/// The rows of candidates.
const ROWS: usize = 14;

/// Returns the row, the column and the value of the least number; of equal ones, the first, row by row. None is NaN.
#[inline(always)]
fn first_least<C: Corners>(isa: impl Isa<F64x3 = C>, rows: &[C; ROWS]) -> (usize, usize, f64) {
    // In pairs of neighbours, and not one after another.
    let mut least = *rows;
    let mut number = [isa.corners([0.0; 3]); ROWS];
    for (row, number) in number.iter_mut().enumerate() {
        *number = isa.corners([row as f64; 3]);
    }
    for at in [1, 2, 4, 8] {
        for row in (0..ROWS - at).step_by(2 * at) {
            let closer = least[row + at].lt(least[row]);
            least[row] = C::select(closer, least[row + at], least[row]);
            number[row] = C::select(closer, number[row + at], number[row]);
        }
    }
    let (least, rows) = (least[0].all(), number[0].all());
    let mut column = 0;
    for other in 1..3 {
        if least[other] < least[column] || least[other] == least[column] && rows[other] < rows[column] {
            column = other;
        }
    }
    (rows[column] as usize, column, least[column])
}

/// Returns the vector of a corner.
#[inline(always)]
pub(super) fn point<C: Corners>(of: &Vectors<C>, corner: usize) -> Point {
    [of[0].of(corner), of[1].of(corner), of[2].of(corner)]
}

/// Returns the same vector for all corners.
#[inline(always)]
pub(super) fn everywhere<C: Corners>(isa: impl Isa<F64x3 = C>, [x, y, z]: Point) -> Vectors<C> {
    [isa.corners([x; 3]), isa.corners([y; 3]), isa.corners([z; 3])]
}

/// Returns the corners of a triangle in lanes, from the one called `first` on.
#[inline(always)]
pub(super) fn corners<I: Isa>(isa: I, t: &Triangle, first: usize) -> Vectors<I::F64x3> {
    let (p, q, r) = (t[first % 3], t[(first + 1) % 3], t[(first + 2) % 3]);
    [isa.corners([p[0], q[0], r[0]]), isa.corners([p[1], q[1], r[1]]), isa.corners([p[2], q[2], r[2]])]
}

/// Returns what leads from a point to the corners of a triangle.
#[inline(always)]
fn gaps_to<I: Isa>(isa: I, point: Point, to: &Triangle) -> Vectors<I::F64x3> {
    subtract(corners(isa, to, 0), everywhere(isa, point))
}

#[inline(always)]
fn gaps_from<I: Isa>(isa: I, [p, q, r]: &Triangle, to: &Triangle) -> [Vectors<I::F64x3>; 3] {
    [gaps_to(isa, *p, to), gaps_to(isa, *q, to), gaps_to(isa, *r, to)]
}

/// Returns what leads from each corner of a triangle to the next one.
#[inline(always)]
pub(super) fn edges<I: Isa>(isa: I, t: &Triangle) -> Vectors<I::F64x3> {
    subtract(corners(isa, t, 1), corners(isa, t, 0))
}

/// Returns the largest coordinate of each vector.
#[inline(always)]
pub(super) fn magnitude<C: Corners>([x, y, z]: Vectors<C>) -> C {
    x.abs().max(y.abs()).max(z.abs())
}

/// Returns where a weight is strictly between 0 and 1.
#[inline(always)]
pub(super) fn is_between<C: Corners>(isa: impl Isa<F64x3 = C>, x: C) -> C::Mask {
    C::and(isa.corners([0.0; 3]).lt(x), x.lt(isa.corners([1.0; 3])))
}

#[inline(always)]
pub(super) fn subtract<C: Corners>(p: Vectors<C>, q: Vectors<C>) -> Vectors<C> {
    [p[0].sub(q[0]), p[1].sub(q[1]), p[2].sub(q[2])]
}

#[inline(always)]
pub(super) fn dot<C: Corners>(p: Vectors<C>, q: Vectors<C>) -> C {
    p[0].mul(q[0]).add(p[1].mul(q[1])).add(p[2].mul(q[2]))
}

/// Returns `p - factor * q`; each coordinate is rounded twice.
#[inline(always)]
pub(super) fn less<C: Corners>(p: Vectors<C>, factor: C, q: Vectors<C>) -> Vectors<C> {
    [p[0].sub(factor.mul(q[0])), p[1].sub(factor.mul(q[1])), p[2].sub(factor.mul(q[2]))]
}
