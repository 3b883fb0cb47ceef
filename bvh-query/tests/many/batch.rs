//! Checks that batches answer as a querier does pose by pose, and stop at the same pose, on any number of threads.
use crate::common::shapes::{cube, dirty, moved, soup, sphere, torus};
use crate::common::{Random, backends, bake, baked, mesh, options, random_pose, translation};
use bvh_bake::Options;
use bvh_bake::mesh::Mesh;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{
    Backend, Batch, Bvh, ClashOptions, PatchOptions, PenetrationOptions, Pose, Querier, QueryError, Tracker,
};

fn pools() -> Vec<cbvh_testkit::Pool> {
    [1, 2, 3, 8].map(cbvh_testkit::pool).into()
}

/// Makes poses, first along a line through the mesh, then anywhere.
fn poses(random: &mut Random, count: usize) -> Vec<Pose> {
    let along = |i: usize| translation(3.0 - i as f64 / 64.0, 0.25, 0.125);
    (0..count).map(|i| if i < count / 2 { along(i) } else { random_pose(random, 2.5) }).collect()
}

#[test]
fn batches_answer_as_one_by_one() {
    let a = bake(&mesh(&dirty(&soup(300, 4), 5)), &options(Profile::Dop14U8, TriangleEncoding::F32));
    let b = bake(&mesh(&torus(12, 8)), &options(Profile::Dop26U4, TriangleEncoding::Packed));
    let mut random = Random::new(3);
    let pools = pools();
    for backend in backends() {
        let mut querier = Querier::with_backend(backend);
        let batch = Batch::with_backend(&a, &b, backend);
        for count in [0, 1, 2, 31, 33, 64, 400] {
            let poses = poses(&mut random, count);
            let collide: Vec<_> = poses.iter().map(|p| querier.collide(&a, &b, p).unwrap()).collect();
            let contacts: Vec<_> = poses.iter().map(|p| querier.contacts(&a, &b, p).unwrap()).collect();
            let distance: Vec<_> = poses.iter().map(|p| querier.distance(&a, &b, p).unwrap()).collect();
            let within: Vec<_> = poses.iter().map(|p| querier.within(&a, &b, p, 0.2).unwrap()).collect();
            let first = collide.iter().position(|touching| *touching);
            for pool in &pools {
                pool.install(|| {
                    assert_eq!(batch.collide(&poses), Ok(collide.clone()));
                    assert_eq!(batch.contacts(&poses), Ok(contacts.clone()));
                    assert_eq!(batch.distances(&poses), Ok(distance.clone()));
                    assert_eq!(batch.within(&poses, 0.2), Ok(within.clone()));
                    assert_eq!(batch.first_collision(&poses), Ok(first));
                });
            }
        }
    }
}

#[test]
fn batches_answer_about_overlaps_as_one_by_one() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let poses = poses(&mut Random::new(5), 48);
    let (depth, patch) =
        (PenetrationOptions::new().relative_gap(0.5), PatchOptions::new().max_contacts(20).max_points(6));
    let clash = ClashOptions::new().clearance(0.5).tolerance(0.1).magnitudes(true);
    let up = [0.0, 0.0, 2.0];
    let mut querier = Querier::new().unwrap();
    let (mut separations, mut penetrations, mut clashes) = (vec![], vec![], vec![]);
    let (mut regions, mut patches) = (vec![], vec![]);
    let (mut intersections, mut surfaces) = (vec![], vec![]);
    for pose in &poses {
        separations.push(querier.separation(&a, &b, pose, up).unwrap());
        penetrations.push(querier.penetration(&a, &b, pose, &depth).unwrap());
        clashes.push(querier.clash(&a, &b, pose, &clash).unwrap());
        intersections.push(querier.intersection(&a, &b, pose).unwrap());
        surfaces.push(querier.intersection_surface(&a, &b, pose).unwrap());
        regions.push(querier.contact_regions(&a, &b, pose, 10).unwrap());
        patches.push(querier.patches(&a, &b, pose, &patch).unwrap());
    }
    assert!(penetrations.iter().any(|of| of.lower > 0.0) && regions.iter().any(|of| of.is_truncated()));
    assert!(clashes.iter().any(|of| of.magnitudes.is_some()));
    assert!(intersections.iter().any(|of| of.volume > 0.0) && surfaces.iter().any(|of| of.points.is_empty()));
    let batch = Batch::new(&a, &b).unwrap();
    for pool in &pools() {
        pool.install(|| {
            assert_eq!(batch.separations(&poses, up), Ok(separations.clone()));
            assert_eq!(batch.penetrations(&poses, &depth), Ok(penetrations.clone()));
            assert_eq!(batch.clashes(&poses, &clash), Ok(clashes.clone()));
            assert_eq!(batch.intersections(&poses), Ok(intersections.clone()));
            assert_eq!(batch.intersection_surfaces(&poses), Ok(surfaces.clone()));
            assert_eq!(batch.contact_regions(&poses, 10), Ok(regions.clone()));
            assert_eq!(batch.patches(&poses, &patch), Ok(patches.clone()));
        });
    }
    // Numbers are checked even without poses.
    assert!(batch.separations(&[], [0.0; 3]).is_err());
    assert!(batch.penetrations(&[], &depth.relative_gap(0.0)).is_err());
    assert!(batch.clashes(&[], &clash.clearance(-1.0)).is_err());
    assert!(batch.patches(&[], &patch.tolerance(-1.0)).is_err());
}

