//! Checks every answer against brute force over all pairs of triangles with exact predicates, for all profiles,
//! triangle encodings and backends.

use crate::common::expected::Expected;
use crate::common::shapes::{comb, cube, dirty, moved, plate, soup, sphere, terrain, torus};
use crate::common::truth::Surface;
use crate::common::{
    Random, Triangle, bake, baked, fcl_pair, mesh, options, queriers, random_pose, rotation, shared_mesh,
    stored, translation,
};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Effort, Options};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Distance, Pose, Querier};
use std::ops::ControlFlow;

/// Bakes a mesh into one file per profile and lossless encoding.
fn files(triangles: &[Triangle]) -> Vec<Bvh> {
    files_in(triangles, &LOSSLESS)
}

fn files_in(triangles: &[Triangle], encodings: &[TriangleEncoding]) -> Vec<Bvh> {
    let mesh = mesh(triangles);
    let all = Profile::ALL.into_iter().flat_map(|profile| encodings.iter().map(move |&e| (profile, e)));
    all.map(|(profile, encoding)| bake(&mesh, &options(profile, encoding))).collect()
}

const LOSSLESS: [TriangleEncoding; 2] = [TriangleEncoding::F32, TriangleEncoding::Packed];

/// Queries every file of A against the same and one other file of B, on every backend. All answers must be right, and
/// all must be equal, except that different triangles may be named when the meshes touch.
fn check(a: &[Bvh], b: &[Bvh], poses: &[Pose]) {
    let mut queriers = queriers();
    let [of_a, of_b] = [&a[0], &b[0]].map(|file| Surface::new(stored(file)));
    for pose in poses {
        let expected = Expected::new(&of_a, &of_b, pose);
        let mut apart: Option<Distance> = None;
        for i in 0..a.len().max(b.len()) {
            for other in [i, 7 * i + 3] {
                let (a, b) = (&a[i % a.len()], &b[other % b.len()]);
                let answer = expected.check(a, b, pose, &mut queriers);
                if answer.distance > 0.0 {
                    assert_eq!(*apart.get_or_insert(answer), answer, "file {i} against {other}");
                }
            }
        }
    }
}

#[test]
fn baking_keeps_every_triangle() {
    for triangles in [dirty(&sphere(2), 1), soup(200, 2), comb(64), dirty(&plate(8), 3)] {
        for file in files(&triangles) {
            let stored = stored(&file);
            assert_eq!(stored.len(), triangles.len());
            for (id, (input, stored)) in triangles.iter().zip(&stored).enumerate() {
                // A duplicate gets the corners of the triangle that was kept for it.
                let sorted = |mut t: Triangle| {
                    t.sort_by(|p, q| p.partial_cmp(q).unwrap());
                    t
                };
                assert_eq!((id as u32, sorted(*input)), (stored.id, sorted(stored.corners)));
            }
        }
    }
}

#[test]
fn random_poses() {
    let meshes = [
        ("sphere", dirty(&sphere(2), 1)),
        ("torus", torus(12, 8)),
        ("soup", dirty(&soup(90, 4), 5)),
        ("comb", comb(64)),
        ("plate", dirty(&plate(8), 6)),
        ("terrain", terrain(10, 7)),
        ("cube", cube()),
    ];
    let files: Vec<_> = meshes.iter().map(|(_, triangles)| files(triangles)).collect();
    let mut random = Random::new(11);
    for (a, b) in [(0, 1), (1, 3), (2, 2), (3, 4), (4, 0), (5, 2), (6, 5), (3, 3), (1, 1), (6, 2)] {
        // The poses range from deep inside to a few sizes away.
        let poses = [0.3, 1.0, 1.5, 2.0, 4.0].map(|reach| random_pose(&mut random, reach));
        check(&files[a], &files[b], &poses);
    }
}

/// The time spent on a tree changes no answer. Half of the meshes have crowds of triangles in a corner that a grid over the whole
/// does not divide, so that trees of little time have to do it otherwise.
#[test]
fn random_meshes_of_every_effort() {
    let mut random = Random::new(29);
    for round in 0..12 {
        let [a, b] = [0, 1].map(|side| {
            let count = 1 + random.below([5, 60, 400, 900][(round + side) % 4]);
            let seed = random.bits();
            let mut triangles = match random.below(3) {
                0 => dirty(&soup(count, seed), seed),
                1 => soup(count, seed),
                _ => terrain(1 + (count as f64 / 2.0).sqrt() as usize, seed % 1000),
            };
            if round % 2 == 1 {
                triangles.extend(moved(&soup(count.min(200), seed + 1), 1e-5, [0.5, -0.25, 0.75]));
            }
            let mesh = mesh(&triangles);
            let options = Effort::ALL.map(|effort| Options::default().effort(effort));
            let packed = options[0].clone().triangles(Some(TriangleEncoding::Packed)).topology(false);
            options.iter().chain([&packed]).map(|options| bake(&mesh, options)).collect::<Vec<_>>()
        });
        let poses = [0.1, 0.8, 2.5].map(|reach| random_pose(&mut random, reach));
        check(&a, &b, &poses);
    }
}

