//! Convex solids: their depth is the least width of both along a normal of a face, or across two edges.

use super::{moved, penetration};
use crate::common::shapes::{cube, outward, sphere};
use crate::common::{Random, bake, baked, corners, mesh, placed, queriers, random_pose, stored, translation};
use bvh_bake::shapes::convex_hull;
use bvh_bake::{Options, Profile, TriangleEncoding, shapes};
use bvh_query::{Bvh, PenetrationOptions, Pose, Querier, QueryError, Relation, Shape};

type Point = [f64; 3];

fn subtract(p: Point, q: Point) -> Point {
    [0, 1, 2].map(|k| p[k] - q[k])
}

fn dot(p: Point, q: Point) -> f64 {
    (0..3).map(|k| p[k] * q[k]).sum()
}

fn cross(p: Point, q: Point) -> Point {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// The depth of two convex solids that overlap, to within roundings: some facet of their Minkowski difference is the nearest, and its
/// normal is that of a face of one of them or across an edge of each. Along all other directions they are at least as wide.
fn depth(a: &[[Point; 3]], b: &[[Point; 3]]) -> f64 {
    let edges = |triangles: &[[Point; 3]]| -> Vec<Point> {
        let of = |[p, q, r]: &[Point; 3]| [subtract(*q, *p), subtract(*r, *q), subtract(*p, *r)];
        triangles.iter().flat_map(of).collect()
    };
    let faces = a.iter().chain(b).map(|[p, q, r]| cross(subtract(*q, *p), subtract(*r, *p)));
    let (of_a, of_b) = (edges(a), edges(b));
    let across = of_a.iter().flat_map(|u| of_b.iter().map(|v| cross(*u, *v)));
    let width = |normal: Point| {
        let length = dot(normal, normal).sqrt();
        let height = |corner: &Point| dot(*corner, normal) / length;
        let highest = a.as_flattened().iter().map(height).fold(f64::NEG_INFINITY, f64::max);
        highest - b.as_flattened().iter().map(height).fold(f64::INFINITY, f64::min)
    };
    let all: Vec<Point> = faces.chain(across).flat_map(|normal| [normal, normal.map(|x| -x)]).collect();
    let longest = all.iter().map(|normal| dot(*normal, *normal)).fold(0.0, f64::max);
    let certain = all.into_iter().filter(|normal| dot(*normal, *normal) > 1e-16 * longest);
    certain.map(width).fold(f64::INFINITY, f64::min)
}

fn triangles(bvh: &Bvh, pose: &Pose) -> Vec<[Point; 3]> {
    placed(&corners(&stored(bvh)), pose)
}

fn hull(random: &mut Random, points: usize, scale: f64) -> Bvh {
    let stretch = [(); 3].map(|()| 0.2 + random.unit());
    let points: Vec<Point> = (0..points)
        .map(|_| {
            let p = random.point();
            [0, 1, 2].map(|k| scale * stretch[k] * p[k])
        })
        .collect();
    bake(&convex_hull(&points).unwrap(), &Options::default())
}

/// Also far from the origin, tiny and huge.
#[test]
fn hulls_are_as_deep_as_their_least_width() {
    let (mut queriers, mut random) = (queriers(), Random::new(17));
    for round in 0..60 {
        let scale = [1.0, 2f64.powi(60), 2f64.powi(-60)][round % 3];
        let [a, b] = [(); 2].map(|()| {
            let points = 4 + random.below(16);
            hull(&mut random, points, scale)
        });
        let turned = random_pose(&mut random, 0.0);
        let far = if round % 5 == 4 { 1e6 } else { 0.0 };
        let shift = random.point().map(|x| scale * (0.5 * x));
        let pose = Pose::new(*turned.rotation(), shift).unwrap();
        if queriers[0].relation(&a, &b, &pose).unwrap() == Relation::Apart {
            continue;
        }
        let expected = depth(&triangles(&a, &Pose::IDENTITY), &triangles(&b, &pose));
        let found = penetration(&mut queriers, &a, &b, &pose);
        let slack = 1e-12 * scale;
        assert!(found.lower <= expected + slack && expected <= found.upper + slack, "{found:?}, {expected}");
        assert!(found.upper <= 1.011 * found.lower + slack && found.radii == [0.0; 2], "{round}: {found:?}");
        for (shape, pose) in [(&a, Pose::IDENTITY), (&b, pose)] {
            assert!(is_in(shape, &pose, found.point, slack), "{round}: {found:?}");
        }
        // Closer bounds on request, and none closer than they have to be.
        let exact =
            queriers[0].penetration(&a, &b, &pose, &PenetrationOptions::new().relative_gap(1e-9)).unwrap();
        assert!(exact.upper <= exact.lower * (1.0 + 1e-9) + slack, "{round}: {exact:?}");
        let known =
            queriers[0].penetration(&a, &b, &pose, &PenetrationOptions::new().tolerance(expected / 2.0));
        assert!(known.unwrap().lower > expected / 2.0);
        if far > 0.0 {
            far_away(&mut queriers, &mut random, far * scale, scale);
        }
    }
}

/// Whether a point is in a convex solid, or hardly outside.
fn is_in(solid: &Bvh, pose: &Pose, point: Point, slack: f64) -> bool {
    triangles(solid, pose).iter().all(|[p, q, r]| {
        let normal = cross(subtract(*q, *p), subtract(*r, *p));
        dot(normal, subtract(point, *p)) <= slack * dot(normal, normal).sqrt()
    })
}

/// Both hulls far from the origin of A's frame, where placing a vertex rounds by more than the solids do.
fn far_away(queriers: &mut [Querier], random: &mut Random, far: f64, scale: f64) {
    let mut hull = || {
        let points: Vec<Point> = (0..12).map(|_| random.point().map(|x| far + scale * x)).collect();
        bake(&convex_hull(&points).unwrap(), &Options::default())
    };
    let [a, b] = [hull(), hull()];
    let pose = Pose::new(*Pose::IDENTITY.rotation(), random.point().map(|x| 0.3 * scale * x)).unwrap();
    if queriers[0].relation(&a, &b, &pose).unwrap() != Relation::Apart {
        let expected = depth(&triangles(&a, &Pose::IDENTITY), &triangles(&b, &pose));
        let found = penetration(queriers, &a, &b, &pose);
        let slack = 1e-14 * far;
        assert!(found.lower <= expected + slack && expected <= found.upper + slack, "{found:?}, {expected}");
        assert!(found.upper <= 1.011 * found.lower + 100.0 * slack, "{found:?}");
    }
}

/// One in the other, the same in one place, and with radii.
#[test]
fn nested_equal_and_rounded_solids() {
    let mut queriers = queriers();
    let big = bake(&shapes::block([2.0, 4.0, 6.0]).unwrap(), &Options::default());
    let small = bake(&shapes::block([0.5, 0.5, 0.5]).unwrap(), &Options::default());
    for (a, b, pose, expected) in [
        (&big, &small, translation(0.25, 0.0, 0.0), 1.0),
        (&small, &big, translation(0.0, 0.0, 0.0), 1.25),
        (&big, &big, translation(0.0, 0.0, 0.0), 2.0),
        (&small, &small, translation(0.25, 0.0, 0.0), 0.25),
    ] {
        let found = penetration(&mut queriers, a, b, &pose);
        assert!((found.lower - expected).abs() < 1e-9 && (found.upper - expected).abs() < 1e-9, "{found:?}");
        let (round_a, round_b) = (a.all().rounded(0.125).unwrap(), b.all().rounded(0.25).unwrap());
        for querier in &mut queriers {
            let found = querier.penetration(round_a, round_b, &pose, &PenetrationOptions::new()).unwrap();
            let expected = expected + 0.375;
            assert!(found.lower <= expected && expected <= found.upper, "{found:?}");
            assert!(found.upper - found.lower < 1e-9, "{found:?}");
            let free = moved(&pose, found.translation);
            assert_eq!(querier.relation(round_a, round_b, &free), Ok(Relation::Apart));
        }
    }
}

/// What looks convex and is not, has no volume or hardly any is left to the search that needs neither.
#[test]
fn what_is_not_certainly_a_convex_solid_has_its_depth_too() {
    let mut queriers = queriers();
    let block = bake(&shapes::block([1.0, 1.0, 1.0]).unwrap(), &Options::default());
    // A vertex of a face is pushed in by the least number.
    let mut dented = outward(cube());
    let centre = [1.0f64.next_down(), 0.0, 0.0];
    let face = |triangle: &[Point; 3]| triangle.iter().all(|corner| corner[0] == 1.0);
    let on_face: Vec<_> = dented.iter().copied().filter(|triangle| face(triangle)).collect();
    dented.retain(|triangle| !face(triangle));
    let ring = [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]];
    assert_eq!(on_face.len(), 2);
    dented.extend((0..4).map(|k| [ring[k], ring[(k + 1) % 4], centre]));
    let dented = baked(&outward(dented));
    let found = penetration(&mut queriers, &dented, &block, &translation(1.0, 0.0, 0.0));
    assert!(found.lower > 0.0 && found.lower <= 0.5 && found.radii != [0.0; 2], "{found:?}");
    assert!((found.upper - 0.5).abs() < 1e-12, "{found:?}");
    // Two faces back to back enclose nothing.
    let flat = baked(&[
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    ]);
    let found = penetration(&mut queriers, &block, &flat, &translation(0.25, 0.0, 0.0));
    assert_eq!(found.lower, 0.0, "{found:?}");
    // A plate that is thinner than what roundings may bend.
    let plate = bake(&shapes::block([1.0, 1.0, 1e-9]).unwrap(), &Options::default());
    let found = penetration(&mut queriers, &plate, &plate, &translation(0.25, 0.0, 0.0));
    assert!(found.lower <= 1e-9 && found.upper >= 1e-9 * (1.0 - 1e-6), "{found:?}");
    // More triangles than are looked at.
    let fine = baked(&outward(sphere(5)));
    let found = penetration(&mut queriers, &fine, &block, &translation(1.25, 0.0, 0.0));
    assert!(found.lower > 0.1 && found.lower <= 0.25 && found.radii != [0.0; 2], "{found:?}");
    let open = baked(&outward(cube())[1..]);
    let refused = queriers[0].penetration(&open, &block, &Pose::IDENTITY, &PenetrationOptions::new());
    assert!(matches!(refused, Err(QueryError::NotClosed { .. })));
}

