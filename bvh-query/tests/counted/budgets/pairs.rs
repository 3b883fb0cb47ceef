//! Two meshes, points and lines.

use super::{BUDGETS, dust, tetrahedron, text, use_this_thread, within_budget};
use crate::common::shapes::{cube, moved, outward, sphere};
use crate::common::{Triangle, bake, baked, mesh, translation};
use crate::forged::{blown_up, duplicated, understated};
use bvh_bake::Options;
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use bvh_query::{
    Batch, Bvh, DistanceOptions, Motion, MotionOptions, OwnedShape, PatchOptions, PenetrationOptions, Pose,
    ProbeBatch, Querier, QueryError, Ray, Relation, RigidPath, Scene, Side, Tracker,
};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

/// The poses that a visit of a motion may ask its path for: each of at most 24 pairs of triangles, in 12 steps.
const POSES_PER_VISIT: u64 = 300;

/// A path that counts how often it is asked where B is.
struct Counted<'a>(&'a dyn PathAndSync, AtomicU64);

trait PathAndSync: RigidPath + Sync {}
impl<P: RigidPath + Sync> PathAndSync for P {}

impl RigidPath for Counted<'_> {
    fn pose(&self, t: f64) -> Pose {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.pose(t)
    }
    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        self.0.sagitta(radius, t0, t1)
    }
}

