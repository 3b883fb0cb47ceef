//! Checks where meshes meet themselves against exact arithmetic with integers, by a method of its own.

use crate::common::shapes::{comb, plate, sphere, torus};
use crate::common::{Random, Triangle, bake, baked, fcl_pair, mesh, note, options, queriers, shared_mesh};
use bvh_bake::Options;
use bvh_bake::mesh::Mesh;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Contact, Pose, Querier, QueryError, SelfContact, SelfContactKind};
use std::collections::BTreeSet;
use std::ops::ControlFlow;

type Vector = [i128; 3];

/// A point with rational coordinates: a vector and the positive number that it is to be divided by.
type Rational = (Vector, i128);

fn minus(p: Vector, q: Vector) -> Vector {
    [0, 1, 2].map(|i| p[i] - q[i])
}

fn cross(p: Vector, q: Vector) -> Vector {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| p[i] * q[j] - p[j] * q[i])
}

fn dot(p: Vector, q: Vector) -> i128 {
    (0..3).map(|i| p[i] * q[i]).sum()
}

fn times(factor: i128, p: Vector) -> Vector {
    p.map(|x| factor * x)
}

fn on_segment((point, w): Rational, p: Vector, q: Vector) -> bool {
    let (to_p, to_q) = (minus(times(w, p), point), minus(times(w, q), point));
    cross(to_p, to_q) == [0; 3] && dot(to_p, to_q) <= 0
}

/// Whether a closed triangle, segment or point contains a point.
fn contains(t: &[Vector; 3], (point, w): Rational) -> bool {
    let normal = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    if normal == [0; 3] {
        return (0..3).any(|i| on_segment((point, w), t[i], t[(i + 1) % 3]));
    }
    let from = |i: usize| minus(point, times(w, t[i]));
    dot(normal, from(0)) == 0 && (0..3).all(|i| dot(normal, cross(minus(t[(i + 1) % 3], t[i]), from(i))) >= 0)
}

/// The points where a line meets the plane of a triangle and the lines of its edges, if these are single points.
fn single_points(p: Vector, q: Vector, t: &[Vector; 3]) -> Vec<Rational> {
    let (along, normal) = (minus(q, p), cross(minus(t[1], t[0]), minus(t[2], t[0])));
    let point = |n: i128, w: i128| {
        let (n, w) = if w < 0 { (-n, -w) } else { (n, w) };
        ([0, 1, 2].map(|i| w * p[i] + n * along[i]), w)
    };
    let mut points = Vec::new();
    if dot(normal, along) != 0 {
        points.push(point(dot(normal, minus(t[0], p)), dot(normal, along)));
    }
    for i in 0..3 {
        let (edge, to) = (minus(t[(i + 1) % 3], t[i]), minus(t[i], p));
        let across = cross(along, edge);
        if across != [0; 3] && dot(to, across) == 0 {
            points.push(point(dot(cross(to, edge), across), dot(across, across)));
        }
    }
    points
}

/// How two triangles meet, by the definition: all extreme points of what they share are in the hull of the common corners.
fn truth(a: &[Vector; 3], b: &[Vector; 3]) -> Option<SelfContactKind> {
    let [of_a, of_b] = [a, b].map(|t| BTreeSet::from(*t));
    if of_a == of_b {
        return Some(SelfContactKind::Duplicate);
    }
    let common: Vec<Vector> = of_a.intersection(&of_b).copied().collect();
    let mut points: Vec<Rational> = a.iter().chain(b).map(|corner| (*corner, 1)).collect();
    for i in 0..3 {
        points.extend(single_points(a[i], a[(i + 1) % 3], b));
        points.extend(single_points(b[i], b[(i + 1) % 3], a));
    }
    let explained = |point| match common[..] {
        [] => false,
        [p] => on_segment(point, p, p),
        [p, q] => on_segment(point, p, q),
        // One of them has no area, and is a segment or a point between its corners.
        _ => (0..3).any(|i| on_segment(point, common[i], common[(i + 1) % 3])),
    };
    let meet = points.into_iter().any(|point| contains(a, point) && contains(b, point) && !explained(point));
    let kinds = [SelfContactKind::Crossing, SelfContactKind::AtCorner, SelfContactKind::Folded];
    meet.then(|| kinds[common.len().min(2)])
}

fn truth_of_mesh(triangles: &[[Vector; 3]]) -> Vec<SelfContact> {
    let mut contacts = Vec::new();
    for (i, a) in triangles.iter().enumerate() {
        for (j, b) in triangles.iter().enumerate().skip(i + 1) {
            if let Some(kind) = truth(a, b) {
                contacts.push(contact(i, j, kind));
            }
        }
    }
    contacts
}