/// A cube and the same cube inside out enclose nothing, whether the file tells of duplicates or not. A face that is divided very finely
/// is not decided, and has its depth as well.
#[test]
fn what_cancels_or_is_divided_finely_is_no_convex_solid() {
    let mut queriers = queriers();
    let mut both = outward(cube());
    both.extend(outward(cube()).iter().map(|[p, q, r]| [*p, *r, *q]));
    let small = bake(&shapes::block([0.5; 3]).unwrap(), &Options::default());
    for has_ids in [true, false] {
        let nothing = bake(&mesh(&both), &Options::default().ids(has_ids));
        for (b, shift) in [(&small, 0.0), (&small, 0.75), (&nothing, 0.75)] {
            let found = penetration(&mut queriers, &nothing, b, &translation(shift, 0.0, 0.0));
            assert_eq!(found.lower, 0.0, "{has_ids}, {shift}: {found:?}");
        }
    }
    let steps = 22;
    let grid = |x: usize, y: usize, k: usize, sign: f64| {
        let [x, y] = [x, y].map(|at| 2.0 * at as f64 / steps as f64 - 1.0);
        let mut point = [sign; 3];
        (point[(k + 1) % 3], point[(k + 2) % 3]) = (x, y);
        point
    };
    let mut fine = Vec::new();
    for (k, sign) in (0..3).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
        for (x, y) in (0..steps).flat_map(|x| (0..steps).map(move |y| (x, y))) {
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| grid(x, y, k, sign));
            fine.extend([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
        }
    }
    let fine = baked(&outward(fine));
    let found = penetration(&mut queriers, &fine, &small, &translation(1.125, 0.0, 0.0));
    assert!(found.lower > 0.0 && found.lower <= 0.125 && found.upper >= 0.125, "{found:?}");
    assert!(found.upper < 0.125 + 1e-9, "{found:?}");
}

