//! Contact points of patches: where they are on bodies whose corners and depths are known, and how they change.

use super::{block, dot, expect_close, is_close, patches, querier};
use crate::common::shapes::{outward, sphere, torus};
use crate::common::{Random, Triangle, baked, random_pose, rotation, translation};
use bvh_query::{Bvh, PatchOptions, PatchPoint, Pose, Querier, QueryError};

fn points(a: &[Triangle], b: &[Triangle], pose: &Pose, most: usize) -> Vec<PatchPoint> {
    patches(&baked(a), &baked(b), pose, &PatchOptions::new().max_points(most)).points
}

fn floor() -> Vec<Triangle> {
    block([-10.0, -11.0, -5.0], [12.0, 10.0, 0.0])
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    let v = [0, 1, 2].map(|k| p[k] - q[k]);
    dot(v, v).sqrt()
}

/// The area of a convex polygon in a plane of equal z whose corners are given in any order.
fn area(points: &[PatchPoint]) -> f64 {
    let count = points.len() as f64;
    let [x, y] = [0, 1].map(|k| points.iter().map(|of| of.point[k]).sum::<f64>() / count);
    let mut around: Vec<_> = points.iter().map(|of| [of.point[0] - x, of.point[1] - y]).collect();
    around.sort_by(|p, q| p[1].atan2(p[0]).total_cmp(&q[1].atan2(q[0])));
    let next = around.iter().cycle().skip(1);
    around.iter().zip(next).map(|(p, q)| (p[0] * q[1] - p[1] * q[0]) / 2.0).sum()
}

/// Panics unless there are the expected points, in any order.
#[track_caller]
fn expect_points(found: &[PatchPoint], expected: &[[f64; 3]], within: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for point in expected {
        assert!(found.iter().any(|of| distance(of.point, *point) <= within), "no {point:?} in {found:?}");
    }
}

