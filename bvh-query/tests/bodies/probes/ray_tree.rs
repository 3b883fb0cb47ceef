//! Rays along the tree of boxes that an open file keeps for them: the answers are those of rational numbers, and of the walk without it.

use super::hard::{Mesh, direction, point};
use super::rationals::{Rational, first};
use crate::common::shapes::{dirty, moved, on_lattice, soup, sphere, terrain, torus};
use crate::common::{Random, bake, mesh, note, options, queriers, random_pose, stored};
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier, Ray};
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
                let expected: Vec<_> = rays.iter().map(|ray| slow.first_hit(shape, ray).unwrap()).collect();
                for (ray, expected) in rays.iter().zip(&expected) {
                    assert_eq!(querier.first_hit(shape, ray), Ok(*expected), "{} {ray:?} {pose:?}", of.name);
                    assert_eq!(querier.any_hit(shape, ray), Ok(expected.is_some()));
                    assert_eq!(querier.all_hits(shape, ray), slow.all_hits(shape, ray));
                    let to = [0, 1, 2].map(|k| ray.origin[k] + ray.direction[k].clamp(-1e30, 1e30));
                    let met = slow.segment_hit(shape, ray.origin, to);
                    assert_eq!(querier.segment_hit(shape, ray.origin, to), met);
                    asked += 1;
                    hits += u32::from(expected.is_some());
                }
                #[cfg(feature = "parallel")]
                {
                    let batch = bvh_query::ProbeBatch::with_backend(shape, querier.backend());
                    assert_eq!(batch.first_hits(&rays), Ok(expected));
                    let any: Vec<bool> = rays.iter().map(|ray| slow.any_hit(shape, ray).unwrap()).collect();
                    assert_eq!(batch.any_hits(&rays), Ok(any));
                }
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

/// Vertices that are no sums of `f32` numbers, in poses that stretch as much as poses may.
#[test]
fn rays_meet_corrected_vertices_in_poses_that_stretch() {
    let random = &mut Random::new(55);
    let ball = sphere(3);
    let mut most_left_out = 0.0f32;
    let (mut asked, mut hits) = (0, 0);
    for (number, (factor, by)) in
        [(1.0 / 3.0, [1e6 + 0.1, -3e5, 7.7]), (1e-3, [5e3 + 0.01, 0.1, -900.0]), (1.0, [0.0; 3])]
            .into_iter()
            .enumerate()
    {
        // Last, because the makers of shapes round to `f32`.
        let at = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] * factor + by[k]);
        let triangles: Vec<_> = dirty(&ball, 3).into_iter().map(|triangle| triangle.map(at)).collect();
        let encoding = [TriangleEncoding::F32, TriangleEncoding::Packed][number % 2];
        let bvh = bake(&mesh(&triangles), &options(Profile::Dop14U8, encoding));
        let left_out = bvh.objects()[0].record().left_out.map(|most| most.get());
        most_left_out = left_out.into_iter().fold(most_left_out, f32::max);
        for stretch in [1.0, 1.0 + 0.45 / (1 << 20) as f64, 1.0 - 0.45 / (1 << 20) as f64] {
            let turned = random_pose(random, 10.0);
            let rows = turned.rotation().map(|row| row.map(|x| x * stretch));
            let back = turned.place(by);
            // The mesh is near the origin of the world, so that coordinates cancel.
            let pose = Pose::new(rows, [0, 1, 2].map(|k| turned.translation()[k] - back[k])).unwrap();
            let placed: Vec<_> = stored(&bvh)
                .into_iter()
                .map(|of| (of.corners.map(|corner| pose.place(corner)), of.id))
                .collect();
            let of =
                Mesh { name: "placed", triangles: placed.iter().map(|of| of.0).collect(), is_closed: false };
            for querier in &mut queriers() {
                warm(&bvh, querier, triangles[0][0]);
                for round in 0..rounds(40) {
                    let [origin, direction] = if round % 3 == 0 {
                        from_afar(random, &of)
                    } else {
                        let origin = point(random, &of);
                        [origin, direction(random, &of, &origin)]
                    };
                    let mut met: Vec<(Rational, u32)> = placed
                        .iter()
                        .filter_map(|(corners, id)| Some((first(&origin, &direction, corners)?, *id)))
                        .collect();
                    met.sort_by(|x, y| x.0.compare(&y.0).then(x.1.cmp(&y.1)));
                    let hit = querier.first_hit(bvh.all().at(&pose), &Ray::new(origin, direction)).unwrap();
                    let found = hit.map(|hit| hit.triangle);
                    assert_eq!(
                        found,
                        met.first().map(|met| met.1),
                        "{origin:?} {direction:?} {pose:?} {by:?}"
                    );
                    asked += 1;
                    hits += u32::from(found.is_some());
                }
            }
        }
    }
    assert!(most_left_out > 0.0 && hits > asked / 4, "{most_left_out}, {hits} of {asked}");
}

/// There is no tree of a file with a damaged page. Rays that need the page are refused, and others are answered.
#[test]
fn a_damaged_page_has_the_error_it_had() {
    let triangles = terrain(60, 5);
    let file = to_bytes(&mesh(&triangles), &Default::default()).unwrap().0;
    let good = Bvh::from_bytes(file.clone()).unwrap();
    let pages = good.layout().page_count();
    assert!(pages > 4, "{pages}");
    let (mut refused, mut answered) = (0, 0);
    for page in [pages / 2, pages - 1] {
        let mut file = file.clone();
        file[good.layout().page_offset(page) as usize + 100] ^= 1;
        let bvh = Bvh::from_bytes(file).unwrap();
        let mut querier = Querier::new().unwrap();
        let (mut slow, mut whole) = (limited(&querier), limited(&querier));
        for round in 0..3 {
            for triangle in triangles.iter().step_by(7) {
                let at = [0, 1, 2].map(|k| (triangle[0][k] + triangle[1][k] + triangle[2][k]) / 3.0);
                let ray = Ray::new([at[0], at[1], at[2] + 0.01], [0.0, 0.0, -1.0]);
                let hit = querier.first_hit(&bvh, &ray);
                assert_eq!(hit, slow.first_hit(&bvh, &ray), "{round} {ray:?}");
                match hit {
                    Ok(hit) => {
                        assert_eq!(Ok(hit), whole.first_hit(&good, &ray));
                        answered += 1;
                    }
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(refused > 10 && answered > 10, "{refused} refused, {answered} answered");
}

/// Threads that all want the tree at once have the answers of one.
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads here")]
#[test]
fn threads_make_one_tree() {
    let triangles = soup(3000, 9);
    for _ in 0..rounds(5) {
        let bvh = bake(&mesh(&triangles), &Default::default());
        let ask = |querier: &mut Querier| {
            let mut random = Random::new(12);
            let mut rays = || Ray::new(random.point(), random.point());
            (0..400).map(|_| querier.first_hit(&bvh, &rays()).unwrap()).collect::<Vec<_>>()
        };
        let expected = ask(&mut limited(&Querier::new().unwrap()));
        std::thread::scope(|scope| {
            let threads = [(); 8].map(|()| scope.spawn(|| ask(&mut Querier::new().unwrap())));
            for thread in threads {
                assert_eq!(thread.join().unwrap(), expected);
            }
        });
    }
}
