//! Depths that follow from a formula: of boxes, balls and capsules, nested, touching, far away, tiny and huge.

use super::penetration;
use crate::common::shapes::{cube, moved as at, outward, plate, sphere};
use crate::common::{Random, bake, baked, mesh, queriers, random_pose, translation};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, shapes};
use bvh_query::{Bvh, PenetrationOptions, Querier, QueryError, Relation, Shape};
use cbvh_testkit::depth::rounds;

/// A box with its centre at the origin.
fn block(half: [f64; 3]) -> Bvh {
    let corner = |corner: [f64; 3]| [0, 1, 2].map(|k| half[k] * corner[k]);
    baked(&outward(cube()).iter().map(|triangle| triangle.map(corner)).collect::<Vec<_>>())
}

/// How far B moves along a direction until it has left A: two boxes, with B's centre at `offset`.
fn way_out(a: [f64; 3], b: [f64; 3], offset: [f64; 3], direction: [f64; 3]) -> f64 {
    let along = |k: usize| ((a[k] + b[k]) - offset[k] * direction[k].signum()) / direction[k].abs();
    (0..3).filter(|&k| direction[k] != 0.0).map(along).fold(f64::INFINITY, f64::min)
}

const AXES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

fn eighths(random: &mut Random, most: usize) -> f64 {
    (1 + random.below(most)) as f64 / 8.0
}

/// Also where faces are flush, and where one box is in the other. At any scale, and in inches, which `f32` does not hold.
#[test]
fn boxes_are_as_deep_as_their_sides_say() {
    let (mut queriers, mut random) = (queriers(), Random::new(11));
    for round in 0..60 {
        let scale = [1.0, 2f64.powi(40), 2f64.powi(-40), 0.0254][round % 4];
        let [a, b] = [(); 2].map(|()| [(); 3].map(|()| scale * eighths(&mut random, 12)));
        let offset = [0, 1, 2].map(|k| {
            let steps = ((a[k] + b[k]) / scale * 8.0).round() as usize;
            scale * (random.below(2 * steps - 1) as f64 + 1.0 - steps as f64) / 8.0
        });
        let (box_a, box_b) = (block(a), block(b));
        let pose = translation(offset[0], offset[1], offset[2]);
        let depth = AXES.iter().map(|&axis| way_out(a, b, offset, axis)).fold(f64::INFINITY, f64::min);
        let found = penetration(&mut queriers, &box_a, &box_b, &pose);
        let size = a.iter().chain(&b).sum::<f64>();
        // Sums of inches are rounded here.
        let slack = if scale == 0.0254 { 1e-15 * size } else { 0.0 };
        assert!(found.lower <= depth + slack && found.upper >= depth - slack, "{found:?} {depth}");
        assert!(
            found.upper <= depth + 1e-12 * size && found.lower > 0.3 * depth,
            "{found:?} {depth} {a:?} {b:?} {offset:?}"
        );
        for direction in [random.point(), AXES[round % 6], [3.0, 0.0, 4.0]] {
            let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            let way = way_out(a, b, offset, direction.map(|x| x / norm));
            let ask = |querier: &mut Querier| querier.separation(&box_a, &box_b, &pose, direction).unwrap();
            let found = ask(&mut queriers[0]);
            assert!(queriers.iter_mut().all(|querier| ask(querier) == found));
            assert!(
                found.lower <= way * (1.0 + 1e-14) && way <= found.upper * (1.0 + 1e-14),
                "{found:?} {way}"
            );
            assert!(
                found.upper - found.lower <= 1e-12 * size,
                "{found:?} {way} {a:?} {b:?} {offset:?} {direction:?}"
            );
            let at = [0, 1, 2].map(|k| offset[k] + found.translation[k]);
            let moved = translation(at[0], at[1], at[2]);
            assert_eq!(queriers[0].relation(&box_a, &box_b, &moved).unwrap(), Relation::Apart);
        }
    }
}

/// Boxes that touch in a face, an edge or a corner, also far from the origin.
#[test]
fn what_touches_is_not_deep() {
    let mut queriers = queriers();
    let (a, b) = (block([1.0, 2.0, 0.5]), block([0.25, 1.0, 1.5]));
    for shift in
        [[1.25, 0.5, 0.25], [-1.25, 0.0, 0.0], [1.25, 3.0, 0.0], [0.125, -3.0, 2.0], [1.25, 3.0, -2.0]]
    {
        let found = penetration(&mut queriers, &a, &b, &translation(shift[0], shift[1], shift[2]));
        assert!(found.lower == 0.0 && found.upper <= 5e-12, "{found:?} at {shift:?}");
        let apart = shift.map(|x| 1.0001 * x);
        let none = penetration(&mut queriers, &a, &b, &translation(apart[0], apart[1], apart[2]));
        assert_eq!((none.lower, none.upper, none.translation), (0.0, 0.0, [0.0; 3]));
    }
    let far = [2f64.powi(20), -(2f64.powi(21)), 2f64.powi(19)];
    let moved = baked(&at(&outward(cube()), 1.0, far));
    let found = penetration(&mut queriers, &moved, &moved, &translation(2.0, 0.5, 0.0));
    assert!(found.lower == 0.0 && found.upper < 1e-7, "{found:?}");
    let found = penetration(&mut queriers, &moved, &moved, &translation(1.75, 0.5, 0.0));
    assert!(found.lower > 0.2 && (0.25..0.2501).contains(&found.upper), "{found:?}");
}

