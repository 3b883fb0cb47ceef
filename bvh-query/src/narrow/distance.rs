//! Measures the distance between two closed triangles, with witness points and certified bounds.
//!
//! # Method
//! Unless the triangles meet, the closest points are in the relative interiors of two features (corner, edge
//! or face) on which the line between them is perpendicular, and one of four kinds: corner and corner, corner
//! and edge, edge and edge, corner and face. So the distance is the least over 9 + 18 + 9 + 6 candidates,
//! each of which counts only where its feet lie strictly inside both features; what is lost to a wrong
//! decision near a border is found again as a candidate of the border. Whether the triangles meet is never
//! read off the distance: a positive lower bound proves that they don't, and else [`triangles_intersect`]
//! decides.
//!
//! # Why it is accurate
//! All that enters is differences of two input points, so an offset of both triangles costs nothing, and a
//! gap between two corners has full relative accuracy. The least-squares problem of two edges, or of a corner
//! and a face, is solved by modified Gram-Schmidt orthogonalisation (Å. Björck, "Solving Linear Least Squares
//! Problems by Gram-Schmidt Orthogonalization", BIT 7, 1967), which is backward stable: one direction is
//! projected out of the other and out of the gap, `r` and `h` are left, and the distance is that of `r` from
//! the line along `h`. Each has an absolute error of a few roundings of the lengths at hand, and the weight
//! on `h` is at most 1, so however short `h` is (a sliver, or two nearly parallel edges) the distance is off
//! by a few roundings of these lengths. The textbook formula divides by `|d|²|e|² - (d·e)²` and loses half
//! the digits there; one that skips small normals below an absolute length misses the face altogether.
//!
//! # Units
//! Differences are scaled by a power of two, exactly, so that the largest coordinate is in [1, 2). What
//! underflows after that is too small, relative to the sizes at hand, to show in the result.

use super::{Point, Triangle, UNIT_ROUNDOFF, add_scaled, cross, dot, subtract, triangles_intersect};

/// How far two triangles are apart, and where; lengths in mesh units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    /// The distance of the closest points found: 0 if and only if the triangles intersect.
    pub(crate) distance: f64,
    /// A certified lower bound of the exact distance, at most `distance`; 0 where nothing better is proven.
    pub(crate) lower: f64,
    /// A certified upper bound of the exact distance, at least `distance`.
    pub(crate) upper: f64,
    /// A point of the first triangle, up to the rounding of its coordinates.
    pub(crate) point_a: Point,
    /// A point of the second triangle, up to the rounding of its coordinates; `point_a` if they intersect.
    pub(crate) point_b: Point,
}

/// The distance of two closed triangles and a pair of closest points.
///
/// `distance` is 0 if and only if [`triangles_intersect`], and both witness points then are the same.
/// Otherwise it is positive, and within a few roundings (2^-53 each) of the size of the triangles and the
/// gap; the exact value is in `lower..=upper`. Where both bounds of a gap near 2^-53 of the size fail to tell
/// it from zero, the distance is still positive but may be as small as the smallest normal number. A triangle
/// without area is the segment or point that its corners span. Constant cost.
///
/// The result has the same bits whatever the target: no operation is fused, and no operation combines lanes.
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
    // Between two features that are about as near, the direction of either may be far off that of the gap.
    let lower = if distance - lower > MAX_ERROR_ASYMMETRY * (upper - distance) {
        differences.widest(&closest).max(lower)
    } else {
        lower
    };
    // A length that rounds to zero is still not a contact.
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

/// A lower bound this many times as far below the distance as the upper bound is above is not taken as it is.
const MAX_ERROR_ASYMMETRY: f64 = 8.0;

/// A point of a triangle: `corner + along * (next - corner) + across * (previous - corner)`.
///
/// In the relative interior of the feature that its nonzero weights span: both are at least 0, and their
/// exact sum is below 1.
#[derive(Clone, Copy)]
struct Foot {
    corner: usize,
    along: f64,
    across: f64,
}

impl Foot {
    fn corner(corner: usize) -> Self {
        Self { corner, along: 0.0, across: 0.0 }
    }

    fn edge(corner: usize, along: f64) -> Self {
        Self { corner, along, across: 0.0 }
    }

    /// The two terms that are added to the corner. `edges[i]` leads from corner `i` to the next one.
    fn offsets(&self, edges: &Triangle) -> [Point; 2] {
        let (next, previous) = (edges[self.corner], edges[(self.corner + 2) % 3]);
        [times(self.along, next), times(-self.across, previous)]
    }

    /// The point in mesh units, given the edges in multiples of `unit`.
    fn place(&self, triangle: &Triangle, edges: &Triangle, unit: f64) -> Point {
        let [along, across] = self.offsets(edges);
        let corner = triangle[self.corner];
        [0, 1, 2].map(|k| corner[k] + (along[k] + across[k]) * unit)
    }
}