#[test]
fn in_place_turned_and_far() {
    let half_turns = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let mut poses = vec![Pose::IDENTITY, translation(1e4, -2e4, 3e4), translation(0.0, 0.0, 1e30)];
    poses.extend(half_turns.map(|q| Pose::new(rotation(q), [0.0; 3]).unwrap()));
    let third = Pose::new([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], [0.25, 0.0, 0.0]);
    poses.push(third.unwrap());
    for triangles in [dirty(&cube(), 2), plate(4), dirty(&sphere(1), 3), comb(24), soup(40, 9)] {
        let files = files(&triangles);
        check(&files, &files, &poses);
    }
}

#[test]
fn touching_in_a_face_an_edge_a_corner_and_just_not() {
    let cube = files(&cube());
    let mut poses = Vec::new();
    for x in [2.0, -2.0] {
        poses.extend([translation(x, 0.0, 0.0), translation(x, 2.0, 0.0), translation(x, -2.0, 2.0)]);
        // The meshes are one rounding unit apart, then half of one inside each other.
        let (out, inside) = (x * (1.0 + f64::EPSILON), x * (1.0 - f64::EPSILON / 2.0));
        poses.extend([
            translation(0.5, out, 0.25),
            translation(out, out, out),
            translation(inside, 0.5, 0.0),
        ]);
    }
    let turned = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
    poses.push(Pose::new(turned, [2.4, 0.0, 0.0]).unwrap());
    poses.push(Pose::new(turned, [0.0, 0.0, 2.0]).unwrap());
    check(&cube, &cube, &poses);
    // A corner of the octahedron is placed on faces, edges and corners of the plate, from above and from below.
    let plate = files(&dirty(&plate(4), 1));
    let octahedron = files(&dirty(&sphere(0), 2));
    let above = |x: f64, y: f64| [1.0, 1.0 + 1e-15, 1.0 - 1e-15, -1.0].map(|z| translation(x, y, z));
    let poses: Vec<_> = [above(0.1, 0.2), above(0.5, 0.125), above(0.5, -0.5), above(1.0, 1.0)].concat();
    check(&plate, &octahedron, &poses);
}

#[test]
fn nested_surfaces_do_not_collide() {
    let outer = files(&sphere(2));
    let inner = files(&moved(&sphere(1), 0.25, [0.125, 0.25, 0.0]));
    let mut querier = Querier::new().unwrap();
    let mut random = Random::new(3);
    let poses: Vec<_> = (0..4).map(|_| random_pose(&mut random, 0.2)).collect();
    for pose in &poses {
        assert!(!querier.collide(&outer[0], &inner[0], pose).unwrap());
        assert!(querier.distance(&outer[0], &inner[0], pose).unwrap().distance > 0.1);
    }
    check(&outer, &inner, &poses);
    check(&inner, &outer, &poses[..1]);
}

#[test]
fn a_few_triangles() {
    let mut random = Random::new(8);
    for count in 1..=5 {
        let (a, b) = (soup(count, 20 + count as u64), soup(6 - count, 30 + count as u64));
        let poses = [0.2, 0.6, 2.0].map(|reach| random_pose(&mut random, reach));
        check(&files(&a), &files(&b), &poses);
    }
    // Meshes of points and segments only.
    let point = vec![[[0.5, 0.25, 0.0]; 3]];
    let segments = vec![[[0.0; 3], [1.0, 0.5, 0.0], [0.0; 3]], [[0.0; 3], [2.0, 2.0, 2.0], [1.0; 3]]];
    let poses = [Pose::IDENTITY, translation(0.5, 0.25, 0.0), translation(-0.5, 0.0, 1e-7)];
    for (a, b) in [(&point, &point), (&point, &segments), (&segments, &segments), (&segments, &cube())] {
        check(&files(a), &files(b), &poses);
    }
}

#[test]
fn tiny_and_huge_meshes() {
    for scale in [1e-20, 1e-37, 1e15, 1e35] {
        let a = files(&moved(&dirty(&sphere(1), 1), scale, [0.0; 3]));
        let b = files(&moved(&soup(40, 2), scale, [0.0; 3]));
        let mut random = Random::new(5);
        let poses = [0.5, 1.0, 2.0, 3.0].map(|reach| random_pose(&mut random, reach * scale));
        check(&a, &b, &poses);
    }
}

