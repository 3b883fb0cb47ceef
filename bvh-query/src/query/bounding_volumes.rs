//! Compares the bounding spheres and boxes of two objects, which decides most queries of separated meshes.

use crate::numerics::SLACK;
use crate::traverse::placement::{ObjectPair, Placement};
use bvh_format::object::Object;

/// Returns a lower bound of the distance of two objects by their bounding spheres, in mesh units. It is negative if the
/// spheres overlap. Cost: a few nanoseconds.
pub(super) fn sphere_gap(placement: &Placement, a: &Object, b: &Object) -> f64 {
    let (squared, radii, error) = spheres(placement, a, b);
    squared.sqrt() * (1.0 - SLACK) - radii - error
}

/// Returns whether the bounding spheres or boxes of two objects show that the objects do not touch.
pub(super) fn surely_apart(ObjectPair { placement, object_a, object_b, .. }: &ObjectPair<'_>) -> bool {
    spheres_apart(placement, object_a, object_b) || boxes_apart(placement, object_a, object_b)
}

/// Returns whether [`sphere_gap`] is positive, but for roundings, without its root.
fn spheres_apart(placement: &Placement, a: &Object, b: &Object) -> bool {
    let (squared, radii, error) = spheres(placement, a, b);
    // Squares that are as small as that are not rounded by a part of themselves.
    squared > 2f64.powi(-900) && squared * (1.0 - 4.0 * SLACK) > (radii + error) * (radii + error)
}

/// Returns the square of how far apart the middles of two bounding spheres are, the sum of their radii, as a pose may stretch it by
/// 2^-20, and the f64 error of a placed point.
#[inline(always)]
fn spheres(placement: &Placement, a: &Object, b: &Object) -> (f64, f64, f64) {
    let (a, b) = (a.volumes(), b.volumes());
    let [x, y, z] = between(placement, a.sphere_centre, b.sphere_centre);
    let radii = a.sphere_radius + b.sphere_radius;
    (x * x + y * y + z * z, radii * (1.0 + 2f64.powi(-19)), 3.0 * placement.error)
}

/// Returns whether the bounding boxes are apart along an axis of either: the separating axis test of Gottschalk, Lin and
/// Manocha (SIGGRAPH 1996) without its nine cross products. Cost: a tenth of what it takes to prepare a walk.
fn boxes_apart(placement: &Placement, a: &Object, b: &Object) -> bool {
    let sides = |object: &Object| (object.volumes().box_centre, object.volumes().half_sides);
    apart_along_sides(placement, sides(a), sides(b))
}

/// Returns the way from a point of A to a point of B.
#[inline(always)]
fn between(placement: &Placement, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let placed = placement.place(b);
    [placed[0] - a[0], placed[1] - a[1], placed[2] - a[2]]
}

/// Returns whether two boxes, each given by its centre and half its sides, are apart along an axis of either.
fn apart_along_sides(
    placement: &Placement,
    (centre_a, half_a): ([f64; 3], [f64; 3]),
    (centre_b, half_b): ([f64; 3], [f64; 3]),
) -> bool {
    let r = &placement.rotation;
    let between = between(placement, centre_a, centre_b);
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
    use crate::numerics::POSE_ERROR;
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
            let half = |x: f64, y: f64| (x + y) / 2.0;
            let around = |[lo, hi]: [[f64; 3]; 2]| {
                ([0, 1, 2].map(|i| half(lo[i], hi[i])), [0, 1, 2].map(|i| half(hi[i], -lo[i])))
            };
            let apart = |gap: f64| apart_along_sides(&place(gap), around(a), around(b));
            assert!(!apart(0.0), "round {round}");
            // Far out along the axis: surely beyond both boxes.
            found += u32::from(apart(if up == 1 { 1e-3 } else { -1e-3 }));
            assert!(apart(if up == 1 { 10.0 } else { -10.0 }), "round {round}");
        }
        assert!(found > 2000, "{found} of 20000");
    }
}
