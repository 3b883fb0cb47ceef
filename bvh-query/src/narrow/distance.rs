//! Measures the distance between two closed triangles, with witness points and certified bounds.
//!
//! # Method
//! Unless the triangles meet, the two closest points lie in the relative interiors of two features (corners,
//! edges or faces), and the line between them is perpendicular to both features. There are four kinds of pairs:
//! corner and corner, corner and edge, edge and edge, corner and face. So the distance is the least of
//! 9 + 18 + 9 + 6 candidates. A candidate counts only if its feet lie strictly inside both features. If rounding
//! rejects a foot near the border of a feature, a candidate of that border takes its place. The distance itself
//! never decides whether the triangles meet: a positive lower bound proves that they do not, and otherwise
//! [`triangles_intersect`] decides.
//!
//! # Why it is accurate
//! Only differences of two input points enter the computation, so a common offset of both triangles
//! costs no accuracy, and a gap between two corners has full relative accuracy. The least-squares problem of two
//! edges, or of a corner and a face, is solved by modified Gram-Schmidt orthogonalisation (Å. Björck, "Solving
//! Linear Least Squares Problems by Gram-Schmidt Orthogonalization", BIT 7, 1967), which is backward stable. The
//! first direction is projected out of the second one, which leaves `h`, and out of the gap, which leaves `r`;
//! the distance is that of `r` from the line along `h`. Both have an absolute error of a few roundings of the
//! lengths involved, and the weight on `h` is at most 1. So the error of the distance is a few roundings of these
//! lengths, however short `h` is (for a sliver, or for two nearly parallel edges). The textbook formula divides
//! by `|d|²|e|² - (d·e)²` and loses half the digits there. A formula that skips normals below an absolute length
//! misses the face altogether.
//!
//! # Units
//! Differences are scaled by a power of two, exactly, so that the largest coordinate is in [1, 2). Whatever
//! underflows after that is too small, relative to the lengths involved, to change the result.

use super::{Point, Triangle, UNIT_ROUNDOFF, add_scaled, cross, dot, subtract, triangles_intersect};
use std::hint::select_unpredictable;

/// How far two triangles are apart, and where; lengths in mesh units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    /// The distance between the closest points found; 0 if and only if the triangles intersect.
    pub(crate) distance: f64,
    /// A certified lower bound of the exact distance, at most `distance`; 0 if no positive bound is proven.
    pub(crate) lower: f64,
    /// A certified upper bound of the exact distance, at least `distance`.
    pub(crate) upper: f64,
    /// A point of the first triangle, up to the rounding of its coordinates.
    pub(crate) point_a: Point,
    /// A point of the second triangle, up to the rounding of its coordinates; `point_a` if they intersect.
    pub(crate) point_b: Point,
}

/// Returns the distance between two closed triangles, with bounds and a pair of closest points.
///
/// `distance` is 0 if and only if [`triangles_intersect`] returns true, and then both witness points are the same.
/// Otherwise it is positive. Its error is a few roundings (2^-53 each) of the size of the triangles and the gap, and
/// the exact value is in `lower..=upper`. For a gap near 2^-53 of the size, the bounds may not exclude zero; the
/// distance is still positive then, but may be as small as the smallest normal number. A triangle without area is
/// the segment or point that its corners span. The cost is constant.
///
/// The result has the same bits on every target: no operation is fused, and no operation combines lanes.
#[must_use]
#[inline(always)]
pub(crate) fn triangle_distance(a: &Triangle, b: &Triangle) -> Closest {
    let Some(differences) = Differences::new(a, b) else {
        return Closest { distance: 0.0, lower: 0.0, upper: 0.0, point_a: a[0], point_b: b[0] };
    };
    let closest = differences.closest();
    let lower = differences.separation(differences.direction(&closest));
    if lower == 0.0 && triangles_intersect(a, b) {
        let point = common_point(a, b, &differences, &closest);
        return Closest { distance: 0.0, lower: 0.0, upper: 0.0, point_a: point, point_b: point };
    }
    let (distance, upper) = differences.length(&closest);
    // If two pairs of features are about equally near, the chosen direction may be far from that of the gap.
    let lower = if distance - lower > MAX_ERROR_ASYMMETRY * (upper - distance) {
        differences.widest(&closest).max(lower)
    } else {
        lower
    };
    // The triangles do not meet, so the distance must not round to zero.
    let distance = (distance * differences.unit).max(f64::MIN_POSITIVE);
    let lower = lower * differences.unit;
    Closest {
        distance,
        // Multiplying by a power of two is exact down to the smallest normal number.
        lower: if lower < f64::MIN_POSITIVE { 0.0 } else { lower.min(distance) },
        upper: (upper * differences.unit).max(distance),
        point_a: closest.foot_a.place(a, &differences.edges_a, differences.unit),
        point_b: closest.foot_b.place(b, &differences.edges_b, differences.unit),
    }
}