#[test]
fn a_mesh_of_several_bricks() {
    // The mesh has 320,000 triangles, more than the baker puts into one tree.
    let large = terrain(400, 21);
    let small = sphere(0);
    let [large, small] = [large, small].map(|triangles| vec![baked(&triangles)]);
    let mut random = Random::new(22);
    let poses = [0.5, 1.5, 3.0].map(|reach| random_pose(&mut random, reach));
    check(&large, &small, &poses);
}

#[test]
fn far_from_the_origin_in_f64() {
    let offset = [1e7, -3e7, 2e7];
    let far = |triangles: Vec<Triangle>| -> Vec<Triangle> {
        let point = |p: [f64; 3]| [0, 1, 2].map(|axis| p[axis] + offset[axis] + 0.1);
        triangles.into_iter().map(|t| t.map(point)).collect()
    };
    let (a, b) = (files(&far(dirty(&sphere(1), 1))), files(&far(soup(40, 3))));
    assert_ne!(a[0].objects()[0].origin()[0], 0.0);
    let near = files(&soup(40, 3));
    let mut random = Random::new(6);
    let poses: Vec<_> =
        [0.5, 1.5, 4.0].map(|reach| translation(random.signed() * reach, 0.0, reach)).to_vec();
    check(&a, &b, &poses);
    // The mesh is turned about its own place, because the translation brings it back.
    let turned: Vec<_> = [0.5, 1.0, 3.0]
        .map(|reach| {
            let pose = random_pose(&mut random, reach);
            let back = pose.place(offset);
            let translation = [0, 1, 2].map(|k| offset[k] - back[k] + 2.0 * pose.translation()[k]);
            Pose::new(*pose.rotation(), translation).unwrap()
        })
        .to_vec();
    check(&a, &b, &turned);
    check(&a, &near, &[Pose::IDENTITY, translation(offset[0], offset[1], offset[2])]);
    check(&near, &a, &[Pose::IDENTITY, translation(-offset[0], -offset[1], -offset[2])]);
}

#[test]
fn quantized_files_are_about_the_moved_triangles() {
    let mut random = Random::new(12);
    let quantized = |triangles: &[Triangle]| files_in(triangles, &[TriangleEncoding::Quantized]);
    let (a, b) = (quantized(&dirty(&sphere(2), 1)), quantized(&soup(60, 3)));
    let poses = [0.3, 1.5, 3.0].map(|reach| random_pose(&mut random, reach));
    check(&a, &b, &poses);
    check(&a, &files(&torus(8, 6)), &poses);
    check(&b, &b, &[Pose::IDENTITY]);
}

#[test]
fn several_objects_answer_as_one() {
    let mut split = mesh(&dirty(&sphere(1), 1));
    let names = ["", "soup", "torus"];
    for (name, triangles) in
        names[1..].iter().zip([dirty(&soup(30, 2), 3), moved(&torus(6, 4), 1.5, [0.5; 3])])
    {
        let mut object = mesh(&triangles).objects.remove(0);
        let first = split.triangle_count() as u32;
        object.triangle_ids.iter_mut().for_each(|id| *id += first);
        object.name = (*name).to_owned();
        split.objects.push(object);
    }
    let other = files(&terrain(6, 4));
    let mut querier = Querier::new().unwrap();
    let mut random = Random::new(13);
    let poses = [0.5, 2.0, 4.0, 4.0].map(|reach| random_pose(&mut random, reach));
    let mut all = Vec::new();
    for profile in Profile::ALL {
        let one = bake(&split, &options(profile, TriangleEncoding::F32));
        let several = bake(&split, &options(profile, TriangleEncoding::Packed).split_objects(true));
        assert_eq!((one.objects().len(), several.objects().len()), (1, 3));
        for pose in &poses {
            let pairs = |contacts: Vec<bvh_query::Contact>| -> Vec<_> {
                let mut pairs: Vec<_> = contacts.iter().map(|c| (c.triangle_a, c.triangle_b)).collect();
                pairs.sort_unstable();
                pairs
            };
            let (as_one, as_several) = (
                querier.contacts(&one, &other[0], pose).unwrap(),
                querier.contacts(&several, &other[0], pose).unwrap(),
            );
            assert_eq!(pairs(as_one), pairs(as_several));
            let distance = querier.distance(&several, &other[0], pose).unwrap().distance;
            assert_eq!(querier.distance(&one, &other[0], pose).unwrap().distance, distance);
            // A single object is at least as far away as all together, and one of them is exactly as far.
            let alone =
                |number| querier.distance(several.object(number).unwrap(), &other[0], pose).unwrap().distance;
            assert_eq!([0, 1, 2].map(alone).into_iter().fold(f64::INFINITY, f64::min), distance);
        }
        assert_eq!(several.find("torus"), Some(2));
        all.push(several);
    }
    check(&all, &other, &poses);
    check(&all, &all, &[Pose::IDENTITY, poses[3]]);
}

