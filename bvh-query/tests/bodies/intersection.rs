//! What meshes have in common: volumes, areas, boxes and what is pierced, against cells that are counted and polyhedra that are clipped.

use crate::common::shapes::{cube, moved, outward, sphere};
use crate::common::{Random, baked, queriers, random_pose, translation};
use bvh_query::{Bvh, Intersection, Pose, Querier, QueryError};
use std::collections::BTreeSet;

type Point = [f64; 3];
type Triangle = [Point; 3];
/// A name, two meshes, and how thick each of them is where the other one pierces it.
type Case<'a> = (&'a str, &'a [Triangle], &'a [Triangle], Option<f64>, Option<f64>);

/// Asks on all backends, which have to agree.
#[track_caller]
fn intersection(queriers: &mut [Querier], a: &Bvh, b: &Bvh, pose: &Pose) -> Intersection {
    let first = queriers[0].intersection(a, b, pose).unwrap();
    for querier in &mut queriers[1..] {
        assert_eq!(querier.intersection(a, b, pose).unwrap(), first, "{}", querier.backend());
    }
    first
}

/// A box from one corner to another.
fn block(lo: Point, hi: Point) -> Vec<Triangle> {
    outward(cube())
        .iter()
        .map(|triangle| triangle.map(|p| [0, 1, 2].map(|k| if p[k] < 0.0 { lo[k] } else { hi[k] })))
        .collect()
}

/// The surface of some cells of a grid, with sides of a length. Cells may share edges and corners only.
fn surface(cells: &BTreeSet<[i32; 3]>, side: f64) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for cell in cells {
        for axis in 0..3 {
            for up in [false, true] {
                let mut beside = *cell;
                beside[axis] += if up { 1 } else { -1 };
                if cells.contains(&beside) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |i: i32, j: i32| {
                    let mut at = *cell;
                    at[axis] += i32::from(up);
                    at[u] += i;
                    at[v] += j;
                    at.map(|x| f64::from(x) * side)
                };
                let [p, q, r, s] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                triangles.extend(if up { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] });
            }
        }
    }
    triangles
}

fn random_cells(random: &mut Random, size: i32) -> BTreeSet<[i32; 3]> {
    let share = 1 + random.below(6);
    let mut cells = BTreeSet::new();
    while cells.is_empty() {
        for n in 0..size * size * size {
            if random.below(7) < share {
                cells.insert([n % size, n / size % size, n / (size * size)]);
            }
        }
    }
    cells
}

/// Cells of one grid are flush in nearly all faces, and have edges and corners in common. Also turned by right angles.
#[test]
fn common_cells_are_counted() {
    let (mut queriers, mut random) = (queriers(), Random::new(5));
    let turns = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    ];
    for round in 0..120 {
        let (a, b) = (random_cells(&mut random, 4), random_cells(&mut random, 4));
        let side = [1.0, 0.1, 2f64.powi(-30), 1e6][round % 4];
        // A cell's least corner is not that of the turned cell, where an axis is turned around.
        let turn = turns[round % 3];
        let shift = [(); 3].map(|()| random.below(5) as i32 - 2);
        let placed: BTreeSet<[i32; 3]> = b
            .iter()
            .map(|cell| {
                [0, 1, 2].map(|k| {
                    let along = (0..3).find(|&j| turn[k][j] != 0.0).unwrap();
                    let at = if turn[k][along] > 0.0 { cell[along] } else { -cell[along] - 1 };
                    at + shift[k]
                })
            })
            .collect();
        let pose = Pose::new(turn, shift.map(|x| f64::from(x) * side)).unwrap();
        // Decimal sides are flush only where no translation rounds.
        let (other, pose) = if side == 0.1 { (&placed, Pose::IDENTITY) } else { (&b, pose) };
        let found =
            intersection(&mut queriers, &baked(&surface(&a, side)), &baked(&surface(other, side)), &pose);
        let common: BTreeSet<[i32; 3]> = a.intersection(&placed).copied().collect();
        let volume = common.len() as f64 * side.powi(3);
        let rounding = 1e-13 * side.powi(3) * 64.0;
        assert!((found.volume - volume).abs() <= found.volume_error + rounding, "{round} {found:?} {volume}");
        assert!(found.volume_error <= 1e-12 * 64.0 * side.powi(3), "{found:?}");
        if common.is_empty() {
            continue;
        }
        let least: f64 = surface(&common, side).len() as f64 / 2.0 * side * side;
        // Faces that are flush from both sides may enclose nothing between them.
        assert!(found.area_a + found.area_b >= least * (1.0 - 1e-12), "{round} {found:?} {least}");
        let [lo, hi] = found.bounds.unwrap();
        for k in 0..3 {
            let low = common.iter().map(|cell| cell[k]).min().unwrap();
            let high = common.iter().map(|cell| cell[k] + 1).max().unwrap();
            let slack = 1e-12 * side;
            assert!(
                lo[k] <= f64::from(low) * side + slack && hi[k] >= f64::from(high) * side - slack,
                "{found:?}"
            );
        }
    }
}

