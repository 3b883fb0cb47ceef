//! Asks every question of forged files with small budgets, and counts what each question takes: calls and bytes.
//!
//! A question has the answer that it has without a budget, or ends with the budget's error. It never takes more than the
//! budget allows, though the files are such that it would take millions of times as much.

#![cfg(feature = "parallel")]

mod common;
#[path = "common/counted.rs"]
mod counted;

use bvh_bake::{Options, to_bytes};
use bvh_format::instances::{Instance, write_instances};
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use bvh_query::{
    Batch, Bvh, Contact, Distance, DistanceOptions, Files, Groups, InstanceId, Motion, MotionOptions,
    OwnedShape, Pose, ProbeBatch, Querier, QueryError, Ray, Relation, RigidPath, Scene, SceneError,
    SceneMotionAnswer, ScenePair, Side, Tracker,
};
use cbvh_testkit::seal::{put_together, take_apart};
use common::forged::{blown_up, duplicated};
use common::shapes::{cube, moved};
use common::{Triangle, bake, mesh, translation};
use counted::peak;
use std::fmt::Debug;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

const BUDGETS: [u64; 4] = [0, 1, 100, 10_000];
/// The bytes that a question may take whatever its budget: the memory that a querier begins with.
const BASE_BYTES: u64 = 2 << 20;
/// The bytes that a visit may add: both nodes that it opens, and vectors of twice the length.
const BYTES_PER_VISIT: u64 = 16 << 10;
/// The poses that a visit of a motion may ask its path for: each of at most 24 pairs of triangles, in 12 steps.
const POSES_PER_VISIT: u64 = 300;

/// The errors of a budget that ran out.
trait Spent: PartialEq + Debug {
    fn is_spent(&self, budget: u64) -> bool;
}

impl Spent for QueryError {
    fn is_spent(&self, budget: u64) -> bool {
        *self == QueryError::Budget { visits: budget }
    }
}

impl Spent for SceneError {
    fn is_spent(&self, budget: u64) -> bool {
        match self {
            SceneError::Query(source)
            | SceneError::Pair { source, .. }
            | SceneError::Instance { source, .. } => source.is_spent(budget),
            _ => false,
        }
    }
}

/// Lets batches and parallel scenes work on this thread alone, whose bytes are counted.
fn use_this_thread() {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().unwrap();
}

/// Asks with a budget, and checks the bytes and the error. Returns the answer.
fn within_budget<R: Debug, E: Spent>(
    name: &str,
    budget: u64,
    ask: impl FnOnce() -> Result<R, E>,
) -> Result<R, E> {
    let (bytes, answer) = peak(ask);
    let most = BASE_BYTES + budget * BYTES_PER_VISIT;
    assert!(bytes as u64 <= most, "{name}, budget {budget}: {bytes} bytes, not {most}");
    if let Err(error) = &answer {
        assert!(error.is_spent(budget), "{name}, budget {budget}: {error:?}");
    }
    answer
}

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