/// A candidate for the closest pair of points.
#[derive(Clone, Copy)]
struct Candidate {
    squared: f64,
    foot_a: Foot,
    foot_b: Foot,
}

/// Candidates in order: 9 of two corners, 9 of an edge of `a` and a corner, 9 of an edge of `b` and a corner, 9 of two
/// edges, 3 of the face of `a`, 3 of the face of `b`; and as many infinite ones as fill registers.
const CANDIDATES: usize = 48;

/// The gaps between two triangles and their edges, in multiples of `unit`, each coordinate rounded once.
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
    /// `None` if all six corners are the same point.
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

    /// From corner `j` of `b` to the corners of `a`.
    #[inline(always)]
    fn gaps_to(&self, j: usize) -> Triangle {
        [negated(self.gaps[0][j]), negated(self.gaps[1][j]), negated(self.gaps[2][j])]
    }

    /// The closest pair among all candidates. Ties go to the first, so that the result is a function of the input.
    #[inline(always)]
    fn closest(&self) -> Candidate {
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
        Candidate { squared: least, foot_a, foot_b }
    }

    /// The direction in which the triangles are most likely separated: the one between the closest points.
    ///
    /// Of a face or of two edges the normal is taken instead, which a small gap doesn't make inaccurate.
    #[inline(always)]
    fn direction(&self, closest: &Candidate) -> Point {
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
    fn terms(&self, closest: &Candidate) -> [Point; 5] {
        let (a, b) = (&closest.foot_a, &closest.foot_b);
        let [along_a, across_a] = a.offsets(&self.edges_a);
        let [along_b, across_b] = b.offsets(&self.edges_b);
        [self.gaps[a.corner][b.corner], negated(along_a), negated(across_a), along_b, across_b]
    }

    /// The vector from the first foot to the second.
    #[inline(always)]
    fn between(&self, closest: &Candidate) -> Point {
        self.terms(closest).into_iter().fold([0.0; 3], |sum, term| add_scaled(sum, 1.0, term))
    }

    /// The distance of the feet, and a certified upper bound of the triangles' exact distance, both scaled.
    ///
    /// The exact points with the weights of the feet are in the triangles, so their exact distance is an
    /// upper bound. In each coordinate the sum differs from theirs by at most one rounding of the gap, two of
    /// each other term (edge and product) and one for each of the two additions of terms that aren't zero:
    /// less than five roundings of the sum of magnitudes. Square, sum and root add less than four, relative.
    #[inline(always)]
    fn length(&self, closest: &Candidate) -> (f64, f64) {
        let sum = self.between(closest);
        let magnitude: f64 = self.terms(closest).iter().flatten().map(|x| x.abs()).sum();
        let length = dot(sum, sum).sqrt();
        (length, length * (1.0 + 8.0 * UNIT_ROUNDOFF) + 8.0 * UNIT_ROUNDOFF * magnitude)
    }

    /// A certified lower bound of the distance, scaled: the width of the slab across `direction` between the
    /// triangles, on either side, or 0.
    ///
    /// Any direction gives a bound, so its own error doesn't matter. A computed product `direction · gap` is
    /// off by at most four roundings (one of the gap, one of the product, two of the additions), relative to
    /// the sum of the magnitudes of its three terms; subtracting the bound from it rounds once more. Eight of
    /// them also cover the rounding of the bound itself. The largest coordinate of `direction` is scaled to
    /// [1, 2), so that what underflows is less than the smallest normal number in total, and that the norm,
    /// the division and the last product are off by less than eight roundings, relative.
    #[inline(always)]
    fn separation(&self, direction: Point) -> f64 {
        let size = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
        // An edge without length leaves no direction.
        if size == 0.0 || !direction.iter().all(|x| x.is_finite()) {
            return 0.0;
        }
        let scale = reciprocal_exponent(size);
        let direction = direction.map(|x| x * scale);
        let magnitude = direction.map(f64::abs);
        let (mut ahead, mut behind) = (f64::INFINITY, f64::INFINITY);
        for gap in self.gaps.iter().flatten() {
            let height = dot(direction, *gap);
            let error = 8.0 * UNIT_ROUNDOFF * dot(magnitude, gap.map(f64::abs));
            ahead = ahead.min(height - error);
            behind = behind.min(-height - error);
        }
        let width = ahead.max(behind) - f64::MIN_POSITIVE;
        if width > 0.0 { width / dot(direction, direction).sqrt() * (1.0 - 8.0 * UNIT_ROUNDOFF) } else { 0.0 }
    }
}

