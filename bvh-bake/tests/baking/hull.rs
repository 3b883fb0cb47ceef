//! Convex hulls, checked in exact arithmetic: each is closed, looks outwards and contains every point, also as a file holds it.

use bvh_bake::mesh::Mesh;
use bvh_bake::shapes::convex_hull;
use bvh_bake::{Options, ShapeError, to_bytes};
use bvh_format::validate::validate;
use cbvh_testkit::Random;
use cbvh_testkit::exact::{Dyadic, Number, cross, dot, subtract};
use cbvh_testkit::stored::stored;
use std::cmp::Ordering;
use std::collections::{BTreeSet, HashSet};

type Triangle = [[f64; 3]; 3];

fn exact(point: [f64; 3]) -> [Dyadic; 3] {
    point.map(Dyadic::of)
}

/// Checks a surface in exact arithmetic: each edge has one partner, no triangle is without area, it is in one piece, and no
/// point is above a triangle. A closed surface of one piece all of whose triangles have everything below them is the hull.
fn check(name: &str, triangles: &[Triangle], points: &[[f64; 3]]) {
    let bits = |point: [f64; 3]| point.map(f64::to_bits);
    let edges: Vec<_> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(p, q)| (bits(p), bits(q)))
        .collect();
    let once: HashSet<_> = edges.iter().copied().collect();
    assert_eq!(once.len(), edges.len(), "{name}: an edge is there twice");
    assert!(edges.iter().all(|&(p, q)| once.contains(&(q, p))), "{name}: an edge has no partner");
    let vertices: BTreeSet<_> = edges.iter().map(|edge| edge.0).collect();
    assert_eq!(vertices.len() + triangles.len(), edges.len() / 2 + 2, "{name}: Euler's formula of one ball");
    let points: Vec<_> = points.iter().map(|&point| exact(point)).collect();
    for &triangle in triangles {
        let [a, b, c] = triangle.map(exact);
        let normal = cross(&subtract(&b, &a), &subtract(&c, &a));
        assert!(normal.iter().any(|x| x.sign() != Some(Ordering::Equal)), "{name}: {triangle:?} has no area");
        for point in &points {
            let height = dot(&normal, &subtract(point, &a));
            assert_ne!(height.sign(), Some(Ordering::Greater), "{name}: {point:?} above {triangle:?}");
        }
    }
}

fn corners(mesh: &Mesh) -> Vec<Triangle> {
    let object = &mesh.objects[0];
    object.triangles.iter().map(|numbers| numbers.map(|number| object.positions[number as usize])).collect()
}

/// Coordinates that are f32 numbers.
fn rounded(points: impl IntoIterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
    points.into_iter().map(|point| point.map(|x| f64::from(x as f32))).collect()
}

