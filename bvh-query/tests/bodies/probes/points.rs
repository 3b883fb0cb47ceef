//! Points: against labels from exact arithmetic, against the distance to a mesh that is a point, and where ties decide.

use crate::common::shapes::{cube, moved, plate, sphere, torus};
use crate::common::{Random, Triangle, bake, baked, mesh, note, queriers, random_pose, shared};
use bvh_query::{NumberError, Pose, QueryError};
#[cfg(feature = "parallel")]
use bvh_query::{ProbeBatch, Querier};
use cbvh_testkit::depth::rounds;

/// A label that is not the least distance, and what is: computed with rationals over all triangles near the point.
const MISLABELLED: (&str, f64) =
    ("-0.030366769060492516 0.15410411357879639 -0.0039105289615690708", 0.000_227_573_734_231_122_88);

/// The labels are exact distances, rounded once, about vertices rounded to f32: a point on a vertex, an edge or a face, a
/// little off it, or anywhere.
#[test]
#[ignore = "needs ../shared"]
fn labelled_points_have_their_distances() {
    for name in ["ball", "bunny", "nao", "apollo", "dragon"] {
        let folder = if name == "ball" { "probes" } else { "meshes" };
        let (path, points) =
            (shared(&format!("{folder}/{name}.obj")), shared(&format!("probes/{name}_points.txt")));
        let mut read = bvh_bake::input::read(&path).unwrap();
        for object in &mut read.objects {
            object.positions.iter_mut().for_each(|p| *p = p.map(|v| f64::from(v as f32)));
        }
        let bvh = bake(&read, &bvh_bake::Options::default());
        let size = bvh.objects()[0].bounding_sphere().1;
        let mut queriers = queriers();
        let text = std::fs::read_to_string(points).unwrap();
        let (mut on, mut all, mut worst) = (0, 0, 0.0f64);
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (numbers, label) = line.split_once('#').unwrap();
            let numbers: Vec<f64> = numbers.split_whitespace().map(|word| word.parse().unwrap()).collect();
            let point = [numbers[0], numbers[1], numbers[2]];
            let mut words = label.split_whitespace();
            words.find(|word| *word == "dist").unwrap();
            let label = words.next().unwrap().parse().unwrap();
            let exact = if line.starts_with(MISLABELLED.0) { MISLABELLED.1 } else { label };
            let mut first = None;
            for querier in &mut queriers {
                let found = querier.closest_point(&bvh, point, f64::INFINITY).unwrap().unwrap();
                assert_eq!(*first.get_or_insert(found), found, "{name} {line} {:?}", querier.backend());
            }
            let found = first.unwrap();
            assert_eq!(found.distance == 0.0, exact == 0.0, "{name} {line}");
            // The label itself is rounded.
            let slack = exact * f64::EPSILON;
            assert!(found.lower <= exact + slack && exact - slack <= found.upper, "{name} {line} {found:?}");
            worst = worst.max((found.distance - exact).abs() / size);
            let off: f64 = (0..3).map(|k| (found.point[k] - point[k]).powi(2)).sum::<f64>().sqrt();
            assert!((off - exact).abs() <= 1e-15 * size, "{name} {line} {found:?}");
            on += u32::from(exact == 0.0);
            all += 1;
        }
        assert!(worst <= 1e-16 && on > 50 && all == 1000, "{name}: {worst:e}, {on} of {all} on the mesh");
        note(&format!(
            "{name}: {all} points, {on} on the mesh, distances off by at most {worst:e} of its radius"
        ));
    }
}