/// Does what [`triangle_distance`] does where that is rare: once for all callers.
#[cold]
#[inline(never)]
pub(crate) fn triangle_distance_apart(a: &Triangle, b: &Triangle) -> Closest {
    triangle_distance(a, b)
}

/// The largest accepted ratio of `distance - lower` to `upper - distance`; beyond it a better lower bound is sought.
pub(super) const MAX_ERROR_ASYMMETRY: f64 = 8.0;

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

    /// Returns the two terms that are added to the corner. `edges[i]` leads from corner `i` to the next one.
    pub(super) fn offsets(&self, edges: &Triangle) -> [Point; 2] {
        let (next, previous) = (edges[self.corner], edges[(self.corner + 2) % 3]);
        [times(self.along, next), times(-self.across, previous)]
    }

    /// Returns the point in mesh units, given the edges in multiples of `unit`.
    pub(super) fn place(&self, triangle: &Triangle, edges: &Triangle, unit: f64) -> Point {
        let [along, across] = self.offsets(edges);
        let corner = triangle[self.corner];
        [0, 1, 2].map(|k| corner[k] + (along[k] + across[k]) * unit)
    }
}

/// The feet of two features: the closest points, if no other feet are closer.
#[derive(Clone, Copy)]
struct Feet {
    squared: f64,
    foot_a: Foot,
    foot_b: Foot,
}

/// The number of candidates. In order: 9 of two corners, 9 of an edge of `a` and a corner, 9 of an edge of `b` and a
/// corner, 9 of two edges, 3 of the face of `a`, 3 of the face of `b`, and 6 infinite ones that fill the registers.
const CANDIDATES: usize = 48;

/// The gaps between two triangles, and their edges, in multiples of `unit`; each coordinate is rounded once.
struct Differences {
    /// `gaps[i][j]` leads from corner `i` of `a` to corner `j` of `b`.
    gaps: [Triangle; 3],
    /// `edges_a[i]` leads from corner `i` to the next one.
    edges_a: Triangle,
    edges_b: Triangle,
    /// The power of two that turns a length back to mesh units.
    unit: f64,
}

impl Differences {
    /// Returns `None` if all six corners are the same point.
    #[inline(always)]
    fn new(a: &Triangle, b: &Triangle) -> Option<Self> {
        let from = |p: Point| [subtract(b[0], p), subtract(b[1], p), subtract(b[2], p)];
        let gaps = [from(a[0]), from(a[1]), from(a[2])];
        let edges = |t: &Triangle| [subtract(t[1], t[0]), subtract(t[2], t[1]), subtract(t[0], t[2])];
        let (edges_a, edges_b) = (edges(a), edges(b));
        let largest = |t: &Triangle| t.as_flattened().iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let [p, q, r] = &gaps;
        let size = largest(p).max(largest(q)).max(largest(r)).max(largest(&edges_a)).max(largest(&edges_b));
        if size == 0.0 {
            return None;
        }
        let scale = reciprocal_exponent(size);
        let scaled = |t: Triangle| [times(scale, t[0]), times(scale, t[1]), times(scale, t[2])];
        Some(Self {
            gaps: [scaled(gaps[0]), scaled(gaps[1]), scaled(gaps[2])],
            edges_a: scaled(edges_a),
            edges_b: scaled(edges_b),
            unit: 1.0 / scale,
        })
    }

    /// Returns the differences with the roles of the triangles exchanged.
    fn swapped(&self) -> Self {
        Self {
            gaps: [self.gaps_to(0), self.gaps_to(1), self.gaps_to(2)],
            edges_a: self.edges_b,
            edges_b: self.edges_a,
            unit: self.unit,
        }
    }

    /// Returns the gaps from corner `j` of `b` to the corners of `a`.
    #[inline(always)]
    fn gaps_to(&self, j: usize) -> Triangle {
        [negated(self.gaps[0][j]), negated(self.gaps[1][j]), negated(self.gaps[2][j])]
    }