/// Points that are hard for a hull, as f32 numbers.
fn hard() -> Vec<(&'static str, Vec<[f64; 3]>)> {
    let mut random = Random::new(11);
    let mut ball = |count: usize, stretch: [f64; 3], middle: [f64; 3]| -> Vec<[f64; 3]> {
        (0..count)
            .map(|_| {
                let p = random.point();
                let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                [0, 1, 2].map(|axis| middle[axis] + stretch[axis] * p[axis] / length)
            })
            .collect()
    };
    let grid: Vec<[f64; 3]> =
        (0..216).map(|k| [k % 6, k / 6 % 6, k / 36].map(|at| f64::from(at) / 10.0)).collect();
    let mut cases = vec![
        ("points on a sphere", ball(300, [1.0; 3], [0.0; 3])),
        ("nearly flat", ball(200, [1.0, 1.0, 1e-7], [0.0; 3])),
        ("flat but for one step of f32", ball(200, [1.0, 1.0, 0.0], [0.0; 3])),
        ("nearly a line", ball(200, [1.0, 1e-7, 1e-7], [0.0; 3])),
        ("far away", ball(200, [1.0; 3], [1e6, -1e6, 1e6])),
        ("so far away that many coincide", ball(500, [1.0; 3], [1e7, 0.0, 0.0])),
        ("tiny", ball(200, [1e-40; 3], [0.0; 3])),
        ("huge", ball(200, [1e30; 3], [0.0; 3])),
        (
            "tiny and huge",
            ball(60, [1e30; 3], [0.0; 3]).into_iter().chain(ball(60, [1e-30; 3], [1.0; 3])).collect(),
        ),
        ("long", ball(200, [1e30, 1.0, 1e-30], [0.0; 3])),
        ("a grid", grid.clone()),
        ("a grid of integers", grid.iter().map(|p| p.map(|x| (x * 10.0).round())).collect()),
        ("a grid far away", grid.iter().map(|p| p.map(|x| x + 1000.0)).collect()),
        ("a grid, tilted", grid.iter().map(|&[x, y, z]| [x + y, y - x, z + 3.0 * x]).collect()),
        (
            "corners of boxes in each other",
            (0..64u32)
                .map(|k| {
                    [0, 1, 2].map(|axis| {
                        let size = f64::from(1 + k / 8);
                        if k >> axis & 1 == 0 { -size } else { size }
                    })
                })
                .collect(),
        ),
        (
            "an octahedron of points on its edges",
            (0..300u32)
                .map(|k| {
                    let along = f64::from(k / 12) / 25.0;
                    let mut point = [0.0; 3];
                    point[(k % 3) as usize] = if k & 4 == 0 { along } else { -along };
                    point[((k + 1) % 3) as usize] = if k & 8 == 0 { 1.0 - along } else { along - 1.0 };
                    point
                })
                .collect(),
        ),
        ("a tetrahedron", vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
    ];
    cases[2].1[0][2] = f64::from(f32::from_bits(1));
    let twice: Vec<_> = cases[10].1.iter().chain(&cases[0].1).flat_map(|&point| [point; 3]).collect();
    cases.push(("each point three times", twice));
    // A polygon extruded: its sides are rectangles of four points in one plane, if f32 could say so.
    let prism = (0..128).map(|k| {
        let turn = f64::from(k / 2) / 64.0 * std::f64::consts::TAU;
        [turn.cos(), turn.sin(), f64::from(k % 2)]
    });
    cases.push(("a prism", prism.collect()));
    cases.into_iter().map(|(name, points)| (name, rounded(points))).collect()
}

#[test]
fn hulls_of_hard_points_are_closed_look_outwards_and_contain_all_points() {
    for (name, points) in hard() {
        let mesh = convex_hull(&points).unwrap_or_else(|error| panic!("{name}: {error}"));
        check(name, &corners(&mesh), &points);
        let given: HashSet<_> = points.iter().map(|point| point.map(|x| (x + 0.0).to_bits())).collect();
        assert!(
            mesh.objects[0].positions.iter().all(|point| given.contains(&point.map(f64::to_bits))),
            "{name}"
        );
        // So is what a file holds of it: nothing is rounded.
        let (bytes, _) = to_bytes(&mesh, &Options::default()).unwrap();
        let held: Vec<Triangle> = stored(&bytes).iter().map(|triangle| triangle.corners).collect();
        assert_eq!(held.len(), mesh.objects[0].triangles.len(), "{name}");
        check(name, &held, &points);
        assert!(validate(&bytes).unwrap().check_topology(&bytes[..]).unwrap()[0].closed, "{name}");
    }
}

#[test]
fn a_hull_has_the_same_vertices_for_points_in_another_order() {
    let mut random = Random::new(3);
    // No four of these points are in a plane of the hull, so that there is no choice of vertices.
    let (_, mut points) = hard().swap_remove(0);
    let vertices = |points: &[[f64; 3]]| -> BTreeSet<[u64; 3]> {
        convex_hull(points).unwrap().objects[0]
            .positions
            .iter()
            .map(|point| point.map(f64::to_bits))
            .collect()
    };
    let expected = vertices(&points);
    for last in (1..points.len()).rev() {
        points.swap(last, random.below(last + 1));
    }
    assert_eq!(vertices(&points), expected);
}

#[test]
fn random_small_integers_have_hulls() {
    let mut random = Random::new(17);
    let mut flat = 0;
    for _ in 0..3000 {
        let points: Vec<[f64; 3]> =
            (0..4 + random.below(12)).map(|_| [0; 3].map(|_: i32| random.below(4) as f64)).collect();
        match convex_hull(&points) {
            Ok(mesh) => check("small integers", &corners(&mesh), &points),
            Err(ShapeError::Flat { dimension, .. }) => {
                flat += 1;
                let exact: Vec<_> = points.iter().map(|&point| exact(point)).collect();
                let [a, b, c, d] = [0, 1, 2, 3];
                let normal = cross(&subtract(&exact[b], &exact[a]), &subtract(&exact[c], &exact[a]));
                let height = dot(&normal, &subtract(&exact[d], &exact[a]));
                assert!(dimension <= 2 && height.sign() == Some(Ordering::Equal));
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(flat > 3);
}

#[test]
fn hulls_of_f64_points_are_exact_until_they_are_baked() {
    let mut random = Random::new(23);
    for (scale, middle) in [(1.0, [0.0; 3]), (1.0, [5e6, -3e6, 7.0]), (1e-9, [1.0; 3]), (1e-100, [0.0; 3])] {
        let points: Vec<[f64; 3]> = (0..200)
            .map(|_| random.point().map(|x| scale * x))
            .map(|p| [0, 1, 2].map(|k| middle[k] + p[k]))
            .collect();
        let Ok(mesh) = convex_hull(&points) else {
            assert_eq!(scale, 1e-100, "nothing is left of numbers that no file can hold");
            continue;
        };
        check("f64", &corners(&mesh), &points);
        let (_, report) = to_bytes(&mesh, &Options::default()).unwrap();
        let largest = middle.iter().fold(scale, |most, x| most.max(x.abs()));
        let most = (scale / f64::from(1u32 << 24)).max(4.0 * f64::EPSILON * largest);
        assert!(report.file.max_vertex_rounding <= most);
    }
}

#[test]
fn points_without_a_volume_are_refused() {
    let line: Vec<[f64; 3]> = rounded((0..50).map(|k| [f64::from(k), 2.0 * f64::from(k), -f64::from(k)]));
    let plane: Vec<[f64; 3]> =
        (0..49).map(|k| [f64::from(k % 7), f64::from(k / 7), f64::from(k % 7 + k / 7)]).collect();
    for (points, dimension) in [
        (vec![], 0),
        (vec![[1.0; 3]], 0),
        (vec![[0.1, 0.2, 0.3]; 100], 0),
        (vec![[0.0; 3], [1.0; 3]], 1),
        (line, 1),
        (vec![[0.0; 3], [1.0; 3], [1.0, 0.0, 0.0]], 2),
        (plane.clone(), 2),
        (plane.iter().map(|p| p.map(|x| x * 2f64.powi(100))).collect(), 2),
        (plane.iter().map(|p| p.map(|x| x * 2f64.powi(-140))).collect(), 2),
        // A height that is too small for any file.
        (vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-300]], 2),
    ] {
        let expected = ShapeError::Flat { points: points.len(), dimension };
        assert_eq!(convex_hull(&points), Err(expected.clone()));
        assert!(
            expected
                .to_string()
                .starts_with("points: expected four or more that are not in one plane, found ")
        );
    }
    for wrong in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.4e36] {
        let mut points = plane.clone();
        points[9][1] = wrong;
        let Err(ShapeError::Point { number: 9, .. }) = convex_hull(&points) else { panic!("{wrong}") };
    }
}
