//! The signed distance is the distance of shapes that are apart and minus the depth of others, by one method for all.

use super::moved;
use crate::common::shapes::{cube, moved as at, outward, sphere};
use crate::common::{Random, bake, baked, queriers, random_pose, translation};
use bvh_bake::{Options, shapes};
use bvh_query::{
    Bvh, NumberError, OwnedShape, PenetrationOptions, Pose, Querier, QueryError, Relation, SignedDistance,
    Tracker,
};

/// Asks on all backends, through a tracker and in a batch, which all have to agree; checks what the answer says of itself.
#[track_caller]
fn signed(queriers: &mut [Querier], tracker: &mut Tracker, [a, b]: [&Bvh; 2], pose: &Pose) -> SignedDistance {
    let options = PenetrationOptions::new();
    let found = queriers[0].signed_distance(a, b, pose, &options).unwrap();
    for querier in queriers.iter_mut() {
        assert_eq!(querier.signed_distance(a, b, pose, &options), Ok(found), "{}", querier.backend());
        assert_eq!(
            tracker.signed_distance(querier, a, b, pose, &options),
            Ok(found),
            "{}",
            querier.backend()
        );
        let near = |querier: &mut Querier, margin| {
            querier.signed_distance_within(a, b, pose, margin, &options).unwrap()
        };
        assert_eq!(near(querier, found.upper.max(0.0)), Some(found), "{}", querier.backend());
        if found.lower > 0.0 {
            assert_eq!(near(querier, found.lower.next_down()), None, "{}", querier.backend());
            // Between the bounds, exact arithmetic decides.
            let is_within = querier.within(a, b, pose, found.distance).unwrap();
            assert_eq!(near(querier, found.distance), is_within.then_some(found), "{}", querier.backend());
        } else {
            assert_eq!(near(querier, 0.0), Some(found), "{}", querier.backend());
        }
    }
    assert!(found.lower <= found.distance && found.distance <= found.upper, "{found:?}");
    assert!(found.lower <= found.upper && found.is_signed && !found.is_spent, "{found:?}");
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!((length(found.normal) - 1.0).abs() < 1e-12, "{found:?}");
    if found.lower < 0.0 {
        assert!(
            (length(found.translation) + found.lower).abs() <= 1e-14 * length(found.translation),
            "{found:?}"
        );
        let free = moved(pose, found.translation);
        assert_eq!(queriers[0].relation(a, b, &free), Ok(Relation::Apart), "{found:?}");
    } else {
        assert_eq!(found.translation, [0.0; 3]);
        assert_eq!(found.upper, queriers[0].distance(a, b, pose).unwrap().upper);
    }
    // The points are on the surfaces, and as far apart along the normal as the number says.
    let along = (0..3).map(|k| found.normal[k] * (found.point_b[k] - found.point_a[k])).sum::<f64>();
    let slack = 1e-9 + 0.02 * found.lower.abs();
    assert!(found.lower - slack <= along && along <= found.upper + slack, "{along}, {found:?}");
    for (shape, pose, point) in [(a, Pose::IDENTITY, found.point_a), (b, *pose, found.point_b)] {
        let away = queriers[0].closest_point(shape.all().at(&pose), point, f64::INFINITY).unwrap().unwrap();
        assert!(away.distance <= 1e-9 + 0.02 * found.lower.abs(), "{away:?}, {found:?}");
    }
    found
}

