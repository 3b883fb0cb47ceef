//! Radii and margins in scenes: every question against the questions about each pair, whose shapes have the radii that the
//! margins make.

use super::{scenes, shape};
use crate::common::shapes::{cube, outward, plate, sphere, torus};
use crate::common::{Random, random_pose};
use bvh_query::{
    InstanceId, Motion, MotionAnswer, MotionOptions, OwnedShape, Pose, Querier, Ray, Relation, RelativePath,
    RigidPath, Scene, SceneError, SceneMotionAnswer, Side,
};
use cbvh_testkit::depth::rounds;
use std::collections::HashMap;

struct Placed {
    id: InstanceId,
    shape: OwnedShape,
    margin: f64,
    world: Pose,
}

impl Placed {
    /// Returns the shape with its margin and a further one.
    fn grown(&self, further: f64) -> OwnedShape {
        let radius = self.shape.shape().radius() + (self.margin + further);
        self.shape.clone().rounded(radius).unwrap()
    }
}

/// A point, a segment, a solid cube and meshes, some with a radius.
fn shapes() -> Vec<OwnedShape> {
    let point = [[0.1, 0.0, 0.2]; 3];
    let segment = [[0.0, 0.0, -0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.5]];
    let solid = shape(&outward(cube())).solid().unwrap();
    vec![
        shape(&[point]).rounded(0.4).unwrap(),
        shape(&[segment]).rounded(0.25).unwrap(),
        solid.clone(),
        solid.rounded(0.125).unwrap(),
        shape(&sphere(1)),
        shape(&torus(12, 8)).rounded(0.05).unwrap(),
        shape(&plate(2)),
    ]
}

