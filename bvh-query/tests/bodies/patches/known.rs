//! Patches of configurations whose number, size, direction and depth are known.

use super::{block, dot, expect_close, is_close, only, patches, patches_of, querier};
use crate::common::shapes::{outward, sphere};
use crate::common::{Random, Triangle, baked, random_pose, rotation, translation};
use bvh_bake::shapes;
use bvh_query::{Bvh, PatchOptions, Pose, QueryError, RegionKind};

/// A floor whose top is the plane z = 0.
fn floor() -> Vec<Triangle> {
    block([-10.0, -11.0, -5.0], [12.0, 10.0, 0.0])
}

fn at(triangles: &[Triangle], by: [f64; 3]) -> Vec<Triangle> {
    triangles.iter().map(|t| t.map(|p| [0, 1, 2].map(|k| p[k] + by[k]))).collect()
}

fn ball(levels: u32) -> Vec<Triangle> {
    outward(sphere(levels))
}

/// A turn about the y-axis by a share of a turn.
fn tilted(share: f64, to: [f64; 3]) -> Pose {
    let (sine, cosine) = (share * std::f64::consts::PI).sin_cos();
    Pose::new(rotation([0.0, sine, 0.0, cosine]), to).unwrap()
}

#[test]
fn a_block_slightly_inside_a_floor() {
    let patch = only(patches_of(&floor(), &block([1.0, 2.0, -0.125], [3.0, 5.0, 4.0])));
    expect_close(&patch.normal, &[0.0, 0.0, 1.0]);
    expect_close(&patch.center, &[2.0, 3.5, 0.0]);
    expect_close(&[patch.length, patch.area, patch.depth], &[10.0, 0.0, 0.125]);
}

/// The bottom of the block and two triangles of the floor overlap in polygons, whose areas add up.
#[test]
fn a_block_flush_on_a_floor() {
    let patch = only(patches_of(&floor(), &block([-1.0, -2.0, 0.0], [3.0, 5.0, 4.0])));
    expect_close(&patch.normal, &[0.0, 0.0, 1.0]);
    expect_close(&patch.center, &[1.0, 1.5, 0.0]);
    expect_close(&[patch.area, patch.depth], &[28.0, 0.0]);
    let outside = only(patches_of(&floor(), &block([-11.0, -2.0, 0.0], [3.0, 5.0, 4.0])));
    expect_close(&[outside.area], &[13.0 * 7.0]);
}

/// Flush in a plane that is askew, the blocks overlap by rounding only, or are apart by it.
#[test]
fn a_turned_block_on_a_turned_floor() {
    let mut random = Random::new(4);
    let (floor, cube) = (baked(&floor()), baked(&block([1.0, 2.0, -0.125], [3.0, 5.0, 4.0])));
    let flat = querier().patches(&floor, &cube, &Pose::IDENTITY, &PatchOptions::new()).unwrap().patches[0];
    for _ in 0..20 {
        // Turned about the z-axis alone.
        let [_, _, z, w] = random.quaternion();
        let length = (z * z + w * w).sqrt();
        let pose = Pose::new(rotation([0.0, 0.0, z / length, w / length]), [0.5, 0.25, 0.0]).unwrap();
        let patch = only(patches(&floor, &cube, &pose, &PatchOptions::new()).patches);
        expect_close(&patch.normal, &flat.normal);
        expect_close(&patch.center, &pose.place(flat.center));
        expect_close(&[patch.length, patch.depth], &[flat.length, flat.depth]);
    }
}

#[test]
fn a_tilted_block_is_as_deep_as_its_lowest_edge() {
    let (floor, cube) = (baked(&floor()), baked(&block([-1.0; 3], [1.0; 3])));
    for share in [0.01, 0.05, 0.125] {
        let pose = tilted(share, [0.5, 0.25, 1.0]);
        let lowest = [-1.0, 1.0].map(|x| pose.place([x, 1.0, -1.0])[2]).into_iter().fold(0.0, f64::min);
        let patch = only(patches(&floor, &cube, &pose, &PatchOptions::new()).patches);
        expect_close(&patch.normal, &[0.0, 0.0, 1.0]);
        expect_close(&[patch.depth], &[-lowest]);
    }
}

