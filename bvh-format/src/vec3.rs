//! Vectors of three `f64` numbers. Each operation is rounded to nearest, from left to right, and none is fused, so that every machine
//! finds the same bits.

/// A point or a vector.
pub type Vec3 = [f64; 3];

/// Returns `p - q`.
#[inline(always)]
pub fn subtract(p: Vec3, q: Vec3) -> Vec3 {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

/// Returns the scalar product.
#[inline(always)]
pub fn dot(p: Vec3, q: Vec3) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// Returns the vector product.
#[inline(always)]
pub fn cross(p: Vec3, q: Vec3) -> Vec3 {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// Returns the length. Squares of numbers below 2^-511 and above 2^511 leave the range of `f64`.
#[inline(always)]
pub fn length(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}
