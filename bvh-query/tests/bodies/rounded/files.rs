//! Radii and solidity that files state, and that shapes write.

use crate::common::{Random, queriers, random_pose};
use bvh_query::Bvh;

/// A file that states a radius and solidity gives the answers of a shape that is rounded and made solid after it was opened.
#[test]
fn files_state_radii_and_solids() {
    let mut random = Random::new(77);
    let (block, cloud) =
        (bvh_bake::shapes::block([2.0; 3]).unwrap(), bvh_bake::shapes::cloud(&[[0.5, 0.25, 0.0]; 3]));
    let bake = |mesh, options: &bvh_bake::Options| {
        Bvh::from_bytes(bvh_bake::to_bytes(mesh, options).unwrap().0).unwrap()
    };
    let options = bvh_bake::Options::default;
    let stated = [bake(&block, &options().radius(0.25).solid(true)), bake(&cloud, &options().radius(0.5))];
    let plain = [bake(&block, &options()), bake(&cloud, &options())];
    let made = [plain[0].all().rounded(0.25).unwrap().solid().unwrap(), plain[1].all().rounded(0.5).unwrap()];
    for (shape, made) in stated.iter().zip(&made) {
        for shape in
            [shape.all(), shape.object(0).unwrap(), bvh_query::OwnedShape::from(shape.clone()).shape()]
        {
            assert_eq!((shape.radius(), shape.is_solid()), (made.radius(), made.is_solid()));
        }
    }
    let (mut inside, mut apart) = (0, 0);
    for querier in &mut queriers() {
        for _ in 0..200 {
            let pose = random_pose(&mut random, 2.5);
            let found = querier.distance(&stated[0], &stated[1], &pose).unwrap();
            assert_eq!(found, querier.distance(made[0], made[1], &pose).unwrap());
            let touches = querier.collide(&stated[0], &stated[1], &pose).unwrap();
            assert_eq!(touches, found.distance == 0.0);
            inside += usize::from(touches);
            apart += usize::from(!touches);
            // A radius that the caller gives replaces that of the file.
            let bare = stated[1].all().rounded(0.0).unwrap();
            let expected = querier.collide(made[0], &plain[1], &pose).unwrap();
            assert_eq!(querier.collide(&stated[0], bare, &pose).unwrap(), expected);
        }
    }
    assert!(inside > 50 && apart > 50, "{inside} {apart}");
}

/// The bytes of a rounded shape are those of a bake with that radius.
#[test]
fn bytes_state_the_radius_and_the_solidity() {
    let bake = |options: bvh_bake::Options| {
        let mut mesh = bvh_bake::shapes::block([1.0, 2.0, 3.0]).unwrap();
        mesh.objects.extend(bvh_bake::shapes::block([2.0; 3]).unwrap().objects);
        mesh.objects[1].triangle_ids = (12..24).collect();
        bvh_bake::to_bytes(&mesh, &options.split_objects(true)).unwrap().0
    };
    let plain = bvh_query::OwnedShape::from(Bvh::from_bytes(bake(bvh_bake::Options::default())).unwrap());
    assert!(matches!(plain.bytes().unwrap(), std::borrow::Cow::Borrowed(_)));
    let rounded = plain.clone().rounded(0.25).unwrap();
    assert_eq!(rounded.bytes().unwrap(), bake(bvh_bake::Options::default().radius(0.25)));
    let solid = rounded.solid().unwrap();
    assert_eq!(solid.bytes().unwrap(), bake(bvh_bake::Options::default().radius(0.25).solid(true)));
    let again = bvh_query::OwnedShape::from(Bvh::from_bytes(solid.bytes().unwrap().into_owned()).unwrap());
    assert_eq!((again.shape().radius(), again.shape().is_solid()), (0.25, true));
    assert_eq!(again.rounded(0.0).unwrap().bytes().unwrap(), bake(bvh_bake::Options::default().solid(true)));
    // A file with an open object has no solids, though one of its objects may be one.
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/ok-topology.cbvh");
    let mixed = Bvh::read(folder).unwrap();
    let one = bvh_query::OwnedShape::object(mixed, 0).unwrap().rounded(0.5).unwrap().solid().unwrap();
    let saved = Bvh::from_bytes(one.bytes().unwrap().into_owned()).unwrap();
    saved.validate().unwrap();
    assert_eq!((saved.all().radius(), saved.all().is_solid()), (0.5, false));
}
