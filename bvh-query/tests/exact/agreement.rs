//! Compares the oracles with each other: three that say whether triangles meet, and three that say how far apart they
//! are.

use super::ball::Ball;
use super::decide::{Boxed, Decided, Triangle, certainly_farther, intersect};
use super::features::squared_distance;
use super::length::Length;
use super::meet::meet;
use super::number::Corners;
use super::separation::widest;
use crate::common::{Random, exact};
use cbvh_testkit::depth::rounds;
use proptest::prelude::*;

/// Returns a triangle on a small grid, where triangles often have equal corners, parallel edges and common planes.
fn lattice(most: i64) -> impl Strategy<Value = Corners<i64>> {
    prop::array::uniform3(prop::array::uniform3(-most..=most))
}

fn floats(t: &Corners<i64>, scale: f64) -> Triangle {
    t.map(|p| p.map(|x| x as f64 * scale))
}

/// Asserts that all oracles agree, on integers, on f64 at some scale, and with the oracles in `common`.
fn agree(a: &Corners<i64>, b: &Corners<i64>, scale: f64) {
    let wide = |t: &Corners<i64>| t.map(|p| p.map(i128::from));
    let touching = meet(a, b).unwrap();
    let square = squared_distance(&wide(a), &wide(b), &[0, 1]).unwrap();
    let proof = widest(&wide(a), &wide(b), &0).unwrap_or((0, 1));
    assert_eq!(touching, square.0 == 0, "{a:?} {b:?}");
    assert_eq!(square.0 * proof.1, proof.0 * square.1, "{a:?} {b:?}");

    let (float_a, float_b) = (floats(a, scale), floats(b, scale));
    let boxed = (Boxed::new(float_a), Boxed::new(float_b));
    assert_eq!(intersect(&boxed.0, &boxed.1, &mut Decided::default()), touching, "{a:?} {b:?}");
    let balls = |t: Triangle| t.map(|p| p.map(Ball::exactly));
    assert!(meet(&balls(float_a), &balls(float_b)).is_none_or(|answer| answer == touching), "{a:?} {b:?}");
    assert_eq!(exact::intersect(&float_a, &float_b), touching, "{a:?} {b:?}");

    let length = Length::between(&float_a, &float_b);
    let floor = length.floor();
    let other = exact::distance(&float_a, &float_b);
    assert!(other.compare(floor).is_ge() && other.compare(floor.next_up()).is_lt(), "{a:?} {b:?}");
    assert!(length.compare(floor).is_ge() && length.compare(floor.next_up()).is_lt(), "{a:?} {b:?}");
    assert!(!certainly_farther(&boxed.0, &boxed.1, floor.next_up()), "{a:?} {b:?}");
    // Balls are off by less than 2^-40 of the square, for numbers of a few bits.
    assert!(floor == 0.0 || certainly_farther(&boxed.0, &boxed.1, floor * (1.0 - 1e-9)), "{a:?} {b:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: rounds(200) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn on_a_grid_of_three(a in lattice(1), b in lattice(1)) {
        agree(&a, &b, 1.0);
    }

    #[test]
    fn on_a_grid_of_nine(a in lattice(4), b in lattice(4)) {
        agree(&a, &b, 0.125);
    }

    #[test]
    fn on_a_grid_of_some_bits(a in lattice(100), b in lattice(100), exponent in -149..100) {
        agree(&a, &b, 2f64.powi(exponent));
    }
}

/// Points, segments and slivers, with their corners in any order.
#[test]
fn degenerate_triangles() {
    let mut random = Random::new(1);
    for _ in 0..rounds(300) {
        let mut corner = |spread: usize| [(); 3].map(|()| random.below(spread) as i64);
        let points = [corner(3), corner(3), corner(4)];
        let pick = |random: &mut Random| [(); 3].map(|()| points[random.below(3)]);
        let (a, b) = (pick(&mut random), pick(&mut random));
        agree(&a, &b, 1.0);
        let middle = [0, 1, 2].map(|k| points[0][k] + points[1][k]);
        let doubled = a.map(|p| p.map(|x| 2 * x));
        agree(&doubled, &[middle; 3], 1.0);
        agree(&[middle, doubled[1], middle], &b, 0.5);
    }
}

#[test]
fn known_distances() {
    let face = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    for (other, distance) in [
        ([[1.0, 1.0, 3.0], [1.0, 1.0, 4.0], [2.0, 1.0, 4.0]], 3.0),
        ([[7.0, 0.0, 4.0]; 3], 5.0),
        ([[2.0, -3.0, 4.0]; 3], 5.0),
        ([[2.0, -2.0, -1.0], [2.0, -2.0, 1.0], [2.0, -9.0, 0.0]], 2.0),
        ([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 1.0]], 0.0),
        ([[2.0, 2.0, 0.0], [3.0, 3.0, 1.0], [4.0, 3.0, 1.0]], 0.0),
    ] {
        assert!(Length::between(&face, &other).compare(distance).is_eq(), "{other:?}");
        let touching = intersect(&Boxed::new(face), &Boxed::new(other), &mut Decided::default());
        assert_eq!(touching, distance == 0.0, "{other:?}");
    }
}
