//! Poses and answers come back from JSON as they were, to the bit. Numbers that make no pose, and lists that do not fit together, are
//! refused. Answers about scenes are written only: what they say of instances are numbers of one scene.

use crate::common::shapes::{cube, moved, soup};
use crate::common::{Random, baked, random_pose, translation};
use bvh_query::{
    Clash, ClashOptions, ClosestPoint, Contact, Distance, InstanceId, IntersectionSurface, Motion,
    MotionOptions, OwnedShape, PatchOptions, Patches, PenetrationOptions, Pose, Querier, Ray, RayHit,
    RigidPath, Scene, SceneMotionAnswer, ScenePair, SignedDistance,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, from_value, json, to_value};
use std::fmt::Debug;

fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: T) {
    let text = serde_json::to_string(&value).unwrap();
    assert_eq!(serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
}

#[test]
fn poses_come_back_and_numbers_that_make_none_are_refused() {
    let mut random = Random::new(1);
    for _ in 0..100 {
        let pose = random_pose(&mut random, 1e3);
        comes_back(pose);
        // The text is that of the rows, which `from_rows` reads.
        let rows: [f64; 12] = serde_json::from_str(&serde_json::to_string(&pose).unwrap()).unwrap();
        assert_eq!(Pose::from_rows(&rows), Ok(pose));
    }
    let refused = |text: &str| serde_json::from_str::<Pose>(text).unwrap_err().to_string();
    let scaled = Pose::from_rows(&[2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0]).unwrap_err();
    assert_eq!(refused("[2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0]"), scaled.to_string());
    assert!(serde_json::from_str::<Pose>("[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]").is_err());
}

#[test]
fn answers_come_back() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let mut querier = Querier::new().unwrap();
    let (deep, far) = (&Pose::IDENTITY, &translation(9.0, 1.0 / 3.0, 0.0));
    let motion = Motion::between(far, deep).unwrap();
    for pose in [deep, far] {
        comes_back(querier.contacts(&a, &b, pose).unwrap());
        comes_back(querier.distance(&a, &b, pose).unwrap());
        comes_back(querier.stats());
        comes_back(querier.relation(&a, &b, pose).unwrap());
        comes_back(querier.penetration(&a, &b, pose, &PenetrationOptions::new()).unwrap());
        comes_back(querier.signed_distance(&a, &b, pose, &PenetrationOptions::new()).unwrap());
        comes_back(querier.clash(&a, &b, pose, &ClashOptions::new().clearance(20.0)).unwrap());
    }
    comes_back(querier.self_contacts(&baked(&soup(50, 3))).unwrap());
    comes_back(querier.motion(&a, &b, &motion, &MotionOptions::new()).unwrap());
    comes_back(querier.closest_point(&a, [1.0 / 3.0, 7.0, 3.0], f64::INFINITY).unwrap());
    comes_back(querier.signed_point_distance(&a, [1.0 / 3.0, 0.1, 0.2], f64::INFINITY).unwrap());
    comes_back(querier.first_hit(&a, &Ray::new([9.0, 0.1, 0.2], [-1.0, 0.0, 0.0])).unwrap());
}

#[test]
fn contacts_and_intersections_come_back() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let mut querier = Querier::new().unwrap();
    let options = PatchOptions::new().max_points(4);
    for pose in [&Pose::IDENTITY, &translation(1.0 / 3.0, 0.1, 0.0), &translation(9.0, 0.0, 0.0)] {
        let patches = querier.patches(&a, &b, pose, &options).unwrap();
        assert_eq!(patches.patches.is_empty(), patches.points.is_empty());
        comes_back(patches);
        comes_back(querier.contact_regions(&a, &b, pose, 7).unwrap());
        comes_back(querier.intersection(&a, &b, pose).unwrap());
        comes_back(querier.intersection_surface(&a, &b, pose).unwrap());
    }
    for hit in querier.all_hits(&a, &Ray::new([9.0, 0.1, 0.2], [-1.0, 0.0, 0.0])).unwrap() {
        comes_back(hit);
    }
}