/// Random points beside, on and in meshes, and far away: the answer is that of a mesh without area at the point.
#[test]
fn a_point_is_as_far_as_a_mesh_that_is_a_point() {
    let random = &mut Random::new(41);
    let mut two = mesh(&sphere(2));
    two.objects.extend(mesh(&moved(&torus(9, 6), 0.5, [3.0, 0.0, 0.0])).objects);
    let split = bvh_bake::Options::default().split_objects(true);
    let shapes = [baked(&cube()), baked(&plate(6)), baked(&torus(24, 12)), bake(&two, &split)];
    let mut queriers = queriers();
    let mut tied = 0;
    for round in 0..rounds(300) {
        let bvh = &shapes[random.below(shapes.len())];
        let spread = [0.9, 2.0, 50.0][random.below(3)];
        // Often a point of a lattice, where vertices are and ties come from.
        let lattice = round % 3 == 0;
        let point = random.point().map(|v| {
            let v = if lattice { (2.0 * spread * v).round() / 2.0 } else { spread * v };
            f64::from(v as f32)
        });
        let one = baked(&[[point; 3]]);
        let pose = random_pose(random, 1.0);
        let placed = queriers[0].distance(&one, bvh, &pose).unwrap();
        for querier in &mut queriers {
            let found = querier.closest_point(bvh.all().at(&pose), point, f64::INFINITY).unwrap().unwrap();
            assert_eq!(found.distance, placed.distance, "{point:?} {pose:?} {:?}", querier.backend());
            if placed.distance > 0.0 {
                assert_eq!((found.object, found.triangle), (placed.object_b, placed.triangle_b), "{point:?}");
                assert_eq!((found.upper, found.point), (placed.upper, placed.point_b));
            }
            assert!(found.lower <= found.distance && found.lower >= placed.distance * (1.0 - 1e-5));
            let limit = placed.upper * (1.0 + 1e-12);
            assert_eq!(querier.closest_point(bvh.all().at(&pose), point, limit), Ok(Some(found)));
        }
        let expected = queriers[0].distance(bvh, &one, &Pose::IDENTITY).unwrap();
        for querier in &mut queriers {
            let found = querier.closest_point(bvh, point, f64::INFINITY).unwrap().unwrap();
            assert_eq!(found.distance, expected.distance, "{point:?} {:?}", querier.backend());
            if expected.distance > 0.0 {
                assert_eq!(
                    (found.object, found.triangle),
                    (expected.object_a, expected.triangle_a),
                    "{point:?}"
                );
                assert_eq!((found.lower, found.upper), (expected.lower, expected.upper));
                assert_eq!(found.point, expected.point_a);
            }
            // The limit itself counts, the next number below does not.
            let d = found.distance;
            assert_eq!(querier.closest_point(bvh, point, d.max(found.upper)), Ok(Some(found)));
            if found.lower > 0.0 {
                assert_eq!(querier.closest_point(bvh, point, found.lower * (1.0 - 1e-9)), Ok(None));
            }
        }
        tied += u32::from(lattice && expected.distance > 0.0);
    }
    assert!(tied > 10, "{tied}");
}

#[test]
fn ties_go_to_the_lowest_numbers_and_a_limit_is_exact() {
    let mut two = mesh(&cube());
    two.objects.extend(mesh(&cube()).objects);
    let bvh = bake(&two, &bvh_bake::Options::default().split_objects(true));
    for querier in &mut queriers() {
        // From the middle of both cubes all faces are equally near, and from a corner outside all that meet there.
        let middle = querier.closest_point(&bvh, [0.0; 3], f64::INFINITY).unwrap().unwrap();
        assert_eq!((middle.distance, middle.object, middle.triangle), (1.0, 0, 0));
        let corner = querier.closest_point(&bvh, [2.0, 2.0, 2.0], f64::INFINITY).unwrap().unwrap();
        let meets = |t: &Triangle| t.contains(&[1.0; 3]);
        assert_eq!((corner.point, corner.object), ([1.0; 3], 0));
        assert_eq!(corner.triangle as usize, cube().iter().position(meets).unwrap());
        assert_eq!(corner.distance, 3f64.sqrt());
        // On the mesh, too.
        let on = querier.closest_point(&bvh, [1.0, 1.0, 1.0], 0.0).unwrap().unwrap();
        assert_eq!((on.distance, on.triangle), (0.0, corner.triangle));
        assert_eq!(querier.closest_point(&bvh, [0.0, 0.0, 3.0], 2.0).unwrap().unwrap().distance, 2.0);
        assert_eq!(querier.closest_point(&bvh, [0.0, 0.0, 3.0], 2f64.next_down()), Ok(None));
        // What is too small for exact arithmetic counts as 0.
        let tiny = querier.closest_point(&bvh, [1.0, 5e-324, -1e-200], 0.0).unwrap().unwrap();
        assert_eq!((tiny.distance, tiny.point), (0.0, [1.0, 0.0, 0.0]));
        // Far away, all is equally far in f64; and at the edge of what coordinates may be.
        for far in [1e9, 1e25, 2f64.powi(120)] {
            let found = querier.closest_point(&bvh, [far, 0.0, 0.0], f64::INFINITY).unwrap().unwrap();
            assert_eq!(found.distance, far - 1.0);
        }
        for wrong in [f64::NAN, f64::INFINITY, 2f64.powi(121)] {
            let error = querier.closest_point(&bvh, [0.0, wrong, 0.0], f64::INFINITY);
            assert!(matches!(error, Err(QueryError::Number(NumberError::Point(_)))), "{error:?}");
        }
        for wrong in [f64::NAN, -1.0] {
            let error = querier.closest_point(&bvh, [0.0; 3], wrong);
            assert!(matches!(error, Err(QueryError::Number(NumberError::Within(_)))), "{error:?}");
        }
        querier.set_budget(2);
        assert_eq!(querier.closest_point(&bvh, [0.0; 3], 9.0), Err(QueryError::Budget { visits: 2 }));
    }
}