/// Asks with a path, and checks how often it was asked where B is.
fn along<R>(name: &str, budget: u64, path: &dyn PathAndSync, ask: impl FnOnce(&Counted<'_>) -> R) -> R {
    let counted = Counted(path, AtomicU64::new(0));
    let answer = ask(&counted);
    let (poses, most) = (counted.1.into_inner(), POSES_PER_VISIT.saturating_mul(budget.saturating_add(1)));
    assert!(poses <= most, "{name}, budget {budget}: {poses} poses, not {most}");
    answer
}

type AskPair<'a> = &'a dyn Fn(&mut Querier) -> Result<String, QueryError>;

/// Every question about two meshes.
fn each_pair_question(
    (a, b): (&Bvh, &Bvh),
    pose: &Pose,
    path: &Motion,
    budget: u64,
    mut check: impl FnMut(&str, AskPair<'_>),
) {
    let options = &MotionOptions::new();
    let (poses, paths) = ([*pose; 2], [*path; 2]);
    let mut batch = Batch::new(a, b).unwrap();
    batch.set_budget(budget);
    let batch = &batch;
    let loose = &DistanceOptions::default();
    let asks: [(&str, AskPair<'_>); 22] = [
        ("collide", &|q| text(q.collide(a, b, pose))),
        ("contacts", &|q| text(q.contacts(a, b, pose))),
        ("contact_regions", &|q| text(q.contact_regions(a, b, pose, 100))),
        ("patches", &|q| text(q.patches(a, b, pose, &PatchOptions::new().max_points(4)))),
        ("distance", &|q| text(q.distance(a, b, pose))),
        ("distance_with", &|q| text(q.distance_with(a, b, pose, loose))),
        ("within", &|q| text(q.within(a, b, pose, 5.0))),
        ("relation", &|q| text(q.relation(a, b, pose))),
        ("motion", &|q| text(along("motion", budget, path, |path| q.motion(a, b, path, options)))),
        ("is_free", &|q| text(along("is_free", budget, path, |path| q.is_free(a, b, path, options)))),
        ("Tracker::collide", &|q| text(Tracker::new().collide(q, a, b, pose))),
        ("Tracker::distance", &|q| text(Tracker::new().distance(q, a, b, pose))),
        ("Tracker::within", &|q| text(Tracker::new().within(q, a, b, pose, 5.0))),
        ("Batch::collide", &|_| text(batch.collide(&poses))),
        ("Batch::contacts", &|_| text(batch.contacts(&poses))),
        ("Batch::distances", &|_| text(batch.distances(&poses))),
        ("Batch::within", &|_| text(batch.within(&poses, 5.0))),
        ("Batch::relations", &|_| text(batch.relations(&poses))),
        ("Batch::first_collision", &|_| text(batch.first_collision(&poses))),
        ("Batch::motions", &|_| text(batch.motions(&paths, options))),
        ("Batch::are_free", &|_| text(batch.are_free(&paths, options))),
        ("visit_contacts", &|q| {
            let mut calls = 0;
            let counted = q.visit_contacts(a, b, pose, |_| {
                calls += 1;
                ControlFlow::Continue(())
            });
            assert!(calls <= budget, "{calls} contacts, budget {budget}");
            text(counted)
        }),
    ];
    for (name, ask) in asks {
        check(name, ask);
    }
}

/// Every question about a point or a line.
fn each_probe_question(a: &Bvh, budget: u64, mut check: impl FnMut(&str, AskPair<'_>)) {
    let (point, ray) = ([0.1, 0.2, 0.3], Ray::new([0.1, 0.2, -3.0], [0.3, 0.2, 1.0]));
    let (from, to) = ([-3.0, 0.3, 0.1], [3.0, 0.2, 0.4]);
    let far = f64::INFINITY;
    let mut batch = ProbeBatch::new(a).unwrap();
    batch.set_budget(budget);
    let batch = &batch;
    let asks: [(&str, AskPair<'_>); 16] = [
        ("closest_point", &|q| text(q.closest_point(a, point, far))),
        ("side", &|q| text(q.side(a, point))),
        ("signed_point_distance", &|q| text(q.signed_point_distance(a, point, far))),
        ("first_hit", &|q| text(q.first_hit(a, &ray))),
        ("any_hit", &|q| text(q.any_hit(a, &ray))),
        ("all_hits", &|q| text(q.all_hits(a, &ray))),
        ("segment_hit", &|q| text(q.segment_hit(a, from, to))),
        ("ProbeBatch::closest_points", &|_| text(batch.closest_points(&[point], far))),
        ("ProbeBatch::sides", &|_| text(batch.sides(&[point]))),
        ("ProbeBatch::signed_point_distances", &|_| text(batch.signed_point_distances(&[point], far))),
        ("ProbeBatch::first_hits", &|_| text(batch.first_hits(&[ray]))),
        ("ProbeBatch::any_hits", &|_| text(batch.any_hits(&[ray]))),
        ("ProbeBatch::all_hits", &|_| text(batch.all_hits(&[ray]))),
        ("ProbeBatch::segment_hits", &|_| text(batch.segment_hits(&[[from, to]]))),
        ("visible", &|q| text(q.visible(a, from, to, 0.1))),
        ("ProbeBatch::visible", &|_| text(batch.visible(&[[from, to]], 0.1))),
    ];
    for (name, ask) in asks {
        check(name, ask);
    }
}

/// Asks all questions about two meshes with small budgets. What has an answer has the one without a budget.
fn check_pair((a, b): (&Bvh, &Bvh), pose: &Pose, path: &Motion) {
    let fresh = |budget: u64| {
        let mut querier = Querier::new().unwrap();
        querier.set_budget(budget);
        querier
    };
    let (mut spent, mut answered) = (0, 0);
    let mut compare = |name: &str, budget: u64, ask: AskPair<'_>, free: AskPair<'_>| match within_budget(
        name,
        budget,
        || ask(&mut fresh(budget)),
    ) {
        Ok(answer) => {
            // Nearly without: rays that nothing limits have a tree with boxes of its own, and forged files have wrong ones.
            assert_eq!(Ok(answer), free(&mut fresh(u64::MAX - 1)), "{name}, budget {budget}");
            answered += 1;
        }
        Err(_) => spent += 1,
    };
    for budget in BUDGETS {
        // The questions without a budget, of which only those are asked whose answers are to be compared.
        each_pair_question((a, b), pose, path, budget, |name, ask| {
            each_pair_question((a, b), pose, path, u64::MAX - 1, |other, free| {
                if other == name {
                    compare(name, budget, ask, free);
                }
            });
        });
        each_probe_question(a, budget, |name, ask| {
            each_probe_question(a, u64::MAX - 1, |other, free| {
                if other == name {
                    compare(name, budget, ask, free);
                }
            });
        });
    }
    assert!(spent >= 2 * 34, "{spent} questions were refused, {answered} answered");
}

/// The same as objects of their own.
fn many_objects(count: usize) -> Bvh {
    let mut all = mesh(&dust(1));
    all.objects.clear();
    for number in 0..count {
        all.objects.extend(mesh(&tetrahedron(0.25, [0.0, number as f64, 0.0])).objects);
    }
    bake(&all, &Options::default().split_objects(true))
}

/// Triangles each of which is half as large as the one before, so that their tree is as deep as it can be.
fn chain() -> Vec<Triangle> {
    let size = |number: i32| 2f64.powi(-number);
    (0..120).map(|k| [[size(k), 0.0, 0.0], [0.0, size(k), 0.0], [size(k), size(k), size(k + 1)]]).collect()
}

#[test]
fn questions_about_bounds_that_contain_everything_keep_to_their_budget() {
    use_this_thread();
    let files = [1, 2].map(|seed| blown_up(1500, seed, Profile::Dop14U8));
    for file in &files {
        validate(file).unwrap();
    }
    let [a, b] = files.map(|file| Bvh::from_bytes(file).unwrap());
    let [from, to] = [translation(100.0, 0.0, 0.0), translation(1.0, 2.0, 3.0)];
    check_pair((&a, &b), &from, &Motion::between(&from, &to).unwrap());
}

#[test]
fn questions_about_deep_trees_keep_to_their_budget() {
    use_this_thread();
    let deep = baked(&chain());
    let pose = Pose::from_quaternion([0.0, 0.6, 0.0, 0.8], [1e-6, 0.0, 0.0]).unwrap();
    let path = Motion::between(&pose, &translation(0.5, 0.25, 0.125)).unwrap();
    check_pair((&deep, &deep), &pose, &path);
}

#[test]
fn questions_about_many_objects_and_components_keep_to_their_budget() {
    use_this_thread();
    let (objects, components) = (many_objects(1000), baked(&dust(2000)));
    let pose = translation(50.0, 0.5, 0.0);
    let path = Motion::between(&pose, &translation(0.5, 0.5, 0.5)).unwrap();
    check_pair((&components, &objects), &pose, &path);
    check_pair((&objects, &components), &pose, &path);
}

/// Each component is looked for in each object, and that is charged.
#[test]
fn a_relation_is_charged_for_components_times_objects() {
    let (objects, components) = (many_objects(1000), baked(&dust(2000)));
    let pose = translation(50.0, 0.5, 0.0);
    let mut querier = Querier::new().unwrap();
    querier.set_budget(10_000);
    let refused = Err(QueryError::Budget { visits: 10_000 });
    assert_eq!(querier.relation(&components, &objects, &pose), refused);
    assert_eq!(querier.relation(&objects, &components, &pose), refused);
    assert_eq!(querier.side(&objects, [9.0; 3]), Ok(Side::Outside));
    querier.set_budget(999);
    assert_eq!(querier.side(&objects, [9.0; 3]), Err(QueryError::Budget { visits: 999 }));
    // 3 times each pair of objects, and each component in each object: each triangle counts as one where components are small.
    querier.set_budget(3 * 1000 + 8000 * 1000 + 10_000);
    assert_eq!(querier.relation(&components, &objects, &pose), Ok(Relation::Apart));
}

/// A tracker bounds how far B has moved, by each of its objects.
#[test]
fn a_tracker_is_charged_for_the_objects_that_it_looks_at() {
    let (cube, objects) = (baked(&cube()), many_objects(1000));
    let pose = translation(50.0, 0.0, 0.0);
    let (mut querier, mut tracker) = (Querier::new().unwrap(), Tracker::new());
    tracker.distance(&mut querier, &cube, &objects, &pose).unwrap();
    querier.set_budget(100);
    let refused = Err(QueryError::Budget { visits: 100 });
    assert_eq!(tracker.collide(&mut querier, &cube, &objects, &pose), refused);
    assert_eq!(tracker.within(&mut querier, &cube, &objects, &pose, 1.0), refused);
    querier.set_budget(1000);
    assert_eq!(tracker.collide(&mut querier, &cube, &objects, &pose), Ok(false));
}

/// A contact counts for each pair of ids that it stands for.
#[test]
fn contacts_of_duplicates_keep_to_their_budget() {
    let forged = Bvh::from_bytes(duplicated(2999)).unwrap();
    let shape = OwnedShape::from(Bvh::from_bytes(duplicated(2999)).unwrap());
    let pose = translation(0.5, 0.25, 0.125);
    let mut scene = Scene::new().unwrap();
    scene.add(shape.clone(), Pose::IDENTITY).unwrap();
    scene.add(shape, pose).unwrap();
    for budget in BUDGETS {
        let mut querier = Querier::new().unwrap();
        querier.set_budget(budget);
        let mut calls = 0;
        let asked = within_budget("visit_contacts", budget, || {
            querier.visit_contacts(&forged, &forged, &pose, |_| {
                calls += 1;
                ControlFlow::Continue(())
            })
        });
        assert_eq!(asked, Err(QueryError::Budget { visits: budget }));
        assert!(calls <= budget, "{calls} calls, budget {budget}");
        assert!(within_budget("contacts", budget, || querier.contacts(&forged, &forged, &pose)).is_err());
        scene.set_budget(budget);
        assert!(within_budget("Scene::contacts", budget, || scene.contacts()).is_err());
        let visited = within_budget("Scene::visit_contacts", budget, || {
            scene.visit_contacts(|_, _| ControlFlow::Continue(()))
        });
        assert!(visited.is_err());
        // What breaks in time has an answer.
        let mut querier = Querier::new().unwrap();
        querier.set_budget(budget);
        let asked = querier.visit_contacts(&forged, &forged, &pose, |_| ControlFlow::Break(()));
        assert_eq!(asked.is_ok(), budget >= 100, "{asked:?}, budget {budget}");
    }
}

/// What a file states of ids, duplicates and the number of its triangles does not decide what a depth takes. Where a budget ends the
/// search, the bounds so far hold.
#[test]
fn depths_keep_to_their_budget() {
    let block = baked(&outward(cube()));
    // Who believes the number leaves out two thirds of a cube whose faces are divided, and takes what is behind them for inside.
    let mut parts = outward(cube());
    for _ in 0..4 {
        let split = |[a, b, c]: Triangle| {
            let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        parts = parts.into_iter().flat_map(split).collect();
    }
    parts.extend(moved(&outward(cube()), 0.25, [4.0, 0.0, 0.0]));
    let honest = baked(&parts);
    let small = Bvh::from_bytes(understated(honest.bytes().to_vec(), 4)).unwrap();
    let exact = PenetrationOptions::new().relative_gap(1e-12);
    for axis in 0..6 {
        let shift = [0, 1, 2].map(|k| if k == axis % 3 { 1.75 - 3.5 * (axis / 3) as f64 } else { 0.125 });
        let pose = translation(shift[0], shift[1], shift[2]);
        let ask = |a: &Bvh| Querier::new().unwrap().penetration(a, &block, &pose, &exact).unwrap();
        let (found, whole) = (ask(&small), ask(&honest));
        assert!(whole.lower > 0.0 && whole.upper < 0.251, "{whole:?}");
        assert!(found.lower <= whole.upper && whole.lower <= found.upper, "{found:?}, {whole:?}");
    }
    let duplicates = Bvh::from_bytes(duplicated(200_000)).unwrap();
    let (pose, options) = (translation(0.125, 0.5, 0.0), PenetrationOptions::new());
    let mut free = Querier::new().unwrap();
    for (forged, truth) in [(&small, &honest), (&duplicates, &block)] {
        let whole = free.penetration(truth, &block, &pose, &options).unwrap();
        assert!(whole.lower > 0.0);
        for budget in BUDGETS {
            let mut querier = Querier::new().unwrap();
            querier.set_budget(budget);
            let ask = || querier.penetration(forged, &block, &pose, &options);
            if let Ok(found) = within_budget("penetration", budget, ask) {
                assert!(found.lower <= whole.upper && whole.lower <= found.upper, "{found:?}, {whole:?}");
            }
            let mut querier = Querier::new().unwrap();
            querier.set_budget(budget);
            let ask = || querier.signed_distance(forged, &block, &pose, &options);
            if let Ok(found) = within_budget("signed_distance", budget, ask) {
                assert!(-found.upper <= whole.upper && whole.lower <= -found.lower, "{found:?}, {whole:?}");
            }
            let mut querier = Querier::new().unwrap();
            querier.set_budget(budget);
            let ask = || querier.signed_distance_within(forged, &block, &pose, 0.5, &options);
            if let Ok(found) = within_budget("signed_distance_within", budget, ask) {
                let found = found.unwrap();
                assert!(-found.upper <= whole.upper && whole.lower <= -found.lower, "{found:?}, {whole:?}");
            }
        }
        let found = free.penetration(forged, &block, &pose, &options).unwrap();
        assert!(found.lower <= whole.upper && whole.lower <= found.upper, "{found:?}, {whole:?}");
    }
}

/// What two closed meshes have in common, which takes memory for each triangle in the box of the other mesh and for each contact.
#[test]
fn intersections_keep_to_their_budget() {
    let ball = baked(&outward(sphere(4)));
    let mut querier = Querier::new().unwrap();
    for x in [0.0, 0.5, 1.9] {
        let pose = translation(x, 0.25, 0.125);
        querier.set_budget(u64::MAX);
        let whole = querier.intersection(&ball, &ball, &pose).unwrap();
        let surface = querier.intersection_surface(&ball, &ball, &pose).unwrap();
        let mut answered = 0;
        for budget in BUDGETS.into_iter().chain([1000, 100_000, 1_000_000]) {
            querier.set_budget(budget);
            if let Ok(found) =
                within_budget("intersection", budget, || querier.intersection(&ball, &ball, &pose))
            {
                assert_eq!(found, whole);
                answered += 1;
            }
            let ask = || querier.intersection_surface(&ball, &ball, &pose);
            if let Ok(found) = within_budget("intersection_surface", budget, ask) {
                assert_eq!(found, surface);
            }
        }
        assert!((1..7).contains(&answered), "{answered}");
    }
}

/// A budget that just suffices changes no answer, and one visit less is refused.
#[test]
fn the_least_budget_that_suffices_gives_the_answer_without() {
    use_this_thread();
    let deep = baked(&chain());
    let (a, b) = (&many_objects(20), &deep);
    let pose = translation(0.01, 3.0, 0.02);
    let path = Motion::between(&pose, &translation(0.02, -1.0, 0.01)).unwrap();
    let mut querier = Querier::new().unwrap();
    let mut least = |name: &str, ask: AskPair<'_>| {
        querier.set_budget(u64::MAX);
        let free = ask(&mut querier);
        assert!(free.is_ok(), "{name}: {free:?}");
        let mut refused = |budget: u64| {
            querier.set_budget(budget);
            let answer = ask(&mut querier);
            assert!(
                answer == free || answer == Err(QueryError::Budget { visits: budget }),
                "{name}: {answer:?}"
            );
            answer.is_err()
        };
        let (mut low, mut high) = (0, 1 << 24);
        assert!(refused(low) && !refused(high), "{name}");
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if refused(middle) { low = middle } else { high = middle }
        }
    };
    // Batches have budgets of their own.
    each_pair_question((a, b), &pose, &path, u64::MAX - 1, |name, ask| {
        if !name.starts_with("Batch") {
            least(name, ask);
        }
    });
    each_probe_question(a, u64::MAX, |name, ask| {
        if !name.starts_with("ProbeBatch") {
            least(name, ask);
        }
    });
}
