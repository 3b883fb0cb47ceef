//! The same case in the orders that must not matter: of corners, of triangles, of the two sides.

use super::shapes::Triangle;
use super::{Case, Truth};

/// A case in one order.
pub(crate) struct Ordered {
    /// Which order.
    pub(crate) name: &'static str,
    pub(crate) a: Vec<Triangle>,
    pub(crate) b: Vec<Triangle>,
    pub(crate) pose: [f64; 12],
}

impl Case {
    /// As listed; with corners turned and triangles backward; with corners backward; and with A and B swapped, if the
    /// inverse pose places corners without rounding, so that the truth is the same.
    pub(crate) fn orders(&self) -> Vec<Ordered> {
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

    /// The inverse pose, if corners of A are placed by it, and those of B by the pose, without rounding.
    fn inverse(&self) -> Option<[f64; 12]> {
        let pose = self.pose;
        let rotation = |i: usize, j: usize| pose[4 * i + j];
        let exact = (0..9).all(|k| [0.0, 1.0, -1.0].contains(&rotation(k / 3, k % 3)));
        let mut inverse = [0.0; 12];
        for i in 0..3 {
            let mut along = 0.0;
            for j in 0..3 {
                inverse[4 * i + j] = rotation(j, i);
                // One of the three is not zero, so that nothing is rounded.
                along -= rotation(j, i) * pose[4 * j + 3];
            }
            // 0 - 0 is 0, but the negative of 0 is not.
            inverse[4 * i + 3] = along + 0.0;
        }
        let placed = |side: &[Triangle], pose: &[f64; 12]| side.iter().flatten().all(|&p| is_exact(p, pose));
        (exact && placed(&self.a, &inverse) && placed(&self.b, &pose)).then_some(inverse)
    }
}

/// Whether a pose that permutes axes moves a point without rounding: by Knuth's two-sum, which says what is lost.
fn is_exact(point: [f64; 3], pose: &[f64; 12]) -> bool {
    (0..3).all(|i| {
        let turned: f64 = (0..3).map(|j| pose[4 * i + j] * point[j]).sum();
        let by = pose[4 * i + 3];
        let sum = turned + by;
        let of_by = sum - turned;
        (turned - (sum - of_by)) + (by - of_by) == 0.0
    })
}
