//! All hits of rays and shapes with a radius, compared with exact distances along the ray and with formulas for balls and capsules.

use super::{WHOLE, lattice_core, sum};
use crate::common::nearest::point_triangle;
use crate::common::shapes::{cube, outward, soup, torus};
use crate::common::{Random, Triangle, baked, queriers, random_pose, stored, translation};
use bvh_query::{Bvh, OwnedShape, Pose, Querier, Ray, RayHit, Scene};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::Length;

/// Asks all backends, which agree with each other and with the first hit.
fn all_hits(queriers: &mut [Querier], bvh: &Bvh, radius: f64, ray: &Ray) -> Vec<RayHit> {
    let shape = bvh.all().rounded(radius).unwrap();
    let mut answers = queriers.iter_mut().map(|querier| {
        let all = querier.all_hits(shape, ray).unwrap();
        let first = querier.first_hit(shape, ray).unwrap();
        assert_eq!(all.first().map(|hit| (hit.t, hit.upper)), first.map(|hit| (hit.t, hit.upper)), "{ray:?}");
        assert_eq!(all.first().map(|hit| hit.triangle), first.map(|hit| hit.triangle), "{ray:?}");
        assert_eq!(querier.any_hit(shape, ray).unwrap(), first.is_some());
        all
    });
    let all = answers.next().unwrap();
    assert!(answers.all(|other| other == all));
    assert!(all.is_sorted_by(|x, y| x.t <= y.t && x.lower <= y.lower && x.upper <= y.upper), "{all:?}");
    assert!(all.iter().all(|hit| hit.lower <= hit.t && hit.t <= hit.upper && hit.t <= ray.until), "{all:?}");
    all
}

/// Returns the exact distances of triangles from a point of a ray that is exact.
fn distances(core: &[Triangle], ray: &Ray, t: f64) -> Vec<Length> {
    let point = [0, 1, 2].map(|k| ray.origin[k] + t * ray.direction[k]);
    core.iter().map(|triangle| Length::between(triangle, &[point; 3])).collect()
}

/// Between an entry and the exit after it, and only there, a triangle is within the radius: at points which are exact, of rays whose
/// numbers are small.
fn check_parts(core: &[Triangle], radius: f64, ray: &Ray, hits: &[RayHit], until: f64) {
    let mut from = 0.0;
    for (number, part) in (0..=hits.len()).enumerate() {
        let is_inside = part % 2 == 1;
        let to = hits.get(number).map_or(until, |hit| hit.lower);
        for step in 0..=16 {
            // A multiple of 2^-20.
            let t = ((from + (to - from) * f64::from(step) / 16.0) * 1048576.0).round() / 1048576.0;
            if t < from || t > to {
                continue;
            }
            let found = distances(core, ray, t).iter().any(|length| length.compare(radius).is_le());
            // An end of an interval belongs to it.
            let is_end = hits.iter().any(|hit| t == hit.lower || t == hit.upper);
            assert!(found == is_inside || is_end, "{t} of {ray:?}, {radius} around {core:?}: {hits:?}");
        }
        from = hits.get(number).map_or(until, |hit| hit.upper);
    }
}

/// Each hit is on the surface of the triangle that it names, and in no other one.
fn check_ids(bvh: &Bvh, core: &[Triangle], radius: f64, hits: &[RayHit]) {
    let ids: Vec<u32> = stored(bvh).iter().map(|stored| stored.id).collect();
    for hit in hits.iter().filter(|hit| hit.t > 0.0) {
        let off = |triangle: &Triangle| point_triangle(hit.point, triangle) - radius;
        // Where a ray grazes, the parameter is known to half the digits.
        let tolerance = 1e-12 + 2.0 * (hit.upper - hit.lower);
        let named = ids.iter().position(|id| *id == hit.triangle).unwrap();
        assert!(off(&core[named]).abs() < tolerance, "{hit:?} {radius} {}", off(&core[named]));
        assert!(core.iter().all(|triangle| off(triangle) > -tolerance), "{hit:?} {radius}");
    }
}

