//! Compares the stretches of ways with exact contact at many places of them.

use super::generate::{KINDS, float, grid_triangle, pair};
use crate::narrow::{Point, Triangle, Way, stretch, triangles_intersect};
use cbvh_testkit::Random;

fn moved(triangle: &Triangle, direction: Point, at: f64) -> Triangle {
    triangle.map(|corner| [0, 1, 2].map(|k| corner[k] + at * direction[k]))
}

/// Checks that triangles are in contact where they certainly cross, and nowhere outside the stretch. Returns whether they
/// certainly cross somewhere.
#[track_caller]
fn check(name: &str, a: &Triangle, b: &Triangle, way: &Way, places: &[f64]) -> bool {
    let of = stretch(a, b, way);
    let (outer, inner) = (of.outer, of.inner);
    let crosses = inner[0] < inner[1];
    assert!(!crosses || outer[0] <= inner[0] && inner[1] <= outer[1], "{name}: {of:?}");
    let size = way.length;
    let near_ends = outer.into_iter().chain(inner).filter(|end| end.is_finite()).flat_map(|end| {
        [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-6, -1e-6, 1e-2, -1e-2].map(|step| end + step * size)
    });
    for at in near_ends.chain(places.iter().copied()).filter(|at| at.abs() <= way.length) {
        let touches = triangles_intersect(a, &moved(b, way.direction, at));
        assert!(!touches || outer[0] <= at && at <= outer[1], "{name} at {at:e}: {of:?} {a:?} {b:?} {way:?}");
        assert!(touches || at <= inner[0] || inner[1] <= at, "{name} at {at:e}: {of:?} {a:?} {b:?} {way:?}");
    }
    crosses
}

/// On a lattice, moved triangles are exact, so that nothing is charged for them.
#[test]
fn grid_pairs_touch_in_their_stretches() {
    let mut random = Random::new(17);
    let places: Vec<f64> = (-64..=64).map(|at| f64::from(at) / 8.0).collect();
    let mut crossing = 0;
    for round in 0..4000 {
        let n = 2 + round % 4;
        let [a, b] = [(); 2].map(|()| float(&grid_triangle(&mut random, n)));
        let direction = [(); 3].map(|()| (random.below(5) as f64 - 2.0) / 2.0);
        if direction == [0.0; 3] {
            continue;
        }
        let way = Way { direction, length: 8.0, error: 0.0 };
        // At its ends, moved triangles are rounded: only the lattice is asked.
        let of = stretch(&a, &b, &way);
        crossing += u32::from(of.inner[0] < of.inner[1]);
        for &place in &places {
            let touches = triangles_intersect(&a, &moved(&b, direction, place));
            assert!(
                !touches || of.outer[0] <= place && place <= of.outer[1],
                "{of:?} at {place}: {a:?} {b:?}"
            );
            assert!(
                touches || place <= of.inner[0] || of.inner[1] <= place,
                "{of:?} at {place}: {a:?} {b:?}"
            );
        }
    }
    assert!(crossing > 1000, "{crossing}");
}

#[test]
fn hard_pairs_touch_in_their_stretches() {
    let mut random = Random::new(23);
    let mut crossing = 0;
    for round in 0..KINDS * 150 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        let scale = [1.0, 2f64.powi(60), 2f64.powi(-60)][round % 3];
        let [a, b] = [a, b].map(|triangle| triangle.map(|corner| corner.map(|x| scale * x)));
        let direction = match round % 4 {
            0 => [1.0, 0.0, 0.0],
            _ => {
                let d = random.point();
                let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
                d.map(|x| x / length)
            }
        };
        // Moved corners are rounded twice.
        let way = Way { direction, length: 8.0 * scale, error: 1e-14 * scale };
        let places: Vec<f64> = (0..40).map(|_| 4.0 * scale * random.signed()).collect();
        crossing += u32::from(check(name, &a, &b, &way, &places));
    }
    assert!(crossing > KINDS as u32 * 60, "{crossing}");
}
