//! Rays at triangles whose corners are no numbers, which only damaged files have.

use crate::narrow::{Ray, RoundedRay};

#[test]
fn corners_that_are_not_finite_do_no_harm() {
    let numbers = [-1.0, 1.0, f64::MAX, -f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
    for origin in [[0.0; 3], [-1.0, 0.0, 0.0], [-0.75, 0.75, 0.0]] {
        for direction in [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.25, -1.5, 0.5]] {
            let ray = Ray { origin, direction };
            for first in numbers {
                for second in numbers {
                    for place in 0..36 {
                        let mut corners = [-1.0, -1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0];
                        (corners[place % 9], corners[(place + place / 9 + 1) % 9]) = (first, second);
                        let [a, b, c, d, e, f, g, h, i] = corners;
                        let triangle = [[a, b, c], [d, e, f], [g, h, i]];
                        if let Some(found) = ray.crossing(&triangle) {
                            // It can be asked about further.
                            let _ = ray.is_within(&triangle, &found, 0.5);
                            let _ = ray.compare((&triangle, &found), (&triangle, &found));
                        }
                        let _ = RoundedRay::new(&ray, &triangle, 0.5).stay(f64::INFINITY);
                    }
                }
            }
        }
    }
}