/// Points, segments and triangles, tangents among them: exact distances tell where each ray is in the body.
#[test]
fn rays_are_in_rounded_cores_between_entries_and_exits() {
    let mut queriers = queriers();
    let mut random = Random::new(21);
    let (mut hits, mut several, mut inside, mut ended) = (0, 0, 0, 0);
    for round in 0..rounds(300) {
        let core = lattice_core(&mut random, 1 + round as usize % 7);
        let bvh = baked(&core);
        let core: Vec<Triangle> = stored(&bvh).iter().map(|stored| stored.corners).collect();
        let radius = [0.25, 0.75, 1.0, 2.0][random.below(4)];
        // Through a corner, along an edge, or anywhere.
        let triangle = core[random.below(core.len())];
        let [mut origin, mut direction] = [25, 5].map(|sides| {
            let half = (sides / 2) as f64;
            [(); 3].map(|()| random.below(sides) as f64 - half)
        });
        match random.below(4) {
            0 => origin = [0, 1, 2].map(|k| triangle[0][k] - 3.0 * direction[k]),
            1 => {
                direction = [0, 1, 2].map(|k| triangle[1][k] - triangle[0][k]);
                origin = [0, 1, 2].map(|k| triangle[0][k] - direction[k]);
            }
            2 => origin = triangle[2],
            _ => {}
        }
        if direction == [0.0; 3] {
            direction = [0.0, 1.0, 0.0];
        }
        let until = if round % 3 == 0 { 0.5 * random.below(12) as f64 } else { f64::INFINITY };
        let ray = Ray::new(origin, direction).until(until);
        let found = all_hits(&mut queriers, &bvh, radius, &ray);
        check_parts(&core, radius, &ray, &found, until.min(64.0));
        check_ids(&bvh, &core, radius, &found);
        hits += found.len();
        several += usize::from(found.len() > 2);
        inside += usize::from(found.first().is_some_and(|hit| hit.t == 0.0));
        ended += found.len() % 2;
    }
    assert!(hits > 200 && several > 10 && inside > 20 && ended > 5, "{hits} {several} {inside} {ended}");
}

/// Returns where a line is in balls, from the roots of quadratic equations, as joined intervals.
fn in_balls(centres: &[[f64; 3]], radius: f64, ray: &Ray) -> Vec<[f64; 2]> {
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let mut parts: Vec<[f64; 2]> = centres
        .iter()
        .filter_map(|centre| {
            let from = [0, 1, 2].map(|k| ray.origin[k] - centre[k]);
            let (square, half) = (dot(ray.direction, ray.direction), dot(from, ray.direction));
            let discriminant = half * half - square * (dot(from, from) - radius * radius);
            let root = discriminant.sqrt();
            let [first, last] = [(-half - root) / square, (-half + root) / square];
            (discriminant >= 0.0 && last >= 0.0).then_some([first.max(0.0), last])
        })
        .collect();
    parts.sort_by(|x, y| x[0].total_cmp(&y[0]));
    parts.dedup_by(|later, earlier| {
        let meets = later[0] <= earlier[1];
        if meets {
            earlier[1] = earlier[1].max(later[1]);
        }
        meets
    });
    parts
}

/// Clouds of many balls, also along trees of boxes, in batches and in scenes: as many hits as the formula has, and where it has them.
#[test]
fn hits_of_clouds_are_those_of_their_balls() {
    let mut random = Random::new(22);
    let centres: Vec<[f64; 3]> = (0..3000).map(|_| random.point().map(|x| f64::from(x as f32))).collect();
    let points: Vec<Triangle> = centres.iter().map(|centre| [*centre; 3]).collect();
    let bvh = baked(&points);
    let mut queriers = queriers();
    let mut most = 0;
    for radius in [0.01, 0.04, 0.2] {
        let rays: Vec<Ray> = (0..rounds(200))
            .map(|_| Ray::new(random.point().map(|x| 2.0 * x), random.point()).until(1.0 + random.unit()))
            .collect();
        let expected: Vec<_> = rays.iter().map(|ray| all_hits(&mut queriers, &bvh, radius, ray)).collect();
        for (ray, hits) in rays.iter().zip(&expected) {
            let ends = in_balls(&centres, radius, ray).concat();
            // Its entries are up to `until`, and so are its exits.
            let ends: Vec<f64> = ends.into_iter().filter(|t| *t <= ray.until).collect();
            assert_eq!(hits.len(), ends.len(), "{ray:?} {radius}: {hits:?} {ends:?}");
            for (hit, t) in hits.iter().zip(&ends) {
                assert!(hit.lower - 1e-12 <= *t && *t <= hit.upper + 1e-12, "{hit:?} {t}");
                // Each point names the ball that it is on.
                let off = point_triangle(hit.point, &points[hit.triangle as usize]) - radius;
                assert!(hit.t == 0.0 || off.abs() < 1e-9, "{hit:?} {off}");
            }
            most = most.max(hits.len());
        }
        #[cfg(feature = "parallel")]
        assert_eq!(
            bvh_query::ProbeBatch::new(bvh.all().rounded(radius).unwrap()).unwrap().all_hits(&rays),
            Ok(expected.clone())
        );
        let mut scene = Scene::new().unwrap();
        let id = scene.add(OwnedShape::from(bvh.clone()), Pose::IDENTITY).unwrap();
        scene.set_margin(id, radius).unwrap();
        let found = scene.all_hits(&rays).unwrap().into_iter();
        let found: Vec<Vec<_>> = found.map(|hits| hits.into_iter().map(|hit| hit.hit).collect()).collect();
        assert_eq!(found, expected);
    }
    assert!(most > 6, "{most}");
}

