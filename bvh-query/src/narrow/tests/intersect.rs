//! Compares `triangles_intersect` and `segment_intersects` with the oracle: in every touching, coplanar and degenerate position, by name and
//! at random on small grids, and in positions that rounding cannot tell from touching.

use super::generate::{KINDS, float, grid_triangle, pair, shuffled};
use crate::narrow::{Triangle, segment_intersects, triangles_intersect};
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::{Length, meet};

const A: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

#[track_caller]
fn expect(a: &Triangle, b: &Triangle, expected: bool) {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for order_a in ORDERS {
        for order_b in ORDERS {
            let (a, b) = (order_a.map(|i| a[i]), order_b.map(|i| b[i]));
            assert_eq!(triangles_intersect(&a, &b), expected, "{a:?} {b:?}");
            assert_eq!(triangles_intersect(&b, &a), expected, "{b:?} {a:?}");
        }
    }
}

fn scaled(triangle: &Triangle, scale: f64) -> Triangle {
    triangle.map(|corner| corner.map(|x| x * scale))
}

#[test]
fn grid_pairs_agree_with_the_oracle() {
    for (n, everyday) in [(2, 3000), (3, 4000), (5, 4000)] {
        let mut random = Random::new(n as u64);
        for _ in 0..rounds(everyday) {
            let (a, b) = (grid_triangle(&mut random, n), grid_triangle(&mut random, n));
            let expected = meet(&a, &b).unwrap();
            let (c, d) = (shuffled(&mut random, &a), shuffled(&mut random, &b));
            assert_eq!(triangles_intersect(&float(&a), &float(&b)), expected, "{a:?} {b:?}");
            assert_eq!(triangles_intersect(&float(&d), &float(&c)), expected, "{d:?} {c:?}");
            let [p, q, _] = d;
            let expected = meet(&c, &[p, q, q]).unwrap();
            let [from, to, _] = float(&d);
            assert_eq!(segment_intersects(&float(&c), from, to), expected, "{c:?} {p:?} {q:?}");
        }
    }
}

#[test]
fn pairs_within_rounding_of_touching_agree_with_the_oracle() {
    let mut random = Random::new(7);
    for round in 0..KINDS * 60 {
        let (name, a, b) = pair(round % KINDS, &mut random);
        let (a, b) = (shuffled(&mut random, &a), shuffled(&mut random, &b));
        let touches = |b: &Triangle| Length::between(&a, b).compare(0.0).is_eq();
        let (expected, [p, q, _]) = (touches(&b), b);
        let expected_of_segment = touches(&[p, q, q]);
        // Bounds of errors have the unit of what they bound: scales show a product in the place of a sum.
        for scale in [1.0, 2_f64.powi(-60), 2_f64.powi(60)] {
            let (a, b) = (scaled(&a, scale), scaled(&b, scale));
            assert_eq!(triangles_intersect(&a, &b), expected, "{name}: {a:?} {b:?}");
            assert_eq!(triangles_intersect(&b, &a), expected, "{name}, swapped: {a:?} {b:?}");
            assert_eq!(
                segment_intersects(&a, b[0], b[1]),
                expected_of_segment,
                "{name}, an edge: {a:?} {b:?}"
            );
        }
    }
}

#[test]
fn the_ends_of_the_range_are_exact() {
    // One unit in the last place decides, at coordinates of 2^125 and where they are multiples of 2^-296.
    for scale in [2_f64.powi(123), 2_f64.powi(-214)] {
        let up = (1.0 + f64::EPSILON) * scale;
        let a = [[0.0; 3], [scale, 0.0, scale], [0.0, scale, scale]];
        let over = |z: f64| [[0.25 * scale, 0.75 * scale, z], [0.5 * scale, scale, 2.0 * scale], [scale; 3]];
        expect(&a, &over(scale), true);
        expect(&a, &[[0.25 * scale, 0.75 * scale, up]; 3], false);
        expect(&a, &[[0.25 * scale, 0.75 * scale, scale]; 3], true);
        expect(
            &a,
            &[[0.25 * scale, 0.75 * scale, up], [scale, scale, 3.0 * scale], [scale, scale, 4.0 * scale]],
            false,
        );
    }
}

#[test]
fn touching_triangles_intersect() {
    expect(&A, &[[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], true); // corner on face
    expect(&A, &[[2.0, 2.0, 0.0], [3.0, 3.0, 1.0], [4.0, 3.0, 1.0]], true); // corner on edge
    expect(&A, &[[4.0, 0.0, 0.0], [5.0, 0.0, 1.0], [5.0, 1.0, 1.0]], true); // corner on corner
    expect(&A, &[[1.0, -1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -2.0, 2.0]], true); // edge crosses edge
    expect(&A, &[[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.0, 1.0]], true); // edge in face
    expect(&A, &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], true); // edge along edge
    expect(&A, &[[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 4.0]], true); // shared edge
    expect(&A, &[[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 0.0]], true); // edge pierces face
    expect(&A, &A, true);
}