/// The pairs that are asked about, with the further margin of each and B in A's frame.
fn pairs<'a>(
    placed: &'a [Placed],
    margins: &'a HashMap<(InstanceId, InstanceId), f64>,
    allowed: (InstanceId, InstanceId),
) -> impl Iterator<Item = (&'a Placed, &'a Placed, OwnedShape, OwnedShape)> {
    let all = (0..placed.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let all = all.map(|(a, b)| (&placed[a], &placed[b]));
    all.filter(move |(a, b)| (a.id, b.id) != allowed).map(|(a, b)| {
        let further = margins.get(&(a.id, b.id)).copied().unwrap_or(0.0);
        (a, b, a.grown(further), b.grown(0.0))
    })
}

#[test]
fn every_question_respects_every_margin() {
    let shapes = shapes();
    let mut seen = [0; 4];
    // All of them see the same, however many backends this CPU has.
    let scenes_per_round = scenes().len() as u32;
    for round in 0..rounds(24) {
        for scene in &mut scenes() {
            let mut random = Random::new(1000 + round);
            let mut placed = Vec::new();
            for _ in 0..9 {
                let (shape, world) =
                    (shapes[random.below(shapes.len())].clone(), random_pose(&mut random, 5.0));
                let id = scene.add(shape.clone(), world).unwrap();
                let margin = [0.0, 0.2, 0.5][random.below(3)] * random.unit();
                scene.set_margin(id, margin).unwrap();
                assert_eq!(scene.margin(id), Ok(margin));
                placed.push(Placed { id, shape, margin, world });
            }
            let mut margins = HashMap::new();
            for _ in 0..6 {
                let (a, b) = (random.below(8), 8);
                let margin = 2.0 * random.unit();
                scene.set_pair_margin(placed[b].id, placed[a].id, margin).unwrap();
                assert_eq!(scene.pair_margin(placed[a].id, placed[b].id), Ok(margin));
                margins.insert((placed[a].id, placed[b].id), margin);
            }
            let allowed = (placed[0].id, placed[1].id);
            scene.set_allowed(allowed.0, allowed.1, true).unwrap();
            check_pairs(scene, &placed, &margins, allowed, &mut seen);
            check_motion(scene, &placed, &margins, allowed, &mut random);
            check_probes(scene, &placed, &mut random);
            // Without margins, the answers are the old ones.
            for one in &mut placed {
                scene.set_margin(one.id, 0.0).unwrap();
                one.margin = 0.0;
            }
            for &(a, b) in margins.keys() {
                scene.set_pair_margin(a, b, 0.0).unwrap();
            }
            check_pairs(scene, &placed, &HashMap::new(), allowed, &mut seen);
        }
    }
    assert!(seen.iter().all(|&count| count >= 2 * scenes_per_round), "{scenes_per_round} scenes: {seen:?}");
}

fn check_pairs(
    scene: &mut Scene,
    placed: &[Placed],
    margins: &HashMap<(InstanceId, InstanceId), f64>,
    allowed: (InstanceId, InstanceId),
    seen: &mut [u32; 4],
) {
    let mut querier = Querier::new().unwrap();
    let (mut touching, mut near, mut contacts, mut relations) = (vec![], vec![], vec![], vec![]);
    let mut distances = Vec::new();
    for (a, b, shape_a, shape_b) in pairs(placed, margins, allowed) {
        let (pose, ids) = (Pose::relative(&a.world, &b.world).unwrap(), (a.id, b.id));
        touching.extend(querier.collide(&shape_a, &shape_b, &pose).unwrap().then_some(ids));
        near.extend(querier.within(&shape_a, &shape_b, &pose, 0.3).unwrap().then_some(ids));
        contacts.extend(
            querier.contacts(&shape_a, &shape_b, &pose).unwrap().into_iter().map(|found| (ids, found)),
        );
        distances.push((querier.distance(&shape_a, &shape_b, &pose).unwrap(), ids));
        let relation = querier.relation(&shape_a, &shape_b, &pose).unwrap();
        relations.extend((relation != Relation::Apart).then_some((ids, relation)));
    }
    [touching.len(), near.len() - touching.len(), contacts.len(), relations.len() - touching.len()]
        .into_iter()
        .zip(&mut *seen)
        .for_each(|(count, seen)| *seen += count as u32);
    touching.sort_unstable();
    near.sort_unstable();
    contacts.sort_unstable();
    relations.sort_unstable_by_key(|(ids, _)| *ids);
    let of =
        |pairs: Vec<bvh_query::ScenePair>| pairs.into_iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>();
    assert_eq!(of(scene.pairs_in_contact().unwrap()), touching);
    assert_eq!(of(scene.pairs_within(0.3).unwrap()), near);
    assert_eq!(scene.collide().unwrap(), !touching.is_empty());
    assert_eq!(scene.within(0.3).unwrap(), !near.is_empty());
    let found: Vec<_> = scene
        .contacts()
        .unwrap()
        .into_iter()
        .map(|found| ((found.pair.a, found.pair.b), found.contact))
        .collect();
    assert_eq!(found, contacts);
    let found: Vec<_> =
        scene.relations().unwrap().into_iter().map(|(pair, relation)| ((pair.a, pair.b), relation)).collect();
    assert_eq!(found, relations);
    distances.sort_by(|x, y| (x.0.distance, x.1).partial_cmp(&(y.0.distance, y.1)).unwrap());
    let nearest = scene.distance().unwrap().unwrap();
    assert_eq!((nearest.nearest, (nearest.pair.a, nearest.pair.b)), distances[0]);
}

fn check_motion(
    scene: &mut Scene,
    placed: &[Placed],
    margins: &HashMap<(InstanceId, InstanceId), f64>,
    allowed: (InstanceId, InstanceId),
    random: &mut Random,
) {
    let mut querier = Querier::new().unwrap();
    let options = MotionOptions::new().clearance(0.01).tolerance(1e-3);
    let moving = [random.below(placed.len()), random.below(placed.len())];
    let paths: HashMap<InstanceId, Motion> = moving
        .into_iter()
        .map(|place| {
            let one = &placed[place];
            (one.id, Motion::between(&one.world, &random_pose(random, 5.0)).unwrap())
        })
        .collect();
    let path = |one: &Placed| -> Box<dyn RigidPath> {
        paths.get(&one.id).map_or_else(|| Box::new(one.world) as Box<dyn RigidPath>, |path| Box::new(*path))
    };
    let mut first: Option<f64> = None;
    let mut is_free = true;
    for (a, b, shape_a, shape_b) in pairs(placed, margins, allowed) {
        let (path_a, path_b) = (path(a), path(b));
        if !paths.contains_key(&a.id) && !paths.contains_key(&b.id) {
            continue;
        }
        // The one that stands still, if one does, is A there.
        let swapped = paths.contains_key(&a.id) && !paths.contains_key(&b.id);
        let further = margins.get(&(a.id, b.id)).copied().unwrap_or(0.0);
        let (shape_a, shape_b) = if swapped { (b.grown(further), a.grown(0.0)) } else { (shape_a, shape_b) };
        let path = if swapped {
            RelativePath::new(path_b.as_ref(), path_a.as_ref())
        } else {
            RelativePath::new(path_a.as_ref(), path_b.as_ref())
        };
        let answer = querier.motion(&shape_a, &shape_b, &path, &options).unwrap();
        is_free &= answer == MotionAnswer::Free;
        if let MotionAnswer::Hit { touching_at, .. } = answer {
            first = Some(first.map_or(touching_at, |first| first.min(touching_at)));
        }
    }
    let given: Vec<_> = paths.iter().map(|(id, path)| (*id, path as _)).collect();
    assert_eq!(scene.is_free(&given, &options).unwrap(), is_free);
    match scene.motion(&given, &options).unwrap() {
        SceneMotionAnswer::Hit { touching_at, .. } => assert_eq!(first, Some(touching_at)),
        SceneMotionAnswer::Free => assert!(is_free),
        SceneMotionAnswer::Near { .. } => assert!(!is_free && first.is_none()),
    }
}

fn check_probes(scene: &mut Scene, placed: &[Placed], random: &mut Random) {
    let mut querier = Querier::new().unwrap();
    for _ in 0..10 {
        let point = random.point().map(|x| 4.0 * x);
        let ray = Ray::new(point, random.point());
        let (mut distance, mut hit, mut sides) = (f64::INFINITY, f64::INFINITY, Vec::new());
        for one in placed {
            let shape = one.grown(0.0);
            let at = shape.shape().at(&one.world);
            distance =
                distance.min(querier.closest_point(at, point, f64::INFINITY).unwrap().unwrap().distance);
            if let Some(found) = querier.first_hit(at, &ray).unwrap() {
                hit = hit.min(found.t);
            }
            assert_eq!(querier.any_hit(at, &ray).unwrap(), querier.first_hit(at, &ray).unwrap().is_some());
            sides.push(querier.side(at, point).unwrap());
        }
        let found = scene.closest_points(&[point], f64::INFINITY).unwrap()[0].unwrap();
        assert_eq!(found.closest.distance, distance);
        let first = scene.first_hits(&[ray]).unwrap()[0];
        assert_eq!(first.map_or(f64::INFINITY, |first| first.hit.t), hit);
        assert_eq!(scene.any_hits(&[ray]).unwrap()[0], hit < f64::INFINITY);
        let side = scene.sides(&[point]).unwrap()[0];
        assert_eq!(side == Side::Inside, sides.contains(&Side::Inside));
    }
}

#[test]
fn wrong_margins_are_refused_and_change_nothing() {
    let mut scene = Scene::new().unwrap();
    let a = scene.add(shape(&cube()), Pose::IDENTITY).unwrap();
    let b = scene.add(shape(&cube()), Pose::IDENTITY).unwrap();
    scene.set_margin(a, 1.0).unwrap();
    for wrong in [-1.0, f64::NAN, f64::INFINITY, f64::MAX] {
        assert!(matches!(scene.set_margin(a, wrong), Err(SceneError::Margin(_))));
        assert!(matches!(scene.set_pair_margin(a, b, wrong), Err(SceneError::Margin(_))));
    }
    assert_eq!((scene.margin(a), scene.pair_margin(a, b)), (Ok(1.0), Ok(0.0)));
    scene.set_pair_margin(a, b, 3.0).unwrap();
    scene.remove(b).unwrap();
    let c = scene.add(shape(&cube()), Pose::IDENTITY).unwrap();
    assert_eq!(scene.pair_margin(a, c), Ok(0.0), "a margin of a pair goes with its instances");
    assert!(matches!(scene.set_margin(b, 1.0), Err(SceneError::NoInstance(_))));
}