/// From 1e-30 to 1e30 the same answers, but for the factor.
#[test]
fn units_do_not_matter() {
    let random = &mut Random::new(42);
    for exponent in [-99, 0, 99] {
        let factor = 2f64.powi(exponent);
        let scale = |p: [f64; 3]| p.map(|v| v * factor);
        // Coordinates that no factor makes subnormal.
        let coarse = |p: [f64; 3]| p.map(|v| (v * 1024.0).round() / 1024.0);
        let plain: Vec<Triangle> = torus(16, 8).into_iter().map(|t| t.map(coarse)).collect();
        let (one, scaled) = (baked(&plain), baked(&plain.iter().map(|t| t.map(scale)).collect::<Vec<_>>()));
        for querier in &mut queriers() {
            for _ in 0..20 {
                let point = random.point().map(|v| 2.0 * v);
                let expected = querier.closest_point(&one, point, f64::INFINITY).unwrap().unwrap();
                let found = querier.closest_point(&scaled, scale(point), f64::INFINITY).unwrap().unwrap();
                assert_eq!((found.distance, found.triangle), (expected.distance * factor, expected.triangle));
            }
        }
    }
}

/// On any number of threads, a batch has the answers of the querier; and the error of the first point.
#[test]
#[cfg(feature = "parallel")]
fn batches_of_points_have_the_same_answers() {
    let random = &mut Random::new(43);
    let bvh = baked(&torus(24, 12));
    let mut points: Vec<[f64; 3]> = (0..999).map(|_| random.point().map(|v| 3.0 * v)).collect();
    for backend in crate::common::backends() {
        let (mut querier, batch) = (Querier::with_backend(backend), ProbeBatch::with_backend(&bvh, backend));
        for within in [f64::INFINITY, 0.4] {
            let expected: Vec<_> =
                points.iter().map(|point| querier.closest_point(&bvh, *point, within).unwrap()).collect();
            assert!(expected.iter().any(Option::is_some) && (within > 1.0 || expected.contains(&None)));
            for threads in [1, 2] {
                let pool = cbvh_testkit::pool(threads);
                assert_eq!(pool.install(|| batch.closest_points(&points, within)), Ok(expected.clone()));
            }
        }
    }
    let mut batch = ProbeBatch::new(&bvh).unwrap();
    assert_eq!(batch.closest_points(&[], f64::INFINITY), Ok(vec![]));
    assert!(batch.closest_points(&[], f64::NAN).is_err());
    (points[77][0], points[500][1]) = (2f64.powi(130), f64::NAN);
    let error = batch.closest_points(&points, f64::INFINITY);
    assert_eq!(error, Err(QueryError::Number(NumberError::Point(2f64.powi(130)))));
    batch.set_budget(3);
    assert_eq!(batch.closest_points(&points[..10], f64::INFINITY), Err(QueryError::Budget { visits: 3 }));
}