fn contact(a: usize, b: usize, kind: SelfContactKind) -> SelfContact {
    SelfContact { object_a: 0, triangle_a: a as u32, object_b: 0, triangle_b: b as u32, kind }
}

fn in_floats(triangles: &[[Vector; 3]]) -> Vec<Triangle> {
    triangles.iter().map(|t| t.map(|p| p.map(|x| x as f64))).collect()
}

/// Random triangles of a lattice that share many corners, edges and planes; some have no area, and some come twice.
fn lattice(count: usize, size: usize, random: &mut Random) -> Vec<[Vector; 3]> {
    let flat = random.below(3) == 0;
    let mut triangles: Vec<[Vector; 3]> = Vec::new();
    while triangles.len() < count {
        let mut point =
            || [0, 1, 2].map(|axis| if flat && axis == 2 { 0 } else { random.below(size) as i128 });
        let mut triangle = [point(), point(), point()];
        if !triangles.is_empty() {
            let other = triangles[random.below(triangles.len())];
            for corner in &mut triangle {
                if random.below(2) == 0 {
                    *corner = other[random.below(3)];
                }
            }
        }
        triangles.push(triangle);
    }
    triangles
}

fn ask(bvh: &Bvh) -> Vec<SelfContact> {
    let answers: Vec<_> = queriers().iter_mut().map(|querier| querier.self_contacts(bvh).unwrap()).collect();
    assert!(answers.iter().all(|answer| *answer == answers[0]), "backends differ");
    answers.into_iter().next().unwrap()
}

#[test]
fn random_lattices_agree_with_integers() {
    let mut random = Random::new(7);
    let mut kinds = [0; 4];
    for round in 0..400 {
        let triangles = lattice(2 + random.below(40), 2 + random.below(4), &mut random);
        let profile = Profile::ALL[round % Profile::ALL.len()];
        let encoding = [TriangleEncoding::F32, TriangleEncoding::Packed][round / 2 % 2];
        let bvh = bake(&mesh(&in_floats(&triangles)), &options(profile, encoding));
        let truth = truth_of_mesh(&triangles);
        assert_eq!(ask(&bvh), truth, "round {round}: {triangles:?}");
        truth.iter().for_each(|contact| kinds[contact.kind as usize] += 1);
    }
    assert!(kinds.iter().all(|count| *count > 500), "{kinds:?}");
}

#[test]
fn pairs_of_triangles_agree_with_integers() {
    let mut random = Random::new(11);
    let mut querier = Querier::new().unwrap();
    // Far apart, so that only the two of each pair can meet.
    let pairs: Vec<_> = (0..20_000).map(|_| lattice(2, 2 + random.below(4), &mut random)).collect();
    let place = |(at, pair): (usize, &Vec<[Vector; 3]>)| {
        let by = [at % 30, at / 30 % 30, at / 900].map(|x| 16 * x as i128);
        pair.iter().map(move |t| t.map(|p| [0, 1, 2].map(|i| p[i] + by[i]))).collect::<Vec<_>>()
    };
    let all: Vec<_> = pairs.iter().enumerate().flat_map(place).collect();
    let expected: Vec<_> = pairs
        .iter()
        .enumerate()
        .filter_map(|(at, pair)| Some(contact(2 * at, 2 * at + 1, truth(&pair[0], &pair[1])?)))
        .collect();
    assert_eq!(querier.self_contacts(&baked(&in_floats(&all))).unwrap(), expected);
}

/// Corners on a fine lattice, in planes that are missed by a unit of it: what filters in `f32` cannot decide.
#[test]
fn neighbours_almost_in_one_plane_agree_with_integers() {
    let mut random = Random::new(23);
    let mut querier = Querier::new().unwrap();
    let mut all: Vec<[Vector; 3]> = Vec::new();
    let mut expected = Vec::new();
    for at in 0..20_000 {
        let mut near = |wide: i128| {
            let mut step = || random.below(2 * wide as usize + 1) as i128 - wide;
            [step(), step(), step()]
        };
        let add = |p: Vector, q: Vector| [0, 1, 2].map(|i| p[i] + q[i]);
        // Corners of a plane through the origin, moved by at most a unit.
        let (u, v) = (near(1500), near(1500));
        let in_plane = |[i, j, _]: Vector, off: Vector| add(add(times(i, u), times(j, v)), off);
        let mut corner = || in_plane(near(3), near(1));
        let a = [corner(), corner(), corner()];
        let mut b = [corner(), corner(), corner()];
        b[..at % 3].copy_from_slice(&a[..at % 3]);
        if let Some(kind) = truth(&a, &b) {
            expected.push(contact(2 * at, 2 * at + 1, kind));
        }
        let by = [at % 30, at / 30 % 30, at / 900].map(|x| 32_768 * x as i128);
        all.extend([a, b].map(|t| t.map(|p| add(p, by))));
    }
    assert_eq!(querier.self_contacts(&baked(&in_floats(&all))).unwrap(), expected);
    assert!(querier.stats().exact_tests > 1000, "{:?}", querier.stats());
}