/// In another order, with another tree and in another encoding, a mesh is as deep to the bit.
#[test]
fn the_depth_does_not_depend_on_the_file() {
    let (mut random, mut querier) = (Random::new(29), Querier::new().unwrap());
    for _ in 0..8 {
        let [a, b] = [(); 2].map(|()| {
            let points: Vec<Point> = (0..40).map(|_| random.point().map(|x| f64::from(x as f32))).collect();
            let hull = bake(&convex_hull(&points).unwrap(), &Options::default());
            let turned: Vec<_> =
                triangles(&hull, &Pose::IDENTITY).iter().rev().map(|[p, q, r]| [*q, *r, *p]).collect();
            let other = Options::default().profile(Profile::Dop6U8).triangles(TriangleEncoding::Packed);
            [bake(&mesh(&turned), &other), hull]
        });
        let pose = random_pose(&mut random, 0.5);
        let [first, second] =
            [0, 1].map(|k| querier.penetration(&a[k], &b[k], &pose, &PenetrationOptions::new()).unwrap());
        assert_eq!(first, second);
    }
}

/// A budget ends the search with what is known, or with an error.
#[test]
fn a_budget_ends_the_search() {
    let mut random = Random::new(5);
    let [a, b] = [(); 2].map(|()| hull(&mut random, 300, 1.0));
    let mut querier = Querier::new().unwrap();
    let exact = PenetrationOptions::new().relative_gap(1e-12);
    let full = querier.penetration(Shape::from(&a), &b, &Pose::IDENTITY, &exact).unwrap();
    assert!(!full.is_spent && full.lower > 0.0);
    let mut spent = 0;
    for budget in 0..60 {
        querier.set_budget(budget);
        match querier.penetration(&a, &b, &Pose::IDENTITY, &exact) {
            Ok(found) => {
                assert!(found.lower <= full.upper && full.lower <= found.upper, "{found:?}");
                spent += u32::from(found.is_spent);
            }
            Err(error) => assert!(matches!(error, QueryError::Budget { .. })),
        }
    }
    assert!(spent > 3, "{spent}");
}