/// The volume of the convex polyhedron that planes leave of a box: each face is clipped by all other planes.
fn clipped_volume(planes: &[(Point, f64)]) -> f64 {
    let dot = |p: Point, q: Point| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let cross = |p: Point, q: Point| {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let mut six = 0.0;
    for (number, (normal, offset)) in planes.iter().enumerate() {
        let aside = if normal[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let norm = |v: Point| v.map(|x| x / dot(v, v).sqrt());
        let (u, middle) = (norm(cross(*normal, aside)), normal.map(|x| x * offset));
        let v = cross(*normal, u);
        let corner = |i: f64, j: f64| [0, 1, 2].map(|k| middle[k] + 100.0 * (i * u[k] + j * v[k]));
        let mut polygon = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        for (other, (n, d)) in planes.iter().enumerate() {
            if other == number {
                continue;
            }
            let mut kept = Vec::new();
            for at in 0..polygon.len() {
                let (p, q) = (polygon[at], polygon[(at + 1) % polygon.len()]);
                let (x, y) = (dot(*n, p) - d, dot(*n, q) - d);
                if x <= 0.0 {
                    kept.push(p);
                }
                if (x < 0.0) != (y < 0.0) && x != y {
                    kept.push([0, 1, 2].map(|k| p[k] + x / (x - y) * (q[k] - p[k])));
                }
            }
            polygon = kept;
        }
        for at in 1..polygon.len().max(1) - 1 {
            six += dot(polygon[0], cross(polygon[at], polygon[at + 1]));
        }
    }
    six / 6.0
}

#[test]
fn convex_solids_have_the_volume_of_what_planes_leave() {
    let (mut queriers, mut random) = (queriers(), Random::new(23));
    let mut shared = 0;
    for _ in 0..200 {
        let [a, b] = [(); 2].map(|()| [(); 3].map(|()| 0.2 + random.unit()));
        let pose = random_pose(&mut random, 1.0);
        let [of_a, of_b] = [a, b].map(|half| baked(&block(half.map(|x: f64| -x), half)));
        let mut planes = Vec::new();
        for k in 0..3 {
            for sign in [1.0, -1.0] {
                let mut normal = [0.0; 3];
                normal[k] = sign;
                planes.push((normal, a[k]));
                let turned = pose.rotation().map(|row| row[k] * sign);
                let at = pose.translation();
                planes.push((turned, b[k] + (0..3).map(|j| turned[j] * at[j]).sum::<f64>()));
            }
        }
        let volume = clipped_volume(&planes);
        let found = intersection(&mut queriers, &of_a, &of_b, &pose);
        assert!((found.volume - volume).abs() <= 1e-12, "{found:?} {volume}");
        assert!(found.volume_error < 1e-11, "{found:?}");
        shared += usize::from(volume > 0.0);
        let Ok(inverse) = pose.inverse() else { continue };
        let swapped = intersection(&mut queriers, &of_b, &of_a, &inverse);
        assert!(
            (found.volume - swapped.volume).abs() < 1e-12 && (found.area_a - swapped.area_b).abs() < 1e-12
        );
        let same = |x: Option<f64>, y: Option<f64>| match (x, y) {
            (Some(x), Some(y)) => (x - y).abs() < 1e-12,
            (None, None) => true,
            _ => false,
        };
        assert!(
            same(found.pierced_a, swapped.pierced_b) && same(found.pierced_b, swapped.pierced_a),
            "{found:?} {swapped:?}"
        );
    }
    assert!(shared > 100, "{shared}");
}

/// A mesh in another one, one that is itself, one turned inside out, with and without a common point.
#[test]
fn all_of_a_mesh_may_be_in_the_other() {
    let mut queriers = queriers();
    let (ball, large) = (outward(sphere(3)), moved(&outward(sphere(3)), 3.0, [0.0; 3]));
    let six: f64 = ball
        .iter()
        .map(|[p, q, r]| {
            p[0] * (q[1] * r[2] - q[2] * r[1])
                + p[1] * (q[2] * r[0] - q[0] * r[2])
                + p[2] * (q[0] * r[1] - q[1] * r[0])
        })
        .sum();
    let inside_out = |of: &[Triangle]| of.iter().map(|&[p, q, r]| [p, r, q]).collect::<Vec<_>>();
    for a in [ball.clone(), inside_out(&ball)] {
        for b in [ball.clone(), inside_out(&ball), large.clone(), inside_out(&large)] {
            let [a, b] = [&a, &b].map(|of| baked(of));
            for (a, b) in [(&a, &b), (&b, &a)] {
                let found = intersection(&mut queriers, a, b, &Pose::IDENTITY);
                assert!((found.volume - six / 6.0).abs() <= found.volume_error + 1e-14, "{found:?}");
                assert_eq!((found.pierced_a, found.pierced_b), (None, None));
            }
        }
    }
    let found = intersection(&mut queriers, &baked(&ball), &baked(&ball), &translation(2.5, 0.0, 0.0));
    assert_eq!((found.volume, found.volume_error, found.bounds), (0.0, 0.0, None));
}

/// Walls, ducts, pipes, slabs and beams of known sizes, shifted and turned.
#[test]
fn what_is_pierced_is_as_thick_as_it_was_made() {
    let (mut queriers, mut random) = (queriers(), Random::new(41));
    let wall = block([-3.0, -0.1, -2.0], [3.0, 0.1, 2.0]);
    let duct = block([-0.3, -1.1, -0.25], [0.3, 0.9, 0.25]);
    let blind = block([-0.3, -1.1, -0.25], [0.3, 0.05, 0.25]);
    let pipe = pipe(0.3, 0.2, 1.2);
    let walls = [wall.clone(), block([-3.0, 0.25, -2.0], [3.0, 0.45, 2.0])].concat();
    let comb: Vec<Triangle> = [-0.6, -0.2, 0.2, 0.6]
        .iter()
        .flat_map(|x| block([x - 0.1, -0.5, -0.05], [x + 0.1, 0.02, 0.05]))
        .collect();
    let cases: [Case<'_>; 7] = [
        ("duct through wall", &duct, &wall, None, Some(0.2)),
        // The wall is in the pipe's own wall, too, from the facets outside to those inside.
        ("pipe through wall", &pipe, &wall, Some(0.1 * (std::f64::consts::PI / 24.0).cos()), Some(0.2)),
        ("duct in wall", &blind, &wall, None, None),
        ("duct through two walls", &duct, &walls, None, Some(0.2)),
        ("teeth of a comb in a wall", &comb, &wall, None, None),
        ("wall and slab", &wall, &block([-1.0, -2.0, -0.15], [1.0, 2.0, 0.15]), Some(0.2), None),
        ("longer slab", &block([-4.0, -2.0, -0.15], [4.0, 2.0, 0.15]), &wall, Some(0.3), None),
    ];
    for (name, a, b, pierced_a, pierced_b) in cases {
        for round in 0..12 {
            let (of_a, of_b) = (baked(a), baked(b));
            let mut shift = random.point().map(|x| 0.01 * x);
            if round == 0 {
                shift = [0.0; 3];
            }
            let about = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let pose = Pose::new(about, shift).unwrap();
            let frame = random_pose(&mut random, 10.0);
            // Both moved together: the same thickness.
            let placed = |of: &[Triangle], pose: &Pose| -> Vec<Triangle> {
                of.iter().map(|triangle| triangle.map(|p| frame.place(pose.place(p)))).collect()
            };
            let found = if round % 2 == 0 {
                intersection(&mut queriers, &of_a, &of_b, &pose)
            } else {
                let (a, b) = (baked(&placed(a, &Pose::IDENTITY)), baked(&placed(b, &pose)));
                intersection(&mut queriers, &a, &b, &Pose::IDENTITY)
            };
            let same = |x: Option<f64>, y: Option<f64>| match (x, y) {
                (Some(x), Some(y)) => (x - y).abs() < 1e-12,
                (None, None) => true,
                _ => false,
            };
            assert!(
                same(found.pierced_a, pierced_a) && same(found.pierced_b, pierced_b),
                "{name} {round}: {found:?}"
            );
        }
    }
}

/// A pipe along y: what is between two cylinders, with its ends.
fn pipe(outer: f64, inner: f64, half: f64) -> Vec<Triangle> {
    let count = 24;
    let at = |radius: f64, n: usize, y: f64| {
        let angle = std::f64::consts::TAU * (n % count) as f64 / count as f64;
        [radius * angle.cos(), y, radius * angle.sin()]
    };
    let mut triangles = Vec::new();
    for n in 0..count {
        let quads = [
            [at(outer, n, -half), at(outer, n, half), at(outer, n + 1, half), at(outer, n + 1, -half)],
            [at(inner, n + 1, -half), at(inner, n + 1, half), at(inner, n, half), at(inner, n, -half)],
            [at(inner, n, half), at(inner, n + 1, half), at(outer, n + 1, half), at(outer, n, half)],
            [at(outer, n, -half), at(outer, n + 1, -half), at(inner, n + 1, -half), at(inner, n, -half)],
        ];
        triangles.extend(quads.iter().flat_map(|&[p, q, r, s]| [[p, q, r], [p, r, s]]));
    }
    triangles
}

/// Boxes whose corners are multiples of 2^-20 have a volume that integers tell, near the origin, far from it, flat and large.
#[test]
fn volumes_are_certain() {
    let (mut queriers, mut random) = (queriers(), Random::new(9));
    for round in 0..300 {
        let far = [0i64, 1 << 40, 1 << 48, -(1 << 44)][round % 4];
        let reach = [1 << 22, 1 << 12, 1 << 30][round % 3];
        let mut corners = || {
            let mut pair = [(); 2].map(|()| [(); 3].map(|()| far + random.below(reach) as i64));
            for k in 0..3 {
                let [lo, hi] = [pair[0][k].min(pair[1][k]), pair[0][k].max(pair[1][k]) + 1];
                (pair[0][k], pair[1][k]) = (lo, hi);
            }
            pair
        };
        let (a, b) = (corners(), corners());
        let unit = 1.0 / f64::from(1 << 20);
        let [of_a, of_b] =
            [a, b].map(|[lo, hi]| baked(&block(lo.map(|x| x as f64 * unit), hi.map(|x| x as f64 * unit))));
        let sides = [0, 1, 2].map(|k| i128::from((a[1][k].min(b[1][k]) - a[0][k].max(b[0][k])).max(0)));
        let volume = (sides[0] * sides[1] * sides[2]) as f64 * unit.powi(3);
        let found = intersection(&mut queriers, &of_a, &of_b, &Pose::IDENTITY);
        // The product is rounded once.
        let off = (found.volume - volume).abs() - volume * f64::EPSILON;
        assert!(off <= found.volume_error, "{round} {found:?} {volume}");
        if far == 0 {
            let size = reach as f64 * unit;
            assert!(found.volume_error <= 1e-13 * size.powi(3), "{found:?}");
        }
    }
}

/// A solid with zero-area triangles, vertices in the middle of edges, and slivers is as large as without.
#[test]
fn triangles_without_area_change_nothing() {
    let (mut queriers, mut random) = (queriers(), Random::new(77));
    let plain = block([-1.0, -0.5, -0.25], [1.0, 0.5, 0.25]);
    let mut divided = Vec::new();
    for &[p, q, r] in &plain {
        let part = [0.5, 0.25, 2f64.powi(-45)][random.below(3)];
        let middle = [0, 1, 2].map(|k| p[k] + part * (q[k] - p[k]));
        divided.extend([[p, middle, r], [middle, q, r], [p, q, middle]]);
    }
    for (number, other) in
        [block([-0.3; 3], [0.7, 0.9, 1.5]), pipe(0.4, 0.3, 0.4), plain.clone(), divided.clone()]
            .iter()
            .enumerate()
    {
        for _ in 0..10 {
            let pose = if random.below(2) == 0 { Pose::IDENTITY } else { random_pose(&mut random, 0.5) };
            let [one, two] =
                [&plain, &divided].map(|of| intersection(&mut queriers, &baked(of), &baked(other), &pose));
            assert!((one.volume - two.volume).abs() <= 1e-13, "{number} {one:?} {two:?}");
            assert!(
                (one.area_a + one.area_b - two.area_a - two.area_b).abs() <= 1e-12,
                "{number} {one:?} {two:?}"
            );
        }
    }
}

/// The polygons of a boundary are closed together, enclose the volume, and have its areas; a plate with holes, too.
#[test]
fn polygons_enclose_the_volume() {
    let (mut queriers, mut random) = (queriers(), Random::new(2));
    let wall = block([-3.0, -0.1, -2.0], [3.0, 0.1, 2.0]);
    let shapes = [pipe(0.3, 0.2, 1.2), outward(sphere(2)), block([-0.5; 3], [0.5, 0.7, 0.6]), wall];
    let mut holes = 0;
    for round in 0..40 {
        let [a, b] = [(); 2].map(|()| baked(&shapes[random.below(shapes.len())]));
        let pose = if round < 4 { Pose::IDENTITY } else { random_pose(&mut random, 0.3) };
        let found = intersection(&mut queriers, &a, &b, &pose);
        let surface = queriers[0].intersection_surface(&a, &b, &pose).unwrap();
        assert_eq!(surface.loops.iter().sum::<u32>() as usize, surface.points.len());
        assert_eq!(surface.polygons.iter().sum::<u32>() as usize, surface.loops.len());
        holes += surface.loops.len() - surface.polygons.len();
        let (mut six, mut around, mut at) = (0.0, std::collections::BTreeMap::new(), 0);
        for &count in &surface.loops {
            let points = &surface.points[at..at + count as usize];
            at += count as usize;
            for k in 0..points.len() {
                let (o, p, q) = (points[0], points[k], points[(k + 1) % points.len()]);
                six += o[0] * (p[1] * q[2] - p[2] * q[1])
                    + o[1] * (p[2] * q[0] - p[0] * q[2])
                    + o[2] * (p[0] * q[1] - p[1] * q[0]);
                let bits = |p: Point| p.map(|x| (x + 0.0).to_bits());
                *around.entry((bits(p), bits(q))).or_insert(0) += 1;
                *around.entry((bits(q), bits(p))).or_insert(0) -= 1;
            }
        }
        assert!(around.values().all(|net| *net == 0), "{round}");
        // Loops of one face lie in one plane, so each has the height of its own first point.
        assert!((six / 6.0 - found.volume).abs() < 1e-12, "{round} {six} {found:?}");
    }
    assert!(holes > 0);
}

#[test]
fn open_meshes_have_no_volume() {
    let open = &outward(cube())[1..];
    let (open, closed) = (baked(open), baked(&outward(cube())));
    for querier in &mut queriers() {
        for (a, b) in [(&open, &closed), (&closed, &open)] {
            let error = querier.intersection(a, b, &Pose::IDENTITY).unwrap_err();
            assert!(matches!(error, QueryError::NotClosed { .. }), "{error}");
        }
    }
}

/// A tetrahedron with corners that are whole numbers below a limit, counterclockwise seen from outside.
fn random_tetrahedron(random: &mut Random, limit: usize) -> [Triangle; 4] {
    loop {
        let corners = [(); 4].map(|()| [(); 3].map(|()| random.below(limit) as f64));
        let [u, v, w] = [1, 2, 3].map(|n| [0, 1, 2].map(|k| corners[n][k] - corners[0][k]));
        let six = u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0]);
        let [p, q, r, s] = corners;
        if six != 0.0 {
            let [q, r] = if six > 0.0 { [q, r] } else { [r, q] };
            return [[p, r, q], [p, q, s], [q, r, s], [r, p, s]];
        }
    }
}

