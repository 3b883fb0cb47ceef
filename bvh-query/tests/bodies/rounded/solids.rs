//! What is inside a solid touches it: meshes, points that move into it, and clouds.

use crate::common::shapes::{cube, outward, plate};
use crate::common::{Random, bake, baked, queriers, random_pose, stored, translation};
use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Pose, Querier, QueryError, Side, Tracker};

/// What is inside a solid cube touches it, whatever moves, and from either side.
#[test]
fn what_is_inside_a_solid_touches_it() {
    let mut queriers = queriers();
    let cube = baked(&outward(cube()));
    let solid = cube.all().solid().unwrap();
    let part = [[0.125, 0.0, 0.0], [0.25, 0.0, 0.0], [0.125, 0.125, 0.0]];
    for core in [vec![[part[0]; 3]], vec![[part[0], part[1], part[1]]], vec![part], vec![part, [[9.0; 3]; 3]]]
    {
        let small = baked(&core);
        for querier in &mut queriers {
            for (pose, is_inside) in [
                (translation(0.0, 0.0, 0.0), true),
                (translation(0.5, -0.5, 0.0), true),
                (translation(2.0, 0.0, 0.0), false),
            ] {
                let identity = translation(-pose.translation()[0], -pose.translation()[1], 0.0);
                assert!(!querier.collide(&cube, &small, &pose).unwrap());
                assert_eq!(querier.collide(solid, &small, &pose).unwrap(), is_inside);
                assert_eq!(querier.collide(&small, solid, &identity).unwrap(), is_inside);
                assert_eq!(Tracker::new().collide(querier, solid, &small, &pose).unwrap(), is_inside);
                let answer = querier.distance(solid, &small, &pose).unwrap();
                assert_eq!(answer.distance == 0.0, is_inside);
                assert_eq!((answer.point_a == answer.point_b, answer.upper == 0.0), (is_inside, is_inside));
                assert_eq!(querier.within(solid, &small, &pose, 0.0625).unwrap(), is_inside);
            }
        }
    }
    // Cells that have only an edge or a corner in common are solid, too.
    let cells = bvh_bake::shapes::voxels(&[[0, 0, 0], [1, 1, 0], [2, 2, 1]], 1.0).unwrap();
    let cells = bake(&cells, &bvh_bake::Options::default());
    let (solid, point) = (cells.all().solid().unwrap(), baked(&[[[0.5, 0.5, 0.5]; 3]]));
    for (x, y, z, is_inside) in
        [(0.0, 0.0, 0.0, true), (1.0, 1.0, 0.0, true), (2.0, 2.0, 1.0, true), (1.0, 0.0, 0.0, false)]
    {
        assert_eq!(queriers[0].collide(solid, &point, &translation(x, y, z)).unwrap(), is_inside);
    }
    let open = baked(&plate(2));
    assert!(matches!(open.all().solid().unwrap_err(), QueryError::NotClosed { object: 0, edges: Some(_) }));
}

/// A point passes a face at one moment only, which no tested pose need hit; what is inside afterwards is a hit.
#[test]
fn a_point_that_goes_into_a_solid_hits_it() {
    let mut queriers = queriers();
    let (cube, point) = (baked(&outward(cube())), baked(&[[[0.0; 3]; 3]]));
    let solid = cube.all().solid().unwrap();
    let options = MotionOptions::new();
    for (from, to) in [
        ([3.1, 0.1, 0.2], [0.1, 0.2, 0.1]),
        ([3.3, 0.3, 0.1], [-2.9, 0.1, -0.3]),
        ([0.1, 0.1, 0.1], [0.3, 0.2, 0.1]),
        ([0.1, 0.1, 0.1], [5.3, 0.2, 0.1]),
    ] {
        let pose = |at: [f64; 3]| translation(at[0], at[1], at[2]);
        let path = Motion::between(&pose(from), &pose(to)).unwrap();
        let expected = if from[0] > 1.0 { (1.0 - from[0]) / (to[0] - from[0]) } else { 0.0 };
        let mut answers = Vec::new();
        for querier in &mut queriers {
            let answer = querier.motion(solid, &point, &path, &options).unwrap();
            let MotionAnswer::Hit { free_until, touching_at, nearest } = answer else { panic!("{answer:?}") };
            assert!(
                free_until <= expected && expected <= touching_at && touching_at - free_until < 1e-5,
                "{answer:?}"
            );
            assert_eq!(nearest.distance, 0.0);
            assert!(!querier.is_free(solid, &point, &path, &options).unwrap());
            answers.push(answer);
        }
        assert!(answers.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

/// Whether a point of a large cloud is inside a solid, against the side of each point.
#[test]
fn clouds_are_inside_solids_where_a_point_is() {
    let mut random = Random::new(91);
    for origin in [0.0, 1e6] {
        let points: Vec<[f64; 3]> = (0..3000).map(|_| random.point().map(|c| origin + c)).collect();
        let bake = |mesh: &bvh_bake::mesh::Mesh| {
            Bvh::from_bytes(bvh_bake::to_bytes(mesh, &bvh_bake::Options::default()).unwrap().0).unwrap()
        };
        let cloud = bake(&bvh_bake::shapes::cloud(&points));
        let block = bake(&bvh_bake::shapes::block([0.3, 0.2, 0.1]).unwrap());
        let solid = block.all().solid().unwrap();
        let (mut inside, mut outside) = (0, 0);
        for querier in &mut queriers() {
            for _ in 0..60 {
                let pose = random_pose(&mut random, 1.2);
                let place = [0, 1, 2].map(|k| pose.translation()[k] + origin);
                let pose = Pose::nearest(*pose.rotation(), place).unwrap();
                let is_in = |point: &[f64; 3], querier: &mut Querier| {
                    querier.side(solid.at(&pose), *point).unwrap() != Side::Outside
                };
                let stored: Vec<[f64; 3]> = stored(&cloud).iter().map(|point| point.corners[0]).collect();
                let expected = stored.iter().any(|point| is_in(point, querier));
                assert_eq!(querier.collide(&cloud, solid, &pose).unwrap(), expected);
                let found = querier.distance(&cloud, solid, &pose).unwrap();
                assert_eq!(found.distance == 0.0, expected);
                assert!(!expected || is_in(&found.point_a, querier));
                inside += usize::from(expected);
                outside += usize::from(!expected);
            }
        }
        assert!(inside > 20 && outside > 20, "{inside} {outside}");
    }
}