/// In whatever pose both are, and whichever comes first.
#[test]
fn a_depth_does_not_depend_on_the_frame() {
    let (mut queriers, mut random) = (queriers(), Random::new(7));
    let (ball, cube) = (baked(&outward(sphere(3))), baked(&outward(cube())));
    for _ in 0..8 {
        let pose = random_pose(&mut random, 1.2);
        let (Ok(inverse), one) = (pose.inverse(), penetration(&mut queriers, &cube, &ball, &pose)) else {
            continue;
        };
        let other = penetration(&mut queriers, &ball, &cube, &inverse);
        let size = 1e-12;
        assert!(one.lower <= other.upper + size && other.lower <= one.upper + size, "{one:?} {other:?}");
        assert!(one.upper <= 1.05 * other.upper + size && other.upper <= 1.05 * one.upper + size);
    }
}

/// Points and segments with a radius.
#[test]
fn balls_and_capsules_are_as_deep_as_their_radii_say() {
    let mut queriers = queriers();
    let (point, segment) =
        (baked(&[[[0.0; 3]; 3]]), baked(&[[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]));
    let round = |bvh: &Bvh, radius: f64| -> Shape<'static> {
        let leaked: &'static Bvh = Box::leak(Box::new(bvh.clone()));
        leaked.all().rounded(radius).unwrap()
    };
    let (ball, small, capsule) = (round(&point, 0.5), round(&point, 0.25), round(&segment, 0.25));
    let cube = block([1.0, 1.0, 1.0]);
    let cases: [(Shape<'_>, Shape<'_>, [f64; 3], f64); 5] = [
        (ball, small, [0.5, 0.0, 0.0], 0.25),
        (ball, small, [0.3, 0.0, 0.4], 0.25),
        (capsule, small, [0.5, 0.3, 0.0], 0.2),
        (capsule, capsule, [0.25, 0.0, 0.375], 0.125),
        (cube.all(), ball, [1.25, 0.25, 0.0], 0.25),
    ];
    for (a, b, [x, y, z], depth) in cases {
        let pose = translation(x, y, z);
        for querier in &mut queriers {
            let found = querier.penetration(a, b, &pose, &PenetrationOptions::new()).unwrap();
            assert!(
                found.lower <= depth * (1.0 + 1e-14) && found.upper >= depth * (1.0 - 1e-14),
                "{found:?} {depth}"
            );
            assert!(found.lower >= 0.5 * depth && found.upper <= 1.01 * depth, "{found:?} {depth}");
            let t = found.translation;
            let moved = translation(x + t[0], y + t[1], z + t[2]);
            assert_eq!(querier.relation(a, b, &moved).unwrap(), Relation::Apart);
        }
    }
}

/// Radii far smaller and far larger than anything else: a ball that slides along a face, and capsules whose cores are less than what a
/// place is rounded by.
#[test]
fn searches_end_whatever_the_radii() {
    let (block, point) = (block([0.25, 1.0, 0.75]), baked(&[[[0.0; 3]; 3]]));
    let segments = [2.0, 1.0].map(|length| {
        bake(&shapes::segment([0.0, 0.0, -length / 2.0], [0.0, 0.0, length / 2.0]), &Options::default())
    });
    for querier in &mut queriers() {
        for radius in [1e-3, 1e-5, 1e-6] {
            let ball = point.all().rounded(radius).unwrap();
            let found = querier
                .separation(block.all(), ball, &translation(0.25, 0.0, 0.0), [0.0, 0.0, -1.0])
                .unwrap();
            let expected = 0.75 + radius;
            assert!(found.lower <= expected + 1e-12 && expected <= found.upper + 1e-12, "{found:?}");
            assert!(found.upper < expected + 1e-9, "{found:?}");
        }
        for radius in [1e16, 1e18, 2f64.powi(100), 2f64.powi(117)] {
            let [small, large] = [(0, 0.5), (1, radius)].map(|(n, r)| segments[n].all().rounded(r).unwrap());
            let found = querier
                .penetration(small, large, &translation(1.0, 0.25, 0.0), &PenetrationOptions::new())
                .unwrap();
            assert!(
                found.lower <= radius * (1.0 + 1e-9) && radius * (1.0 - 1e-9) <= found.upper,
                "{found:?}"
            );
        }
    }
}