#[test]
fn triangles_that_miss_do_not_intersect() {
    expect(&A, &[[1.0, 1.0, 1e-300], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], false); // above
    expect(&A, &[[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [9.0, 9.0, 0.0]], false); // both planes cut
    expect(&A, &[[5.0, 0.0, 0.0], [6.0, 0.0, 1.0], [6.0, 1.0, 1.0]], false); // corner in the plane
    expect(&A, &[[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 1.0, 1.0]], false); // edge in the plane
}

#[test]
fn coplanar_triangles_are_decided_in_their_plane() {
    for tilt in [[0.0, 0.0], [1.0, 0.0], [-2.0, 3.0]] {
        for turn in 0..3 {
            // Every plane, including those perpendicular to two axes.
            let place = |t: [[f64; 2]; 3]| {
                t.map(|[x, y]| {
                    let mut p = [x, y, tilt[0] * x + tilt[1] * y];
                    p.rotate_left(turn);
                    p
                })
            };
            let a = place([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]);
            expect(&a, &place([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5]]), true); // nested
            expect(&a, &place([[-9.0, -9.0], [29.0, -9.0], [-9.0, 29.0]]), true); // nesting
            expect(&a, &place([[3.0, 3.0], [-1.0, 3.0], [3.0, -1.0]]), true); // star, no corner inside
            expect(&a, &place([[2.0, 2.0], [3.0, 3.0], [3.0, 4.0]]), true); // corner on edge
            expect(&a, &place([[-1.0, 0.0], [-1.0, 4.0], [0.0, 0.0]]), true); // corner on corner
            expect(&a, &place([[4.0, 0.0], [0.0, 4.0], [4.0, 4.0]]), true); // shared edge
            expect(&a, &place([[4.0, 1.0], [1.0, 4.0], [4.0, 4.0]]), false); // parallel edges
            expect(&a, &place([[-1.0, 0.0], [-1.0, 4.0], [-2.0, 0.0]]), false);
        }
    }
}

#[test]
fn triangles_without_area_are_segments_and_points() {
    let segment = |p: [f64; 3], q: [f64; 3]| [p, q, p];
    let point = |p: [f64; 3]| [p; 3];
    // Against a triangle with area.
    expect(&A, &segment([1.0, 1.0, -1.0], [1.0, 1.0, 1.0]), true);
    expect(&A, &segment([1.0, 1.0, 1.0], [1.0, 1.0, 2.0]), false);
    expect(&A, &segment([3.0, 3.0, -1.0], [3.0, 3.0, 1.0]), false);
    expect(&A, &segment([2.0, 2.0, -1.0], [2.0, 2.0, 1.0]), true); // through an edge
    expect(&A, &segment([-1.0, 2.0, 0.0], [9.0, 2.0, 0.0]), true); // in the plane, through
    expect(&A, &segment([1.0, 1.0, 0.0], [2.0, 1.0, 0.0]), true); // in the plane, inside
    expect(&A, &segment([4.0, 1.0, 0.0], [1.0, 4.0, 0.0]), false); // in the plane, outside
    expect(&A, &segment([5.0, 0.0, 0.0], [6.0, 0.0, 0.0]), false); // on the line of an edge
    expect(&A, &segment([1.0, 1.0, 0.0], [3.0, 3.0, 3.0]), true); // end on the face
    expect(&A, &point([1.0, 1.0, 0.0]), true);
    expect(&A, &point([2.0, 2.0, 0.0]), true);
    expect(&A, &point([4.0, 0.0, 0.0]), true);
    expect(&A, &point([3.0, 3.0, 0.0]), false);
    expect(&A, &point([1.0, 1.0, 1.0]), false);
    // Against a segment; three different corners on one line are a segment as well.
    let s = [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [4.0, 8.0, 12.0]];
    expect(&s, &segment([3.0, 6.0, 9.0], [5.0, 6.0, 9.0]), true);
    expect(&s, &segment([5.0, 6.0, 9.0], [7.0, 6.0, 9.0]), false); // coplanar
    expect(&s, &segment([0.0, 0.0, 1.0], [5.0, 6.0, 9.0]), false); // skew
    expect(&s, &segment([4.0, 8.0, 12.0], [5.0, 10.0, 15.0]), true); // end to end on one line
    expect(&s, &segment([5.0, 10.0, 15.0], [6.0, 12.0, 18.0]), false); // apart on one line
    expect(&s, &segment([0.0, 0.0, 0.0], [9.0, 18.0, 27.0]), true); // within
    expect(&s, &segment([1.0, 2.0, 4.0], [4.0, 8.0, 13.0]), false); // parallel
    expect(&s, &point([3.0, 6.0, 9.0]), true);
    expect(&s, &point([0.0, 0.0, 0.0]), false); // on its line
    expect(&s, &point([3.0, 6.0, 9.5]), false);
    // Points, and both zeros.
    expect(&point([0.0, 1.0, 2.0]), &point([-0.0, 1.0, 2.0]), true);
    expect(&point([0.0, 1.0, 2.0]), &point([0.0, 1.0, 2.5]), false);
}
