//! Inside and outside: labels, and winding numbers of rationals where it is hard.

use super::hard::{in_poses, point};
use super::labels::{each_label, number};
use super::rationals::{first, winding};
use crate::common::shapes::{cube, on_lattice, outward, sphere};
use crate::common::{Random, Triangle, baked, note, queriers};
use bvh_query::Side;
use cbvh_testkit::depth::rounds;

#[test]
#[ignore = "needs ../shared"]
fn labelled_points_are_on_their_sides() {
    let mut queriers = queriers();
    let mut counts = [0; 3];
    each_label(&["ball", "dragon"], "points", |bvh, point: [f64; 3], label, line| {
        let label = (number(label, "side") + 1.0) as usize;
        let expected = [Side::Outside, Side::On, Side::Inside][label];
        counts[label] += 1;
        for querier in &mut queriers {
            assert_eq!(querier.side(bvh, point), Ok(expected), "{line}");
        }
    });
    assert!(counts.iter().sum::<u32>() == 2000 && counts.iter().all(|count| *count > 50), "{counts:?}");
    note(&format!("{counts:?} points outside, on and inside"));
}

/// The side of a point by rationals.
fn side(random: &mut Random, point: &[f64; 3], triangles: &[Triangle], is_closed: bool) -> Side {
    let axis = [1.0, 0.0, 0.0];
    let is_on = |t: &Triangle| {
        first(point, &axis, t).is_some_and(|t| t.compare(&super::rationals::Rational::of(0.0)).is_eq())
    };
    if triangles.iter().any(is_on) {
        return Side::On;
    }
    if !is_closed {
        return Side::Undefined;
    }
    loop {
        if let Some(winding) = winding(point, &random.point(), triangles) {
            return if winding == 0 { Side::Outside } else { Side::Inside };
        }
    }
}

#[test]
fn a_point_outside_the_box_costs_no_walk() {
    let ball = outward(on_lattice(sphere(3)));
    let bvh = baked(&ball);
    let mut querier = bvh_query::Querier::new().unwrap();
    for axis in 0..3 {
        for far in [-2.0, 2.0, -1e6] {
            let mut point = [0.01, 0.02, 0.03];
            point[axis] = far;
            assert_eq!(querier.side(&bvh, point), Ok(Side::Outside));
            assert_eq!(querier.stats().node_tests, 0, "{point:?}");
        }
    }
    assert_eq!(querier.side(&bvh, [0.01, 0.02, 0.03]), Ok(Side::Inside));
    assert!(querier.stats().node_tests > 0);
}

/// Overlapping parts are one solid, but their faces inside it are still faces of the mesh.
#[test]
fn inside_overlapping_parts_the_closest_face_may_be_an_inner_one() {
    let beside: Vec<Triangle> = cube().iter().map(|t| t.map(|[x, y, z]| [x + 1.5, y, z])).collect();
    let bvh = baked(&[cube(), beside].concat());
    let mut querier = bvh_query::Querier::new().unwrap();
    // The faces at 0.5 and 1 are inside the other part; the outside is at a distance of 1.
    let signed = querier.signed_point_distance(&bvh, [0.625, 0.0, 0.0], f64::INFINITY).unwrap().unwrap();
    assert_eq!((signed.side, signed.value()), (Side::Inside, Some(-0.125)));
}

#[test]
fn hard_points_are_on_the_sides_that_rationals_say() {
    let random = &mut Random::new(53);
    let mut queriers = queriers();
    let mut counts = [0; 4];
    for (mesh_of, pose) in in_poses(random) {
        let bvh = baked(&mesh_of.triangles);
        let mesh_of = mesh_of.placed(&pose);
        for _ in 0..rounds(60) {
            let point = point(random, &mesh_of);
            // Vertices keep their coordinates: they are f32 numbers around an origin. Duplicates count.
            let expected = side(random, &point, &mesh_of.triangles, mesh_of.is_closed);
            for querier in &mut queriers {
                let what = format!("{} {point:?} {:?}", mesh_of.name, querier.backend());
                assert_eq!(querier.side(bvh.all().at(&pose), point), Ok(expected), "{what}");
            }
            counts[(expected as i8 + 1) as usize] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 50), "{counts:?}");
    note(&format!("{counts:?} hard points outside, on, inside and where nothing is inside"));
}
