//! Vectors and matrices, as far as bounds of paths need them.

pub(super) type Matrix = [[f64; 3]; 3];

pub(super) use bvh_format::vec3::length;

/// The Frobenius norm, which is no less than the operator's.
pub(super) fn norm(matrix: &Matrix) -> f64 {
    matrix.as_flattened().iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub(super) fn difference(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] - b[i][j]))
}

pub(super) fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}
