//! Rays along the tree of boxes that an open file keeps for them: the answers are those of rational numbers, and of the walk without it.

use super::hard::{Mesh, direction, point};
use super::rationals::{Rational, first};
use crate::common::shapes::{dirty, moved, on_lattice, soup, sphere, terrain, torus};
use crate::common::{Random, bake, mesh, note, options, queriers, random_pose, stored};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, ProbeBatch, Querier, Ray};
use cbvh_testkit::depth::rounds;

/// Walks without the tree, because its visits are limited.
fn limited(querier: &Querier) -> Querier {
    let mut limited = Querier::with_backend(querier.backend());
    limited.set_budget(u64::MAX - 1);
    limited
}

/// Asks about as many rays as it takes to make the tree.
fn warm(bvh: &Bvh, querier: &mut Querier, at: [f64; 3]) {
    for _ in 0..1000 {
        querier.any_hit(bvh, &Ray::new(at, [0.3, 0.2, 1.0])).unwrap();
    }
}

/// Returns a ray that starts a million sizes away and leads exactly through a corner, or near one.
fn from_afar(random: &mut Random, mesh: &Mesh) -> [[f64; 3]; 2] {
    let corner = mesh.triangles[random.below(mesh.triangles.len())][random.below(3)];
    let largest = mesh.triangles.iter().flatten().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    let size = f64::from_bits(largest.to_bits() >> 52 << 52);
    let direction = [(); 3].map(|()| (random.below(9) as f64 - 4.0) * size);
    let direction = if direction == [0.0; 3] { [size, 0.0, 0.0] } else { direction };
    // No coordinate may be beyond 2^120.
    let exponent = (size.to_bits() >> 52) as i32 - 1023;
    let away = 2f64.powi((18 + random.below(5) as i32).min(116 - exponent));
    [[0, 1, 2].map(|k| corner[k] - away * direction[k]), direction]
}

fn meshes() -> Vec<Mesh> {
    let named = |name, triangles| Mesh { name, triangles, is_closed: false };
    let ball = on_lattice(sphere(3));
    vec![
        named("ball", ball.clone()),
        named("ring", on_lattice(torus(24, 10))),
        named("soup", soup(400, 3)),
        named("plain", on_lattice(terrain(14, 5))),
        named("dirty", dirty(&ball, 7)),
        named("tiny", moved(&ball, 2f64.powi(-100), [0.0; 3])),
        named("subnormal", moved(&ball, 2f64.powi(-128), [0.0; 3])),
        named("huge", moved(&ball, 2f64.powi(100), [0.0; 3])),
        named("far", moved(&ball, 1.0, [3e7, -2e6, 1e3])),
        named("flat", ball.iter().map(|t| t.map(|[x, y, _]| [x, y, 0.0])).collect()),
    ]
}

#[test]
fn rays_along_the_tree_hit_what_rationals_say() {
    let random = &mut Random::new(53);
    let mut queriers = queriers();
    let (mut asked, mut hits, mut afar) = (0, 0, 0);
    let kinds = [
        (Profile::Dop26U8Wide, TriangleEncoding::F32),
        (Profile::Dop6U8, TriangleEncoding::Packed),
        (Profile::Dop14U8, TriangleEncoding::Quantized),
        (Profile::Dop6F16, TriangleEncoding::F32),
    ];
    for (number, of) in meshes().iter().enumerate() {
        let (profile, encoding) = kinds[number % kinds.len()];
        let bvh = bake(&mesh(&of.triangles), &options(profile, encoding));
        let stored = stored(&bvh);
        for querier in &mut queriers {
            warm(&bvh, querier, of.triangles[0][0]);
        }
        for round in 0..rounds(30) {
            let [origin, direction] = if round % 3 == 0 {
                afar += 1;
                from_afar(random, of)
            } else {
                let origin = point(random, of);
                [origin, direction(random, of, &origin)]
            };
            let what = format!("{} {origin:?} {direction:?}", of.name);
            let mut met: Vec<(Rational, u32)> = stored
                .iter()
                .filter_map(|stored| Some((first(&origin, &direction, &stored.corners)?, stored.id)))
                .collect();
            met.sort_by(|x, y| x.0.compare(&y.0).then(x.1.cmp(&y.1)));
            met.dedup_by(|later, earlier| later.0.compare(&earlier.0).is_eq());
            let ray = Ray::new(origin, direction);
            for querier in &mut queriers {
                let what = format!("{what} {:?}", querier.backend());
                let all = querier.all_hits(&bvh, &ray).unwrap();
                assert_eq!(all.len(), met.len(), "{what}: {all:?} {met:?}");
                for (hit, (t, id)) in all.iter().zip(&met) {
                    assert_eq!(hit.triangle, *id, "{what}");
                    assert!(t.compare(&Rational::of(hit.lower)).is_ge(), "{what} {hit:?} {t:?}");
                    assert!(t.compare(&Rational::of(hit.upper)).is_le(), "{what} {hit:?} {t:?}");
                }
                assert_eq!(querier.first_hit(&bvh, &ray), Ok(all.first().copied()), "{what}");
                assert_eq!(querier.any_hit(&bvh, &ray), Ok(!all.is_empty()), "{what}");
                assert_eq!(limited(querier).all_hits(&bvh, &ray), Ok(all), "{what}");
            }
            asked += 1;
            hits += u32::from(!met.is_empty());
        }
    }
    assert!(hits > asked / 3 && afar > asked / 4, "{hits} of {asked}, {afar} from afar");
    note(&format!("{asked} rays along trees, {hits} hit something, {afar} came from afar"));
}

