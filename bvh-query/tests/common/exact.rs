//! The oracles that decide in exact integers, from the definition, whether two triangles meet and how far apart they
//! are.
//!
//! They share no code with the library. Triangles are closed; those without area are segments and points.

use super::Triangle;
use dashu_int::IBig;
use std::cmp::Ordering;

type Vector = [IBig; 3];

fn subtract(p: &Vector, q: &Vector) -> Vector {
    [0, 1, 2].map(|k| p[k].clone() - q[k].clone())
}

fn dot(p: &Vector, q: &Vector) -> IBig {
    let [x, y, z] = [0, 1, 2].map(|k| p[k].clone() * q[k].clone());
    x + y + z
}

fn cross(p: &Vector, q: &Vector) -> Vector {
    let minor = |i: usize, j: usize| p[i].clone() * q[j].clone() - p[j].clone() * q[i].clone();
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Returns both triangles as integers, in units of 2^`exponent`.
fn integers(a: &Triangle, b: &Triangle) -> ([Vector; 3], [Vector; 3], i32) {
    let lowest = a.iter().chain(b).flatten().map(|&x| parts(x).1).min().unwrap();
    let integer = |x: f64| match parts(x) {
        (0, _) => IBig::ZERO,
        (mantissa, exponent) => IBig::from(mantissa) << (exponent - lowest) as usize,
    };
    (a.map(|p| p.map(integer)), b.map(|p| p.map(integer)), lowest)
}

/// Returns mantissa and exponent. The exponent of 0 is so high that it is never the lowest.
fn parts(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let mantissa = if field == 0 { fraction } else { fraction | 1 << 52 };
    match mantissa.trailing_zeros() as i32 {
        64 => (0, i32::MAX / 4),
        zeros => ((mantissa >> zeros) * if x < 0.0 { -1 } else { 1 }, field.max(1) - 1075 + zeros),
    }
}

fn separates(a: &[Vector; 3], b: &[Vector; 3], axis: &Vector) -> bool {
    let [p, q] = [a, b].map(|corners| {
        let mut heights = [0, 1, 2].map(|i| dot(axis, &corners[i]));
        heights.sort();
        heights
    });
    p[2] < q[0] || q[2] < p[0]
}

/// Returns whether two closed triangles share a point, which is the case if no direction separates them.
///
/// The differences between points of the two form a convex polytope P, and the triangles are disjoint if the origin
/// is outside of P. A face of P is parallel to two edges. If P is flat, the origin is on one side of its plane, or of
/// an edge within that plane. If P is a segment, the origin is off its line or beyond one end. If P is a point, the
/// direction to that point separates.
pub(crate) fn intersect(a: &Triangle, b: &Triangle) -> bool {
    let (a, b, _) = integers(a, b);
    let edges: Vec<_> = [&a, &b]
        .into_iter()
        .flat_map(|corners| [(0, 1), (1, 2), (2, 0)].map(|(i, j)| subtract(&corners[i], &corners[j])))
        .collect();
    let across = subtract(&a[0], &b[0]);
    let apart = |axis: &Vector| separates(&a, &b, axis);
    let pairs = (0..6).flat_map(|i| (0..i).map(move |j| (i, j)));
    let normals: Vec<_> = pairs.map(|(i, j)| cross(&edges[i], &edges[j])).collect();
    let solid = normals.iter().any(|normal| edges.iter().any(|edge| dot(normal, edge) != IBig::ZERO));
    if solid || normals.iter().any(apart) {
        return !normals.iter().any(apart);
    }
    let in_plane = normals.iter().any(|normal| edges.iter().any(|edge| apart(&cross(normal, edge))));
    let off_line = edges.iter().any(|edge| apart(&cross(&cross(edge, &across), edge)));
    !(in_plane || off_line || edges.iter().any(apart) || apart(&across))
}

/// The exact distance between two triangles.
pub(crate) struct Exact {
    /// The numerator and denominator of the squared distance, in units of 4^`exponent`.
    square: (IBig, IBig),
    exponent: i32,
}

/// Returns the exact distance between two triangles.
///
/// The distance is that of the origin from the convex hull of the nine differences between their corners. The nearest
/// point of a hull is the foot of the perpendicular on the affine hull of some affinely independent subset of at most
/// four of its points. So all subsets are tried.
pub(crate) fn distance(a: &Triangle, b: &Triangle) -> Exact {
    let (a, b, exponent) = integers(a, b);
    let gaps: Vec<Vector> = a.iter().flat_map(|p| b.iter().map(|q| subtract(q, p))).collect();
    let mut best = (dot(&gaps[0], &gaps[0]), IBig::ONE);
    for subset in (1_u32..512).filter(|subset| subset.count_ones() <= 4) {
        let mut members = (0..9).filter(|i| subset >> i & 1 == 1).map(|i| &gaps[i]);
        let base = members.next().unwrap();
        let edges: Vec<_> = members.map(|p| subtract(p, base)).collect();
        // Where there are fewer edges, rows of the identity matrix take their place.
        let entry = |i: usize, j: usize| match (edges.get(i), edges.get(j)) {
            (Some(p), Some(q)) => dot(p, q),
            _ => IBig::from(u8::from(i == j)),
        };
        let gram = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)));
        let right = [0, 1, 2].map(|i| edges.get(i).map_or(IBig::ZERO, |edge| -dot(edge, base)));
        let whole = determinant(&gram);
        if whole == IBig::ZERO {
            continue;
        }
        // Cramer's rule; the matrix is symmetric, so rows can be replaced instead of columns.
        let weights = [0, 1, 2].map(|k| {
            let mut replaced = gram.clone();
            replaced[k] = right.clone();
            determinant(&replaced)
        });
        let sum: IBig = weights.iter().sum();
        if weights.iter().all(|weight| *weight >= IBig::ZERO) && sum <= whole {
            // The foot is perpendicular to the edges, so its square is its product with the base.
            let along: IBig = weights.iter().zip(&edges).map(|(weight, edge)| weight * dot(base, edge)).sum();
            let square = &whole * dot(base, base) + along;
            if &square * &best.1 < &best.0 * &whole {
                best = (square, whole);
            }
        }
    }
    Exact { square: best, exponent }
}

impl Exact {
    /// Compares the distance with `x`.
    pub(crate) fn compare(&self, x: f64) -> Ordering {
        let (mantissa, of_x) = parts(x);
        if mantissa <= 0 {
            return if mantissa < 0 { Ordering::Greater } else { self.square.0.cmp(&IBig::ZERO) };
        }
        let mut left = self.square.0.clone();
        let mut right = IBig::from(mantissa) * IBig::from(mantissa) * &self.square.1;
        let shift = 2 * (of_x - self.exponent);
        if shift > 0 {
            right <<= shift as usize
        } else {
            left <<= -shift as usize
        }
        left.cmp(&right)
    }

    /// Returns whether the distance is `x` to within `tolerance`.
    pub(crate) fn is(&self, x: f64, tolerance: f64) -> bool {
        self.compare(x - tolerance).is_ge() && self.compare(x + tolerance).is_le()
    }
}

fn determinant(m: &[[IBig; 3]; 3]) -> IBig {
    dot(&m[0], &cross(&m[1], &m[2]))
}