    /// Returns the closest of all candidates. Ties go to the first, so that the result is a function of the input.
    #[inline(always)]
    fn closest(&self) -> Feet {
        let mut squared = [f64::INFINITY; CANDIDATES];
        let lines = Lines::new(self);
        lines.corners(&mut squared);
        let (s, t) = lines.edges(&self.edges_b, &mut squared);
        let faces = [self.face(&lines, 0, &mut squared), self.face(&lines, 1, &mut squared)];
        let mut least = f64::INFINITY;
        for candidate in squared {
            least = if candidate < least { candidate } else { least };
        }
        let found = squared.iter().position(|&candidate| candidate == least).unwrap_or(0);
        let (row, column) = (found % 9 / 3, found % 3);
        let (foot_a, foot_b) = match found {
            0..9 => (Foot::corner(row), Foot::corner(column)),
            9..18 => (Foot::edge(row, lines.along[found - 9]), Foot::corner(column)),
            18..27 => (Foot::corner(column), Foot::edge(row, lines.along[found - 9])),
            27..36 => (Foot::edge(row, s[found - 27]), Foot::edge(column, t[found - 27])),
            36..39 => (faces[0].foot(column), Foot::corner(column)),
            _ => (Foot::corner(column), faces[1].foot(column)),
        };
        Feet { squared: least, foot_a, foot_b }
    }

    /// Returns the direction in which the triangles are most likely separated: the one between the closest points.
    ///
    /// For a face or two edges it returns the normal instead, which stays accurate however small the gap is.
    #[inline(always)]
    fn direction(&self, closest: &Feet) -> Point {
        let (a, b) = (&closest.foot_a, &closest.foot_b);
        if a.across != 0.0 {
            perpendicular_normal(self.edges_a[a.corner], self.edges_a[(a.corner + 2) % 3])
        } else if b.across != 0.0 {
            perpendicular_normal(self.edges_b[b.corner], self.edges_b[(b.corner + 2) % 3])
        } else if a.along != 0.0 && b.along != 0.0 {
            perpendicular_normal(self.edges_a[a.corner], self.edges_b[b.corner])
        } else {
            // Of a small gap little but noise may be left, so it is made perpendicular to the edge once more.
            let gap = self.between(closest);
            let edge = if a.along != 0.0 { self.edges_a[a.corner] } else { self.edges_b[b.corner] };
            if a.along != 0.0 || b.along != 0.0 { perpendicular_part(edge, gap) } else { gap }
        }
    }

    /// The vectors whose sum leads from the first foot to the second.
    #[inline(always)]
    fn terms(&self, closest: &Feet) -> [Point; 5] {
        let (a, b) = (&closest.foot_a, &closest.foot_b);
        let [along_a, across_a] = a.offsets(&self.edges_a);
        let [along_b, across_b] = b.offsets(&self.edges_b);
        [self.gaps[a.corner][b.corner], negated(along_a), negated(across_a), along_b, across_b]
    }

    /// The vector from the first foot to the second.
    #[inline(always)]
    fn between(&self, closest: &Feet) -> Point {
        self.terms(closest).into_iter().fold([0.0; 3], |sum, term| add_scaled(sum, 1.0, term))
    }

    /// The distance of the feet, and a certified upper bound of the triangles' exact distance, both scaled.
    ///
    /// The exact points with the weights of the feet are in the triangles, so their exact distance is an
    /// upper bound. In each coordinate the sum differs from theirs by at most one rounding of the gap, two of
    /// each other term (edge and product) and one for each of the two additions of terms that aren't zero:
    /// less than five roundings of the sum of magnitudes. Square, sum and root add less than four, relative.
    #[inline(always)]
    fn length(&self, closest: &Feet) -> (f64, f64) {
        let sum = self.between(closest);
        let magnitude: f64 = self.terms(closest).iter().flatten().map(|x| x.abs()).sum();
        let length = dot(sum, sum).sqrt();
        (length, length * (1.0 + 8.0 * UNIT_ROUNDOFF) + 8.0 * UNIT_ROUNDOFF * magnitude)
    }

    /// A certified lower bound of the distance, scaled: see [`certified_gap`].
    #[inline(always)]
    fn separation(&self, direction: Point) -> f64 {
        certified_gap(direction, self.gaps.as_flattened())
    }
}

