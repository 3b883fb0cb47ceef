//! Compares the oracles with each other: those that say whether triangles meet, and those that say how far apart they are.

use super::separation::widest;
use super::*;
use crate::depth::rounds;
use crate::{Random, Triangle};

/// Returns a triangle on a small grid, where triangles often have equal corners, parallel edges and common planes.
fn lattice(random: &mut Random, most: usize) -> Corners<i64> {
    [(); 3].map(|()| [(); 3].map(|()| random.below(2 * most + 1) as i64 - most as i64))
}

fn floats(t: &Corners<i64>, scale: f64) -> Triangle {
    t.map(|p| p.map(|x| x as f64 * scale))
}

/// Asserts that all oracles agree, on integers, on balls and on f64 at some scale.
fn agree(a: &Corners<i64>, b: &Corners<i64>, scale: f64) {
    let wide = |t: &Corners<i64>| t.map(|p| p.map(I256::from));
    let touching = meet(a, b).unwrap();
    let square = squared_distance(&wide(a), &wide(b), &[I256::ZERO, I256::ONE]).unwrap();
    let proof = widest(&wide(a), &wide(b), &I256::ZERO).unwrap_or((I256::ZERO, I256::ONE));
    assert_eq!(touching, square.0 == I256::ZERO, "{a:?} {b:?}");
    assert_eq!(square.0 * proof.1, proof.0 * square.1, "{a:?} {b:?}");

    let (float_a, float_b) = (floats(a, scale), floats(b, scale));
    let boxed = (Boxed::new(float_a), Boxed::new(float_b));
    assert_eq!(intersect(&boxed.0, &boxed.1, &mut Decided::default()), touching, "{a:?} {b:?}");
    let balls = |t: Triangle| t.map(|p| p.map(Ball::exactly));
    assert!(meet(&balls(float_a), &balls(float_b)).is_none_or(|answer| answer == touching), "{a:?} {b:?}");

    let length = Length::between(&float_a, &float_b);
    let floor = length.floor();
    assert!(length.compare(floor).is_ge() && length.compare(floor.next_up()).is_lt(), "{a:?} {b:?}");
    assert!(!certainly_farther(&boxed.0, &boxed.1, floor.next_up()), "{a:?} {b:?}");
    // Balls are off by less than 2^-40 of the square, for numbers of a few bits.
    assert!(floor == 0.0 || certainly_farther(&boxed.0, &boxed.1, floor * (1.0 - 1e-9)), "{a:?} {b:?}");
}

#[test]
fn triangles_on_small_grids() {
    let mut random = Random::new(2);
    for _ in 0..rounds(200) {
        for (most, exponent) in [(1, 0), (4, -3), (100, random.below(249) as i32 - 149)] {
            let [a, b] = [(); 2].map(|()| lattice(&mut random, most));
            agree(&a, &b, 2f64.powi(exponent));
        }
    }
}

/// Integers of a fixed width decide as dyadic numbers do, up to the limit of their width and beyond.
#[test]
fn large_integers_do_not_overflow() {
    let most = ((1i64 << 53) - 1) as f64 * 128.0;
    let corners = [[most, most, -most], [-most, most, most], [most, -most, most]];
    for step in [128.0, 0.5] {
        // In parallel planes, whose x + y + z differ by a step.
        let shifted = corners.map(|p| p.map(|x| if x < 0.0 { x + step } else { x }));
        let tilted = [shifted[0], shifted[1], [most, -most, most - 2.0 * step]];
        for (a, b) in [(corners, shifted), (corners, corners), (corners, tilted), (tilted, shifted)] {
            let exact = [a, b].map(|t| t.map(|p| p.map(Dyadic::of)));
            let mut decided = Decided::default();
            let found = intersect(&Boxed::new(a), &Boxed::new(b), &mut decided);
            assert_eq!(Some(found), meet(&exact[0], &exact[1]), "{a:?} {b:?}");
        }
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
