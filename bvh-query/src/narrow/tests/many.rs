//! Compares `triangles_intersect` with the independent oracles of cbvh-testkit on many pairs that f64 can hardly
//! tell from touching, and the interval of `triangle_distance` on some of them.
//!
//! `CBVH_TEST_DEPTH` multiplies the number of pairs.

use super::generate::{KINDS, pair, shuffled};
use crate::narrow::{Point, Triangle, subtract, triangle_distance, triangles_intersect};
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::{Boxed, Decided, Length, intersect};

/// Returns a corner, a point of an edge or a point of the face, rounded.
fn point_of(t: &Triangle, random: &mut Random) -> Point {
    let [p, q, r] = shuffled(random, t);
    let (x, y) = match random.below(3) {
        0 => (0.0, 0.0),
        1 => (random.unit(), 0.0),
        _ => (random.unit() / 2.0, random.unit() / 2.0),
    };
    [0, 1, 2].map(|k| p[k] + x * (q[k] - p[k]) + y * (r[k] - p[k]))
}

/// Returns a hard pair at a random place and scale; three in four would touch if nothing were rounded.
fn close_pair(round: u64, random: &mut Random) -> (&'static str, Triangle, Triangle) {
    let (name, a, b) = pair(round as usize % KINDS, random);
    let mut b = shuffled(random, &b);
    if random.below(4) != 0 {
        let gap = subtract(point_of(&a, random), point_of(&b, random));
        b = b.map(|p| [0, 1, 2].map(|k| p[k] + gap[k]));
    }
    let scale = 2_f64.powi(random.below(160) as i32 - 80);
    let offset = if random.below(4) == 0 { random.point().map(|x| x * 1e6) } else { [0.0; 3] };
    let place = |t: Triangle| t.map(|p| [0, 1, 2].map(|k| (p[k] + offset[k]) * scale));
    let (a, mut b) = (place(a), place(b));
    if random.below(4) == 0 {
        let x = &mut b[random.below(3)][random.below(3)];
        // The neighbours of 0 are finer than the grid that the narrow phase requires.
        *x = match (*x == 0.0, random.below(2)) {
            (true, _) => 0.0,
            (false, 0) => x.next_up(),
            (false, _) => x.next_down(),
        };
    }
    (name, a, b)
}

#[test]
#[allow(clippy::print_stderr, reason = "a longer search is run for its counts")]
fn pairs_that_almost_touch_agree_with_the_exact_oracle() {
    let (mut random, mut decided, mut touching, mut lengths) =
        (Random::new(23), Decided::default(), 0_u64, 0_u64);
    let count = rounds(40_000);
    for round in 0..count {
        let (name, a, b) = close_pair(round, &mut random);
        let expected = intersect(&Boxed::new(a), &Boxed::new(b), &mut decided);
        touching += u64::from(expected);
        assert_eq!(triangles_intersect(&a, &b), expected, "{name}: {a:?} {b:?}");
        assert_eq!(triangles_intersect(&b, &a), expected, "{name}, swapped: {a:?} {b:?}");
        if round % 1024 == 0 {
            lengths += 1;
            let (exact, closest) = (Length::between(&a, &b), triangle_distance(&a, &b));
            assert_eq!(closest.distance == 0.0, expected, "{name}: {a:?} {b:?} {closest:?}");
            assert!(exact.compare(closest.lower).is_ge(), "{name}: {a:?} {b:?} {closest:?}");
            assert!(exact.compare(closest.upper).is_le(), "{name}: {a:?} {b:?} {closest:?}");
        }
    }
    let Decided { by_boxes, by_balls, by_integers } = decided;
    eprintln!(
        "narrow phase: {count} triangle pairs, {touching} in contact; oracle: {by_boxes} by boxes, {by_balls} by \
         balls, {by_integers} by integers; {lengths} intervals of a distance"
    );
}