#[test]
fn answers_follow_the_mesh() {
    let mut random = Random::new(3);
    for _ in 0..40 {
        let triangles = lattice(30, 4, &mut random);
        let expected = truth_of_mesh(&triangles);
        let floats = in_floats(&triangles);
        let change = |f: &dyn Fn([f64; 3]) -> [f64; 3]| -> Vec<Triangle> {
            floats.iter().map(|t| [2, 0, 1].map(|i| f(t[i]))).collect()
        };
        let changed = [
            change(&|[x, y, z]| [y, z, x]),
            change(&|[x, y, z]| [-x, y, z]),
            change(&|p| p.map(|x| x * 2f64.powi(-90))),
            change(&|p| p.map(|x| x * 2f64.powi(100))),
            change(&|p| p.map(|x| x + 123_456_789.0)),
            // So small beside another part of the mesh that products underflow.
            [change(&|p| p.map(|x| x * 2f64.powi(-130))), vec![[[1.0; 3], [2.0; 3], [2.0, 1.0, 2.0]]]]
                .concat(),
            change(&|[x, y, z]| [x, x + y, x + y + z]),
        ];
        for (number, triangles) in changed.iter().enumerate() {
            assert_eq!(ask(&baked(triangles)), expected, "change {number}");
        }
        let reversed: Vec<_> = triangles.iter().rev().copied().collect();
        assert_eq!(ask(&baked(&in_floats(&reversed))), truth_of_mesh(&reversed));
    }
}

#[test]
fn objects_of_a_file_meet_each_other_and_themselves() {
    let mut random = Random::new(5);
    for _ in 0..30 {
        let triangles = lattice(24, 4, &mut random);
        let mut whole = mesh(&in_floats(&triangles[..12]));
        whole.objects.extend(mesh(&in_floats(&triangles[12..])).objects);
        whole.objects[1].triangle_ids = (12..24).collect();
        let bvh = bake(&whole, &Options::default().split_objects(true));
        let of = |id: u32| u32::from(id >= 12);
        let truth: Vec<_> = truth_of_mesh(&triangles)
            .into_iter()
            .map(|c| SelfContact { object_a: of(c.triangle_a), object_b: of(c.triangle_b), ..c })
            .collect();
        assert_eq!(ask(&bvh), truth);
        let mut querier = Querier::new().unwrap();
        let second = querier.self_contacts(bvh.object(1).unwrap()).unwrap();
        assert!(second.iter().eq(truth.iter().filter(|c| (c.object_a, c.object_b) == (1, 1))));
    }
}

#[test]
fn good_meshes_do_not_meet_themselves() {
    for triangles in [sphere(3), torus(40, 20), plate(20), vec![comb(2)[0]]] {
        assert_eq!(ask(&baked(&triangles)), []);
    }
}