#[test]
fn a_ball_in_a_floor_however_deep() {
    for (height, levels) in [(0.9, 4), (0.5, 4), (-0.5, 3)] {
        let patch = only(patches_of(&floor(), &at(&ball(levels), [0.1, 0.2, height])));
        expect_close(&patch.normal, &[0.0, 0.0, 1.0]);
        let radius = (1.0 - height * height).sqrt();
        let depth = 1.0 - height;
        assert!((patch.depth - depth).abs() < 1e-3 * depth + 1e-6, "{patch:?}, not {depth}");
        let length = std::f64::consts::TAU * radius;
        assert!((patch.length - length).abs() < 0.02 * length, "{patch:?}, not {length}");
        assert!((patch.center[0] - 0.1).abs() + (patch.center[1] - 0.2).abs() < 5e-3, "{patch:?}");
        assert!(is_close(patch.center[2], 0.0), "{patch:?}");
    }
}

#[test]
fn two_balls_push_along_the_line_between_them() {
    let by = [0.9, -1.2, 0.8];
    let distance = dot(by, by).sqrt();
    let patch = only(patches_of(&ball(4), &at(&ball(4), by)));
    let along = dot(patch.normal, by) / distance;
    assert!(along > 0.999, "{patch:?}");
    // The facets are up to 0.003 inside of either sphere.
    assert!((0.0..7e-3).contains(&(2.0 - distance - patch.depth)), "{patch:?}");
}

/// Two cubes that stand on edges, one above the other and turned against it.
#[test]
fn edge_on_edge() {
    let cube = block([-1.0; 3], [1.0; 3]);
    let half = 2f64.sqrt();
    let lower =
        Pose::new(rotation([0.0, 0.382_683_432_365_089_8, 0.0, 0.923_879_532_511_286_7]), [0.0; 3]).unwrap();
    let upper = Pose::new(
        rotation([0.382_683_432_365_089_8, 0.0, 0.0, 0.923_879_532_511_286_7]),
        [0.0, 0.0, 2.0 * half - 0.1],
    )
    .unwrap();
    let world = |pose: &Pose| crate::common::placed(&cube, pose);
    let patch = only(patches_of(&world(&lower), &world(&upper)));
    expect_close(&patch.normal, &[0.0, 0.0, 1.0]);
    assert!((patch.depth - 0.1).abs() < 1e-5, "{patch:?}");
    assert!((patch.center[2] - (half - 0.05)).abs() < 1e-5, "{patch:?}");
}

#[test]
fn touching_in_a_corner_or_an_edge_has_a_direction() {
    // A corner on the floor, and an edge.
    let pose =
        Pose::new(rotation([0.0, 0.382_683_432_365_089_8, 0.0, 0.923_879_532_511_286_7]), [0.0; 3]).unwrap();
    let turned = crate::common::placed(&block([-1.0; 3], [1.0; 3]), &pose);
    let lowest = turned.iter().flatten().fold(0.0, |low: f64, p| low.min(p[2]));
    // On one plane in spite of rounding.
    let on_edge: Vec<Triangle> = turned
        .iter()
        .map(|t| t.map(|p| [p[0], p[1], if p[2] < lowest + 1e-3 { 0.0 } else { p[2] - lowest }]))
        .collect();
    let patch = only(patches_of(&floor(), &on_edge));
    assert!(patch.normal[2] > 0.99 && patch.depth == 0.0, "{patch:?}");
    expect_close(&[patch.length, patch.area], &[2.0, 0.0]);
    let corner = vec![
        [[0.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]],
        [[0.0; 3], [-1.0, 0.0, 2.0], [0.0, -1.0, 2.0]],
    ];
    let patch = only(patches_of(&floor(), &corner));
    expect_close(&[patch.length, patch.area, patch.depth], &[0.0; 3]);
    expect_close(&patch.center, &[0.0; 3]);
}

