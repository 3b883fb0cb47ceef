//! Rays and segments: labels, hard cases, and every corner and edge of closed meshes seen from inside.

use super::hard::{direction, in_poses, point, stored_at};
use super::labels::{each_label, number};
use super::rationals::{Rational, first};
use crate::common::shapes::on_lattice;
use crate::common::{Random, baked, note, queriers, stored};
use bvh_query::{NumberError, Querier, QueryError, Ray};
use cbvh_testkit::depth::rounds;

const MESHES: [&str; 5] = ["ball", "bunny", "nao", "apollo", "dragon"];

#[test]
#[ignore = "needs ../shared"]
fn labelled_rays_hit_where_they_should() {
    let (mut hits, mut all, mut worst) = (0, 0, 0.0f64);
    let mut queriers = queriers();
    each_label(&MESHES, "rays", |bvh, [a, b, c, d, e, f], label, line| {
        let (ray, label) = (Ray::new([a, b, c], [d, e, f]), number(label, "t"));
        let mut first = None;
        for querier in &mut queriers {
            let found = querier.first_hit(bvh, &ray).unwrap();
            assert_eq!(*first.get_or_insert(found), found, "{line} {:?}", querier.backend());
            assert_eq!(querier.any_hit(bvh, &ray), Ok(found.is_some()), "{line}");
            let all = querier.all_hits(bvh, &ray).unwrap();
            assert_eq!(all.first().copied(), found, "{line}");
            assert!(all.is_sorted_by(|x, y| x.t <= y.t));
        }
        let found = first.unwrap();
        assert_eq!(found.is_none(), label == -1.0, "{line} {found:?}");
        all += 1;
        let Some(hit) = found else { return };
        hits += 1;
        let slack = label * f64::EPSILON;
        assert!(hit.lower <= label + slack && label - slack <= hit.upper, "{line} {hit:?}");
        assert_eq!(hit.t == 0.0, label == 0.0);
        worst = worst.max((hit.t - label).abs() / label);
    });
    assert!(worst <= 2f64.powi(-43), "{worst:e}");
    assert!(all == 5000 && hits > 1000 && all - hits > 500, "{hits} of {all} rays hit");
    note(&format!("{all} rays, {hits} hits, parameters off by at most {worst:e} of themselves"));
}

#[test]
#[ignore = "needs ../shared"]
fn labelled_segments_meet_what_they_should() {
    let (mut met, mut all) = (0, 0);
    let mut queriers = queriers();
    each_label(&MESHES, "segments", |bvh, [a, b, c, d, e, f], label, line| {
        let label = number(label, "hit") == 1.0;
        for querier in &mut queriers {
            let found = querier.segment_hit(bvh, [a, b, c], [d, e, f]).unwrap();
            assert_eq!(found, label, "{line} {:?}", querier.backend());
            assert_eq!(querier.segment_hit(bvh, [d, e, f], [a, b, c]), Ok(found), "{line}");
        }
        met += u32::from(label);
        all += 1;
    });
    assert!(all == 5000 && met > 1000 && all - met > 500, "{met} of {all} segments meet their mesh");
    note(&format!("{all} segments, {met} meet their mesh"));
}

/// Rays through features, in planes, along edges and axes: what is hit, where, and in which order is that of rationals.
#[test]
fn hard_rays_hit_what_rationals_say() {
    let random = &mut Random::new(51);
    let mut queriers = queriers();
    let (mut asked, mut hits, mut shared) = (0, 0, 0);
    for (mesh_of, pose) in in_poses(random) {
        let bvh = baked(&mesh_of.triangles);
        let (shape, stored, mesh_of) = (bvh.all().at(&pose), stored_at(&bvh, &pose), mesh_of.placed(&pose));
        for _ in 0..rounds(40) {
            let origin = point(random, &mesh_of);
            let direction = direction(random, &mesh_of, &origin);
            let what = format!("{} {origin:?} {direction:?} {pose:?}", mesh_of.name);
            let mut met: Vec<(Rational, u32)> = stored
                .iter()
                .filter_map(|stored| Some((first(&origin, &direction, &stored.corners)?, stored.id)))
                .collect();
            met.sort_by(|x, y| x.0.compare(&y.0).then(x.1.cmp(&y.1)));
            let until = match random.below(4) {
                // Where the hit is, if that is a number, and just before.
                0 => 1.0,
                1 => 1f64.next_down(),
                _ => f64::INFINITY,
            };
            if until.is_finite() {
                met.retain(|(t, _)| t.compare(&Rational::of(until)).is_le());
            }
            let with_ties = met.len();
            met.dedup_by(|later, earlier| later.0.compare(&earlier.0).is_eq());
            let ray = Ray::new(origin, direction).until(until);
            for querier in &mut queriers {
                let what = format!("{what} until {until} {:?}", querier.backend());
                let all = querier.all_hits(shape, &ray).unwrap();
                assert_eq!(all.len(), met.len(), "{what}: {all:?} {met:?}");
                for (hit, (t, id)) in all.iter().zip(&met) {
                    assert_eq!(hit.triangle, *id, "{what}");
                    assert!(t.compare(&Rational::of(hit.lower)).is_ge(), "{what} {hit:?} {t:?}");
                    assert!(t.compare(&Rational::of(hit.upper)).is_le(), "{what} {hit:?} {t:?}");
                    assert_eq!(hit.t == 0.0, t.compare(&Rational::of(0.0)).is_eq(), "{what}");
                    assert!(hit.lower <= hit.t && hit.t <= hit.upper);
                    assert!(hit.upper - hit.lower <= 2f64.powi(-43) * hit.t, "{what} {hit:?}");
                }
                assert_eq!(querier.first_hit(shape, &ray), Ok(all.first().copied()), "{what}");
                assert_eq!(querier.any_hit(shape, &ray), Ok(!all.is_empty()), "{what}");
            }
            asked += 1;
            hits += u32::from(!met.is_empty());
            shared += u32::from(with_ties > met.len());
        }
    }
    assert!(hits > asked / 3 && shared > asked / 10, "{hits} {shared} of {asked}");
    note(&format!("{asked} hard rays, {hits} hit something, {shared} several triangles in one point"));
}

