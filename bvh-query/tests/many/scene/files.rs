//! Scene files, and scenes whose files are opened at first need.

use super::{Random, ask, place, shape, shapes};
use crate::common::shapes::sphere;
use bvh_query::{Bvh, FileChange, Files, Groups, OwnedShape, Pose, QueryError, Rule, Scene, SceneError};
use std::path::{Path, PathBuf};

/// Writes a file of its own for each shape, and returns the folder and the paths.
fn files_of(shapes: &[OwnedShape]) -> (cbvh_testkit::TempDir, Vec<PathBuf>) {
    let folder = cbvh_testkit::folder();
    let path = |number: usize| folder.path().join(format!("{number}.cbvh"));
    let paths: Vec<_> = (0..shapes.len()).map(path).collect();
    paths.iter().zip(shapes).for_each(|(path, shape)| std::fs::write(path, shape.bvh().bytes()).unwrap());
    (folder, paths)
}

/// A scene file is a scene of its objects, each with its name, its pose and its groups.
#[test]
fn a_scene_file_is_the_scene_of_its_instances() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/ok-scene.cbvh");
    let bvh = Bvh::read(&path).unwrap();
    let mut opened = Scene::of_file(bvh.clone()).unwrap();
    let mut built = Scene::new().unwrap();
    let turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let cube = OwnedShape::object(bvh.clone(), 0).unwrap();
    built.add_named("cube", cube.clone(), Pose::IDENTITY).unwrap();
    let turned = built.add_named("turned", cube.clone(), Pose::new(turn, [1.5, 0.0, -2.5]).unwrap()).unwrap();
    built.set_groups(turned, Groups { member: 6, meets: 1 }).unwrap();
    built.set_margin(turned, 0.25).unwrap();
    built.add(cube, Pose::IDENTITY).unwrap();
    assert_eq!(opened.len(), 3);
    assert_eq!(opened.instances().collect::<Vec<_>>(), built.instances().collect::<Vec<_>>());
    for id in built.instances() {
        assert_eq!(opened.name(id), built.name(id));
        assert_eq!(opened.pose(id), built.pose(id));
        assert_eq!(opened.margin(id), built.margin(id));
    }
    assert_eq!(ask(&mut opened), ask(&mut built));
    assert_eq!(opened.pairs_in_contact().unwrap().len(), 1);
    opened.set_groups(turned, Groups::ALL).unwrap();
    built.set_groups(turned, Groups::ALL).unwrap();
    assert_eq!(ask(&mut opened), ask(&mut built));
    assert_eq!(opened.distance().unwrap().unwrap().nearest.distance, 0.0);

    let plain = path.with_file_name("ok-plain.cbvh");
    assert_eq!(Scene::of_file(Bvh::read(plain).unwrap()).unwrap_err(), SceneError::NoInstances);
    for (bad, rule) in [
        ("R40-no-instances", "R40"),
        ("R41-object-1", "R41"),
        ("R42-scaled", "R42"),
        ("R43-twice", "R43"),
        ("R50-negative-margin", "R50"),
    ] {
        let bad = path.with_file_name(format!("bad-{bad}.cbvh"));
        // Without its world, the file is as good as any.
        let said = Scene::of_file(Bvh::read(bad).unwrap()).unwrap_err().to_string();
        assert!(said.contains(rule), "{said}");
    }
}

/// Files that open at first need give the answers of open ones, and no more than the bound stay open.
#[test]
fn files_open_at_first_need_and_few_stay_open() {
    let shapes = shapes();
    let (_folder, paths) = files_of(&shapes);
    let mut random = Random::new(7);
    for (most, parallel) in [(1, false), (2, false), (2, true), (100, true)] {
        let files = if parallel || cfg!(target_family = "wasm") {
            Files::new(most)
        } else {
            // SAFETY: nobody changes these files.
            unsafe { Files::mapped(most) }
        };
        let same = |(path, shape): (&PathBuf, &OwnedShape)| {
            let (stored, objects) = (files.shape(path).unwrap(), shape.shape().objects());
            let first = shape.bvh().objects().iter().position(|object| object == &objects[0]).unwrap();
            if objects.len() == stored.objects().len() { stored } else { stored.object(first).unwrap() }
        };
        let stored: Vec<_> = paths.iter().zip(&shapes).map(same).collect();
        assert_eq!(files.open_count(), 0);
        let (mut lazy, mut eager) = (Scene::new().unwrap(), Scene::new().unwrap());
        lazy.set_parallel(parallel);
        for _ in 0..40 {
            let number = random.below(shapes.len());
            let world = place(&mut random, &shapes[number], 3.0);
            assert_eq!(
                lazy.add(stored[number].clone(), world).unwrap(),
                eager.add(shapes[number].clone(), world).unwrap()
            );
        }
        assert_eq!(files.open_count(), 0);
        assert!(ask(&mut lazy) == ask(&mut eager));
        assert!((1..=most).contains(&files.open_count()), "{} of {most}", files.open_count());
    }
}