impl Differences {
    /// The best lower bound that any of eighteen directions gives: both normals, all cross products of edges,
    /// and the gap as it is and made perpendicular to each edge.
    #[cold]
    #[inline(never)]
    fn widest(&self, closest: &Candidate) -> f64 {
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

/// The six edges, each with the three corners of the other triangle, seen from the edge's first corner: element
/// `3 * i + k` is edge i of `a` and corner k of `b`, `9 + 3 * j + k` edge j of `b` and corner k of `a`. One array a
/// coordinate, so that all go through vector registers at once; their ends hold nothing of meaning.
struct Lines {
    gap: [[f64; LINES]; 3],
    edge: [[f64; LINES]; 3],
    /// 1 over the edge's squared length; infinite or NaN are never used, an edge without length has 0.
    inverse: [f64; LINES],
    /// The weight on `edge` of the foot of the corner's perpendicular.
    along: [f64; LINES],
    /// The perpendicular that leads to the corner.
    perpendicular: [[f64; LINES]; 3],
}

/// 18, and as many as fill registers.
const LINES: usize = 24;

/// 9, and as many as fill registers.
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

    /// The squared distances of corners from corners and from edges; infinite unless the foot is inside the edge.
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

    /// The squared distances of edges from edges, and the weights on both; infinite unless the feet are inside both.
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
            // NaN or infinite, hence not inside, if nothing is left of the edge.
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

/// Element `l` of three arrays.
#[inline(always)]
fn at(arrays: &[[f64; LINES]; 3], l: usize) -> Point {
    [arrays[0][l], arrays[1][l], arrays[2][l]]
}

#[inline(always)]
fn put(arrays: &mut [[f64; LINES]; 3], l: usize, value: Point) {
    (arrays[0][l], arrays[1][l], arrays[2][l]) = (value[0], value[1], value[2]);
}

/// The feet of the other triangle's corners on a face: the base they are given from, and two weights each.
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
    /// The squared distances of the face of `a` (side 0) or `b` (side 1) from the corners of the other triangle,
    /// infinite unless the foot is inside the face. The longest edge is projected out first, so that the height
    /// on it is as small as the sliver.
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
            // A sum that rounds to less than 1 is less than 1.
            let inside = (across > 0.0) & (along > 0.0) & (across + along < 1.0);
            let shortest = add_scaled(to_corner, -across, height);
            squared[36 + 3 * side + k] = if inside { dot(shortest, shortest) } else { f64::INFINITY };
            (feet.along[k], feet.across[k]) = (along, across);
        }
        feet
    }
}

/// A point that two intersecting triangles have in common, as well as f64 gives it.
///
/// Where they touch or overlap in a plane the closest feet are it. Where an edge pierces a face they are
/// apart, and the crossing is computed; whichever is least far from the other triangle counts.
#[cold]
fn common_point(a: &Triangle, b: &Triangle, differences: &Differences, closest: &Candidate) -> Point {
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
    /// Of the points where the edges of `a` pass through the plane of `b` the one closest to `b`, with its
    /// squared distance.
    ///
    /// The plane of a sliver is known well only near the sliver, so each crossing is found by Newton's method
    /// from the plane: the remaining height is measured from the closest point of `b`, and shrinks by some
    /// seven digits in a step even where rounding tilts the plane that much.
    fn crossing(&self) -> Option<(f64, Foot)> {
        const STEPS: usize = 3;
        // Four roundings of the size, which is at least 1: no step improves on that.
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

/// The edge to project out first.
fn longest(edges: &Triangle) -> usize {
    let [p, q, r] = edges.map(|edge| dot(edge, edge));
    if p >= q && p >= r {
        0
    } else if q >= r {
        1
    } else {
        2
    }
}

/// A normal of two vectors, of which the first is not too short to be squared; perpendicular to it up to one
/// rounding, however small the angle between them.
fn perpendicular_normal(d: Point, e: Point) -> Point {
    cross(d, perpendicular_part(d, e))
}

/// `e` without its component along `d`, which is not too short to be squared.
#[inline(always)]
fn perpendicular_part(d: Point, e: Point) -> Point {
    add_scaled(e, -dot(d, e) / dot(d, d), d)
}

#[inline(always)]
fn times(factor: f64, p: Point) -> Point {
    [factor * p[0], factor * p[1], factor * p[2]]
}

#[inline(always)]
fn negated(p: Point) -> Point {
    [-p[0], -p[1], -p[2]]
}

/// The power of two that scales a positive number into [1, 2); exact for normal numbers below 2^1023.
fn reciprocal_exponent(x: f64) -> f64 {
    let exponent = x.to_bits() >> 52 & 0x7ff;
    f64::from_bits(2046_u64.saturating_sub(exponent) << 52)
}