/// A certified lower bound of the distance, scaled, given the gaps between all corners: the width of the slab across
/// `direction` between the triangles, on either side, or 0.
///
/// Any direction gives a bound, so an error of the direction does no harm. The error of a computed product
/// `direction · gap` is at most four roundings (one of the gap, one of the product, two of the additions),
/// relative to the sum of the magnitudes of its three terms. Subtracting the bound from it rounds once more.
/// Eight roundings also cover the rounding of the bound itself. The largest coordinate of `direction` is
/// scaled to [1, 2). So all underflow together is less than the smallest normal number, and the relative
/// error of the norm, the division and the last product is less than eight roundings.
#[inline(always)]
pub(super) fn certified_gap(direction: Point, gaps: &[Point]) -> f64 {
    let size = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
    // An edge without length leaves no direction.
    if size == 0.0 || !direction.iter().all(|x| x.is_finite()) {
        return 0.0;
    }
    let scale = reciprocal_exponent(size);
    let direction = direction.map(|x| x * scale);
    let magnitude = direction.map(f64::abs);
    let (mut ahead, mut behind) = (f64::INFINITY, f64::INFINITY);
    for gap in gaps {
        let height = dot(direction, *gap);
        let error = 8.0 * UNIT_ROUNDOFF * dot(magnitude, gap.map(f64::abs));
        ahead = ahead.min(height - error);
        behind = behind.min(-height - error);
    }
    let width = ahead.max(behind) - f64::MIN_POSITIVE;
    if width > 0.0 { width / dot(direction, direction).sqrt() * (1.0 - 8.0 * UNIT_ROUNDOFF) } else { 0.0 }
}

impl Differences {
    /// Returns the best lower bound of eighteen directions: both normals, all cross products of an edge of each
    /// triangle, the gap, and the gap's component perpendicular to each edge.
    #[cold]
    #[inline(never)]
    fn widest(&self, closest: &Feet) -> f64 {
        let (a, b) = (&self.edges_a, &self.edges_b);
        let gap = self.between(closest);
        let mut widest = self.separation(gap);
        let mut look_along = |direction| widest = self.separation(direction).max(widest);
        look_along(perpendicular_normal(a[0], a[2]));
        look_along(perpendicular_normal(b[0], b[2]));
        for &edge_a in a {
            b.iter().for_each(|&edge_b| look_along(perpendicular_normal(edge_a, edge_b)));
        }
        a.iter().chain(b).for_each(|&edge| look_along(perpendicular_part(edge, gap)));
        widest
    }
}

/// The six edges, each with the three corners of the other triangle, seen from the edge's first corner. Element
/// `3 * i + k` is edge i of `a` with corner k of `b`, element `9 + 3 * j + k` is edge j of `b` with corner k of `a`.
/// Each coordinate has one array, so that vector registers hold many elements. The elements after these 18 have no
/// meaning.
struct Lines {
    gap: [[f64; LINES]; 3],
    edge: [[f64; LINES]; 3],
    /// 1 over the edge's squared length, or 0 if that square is not a normal number.
    inverse: [f64; LINES],
    /// The weight on `edge` that gives the foot of the perpendicular from the corner.
    along: [f64; LINES],
    /// The perpendicular from this foot to the corner.
    perpendicular: [[f64; LINES]; 3],
}

/// The number of pairs of an edge and a corner, 18, rounded up to fill the registers.
const LINES: usize = 24;

/// The number of pairs of edges, and of pairs of corners, 9, rounded up to fill the registers.
const EDGES: usize = 16;

impl Lines {
    #[inline(always)]
    fn new(differences: &Differences) -> Self {
        let Differences { gaps, edges_a, edges_b, .. } = differences;
        let (mut gap, mut edge) = ([[0.0; LINES]; 3], [[0.0; LINES]; 3]);
        for axis in 0..3 {
            for i in 0..3 {
                for k in 0..3 {
                    gap[axis][3 * i + k] = gaps[i][k][axis];
                    gap[axis][9 + 3 * i + k] = -gaps[k][i][axis];
                    edge[axis][3 * i + k] = edges_a[i][axis];
                    edge[axis][9 + 3 * i + k] = edges_b[i][axis];
                }
            }
        }
        let (mut inverse, mut along) = ([0.0; LINES], [0.0; LINES]);
        let mut perpendicular = [[0.0; LINES]; 3];
        for l in 0..LINES {
            let (edge, gap) = (at(&edge, l), at(&gap, l));
            let squared = dot(edge, edge);
            inverse[l] = if squared >= f64::MIN_POSITIVE { 1.0 / squared } else { 0.0 };
            along[l] = dot(gap, edge) * inverse[l];
            put(&mut perpendicular, l, add_scaled(gap, -along[l], edge));
        }
        Self { gap, edge, inverse, along, perpendicular }
    }