/// Meshes with a radius in poses, against distances at many points of each ray.
#[test]
fn rays_are_in_rounded_meshes_between_entries_and_exits() {
    let mut queriers = queriers();
    let mut random = Random::new(23);
    let mut several = 0;
    for triangles in [outward(cube()), torus(16, 8), soup(40, 3)] {
        let bvh = baked(&triangles);
        for _ in 0..rounds(40) {
            let pose = random_pose(&mut random, 1.0);
            let placed: Vec<Triangle> =
                stored(&bvh).iter().map(|stored| stored.corners.map(|corner| pose.place(corner))).collect();
            let radius = 0.02 + 0.1 * random.unit();
            let (origin, through) = (random.point().map(|x| 3.0 * x), random.point());
            let ray = Ray::new(origin, [0, 1, 2].map(|k| through[k] - origin[k]));
            let shape = bvh.all().rounded(radius).unwrap().at(&pose);
            let mut answers = queriers.iter_mut().map(|querier| querier.all_hits(shape, &ray).unwrap());
            let hits = answers.next().unwrap();
            assert!(answers.all(|other| other == hits));
            for step in 0..500 {
                let t = f64::from(step) * 0.01;
                let point = [0, 1, 2].map(|k| ray.origin[k] + t * ray.direction[k]);
                let least = placed.iter().map(|of| point_triangle(point, of)).fold(f64::INFINITY, f64::min);
                let is_inside = hits.iter().filter(|hit| hit.t <= t).count() % 2 == 1;
                assert!(
                    (least <= radius) == is_inside || (least - radius).abs() < 1e-9,
                    "{t} {least} {radius} {hits:?}"
                );
            }
            check_ids(&bvh, &placed, radius, &hits);
            several += usize::from(hits.len() > 2);
        }
    }
    assert!(several > 20, "{several}");
}

#[track_caller]
fn check(bvh: &Bvh, radius: f64, ray: &Ray, expected: &[f64]) {
    let hits = all_hits(&mut queriers(), bvh, radius, ray);
    assert_eq!(hits.len(), expected.len(), "{hits:?} {expected:?}");
    for (number, (hit, t)) in hits.iter().zip(expected).enumerate() {
        // A graze is known to half the digits.
        let size = expected.iter().fold(0.0f64, |most, t| most.max(t.abs()));
        assert!(hit.lower <= *t && *t <= hit.upper, "{hit:?} {t}");
        assert!((hit.t - t).abs() <= 1e-12 * (1.0 + size) || hits[0].t == hits[1].t, "{hit:?} {t}");
        assert!(number % 2 == 1 || (hit.t == 0.0) == (*t == 0.0), "{hit:?}");
    }
}

