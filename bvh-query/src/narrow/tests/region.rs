//! Compares `common_region` with the extreme points that rational numbers give: on small grids, where all kinds of contact
//! occur, and near contact, for planes that hardly cross, slivers, and triangles far from the origin.

use super::generate::{KINDS, float, grid_triangle, pair, shuffled, small, triangle};
use crate::narrow::contact_region::{Region, common_region, unit_normal};
use crate::narrow::{Point, Triangle, add_scaled, dot};
use crate::numerics::UNIT_ROUNDOFF;
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::{self, Dyadic, Number, is_zero, subtract};
use std::cmp::Ordering::{Greater, Less};

type Vector = exact::Vector<Dyadic>;

/// A rational point: a vector over a positive number.
type Rational = (Vector, Dyadic);

fn is_between(x: &Dyadic, end: &Dyadic) -> bool {
    *x >= Dyadic::ZERO && x <= end
}

/// Returns the corners of the triangle, or of the segment or the point that it is.
fn hull(triangle: &Triangle) -> Vec<Vector> {
    let mut corners = triangle.map(|p| p.map(Dyadic::of)).to_vec();
    if is_zero(&normal(&corners)).unwrap() {
        corners.sort();
        corners.remove(1);
        corners.dedup();
    }
    corners
}

fn normal(t: &[Vector]) -> Vector {
    exact::cross(&subtract(&t[1], &t[0]), &subtract(&t[2], &t[0]))
}

fn edges(hull: &[Vector]) -> Vec<(&Vector, &Vector)> {
    match hull {
        [p, q] => vec![(p, q)],
        [p, q, r] => vec![(p, q), (q, r), (r, p)],
        _ => vec![],
    }
}

/// Returns whether a hull contains a point.
fn contains(hull: &[Vector], (point, scale): &Rational) -> bool {
    let from = |corner: &Vector| [0, 1, 2].map(|k| point[k].minus(&corner[k].times(scale)));
    match hull {
        [p] => is_zero(&from(p)).unwrap(),
        [p, q] => {
            let edge = subtract(q, p);
            let along = exact::dot(&edge, &from(p));
            is_zero(&exact::cross(&edge, &from(p))).unwrap()
                && is_between(&along, &exact::dot(&edge, &edge).times(scale))
        }
        _ => {
            let n = normal(hull);
            exact::dot(&n, &from(&hull[0])) == Dyadic::ZERO
                && edges(hull)
                    .iter()
                    .all(|(p, q)| exact::dot(&n, &exact::cross(&subtract(q, p), &from(p))) >= Dyadic::ZERO)
        }
    }
}

/// Returns the extreme points of what two triangles have in common: corners, edges through planes, and edges that cross.
fn extreme_points(a: &Triangle, b: &Triangle) -> Vec<Rational> {
    let hulls = [hull(a), hull(b)];
    let mut found: Vec<Rational> = Vec::new();
    let mut add = |point: Rational| {
        let is_same =
            |other: &Rational| (0..3).all(|k| point.0[k].times(&other.1) == other.0[k].times(&point.1));
        if hulls.iter().all(|hull| contains(hull, &point)) && !found.iter().any(is_same) {
            found.push(point);
        }
    };
    // The point at t / whole of the way from p to q.
    let at = |p: &Vector, q: &Vector, t: &Dyadic, whole: &Dyadic| {
        (([0, 1, 2].map(|k| p[k].times(whole).plus(&q[k].minus(&p[k]).times(t)))), whole.clone())
    };
    for (one, other) in [(&hulls[0], &hulls[1]), (&hulls[1], &hulls[0])] {
        one.iter().for_each(|corner| add((corner.clone(), Dyadic::ONE)));
        for (p, q) in edges(one) {
            if other.len() == 3 {
                let height = |x: &Vector| exact::dot(&normal(other), &subtract(x, &other[0]));
                let (x, y) = (height(p), height(q));
                if x != Dyadic::ZERO && x.sign() == Dyadic::ZERO.minus(&y).sign() {
                    add(at(p, q, &x.abs(), &x.minus(&y).abs()));
                }
            }
            for (r, s) in edges(other) {
                let (d, e) = (subtract(q, p), subtract(s, r));
                let n = exact::cross(&d, &e);
                let t = exact::dot(&exact::cross(&subtract(r, p), &e), &n);
                let whole = exact::dot(&n, &n);
                if whole > Dyadic::ZERO && is_between(&t, &whole) {
                    add(at(p, q, &t, &whole));
                }
            }
        }
    }
    found
}

