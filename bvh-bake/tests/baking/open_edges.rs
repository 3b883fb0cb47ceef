//! The open edges of files: how many there are of each kind, which come first, and how near they are to each other. Brute force on
//! the input's triangles is the oracle.

use super::mesh;
use super::weld::three_js_sphere;
use bvh_bake::{
    BakeError, FileBake, OpenEdges, Options, Outcome, StoredFile, VerifyOptions, open_edges, to_bytes,
};
use bvh_format::Layout;
use bvh_format::open_edges::{MAX_LISTED, MAX_LISTED_TRIANGLES};
use bvh_format::validate::validate;
use cbvh_testkit::ball::ball;
use cbvh_testkit::stored::stored;
use cbvh_testkit::{Random, Triangle, folder, pool};
use std::collections::BTreeMap;

type Point = [u64; 3];

/// An open edge by brute force: how many triangles it has, the smallest numbers of some, and its ends.
#[derive(Debug, PartialEq, Clone)]
struct Open {
    triangles: Vec<u32>,
    count: usize,
    ends: [[f64; 3]; 2],
}

/// Returns the open edges of triangles, by the first triangle and then by the bits of their ends.
fn brute_force(triangles: &[Triangle]) -> Vec<Open> {
    let bits = |triangle: &Triangle| triangle.map(|corner| corner.map(|value| (value + 0.0).to_bits()));
    // The net of each set of equal triangles, by the rotation that starts at the least corner, and the first triangle.
    let mut nets: BTreeMap<[Point; 3], (u32, i64, [Point; 3])> = BTreeMap::new();
    for (number, triangle) in (0..).zip(triangles) {
        let own = bits(triangle);
        let mut key = own;
        key.sort_unstable();
        let rotations = |[a, b, c]: [Point; 3]| [[a, b, c], [b, c, a], [c, a, b]];
        let (_, net, first) = nets.entry(key).or_insert((number, 0, own));
        *net += if rotations(*first).contains(&own) { 1 } else { -1 };
    }
    let mut edges: BTreeMap<[Point; 2], (i64, usize, Vec<u32>)> = BTreeMap::new();
    for (number, net, [a, b, c]) in nets.into_values() {
        let ways = [(a, b), (b, c), (c, a)];
        if ways.iter().all(|(from, to)| from != to) && net != 0 {
            for (from, to) in ways {
                let (sum, count, of) = edges.entry([from.min(to), from.max(to)]).or_default();
                *sum += if from < to { net } else { -net };
                *count += net.unsigned_abs() as usize;
                of.push(number);
            }
        }
    }
    let open = edges.into_iter().filter(|(_, (sum, ..))| *sum != 0);
    let mut open: Vec<Open> = open
        .map(|([a, b], (sum, count, mut triangles))| {
            triangles.sort_unstable();
            triangles.truncate(MAX_LISTED_TRIANGLES);
            let ends = if sum > 0 { [a, b] } else { [b, a] };
            Open { triangles, count, ends: ends.map(|end| end.map(f64::from_bits)) }
        })
        .collect();
    open.sort_by_key(|edge| edge.triangles[0]);
    open
}

