//! Compares what is within a distance with the oracle, at the two neighbouring limits that the exact distance lies between.

use super::generate::{KINDS, float, grid_triangle, pair};
use crate::narrow::within::ray_within;
use crate::narrow::{Closest, Point, Ray, Triangle, triangle_distance, triangles_below, triangles_within};
use cbvh_testkit::Random;
use cbvh_testkit::exact::Length;

#[track_caller]
fn check(name: &str, exact: &Length, a: &Triangle, b: &Triangle, closest: &Closest) {
    let floor = exact.floor();
    for limit in [floor, floor.next_up(), floor.next_down(), 0.0, 0.5 * floor, 2.0 * floor] {
        let (limit, context) = (limit.max(0.0), format!("{name}, {limit:e}: {a:?} {b:?} {closest:?}"));
        assert_eq!(triangles_within(a, b, closest, limit), exact.compare(limit).is_le(), "{context}");
        if limit > 0.0 {
            assert_eq!(triangles_below(a, b, closest, limit), exact.compare(limit).is_lt(), "{context}");
        }
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

/// A ray up to a parameter is the segment to its end. One without end is as near as a segment that goes on far behind the triangle.
#[test]
fn rays_agree_with_the_oracle() {
    let mut random = Random::new(37);
    let mut sides = [0; 2];
    for round in 0..1200 {
        let unit = [1.0, 2_f64.powi(-160), 2_f64.powi(90)][round % 3];
        let triangle = float(&grid_triangle(&mut random, 4)).map(|p| p.map(|x| (x - 1.0) * unit));
        let mut whole = |most: usize| (random.below(2 * most + 1) as f64) - most as f64;
        let origin = [(); 3].map(|()| unit * whole(5));
        let direction = [(); 3].map(|()| whole(2));
        if direction == [0.0; 3] {
            continue;
        }
        let until =
            if round % 4 == 0 { f64::INFINITY } else { unit * (0.25 + random.below(20) as f64 / 4.0) };
        let reach = if until == f64::INFINITY { 1024.0 * unit } else { until };
        let end: Point = [0, 1, 2].map(|k| origin[k] + reach * direction[k]);
        let exact = Length::between(&[origin, end, end], &triangle);
        // The function is never asked about a ray that crosses the triangle.
        if exact.compare(0.0).is_eq() {
            continue;
        }
        let (ray, floor) = (Ray { origin, direction }, exact.floor());
        for limit in [floor, floor.next_up(), floor.next_down(), 0.5 * floor, 2.0 * floor] {
            let is_within = exact.compare(limit).is_le();
            assert_eq!(
                ray_within(&ray, until, &triangle, limit),
                is_within,
                "{ray:?}, {until}, {triangle:?}"
            );
            sides[usize::from(is_within)] += 1;
        }
    }
    assert!(sides.iter().all(|count| *count > 500), "{sides:?}");
}