#[test]
fn hits_of_known_shapes_are_where_they_should_be() {
    let ball = baked(&[[[0.0; 3]; 3]]);
    let along = |x: f64| Ray::new([x, 0.0, 0.0], [1.0, 0.0, 0.0]);
    check(&ball, 2.0, &along(-5.0), &[3.0, 7.0]);
    check(&ball, 2.0, &along(-5.0).until(7.0), &[3.0, 7.0]);
    check(&ball, 2.0, &along(-5.0).until(3.0), &[3.0]);
    check(&ball, 2.0, &along(-5.0).until(3f64.next_down()), &[]);
    check(&ball, 2.0, &along(-5.0).until(6.0), &[3.0]);
    check(&ball, 2.0, &Ray::new([-5.0, 0.0, 0.0], [0.25, 0.0, 0.0]), &[12.0, 28.0]);
    // From inside, from the surface inwards and outwards, and away.
    check(&ball, 2.0, &along(1.0), &[0.0, 1.0]);
    check(&ball, 2.0, &along(1.0).until(0.5), &[0.0]);
    check(&ball, 2.0, &along(1.0).until(0.0), &[0.0]);
    check(&ball, 2.0, &along(-2.0), &[0.0, 4.0]);
    check(&ball, 2.0, &along(2.0), &[0.0, 0.0]);
    check(&ball, 2.0, &along(2.5), &[]);
    // Tangents of balls, one of them between two others.
    for (vector, length, tangent) in WHOLE {
        let ray = Ray::new(sum(vector, tangent.map(|x| -2.0 * x)), tangent);
        check(&ball, length, &ray, &[2.0, 2.0]);
        check(&ball, length.next_down(), &ray, &[]);
    }
    let three = baked(&[[[0.0, 0.0, 0.0]; 3], [[4.0, 1.0, 0.0]; 3], [[8.0, 0.0, 0.0]; 3]]);
    check(&three, 1.0, &along(-2.0), &[1.0, 3.0, 6.0, 6.0, 9.0, 11.0]);
    // Balls that touch are one body, balls that do not are two.
    let two = baked(&[[[0.0; 3]; 3], [[2.0, 0.0, 0.0]; 3]]);
    check(&two, 1.0, &along(-2.0), &[1.0, 5.0]);
    check(&two, 0.75, &along(-2.0), &[1.25, 2.75, 3.25, 4.75]);
    check(&two, 1.0 - 2f64.powi(-30), &along(-2.0), &{
        let r = 1.0 - 2f64.powi(-30);
        [2.0 - r, 2.0 + r, 4.0 - r, 4.0 + r]
    });
    // A capsule, across, along its segment, and past its side, where the ray grazes all of it.
    let capsule = baked(&[[[0.0; 3], [4.0, 0.0, 0.0], [4.0, 0.0, 0.0]]]);
    check(&capsule, 1.0, &along(-3.0), &[2.0, 8.0]);
    check(&capsule, 1.0, &along(2.0), &[0.0, 3.0]);
    check(&capsule, 1.0, &Ray::new([2.0, 3.0, 0.0], [0.0, -1.0, 0.0]), &[2.0, 4.0]);
    let beside = Ray::new([-3.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let hits = all_hits(&mut queriers(), &capsule, 1.0, &beside);
    assert!(
        hits.len() == 2 && hits.iter().all(|hit| hit.lower <= 3.0 + 1e-7 && hit.upper >= 3.0),
        "{hits:?}"
    );
    assert!(hits[0].lower <= 3.0 && hits[1].upper >= 7.0, "{hits:?}");
    // A closed core is hollow, solid or not; and a radius of zero is none.
    let hollow = baked(&outward(cube()));
    let ray = Ray::new([-5.0, 0.1, 0.2], [2.0, 0.0, 0.0]);
    let plain = Querier::new().unwrap().all_hits(&hollow, &ray).unwrap();
    let [first, last] = [plain[0].t, plain[1].t];
    check(&hollow, 0.125, &ray, &[first - 0.0625, first + 0.0625, last - 0.0625, last + 0.0625]);
    let mut querier = Querier::new().unwrap();
    let solid = hollow.all().solid().unwrap();
    let rounded = hollow.all().rounded(0.125).unwrap();
    assert_eq!(querier.all_hits(solid.rounded(0.125).unwrap(), &ray), querier.all_hits(rounded, &ray));
    assert_eq!(querier.all_hits(solid.rounded(0.0).unwrap(), &ray), Ok(plain));
}

/// Radii that are tiny and huge beside the core, and rays from far away.
#[test]
fn radii_of_any_size_have_entries_and_exits() {
    for core in [0.0, 1e-30, 1.0, 1e30] {
        let bvh = baked(&[[[0.0; 3], [core, 0.0, 0.0], [0.0, core, 0.0]]]);
        for radius in [1e-60, 1e-30, 1.0, 1e10, 1e30, 2f64.powi(116)] {
            let from = 4.0 * (core + radius);
            let ray = Ray::new([0.0, 0.0, from], [0.0, 0.0, -1.0]);
            let hits = all_hits(&mut queriers(), &bvh, radius, &ray);
            assert_eq!(hits.len(), 2, "{core} {radius}: {hits:?}");
            for (hit, expected) in hits.iter().zip([from - radius, from + radius]) {
                assert!((hit.t - expected).abs() <= 1e-12 * from, "{core} {radius}: {hit:?}");
                assert!(hit.lower <= expected * (1.0 + 1e-15) && expected * (1.0 - 1e-15) <= hit.upper);
            }
        }
    }
}

/// Bodies of scenes are bodies of their own, also where they overlap each other or a mesh without a radius.
#[test]
fn instances_are_bodies_of_their_own() {
    let ball = OwnedShape::from(baked(&[[[0.0; 3]; 3]])).rounded(2.0).unwrap();
    let sheet = OwnedShape::from(baked(&[[[0.0, -9.0, -9.0], [0.0, 9.0, -9.0], [0.0, 0.0, 9.0]]]));
    let at = |x| translation(x, 0.0, 0.0);
    let mut scene = Scene::new().unwrap();
    let ids = [
        scene.add(ball.clone(), at(0.0)).unwrap(),
        scene.add(ball, at(1.0)).unwrap(),
        scene.add(sheet, at(0.5)).unwrap(),
    ];
    let hits = &scene.all_hits(&[Ray::new([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0])]).unwrap()[0];
    let found: Vec<_> = hits.iter().map(|hit| (hit.instance, hit.hit.t)).collect();
    assert_eq!(found, [(ids[0], 3.0), (ids[1], 4.0), (ids[2], 5.5), (ids[0], 7.0), (ids[1], 8.0)]);
}