/// Whoever needs a file that vanished, or is another one now, is told which.
#[test]
fn a_file_that_vanishes_or_changes_is_named() {
    let both = [shape(&sphere(2)), shape(&sphere(3))];
    let (_folder, paths) = files_of(&both);
    let files = Files::new(4);
    let stored: Vec<_> = paths.iter().map(|path| files.shape(path).unwrap()).collect();
    assert!(stored[0].object(0).is_some() && stored[0].object(1).is_none());
    let mut scene = Scene::new().unwrap();
    let at = |x: f64| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]).unwrap();
    let first = scene.add_named("first", stored[0].clone(), at(0.0)).unwrap();
    let second = scene.add_named("second", stored[1].clone(), at(9.0)).unwrap();
    std::fs::remove_file(&paths[1]).unwrap();
    // Far apart, nobody needs it.
    assert_eq!(scene.pairs_in_contact().unwrap(), []);
    scene.set_pose(second, at(0.5)).unwrap();
    let error = scene.pairs_in_contact().unwrap_err();
    let SceneError::Pair { a, b, source } = &error else { panic!("{error:?}") };
    assert_eq!(
        (a.id, a.name.as_deref(), b.id, b.name.as_deref()),
        (first, Some("first"), second, Some("second"))
    );
    let changed = |found| QueryError::File { path: paths[1].clone(), found };
    assert_eq!(*source, changed(FileChange::Unreadable(std::io::ErrorKind::NotFound)));
    let said = error.to_string();
    assert!(said.starts_with("instances first and second: ") && said.contains("1.cbvh: expected"), "{said}");
    assert!(said.contains("(entity not found)") && !said.contains('\n'), "{said}");
    std::fs::write(&paths[1], both[0].bvh().bytes()).unwrap();
    let refused = |answer: Result<(), SceneError>| match answer {
        Err(SceneError::Pair { source, .. }) => source,
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(scene.collide().map(drop)), changed(FileChange::Replaced));
    std::fs::write(&paths[1], b"no").unwrap();
    assert_eq!(refused(scene.distance().map(drop)), changed(FileChange::Damaged(Rule::Magic)));
    // The same file again is as good as ever, and an open file stays what it is.
    std::fs::write(&paths[1], both[1].bvh().bytes()).unwrap();
    assert!(scene.collide().unwrap());
    std::fs::remove_file(&paths[1]).unwrap();
    assert!(scene.collide().unwrap());
}

/// Shapes whose files open at first need have the radius that their files state, and solid instances are solid.
#[test]
fn stored_shapes_and_instances_have_what_their_files_state() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("point.cbvh");
    let options = bvh_bake::Options::default().radius(0.5);
    let point = bvh_bake::shapes::point([0.0; 3]);
    std::fs::write(&path, bvh_bake::to_bytes(&point, &options).unwrap().0).unwrap();
    let stored = Files::new(1).shape(&path).unwrap();
    assert_eq!((stored.radius(), stored.object(0).unwrap().radius()), (0.5, 0.5));
    assert_eq!(stored.opened().unwrap().shape().radius(), 0.5);

    let mut block = bvh_bake::shapes::block([4.0; 3]).unwrap();
    let hollow = bvh_bake::mesh::Instance::of_object(0);
    for (solid, touches) in [(false, false), (true, true)] {
        block.instances = vec![bvh_bake::mesh::Instance { solid, ..hollow.clone() }];
        let bytes = bvh_bake::to_bytes(&block, &bvh_bake::Options::default()).unwrap().0;
        let mut scene = Scene::of_file(Bvh::from_bytes(bytes).unwrap()).unwrap();
        scene.add(stored.clone(), Pose::IDENTITY).unwrap();
        assert_eq!(scene.pairs_in_contact().unwrap().len(), usize::from(touches));
    }
}
