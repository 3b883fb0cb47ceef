//! Compares `triangle_distance` with the oracle: value, bounds and witness points.

use super::generate::{KINDS, float, grid_triangle, pair, shuffled, small};
use crate::isa::{Backend, Isa, Task};
use crate::narrow::{
    Closest, Point, Triangle, add_scaled, point_distance, subtract, triangle_distance,
    triangle_distance_with, triangles_intersect,
};
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::Length;

/// The largest error allowed, as a fraction of the largest difference of two coordinates.
const TOLERANCE: f64 = 1e-14;

fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// The distance of two triangles, and that of the first corner of the second one, with the registers of a backend.
struct Distances<'a>(&'a Triangle, &'a Triangle);

impl Task for Distances<'_> {
    type Output = [Closest; 2];

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> [Closest; 2] {
        let Self(a, b) = self;
        [triangle_distance_with(isa, a, b), point_distance(isa, a, b[0])]
    }
}

/// Returns the distances, which are the same on every backend.
#[track_caller]
fn on_all_backends(a: &Triangle, b: &Triangle) -> [Closest; 2] {
    let expected = Backend::Scalar.run(Distances(a, b));
    for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
        assert_eq!(backend.run(Distances(a, b)), expected, "{backend}: {a:?} {b:?}");
    }
    expected
}

#[track_caller]
fn check(name: &str, a: &Triangle, b: &Triangle) -> Closest {
    let exact = Length::between(a, b);
    let [closest, _] = on_all_backends(a, b);
    assert_eq!(closest, triangle_distance(a, b));
    let Closest { distance, lower, upper, point_a, point_b } = closest;
    let context = format!("{name}: {a:?} {b:?} {closest:?}");

    let size = largest(a.iter().chain(b).flat_map(|p| [0, 1, 2].map(|k| p[k] - a[0][k])));
    let ulp = largest(a.iter().chain(b).flatten().copied()) * f64::EPSILON;
    assert!(0.0 <= lower && lower <= distance && distance <= upper, "{context}");
    assert!(exact.compare(lower).is_ge(), "lower: {context}");
    assert!(exact.compare(upper).is_le(), "upper: {context}");
    assert!(exact.compare(distance - TOLERANCE * size).is_ge(), "too far: {context}");
    assert!(exact.compare(distance + TOLERANCE * size).is_le(), "too near: {context}");
    assert!(upper - distance <= TOLERANCE * size + f64::MIN_POSITIVE, "{context}");
    assert!(distance - lower <= TOLERANCE * size + f64::MIN_POSITIVE, "{context}");
    assert_eq!(distance == 0.0, exact.compare(0.0).is_eq(), "{context}");
    assert_eq!(distance == 0.0, triangles_intersect(a, b), "{context}");

    for (triangle, point) in [(a, point_a), (b, point_b)] {
        let off = Length::between(triangle, &[point; 3]);
        assert!(off.compare(2.0 * ulp + TOLERANCE * size).is_le(), "witness point: {context}");
    }
    if distance == 0.0 {
        assert_eq!(point_a, point_b, "{context}");
    } else {
        let between = length(&point_a, &point_b);
        assert!((between - distance).abs() <= 4.0 * ulp + TOLERANCE * size, "{between} {context}");
    }
    closest
}

fn length(p: &Point, q: &Point) -> f64 {
    let size = largest([0, 1, 2].map(|k| q[k] - p[k]));
    if size == 0.0 {
        0.0
    } else {
        size * [0, 1, 2].map(|k| ((q[k] - p[k]) / size).powi(2)).iter().sum::<f64>().sqrt()
    }
}

#[test]
fn grid_pairs_agree_with_the_oracle() {
    for (n, rounds) in [(2, 100), (3, 200), (5, 300)] {
        let mut random = Random::new(n as u64);
        for _ in 0..rounds {
            let (a, b) = (grid_triangle(&mut random, n), grid_triangle(&mut random, n));
            check("grid", &float(&a), &float(&b));
        }
    }
}

#[test]
fn grid_pairs_at_the_ends_of_the_range_agree_with_the_oracle() {
    // Multiples of 2^-296, and coordinates of 2^125.
    for unit in [2_f64.powi(-296), 2_f64.powi(123)] {
        let mut random = Random::new(41);
        for _ in 0..200 {
            let [a, b] = [(); 2].map(|()| float(&grid_triangle(&mut random, 5)).map(|p| p.map(|x| x * unit)));
            check("end of the range", &a, &b);
        }
    }
}

#[test]
fn hard_pairs_agree_with_the_oracle() {
    let mut random = Random::new(11);
    for round in 0..KINDS * 40 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        check(name, &shuffled(&mut random, &a), &shuffled(&mut random, &b));
    }
}

#[test]
fn hard_pairs_of_any_scale_agree_with_the_oracle() {
    let mut random = Random::new(13);
    for round in 0..KINDS * 20 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        let scale = 2_f64.powi(random.below(201) as i32 - 100);
        let scaled = |t: Triangle| t.map(|p| p.map(|x| x * scale));
        check(name, &scaled(a), &scaled(b));
    }
}

#[test]
fn a_common_offset_costs_no_accuracy() {
    let mut random = Random::new(17);
    for round in 0..KINDS * 20 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        // The rounded corners are the input, and their distance is as accurate as near the origin.
        let offset = random.point().map(|x| x * 1e10);
        let moved = |t: Triangle| t.map(|p| [0, 1, 2].map(|k| p[k] + offset[k]));
        check(name, &moved(a), &moved(b));
    }
}