/// Returns the least distance within which both ends of two edges are near each other.
fn gap(a: &Open, b: &Open) -> f64 {
    let far = |p: [f64; 3], q: [f64; 3]| (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>().sqrt();
    let ([p, q], [r, s]) = (a.ends, b.ends);
    far(p, r).max(far(q, s)).min(far(p, s).max(far(q, r)))
}

/// Compares the open edges of a file with brute force. Coordinates must be stored as they are.
fn compare(name: &str, found: &OpenEdges, triangles: &[Triangle]) {
    let expected = brute_force(triangles);
    let mut counts = [0, 0, 0];
    for ((kind, of_kind), number) in found.kinds().into_iter().zip(0..) {
        let own = expected.iter().filter(|edge| edge.count.min(3) == number + 1);
        counts[number] = own.clone().count() as u64;
        assert_eq!(of_kind.count, counts[number], "{name}, {kind}");
        assert_eq!(of_kind.first.len(), own.clone().count().min(MAX_LISTED));
        for (edge, expected) in of_kind.first.iter().zip(own) {
            assert_eq!((&edge.triangles, edge.ends), (&expected.triangles, expected.ends), "{name}, {kind}");
            let others = expected_gap(&expected_others(expected, &brute_force(triangles)), expected);
            assert_eq!(edge.gap, others.filter(|_| number == 0), "{name}, {kind}");
        }
    }
    assert_eq!((found.count(), found.is_empty()), (counts.iter().sum(), expected.is_empty()));
    let gaps: Vec<(f64, f64)> = expected
        .iter()
        .filter(|edge| edge.count == 1)
        .filter_map(|edge| {
            let [a, b] = edge.ends;
            let length = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
            Some((expected_gap(&expected_others(edge, &expected), edge)?, length))
        })
        .collect();
    let cracks = || gaps.iter().filter(|(gap, length)| *gap < 0.01 * length).map(|(gap, _)| *gap);
    assert_eq!(found.gaps.nearest, gaps.iter().map(|(gap, _)| *gap).reduce(f64::min), "{name}");
    assert_eq!(
        (found.gaps.cracks, found.gaps.widest_crack),
        (cracks().count() as u64, cracks().reduce(f64::max))
    );
}

fn expected_others(edge: &Open, all: &[Open]) -> Vec<Open> {
    all.iter().filter(|other| *other != edge).cloned().collect()
}

fn expected_gap(others: &[Open], edge: &Open) -> Option<f64> {
    others.iter().map(|other| gap(edge, other)).reduce(f64::min)
}

/// Bakes triangles, and compares what the bake, the file and stored files say with brute force.
fn check(name: &str, triangles: &[Triangle]) -> OpenEdges {
    let (bytes, report) = to_bytes(&mesh(triangles), &Options::default()).unwrap();
    let found = report.open_edges.unwrap();
    compare(name, &found, triangles);
    assert_eq!(found.is_empty(), report.file.closed == Some(1), "{name}");
    let layout = validate(&bytes).unwrap();
    let scratch = folder();
    // With little memory, runs are in files.
    let little = VerifyOptions::default().max_memory(1 << 12).scratch(scratch.path().to_owned());
    for options in [VerifyOptions::default(), little] {
        for threads in [1, 2] {
            let again = pool(threads).install(|| open_edges(&layout, &bytes[..], &options).unwrap());
            assert_eq!(again, found, "{name}");
        }
    }
    // Without ids, triangles are named by their places.
    let (bytes, report) = to_bytes(&mesh(triangles), &Options::default().ids(false)).unwrap();
    let places: BTreeMap<u32, Triangle> = stored(&bytes).iter().map(|of| (of.place, of.corners)).collect();
    let unnamed = report.open_edges.unwrap();
    assert_eq!(unnamed.count(), found.count(), "{name}");
    for edge in unnamed.kinds().iter().flat_map(|(_, of_kind)| &of_kind.first) {
        assert!(edge.triangles.iter().all(|place| edge.ends.iter().all(|end| places[place].contains(end))));
    }
    found
}

#[test]
fn kinds_of_open_edges_are_told_apart() {
    let (positions, indices) = ball(2000);
    let narrow = |index: u32| positions[index as usize].map(|c| f64::from(c as f32));
    let sphere: Vec<Triangle> = indices.iter().map(|triangle| triangle.map(narrow)).collect();
    assert!(check("closed", &sphere).is_empty());
    let hole = check("hole", &sphere[1..]);
    assert_eq!((hole.boundary.count, hole.count(), hole.gaps.cracks), (3, 3, 0));
    assert_eq!(hole.proposed_weld(), None);
    assert!(hole.to_string().starts_with("3 edges have one triangle; the nearest gap is "), "{hole}");
    assert!(hole.to_string().ends_with("and no crack"), "{hole}");
    let mut turned = sphere.clone();
    turned[7].swap(0, 1);
    let turned = check("turned", &turned);
    assert_eq!((turned.flipped.count, turned.count()), (3, 3));
    assert_eq!(turned.to_string(), "3 edges have two triangles that face opposite ways");
    assert!(turned.flipped.first.iter().all(|edge| edge.triangles.contains(&7)));
    let fin = [&sphere[..], &[[sphere[0][0], sphere[0][1], [2.0; 3]]]].concat();
    let fin = check("fin", &fin);
    assert_eq!((fin.crowded.count, fin.boundary.count), (1, 2));
    assert_eq!(fin.crowded.first[0].triangles.len(), 3);
    // Duplicates count with their orientation: a wall given twice adds nothing, and a triangle given twice has two.
    let again = [&sphere[..], &sphere[3..4]].concat();
    assert_eq!(check("twice", &again).crowded.count, 3);
    let wall = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
    let [a, b, c] = wall(5.0);
    assert!(check("both sides", &[wall(5.0), [b, a, c]]).is_empty());
    assert_eq!(check("twice alone", &[wall(5.0), [b, c, a]]).flipped.count, 3);
    let open = check("wall and sheet", &[wall(5.0), [b, a, c], wall(0.0)]);
    assert_eq!((open.boundary.count, open.boundary.first[0].triangles[0]), (3, 2));
    let flat = check("triangles without area", &[wall(0.0), [a, a, b], [a, a, a], [a, [0.5, 0.0, 5.0], b]]);
    assert_eq!(flat.boundary.count, 6);
}

/// Random triangles over few vertices share edges in all ways.
#[test]
fn crowded_meshes_agree_with_brute_force() {
    let mut random = Random::new(17);
    let mut totals = [0; 3];
    for round in 0..150 {
        let points: Vec<[f64; 3]> = (0..4 + round % 9)
            .map(|_| {
                [(); 3]
                    .map(|()| random.below(3) as f64 + f64::from(round % 3) * random.below(2) as f64 * 0.125)
            })
            .collect();
        let mut point = || points[random.below(points.len())];
        let triangles: Vec<Triangle> = (0..1 + round % 50).map(|_| [(); 3].map(|()| point())).collect();
        let found = check(&format!("round {round}"), &triangles);
        for ((_, of_kind), total) in found.kinds().iter().zip(&mut totals) {
            *total += of_kind.count;
        }
    }
    assert!(totals.iter().all(|&total| total > 300), "{totals:?}");
}

/// More triangles than a page and a brick hold, most of them loose, within a budget and without one.
#[test]
fn large_open_meshes_agree_with_brute_force() {
    let (positions, indices) = ball(300_000);
    let narrow = |index: u32| positions[index as usize].map(|c| f64::from(c as f32));
    let mut triangles: Vec<Triangle> = indices.iter().map(|triangle| triangle.map(narrow)).collect();
    triangles.retain({
        let mut number = 0;
        move |_| {
            number += 1;
            number % 1000 != 1
        }
    });
    triangles[500].swap(0, 1);
    let expected = brute_force(&triangles);
    let folder = folder();
    let (input, output) = (folder.path().join("open.obj"), folder.path().join("open.cbvh"));
    super::weld::write(&input, &triangles);
    let mut all = Vec::new();
    for memory in [None, Some(128 << 20)] {
        let bake = FileBake::new([&input], &output).force(true).max_memory(memory);
        let Outcome::Baked(report) = bake.run().unwrap() else { panic!() };
        let found = report.open_edges.unwrap();
        for ((_, of_kind), number) in found.kinds().into_iter().zip(1..) {
            assert_eq!(
                of_kind.count as usize,
                expected.iter().filter(|edge| edge.count.min(3) == number).count()
            );
        }
        assert!(found.boundary.count > 800 && found.flipped.count == 3 && found.crowded.count == 0);
        all.push(found);
    }
    let file = StoredFile::open(&output, None).unwrap();
    let layout = Layout::read_from(&file).unwrap();
    let little = VerifyOptions::default().max_memory(1 << 20).scratch(folder.path().to_owned());
    all.push(open_edges(&layout, &file, &little).unwrap());
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
}

/// What is proposed closes the sphere, and the errors of a solid say so.
#[test]
fn the_proposed_weld_closes_a_sphere() {
    for (columns, rows) in [(8, 6), (32, 16), (101, 50)] {
        let sphere = three_js_sphere(columns, rows);
        let (_, report) = to_bytes(&sphere, &Options::default()).unwrap();
        let open = report.open_edges.unwrap();
        assert!(open.boundary.count >= u64::from(2 * (rows - 2)) && open.count() == open.boundary.count);
        assert_eq!(open.gaps.cracks, open.boundary.count);
        let weld = open.proposed_weld().unwrap();
        assert!((1e-16..1e-12).contains(&weld), "{weld:e}");
        let (_, report) = to_bytes(&sphere, &Options::default().weld(weld)).unwrap();
        assert_eq!((report.file.closed, report.open_edges), (Some(1), Some(OpenEdges::default())));
        let refused = to_bytes(&sphere, &Options::default().solid(true)).unwrap_err();
        let BakeError::NotClosed { edges, .. } = &refused else { panic!("{refused}") };
        assert_eq!(**edges, open);
        let text = refused.to_string();
        assert!(text.contains(&format!("{} edges have one triangle; ", open.boundary.count)), "{text}");
        assert!(text.contains(&format!("bake with --weld {weld:e}")), "{text}");
    }
    // A file that does not state which objects are closed has nothing to explain.
    let (_, report) = to_bytes(&three_js_sphere(8, 6), &Options::default().topology(false)).unwrap();
    assert_eq!(report.open_edges, None);
}