/// Each leg of a table has a patch of its own, each wall of a corner, and each side of a plate that is pierced.
#[test]
fn parts_that_do_not_meet_are_patches_of_their_own() {
    let mut legs = block([0.0, 0.0, 1.0], [8.0, 1.0, 2.0]);
    legs.extend(block([0.0, 0.0, -0.1], [1.0, 1.0, 1.0]));
    legs.extend(block([7.0, 0.0, -0.2], [8.0, 1.0, 1.0]));
    let two = patches_of(&floor(), &legs);
    assert_eq!(two.len(), 2, "{two:?}");
    let mut depths = [two[0].depth, two[1].depth];
    depths.sort_by(f64::total_cmp);
    expect_close(&depths, &[0.1, 0.2]);

    let mut corner = block([-3.0, -3.0, -1.0], [3.0, 3.0, 0.0]);
    corner.extend(block([-4.0, -3.0, 0.5], [-3.0, 3.0, 4.0]));
    corner.extend(block([-3.0, -4.0, 0.5], [3.0, -3.0, 4.0]));
    let three = patches_of(&corner, &at(&ball(3), [-2.05, -2.05, 0.95]));
    assert_eq!(three.len(), 3, "{three:?}");
    let mut sum = [0.0; 3];
    for patch in &three {
        expect_close(&[patch.depth], &[0.05]);
        (0..3).for_each(|k| sum[k] += patch.normal[k]);
    }
    expect_close(&sum, &[1.0, 1.0, 1.0]);

    let plate = block([-3.0, -3.0, 0.0], [3.0, 3.0, 0.5]);
    let pierced = patches_of(&plate, &block([-1.0, -1.0, -2.0], [1.0, 1.0, 2.0]));
    assert_eq!(pierced.len(), 2, "{pierced:?}");
    expect_close(&[pierced[0].normal[2].abs(), pierced[0].normal[2] + pierced[1].normal[2]], &[1.0, 0.0]);
}

/// A pipe has an inner rim, whose curve goes around the other way.
#[test]
fn both_rims_of_a_pipe_push_up() {
    let ring = |radius: f64, i: usize, z: f64| {
        let angle = std::f64::consts::TAU * (i % 24) as f64 / 24.0;
        [radius * angle.cos(), radius * angle.sin(), z]
    };
    let mut pipe = Vec::new();
    let mut quad = |[a, b, c, d]: [[f64; 3]; 4]| pipe.extend([[a, b, c], [a, c, d]]);
    for i in 0..24 {
        let at = |radius: f64, j: usize, z: f64| ring(radius, i + j, z);
        quad([at(2.0, 0, -0.1), at(2.0, 1, -0.1), at(2.0, 1, 3.0), at(2.0, 0, 3.0)]);
        quad([at(1.0, 1, -0.1), at(1.0, 0, -0.1), at(1.0, 0, 3.0), at(1.0, 1, 3.0)]);
        quad([at(1.0, 0, -0.1), at(1.0, 1, -0.1), at(2.0, 1, -0.1), at(2.0, 0, -0.1)]);
        quad([at(1.0, 1, 3.0), at(1.0, 0, 3.0), at(2.0, 0, 3.0), at(2.0, 1, 3.0)]);
    }
    let rims = patches_of(&floor(), &pipe);
    assert_eq!(rims.len(), 2, "{rims:?}");
    for rim in rims {
        expect_close(&rim.normal, &[0.0, 0.0, 1.0]);
        expect_close(&[rim.depth], &[0.1]);
    }
}