/// Named cases: the corners of two triangles, and how they meet.
#[test]
fn small_cases() {
    let (o, x, y, z) = ([0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]);
    let half = [2, 0, 0];
    let cases: &[([Vector; 3], [Vector; 3], Option<SelfContactKind>)] = &[
        ([o, x, y], [o, x, z], None),
        ([o, x, y], [o, x, [0, -4, 0]], None),
        ([o, x, y], [o, x, [1, 1, 0]], Some(SelfContactKind::Folded)),
        ([o, x, y], [x, o, [4, 4, 0]], Some(SelfContactKind::Folded)),
        ([o, x, y], [y, o, x], Some(SelfContactKind::Duplicate)),
        ([o, x, y], [o, y, x], Some(SelfContactKind::Duplicate)),
        ([o, x, y], [o, [-1, 0, 0], [0, -1, 0]], None),
        ([o, x, y], [o, [1, 1, 1], [1, 1, -1]], Some(SelfContactKind::AtCorner)),
        ([o, x, y], [o, [-1, -1, 1], [-1, -1, -1]], None),
        // A corner that is missing on the other side of an edge.
        ([o, x, y], [o, half, [2, -2, 0]], Some(SelfContactKind::AtCorner)),
        ([o, x, y], [half, [2, -2, 0], [3, -2, 1]], Some(SelfContactKind::Crossing)),
        // Without area: along an edge, beyond it, a corner, and two equal points.
        ([o, x, y], [o, half, x], None),
        ([o, x, y], [o, x, [5, 0, 0]], None),
        ([o, x, y], [half, half, half], Some(SelfContactKind::Crossing)),
        ([o, x, y], [o, o, o], None),
        ([o, x, y], [o, o, [1, 1, 0]], Some(SelfContactKind::AtCorner)),
        ([o, o, x], [o, x, x], Some(SelfContactKind::Duplicate)),
        ([o, half, x], [o, half, [3, 0, 0]], Some(SelfContactKind::Folded)),
        ([z, z, z], [z, z, z], Some(SelfContactKind::Duplicate)),
    ];
    for (a, b, expected) in cases {
        assert_eq!(truth(a, b), *expected, "{a:?} {b:?}");
        let found = ask(&baked(&in_floats(&[*a, *b])));
        assert_eq!(found.first().map(|contact| contact.kind), *expected, "{a:?} {b:?}");
    }
    let zeros = [
        [[0.0, -0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[-0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    ];
    assert_eq!(ask(&baked(&zeros)), []);
}

#[test]
fn real_meshes_agree_with_contacts() {
    agree_with_contacts(fcl_pair());
}

#[test]
#[ignore = "needs ../shared"]
fn larger_real_meshes_agree_with_contacts() {
    agree_with_contacts(["hand.obj", "nao.obj", "bunny.obj", "apollo.obj", "piano.obj"].map(shared_mesh));
}

/// Of real meshes, pairs without a common corner are those that the pair walk finds for a copy in the same place.
fn agree_with_contacts<const N: usize>(meshes: [Mesh; N]) {
    let mut total = 0;
    for bvh in meshes.map(|mesh| bake(&mesh, &Options::default())) {
        let mut corners = vec![[[0.0; 3]; 3]; bvh.all().triangles() as usize * 3];
        bvh.all().visit_triangles(|id, triangle| corners[id as usize] = triangle).unwrap();
        let apart = |contact: &&Contact| {
            let (a, b) = (&corners[contact.triangle_a as usize], &corners[contact.triangle_b as usize]);
            contact.triangle_a < contact.triangle_b && !a.iter().any(|corner| b.contains(corner))
        };
        let found = ask(&bvh);
        let crossing = found.iter().filter(|contact| contact.kind == SelfContactKind::Crossing);
        let pairs: Vec<_> = crossing.map(|contact| (contact.triangle_a, contact.triangle_b)).collect();
        let contacts = Querier::new().unwrap().contacts(&bvh, &bvh, &Pose::IDENTITY).unwrap();
        let expected: Vec<_> = contacts.iter().filter(apart).map(|c| (c.triangle_a, c.triangle_b)).collect();
        assert!(pairs == expected, "{} {}", pairs.len(), expected.len());
        note(&format!("{} contacts of {} triangles", found.len(), bvh.all().triangles()));
        total += pairs.len();
    }
    assert!(total > 0, "no mesh crosses itself");
}

#[test]
fn coincident_triangles_end_with_a_limit_or_a_budget() {
    const COUNT: u32 = 1_000_000;
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let indices = (0..COUNT).map(|n| [n % 3, (n + 1) % 3, (n + 2) % 3]).collect();
    let bvh = bake(&Mesh::from_triangles(corners, indices), &Options::default());
    let mut querier = Querier::new().unwrap();
    let mut left = 1000;
    let visits = querier.visit_self_contacts(&bvh, |contact| {
        assert_eq!(contact.kind, SelfContactKind::Duplicate);
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(visits.unwrap(), 1000);
    querier.set_budget(5000);
    assert_eq!(querier.self_contacts(&bvh), Err(QueryError::Budget { visits: 5000 }));
    // All of them meet, and none is the same as another.
    let fan = |n: usize| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [n as f64, 1.0, 0.0]];
    let fans: Vec<Triangle> = (0..2000).map(fan).collect();
    assert_eq!(querier.self_contacts(&baked(&fans)), Err(QueryError::Budget { visits: 5000 }));
    querier.set_budget(u64::MAX);
    assert_eq!(querier.self_contacts(&baked(&fans)).unwrap().len(), 2000 * 1999 / 2);
    assert_eq!(querier.self_contacts(&baked(&fans[..1])).unwrap(), []);
}