/// The volume that two tetrahedra have in common, by their planes.
fn common_volume(a: &[Triangle], b: &[Triangle]) -> f64 {
    let mut planes: Vec<(Point, f64)> = Vec::new();
    for [p, q, r] in a.iter().chain(b) {
        let [u, v] = [q, r].map(|x| [0, 1, 2].map(|k| x[k] - p[k]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let normal = normal.map(|x| x / length);
        let plane = (normal, normal.iter().zip(p).map(|(x, y)| x * y).sum::<f64>());
        let is_known = |sign: f64| {
            let differs = |x: f64, y: f64| (x - sign * y).abs() > 1e-12;
            let is_it = |known: &(Point, f64)| {
                !differs(known.1, plane.1) && (0..3).all(|k| !differs(known.0[k], plane.0[k]))
            };
            planes.iter().any(is_it)
        };
        // Nothing but a plane is between two that face each other.
        if is_known(-1.0) {
            return 0.0;
        }
        if !is_known(1.0) {
            planes.push(plane);
        }
    }
    clipped_volume(&planes)
}

/// Tetrahedra whose corners are whole numbers from 2^52 on: all points of what they have in common may be rounded to one.
#[test]
fn volumes_are_certain_where_all_points_are_rounded_to_one() {
    let (mut queriers, mut random) = (queriers(), Random::new(52));
    let mut flat = 0;
    for round in 0..400 {
        let limit = [3, 5, 9, 40][round % 4];
        let near = [(); 2].map(|()| random_tetrahedron(&mut random, limit));
        let [a, b] = near.map(|of| of.map(|triangle| triangle.map(|p| p.map(|x| x + 2f64.powi(52)))));
        let volume = common_volume(&near[0], &near[1]);
        let found = intersection(&mut queriers, &baked(&a), &baked(&b), &Pose::IDENTITY);
        flat += usize::from(found.volume == 0.0 && volume > 1e-9);
        assert!((found.volume - volume).abs() <= found.volume_error + 1e-9, "{round} {found:?} {volume}");
    }
    assert!(flat > 0);
}

/// Volumes add up, each as often as surfaces wind around it: parts that overlap, have corners, edges and faces in common, or are there
/// twice, and some of them inside out.
#[test]
fn volumes_of_parts_add_up() {
    let (mut queriers, mut random) = (queriers(), Random::new(17));
    let mut shared = 0;
    for round in 0..400 {
        let limit = [3, 4, 6][round % 3];
        let mut parts = || {
            let mut parts: Vec<([Triangle; 4], f64)> = Vec::new();
            for _ in 0..1 + random.below(4) {
                let mut part = random_tetrahedron(&mut random, limit);
                if random.below(4) == 0
                    && let Some((known, _)) = parts.last()
                {
                    part = *known;
                }
                parts.push((part, if random.below(3) == 0 { -1.0 } else { 1.0 }));
            }
            parts
        };
        let (a, b) = (parts(), parts());
        let mesh = |parts: &[([Triangle; 4], f64)]| -> Vec<Triangle> {
            let turned = |(part, sign): &([Triangle; 4], f64)| {
                part.map(|[p, q, r]| if *sign > 0.0 { [p, q, r] } else { [p, r, q] })
            };
            parts.iter().flat_map(turned).collect()
        };
        let (mesh_a, mesh_b) = (mesh(&a), mesh(&b));
        let volume: f64 = a
            .iter()
            .flat_map(|(of_a, sign)| {
                b.iter().map(move |(of_b, other)| sign * other * common_volume(of_a, of_b))
            })
            .sum();
        let found = intersection(&mut queriers, &baked(&mesh_a), &baked(&mesh_b), &Pose::IDENTITY);
        assert!((found.volume - volume.abs()).abs() <= 1e-11, "{round} {found:?} {volume}");
        shared += usize::from(volume != 0.0);
    }
    assert!(shared > 100, "{shared}");
}

/// A quarter of a turn by rounded numbers leaves normals with a component of about 1e-16, which is no axis to look along. Lines around
/// parts lead the other way around where one of the meshes is turned inside out.
#[test]
fn holes_are_holes_however_faces_are_turned() {
    let mut queriers = queriers();
    let wall = block([-3.0, -0.1, -2.0], [3.0, 0.1, 2.0]);
    // Beside the diagonals of the wall's faces.
    let duct = moved(&pipe(0.3, 0.2, 1.2), 1.0, [1.0, 0.0, -1.2]);
    let inside_out = |of: &[Triangle]| of.iter().map(|&[p, q, r]| [p, r, q]).collect::<Vec<_>>();
    let (sin, cos) = std::f64::consts::FRAC_PI_2.sin_cos();
    let turns = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]],
        [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]],
    ];
    for turn in turns {
        for other in turns {
            // Both turned together twice.
            let place = |p: Point| {
                let by = |turn: [Point; 3], p: Point| {
                    turn.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
                };
                by(other, by(turn, p))
            };
            let placed = |of: &[Triangle]| of.iter().map(|triangle| triangle.map(place)).collect::<Vec<_>>();
            for (wall, duct) in [
                (wall.clone(), duct.clone()),
                (inside_out(&wall), duct.clone()),
                (wall.clone(), inside_out(&duct)),
                (inside_out(&wall), inside_out(&duct)),
            ] {
                let (of_duct, of_wall) = (baked(&placed(&duct)), baked(&placed(&wall)));
                let found = intersection(&mut queriers, &of_duct, &of_wall, &Pose::IDENTITY);
                let is_right = found.pierced_b.is_some_and(|thickness| (thickness - 0.2).abs() < 1e-12);
                assert!(is_right, "{turn:?} {other:?} {found:?}");
                let surface = queriers[0].intersection_surface(&of_duct, &of_wall, &Pose::IDENTITY).unwrap();
                // Both sides of the wall have a ring.
                assert_eq!(surface.loops.len() - surface.polygons.len(), 2, "{turn:?} {other:?}");
            }
        }
    }
}

