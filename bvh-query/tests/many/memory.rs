//! What a querier keeps from one query to the next changes no answer and no count of work.

use crate::common::shapes::{moved, rounded, sphere, terrain, torus};
use crate::common::{Random, backends, bake, baked, mesh, options, random_pose};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier, QueryStats};
use cbvh_testkit::depth::rounds;

/// The answers of a querier, and the work for each.
fn ask(querier: &mut Querier, a: &Bvh, b: &Bvh, pose: &Pose) -> (String, [QueryStats; 3]) {
    let mut stats = [QueryStats::default(); 3];
    let touch = querier.collide(a, b, pose).unwrap();
    stats[0] = querier.stats();
    let distance = querier.distance(a, b, pose).unwrap();
    stats[1] = querier.stats();
    let contacts = querier.contacts(a, b, pose).unwrap();
    stats[2] = querier.stats();
    assert_eq!(touch, distance.distance == 0.0);
    (format!("{distance:?} {contacts:?}"), stats)
}

fn bodies() -> Vec<Bvh> {
    let large = sphere(4);
    let small = rounded(moved(&torus(24, 12), 0.2, [0.0; 3]));
    vec![
        baked(&large),
        bake(&mesh(&small), &options(Profile::Dop6U8, TriangleEncoding::Packed)),
        bake(&mesh(&terrain(30, 3)), &options(Profile::Dop14U8, TriangleEncoding::F32)),
    ]
}

/// One querier asks about several pairs in turn, so that it has nodes of the same file, of another one, and too many.
#[test]
fn a_used_querier_answers_like_a_new_one() {
    let bodies = bodies();
    for backend in backends() {
        let (mut random, mut used) = (Random::new(5), Querier::with_backend(backend));
        let mut touching = 0;
        for round in 0..rounds(60) {
            let (a, b) = (&bodies[random.below(3)], &bodies[random.below(3)]);
            let pose = random_pose(&mut random, 1.5);
            // Some pairs are asked several times, others once.
            for _ in 0..1 + random.below(3) {
                let found = ask(&mut used, a, b, &pose);
                let expected = ask(&mut Querier::with_backend(backend), a, b, &pose);
                assert_eq!(found, expected, "{backend}, round {round}");
                touching += u32::from(found.0.contains("distance: 0.0,"));
            }
        }
        assert!(touching > 5, "{touching}");
    }
}

/// A file at the address of one that is gone is another file.
#[test]
fn nodes_of_a_file_that_is_gone_are_forgotten() {
    let (near, far) = (sphere(3), moved(&sphere(3), 0.5, [3.0, 0.0, 0.0]));
    let mut used = Querier::new().unwrap();
    for round in 0..20 {
        let shape = if round % 2 == 0 { &near } else { &far };
        let body = Box::new(bake(&mesh(shape), &options(Profile::Dop14U8, TriangleEncoding::F32)));
        let pose = crate::common::translation(1.5, 0.0, 0.0);
        let expected = Querier::new().unwrap().distance(&*body, &*body, &pose).unwrap();
        assert_eq!(used.distance(&*body, &*body, &pose).unwrap(), expected, "round {round}");
    }
}

/// All backends meet the same contact first: it is the one that a distance of 0 names.
#[test]
fn touching_meshes_name_the_same_contact_on_every_backend() {
    let bodies = bodies();
    let mut random = Random::new(6);
    let mut touching = 0;
    for round in 0..rounds(200) {
        let (a, b) = (&bodies[random.below(3)], &bodies[random.below(3)]);
        let pose = random_pose(&mut random, 1.2);
        let mut found = backends().into_iter().map(|backend| {
            let mut querier = Querier::with_backend(backend);
            (querier.distance(a, b, &pose).unwrap(), querier.contacts(a, b, &pose).unwrap())
        });
        let (first, contacts) = found.next().unwrap();
        if first.distance == 0.0 {
            touching += 1;
            let is_it = |contact: &bvh_query::Contact| {
                (contact.triangle_a, contact.triangle_b) == (first.triangle_a, first.triangle_b)
            };
            assert!(contacts.iter().any(is_it), "round {round}: {first:?} is no contact");
        }
        for (other, _) in found {
            assert_eq!(other, first, "round {round}");
        }
    }
    assert!(touching > 5, "{touching}");
}