/// Every question about two meshes, as text to compare.
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
    let asks: [(&str, AskPair<'_>); 20] = [
        ("collide", &|q| q.collide(a, b, pose).map(|yes| yes.to_string())),
        ("contacts", &|q| q.contacts(a, b, pose).map(|all| format!("{all:?}"))),
        ("distance", &|q| q.distance(a, b, pose).map(|at| format!("{at:?}"))),
        ("distance_with", &|q| q.distance_with(a, b, pose, loose).map(|at| format!("{at:?}"))),
        ("within", &|q| q.within(a, b, pose, 5.0).map(|yes| yes.to_string())),
        ("relation", &|q| q.relation(a, b, pose).map(|how| format!("{how:?}"))),
        ("motion", &|q| {
            along("motion", budget, path, |path| q.motion(a, b, path, options)).map(|at| format!("{at:?}"))
        }),
        ("is_free", &|q| {
            along("is_free", budget, path, |path| q.is_free(a, b, path, options)).map(|yes| yes.to_string())
        }),
        ("Tracker::collide", &|q| Tracker::new().collide(q, a, b, pose).map(|yes| yes.to_string())),
        ("Tracker::distance", &|q| Tracker::new().distance(q, a, b, pose).map(|at| format!("{at:?}"))),
        ("Tracker::within", &|q| Tracker::new().within(q, a, b, pose, 5.0).map(|yes| yes.to_string())),
        ("Batch::collide", &|_| batch.collide(&poses).map(|all| format!("{all:?}"))),
        ("Batch::contacts", &|_| batch.contacts(&poses).map(|all| format!("{all:?}"))),
        ("Batch::distances", &|_| batch.distances(&poses).map(|all| format!("{all:?}"))),
        ("Batch::within", &|_| batch.within(&poses, 5.0).map(|all| format!("{all:?}"))),
        ("Batch::relations", &|_| batch.relations(&poses).map(|all| format!("{all:?}"))),
        ("Batch::first_collision", &|_| batch.first_collision(&poses).map(|all| format!("{all:?}"))),
        ("Batch::motions", &|_| batch.motions(&paths, options).map(|all| format!("{all:?}"))),
        ("Batch::are_free", &|_| batch.are_free(&paths, options).map(|all| format!("{all:?}"))),
        ("visit_contacts", &|q| {
            let mut calls = 0;
            let counted = q.visit_contacts(a, b, pose, |_| {
                calls += 1;
                ControlFlow::Continue(())
            });
            assert!(calls <= budget, "{calls} contacts, budget {budget}");
            counted.map(|calls| calls.to_string())
        }),
    ];
    for (name, ask) in asks {
        check(name, ask);
    }
}