/// A curve along an edge that two triangles share counts once, and so do duplicates.
#[test]
fn what_several_contacts_have_in_common_counts_once() {
    let wall = vec![[[0.0, -1.0, -1.0], [0.0, 3.0, -1.0], [0.0, 1.0, 3.0]]];
    let crease = vec![
        [[-1.0, 0.0, 0.25], [1.0, 0.0, 0.25], [0.0, 1.0, 0.0]],
        [[1.0, 0.0, 0.25], [-1.0, 0.0, 0.25], [0.0, -1.0, 0.0]],
    ];
    let patch = only(patches_of(&wall, &crease));
    assert_eq!(patch.count, 2);
    let tent = vec![
        [[0.0, 0.5, 0.0], [0.0, 1.5, 0.0], [1.0, 1.0, 1.0]],
        [[0.0, 1.5, 0.0], [0.0, 0.5, 0.0], [-1.0, 1.0, 1.0]],
    ];
    let edge = only(patches_of(&wall, &tent));
    assert_eq!(edge.count, 2);
    expect_close(&[edge.length], &[1.0]);
    let twice: Vec<Triangle> = wall.iter().chain(&wall).copied().collect();
    let doubled = only(patches_of(&twice, &tent));
    assert_eq!(doubled.count, 4);
    expect_close(&[doubled.length], &[1.0]);
    let plate = block([0.0; 3], [1.0; 3]);
    let plates: Vec<Triangle> = plate.iter().chain(&plate).copied().collect();
    let flush = only(patches_of(&plates, &block([0.25, 0.25, 1.0], [0.75, 0.75, 2.0])));
    expect_close(&[flush.area], &[0.25]);
}

/// Both in another place: the patches move along. Exchanged: they push the other way.
#[test]
fn patches_move_with_the_meshes_and_turn_when_these_are_exchanged() {
    let (a, b) = (ball(3), block([-0.8, -0.9, -0.4], [0.7, 0.5, 2.0]));
    let (baked_a, baked_b) = (baked(&a), baked(&b));
    let mut random = Random::new(31);
    for _ in 0..10 {
        let pose = random_pose(&mut random, 0.6);
        let found = patches(&baked_a, &baked_b, &pose, &PatchOptions::new()).patches;
        let inverse = pose.inverse().unwrap();
        let exchanged = patches(&baked_b, &baked_a, &inverse, &PatchOptions::new()).patches;
        assert_eq!(found.len(), exchanged.len());
        let turn = |v: [f64; 3]| {
            let (to, from) = (pose.place(v), pose.place([0.0; 3]));
            [0, 1, 2].map(|k| to[k] - from[k])
        };
        for patch in &found {
            let is_it = |other: &&bvh_query::Patch| {
                let center = pose.place(other.center);
                (0..3).all(|k| (center[k] - patch.center[k]).abs() < 1e-9)
            };
            let other = exchanged.iter().find(is_it).unwrap();
            expect_close(&turn(other.normal).map(|x| -x), &patch.normal);
            expect_close(&[other.length, other.area, other.depth], &[patch.length, patch.area, patch.depth]);
        }
    }
}

/// Moving B out by the depth separates convex shapes, or leaves them only just touching.
#[test]
fn depth_times_normal_resolves_a_patch_of_convex_shapes() {
    let (a, b) = (baked(&block([-2.0; 3], [2.0; 3])), baked(&block([-0.5, -0.6, -0.7], [0.5, 0.6, 0.7])));
    let mut random = Random::new(32);
    let (mut resolved, mut all) = (0, 0);
    while all < 60 {
        let turn = *random_pose(&mut random, 0.0).rotation();
        let height = 2.0 + 0.9 * random.unit();
        let pose = Pose::new(turn, [0.5 * random.signed(), 0.5 * random.signed(), height]).unwrap();
        let found = patches(&a, &b, &pose, &PatchOptions::new()).patches;
        let [patch] = found[..] else { continue };
        all += 1;
        let by =
            [0, 1, 2].map(|k| pose.translation()[k] + patch.normal[k] * (patch.depth * (1.0 + 1e-9) + 1e-9));
        let moved = Pose::new(turn, by).unwrap();
        resolved += usize::from(!querier().collide(&a, &b, &moved).unwrap());
    }
    assert_eq!(resolved, all);
}