/// In poses and with a radius, and in batches of any length, answers are those of the walk without the tree, bit for bit.
#[test]
fn the_tree_changes_no_answer() {
    let random = &mut Random::new(54);
    let (mut hits, mut asked) = (0, 0);
    for of in meshes() {
        let bvh = bake(&mesh(&of.triangles), &Default::default());
        let largest = of.triangles.iter().flatten().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
        let posed = [Pose::IDENTITY, random_pose(random, largest.max(1e-30))];
        for (pose, rounds_of_radius) in posed.iter().zip([false, true]) {
            let radius = if rounds_of_radius { largest / 64.0 } else { 0.0 };
            let shape = bvh.all().rounded(radius).unwrap().at(pose);
            let rays: Vec<Ray> = (0..rounds(120))
                .map(|round| {
                    let [origin, direction] = if round % 3 == 0 {
                        from_afar(random, &of)
                    } else {
                        let origin = point(random, &of);
                        [origin, direction(random, &of, &origin)]
                    };
                    Ray::new(pose.place(origin), direction)
                })
                .collect();
            for querier in &mut queriers() {
                warm(&bvh, querier, of.triangles[0][0]);
                let slow = &mut limited(querier);
                let batch = ProbeBatch::with_backend(shape, querier.backend());
                let expected: Vec<_> = rays.iter().map(|ray| slow.first_hit(shape, ray).unwrap()).collect();
                for (ray, expected) in rays.iter().zip(&expected) {
                    assert_eq!(querier.first_hit(shape, ray), Ok(*expected), "{} {ray:?} {pose:?}", of.name);
                    assert_eq!(querier.any_hit(shape, ray), Ok(expected.is_some()));
                    let to = [0, 1, 2].map(|k| ray.origin[k] + ray.direction[k].clamp(-1e30, 1e30));
                    let met = slow.segment_hit(shape, ray.origin, to);
                    assert_eq!(querier.segment_hit(shape, ray.origin, to), met);
                    asked += 1;
                    hits += u32::from(expected.is_some());
                }
                assert_eq!(batch.first_hits(&rays), Ok(expected));
                let any: Vec<bool> = rays.iter().map(|ray| slow.any_hit(shape, ray).unwrap()).collect();
                assert_eq!(batch.any_hits(&rays), Ok(any));
            }
        }
    }
    assert!(hits > asked / 4 && hits < asked, "{hits} of {asked}");
}

/// A ray that ends as soon as it starts, on a corner, names the lowest of the triangles there.
#[test]
fn the_shortest_rays_know_their_ties() {
    let ball = on_lattice(sphere(3));
    let corner = ball[0][0];
    for turn in 0..4 {
        let mut triangles = ball.clone();
        let count = triangles.len();
        triangles.rotate_left(turn * count / 4);
        let lowest = triangles.iter().position(|triangle| triangle.contains(&corner)).unwrap() as u32;
        let bvh = bake(&mesh(&triangles), &Default::default());
        for querier in &mut queriers() {
            for is_warm in [false, true] {
                if is_warm {
                    warm(&bvh, querier, corner);
                }
                // The shortest numbers have no inverse.
                for until in [0.0, 5e-324, 1e-310, 1e-300, 1.0] {
                    let ray = Ray::new(corner, [0.3, 0.2, 1.0]).until(until);
                    for querier in [&mut limited(querier), &mut *querier] {
                        let hit = querier.first_hit(&bvh, &ray).unwrap().unwrap();
                        assert_eq!((hit.t, hit.triangle), (0.0, lowest), "{until} {turn} {is_warm}");
                    }
                }
            }
        }
    }
}