/// Returns whether a point is within a length of a rational one.
fn is_near(p: &Point, (q, scale): &Rational, length: f64) -> bool {
    let gap = [0, 1, 2].map(|k| Dyadic::of(p[k]).times(scale).minus(&q[k]));
    let limit = Dyadic::of(length).times(scale);
    exact::dot(&gap, &gap) <= limit.times(&limit)
}

/// The largest ratio of an error to what it is allowed to be.
#[derive(Default)]
struct Tally {
    contacts: [usize; 7],
    error: f64,
}

/// Checks the region of two triangles, if they meet.
fn check(a: &Triangle, b: &Triangle, tally: &mut Tally) {
    let expected = extreme_points(a, b);
    if expected.is_empty() {
        return;
    }
    let region = common_region(a, b);
    let points = &region.points[..region.count];
    tally.contacts[region.corners] += 1;
    assert_eq!(region.corners, expected.len(), "{a:?} {b:?} {region:?}");
    for point in points {
        assert!(expected.iter().any(|e| is_near(point, e, region.error)), "{a:?} {b:?} {region:?}");
    }
    if region.count == region.corners {
        for e in &expected {
            assert!(points.iter().any(|p| is_near(p, e, region.error)), "{a:?} {b:?} {region:?}");
        }
    } else {
        assert!(region.corners > 2 && region.count > 0, "{a:?} {b:?} {region:?}");
    }
    let (mut edge, mut largest) = (0.0_f64, 0.0_f64);
    for t in [a, b] {
        t.as_flattened().iter().for_each(|x| largest = largest.max(x.abs()));
        (0..9).for_each(|k| edge = edge.max((t[k / 3][k % 3] - t[(k / 3 + 1) % 3][k % 3]).abs()));
    }
    let allowed = 3.1 * (edge * 2f64.powi(-40) + 2.0 * UNIT_ROUNDOFF * largest) + f64::MIN_POSITIVE;
    assert!(region.error <= allowed, "{region:?} {allowed:e}");
    tally.error = tally.error.max(region.error / allowed);
    check_order(a, b, &region);
    check_swapped(b, a, &region);
}

/// Segments follow the cross product of the normals, and polygons go around A's.
fn check_order(a: &Triangle, b: &Triangle, region: &Region) {
    let exact_normal = |t: &Triangle| normal(&t.map(|p| p.map(Dyadic::of)));
    let between = |p: &Point, q: &Point| subtract(&q.map(Dyadic::of), &p.map(Dyadic::of));
    match &region.points[..region.count] {
        [p, q] if region.corners == 2 => {
            let (line, along) = (exact::cross(&exact_normal(a), &exact_normal(b)), between(p, q));
            let error = Dyadic::of(2.0 * region.error);
            let is_long = exact::dot(&along, &along) > error.times(&error);
            if is_zero(&line).unwrap() {
                assert!(p < q, "{a:?} {b:?} {region:?}");
            } else if is_long {
                assert_eq!(exact::dot(&line, &along).sign(), Some(Greater), "{a:?} {b:?} {region:?}");
            }
        }
        [p, rest @ ..] if region.count == region.corners => {
            let twice = rest.windows(2).fold(Dyadic::ZERO, |sum, pair| {
                let part = exact::cross(&between(p, &pair[0]), &between(p, &pair[1]));
                sum.plus(&exact::dot(&exact_normal(a), &part))
            });
            assert!(rest.is_empty() || twice.sign() != Some(Less), "{a:?} {b:?} {region:?}");
        }
        _ => {}
    }
}

fn check_swapped(b: &Triangle, a: &Triangle, region: &Region) {
    let swapped = common_region(b, a);
    let sorted = |region: &Region| {
        let mut points = region.points[..region.count].to_vec();
        points.sort_by(|p, q| p.partial_cmp(q).unwrap());
        (region.corners, points, region.error)
    };
    assert_eq!(sorted(&swapped), sorted(region), "{a:?} {b:?}");
}