#[test]
fn hard_segments_meet_what_rationals_say() {
    let random = &mut Random::new(52);
    let mut queriers = queriers();
    let (mut asked, mut met) = (0, 0);
    for (mesh_of, pose) in in_poses(random) {
        let bvh = baked(&mesh_of.triangles);
        let (shape, stored, mesh_of) = (bvh.all().at(&pose), stored_at(&bvh, &pose), mesh_of.placed(&pose));
        for _ in 0..rounds(40) {
            let (from, to) = (point(random, &mesh_of), point(random, &mesh_of));
            let direction = [0, 1, 2].map(|k| to[k] - from[k]);
            let is_exact = (0..3).all(|k| from[k] + direction[k] == to[k] && to[k] - direction[k] == from[k]);
            if !is_exact || direction == [0.0; 3] {
                continue;
            }
            let one = Rational::of(1.0);
            let expected = stored.iter().any(|stored| {
                first(&from, &direction, &stored.corners).is_some_and(|t| t.compare(&one).is_le())
            });
            for querier in &mut queriers {
                let what = format!("{} {from:?} {to:?} {:?}", mesh_of.name, querier.backend());
                assert_eq!(querier.segment_hit(shape, from, to), Ok(expected), "{what}");
            }
            asked += 1;
            met += u32::from(expected);
        }
    }
    assert!(met > asked / 4 && met < asked, "{met} of {asked}");
    note(&format!("{asked} hard segments, {met} meet their mesh"));
}

/// From inside a closed mesh, no ray through a corner or the middle of an edge escapes.
#[test]
fn no_ray_escapes_through_a_corner_or_an_edge() {
    let mut querier = Querier::new().unwrap();
    let meshes = [
        ("sphere", crate::common::shapes::sphere(4), [0.0; 3]),
        ("torus", on_lattice(crate::common::shapes::torus(96, 48)), [1.0, 0.0, 0.0]),
        ("cube", crate::common::shapes::cube(), [0.25, -0.5, 0.125]),
    ];
    for (name, triangles, inside) in meshes {
        let bvh = baked(&triangles);
        let mut asked = 0;
        for stored in stored(&bvh) {
            for i in 0..3 {
                let (p, q) = (stored.corners[i], stored.corners[(i + 1) % 3]);
                for target in [p, [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0)] {
                    let ray = Ray::new(inside, [0, 1, 2].map(|k| target[k] - inside[k]));
                    let hit = querier.first_hit(&bvh, &ray).unwrap();
                    // Rounding may lead the ray past the edge of a silhouette, but not out.
                    assert!(hit.is_some(), "{name} {target:?}");
                    asked += 1;
                }
            }
        }
        note(&format!("{name}: {asked} rays from inside, none escaped"));
    }
}

#[test]
fn numbers_that_mean_nothing_are_refused() {
    let bvh = baked(&crate::common::shapes::cube());
    for querier in &mut queriers() {
        let mut refused = |ray: Ray| match querier.first_hit(&bvh, &ray) {
            Err(QueryError::Number(wrong)) => wrong,
            other => panic!("{other:?}"),
        };
        let (o, d) = ([0.0; 3], [1.0, 0.0, 0.0]);
        for bad in [f64::NAN, f64::INFINITY, 2f64.powi(121)] {
            assert!(matches!(refused(Ray::new([0.0, bad, 0.0], d)), NumberError::Point(_)));
        }
        for bad in
            [[0.0; 3], [f64::NAN, 1.0, 1.0], [f64::INFINITY, 0.0, 0.0], [1e-200, 0.0, 0.0], [0.0, 1e200, 0.0]]
        {
            assert!(matches!(refused(Ray::new(o, bad)), NumberError::Direction(_)), "{bad:?}");
        }
        for bad in [f64::NAN, -1.0] {
            assert!(matches!(refused(Ray::new(o, d).until(bad)), NumberError::Until(_)));
        }
        let far = Ray::new([2f64.powi(120), 0.0, 0.0], [-(2f64.powi(500)), 0.0, 0.0]);
        assert_eq!(querier.first_hit(&bvh, &far).unwrap().unwrap().t, 2f64.powi(-380));
        assert!(querier.any_hit(&bvh, &Ray::new([0.0; 3], [2f64.powi(-500), 0.0, 0.0])).unwrap());
        assert_eq!(querier.segment_hit(&bvh, [0.0; 3], [0.0; 3]), Ok(false));
        assert_eq!(querier.segment_hit(&bvh, [1.0; 3], [1.0; 3]), Ok(true));
        assert!(querier.segment_hit(&bvh, [0.0; 3], [f64::NAN; 3]).is_err());
    }
}