/// Points, segments, boxes and prisms with and without radii, on a grid on which many only just touch: at an edge, a corner, or where a
/// point is on a surface.
#[test]
fn shapes_on_a_grid_have_depths_where_they_only_touch() {
    let (mut queriers, mut random) = (queriers(), Random::new(62));
    let options = PenetrationOptions::new();
    let core = |mesh: Mesh| bake(&mesh, &Options::default());
    let cores = [
        core(shapes::point([0.0; 3])),
        core(shapes::cloud(&[[1.0, 0.5, 0.0], [-1.0, -1.0, -1.0], [0.0, 0.5, 1.0]])),
        core(shapes::segment([0.0, 0.0, -0.5], [0.0, 0.0, 0.5])),
        core(shapes::block([1.0; 3]).unwrap()),
        core(shapes::block([0.5, 2.0, 1.5]).unwrap()),
        core(shapes::cylinder(0.5, 1.0, 0.001).unwrap().mesh),
    ];
    let radii = [0.0, 0.25, 0.5, 1.0];
    let mut touching = 0;
    for _ in 0..rounds(600) {
        let [a, b] = [(); 2].map(|()| {
            let core = &cores[random.below(cores.len())];
            (core, core.all().rounded(radii[random.below(radii.len())]).unwrap())
        });
        let at = [(); 3].map(|()| random.below(17) as f64 / 4.0 - 2.0);
        let pose = translation(at[0], at[1], at[2]);
        let what = format!("{:?} and {:?} at {at:?}", a.1, b.1);
        let first = queriers[0].signed_distance(a.1, b.1, &pose, &options).expect(&what);
        let gap = queriers[0].distance(a.0, b.0, &pose).unwrap().distance - a.1.radius() - b.1.radius();
        let [relation, of_cores] =
            [(a.1, b.1), (a.0.all(), b.0.all())].map(|(a, b)| queriers[0].relation(a, b, &pose).unwrap());
        // What has no inside has a distance only.
        assert!(
            !first.is_signed || (first.lower > 0.0) == (relation == Relation::Apart),
            "{first:?}: {what}"
        );
        for querier in &mut queriers {
            assert_eq!(querier.signed_distance(a.1, b.1, &pose, &options).as_ref(), Ok(&first), "{what}");
            let found = querier.penetration(a.1, b.1, &pose, &options).expect(&what);
            assert!(
                0.0 <= found.lower && found.lower <= found.upper && found.upper < 20.0,
                "{found:?}: {what}"
            );
            let t = found.translation;
            let moved = translation(at[0] + t[0], at[1] + t[1], at[2] + t[2]);
            assert_eq!(querier.relation(a.1, b.1, &moved), Ok(Relation::Apart), "{found:?}: {what}");
            // Cores that are as far apart as the radii add up to: there is no depth, but for roundings.
            if gap.abs() < 1e-12 && of_cores == Relation::Apart {
                assert!(found.lower < 1e-12 && found.upper < 1e-9, "{found:?}: {what}");
                touching += 1;
            }
        }
    }
    assert!(touching > 10, "{touching}");
}

/// A ball that moves past another one leaves it where the centres are as far apart as both radii; one that is inside a cube
/// leaves it with its far side.
#[test]
fn balls_leave_where_their_radii_say() {
    let (point, cube) = (baked(&[[[0.0; 3]; 3]]), block([1.0; 3]));
    let (ball, small) = (point.all().rounded(0.5).unwrap(), point.all().rounded(0.25).unwrap());
    let mut random = Random::new(3);
    for querier in &mut queriers() {
        for _ in 0..40 {
            let at = random.point().map(|x| 0.4 * x);
            let d = random.point();
            let norm = d.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (along, square) =
                ((0..3).map(|k| at[k] * d[k] / norm).sum::<f64>(), at.iter().map(|x| x * x).sum::<f64>());
            let of_balls = (along * along - square + 0.75 * 0.75).sqrt() - along;
            let pose = translation(at[0], at[1], at[2]);
            let found = querier.separation(ball, small, &pose, d).unwrap();
            assert!(
                found.lower <= of_balls + 1e-12 && of_balls <= found.upper + 1e-12,
                "{found:?} {of_balls}"
            );
            assert!(found.lower > 0.5 * of_balls && found.upper < 1.5 * of_balls, "{found:?} {of_balls}");
            let axis = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]][random.below(2)];
            let of_cube = 1.25 - (0..3).map(|k| at[k] * axis[k]).sum::<f64>();
            let found = querier.separation(&cube, small, &pose, axis).unwrap();
            assert!(found.lower <= of_cube + 1e-12 && of_cube <= found.upper + 1e-12, "{found:?} {of_cube}");
            assert!(found.upper < 1.01 * of_cube, "{found:?} {of_cube}");
        }
    }
}