    /// Computes the squared distances of corners from corners and from edges; infinite unless the foot is inside the
    /// edge.
    #[inline(always)]
    fn corners(&self, squared: &mut [f64; CANDIDATES]) {
        let (mut between, mut beside) = ([0.0; EDGES], [0.0; LINES]);
        for l in 0..EDGES {
            let gap = at(&self.gap, l);
            between[l] = dot(gap, gap);
        }
        for l in 0..LINES {
            let perpendicular = at(&self.perpendicular, l);
            let inside = (self.along[l] > 0.0) & (self.along[l] < 1.0);
            beside[l] = if inside { dot(perpendicular, perpendicular) } else { f64::INFINITY };
        }
        squared[..9].copy_from_slice(&between[..9]);
        squared[9..27].copy_from_slice(&beside[..18]);
    }

    /// Computes the squared distances of edges from edges, infinite unless both feet are inside their edges. Returns
    /// the weights on the edges of `a` and of `b`.
    #[inline(always)]
    fn edges(&self, edges_b: &Triangle, squared: &mut [f64; CANDIDATES]) -> ([f64; EDGES], [f64; EDGES]) {
        let mut others = [[0.0; LINES]; 3];
        for l in 0..9 {
            // Edge j of `b` begins at its corner j.
            put(&mut others, l, edges_b[l % 3]);
        }
        let (mut s, mut t, mut lengths) = ([0.0; EDGES], [0.0; EDGES], [0.0; EDGES]);
        for l in 0..EDGES {
            let (edge, perpendicular, other) =
                (at(&self.edge, l), at(&self.perpendicular, l), at(&others, l));
            let slope = dot(other, edge) * self.inverse[l];
            let across = add_scaled(other, -slope, edge);
            // NaN or infinite, and so not inside, if `across` is zero.
            t[l] = -dot(perpendicular, across) / dot(across, across);
            s[l] = self.along[l] + t[l] * slope;
            let inside = (t[l] > 0.0) & (t[l] < 1.0) & (s[l] > 0.0) & (s[l] < 1.0);
            let shortest = add_scaled(perpendicular, t[l], across);
            lengths[l] = if inside { dot(shortest, shortest) } else { f64::INFINITY };
        }
        squared[27..36].copy_from_slice(&lengths[..9]);
        (s, t)
    }
}

/// Returns element `l` of three arrays.
#[inline(always)]
fn at(arrays: &[[f64; LINES]; 3], l: usize) -> Point {
    [arrays[0][l], arrays[1][l], arrays[2][l]]
}

#[inline(always)]
fn put(arrays: &mut [[f64; LINES]; 3], l: usize, value: Point) {
    (arrays[0][l], arrays[1][l], arrays[2][l]) = (value[0], value[1], value[2]);
}

/// The feet of the other triangle's corners on a face: the base corner, and two weights per foot.
struct FaceFeet {
    base: usize,
    along: [f64; 3],
    across: [f64; 3],
}

impl FaceFeet {
    fn foot(&self, corner: usize) -> Foot {
        Foot { corner: self.base, along: self.along[corner], across: self.across[corner] }
    }
}

impl Differences {
    /// Computes the squared distances of the face of `a` (side 0) or `b` (side 1) from the corners of the other
    /// triangle, infinite unless the foot is inside the face. The longest edge is projected out first, so what is left
    /// is the triangle's least height, which is as small as a sliver is thin.
    #[inline(always)]
    fn face(&self, lines: &Lines, side: usize, squared: &mut [f64; CANDIDATES]) -> FaceFeet {
        let edges = if side == 0 { &self.edges_a } else { &self.edges_b };
        let base = longest(edges);
        let first = 9 * side + 3 * base;
        let (edge, apex) = (edges[base], negated(edges[(base + 2) % 3]));
        let slope = dot(apex, edge) * lines.inverse[first];
        let height = add_scaled(apex, -slope, edge);
        let whole = dot(height, height);
        let mut feet = FaceFeet { base, along: [0.0; 3], across: [0.0; 3] };
        if whole < f64::MIN_POSITIVE {
            return feet;
        }
        let inverse = 1.0 / whole;
        for k in 0..3 {
            let to_corner = at(&lines.perpendicular, first + k);
            let across = dot(to_corner, height) * inverse;
            let along = lines.along[first + k] - across * slope;
            // If the rounded sum is less than 1, so is the exact one.
            let inside = (across > 0.0) & (along > 0.0) & (across + along < 1.0);
            let shortest = add_scaled(to_corner, -across, height);
            squared[36 + 3 * side + k] = select_unpredictable(inside, dot(shortest, shortest), f64::INFINITY);
            (feet.along[k], feet.across[k]) = (along, across);
        }
        feet
    }
}