/// Every question about a point or a line, as text to compare.
fn each_probe_question(a: &Bvh, budget: u64, mut check: impl FnMut(&str, AskPair<'_>)) {
    let (point, ray) = ([0.1, 0.2, 0.3], Ray::new([0.1, 0.2, -3.0], [0.3, 0.2, 1.0]));
    let (from, to) = ([-3.0, 0.3, 0.1], [3.0, 0.2, 0.4]);
    let far = f64::INFINITY;
    let mut batch = ProbeBatch::new(a).unwrap();
    batch.set_budget(budget);
    let batch = &batch;
    let asks: [(&str, AskPair<'_>); 14] = [
        ("closest_point", &|q| q.closest_point(a, point, far).map(|at| format!("{at:?}"))),
        ("side", &|q| q.side(a, point).map(|side| format!("{side:?}"))),
        ("signed_distance", &|q| q.signed_distance(a, point, far).map(|at| format!("{at:?}"))),
        ("first_hit", &|q| q.first_hit(a, &ray).map(|hit| format!("{hit:?}"))),
        ("any_hit", &|q| q.any_hit(a, &ray).map(|hit| hit.to_string())),
        ("all_hits", &|q| q.all_hits(a, &ray).map(|hits| format!("{hits:?}"))),
        ("segment_hit", &|q| q.segment_hit(a, from, to).map(|met| met.to_string())),
        ("ProbeBatch::closest_points", &|_| {
            batch.closest_points(&[point], far).map(|all| format!("{all:?}"))
        }),
        ("ProbeBatch::sides", &|_| batch.sides(&[point]).map(|all| format!("{all:?}"))),
        ("ProbeBatch::signed_distances", &|_| {
            batch.signed_distances(&[point], far).map(|all| format!("{all:?}"))
        }),
        ("ProbeBatch::first_hits", &|_| batch.first_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("ProbeBatch::any_hits", &|_| batch.any_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("ProbeBatch::all_hits", &|_| batch.all_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("ProbeBatch::segment_hits", &|_| batch.segment_hits(&[[from, to]]).map(|all| format!("{all:?}"))),
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
            assert_eq!(Ok(answer), free(&mut fresh(u64::MAX)), "{name}, budget {budget}");
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
            each_probe_question(a, u64::MAX, |other, free| {
                if other == name {
                    compare(name, budget, ask, free);
                }
            });
        });
    }
    assert!(spent >= 2 * 34, "{spent} questions were refused, {answered} answered");
}

/// A tetrahedron at a place.
fn tetrahedron(size: f64, at: [f64; 3]) -> Vec<Triangle> {
    let corner = |axis: usize| [0, 1, 2].map(|k| at[k] + if k == axis { size } else { 0.0 });
    let [o, x, y, z] = [at, corner(0), corner(1), corner(2)];
    vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
}

/// Many small tetrahedra, on a line along y.
fn dust(count: usize) -> Vec<Triangle> {
    (0..count).flat_map(|number| tetrahedron(0.25, [0.0, number as f64, 0.0])).collect()
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
    let deep = bake(&mesh(&chain()), &Options::default());
    let pose = Pose::from_quaternion([0.0, 0.6, 0.0, 0.8], [1e-6, 0.0, 0.0]).unwrap();
    let path = Motion::between(&pose, &translation(0.5, 0.25, 0.125)).unwrap();
    check_pair((&deep, &deep), &pose, &path);
}

#[test]
fn questions_about_many_objects_and_components_keep_to_their_budget() {
    use_this_thread();
    let (objects, components) = (many_objects(1000), bake(&mesh(&dust(2000)), &Options::default()));
    let pose = translation(50.0, 0.5, 0.0);
    let path = Motion::between(&pose, &translation(0.5, 0.5, 0.5)).unwrap();
    check_pair((&components, &objects), &pose, &path);
    check_pair((&objects, &components), &pose, &path);
}

/// Each component is looked for in each object, and that is charged.
#[test]
fn a_relation_is_charged_for_components_times_objects() {
    let (objects, components) = (many_objects(1000), bake(&mesh(&dust(2000)), &Options::default()));
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
    let (cube, objects) = (bake(&mesh(&cube()), &Options::default()), many_objects(1000));
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

/// A budget that just suffices changes no answer, and one visit less is refused.
#[test]
fn the_least_budget_that_suffices_gives_the_answer_without() {
    use_this_thread();
    let deep = bake(&mesh(&chain()), &Options::default());
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

type AskScene<'a> = &'a dyn Fn(&mut Scene) -> Result<String, SceneError>;

/// Every question about a scene, as text to compare, with the paths of some instances.
fn each_scene_question(paths: &[(InstanceId, &Motion)], mut check: impl FnMut(&str, AskScene<'_>)) {
    let paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> =
        paths.iter().map(|&(id, path)| (id, path as &(dyn RigidPath + Sync))).collect();
    let options = &MotionOptions::new();
    let (point, ray) = ([0.1, 0.2, 0.3], Ray::new([0.1, 0.2, -3.0], [0.3, 0.2, 1.0]));
    let asks: [(&str, AskScene<'_>); 18] = [
        ("collide", &|s| s.collide().map(|yes| yes.to_string())),
        ("within", &|s| s.within(0.01).map(|yes| yes.to_string())),
        ("pairs_in_contact", &|s| s.pairs_in_contact().map(|all| format!("{all:?}"))),
        ("pairs_within", &|s| s.pairs_within(0.01).map(|all| format!("{all:?}"))),
        ("relations", &|s| s.relations().map(|all| format!("{all:?}"))),
        ("contacts", &|s| s.contacts().map(|all| format!("{all:?}"))),
        ("distance", &|s| s.distance().map(|at| format!("{at:?}"))),
        ("motion", &|s| s.motion(&paths, options).map(|at| format!("{at:?}"))),
        ("is_free", &|s| s.is_free(&paths, options).map(|yes| yes.to_string())),
        ("closest_points", &|s| s.closest_points(&[point], f64::INFINITY).map(|all| format!("{all:?}"))),
        ("sides", &|s| s.sides(&[point]).map(|all| format!("{all:?}"))),
        ("signed_distances", &|s| s.signed_distances(&[point], 9.0).map(|all| format!("{all:?}"))),
        ("first_hits", &|s| s.first_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("any_hits", &|s| s.any_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("all_hits", &|s| s.all_hits(&[ray]).map(|all| format!("{all:?}"))),
        ("segment_hits", &|s| s.segment_hits(&[[[9.0; 3], point]]).map(|all| format!("{all:?}"))),
        ("visit_pairs_within", &|s| {
            let mut all = Vec::new();
            s.visit_pairs_within(0.01, |pair| {
                all.push(pair);
                ControlFlow::Continue(())
            })?;
            Ok(format!("{all:?}"))
        }),
        ("visit_contacts", &|s| {
            let mut all = Vec::new();
            s.visit_contacts(|pair, contacts| {
                all.push((pair, contacts.len()));
                ControlFlow::Continue(())
            })?;
            Ok(format!("{all:?}"))
        }),
    ];
    for (name, ask) in asks {
        check(name, ask);
    }
}

/// A scene file that puts an object into so many places.
fn scene_file(triangles: &[Triangle], places: impl Iterator<Item = Instance>) -> Vec<u8> {
    let mut sections = take_apart(&to_bytes(&mesh(triangles), &Options::default()).unwrap().0);
    let at = sections.partition_point(|section| section.0 < 7);
    sections.insert(at, (7, 0, write_instances(&places.collect::<Vec<_>>())));
    let bytes = put_together(&sections);
    validate(&bytes).unwrap();
    bytes
}

/// Opens a scene file and checks the memory that it takes, also for the broad phase of the first question.
fn open_scene(bytes: Vec<u8>) -> Scene {
    let bvh = Bvh::from_bytes(bytes).unwrap();
    let section = bvh.layout().sections.iter().map(|section| section.range.len()).max().unwrap();
    let (bytes, scene) = peak(|| {
        let mut scene = Scene::of_file(bvh).unwrap();
        scene.set_budget(0);
        assert!(scene.pairs_in_contact().unwrap_err().is_spent(0));
        scene
    });
    assert!(bytes <= 16 * section + (1 << 20), "{bytes} bytes for {section} bytes of instances");
    scene
}

/// Four thousand instances in one place are eight million pairs.
#[test]
fn questions_about_coincident_instances_keep_to_their_budget() {
    use_this_thread();
    let count = 4000;
    let file = scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(|_| Instance::of_object(0)));
    let mut scene = open_scene(file);
    let ids: Vec<InstanceId> = scene.instances().collect();
    let path = Motion::between(&translation(-9.0, 0.0, 0.0), &translation(9.0, 1.0, 1.0)).unwrap();
    let paths: Vec<(InstanceId, &Motion)> = ids.iter().take(4).map(|&id| (id, &path)).collect();
    for tracking in [false, true] {
        scene.set_tracking(tracking);
        for budget in BUDGETS {
            scene.set_budget(budget);
            each_scene_question(&paths, |name, ask| {
                let answer = within_budget(name, budget, || ask(&mut scene.clone()));
                let needs_all_pairs = name.starts_with("pairs") || name.starts_with("visit");
                assert!(answer.is_err() || !needs_all_pairs, "{name}, budget {budget}: {answer:?}");
                let answer = within_budget(name, budget, || ask(&mut scene));
                assert!(answer.is_err() || !needs_all_pairs, "{name}, budget {budget}: {answer:?}");
                assert!(scene.pairs_asked() <= budget + 1, "{name}: {} pairs", scene.pairs_asked());
            });
        }
    }
}

/// Groups of which no two meet, but all unions do: nothing is asked about, and finding that out is charged.
#[test]
fn looking_for_pairs_is_charged_where_there_are_none() {
    let count = 3000;
    let place = |number: u32| {
        // Each is in a group, and meets another one, so that no two instances meet each other.
        let [member, meets] = [1 << (number % 3), 1 << ((number + 1) % 3)];
        Instance { member, meets, ..Instance::of_object(0) }
    };
    let mut scene = open_scene(scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(place)));
    for budget in BUDGETS {
        scene.set_budget(budget);
        assert!(within_budget("pairs_in_contact", budget, || scene.pairs_in_contact()).is_err());
        assert!(within_budget("collide", budget, || scene.collide()).is_err());
        assert!(within_budget("distance", budget, || scene.distance()).is_err());
    }
    scene.set_budget(u64::MAX);
    let (bytes, nearest) = peak(|| scene.distance());
    assert_eq!(nearest, Ok(None));
    assert!(bytes < 8 << 20, "{bytes} bytes to find no pair");
}

/// Instances whose boxes all meet though the surfaces are apart, but for some that touch: more pairs than are known at a time.
fn crowd(count: usize) -> (Scene, Vec<InstanceId>, OwnedShape) {
    let two = [tetrahedron(0.25, [0.0; 3]), moved(&tetrahedron(0.25, [0.0; 3]), 1.0, [600.0; 3])].concat();
    let shape = OwnedShape::from(bake(&mesh(&two), &Options::default()));
    let mut scene = Scene::new().unwrap();
    // Two are in one place, near the end.
    let at = |number: usize| if number == count - 3 { count - 7 } else { number } as f64;
    let place = |number: usize| translation(0.0, at(number) * 0.5 + 1e-3 * (at(number) * 0.7).sin(), 0.0);
    let ids = (0..count).map(|number| scene.add(shape.clone(), place(number)).unwrap()).collect();
    (scene, ids, shape)
}

/// Without a budget, the pairs of a scene are known piece by piece. The answers are those about each pair.
#[test]
fn pairs_in_pieces_are_all_pairs() {
    let count = 400;
    let (mut scene, ids, shape) = crowd(count);
    let mut querier = Querier::new().unwrap();
    let mut near = Vec::new();
    let mut contacts: Vec<(ScenePair, Vec<Contact>)> = Vec::new();
    let mut nearest: Option<(ScenePair, Distance)> = None;
    let poses: Vec<Pose> = ids.iter().map(|id| *scene.pose(*id).unwrap()).collect();
    let d = 0.2503;
    for a in 0..count {
        for b in a + 1..count {
            let pose = Pose::relative(&poses[a], &poses[b]).unwrap();
            let pair = ScenePair { a: ids[a], b: ids[b] };
            if querier.within(&shape, &shape, &pose, d).unwrap() {
                near.push(pair);
            }
            let found = querier.contacts(&shape, &shape, &pose).unwrap();
            if !found.is_empty() {
                nearest = Some((pair, querier.distance(&shape, &shape, &pose).unwrap()));
                contacts.push((pair, found));
            }
        }
    }
    assert!(
        near.len() > 20 && near.len() < count && contacts.len() == 1,
        "{} {}",
        near.len(),
        contacts.len()
    );
    for (threads, tracking) in [(1, false), (3, true)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        scene.set_parallel(threads > 1);
        scene.set_tracking(tracking);
        // The second time, the scene knows which pair is likely.
        for _ in 0..2 {
            pool.install(|| {
                assert_eq!(scene.pairs_within(d).unwrap(), near);
                assert!(scene.pairs_asked() > 1 << 16, "{}", scene.pairs_asked());
                assert_eq!(scene.pairs_in_contact().unwrap(), [contacts[0].0]);
                assert_eq!(scene.relations().unwrap(), [(contacts[0].0, Relation::Touching)]);
                assert!(scene.collide().unwrap() && scene.within(d).unwrap());
                assert_eq!(scene.distance().unwrap().map(|at| (at.pair, at.nearest)), nearest);
                let mut all = Vec::new();
                scene
                    .visit_contacts(|pair, contacts| {
                        all.push((pair, contacts.to_vec()));
                        ControlFlow::Continue(())
                    })
                    .unwrap();
                assert_eq!(all, contacts);
                let (mut calls, last) = (0, near[near.len() - 2]);
                scene
                    .visit_pairs_within(d, |pair| {
                        assert_eq!(pair, near[calls]);
                        calls += 1;
                        if pair == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                    })
                    .unwrap();
                assert_eq!(calls, near.len() - 1);
                // A budget that suffices changes nothing, on any number of threads.
                scene.set_budget(1 << 40);
                assert_eq!(scene.pairs_within(d).unwrap(), near);
                scene.set_budget(100_000);
                assert!(scene.pairs_within(d).unwrap_err().is_spent(100_000));
                scene.set_budget(u64::MAX);
            });
        }
    }
    // With the two in one place apart, the nearest pair is another one.
    scene.set_pose(ids[count - 3], translation(0.0, 1e3, 0.0)).unwrap();
    let least = scene.distance().unwrap().unwrap();
    assert!(least.nearest.distance > 0.2 && near.contains(&least.pair), "{least:?}");
    assert!(!scene.collide().unwrap());
}

/// All instances are on paths, so that there are more pairs than are known at a time. One of them moves.
#[test]
fn motions_in_pieces_are_those_of_all_pairs() {
    let count = 400;
    let (mut scene, ids, _) = crowd(count);
    scene.remove(ids[count - 3]).unwrap();
    let last = ids[count - 1];
    let there: Vec<(InstanceId, Motion)> = scene
        .instances()
        .map(|id| {
            let pose = *scene.pose(id).unwrap();
            let [x, y, z] = pose.translation();
            let end = if id == last { translation(x, y - 150.1, z) } else { pose };
            (id, Motion::between(&pose, &end).unwrap())
        })
        .collect();
    let options = &MotionOptions::new();
    let paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> =
        there.iter().map(|(id, path)| (*id, path as &(dyn RigidPath + Sync))).collect();
    let moving = *paths.last().unwrap();
    let alone = scene.motion(&[moving], options).unwrap();
    let SceneMotionAnswer::Hit { pair, .. } = alone else { panic!("{alone:?}") };
    assert_eq!(pair.b, last);
    assert_eq!(scene.is_free(&[moving], options), Ok(false));
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        scene.set_parallel(threads > 1);
        pool.install(|| {
            assert_eq!(scene.motion(&paths, options).unwrap(), alone);
            assert!(scene.pairs_asked() > 1 << 16, "{}", scene.pairs_asked());
            assert_eq!(scene.is_free(&paths, options), Ok(false));
            assert_eq!(scene.is_free(&paths[..count - 2], options), Ok(true));
            scene.set_budget(50_000);
            assert!(scene.motion(&paths, options).unwrap_err().is_spent(50_000));
            assert!(scene.is_free(&paths[..count - 2], options).unwrap_err().is_spent(50_000));
            scene.set_budget(u64::MAX);
        });
    }
}

/// Without a budget, memory does not grow with the number of pairs.
#[test]
fn the_pairs_of_a_scene_are_not_all_kept() {
    let count = 2000;
    let file = scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(|_| Instance::of_object(0)));
    let mut scene = open_scene(file);
    scene.set_budget(u64::MAX);
    for tracking in [false, true] {
        scene.set_tracking(tracking);
        let mut pairs = 0;
        let (bytes, visited) = peak(|| {
            scene.visit_pairs_within(0.0, |_| {
                pairs += 1;
                if pairs == 200_000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        });
        assert_eq!((visited, pairs), (Ok(()), 200_000));
        let most = if tracking { 24 << 20 } else { 4 << 20 };
        assert!(bytes < most, "{bytes} bytes for {count} instances");
    }
}

/// A file that is opened for each question takes as much as opening it, and no more stay open than may.
#[test]
fn files_that_are_opened_for_a_question_are_closed_again() {
    let directory = tempfile::tempdir().unwrap();
    let bytes = to_bytes(&mesh(&dust(10)), &Options::default()).unwrap().0;
    let files = Files::new(2);
    let mut scene = Scene::new().unwrap();
    for number in 0..20 {
        let path = directory.path().join(format!("{number}.cbvh"));
        std::fs::write(&path, &bytes).unwrap();
        let id = scene.add(files.shape(&path).unwrap(), Pose::IDENTITY).unwrap();
        scene.set_groups(id, Groups::ALL).unwrap();
    }
    for budget in BUDGETS {
        scene.set_budget(budget);
        let answer = within_budget("pairs_in_contact", budget, || scene.pairs_in_contact());
        assert_eq!(answer.is_ok(), budget == 10_000, "{answer:?}");
        assert!(files.open_count() <= 2);
    }
}