/// A sheet of which both sides are in the mesh encloses nothing.
#[test]
fn a_sheet_is_not_deep() {
    let front = plate(2);
    let back = front.iter().map(|&[p, q, r]| [p, r, q]);
    let sheet = bake(&mesh(&front.iter().copied().chain(back).collect::<Vec<_>>()), &Options::default());
    let cube = block([0.5; 3]);
    let found = penetration(&mut queriers(), &cube, &sheet, &translation(0.0, 0.0, 0.125));
    assert_eq!(found.lower, 0.0, "{found:?}");
}

#[test]
fn invalid_questions_are_refused() {
    let mut querier = Querier::new().unwrap();
    let (cube, open) = (block([1.0; 3]), baked(&plate(2)));
    let near = translation(0.5, 0.25, 0.0);
    for direction in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
        let refused = querier.separation(&cube, &cube, &near, direction).unwrap_err();
        assert!(refused.to_string().starts_with("direction: expected"), "{refused}");
    }
    for gap in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = querier.penetration(&cube, &cube, &near, &PenetrationOptions::new().relative_gap(gap));
        assert!(refused.unwrap_err().to_string().starts_with("relative_gap: expected"), "{gap}");
    }
    for tolerance in [-1.0, f64::NAN, f64::INFINITY] {
        let refused =
            querier.penetration(&cube, &cube, &near, &PenetrationOptions::new().tolerance(tolerance));
        assert!(refused.unwrap_err().to_string().starts_with("tolerance: expected"), "{tolerance}");
    }
    for (a, b) in [(&cube, &open), (&open, &cube)] {
        let rounded = a.all().rounded(0.125).unwrap();
        let refused = querier.penetration(rounded, b, &near, &PenetrationOptions::new()).unwrap_err();
        assert!(matches!(refused, QueryError::NotClosed { object: 0, edges: Some(_) }));
        assert!(matches!(
            querier.separation(a, b, &near, [1.0, 0.0, 0.0]).unwrap_err(),
            QueryError::NotClosed { object: 0, edges: Some(_) }
        ));
    }
}

/// Spheres that are not known to be convex, because one has a part somewhere else.
fn spheres() -> (Bvh, Bvh) {
    let mut parts = outward(sphere(2));
    parts.extend(at(&outward(cube()), 1.0, [0.0, 0.0, 9.0]));
    (baked(&parts), baked(&outward(sphere(3))))
}

/// However small it is, the bounds that were found before it was spent hold.
#[test]
fn a_spent_budget_leaves_the_bounds_so_far() {
    let mut querier = Querier::new().unwrap();
    let (a, b) = spheres();
    let pose = translation(1.25, 0.25, 0.125);
    let whole = querier.penetration(&a, &b, &pose, &PenetrationOptions::new()).unwrap();
    assert!(!whole.is_spent);
    let (mut refused, mut spent) = (0, 0);
    for budget in (0..400).chain((400..40_000).step_by(997)) {
        querier.set_budget(budget);
        match querier.penetration(&a, &b, &pose, &PenetrationOptions::new()) {
            Err(error) => {
                assert_eq!(error, QueryError::Budget { visits: budget });
                refused += 1;
            }
            Ok(found) => {
                assert!(found.lower <= whole.upper && whole.lower <= found.upper, "{found:?} {whole:?}");
                let [x, y, z] = [0, 1, 2].map(|k| pose.translation()[k] + found.translation[k]);
                querier.set_budget(u64::MAX);
                assert_eq!(querier.relation(&a, &b, &translation(x, y, z)).unwrap(), Relation::Apart);
                spent += u32::from(found.is_spent);
            }
        }
    }
    assert!(refused > 0 && spent > 100, "{refused} {spent}");
}

/// It is enough to know on which side of the tolerance the depth is.
#[test]
fn a_tolerance_ends_the_search() {
    let mut querier = Querier::new().unwrap();
    let (a, b) = spheres();
    let pose = translation(1.25, 0.25, 0.125);
    let mut ask = |options: &PenetrationOptions| {
        let found = querier.penetration(&a, &b, &pose, options).unwrap();
        (found, querier.stats().node_tests)
    };
    let (whole, all) = ask(&PenetrationOptions::new().relative_gap(1e-9));
    let (deeper, few) = ask(&PenetrationOptions::new().tolerance(0.01));
    assert!(deeper.lower > 0.01 && few < all, "{deeper:?} {few} {all}");
    let tolerance = 1.1 * whole.upper;
    let (less, few) = ask(&PenetrationOptions::new().tolerance(tolerance));
    assert!(less.upper <= tolerance && few < all, "{less:?} {few} {all}");
}