/// Lists in which places or numbers do not fit together are refused, one by one.
#[test]
fn lists_that_do_not_fit_together_are_refused() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let mut querier = Querier::new().unwrap();
    let pose = &Pose::IDENTITY;
    let patches =
        to_value(querier.patches(&a, &b, pose, &PatchOptions::new().max_points(4)).unwrap()).unwrap();
    let (regions, points) =
        (patches["regions"].as_array().unwrap().len(), patches["points"].as_array().unwrap().len());
    let with = |whole: &Value, place: &str, value: Value| {
        let mut changed = whole.clone();
        *changed.pointer_mut(place).unwrap() = value;
        changed
    };
    for (place, value) in [
        ("/patches/0/count", json!(regions + 1)),
        ("/patches/0/first", json!(u64::MAX)),
        ("/patches/0/first_point", json!(points)),
        ("/patches/0/point_count", json!(points + 1)),
        ("/total", json!(regions - 1)),
        ("/regions", json!([])),
        ("/points", json!([])),
    ] {
        let refused = from_value::<Patches>(with(&patches, place, value)).unwrap_err().to_string();
        assert!(refused.starts_with("expected patches whose contacts"), "{place}: {refused}");
    }
    assert!(from_value::<Patches>(with(&patches, "/patches/0/count", json!(-1))).is_err());
    let surface = to_value(querier.intersection_surface(&a, &b, pose).unwrap()).unwrap();
    for (place, value) in [
        ("/points", json!([])),
        ("/loops/0", json!(1000)),
        ("/loops", json!([])),
        ("/polygons/0", json!(u32::MAX)),
        ("/polygons", json!([])),
    ] {
        let refused =
            from_value::<IntersectionSurface>(with(&surface, place, value)).unwrap_err().to_string();
        assert!(refused.starts_with("expected as many points and loops"), "{place}: {refused}");
    }
}

/// What answers about scenes have besides instances comes back, and instances are written as their numbers.
#[test]
fn answers_about_scenes_are_written_with_the_numbers_of_instances() {
    fn part<T: DeserializeOwned>(whole: &impl Serialize, name: &str) -> T {
        let text = serde_json::to_string(whole).unwrap();
        from_value(serde_json::from_str::<Value>(&text).unwrap()[name].clone()).unwrap()
    }
    fn pair(whole: &impl Serialize) -> ScenePair {
        let number = |of: &Value| InstanceId::from_bits(of.as_u64().unwrap());
        let pair: Value = part(whole, "pair");
        ScenePair { a: number(&pair["a"]), b: number(&pair["b"]) }
    }
    let shape: OwnedShape = baked(&cube()).into();
    let mut scene = Scene::new().unwrap();
    // A place that is taken for the second time, so that the number is more than a place.
    let gone = scene.add(shape.clone(), translation(0.0, 0.0, 0.0)).unwrap();
    scene.remove(gone).unwrap();
    let first = scene.add(shape.clone(), translation(1.0 / 3.0, 0.0, 0.0)).unwrap();
    let second = scene.add(shape, translation(0.0, 0.7, 0.1)).unwrap();
    assert!(first.to_bits() > u64::from(u32::MAX));
    assert_eq!(to_value(first).unwrap(), json!(first.to_bits()));

    let distance = scene.distance().unwrap().unwrap();
    assert_eq!((pair(&distance), part::<Distance>(&distance, "nearest")), (distance.pair, distance.nearest));
    let signed = scene.signed_distance(&PenetrationOptions::new()).unwrap().unwrap();
    assert_eq!((pair(&signed), part::<SignedDistance>(&signed, "nearest")), (signed.pair, signed.nearest));
    for contact in scene.contacts().unwrap() {
        assert_eq!((pair(&contact), part::<Contact>(&contact, "contact")), (contact.pair, contact.contact));
    }
    for clash in scene.clashes(&ClashOptions::new()).unwrap() {
        assert_eq!((pair(&clash), part::<Clash>(&clash, "clash")), (clash.pair, clash.clash));
    }
    let closest = scene.closest_points(&[[9.0, 0.1, 0.2]], f64::INFINITY).unwrap()[0].unwrap();
    assert_eq!(part::<u64>(&closest, "instance"), closest.instance.to_bits());
    assert_eq!(part::<ClosestPoint>(&closest, "closest"), closest.closest);
    let hit = scene.first_hits(&[Ray::new([9.0, 0.1, 0.2], [-1.0, 0.0, 0.0])]).unwrap()[0].unwrap();
    assert_eq!(part::<u64>(&hit, "instance"), hit.instance.to_bits());
    assert_eq!(part::<RayHit>(&hit, "hit"), hit.hit);

    let path = Motion::between(&translation(9.0, 0.0, 0.0), &translation(0.0, 0.0, 0.0)).unwrap();
    let paths: [(InstanceId, &(dyn RigidPath + Sync)); 1] = [(second, &path)];
    let answer = scene.motion(&paths, &MotionOptions::new()).unwrap();
    let SceneMotionAnswer::Hit { free_until, touching_at, pair: met, nearest } = answer else { panic!() };
    let written: Value = part(&answer, "Hit");
    assert_eq!(pair(&written), met);
    assert_eq!(part::<f64>(&written, "free_until"), free_until);
    assert_eq!(part::<f64>(&written, "touching_at"), touching_at);
    assert_eq!(part::<Distance>(&written, "nearest"), nearest);
    assert_eq!(to_value(SceneMotionAnswer::Free).unwrap(), json!("Free"));
}