/// A block passes through another one, from far on one side to the other: the number is a known function of the way.
#[test]
fn a_block_that_passes_through_another_one() {
    let mut queriers = queriers();
    let [a, b] = [[2.0, 4.0, 4.0], [1.0, 1.0, 1.0]]
        .map(|sides| bake(&shapes::block(sides).unwrap(), &Options::default()));
    let mut tracker = Tracker::new();
    let poses: Vec<Pose> = (-24..=24).map(|step| translation(f64::from(step) / 8.0, 0.25, 0.0)).collect();
    let mut all = Vec::new();
    for pose in &poses {
        let x = pose.translation()[0];
        let found = signed(&mut queriers, &mut tracker, [&a, &b], pose);
        let expected = x.abs() - 1.5;
        assert!(
            found.lower <= expected && expected <= found.upper && found.upper - found.lower < 1e-9,
            "{x}: {found:?}"
        );
        if x != 0.0 {
            let toward = [x.signum(), 0.0, 0.0];
            assert!((0..3).all(|k| (found.normal[k] - toward[k]).abs() < 1e-9), "{x}: {found:?}");
        }
        all.push(found);
    }
    #[cfg(feature = "parallel")]
    for querier in &queriers {
        let batch = bvh_query::Batch::with_backend(&a, &b, querier.backend());
        assert_eq!(batch.signed_distances(&poses, &PenetrationOptions::new()).as_ref(), Ok(&all));
    }
}

/// Radii are part of the shapes: the points are on what they reach, also where the cores only touch.
#[test]
fn points_are_on_the_surfaces_that_radii_make() {
    let [a, b] = [[2.0, 4.0, 4.0], [1.0, 1.0, 1.0]]
        .map(|sides| bake(&shapes::block(sides).unwrap(), &Options::default()));
    let options = PenetrationOptions::new().relative_gap(1e-9);
    for querier in &mut queriers() {
        for radii in [[0.0, 0.25], [0.125, 0.0], [0.125, 0.25]] {
            let rounded = |shape, radius| OwnedShape::from(shape).rounded(radius).unwrap();
            let [a, b] = [rounded(a.clone(), radii[0]), rounded(b.clone(), radii[1])];
            for x in [2.5, 1.625, 1.5, 1.25, 0.5, -1.25] {
                let found = querier.signed_distance(&a, &b, &translation(x, 0.25, 0.0), &options).unwrap();
                let [of_a, of_b] = [1.0 + radii[0], x.abs() - 0.5 - radii[1]];
                let toward = |point: [f64; 3]| point[0] * x.signum();
                let known = [of_b - of_a, of_b - of_a, of_a, of_b];
                let given = [found.lower, found.upper, toward(found.point_a), toward(found.point_b)];
                assert!(
                    given.iter().zip(known).all(|(x, y)| (x - y).abs() < 1e-9),
                    "{x}, {radii:?}: {found:?}"
                );
            }
        }
    }
}

