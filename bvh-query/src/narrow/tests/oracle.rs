//! Computes squared distances of triangles in exact arithmetic, from the definition.
//!
//! The distance of two triangles is that of the origin from the hull of the nine differences of their corners.
//! The point of this hull nearest to the origin is the foot of the perpendicular on the affine hull of some
//! affinely independent subset of at most four of the nine points. Conversely, every such foot inside its simplex
//! is a point of the hull. So all subsets are tried.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use dashu_int::IBig;

use crate::narrow::{Point, Triangle};

/// An exact integer; `i64` suffices for coordinates of a few bits.
pub(super) trait Integer:
    Clone + Ord + From<i8> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
}
impl Integer for i64 {}
impl Integer for IBig {}

/// Returns the squared distance as a numerator and a positive denominator.
pub(super) fn squared_distance<T: Integer>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> (T, T) {
    let (zero, one) = (T::from(0), T::from(1));
    let gaps: Vec<[T; 3]> = a.iter().flat_map(|p| b.iter().map(|q| subtract(q, p))).collect();
    let mut best = (dot(&gaps[0], &gaps[0]), one.clone());
    for subset in (1_u32..512).filter(|subset| subset.count_ones() <= 4) {
        if best.0 == zero {
            break;
        }
        let mut members = (0..9).filter(|i| subset >> i & 1 == 1).map(|i| &gaps[i]);
        let base = members.next().unwrap();
        // Missing edges are zero; their rows of the Gram matrix are those of the identity.
        let edges = [0; 3].map(|_| members.next().map(|p| subtract(p, base)));
        let mut gram = [0, 1, 2].map(|i| [0, 1, 2].map(|j| T::from(i8::from(i == j))));
        let mut right = [0; 3].map(|_| zero.clone());
        for (i, p) in edges.iter().enumerate().filter_map(|(i, p)| Some((i, p.as_ref()?))) {
            right[i] = -dot(p, base);
            for (j, q) in edges.iter().enumerate().filter_map(|(j, q)| Some((j, q.as_ref()?))) {
                gram[i][j] = dot(p, q);
            }
        }
        let whole = determinant(&gram);
        if whole == zero {
            continue;
        }
        // Cramer's rule; the matrix is symmetric, so rows can be replaced instead of columns.
        let weights = [0, 1, 2].map(|k| {
            let mut replaced = gram.clone();
            replaced[k] = right.clone();
            determinant(&replaced)
        });
        let sum = weights.iter().cloned().fold(zero.clone(), |sum, weight| sum + weight);
        if weights.iter().all(|weight| *weight >= zero) && sum <= whole {
            // The foot is perpendicular to the edges, so its square is its product with the base.
            let mut square = whole.clone() * dot(base, base);
            for (weight, edge) in weights.iter().zip(&edges).filter_map(|(w, e)| Some((w, e.as_ref()?))) {
                square = square + weight.clone() * dot(base, edge);
            }
            if square.clone() * best.1.clone() < best.0.clone() * whole.clone() {
                best = (square, whole);
            }
        }
    }
    best
}

fn subtract<T: Integer>(p: &[T; 3], q: &[T; 3]) -> [T; 3] {
    [0, 1, 2].map(|k| p[k].clone() - q[k].clone())
}

fn dot<T: Integer>(p: &[T; 3], q: &[T; 3]) -> T {
    let [x, y, z] = [0, 1, 2].map(|k| p[k].clone() * q[k].clone());
    x + y + z
}

fn determinant<T: Integer>(m: &[[T; 3]; 3]) -> T {
    let minor = |i: usize, j: usize| m[1][i].clone() * m[2][j].clone() - m[1][j].clone() * m[2][i].clone();
    m[0][0].clone() * minor(1, 2) - m[0][1].clone() * minor(0, 2) + m[0][2].clone() * minor(0, 1)
}

/// The exact squared distance of two triangles of f64, `numerator / denominator * 4^exponent`.
pub(super) struct Exact {
    pub(super) numerator: IBig,
    denominator: IBig,
    exponent: i32,
}

impl Exact {
    pub(super) fn new(a: &Triangle, b: &Triangle) -> Self {
        let lowest = a.iter().chain(b).flatten().map(|x| parts(*x).1).min().unwrap();
        let integer = |x: f64| {
            let (mantissa, exponent) = parts(x);
            if mantissa == 0 { IBig::ZERO } else { IBig::from(mantissa) << (exponent - lowest) as usize }
        };
        let integers = |t: &Triangle| t.map(|p| p.map(integer));
        let (numerator, denominator) = squared_distance(&integers(a), &integers(b));
        Self { numerator, denominator, exponent: lowest }
    }

    /// Compares the distance (not its square) with `x`.
    pub(super) fn compare(&self, x: f64) -> Ordering {
        if x < 0.0 {
            return Ordering::Greater;
        }
        let (mantissa, exponent) = parts(x);
        let (mut left, mut right) =
            (self.numerator.clone(), IBig::from(mantissa) * IBig::from(mantissa) * &self.denominator);
        if mantissa != 0 {
            let shift = 2 * (exponent - self.exponent);
            if shift > 0 { right <<= shift as usize } else { left <<= -shift as usize }
        }
        left.cmp(&right)
    }
}

/// Returns mantissa and exponent; the exponent of 0 is so high that it is never the lowest.
fn parts(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let field = (bits >> 52 & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let mantissa = if field == 0 { fraction } else { fraction | 1 << 52 };
    let zeros = mantissa.trailing_zeros() as i32;
    if mantissa == 0 {
        return (0, i32::MAX / 4);
    }
    let mantissa = mantissa >> zeros;
    (if x < 0.0 { -mantissa } else { mantissa }, field.max(1) - 1075 + zeros)
}

#[test]
fn the_oracle_knows_simple_distances() {
    let a = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let above = |z: f64| [[1.0, 1.0, z], [1.0, 1.0, z + 1.0], [2.0, 1.0, z + 5.0]];
    assert!(Exact::new(&a, &above(0.75)).compare(0.75).is_eq());
    assert!(Exact::new(&a, &above(0.0)).compare(0.0).is_eq());
    assert!(Exact::new(&a, &above(-0.5)).compare(0.0).is_eq());
    assert!(Exact::new(&a, &[[7.0, 0.0, 4.0]; 3]).compare(5.0).is_eq());
    assert!(Exact::new(&[[0.0; 3]; 3], &[[3e-300, 4e-300, 0.0]; 3]).compare(4.99e-300).is_gt());
    assert!(Exact::new(&[[0.0; 3]; 3], &[[3e-300, 4e-300, 0.0]; 3]).compare(5.01e-300).is_lt());
}

/// Returns the triangle whose three corners are the point.
pub(super) fn dot_triangle(point: Point) -> Triangle {
    [point; 3]
}
