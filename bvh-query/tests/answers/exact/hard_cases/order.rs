//! Reorders the corners, the triangles and the two sides of a case, none of which may change the answer.

use super::case::{Case, Truth};
use cbvh_testkit::Triangle;

/// A case in one order.
pub(super) struct Ordered {
    /// The name of the order.
    pub(super) name: &'static str,
    /// Mesh A.
    pub(super) a: Vec<Triangle>,
    /// Mesh B, before the pose places it.
    pub(super) b: Vec<Triangle>,
    /// The rows of the 3 by 4 matrix that places B in the frame of A.
    pub(super) pose: [f64; 12],
}

impl Case {
    /// Returns the case as listed, with corners rotated and triangles reversed, and with corners reversed. If the
    /// inverse pose places corners without rounding, so that the truth is the same, returns it also with A and B
    /// swapped.
    pub(super) fn orders(&self) -> Vec<Ordered> {
        let ordered = |name, order: [usize; 3], backward: bool| {
            let side = |triangles: &[Triangle]| {
                let mut side: Vec<_> = triangles.iter().map(|t| order.map(|k| t[k])).collect();
                if backward {
                    side.reverse();
                }
                side
            };
            Ordered { name, a: side(&self.a), b: side(&self.b), pose: self.pose }
        };
        let mut orders = vec![ordered("as listed", [0, 1, 2], false)];
        if matches!(self.truth, Truth::Refused { .. }) {
            return orders;
        }
        orders.push(ordered("corners turned, triangles backward", [1, 2, 0], true));
        orders.push(ordered("corners backward", [2, 1, 0], false));
        orders.extend(self.inverse().map(|pose| Ordered {
            name: "sides swapped",
            a: self.b.clone(),
            b: self.a.clone(),
            pose,
        }));
        orders
    }

    /// Returns the inverse pose if it places the corners of A, and the pose those of B, without rounding.
    fn inverse(&self) -> Option<[f64; 12]> {
        let pose = self.pose;
        let rotation = |i: usize, j: usize| pose[4 * i + j];
        let exact = (0..9).all(|k| [0.0, 1.0, -1.0].contains(&rotation(k / 3, k % 3)));
        let mut inverse = [0.0; 12];
        for i in 0..3 {
            let mut along = 0.0;
            for j in 0..3 {
                inverse[4 * i + j] = rotation(j, i);
                // Only one of the three terms is not zero, so nothing is rounded.
                along -= rotation(j, i) * pose[4 * j + 3];
            }
            // Adding 0 turns -0 into 0.
            inverse[4 * i + 3] = along + 0.0;
        }
        let placed = |side: &[Triangle], pose: &[f64; 12]| side.iter().flatten().all(|&p| is_exact(p, pose));
        (exact && placed(&self.a, &inverse) && placed(&self.b, &pose)).then_some(inverse)
    }
}

/// Returns whether a pose that permutes axes moves a point without rounding. Knuth's two-sum computes what is lost.
fn is_exact(point: [f64; 3], pose: &[f64; 12]) -> bool {
    (0..3).all(|i| {
        let turned: f64 = (0..3).map(|j| pose[4 * i + j] * point[j]).sum();
        let by = pose[4 * i + 3];
        let sum = turned + by;
        let of_by = sum - turned;
        (turned - (sum - of_by)) + (by - of_by) == 0.0
    })
}
