//! Compares the bounding spheres and boxes of two objects, which decides most queries of separated meshes.

use crate::traverse::placement::{ObjectPair, Placement};
use crate::traverse::stages::Stage;
use bvh_format::object::Object;

/// Returns a lower bound of the distance of two objects by their bounding spheres, in mesh units. It is negative if the
/// spheres overlap. Cost: a few nanoseconds.
pub(super) fn sphere_gap(placement: &Placement, a: &Object, b: &Object) -> f64 {
    let centre = |object: &Object| object.record().sphere_centre.map(|c| f64::from(c.get()));
    let (centre_a, centre_b) = (centre(a), centre(b));
    let squared: f64 = (0..3)
        .map(|i| {
            let r = &placement.rotation[i];
            let placed = r[0] * centre_b[0] + r[1] * centre_b[1] + r[2] * centre_b[2];
            (placed + placement.translation[i] - centre_a[i]).powi(2)
        })
        .sum();
    let radius = |object: &Object| f64::from(object.record().sphere_radius.get());
    let radii = radius(a) + radius(b);
    // A pose may stretch by 2^-20 and the f64 error of a placed point is charged to the radii too.
    let gap = squared.sqrt() * (1.0 - 2f64.powi(-40));
    gap - radii * (1.0 + 2f64.powi(-19)) - 3.0 * placement.error
}

/// Returns whether the bounding spheres or boxes of two objects show that the objects do not touch.
pub(super) fn surely_apart(ObjectPair { placement, object_a, object_b, .. }: &ObjectPair<'_>) -> bool {
    let _stage = Stage::Volumes.enter();
    sphere_gap(placement, object_a, object_b) > 0.0 || boxes_apart(placement, object_a, object_b)
}

/// Returns whether the bounding boxes are apart along an axis of either: the separating axis test of Gottschalk, Lin and
/// Manocha (SIGGRAPH 1996) without its nine cross products. Cost: a tenth of what it takes to prepare a walk.
fn boxes_apart(placement: &Placement, a: &Object, b: &Object) -> bool {
    let sides = |object: &Object| {
        let (lo, hi) = (object.record().box_lo, object.record().box_hi);
        [lo, hi].map(|corner| corner.map(|value| f64::from(value.get())))
    };
    apart_along_sides(placement, sides(a), sides(b))
}

/// Returns whether two boxes, each given by two corners, are apart along an axis of either.
fn apart_along_sides(placement: &Placement, a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> bool {
    let r = &placement.rotation;
    let half = |[lo, hi]: [[f64; 3]; 2]| [0, 1, 2].map(|i| (hi[i] - lo[i]) / 2.0);
    let centre = |[lo, hi]: [[f64; 3]; 2]| [0, 1, 2].map(|i| (hi[i] + lo[i]) / 2.0);
    let (half_a, half_b) = (half(a), half(b));
    let (centre_a, centre_b) = (centre(a), centre(b));
    let between = [0, 1, 2].map(|i| {
        let placed = r[i][0] * centre_b[0] + r[i][1] * centre_b[1] + r[i][2] * centre_b[2];
        placed + placement.translation[i] - centre_a[i]
    });
    // The f64 error of a placed point, and as much for each of a few roundings here.
    let error = 4.0 * placement.error;
    // A pose may be 2^-20 from orthonormal, so that B's box leans by three times as much along its own axes.
    let lean = 2f64.powi(-18) * (half_b[0] + half_b[1] + half_b[2]);
    (0..3).any(|i| {
        let reach_b = r[i][0].abs() * half_b[0] + r[i][1].abs() * half_b[1] + r[i][2].abs() * half_b[2];
        let reach_a = r[0][i].abs() * half_a[0] + r[1][i].abs() * half_a[1] + r[2][i].abs() * half_a[2];
        let along_b = r[0][i] * between[0] + r[1][i] * between[1] + r[2][i] * between[2];
        between[i].abs() > half_a[i] + reach_b + error || along_b.abs() > reach_a + half_b[i] + lean + error
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traverse::placement::POSE_ERROR;
    use cbvh_testkit::Random;

    /// Boxes that share a point are not apart, even by a rotation as far off as a pose may have; and most that have
    /// a gap between faces are.
    #[test]
    fn boxes_that_touch_are_not_apart() {
        let mut random = Random::new(3);
        let mut random = || random.signed();
        let mut found = 0;
        for round in 0..20_000 {
            let mut sides = || {
                let (p, q) = ([random(), random(), random()], [random(), random(), random()]);
                [[0, 1, 2].map(|i| p[i].min(q[i])), [0, 1, 2].map(|i| p[i].max(q[i]))]
            };
            let (a, b) = (sides(), sides());
            let (sin, cos) = (3.0 * random()).sin_cos();
            let shear = if round % 2 == 0 { 0.9e-6 } else { -0.9e-6 };
            let rotation = [[cos, -sin, shear * cos], [sin, cos, shear * sin], [0.0, 0.0, 1.0]];
            // A corner of B on a face of A, across axis 0.
            let corner = [0, 1, 2].map(|i| if random() < 0.0 { b[0][i] } else { b[1][i] });
            let up = usize::from(random() < 0.0);
            let mut point = [0, 1, 2].map(|i| a[0][i] + (a[1][i] - a[0][i]) * (random() + 1.0) / 2.0);
            point[0] = a[up][0];
            let place = |gap: f64| {
                let turned = rotation.map(|row: [f64; 3]| (0..3).map(|k| row[k] * corner[k]).sum::<f64>());
                let translation = [point[0] + gap - turned[0], point[1] - turned[1], point[2] - turned[2]];
                Placement { rotation, translation, error: 100.0 * POSE_ERROR }
            };
            assert!(!apart_along_sides(&place(0.0), a, b), "round {round}");
            // Far out along the axis: surely beyond both boxes.
            found += u32::from(apart_along_sides(&place(if up == 1 { 1e-3 } else { -1e-3 }), a, b));
            assert!(apart_along_sides(&place(if up == 1 { 10.0 } else { -10.0 }), a, b), "round {round}");
        }
        assert!(found > 2000, "{found} of 20000");
    }
}
