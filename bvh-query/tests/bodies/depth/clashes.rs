//! The classes of pairs of parts, and those of a scene.

use crate::common::shapes::{cube, moved, outward, plate};
use crate::common::{bake, baked, queriers, translation};
use bvh_query::{Bvh, Clash, ClashClass, ClashOptions, Pose, Querier, Scene};

fn ask(querier: &mut Querier, a: &Bvh, b: &Bvh, pose: &Pose, options: &ClashOptions) -> Clash {
    querier.clash(a, b, pose, options).unwrap()
}

#[test]
fn pairs_have_the_class_that_their_gap_and_depth_say() {
    let (a, small) = (baked(&outward(cube())), baked(&moved(&outward(cube()), 0.25, [0.0; 3])));
    let (same, open) = (baked(&outward(cube())), baked(&plate(2)));
    let options = ClashOptions::new().clearance(0.25).tolerance(1e-3);
    let at = |x: f64| translation(x, 0.25, 0.125);
    let cases = [
        (&a, &a, at(2.5), ClashClass::Apart),
        (&a, &a, at(2.125), ClashClass::Near),
        (&a, &a, at(2.25), ClashClass::Near),
        (&a, &a, at(2.0), ClashClass::Touching),
        (&a, &a, at(2.0 - 1e-4), ClashClass::Touching),
        (&a, &a, at(1.99), ClashClass::Overlapping),
        (&a, &small, at(0.25), ClashClass::Contained),
        (&small, &a, at(0.25), ClashClass::Contained),
        (&a, &a, Pose::IDENTITY, ClashClass::Duplicated),
        (&a, &same, translation(1e-4, 0.0, -1e-4), ClashClass::Duplicated),
        (&a, &same, translation(1e-2, 0.0, 0.0), ClashClass::Overlapping),
        (&a, &open, at(0.5), ClashClass::Intersecting),
        (&open, &small, translation(0.0, 0.0, 4.0), ClashClass::Apart),
    ];
    for mut querier in queriers() {
        for (number, (a, b, pose, class)) in cases.iter().enumerate() {
            let found = ask(&mut querier, a, b, pose, &options);
            assert_eq!(found.class, *class, "case {number}: {found:?}");
            assert_eq!(
                found.depth.is_some(),
                matches!(class, ClashClass::Touching | ClashClass::Overlapping)
            );
            match class {
                ClashClass::Apart => assert_eq!(found.distance, f64::INFINITY),
                ClashClass::Near => assert!((found.distance - (pose.translation()[0] - 2.0)).abs() < 1e-12),
                _ => assert_eq!(found.distance, 0.0),
            }
        }
        for (options, what) in [
            (ClashOptions::new().clearance(-1.0), "clearance: expected"),
            (ClashOptions::new().tolerance(f64::NAN), "tolerance: expected"),
            (ClashOptions::new().relative_gap(0.0), "relative_gap: expected"),
        ] {
            let refused = querier.clash(&a, &a, &Pose::IDENTITY, &options).unwrap_err();
            assert!(refused.to_string().starts_with(what), "{refused}");
        }
    }
}

/// A peg in a hole without a gap touches on all sides: no way out is short, and nothing is deep.
#[test]
fn a_tight_fit_is_undecided_with_its_bounds() {
    let cells: Vec<[i32; 3]> = (0..9).filter(|&n| n != 4).map(|n| [n % 3, n / 3, 0]).collect();
    let ring = bvh_bake::shapes::voxels(&cells, 1.0).unwrap();
    let peg = bvh_bake::shapes::voxels(&[[1, 1, 0]], 1.0).unwrap();
    let [ring, peg] = [ring, peg].map(|mesh| bake(&mesh, &bvh_bake::Options::default()));
    let found = ask(&mut queriers()[0], &ring, &peg, &Pose::IDENTITY, &ClashOptions::new().tolerance(1e-3));
    let depth = found.depth.unwrap();
    assert_eq!(found.class, ClashClass::Undecided, "{found:?}");
    assert!(depth.lower == 0.0 && (1.0..1.01).contains(&depth.upper), "{found:?}");
}

#[test]
fn a_scene_lists_what_its_pairs_say_with_any_number_of_threads() {
    let a = bvh_query::OwnedShape::from(baked(&outward(cube())));
    let mut scene = Scene::new().unwrap();
    for (x, y, z) in [(0.0, 0.0, 0.0), (1.5, 0.25, 0.0), (3.5, 0.125, 0.5), (6.0, 0.0, 0.0), (6.0, 0.0, 0.0)]
    {
        scene.add(a.clone(), translation(x, y, z)).unwrap();
    }
    let options = ClashOptions::new().clearance(0.75).tolerance(1e-6);
    let found = scene.clashes(&options).unwrap();
    let classes: Vec<_> = found.iter().map(|clash| clash.clash.class).collect();
    use ClashClass::{Duplicated, Near, Overlapping, Touching};
    assert_eq!(classes, [Overlapping, Touching, Near, Near, Duplicated]);
    #[cfg(feature = "parallel")]
    {
        scene.set_parallel(true);
        assert_eq!(scene.clashes(&options).unwrap(), found);
    }
    assert!(scene.clashes(&ClashOptions::new().clearance(f64::NAN)).is_err());
}