/// Of many contacts, it must not matter which one some thread finds first.
#[test]
fn the_first_collision_is_the_first_wherever_it_is() {
    let a = baked(&sphere(3));
    let (near, far) = (translation(1.5, 0.0, 0.0), translation(2.5, 0.0, 0.0));
    let batch = Batch::new(&a, &a).unwrap();
    let pools = pools();
    let mut random = Random::new(8);
    for count in [1, 5, 40, 700] {
        for _ in 0..30 {
            let mut poses = vec![far; count];
            assert_eq!(batch.first_collision(&poses), Ok(None));
            let first = random.below(count);
            poses[first] = near;
            for _ in 0..random.below(20) {
                poses[first + random.below(count - first)] = near;
            }
            for pool in &pools {
                assert_eq!(pool.install(|| batch.first_collision(&poses)), Ok(Some(first)));
            }
        }
    }
}

/// Bakes two cubes as two objects, at -3 and at 3, and changes one byte in the page of the second one.
fn half_damaged() -> Bvh {
    let mut split = Mesh::default();
    for (number, x) in [(0, -3.0), (1, 3.0)] {
        let mut object = mesh(&moved(&cube(), 1.0, [x, 0.0, 0.0])).objects.remove(0);
        object.name = format!("cube {number}");
        object.triangle_ids = (12 * number..12 * (number + 1)).collect();
        split.objects.push(object);
    }
    let good = bake(&split, &Options::default().split_objects(true));
    let page = good.objects()[1].record().first_page.get();
    let mut bytes = good.bytes().to_vec();
    bytes[good.layout().page_offset(page) as usize + 100] ^= 1;
    Bvh::from_bytes(bytes).unwrap()
}

#[test]
fn a_batch_ends_at_its_first_error_or_contact() {
    let a = half_damaged();
    let b = baked(&moved(&cube(), 0.5, [0.0; 3]));
    let (hit, free, error) =
        (translation(-3.0, 1.25, 0.0), translation(0.0, 50.0, 0.0), translation(3.0, 1.25, 0.0));
    let mut querier = Querier::new().unwrap();
    assert_eq!(querier.collide(&a, &b, &hit), Ok(true));
    assert_eq!(querier.collide(&a, &b, &free), Ok(false));
    let refused = querier.collide(&a, &b, &error).unwrap_err();
    assert!(matches!(refused, QueryError::Damaged(_)));
    let batch = Batch::new(&a, &b).unwrap();
    let pools = pools();
    let mut random = Random::new(15);
    for count in [3, 50, 600] {
        for _ in 0..30 {
            let mut poses = vec![free; count];
            for _ in 0..1 + random.below(6) {
                poses[random.below(count)] = [hit, error][random.below(2)];
            }
            let first_error = poses.iter().position(|pose| *pose == error);
            let first =
                poses.iter().position(|pose| *pose != free).filter(|first| Some(*first) != first_error);
            let expected = match (first, first_error) {
                (None, Some(_)) => Err(refused.clone()),
                (first, _) => Ok(first),
            };
            let all: Result<Vec<bool>, _> = match first_error {
                Some(_) => Err(refused.clone()),
                None => Ok(poses.iter().map(|pose| *pose == hit).collect()),
            };
            for pool in &pools {
                assert_eq!(pool.install(|| batch.first_collision(&poses)), expected);
                assert_eq!(pool.install(|| batch.collide(&poses)), all);
            }
        }
    }
}

/// A batch returns the error of the first pose that fails, not the error that a thread met first. Different poses
/// need different pages.
#[test]
fn the_error_is_that_of_the_first_pose() {
    let good = bake(&mesh(&soup(900, 1)), &options(Profile::Dop14U8, TriangleEncoding::F32));
    let mut bytes = good.bytes().to_vec();
    let layout = good.layout();
    (1..layout.page_count()).for_each(|page| bytes[layout.page_offset(page) as usize + 200] ^= 1);
    let damaged = Bvh::from_bytes(bytes).unwrap();
    let other = baked(&moved(&cube(), 0.05, [0.0; 3]));
    let mut random = Random::new(2);
    let mut errors = Vec::new();
    for _ in 0..40 {
        let poses: Vec<_> = (0..100).map(|_| random_pose(&mut random, 1.0)).collect();
        let mut querier = Querier::new().unwrap();
        // There is no tracker here, because contacts do not use one.
        let one_by_one: Result<Vec<_>, _> =
            poses.iter().map(|pose| querier.contacts(&damaged, &other, pose)).collect();
        let batch = Batch::new(&damaged, &other).unwrap();
        for pool in &pools() {
            assert_eq!(pool.install(|| batch.contacts(&poses)), one_by_one);
        }
        errors.extend(one_by_one.err().map(|error| error.to_string()));
    }
    errors.sort();
    errors.dedup();
    assert!(errors.len() > 1, "{errors:?}");
}

#[test]
fn budgets_hold_for_each_pose_and_end_batches_alike_on_any_number_of_threads() {
    let a = baked(&soup(600, 4));
    let mut random = Random::new(31);
    let poses = poses(&mut random, 200);
    let mut querier = Querier::with_backend(Backend::Scalar);
    let ends = |querier: &mut Querier, budget: u64| {
        querier.set_budget(budget);
        let mut tracker = Tracker::new();
        poses.iter().position(|pose| tracker.distance(querier, &a, &a, pose).is_err())
    };
    let mut batch = Batch::with_backend(&a, &a, Backend::Scalar);
    for budget in [0, 10, 60, 200, 1000] {
        batch.set_budget(budget);
        let answers: Vec<_> = pools().iter().map(|pool| pool.install(|| batch.distances(&poses))).collect();
        assert!(answers.iter().all(|answer| *answer == answers[0]), "budget {budget}");
        // Each thread's run is shorter than this tracker's, which changes the visits. Still, no query fits in a
        // budget of 0.
        assert!(budget > 0 || (answers[0].is_err() && ends(&mut querier, budget) == Some(0)));
    }
    batch.set_budget(u64::MAX);
    assert!(batch.distances(&poses).is_ok());
}
