//! Compares `triangles_within` with the oracle, at the two neighbouring limits that the exact distance lies between.

use super::generate::{KINDS, float, grid_triangle, pair};
use crate::narrow::{Closest, Triangle, triangle_distance, triangles_within};
use cbvh_testkit::Random;
use cbvh_testkit::exact::Length;

#[track_caller]
fn check(name: &str, exact: &Length, a: &Triangle, b: &Triangle, closest: &Closest) {
    let floor = exact.floor();
    for limit in [floor, floor.next_up(), floor.next_down(), 0.0, 0.5 * floor, 2.0 * floor] {
        let (limit, context) = (limit.max(0.0), format!("{name}, {limit:e}: {a:?} {b:?} {closest:?}"));
        assert_eq!(triangles_within(a, b, closest, limit), exact.compare(limit).is_le(), "{context}");
    }
}

/// Returns bounds so wide that the integers decide about every limit.
fn unknown(t: &Triangle) -> Closest {
    Closest { distance: 0.0, lower: 0.0, upper: f64::INFINITY, point_a: t[0], point_b: t[0] }
}

#[test]
fn grid_pairs_agree_with_the_oracle() {
    // The range of integers is unlimited, so the units are 1, the smallest subnormal number, one near the smallest normal
    // number, and one whose square overflows.
    let units = [1.0, f64::from_bits(1), 2_f64.powi(-1024), 2_f64.powi(900)];
    let mut random = Random::new(31);
    for round in 0..1600 {
        let n = 2 + round % 4;
        let unit = units[random.below(4)];
        let [a, b] =
            [(); 2].map(|()| float(&grid_triangle(&mut random, n)).map(|p| p.map(|x| (x - 1.0) * unit)));
        let exact = Length::between(&a, &b);
        // The function is never asked about triangles that meet.
        if exact.compare(0.0).is_gt() {
            check("grid", &exact, &a, &b, &unknown(&a));
        }
    }
}

#[test]
fn hard_pairs_agree_with_the_oracle() {
    let mut random = Random::new(29);
    for round in 0..KINDS * 40 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        let exact = Length::between(&a, &b);
        check(name, &exact, &a, &b, &triangle_distance(&a, &b));
        if exact.compare(0.0).is_gt() {
            check(name, &exact, &a, &b, &unknown(&a));
        }
    }
}