/// Checks both meshes in every layout without loss, in random poses.
fn check_meshes(random: &mut Random, [a, b]: [Mesh; 2], reach: f64) {
    let bakes = |mesh| -> Vec<_> {
        let choose = |i: usize| options(Profile::ALL[i], LOSSLESS[i % 2]);
        (0..Profile::ALL.len()).map(|i| bake(mesh, &choose(i))).collect()
    };
    let poses: Vec<_> = (0..4).map(|_| random_pose(random, reach)).collect();
    check(&bakes(&a), &bakes(&b), &poses);
}

#[test]
fn real_meshes() {
    check_meshes(&mut Random::new(14), fcl_pair(), 3000.0);
}

#[test]
#[ignore = "needs ../shared"]
fn larger_real_meshes() {
    let random = &mut Random::new(16);
    for (other, reach) in [("fclrob.obj", 4000.0), ("piano.obj", 60.0)] {
        check_meshes(random, ["piano.obj", other].map(shared_mesh), reach);
    }
}

#[test]
fn without_ids_places_name_triangles() {
    let mut random = Random::new(15);
    for profile in Profile::ALL {
        let file = |triangles: &[Triangle]| {
            bake(&mesh(triangles), &options(profile, TriangleEncoding::F32).ids(false))
        };
        let (a, b) = (file(&dirty(&sphere(1), 1)), file(&torus(8, 4)));
        let poses = [0.5, 3.0].map(|reach| random_pose(&mut random, reach));
        check(&[a], &[b], &poses);
    }
}

#[test]
fn a_visit_of_contacts_ends_when_told() {
    let file = baked(&soup(80, 1));
    for querier in &mut queriers() {
        let all = querier.contacts(&file, &file, &Pose::IDENTITY).unwrap();
        assert!(all.len() > 80);
        for most in [1, 2, 50] {
            let mut seen = Vec::new();
            let calls = querier.visit_contacts(&file, &file, &Pose::IDENTITY, |contact| {
                seen.push(contact);
                if seen.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            });
            assert_eq!((calls, seen.len()), (Ok(most as u64), most));
            assert!(seen.iter().all(|contact| all.binary_search(contact).is_ok()));
        }
    }
}

/// Places the unit ball `gap` above the middle of a triangle of a ball a thousand times as large.
fn beside(triangle: &Triangle, gap: f64, random: &mut Random) -> Pose {
    let middle = [0, 1, 2].map(|axis| triangle.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0);
    let length = middle.iter().map(|x| x * x).sum::<f64>().sqrt();
    let shift = middle.map(|x| x * (1.0 + (1.0 + gap) / length));
    Pose::new(*random_pose(random, 0.0).rotation(), shift).unwrap()
}

/// The triangles of A are larger than B, so that they are bounded one by one against nodes of B; and the other way
/// round.
#[test]
fn a_mesh_a_thousand_times_larger_than_the_other() {
    let (large, small) = (moved(&sphere(2), 1000.0, [0.0; 3]), sphere(4));
    let (files_large, files_small) = (files(&large), files(&small));
    let mut random = Random::new(31);
    let gaps = [-1.0, -0.01, 0.001, 0.3, 60.0];
    let poses: Vec<Pose> = gaps.iter().map(|&gap| beside(&large[37], gap, &mut random)).collect();
    check(&files_large, &files_small, &poses);
    let inverse = |pose: &Pose| {
        let r = pose.rotation();
        let t = pose.translation();
        let rows = [0, 1, 2].map(|i| [r[0][i], r[1][i], r[2][i]]);
        Pose::new(rows, rows.map(|row| -(row[0] * t[0] + row[1] * t[1] + row[2] * t[2]))).unwrap()
    };
    let poses: Vec<Pose> = poses.iter().map(inverse).collect();
    check(&files_small, &files_large, &poses);
}

/// Without bounds of single triangles, every packet of the small mesh is tested.
#[test]
fn a_small_mesh_beside_a_large_triangle_takes_few_tests() {
    let (large, small) = (moved(&sphere(2), 1000.0, [0.0; 3]), sphere(5));
    let pose = beside(&large[37], 0.01, &mut Random::new(32));
    let (large, small) = (baked(&large), baked(&small));
    for mut querier in queriers() {
        assert!(!querier.collide(&large, &small, &pose).unwrap());
        let tests = querier.stats().packet_tests;
        assert!(tests < 500, "{tests} packet tests, of some 2,000 packets");
        assert!(querier.distance(&large, &small, &pose).unwrap().distance > 0.0);
        let tests = querier.stats().packet_tests;
        assert!(tests < 1000, "{tests} packet tests, of some 2,000 packets");
    }
}