/// Returns a point that two intersecting triangles have in common, as accurately as f64 allows.
///
/// Where the triangles touch or overlap in a plane, the closest feet are such a point. Where an edge pierces a face,
/// the closest feet are apart, and the crossing is computed. The result is the point closest to the other triangle.
#[cold]
fn common_point(a: &Triangle, b: &Triangle, differences: &Differences, closest: &Feet) -> Point {
    let swapped = differences.swapped();
    let unit = differences.unit;
    let mut best = closest.squared;
    let mut point = closest.foot_a.place(a, &differences.edges_a, unit);
    for (triangle, differences) in [(a, differences), (b, &swapped)] {
        if let Some((squared, foot)) = differences.crossing()
            && squared < best
        {
            best = squared;
            point = foot.place(triangle, &differences.edges_a, unit);
        }
    }
    point
}

impl Differences {
    /// Returns the point, among those where the edges of `a` pass through the plane of `b`, that is closest to `b`,
    /// with its squared distance.
    ///
    /// The plane of a sliver is accurate only near the sliver. So each crossing starts at the plane and is improved by
    /// Newton's method: each step measures the remaining height from the closest point of `b`. The height shrinks by
    /// about seven digits per step, even where rounding tilts the plane that much.
    fn crossing(&self) -> Option<(f64, Foot)> {
        /// The number of Newton steps per edge.
        const STEPS: usize = 3;
        /// The squared distance at which the search ends, in squared multiples of `unit`: four roundings of the size,
        /// which is at least 1, so no step improves on it.
        const ENOUGH: f64 = (4.0 * UNIT_ROUNDOFF) * (4.0 * UNIT_ROUNDOFF);
        let base = longest(&self.edges_b);
        let normal = perpendicular_normal(self.edges_b[base], self.edges_b[(base + 2) % 3]);
        let heights = self.gaps.map(|gaps| -dot(normal, gaps[base]));
        let mut best: Option<(f64, Foot)> = None;
        for i in 0..3 {
            let (p, q) = (heights[i], heights[(i + 1) % 3]);
            if !((p < 0.0 && q > 0.0) || (p > 0.0 && q < 0.0)) {
                continue;
            }
            let mut along = p / (p - q);
            for _ in 0..STEPS {
                let gaps = self.gaps[i].map(|gap| add_scaled(gap, -along, self.edges_a[i]));
                let from_foot = Self { gaps: [gaps; 3], edges_a: [[0.0; 3]; 3], ..*self };
                let closest = from_foot.closest();
                if best.is_none_or(|(least, _)| closest.squared < least) {
                    best = Some((closest.squared, Foot::edge(i, along)));
                    if closest.squared <= ENOUGH {
                        return best;
                    }
                }
                along = (along + dot(normal, from_foot.between(&closest)) / (q - p)).clamp(0.0, 1.0);
            }
        }
        best
    }
}

/// Returns the index of the longest edge, which is projected out first.
pub(super) fn longest(edges: &Triangle) -> usize {
    let [p, q, r] = edges.map(|edge| dot(edge, edge));
    if p >= q && p >= r {
        0
    } else if q >= r {
        1
    } else {
        2
    }
}

/// Returns a normal of `d` and `e`, where `d` is not too short to be squared. The normal is perpendicular to `d` up to
/// one rounding, however small the angle between `d` and `e`.
pub(super) fn perpendicular_normal(d: Point, e: Point) -> Point {
    cross(d, perpendicular_part(d, e))
}

/// Returns `e` without its component along `d`, where `d` is not too short to be squared.
#[inline(always)]
pub(super) fn perpendicular_part(d: Point, e: Point) -> Point {
    add_scaled(e, -dot(d, e) / dot(d, d), d)
}

#[inline(always)]
pub(super) fn times(factor: f64, p: Point) -> Point {
    [factor * p[0], factor * p[1], factor * p[2]]
}

#[inline(always)]
pub(super) fn negated(p: Point) -> Point {
    [-p[0], -p[1], -p[2]]
}

/// Returns the power of two that scales a positive number into [1, 2); exact for normal numbers below 2^1023.
pub(super) fn reciprocal_exponent(x: f64) -> f64 {
    let exponent = x.to_bits() >> 52 & 0x7ff;
    f64::from_bits(2046_u64.saturating_sub(exponent) << 52)
}