/// Points anywhere, on corners, edges and faces and a little off them, about files of every layout: one by one or in a
/// batch, the answer is the nearest of all triangles, with the same bits on all backends.
#[test]
#[cfg(feature = "parallel")]
fn no_triangle_is_nearer_than_the_answer() {
    use crate::common::nearest::point_triangle;
    use crate::common::shapes::{dirty, soup, terrain};
    use crate::common::{Stored, backends, options, stored};
    use bvh_format::leaf::TriangleEncoding;
    use bvh_format::profile::Profile;
    let random = &mut Random::new(44);
    for (number, profile) in Profile::ALL.into_iter().enumerate() {
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            let shape =
                [torus(18, 9), terrain(12, 5), dirty(&sphere(2), 6), soup(150, 7)][number % 4].clone();
            let factor = [1.0, 2f64.powi(-60), 2f64.powi(60)][number % 3];
            let far = [0.0, 3.0, 1e4][random.below(3)];
            let bvh = bake(&mesh(&moved(&shape, factor, [far * factor; 3])), &options(profile, encoding));
            let stored = stored(&bvh);
            let points: Vec<[f64; 3]> = (0..rounds(70))
                .map(|_| {
                    let t = stored[random.below(stored.len())].corners;
                    let (s, u) = (random.below(5) as f64 / 4.0, random.below(3) as f64 / 2.0);
                    let off = [0.0, 0.0, 1e-16, 1e-7, 0.1, 2.0, 1e3][random.below(7)] * factor;
                    let away = random.point();
                    [0, 1, 2].map(|k| {
                        let edge = t[0][k] + s * (t[1][k] - t[0][k]);
                        edge + u * s * (t[2][k] - edge) + off * away[k]
                    })
                })
                .collect();
            let mut answers: Option<Vec<_>> = None;
            for backend in backends() {
                let mut querier = Querier::with_backend(backend);
                let ask = |point: &[f64; 3]| querier.closest_point(&bvh, *point, f64::INFINITY).unwrap();
                let one_by_one: Vec<_> = points.iter().map(ask).collect();
                let batch = ProbeBatch::with_backend(&bvh, backend).closest_points(&points, f64::INFINITY);
                assert_eq!(batch.unwrap(), one_by_one, "{backend}");
                assert_eq!(*answers.get_or_insert(one_by_one.clone()), one_by_one, "{backend}");
            }
            for (point, answer) in points.iter().zip(answers.unwrap()) {
                let answer = answer.unwrap();
                let to = |t: &Stored| point_triangle(*point, &t.corners);
                let least = stored.iter().map(to).fold(f64::INFINITY, f64::min);
                let largest = point.iter().fold(least, |most, x| most.max(x.abs()));
                assert!((answer.distance - least).abs() <= 1e-13 * largest, "{point:?}: {answer:?}, {least}");
                assert!(answer.lower <= answer.distance && answer.distance <= answer.upper);
                let named = stored.iter().find(|t| t.id == answer.triangle).unwrap();
                assert!((to(named) - least).abs() <= 1e-13 * largest, "{point:?}: {answer:?}, {least}");
            }
        }
    }
}

/// Sides, rays and segments in batches, about a mesh in its own frame and one in the world.
#[test]
#[cfg(feature = "parallel")]
fn batches_of_all_probes_have_the_same_answers() {
    use bvh_query::Ray;
    let random = &mut Random::new(45);
    let bvh = baked(&torus(24, 12));
    let pose = random_pose(random, 0.5);
    let points: Vec<[f64; 3]> = (0..700).map(|_| random.point().map(|v| 1.5 * v)).collect();
    let rays: Vec<Ray> = points.iter().map(|point| Ray::new(*point, random.point())).collect();
    let segments: Vec<[[f64; 3]; 2]> = points.iter().map(|point| [*point, random.point()]).collect();
    let mut querier = Querier::new().unwrap();
    for shape in [bvh.all().into(), bvh.all().at(&pose)] {
        let batch = ProbeBatch::new(shape).unwrap();
        let q = &mut querier;
        let expected: Vec<_> = points.iter().map(|p| q.side(shape, *p).unwrap()).collect();
        assert_eq!(batch.sides(&points), Ok(expected));
        let expected: Vec<_> =
            points.iter().map(|p| q.signed_point_distance(shape, *p, 0.5).unwrap()).collect();
        assert_eq!(batch.signed_point_distances(&points, 0.5), Ok(expected));
        let expected: Vec<_> = rays.iter().map(|ray| q.first_hit(shape, ray).unwrap()).collect();
        assert_eq!(batch.first_hits(&rays), Ok(expected));
        let expected: Vec<_> = rays.iter().map(|ray| q.any_hit(shape, ray).unwrap()).collect();
        assert_eq!(batch.any_hits(&rays), Ok(expected));
        let expected: Vec<_> = rays.iter().map(|ray| q.all_hits(shape, ray).unwrap()).collect();
        assert_eq!(batch.all_hits(&rays), Ok(expected));
        let expected: Vec<_> =
            segments.iter().map(|[p, q_]| q.segment_hit(shape, *p, *q_).unwrap()).collect();
        assert_eq!(batch.segment_hits(&segments), Ok(expected));
    }
    let mut bad = rays.clone();
    bad[300].direction = [0.0; 3];
    assert!(matches!(ProbeBatch::new(&bvh).unwrap().any_hits(&bad), Err(QueryError::Number(_))));
}