#[test]
fn the_distance_scales_with_a_power_of_two() {
    let mut random = Random::new(19);
    for round in 0..KINDS * 200 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        let scale = 2_f64.powi(random.below(301) as i32 - 190);
        let scaled = |t: Triangle| t.map(|p| p.map(|x| x * scale));
        let (plain, large) = (triangle_distance(&a, &b), triangle_distance(&scaled(a), &scaled(b)));
        if plain.distance > f64::MIN_POSITIVE {
            assert_eq!(plain.distance * scale, large.distance, "{name}: {a:?} {b:?} {scale:e}");
            assert_eq!(plain.lower * scale, large.lower, "{name}: {a:?} {b:?} {scale:e}");
        }
    }
}

#[test]
fn small_gaps_keep_a_positive_lower_bound() {
    for exponent in -40..0 {
        let gap = 2_f64.powi(exponent);
        let a = [[0.0; 3], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]];
        let over = [[0.25, 0.25, 0.1875 + gap], [1.25, 0.25, 0.4375 + gap], [0.25, 1.25, 0.6875 + gap]];
        let closest = check("parallel faces", &a, &over);
        assert!(closest.lower > 0.9 * closest.distance && closest.distance > 0.8 * gap, "{closest:?}");
        let edge = [[-0.5, -1.0, -gap], [1.5, 1.0, -gap], [0.5, 0.0, -1.0]];
        let closest = check("crossing edges", &[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 1.0]], &edge);
        assert!(closest.lower > 0.9 * closest.distance && closest.distance > 0.8 * gap, "{closest:?}");
    }
}

#[test]
fn simple_distances_are_exact() {
    let a = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let distance = |b: &Triangle| check("simple", &a, b).distance;
    assert_eq!(distance(&[[1.0, 1.0, 3.0], [1.0, 1.0, 4.0], [2.0, 1.0, 4.0]]), 3.0); // corner and face
    assert_eq!(distance(&[[7.0, 0.0, 4.0]; 3]), 5.0); // corners
    assert_eq!(distance(&[[2.0, -3.0, 4.0]; 3]), 5.0); // corner and edge
    assert_eq!(distance(&[[2.0, -3.0, 0.0], [2.0, -3.0, 9.0], [2.0, -9.0, 0.0]]), 3.0);
    assert_eq!(distance(&[[2.0, -2.0, -1.0], [2.0, -2.0, 1.0], [2.0, -9.0, 0.0]]), 2.0); // edges
    assert_eq!(distance(&[[2.0, -2.0, -1.0], [2.0, -2.0, 1.0], [2.0, -2.0, 1.0]]), 2.0); // edge and segment
    assert_eq!(distance(&[[-3.0, 0.0, 0.0], [-3.0, 4.0, 0.0], [-9.0, 0.0, 0.0]]), 3.0); // coplanar
    assert_eq!(distance(&[[0.0, 0.0, 2.0], [4.0, 0.0, 2.0], [0.0, 4.0, 2.0]]), 2.0); // parallel
    assert_eq!(distance(&[[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.5, 0.0]]), 0.0); // nested
    let points = check("points", &[[1.0; 3]; 3], &[[1.0, 4.0, 5.0]; 3]);
    assert_eq!((points.distance, points.point_a, points.point_b), (5.0, [1.0; 3], [1.0, 4.0, 5.0]));
    assert_eq!(check("one point", &[[1.0; 3]; 3], &[[1.0; 3]; 3]).distance, 0.0);
}

#[test]
fn crossing_triangles_share_their_witness_point() {
    let a = [[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]];
    let closest = check("pierced", &a, &[[0.25, 0.5, -1.0], [0.25, 0.5, 1.0], [9.0, 9.0, 0.5]]);
    assert_eq!((closest.distance, closest.point_a), (0.0, [0.25, 0.5, 0.0]));
}

#[test]
fn of_equal_distances_the_first_pair_of_corners_is_named() {
    let a = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let over = a.map(|[x, y, _]| [x, y, 2.0]);
    for turn in 0..3 {
        let (mut a, mut over) = (a, over);
        a.rotate_left(turn);
        over.rotate_left(turn);
        let closest = check("parallel", &a, &over);
        assert_eq!((closest.point_a, closest.point_b), (a[0], over[0]));
    }
}

/// Random points, corners, and points of edges and faces or a little off them, for triangles of any kind and scale.
#[test]
fn a_point_has_the_bits_of_a_triangle_that_is_a_point() {
    let random = &mut Random::new(77);
    let (mut on, mut all) = (0, 0);
    for round in 0..rounds(20_000) {
        let (name, t, other) = pair(round as usize % KINDS, random);
        let scale = [1.0, 2f64.powi(-100), 2f64.powi(90)][random.below(3)];
        // Coarse coordinates make points that are exactly on edges and faces.
        let coarse = if random.below(2) == 0 { 4.0 } else { 2f64.powi(40) };
        let t = t.map(|p| p.map(|x| (x * coarse).round() / coarse * scale));
        let along = |p: Point, share: f64, q: Point| add_scaled(p, share, subtract(q, p));
        let share = [random.below(5) as f64 / 4.0, random.unit()][random.below(2)];
        let on_edge = along(t[0], share, t[1]);
        let near = add_scaled(on_edge, small(random, 17.0) * scale, random.point());
        let inside = along(on_edge, [0.25, random.unit()][random.below(2)], t[2]);
        for point in [other[0].map(|x| x * scale), t[random.below(3)], on_edge, near, inside] {
            let [expected, found] = on_all_backends(&t, &[point; 3]);
            assert_eq!(found, expected, "{name}: {t:?} {point:?}");
            on += u32::from(found.distance == 0.0);
            all += 1;
        }
    }
    assert!(on > all / 10 && on < all / 2, "{on} of {all}");
}