#[test]
fn rounded_shapes_push_along_the_line_between_their_cores() {
    let point = |p: [f64; 3]| baked(&[[p; 3]]);
    let (a, b) = (point([0.0; 3]), point([3.0, 4.0, 0.0]));
    let (a, b) = (a.all().rounded(2.0).unwrap(), b.all().rounded(4.0).unwrap());
    let answer = querier().patches(a, b, &Pose::IDENTITY, &PatchOptions::new()).unwrap();
    let patch = only(answer.patches);
    expect_close(&patch.normal, &[0.6, 0.8, 0.0]);
    expect_close(&[patch.depth, patch.length, patch.area], &[1.0, 0.0, 0.0]);
    expect_close(&patch.center, &[1.0, 4.0 / 3.0, 0.0]);
    assert_eq!(answer.regions[0].kind, RegionKind::Point);
    // Both triangles of the floor are near, and the one beside the ball pushes a little aside.
    let floor = baked(&floor());
    let ball = querier()
        .patches(&floor, b, &translation(0.0, 0.0, 3.5), &PatchOptions::new().tolerance(4.0))
        .unwrap();
    let patch = only(ball.patches);
    assert!(patch.normal[2] > 0.999, "{patch:?}");
    expect_close(&[patch.depth], &[0.5]);
}

#[test]
fn a_limit_keeps_the_first_contacts_and_a_budget_ends_the_question() {
    let (a, b) = (baked(&ball(3)), baked(&at(&ball(3), [0.5, 0.4, 0.3])));
    let all = patches(&a, &b, &Pose::IDENTITY, &PatchOptions::new());
    let contacts = querier().contacts(&a, &b, &Pose::IDENTITY).unwrap();
    let some = patches(&a, &b, &Pose::IDENTITY, &PatchOptions::new().max_contacts(10));
    assert!(some.is_truncated() && !all.is_truncated());
    assert_eq!((some.total, all.regions.len()), (all.total, contacts.len()));
    let mut kept: Vec<_> = some.regions.iter().map(|region| region.contact).collect();
    kept.sort_unstable();
    assert_eq!(kept, contacts[..10]);
    let none = patches(&a, &b, &Pose::IDENTITY, &PatchOptions::new().max_contacts(0));
    assert!(none.patches.is_empty() && none.is_truncated());
    let mut querier = querier();
    querier.set_budget(contacts.len() as u64);
    let refused = querier.patches(&a, &b, &Pose::IDENTITY, &PatchOptions::new());
    assert_eq!(refused, Err(QueryError::Budget { visits: contacts.len() as u64 }));
}

/// A gap between two contacts that a tolerance closes.
#[test]
fn a_tolerance_joins_what_is_near() {
    let mut legs = block([0.0, 0.0, -0.1], [1.0, 1.0, 1.0]);
    legs.extend(block([1.5, 0.0, -0.1], [2.5, 1.0, 1.0]));
    let (floor, legs): (Bvh, Bvh) = (baked(&floor()), baked(&legs));
    for (tolerance, count) in [(0.0, 2), (0.499, 2), (0.501, 1)] {
        let options = PatchOptions::new().tolerance(tolerance);
        let found = patches(&floor, &legs, &Pose::IDENTITY, &options).patches;
        assert_eq!(found.len(), count, "{tolerance} {found:?}");
        expect_close(&[found.iter().map(|patch| patch.length).sum()], &[8.0]);
    }
}

#[test]
fn meshes_apart_have_no_patches_and_shapes_of_the_baker_are_known() {
    let cube =
        bvh_bake::to_bytes(&shapes::block([2.0; 3]).unwrap(), &bvh_bake::Options::default()).unwrap().0;
    let cube = Bvh::from_bytes(cube).unwrap();
    let apart = patches(&cube, &cube, &translation(3.0, 0.0, 0.0), &PatchOptions::new());
    assert!(apart.patches.is_empty() && apart.regions.is_empty() && apart.total == 0);
    let flush = only(patches(&cube, &cube, &translation(2.0, 0.5, 0.0), &PatchOptions::new()).patches);
    expect_close(&flush.normal, &[1.0, 0.0, 0.0]);
    expect_close(&[flush.area, flush.depth], &[3.0, 0.0]);
}