#[test]
fn grid_pairs_meet_where_rationals_say() {
    let mut tally = Tally::default();
    for (n, everyday) in [(2, 1500), (3, 2000), (4, 2000), (12, 2000)] {
        let mut random = Random::new(100 + n as u64);
        for round in 0..rounds(everyday) {
            let (mut a, mut b) = (grid_triangle(&mut random, n), grid_triangle(&mut random, n));
            if round % 3 == 0 {
                // In one plane, which is askew.
                for corner in a.iter_mut().chain(&mut b) {
                    *corner = [3 * corner[0], 3 * corner[1], corner[0] - 2 * corner[1]];
                }
            }
            let (a, b) = (float(&a), float(&b));
            check(&a, &b, &mut tally);
            // Corners that are no longer on a grid of few bits.
            let third = |t: &Triangle| t.map(|p| p.map(|x| (x + 0.1) / 3.0));
            check(&third(&a), &third(&b), &mut tally);
        }
    }
    assert!(tally.contacts[1..].iter().all(|&count| count > 3), "{:?}", tally.contacts);
}

#[test]
fn hard_pairs_meet_where_rationals_say() {
    let mut tally = Tally::default();
    let mut random = Random::new(5);
    for round in 0..rounds(4000) as usize {
        let (_, a, b) =
            if round % 2 == 0 { pair(round / 2 % KINDS, &mut random) } else { hardly_crossing(&mut random) };
        let (a, b) = (shuffled(&mut random, &a), shuffled(&mut random, &b));
        // Brings a point of one to a point of the other.
        let (s, t) = (random.unit(), random.unit());
        let inside = |t: &Triangle, x: f64, y: f64| {
            add_scaled(add_scaled(t[0], x, exact_gap(t, 1)), y * (1.0 - x), exact_gap(t, 2))
        };
        let by = exact_gap(&[inside(&b, s, t), inside(&a, t, s), [0.0; 3]], 1);
        let far = [0.0, 1e3, 1e12][random.below(3)];
        let moved = if round % 4 < 2 { b } else { b.map(|p| add_scaled(p, 1.0, by)) };
        for scale in [1.0, 2f64.powi(-60), 2f64.powi(60)] {
            let place = |t: &Triangle| t.map(|p| p.map(|x| (x + far) * scale));
            check(&place(&a), &place(&moved), &mut tally);
        }
    }
    let [_, points, segments, rest @ ..] = tally.contacts;
    assert!(points > 30 && segments > 1000 && rest.iter().sum::<usize>() > 3, "{:?}", tally.contacts);
    assert!(tally.error > 0.1, "no pair was hard: {}", tally.error);
}

fn exact_gap(t: &Triangle, corner: usize) -> Point {
    [0, 1, 2].map(|k| t[corner][k] - t[0][k])
}

/// Returns triangles through each other whose planes are almost one.
fn hardly_crossing(random: &mut Random) -> (&'static str, Triangle, Triangle) {
    let (a, tilt) = (triangle(random), small(random, 17.0));
    let (u, v, n) = (exact_gap(&a, 1), exact_gap(&a, 2), unit_normal(&a));
    let mut corner = || {
        let flat = add_scaled(add_scaled(a[0], 1.5 * random.signed(), u), 1.5 * random.signed(), v);
        add_scaled(flat, tilt * random.signed(), n)
    };
    ("hardly crossing", a, [corner(), corner(), corner()])
}

#[test]
fn normals_have_length_one_and_are_those_of_the_triangles() {
    let mut random = Random::new(3);
    for round in 0..2000 {
        let (_, a, b) = pair(round % KINDS, &mut random);
        for t in [a, b, [[0.0; 3], [1e-30, 0.0, 0.0], [0.0, 1e-30, 3e-31]], [[1e-300; 3], [1.0; 3], [2.0; 3]]]
        {
            let (n, unit) = (hull(&t).len() == 3, unit_normal(&t));
            assert!(n || unit == [0.0; 3], "{t:?}");
            if !n {
                continue;
            }
            assert!((dot(unit, unit) - 1.0).abs() < 8.0 * UNIT_ROUNDOFF, "{t:?} {unit:?}");
            let facing = exact::dot(&normal(&t.map(|p| p.map(Dyadic::of))), &unit.map(Dyadic::of));
            assert_eq!(facing.sign(), Some(Greater), "{t:?} {unit:?}");
        }
    }
    assert_eq!(unit_normal(&[[1.0; 3], [2.0; 3], [4.0; 3]]), [0.0; 3]);
}
