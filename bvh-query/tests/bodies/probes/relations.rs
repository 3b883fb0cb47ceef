//! How two meshes lie: nested, apart, touching and mixed, in poses; and what open meshes leave undefined.

use super::hard::reversed;
use super::rationals::winding;
use crate::common::shapes::{cube, moved, on_lattice, outward, plate, sphere};
use crate::common::{
    Random, Triangle, bake, baked, mesh, note, placed, queriers, random_pose, stored, translation,
};
use bvh_query::{Bvh, Pose, QueryError, Relation};
use cbvh_testkit::depth::rounds;

#[test]
fn what_is_inside_what_is_told() {
    let cube = outward(cube());
    let ball = outward(on_lattice(sphere(2)));
    let small = moved(&ball, 0.25, [0.0; 3]);
    let two = [small.clone(), moved(&ball, 0.25, [4.0, 0.0, 0.0])].concat();
    let shell = [cube.clone(), moved(&reversed(&ball), 0.5, [0.0; 3])].concat();
    let open = moved(&plate(3), 0.25, [0.0; 3]);
    let cup = ball[1..].to_vec();
    let soup: Vec<Triangle> = (0..200)
        .map(|i| {
            let at = [f64::from(i % 10) / 40.0 - 0.1, f64::from(i / 10) / 80.0 - 0.1, 0.0];
            [at, [at[0] + 0.005, at[1], 0.0], [at[0], at[1] + 0.005, 0.0]]
        })
        .collect();
    let cases = [
        ("a ball in a cube", &small, &cube, 0.0, Relation::AInB),
        ("beside it", &small, &cube, 3.0, Relation::Apart),
        ("through its wall", &small, &cube, 1.0, Relation::Touching),
        ("two balls, one of them in a cube", &two, &cube, 0.0, Relation::Mixed),
        ("a ball in the cavity of a shell", &small, &shell, 0.0, Relation::Apart),
        ("a plate in a cube", &open, &cube, 0.0, Relation::AInB),
        ("a plate beside a cube", &open, &cube, 3.0, Relation::Apart),
        ("many triangles in a cube", &soup, &cube, 0.0, Relation::AInB),
        ("a ball in a ball with a hole", &small, &cup, 0.0, Relation::Undefined),
        ("a ball beside a ball with a hole", &small, &cup, 3.0, Relation::Apart),
        ("a cube inside out around a ball", &small, &reversed(&cube), 0.0, Relation::AInB),
    ];
    for (what, a, b, along, expected) in cases {
        let (a, b) = (baked(a), baked(b));
        let mirrored = match expected {
            Relation::AInB => Relation::BInA,
            Relation::BInA => Relation::AInB,
            other => other,
        };
        for querier in &mut queriers() {
            assert_eq!(querier.relation(&a, &b, &translation(along, 0.0, 0.0)), Ok(expected), "{what}");
            assert_eq!(querier.relation(&b, &a, &translation(-along, 0.0, 0.0)), Ok(mirrored), "{what}");
        }
    }
}

/// A closed mesh that reaches out of the box of an open one: whichever corner stands for it, the answer is the same.
#[test]
fn an_open_mesh_leaves_undefined_what_may_be_in_its_box() {
    let open = baked(&[[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 4.0]]]);
    let corners = [[0.1, 0.2, 3.0], [0.1, 0.2, 9.0], [0.3, 0.2, 9.0], [0.1, 0.4, 9.0]];
    for turn in 0..4 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| corners[(i + turn) % 4]);
        let closed = baked(&outward_of([0.15, 0.25, 7.0], &[[a, b, c], [a, c, d], [a, d, b], [b, d, c]]));
        for querier in &mut queriers() {
            assert_eq!(querier.relation(&open, &closed, &Pose::IDENTITY), Ok(Relation::Undefined));
            assert_eq!(querier.relation(&closed, &open, &Pose::IDENTITY), Ok(Relation::Undefined));
            assert_eq!(querier.relation(&open, &closed, &translation(0.0, 0.0, 2.0)), Ok(Relation::Apart));
        }
    }
}

/// Turns triangles around a point such that all look away from it.
fn outward_of(middle: [f64; 3], triangles: &[Triangle]) -> Vec<Triangle> {
    let minus = moved(triangles, 1.0, middle.map(|v| -v));
    let turned = outward(minus.clone());
    triangles
        .iter()
        .zip(minus.iter().zip(&turned))
        .map(|(t, (old, new))| if old == new { *t } else { [t[0], t[2], t[1]] })
        .collect()
}

