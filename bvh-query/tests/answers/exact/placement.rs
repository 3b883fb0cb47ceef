//! Checks that a placed corner is what `Pose` says it is, and how far that is from R x + t.
//!
//! A stored coordinate is origin + v without rounding. A placed one is `((R0 x + R1 y) + R2 z) + t`, where each
//! product and each sum is rounded to nearest, ties to even. The tests recompute both in integers.

use super::kinds::turn;
use crate::common::{Random, bake, mesh, options};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::Pose;
use cbvh_testkit::exact::{Dyadic, Number};
use cbvh_testkit::stored::stored;

/// Returns whether `x` is an exact number, rounded to nearest, ties to even: no farther away than half way to a neighbour,
/// and half way only with an even mantissa.
fn rounds_to(exact: &Dyadic, x: f64) -> bool {
    let twice = exact.plus(exact);
    let half_way = |neighbour: f64| Dyadic::of(x).plus(&Dyadic::of(neighbour));
    let (below, above) = (twice.cmp(&half_way(x.next_down())), twice.cmp(&half_way(x.next_up())));
    let even = x.to_bits() & 1 == 0;
    (below.is_gt() || (even && below.is_eq())) && (above.is_lt() || (even && above.is_eq()))
}

/// Computes the four steps exactly and rounds after each. Panics if `place` rounded otherwise.
fn check_place(pose: &Pose, point: [f64; 3]) {
    let (placed, translation) = (pose.place(point), pose.translation());
    for k in 0..3 {
        let row = pose.rotation()[k];
        let mut sum = 0.0;
        for (j, (factor, x)) in row.into_iter().zip(point).enumerate() {
            let product = factor * x;
            assert!(rounds_to(&Dyadic::of(factor).times(&Dyadic::of(x)), product), "{factor:e} {x:e}");
            let before = sum;
            sum = if j == 0 { product } else { sum + product };
            assert!(j == 0 || rounds_to(&Dyadic::of(before).plus(&Dyadic::of(product)), sum));
        }
        assert!(
            rounds_to(&Dyadic::of(sum).plus(&Dyadic::of(translation[k])), placed[k]),
            "{pose:?} {point:?}"
        );

        // With u = 2^-53, a product passes at most four roundings and t passes one. The result is off by at most 4u
        // of the sum of the magnitudes, and a small second-order term. An underflow adds less than one subnormal
        // number each.
        let terms = [0, 1, 2].map(|j| Dyadic::of(row[j]).times(&Dyadic::of(point[j])));
        let all = [&terms[0], &terms[1], &terms[2], &Dyadic::of(translation[k])];
        let sum_of = |terms: [Dyadic; 4]| terms.iter().fold(Dyadic::ZERO, |sum, term| sum.plus(term));
        let off = sum_of(all.each_ref().map(|&term| term.clone())).minus(&Dyadic::of(placed[k])).abs();
        let bound =
            Dyadic::of(2.0 * f64::EPSILON * (1.0 + 8.0 * f64::EPSILON)).times(&sum_of(all.map(Dyadic::abs)));
        assert!(off <= bound, "{pose:?} {point:?}");
    }
}

#[test]
fn placed_corners_are_rounded_step_by_step() {
    let mut random = Random::new(41);
    let mut placed = 0;
    for round in 0..20_000 {
        let spread = [1.0, 1e-20, 1e30, 1e7][round % 4];
        let rotation = turn(&mut random);
        let mut number = |largest: f64| random.signed() * largest * 2f64.powi(-(random.below(30) as i32));
        let translation = [(); 3].map(|()| number(spread));
        let Ok(pose) = Pose::new(rotation, translation) else { continue };
        let point = [(); 3].map(|()| f64::from(number(spread) as f32));
        check_place(&pose, point);
        check_place(&pose, point.map(|x| x + spread));
        placed += 1;
    }
    assert!(placed > 5_000, "{placed}");
}

/// Entries that would underflow in exact arithmetic count as 0, and no others do.
#[test]
fn entries_below_the_limits_are_zero() {
    let (tiny_turn, tiny_move) = (2f64.powi(-64), 2f64.powi(-213));
    for (entry, expected) in [(tiny_turn, tiny_turn), (tiny_turn.next_down(), 0.0), (-tiny_turn, -tiny_turn)]
    {
        let pose = Pose::new([[1.0, entry, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]).unwrap();
        assert_eq!(pose.rotation()[0][1], expected);
    }
    for (entry, expected) in [(tiny_move, tiny_move), (tiny_move.next_down(), 0.0), (-tiny_move, -tiny_move)]
    {
        assert_eq!(Pose::new(*Pose::IDENTITY.rotation(), [entry; 3]).unwrap().translation(), [expected; 3]);
    }
}

#[test]
fn stored_corners_are_sums_without_rounding() {
    let mut random = Random::new(43);
    for round in 0..400 {
        let place = random.point().map(|x| x * 2f64.powi(random.below(100) as i32 - 40));
        let size = 2f64.powi(random.below(60) as i32 - 30);
        let mut corner = || [0, 1, 2].map(|k| place[k] + size * random.signed());
        let triangles = [(); 8].map(|()| [(); 3].map(|()| corner()));
        let encodings = [TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized];
        let profile = Profile::ALL[round % Profile::ALL.len()];
        let file = bake(&mesh(&triangles), &options(profile, encodings[round % 3]));
        let origin = file.objects()[0].origin();
        for corner in stored(file.bytes()).iter().flat_map(|triangle| triangle.values) {
            for k in 0..3 {
                let (v, sum) = (f64::from(corner[k]), origin[k] + f64::from(corner[k]));
                assert_eq!(Dyadic::of(origin[k]).plus(&Dyadic::of(v)), Dyadic::of(sum));
            }
        }
    }
}