/// Triangles without area beside each other have edges that no other triangle has.
#[test]
fn triangles_without_area_are_no_gaps() {
    let mut queriers = queriers();
    let plain = block([-1.0, -0.5, -0.25], [1.0, 0.5, 0.25]);
    let mut divided = Vec::new();
    for &[p, q, r] in &plain {
        let between = |part: f64| [0, 1, 2].map(|k| p[k] + part * (q[k] - p[k]));
        let (n, m) = (between(0.25), between(0.5));
        divided.extend([[p, m, r], [m, q, r], [p, n, m], [n, q, m], [p, q, n]]);
    }
    let mut random = Random::new(6);
    let duct = pipe(0.2, 0.1, 1.0);
    for round in 0..40 {
        let shift = random.point().map(|x| 0.5 * x);
        let pose = Pose::new([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift).unwrap();
        let [one, two] =
            [&plain, &divided].map(|of| intersection(&mut queriers, &baked(&duct), &baked(of), &pose));
        assert!((one.volume - two.volume).abs() <= 1e-13, "{round} {one:?} {two:?}");
        let same = |x: Option<f64>, y: Option<f64>| match (x, y) {
            (Some(x), Some(y)) => (x - y).abs() < 1e-12,
            (None, None) => true,
            _ => false,
        };
        assert!(
            same(one.pierced_a, two.pierced_a) && same(one.pierced_b, two.pierced_b),
            "{round} {one:?} {two:?}"
        );
    }
}