#[test]
#[cfg(feature = "parallel")]
fn a_batch_has_the_relations_of_its_poses() {
    let (cube, ball) =
        (baked(&outward(cube())), baked(&moved(&outward(on_lattice(sphere(2))), 0.25, [0.0; 3])));
    let poses: Vec<Pose> = (0..200).map(|i| translation(f64::from(i) / 100.0, 0.1, 0.0)).collect();
    let mut querier = bvh_query::Querier::new().unwrap();
    let expected: Vec<_> = poses.iter().map(|pose| querier.relation(&cube, &ball, pose).unwrap()).collect();
    assert!(
        [Relation::BInA, Relation::Touching, Relation::Apart].iter().all(|found| expected.contains(found))
    );
    assert_eq!(bvh_query::Batch::new(&cube, &ball).unwrap().relations(&poses), Ok(expected));
}

/// Random poses of closed meshes: of those that do not touch, rationals tell for one corner of each component.
#[test]
fn relations_in_poses_are_those_of_rationals() {
    let random = &mut Random::new(54);
    let ball = outward(on_lattice(sphere(1)));
    let meshes = [
        outward(cube()),
        moved(&ball, 0.3, [0.0; 3]),
        [moved(&ball, 0.2, [0.5, 0.0, 0.0]), moved(&ball, 0.2, [-0.5, 0.25, 0.0])].concat(),
        [outward(cube()), moved(&reversed(&ball), 0.9, [0.0; 3])].concat(),
    ];
    let components = [1, 1, 2, 2];
    let files: Vec<Bvh> = meshes.iter().map(|triangles| baked(triangles)).collect();
    let mut queriers = queriers();
    let mut counts = [0; 6];
    for _ in 0..rounds(150) {
        let (i, j) = (random.below(4), random.below(4));
        let reach = [0.2, 1.0, 2.0][random.below(3)];
        let pose = random_pose(random, reach);
        let mut found = None;
        for querier in &mut queriers {
            let relation = querier.relation(&files[i], &files[j], &pose).unwrap();
            assert_eq!(*found.get_or_insert(relation), relation);
        }
        let found = found.unwrap();
        counts[found as usize] += 1;
        if queriers[0].collide(&files[i], &files[j], &pose).unwrap() {
            assert_eq!(found, Relation::Touching);
            continue;
        }
        let of = |file: usize| stored(&files[file]).iter().map(|t| t.corners).collect::<Vec<_>>();
        let (a, b) = (of(i), placed(&of(j), &pose));
        // The components follow each other and are of equal size, or the cube comes first.
        let first_corners = |triangles: &[Triangle], count: usize, which: usize| match (count, which) {
            (1, _) => vec![triangles[0][0]],
            (_, 3) => vec![triangles[0][0], triangles[12][0]],
            _ => vec![triangles[0][0], triangles[triangles.len() / 2][0]],
        };
        let inside = |random: &mut Random, points: Vec<[f64; 3]>, around: &[Triangle]| {
            let mut is_in = |point: &[f64; 3]| loop {
                if let Some(winding) = winding(point, &random.point(), around) {
                    return winding != 0;
                }
            };
            let all = points.len();
            (points.iter().filter(|point| is_in(point)).count(), all)
        };
        let (a_in_b, all_a) = inside(random, first_corners(&a, components[i], i), &b);
        let (b_in_a, all_b) = inside(random, first_corners(&b, components[j], j), &a);
        let expected = match (a_in_b, b_in_a) {
            (0, 0) => Relation::Apart,
            (n, 0) if n == all_a => Relation::AInB,
            (0, n) if n == all_b => Relation::BInA,
            _ => Relation::Mixed,
        };
        assert_eq!(found, expected, "{i} {j} {pose:?}");
    }
    assert!(counts[..4].iter().all(|count| *count > 0), "{counts:?}");
    note(&format!("{counts:?} pairs touching, apart, A in B, B in A, mixed, undefined"));
}

#[test]
fn files_without_topology_say_so() {
    let options = bvh_bake::Options::default().topology(false);
    let (with, without) = (baked(&cube()), bake(&mesh(&moved(&sphere(1), 0.25, [0.0; 3])), &options));
    for querier in &mut queriers() {
        assert_eq!(querier.side(&without, [0.0; 3]), Err(QueryError::NoTopology));
        assert_eq!(querier.relation(&without, &with, &Pose::IDENTITY), Err(QueryError::NoTopology));
        assert_eq!(querier.relation(&with, &without, &Pose::IDENTITY), Err(QueryError::NoTopology));
        // What touches, touches.
        let touching = querier.relation(&with, &without, &translation(1.0, 0.0, 0.0));
        assert_eq!(touching, Ok(Relation::Touching));
    }
}