/// Boxes that overlap in any way touch at the points that the answer names, once B is moved out. A facet of what they have to leave
/// is divided into triangles, only one of which has these points.
#[test]
fn boxes_meet_at_the_points_where_they_come_free() {
    let (mut querier, mut random) = (Querier::new().unwrap(), Random::new(25));
    let options = PenetrationOptions::new().relative_gap(1e-12);
    let mut deep = 0;
    for round in 0..400 {
        let mut block = || {
            let sides = random
                .point()
                .map(|x| 0.25 + if round % 4 < 2 { (8.0 * x.abs()).round() / 8.0 } else { x.abs() });
            let block = bake(&shapes::block(sides).unwrap(), &Options::default());
            OwnedShape::from(block).rounded([0.0, 0.125][round % 2]).unwrap()
        };
        let [a, b] = [block(), block()];
        // Every other one is not turned, so that many directions are as good.
        let turned = random_pose(&mut random, 0.5);
        let [x, y, z] = turned.translation().map(|x| (8.0 * x).round() / 8.0);
        let pose = if round % 4 < 2 { translation(x, y, z) } else { turned };
        let found = querier.signed_distance(&a, &b, &pose, &options).unwrap();
        if found.upper >= 0.0 {
            continue;
        }
        let off = (0..3).map(|k| (found.point_b[k] + found.translation[k] - found.point_a[k]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "round {round}: {found:?}");
        let free = moved(&pose, found.translation);
        for (shape, pose, point) in [(&a, &Pose::IDENTITY, found.point_a), (&b, &free, found.point_a)] {
            let away = querier.closest_point(shape.shape().at(pose), point, f64::INFINITY).unwrap().unwrap();
            assert!(away.distance < 1e-9, "round {round}: {away:?} {found:?}");
        }
        deep += 1;
    }
    assert!(deep > 200, "{deep}");
}

/// Meshes that are not convex, shallow and deep, one in the other, and far away.
#[test]
fn meshes_have_the_numbers_of_distance_and_penetration() {
    let (mut queriers, mut random) = (queriers(), Random::new(23));
    // Two cubes make one mesh that is not convex.
    let mut corner = outward(cube());
    corner.extend(at(&outward(cube()), 1.0, [2.5, 0.0, 0.0]));
    let [a, b] = [baked(&corner), baked(&outward(sphere(2)))];
    let options = PenetrationOptions::new();
    let (mut tracker, mut kinds) = (Tracker::new(), [0; 3]);
    for round in 0..24 {
        let turned = random_pose(&mut random, 0.0);
        let pose = Pose::new(*turned.rotation(), random.point().map(|x| 3.0 * x)).unwrap();
        let found = signed(&mut queriers, &mut tracker, [&a, &b], &pose);
        let relation = queriers[0].relation(&a, &b, &pose).unwrap();
        if relation == Relation::Apart {
            let of = queriers[0].distance(&a, &b, &pose).unwrap();
            assert_eq!(
                [found.lower, found.upper, of.distance - of.distance],
                [of.lower, of.upper, 0.0],
                "{round}"
            );
        } else {
            let of = queriers[0].penetration(&a, &b, &pose, &options).unwrap();
            assert_eq!([-found.lower, -found.upper], [of.upper, of.lower], "{round}");
            assert_eq!(found.translation, of.translation);
        }
        kinds[if relation == Relation::Apart { 0 } else { 1 }] += 1;
    }
    let small = baked(&outward(cube()).iter().map(|t| t.map(|p| p.map(|x| 0.125 * x))).collect::<Vec<_>>());
    let inside = signed(&mut queriers, &mut tracker, [&b, &small], &Pose::IDENTITY);
    assert!(inside.upper < -0.5, "{inside:?}");
    assert!(kinds[0] > 2 && kinds[1] > 2, "{kinds:?}");
}

/// Faces that touch exactly: 0 is between the bounds, which are some roundings apart. Also where nothing is convex.
#[test]
fn touching_shapes_are_at_zero() {
    let mut queriers = queriers();
    let block = bake(&shapes::block([2.0, 2.0, 2.0]).unwrap(), &Options::default());
    let mut pair = outward(cube());
    pair.extend(at(&outward(cube()), 1.0, [2.5, 0.0, 0.0]));
    for (a, b) in [(&block, &block), (&baked(&pair), &block)] {
        for shift in [[-2.0, 0.0, 0.0], [-2.0, 2.0, 0.0], [-2.0, 2.0, -2.0], [0.5, 0.5, 2.0]] {
            let pose = translation(shift[0], shift[1], shift[2]);
            for querier in &mut queriers {
                let found = querier.signed_distance(a, b, &pose, &PenetrationOptions::new()).unwrap();
                assert!(
                    found.lower <= 0.0 && found.upper >= 0.0 && found.upper - found.lower < 1e-12,
                    "{found:?}"
                );
            }
        }
    }
}

/// What has no inside has a distance, and the answer says so; radii give an inside to what they surround.
#[test]
fn what_is_not_closed_has_a_distance_only() {
    let mut queriers = queriers();
    let block = bake(&shapes::block([2.0, 2.0, 2.0]).unwrap(), &Options::default());
    let open = baked(&outward(cube())[1..]);
    let cloud = bake(&shapes::cloud(&[[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]]), &Options::default());
    let segment = bake(&shapes::segment([-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]), &Options::default());
    let options = PenetrationOptions::new();
    for querier in &mut queriers {
        for (shape, shift, expected) in [
            (&open, 3.0, 1.0),
            (&open, 2.0, 0.0),
            (&cloud, 5.0, 4.0),
            (&segment, 0.0, 0.0),
            (&cloud, -0.5, 0.5),
        ] {
            let pose = translation(0.0, 0.0, shift);
            let found = querier.signed_distance(&block, shape, &pose, &options).unwrap();
            assert!(!found.is_signed, "{found:?}");
            assert!(found.lower >= 0.0 && found.translation == [0.0; 3], "{found:?}");
            assert!(
                found.lower <= expected && expected <= found.upper && found.upper < expected + 1e-12,
                "{found:?}"
            );
        }
        // With a radius, points and segments have an inside.
        let ball = cloud.all().rounded(0.5).unwrap();
        let found =
            querier.signed_distance(block.all(), ball, &translation(0.0, 0.0, 1.25), &options).unwrap();
        assert!(found.is_signed && found.lower <= -0.25 && found.upper >= -0.25, "{found:?}");
        let refused = querier.signed_distance(&block, &block, &Pose::IDENTITY, &options.relative_gap(0.0));
        assert!(matches!(refused, Err(QueryError::Number(_))));
    }
    let untold = bake(&shapes::block([1.0; 3]).unwrap(), &Options::default().topology(false));
    assert_eq!(
        queriers[0].signed_distance(&untold, &block, &Pose::IDENTITY, &options),
        Err(QueryError::NoTopology)
    );
}

/// Shapes of all kinds are near where they are within the margin, and where they overlap without touching.
#[test]
fn what_is_near_is_within_the_margin_or_overlaps() {
    let (mut queriers, mut random, options) = (queriers(), Random::new(24), PenetrationOptions::new());
    let surface = OwnedShape::from(baked(&at(&outward(cube()), 3.0, [0.0; 3])));
    let open = OwnedShape::from(baked(&outward(cube())[1..]));
    let cloud = OwnedShape::from(bake(
        &shapes::cloud(&[[0.0; 3], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0]]),
        &Options::default(),
    ));
    let all = [
        surface.clone(),
        surface.clone().solid().unwrap(),
        surface.rounded(0.25).unwrap(),
        OwnedShape::from(baked(&outward(sphere(1)))),
        open,
        cloud.clone(),
        cloud.rounded(0.5).unwrap(),
    ];
    // Those that are farther apart, that are apart but near, that overlap or touch, and of these the ones whose surfaces are far apart.
    let mut kinds = [0; 4];
    for round in 0..600 {
        let [a, b] = [(); 2].map(|()| &all[random.below(all.len())]);
        let pose = random_pose(&mut random, [0.5, 4.0][round % 2]);
        let margin = [0.0, 0.25, 1.0][random.below(3)];
        let whole = queriers[0].signed_distance(a, b, &pose, &options).unwrap();
        let is_within = queriers[0].within(a, b, &pose, margin).unwrap();
        let expected = (is_within || whole.lower < 0.0).then_some(whole);
        for querier in &mut queriers {
            let found = querier.signed_distance_within(a, b, &pose, margin, &options).unwrap();
            assert_eq!(found, expected, "round {round}, {}", querier.backend());
        }
        kinds[match expected {
            None => 0,
            Some(found) if found.lower > 0.0 => 1,
            Some(_) if is_within => 2,
            Some(_) => 3,
        }] += 1;
    }
    assert!(kinds.iter().all(|&kind| kind > 20), "{kinds:?}");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let refused = queriers[0].signed_distance_within(&all[0], &all[1], &Pose::IDENTITY, bad, &options);
        assert!(matches!(refused, Err(QueryError::Number(NumberError::Margin(_)))), "{refused:?}");
    }
    let options = options.relative_gap(0.0);
    let refused = queriers[0].signed_distance_within(&all[0], &all[1], &Pose::IDENTITY, 1.0, &options);
    assert!(matches!(refused, Err(QueryError::Number(NumberError::RelativeGap(_)))), "{refused:?}");
}