/// Cuts each triangle into 4^`levels`.
fn finer(triangles: Vec<Triangle>, levels: u32) -> Vec<Triangle> {
    let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
    (0..levels).fold(triangles, |triangles, _| {
        let split = |[a, b, c]: Triangle| {
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        triangles.into_iter().flat_map(split).collect()
    })
}

/// The middles between the four lower corners of a block and the floor above them.
fn middles(pose: &Pose, low: [f64; 3], high: [f64; 3]) -> [[f64; 3]; 4] {
    let corners = [[low[0], low[1]], [low[0], high[1]], [high[0], low[1]], [high[0], high[1]]];
    corners.map(|[x, y]| pose.place([x, y, low[2]])).map(|[x, y, z]| [x, y, z / 2.0])
}

#[test]
fn a_box_on_a_floor_has_its_four_corners() {
    let (low, high) = ([1.0, 2.0, -0.125], [3.0, 5.0, 4.0]);
    let expected = middles(&Pose::IDENTITY, low, high);
    for most in 1..=20 {
        let found = points(&floor(), &block(low, high), &Pose::IDENTITY, most);
        assert_eq!(found.len(), most.min(4));
        for of in &found {
            assert!(expected.iter().any(|point| distance(of.point, *point) < 1e-9), "{of:?}");
            expect_close(&of.normal, &[0.0, 0.0, 1.0]);
            expect_close(&[of.depth], &[0.125]);
        }
        if most == 2 {
            expect_close(&[distance(found[0].point, found[1].point)], &[13f64.sqrt()]);
        }
        if most > 3 {
            expect_points(&found, &expected, 1e-9);
            expect_close(&[area(&found)], &[6.0]);
        }
    }
    assert!(points(&floor(), &block(low, high), &Pose::IDENTITY, 0).is_empty());
    // Flush, the corners are those of the polygons, and there is no depth.
    let flush = points(&floor(), &block([1.0, 2.0, 0.0], high), &Pose::IDENTITY, 4);
    expect_points(&flush, &middles(&Pose::IDENTITY, [1.0, 2.0, 0.0], high), 1e-9);
    assert!(flush.iter().all(|of| of.depth == 0.0 && of.normal == [0.0, 0.0, 1.0]));
    // Half of it hangs over the edge of the floor: the outline is where it stands.
    let over = points(&floor(), &block([11.0, 2.0, -0.125], [13.0, 5.0, 4.0]), &Pose::IDENTITY, 6);
    let corners = [[11.0, 2.0, 0.0], [11.0, 5.0, 0.0], [12.0, 2.0, 0.0], [12.0, 5.0, 0.0]];
    for corner in corners {
        assert!(over.iter().any(|of| distance(of.point, corner) < 0.13), "{over:?}");
    }
    assert!(over.iter().all(|of| of.point[0] < 12.001 && of.depth < 0.127), "{over:?}");
}

/// All four lower corners are below the floor, each by a depth of its own.
#[test]
fn a_tilted_box_has_its_corners_at_their_own_depths() {
    let (low, high) = ([-1.0, -0.8, -0.5], [1.0, 0.8, 0.5]);
    let mut random = Random::new(3);
    for _ in 0..30 {
        // Far about the vertical, and a little about the others.
        let (z, w) = (3.0 * random.signed()).sin_cos();
        let turn = [0.005 * random.signed(), 0.005 * random.signed(), z, w];
        let length = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
        let pose = Pose::new(rotation(turn.map(|v| v / length)), [0.3, -0.2, 0.48]).unwrap();
        let found = points(&floor(), &block(low, high), &pose, 4);
        expect_points(&found, &middles(&pose, low, high), 1e-9);
        for of in &found {
            expect_close(&of.normal, &[0.0, 0.0, 1.0]);
            expect_close(&[of.depth], &[-2.0 * of.point[2]]);
        }
        assert!(found.iter().all(|of| of.depth <= found[0].depth * 1.01), "{found:?}");
    }
}

/// Triangles of the patch are smaller than the depth, so that none of them reaches the bottom.
#[test]
fn a_fine_box_has_its_corners_as_well() {
    let (low, high) = ([-1.0, -0.75, -0.25], [1.0, 0.75, 0.75]);
    let fine = finer(block(low, high), 5);
    let found = points(&floor(), &fine, &Pose::IDENTITY, 4);
    expect_points(&found, &middles(&Pose::IDENTITY, low, high), 0.01);
    assert!(found.iter().all(|of| is_close(of.depth, 0.25)), "{found:?}");
}

#[test]
fn a_box_on_its_edge_has_the_ends_of_the_edge() {
    let cube = block([-1.0; 3], [1.0; 3]);
    for share in [0.02, 0.05, 0.125] {
        let (sine, cosine) = (share * std::f64::consts::PI).sin_cos();
        let turn = rotation([0.0, sine, 0.0, cosine]);
        let lowest = turn[2][0].abs() + turn[2][2].abs();
        let pose = Pose::new(turn, [0.5, 0.25, lowest - 0.01]).unwrap();
        let ends = [-1.0, 1.0].map(|y| pose.place([1.0, y, -1.0])).map(|[x, y, z]| [x, y, z / 2.0]);
        for most in [2, 4, 8] {
            let found = points(&floor(), &cube, &pose, most);
            for end in ends {
                let of = found.iter().find(|of| distance(of.point, end) < 1e-6).unwrap();
                assert!((of.depth - 0.01).abs() < 1e-6 && is_close(of.normal[2], 1.0), "{of:?}");
            }
            let deep = found.iter().filter(|of| of.depth > 0.009);
            assert_eq!(deep.count(), 2, "{found:?}");
        }
    }
}

/// The depth of each point is that of the sphere, which the facets are a little inside of.
#[test]
fn a_ball_is_deep_in_the_middle_and_not_at_the_rim() {
    let floor = floor();
    for (height, levels) in [(0.9, 4), (0.97, 3), (0.5, 4)] {
        let ball: Vec<Triangle> = outward(sphere(levels));
        let pose = translation(0.1, 0.2, height);
        let (deepest, radius) = (1.0 - height, f64::sqrt(1.0 - height * height));
        for most in [1, 2, 3, 4, 8, 16] {
            let found = points(&floor, &ball, &pose, most);
            assert!(found.len() <= most && found.len() >= most.min(5), "{found:?}");
            assert!((found[0].depth - deepest).abs() < 0.01 * deepest + 0.003, "{found:?}");
            for of in &found {
                let [x, y, z] = of.point;
                let square = (x - 0.1).powi(2) + (y - 0.2).powi(2);
                let depth = (1.0 - square.min(1.0)).sqrt() - height;
                assert!((of.depth - depth).abs() < 0.015, "{of:?}, not {depth}");
                assert!(of.normal[2] > 0.7 && z <= 1e-9 && z >= -deepest, "{of:?}");
                assert!(square.sqrt() < radius + 1e-6, "{of:?}");
            }
            // The first one is in the middle.
            let share = area(&found[1..]) / (std::f64::consts::PI * radius * radius);
            assert!(most < 5 || share > 0.5 && share < 1.0, "{share} {found:?}");
            assert!(most < 16 || share > 0.8, "{share} {found:?}");
        }
    }
}

/// The rim of a pipe is on a ball: where it touches, each point has the direction of the ball, not that of the whole rim.
#[test]
fn points_of_a_curved_patch_have_normals_of_their_own() {
    let ball: Vec<Triangle> = outward(sphere(5));
    let ring = |radius: f64, i: usize, z: f64| {
        let angle = std::f64::consts::TAU * (i % 40) as f64 / 40.0;
        [radius * angle.cos(), radius * angle.sin(), z]
    };
    let mut pipe = Vec::new();
    let mut quad = |[a, b, c, d]: [[f64; 3]; 4]| pipe.extend([[a, b, c], [a, c, d]]);
    for i in 0..40 {
        let at = |radius: f64, j: usize, z: f64| ring(radius, i + j, z);
        quad([at(1.0, 0, 0.0), at(1.0, 1, 0.0), at(1.0, 1, 3.0), at(1.0, 0, 3.0)]);
        quad([at(0.8, 1, 0.0), at(0.8, 0, 0.0), at(0.8, 0, 3.0), at(0.8, 1, 3.0)]);
        quad([at(0.8, 0, 0.0), at(0.8, 1, 0.0), at(1.0, 1, 0.0), at(1.0, 0, 0.0)]);
        quad([at(0.8, 1, 3.0), at(0.8, 0, 3.0), at(1.0, 0, 3.0), at(1.0, 1, 3.0)]);
    }
    let answer = patches(
        &baked(&ball),
        &baked(&pipe),
        &translation(0.0, 0.0, 0.58),
        &PatchOptions::new().max_points(8),
    );
    // Those of its corners; other points are vertices of the ball in the wall of the pipe, which leave it below.
    let is_corner = |of: &&PatchPoint| {
        let to_middle = of.depth / of.normal[2] / 2.0;
        is_close(of.point[2] - to_middle, 0.58) && is_close(of.point[0].hypot(of.point[1]), 0.8)
    };
    let deep: Vec<_> = answer.points.iter().filter(is_corner).collect();
    assert!(deep.len() >= 4, "{answer:?}");
    for of in deep {
        // Its corner is 0.8 from the axis and at a height of 0.58.
        let along = dot(of.normal, of.point) / dot(of.point, of.point).sqrt();
        assert!(along > 0.995, "{of:?}");
        let depth = 1.0 - f64::sqrt(0.64 + 0.58 * 0.58);
        assert!((of.depth - depth).abs() < 0.003, "{of:?}, not {depth}");
    }
}

/// A box in a slot that is a little too narrow: its sides are in the walls, whose tops are far above it. What counts is the floor.
#[test]
fn walls_do_not_make_points_deep() {
    let profile = [
        [-5.0, -5.0],
        [-5.0, 5.0],
        [0.001, 5.0],
        [0.001, 0.0],
        [1.999, 0.0],
        [1.999, 5.0],
        [7.0, 5.0],
        [7.0, -5.0],
    ];
    let mut slot = Vec::new();
    for k in 0..profile.len() {
        let ([x, z], [u, w]) = (profile[k], profile[(k + 1) % profile.len()]);
        let [a, b, c, d] = [[x, -3.0, z], [u, -3.0, w], [u, 3.0, w], [x, 3.0, z]];
        slot.extend([[a, b, c], [a, c, d]]);
    }
    for levels in [0, 4] {
        let found =
            points(&slot, &finer(block([0.0, -0.5, -0.1], [2.0, 0.5, 0.5]), levels), &Pose::IDENTITY, 8);
        assert!(found.iter().all(|of| of.depth < 0.201), "{found:?}");
        let deep: Vec<_> = found.into_iter().filter(|of| of.depth > 0.099 && of.normal[2] > 0.99).collect();
        assert!(deep.len() >= 4, "{deep:?}");
        for corner in [[0.0, -0.5], [0.0, 0.5], [2.0, -0.5], [2.0, 0.5]] {
            let is_near = |of: &PatchPoint| (of.point[0] - corner[0]).hypot(of.point[1] - corner[1]) < 0.3;
            assert!(deep.iter().any(is_near), "{corner:?} {deep:?}");
        }
    }
}

/// Both ends of the line of a point are on the surfaces, as far apart as the depth and the normals tell.
#[test]
fn lines_of_points_end_on_both_surfaces() {
    let (a, b) = (baked(&torus(24, 12)), baked(&block([-0.3, -0.25, -0.2], [0.3, 0.25, 0.2])));
    let ball = baked(&outward(sphere(2)));
    let mut random = Random::new(7);
    let (mut seen, mut deep) = (0, 0);
    for round in 0..120 {
        let pose = random_pose(&mut random, 1.2);
        let (a, b) = if round % 2 == 0 { (&a, &b) } else { (&ball, &a) };
        let answer = patches(a, b, &pose, &PatchOptions::new().max_points(8));
        for patch in &answer.patches {
            for of in &answer.points[patch.first_point..][..patch.point_count] {
                let cosine = dot(of.normal, patch.normal);
                assert!(cosine > 0.0 && of.depth >= 0.0, "{of:?}");
                let half = of.depth / cosine / 2.0;
                let end = |sign: f64| [0, 1, 2].map(|k| of.point[k] + sign * half * patch.normal[k]);
                let mut querier = querier();
                let of_a = querier.closest_point(a, end(1.0), f64::INFINITY).unwrap().unwrap();
                let of_b =
                    querier.closest_point(b.all().at(&pose), end(-1.0), f64::INFINITY).unwrap().unwrap();
                assert!(
                    of_a.distance < 1e-9 && of_b.distance < 1e-9,
                    "{of:?}: {} {}",
                    of_a.distance,
                    of_b.distance
                );
                (seen, deep) = (seen + 1, deep + usize::from(of.depth > 0.01));
            }
        }
    }
    assert!(seen > 200 && deep > 80, "{seen} {deep}");
}

/// Each point of the one is near a point of the other.
fn farthest(one: &[PatchPoint], other: &[PatchPoint]) -> f64 {
    let near = |of: &PatchPoint| {
        let to = |with: &PatchPoint| distance(of.point, with.point) + (of.depth - with.depth).abs();
        other.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    one.iter().map(near).fold(0.0, f64::max)
}

#[test]
fn a_small_turn_moves_points_by_little() {
    let (floor, cube) = (baked(&floor()), baked(&block([-1.0, -0.8, -0.5], [1.0, 0.8, 0.5])));
    let fine = baked(&finer(block([-1.0, -0.8, -0.5], [1.0, 0.8, 0.5]), 3));
    let mut random = Random::new(8);
    for round in 0..200 {
        let (x, y, (z, w)) = (random.signed(), random.signed(), (3.0 * random.signed()).sin_cos());
        let turned = |by: f64| {
            let turn = [0.01 * x + by, 0.01 * y - by, z + by, w];
            let length = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
            Pose::new(rotation(turn.map(|v| v / length)), [0.3, -0.2, 0.45]).unwrap()
        };
        let options = PatchOptions::new().max_points(4);
        let body = if round % 4 == 0 { &fine } else { &cube };
        let before = patches(&floor, body, &turned(0.0), &options).points;
        for by in [1e-9, 1e-6, 1e-4] {
            let after = patches(&floor, body, &turned(by), &options).points;
            // A turn by t radians moves no corner by more than 2 t, and `by` is half of a turn at most.
            let moved = farthest(&before, &after).max(farthest(&after, &before));
            assert!(moved <= 12.0 * by, "{moved} {before:?} {after:?}");
        }
    }
}

/// The order of triangles changes sums by roundings, and no point by more.
#[test]
fn the_order_of_triangles_does_not_matter() {
    let mut random = Random::new(9);
    let bodies = [block([-1.0, -0.8, -0.5], [1.0, 0.8, 0.5]), outward(sphere(3)), torus(24, 12)];
    for round in 0..40 {
        let mut body = bodies[round % 3].clone();
        let mut ground = floor();
        let turn = *random_pose(&mut random, 0.0).rotation();
        let lowest = body.iter().flatten().map(|p| dot(turn[2], *p)).fold(0.0, f64::min);
        let pose = Pose::new(turn, [0.3, 0.4, -lowest - 0.02]).unwrap();
        let first = points(&ground, &body, &pose, 6);
        assert!(!first.is_empty());
        for triangles in [&mut body, &mut ground] {
            for i in (1..triangles.len()).rev() {
                triangles.swap(i, random.below(i + 1));
            }
            triangles.iter_mut().for_each(|t| t.rotate_left(random.below(3)));
        }
        let other = points(&ground, &body, &pose, 6);
        assert!(first.len() == other.len(), "{first:?} {other:?}");
        let moved = farthest(&first, &other).max(farthest(&other, &first));
        assert!(moved < 1e-9, "{moved} {first:?} {other:?}");
    }
}

/// The radius is a margin: depths are those of the cores, and negative where these are apart.
#[test]
fn radii_are_margins() {
    let (low, high) = ([-1.0, -0.75, -0.5], [1.0, 0.75, 0.5]);
    let (floor, cube) = (baked(&floor()), baked(&block(low, high)));
    let options = PatchOptions::new().tolerance(4.0).max_points(4);
    let ask = |radius_a: f64, radius_b: f64, height: f64| {
        let (a, b) = (floor.all().rounded(radius_a).unwrap(), cube.all().rounded(radius_b).unwrap());
        let pose = translation(0.5, 0.25, height + 0.5);
        let mut queriers = crate::common::queriers().into_iter();
        let ask = |mut querier: Querier| querier.patches(a, b, &pose, &options).unwrap();
        let first = ask(queriers.next().unwrap());
        queriers.for_each(|querier| assert_eq!(ask(querier), first));
        first
    };
    for (radius_a, radius_b) in [(0.1, 0.0), (0.0, 0.1), (0.06, 0.04)] {
        for height in [0.09, 0.05, 0.001, -0.001, -0.05] {
            let answer = ask(radius_a, radius_b, height);
            assert_eq!(answer.patches.len(), 1);
            let pose = translation(0.5, 0.25, height + 0.5);
            let expected = middles(&pose, low, high).map(|[x, y, _]| [x, y, height / 2.0]);
            expect_points(&answer.points, &expected, 1e-9);
            for of in &answer.points {
                expect_close(&[of.depth], &[-height]);
                assert!(of.normal[2] > 0.999_999, "{of:?}");
            }
        }
        assert!(ask(radius_a, radius_b, 0.11).points.is_empty());
    }
    // A ball around a point.
    let ball = baked(&[[[0.0, 0.0, 0.3]; 3]]);
    let ball = ball.all().rounded(0.5).unwrap();
    let found = querier().patches(&floor, ball, &Pose::IDENTITY, &options.max_points(1)).unwrap().points;
    expect_close(&found[0].point, &[0.0, 0.0, 0.15]);
    expect_close(&found[0].normal, &[0.0, 0.0, 1.0]);
    expect_close(&[found[0].depth], &[-0.3]);
}

/// Which points are wanted changes nothing else, and their rays are charged.
#[test]
fn points_cost_visits_and_leave_the_rest_alone() {
    let (floor, cube) = (baked(&floor()), baked(&block([1.0, 2.0, -0.125], [3.0, 5.0, 4.0])));
    let ask = |querier: &mut Querier, most: usize| {
        querier.patches(&floor, &cube, &Pose::IDENTITY, &PatchOptions::new().max_points(most))
    };
    let (none, some) = (ask(&mut querier(), 0).unwrap(), ask(&mut querier(), 4).unwrap());
    assert_eq!((&none.regions, none.total), (&some.regions, some.total));
    assert_eq!(
        (none.patches[0].depth, none.patches[0].normal),
        (some.patches[0].depth, some.patches[0].normal)
    );
    let least = |most: usize| {
        let enough = |visits: u64| {
            let mut querier = querier();
            querier.set_budget(visits);
            let answer = ask(&mut querier, most);
            assert!(answer.is_ok() || answer == Err(QueryError::Budget { visits }));
            answer.is_ok()
        };
        (1..10_000).find(|visits| enough(*visits)).unwrap()
    };
    // Each ray visits an object at least.
    assert!(least(4) > least(0) + 12, "{} {}", least(4), least(0));
}

/// Meshes that are not closed, needles and points have points that are finite, or none.
#[test]
fn odd_meshes_have_finite_points() {
    let mut random = Random::new(10);
    let mut corner = |scale: f64| random.point().map(|x| scale * (2.0 * x).round() / 2.0);
    for scale in [1.0, 1e-60, 1e30] {
        let mut soup = |count: usize| -> Bvh {
            let mut triangle = || [corner(scale), corner(scale), corner(scale)];
            baked(&(0..count).map(|_| triangle()).collect::<Vec<_>>())
        };
        for _ in 0..20 {
            let (a, b) = (soup(8), soup(8));
            let answer = patches(&a, &b, &Pose::IDENTITY, &PatchOptions::new().max_points(usize::MAX));
            assert!(answer.points.iter().all(|of| of.depth >= 0.0));
        }
    }
}
