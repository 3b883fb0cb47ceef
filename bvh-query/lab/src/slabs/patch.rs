//! The two directions in which the triangles below a node may be thin: their mean normal and their least principal axis.

use super::vector::{Vector, cross, minus, plus, times};
use crate::tree::{Node, Tree};

/// Sweeps over the three pairs of axes. Jacobi's method converges quadratically, and five are usually enough.
const SWEEPS: usize = 12;

/// The triangles below a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// The sum of normals, weighted by area. Of arbitrary length.
    pub(super) normal: Vector,
    /// The direction in which the corners vary least, of length 1.
    pub(super) axis: Vector,
}

impl Patch {
    /// Returns the patches of all nodes.
    pub(super) fn of_tree(tree: &Tree) -> Vec<Self> {
        tree.nodes.iter().map(|node| Self::of_node(tree, node)).collect()
    }

    fn of_node(tree: &Tree, node: &Node) -> Self {
        let triangles = tree.corners_below(node).iter().map(|triangle| triangle.map(|p| p.map(f64::from)));
        let (mut normal, mut sum) = ([0.0; 3], [0.0; 3]);
        for [a, b, c] in triangles.clone() {
            normal = plus(normal, cross(minus(b, a), minus(c, a)));
            sum = plus(sum, plus(a, plus(b, c)));
        }
        let mean = times(sum, 1.0 / (3.0 * f64::from(node.below.max(1))));
        let mut moments = [[0.0; 3]; 3];
        for corner in triangles.flatten() {
            let d = minus(corner, mean);
            for (row, factor) in moments.iter_mut().zip(d) {
                *row = plus(*row, times(d, factor));
            }
        }
        Self { normal, axis: least_axis(moments) }
    }
}

/// Returns the eigenvector of the least eigenvalue of a symmetric matrix, by Jacobi rotations.
fn least_axis(mut m: [[f64; 3]; 3]) -> Vector {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * SWEEPS) {
        if m[p][q] == 0.0 {
            continue;
        }
        let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
        let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let cosine = 1.0 / tangent.hypot(1.0);
        let sine = tangent * cosine;
        let turn = |x: f64, y: f64| [cosine * x - sine * y, sine * x + cosine * y];
        for row in &mut m {
            [row[p], row[q]] = turn(row[p], row[q]);
        }
        for k in 0..3 {
            [m[p][k], m[q][k]] = turn(m[p][k], m[q][k]);
        }
        for row in &mut axes {
            [row[p], row[q]] = turn(row[p], row[q]);
        }
    }
    let least = (0..3).min_by(|&i, &j| m[i][i].total_cmp(&m[j][j])).unwrap_or(2);
    axes.map(|row| row[least])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slabs::vector::dot;

    #[test]
    fn the_least_axis_of_a_turned_ellipsoid_is_its_shortest() {
        let random = &mut cbvh_measure::poses::Random::default();
        for _ in 0..100 {
            let axes = random.rotation();
            let moments = [0, 1, 2].map(|i| {
                [0, 1, 2].map(|j| (0..3).map(|k| [9.0, 0.5, 4.0][k] * axes[k][i] * axes[k][j]).sum::<f64>())
            });
            assert!(dot(least_axis(moments), axes[1]).abs() > 1.0 - 1e-12);
        }
    }
}
