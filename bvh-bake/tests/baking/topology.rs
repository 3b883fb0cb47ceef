//! What a file states about its surfaces: which objects are closed, a triangle of each component, and how often
//! triangles with duplicates count. Brute force on the input's triangles is the oracle.

use super::mesh;
use bvh_bake::mesh::{Mesh, Object};
use bvh_bake::{Options, StoredFile, to_bytes};
use bvh_format::Layout;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::validate::validate;
use cbvh_testkit::ball::ball;
use cbvh_testkit::seal::{put_together, take_apart};
use cbvh_testkit::stored::stored;
use cbvh_testkit::{Random, Triangle};
use std::collections::{BTreeMap, BTreeSet, HashMap};

type Point = [u32; 3];

fn bake(mesh: &Mesh, options: &Options) -> Vec<u8> {
    to_bytes(mesh, options).unwrap_or_else(|error| panic!("{error}")).0
}

/// The triangles of a ball.
fn ball_of(triangles: u64, centre: [f64; 3], radius: f64) -> Vec<Triangle> {
    let (positions, indices) = ball(triangles);
    let at = |index: u32| [0, 1, 2].map(|axis| centre[axis] + radius * positions[index as usize][axis]);
    indices.iter().map(|triangle| triangle.map(at)).collect()
}

fn turned(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|&[a, b, c]| [b, a, c]).collect()
}

/// An object of a file: what it states, and its triangles by place, each with its id.
struct Stated {
    closed: bool,
    components: Vec<u32>,
    nets: BTreeMap<u32, i32>,
    triangles: BTreeMap<u32, (u32, [Point; 3])>,
}

fn stated(bytes: &[u8], number: usize) -> Stated {
    let layout = validate(bytes).unwrap();
    let stored = stored(bytes).into_iter().filter(|triangle| triangle.object as usize == number);
    let bits = |values: [[f32; 3]; 3]| values.map(|corner| corner.map(f32::to_bits));
    let triangles = stored.map(|triangle| (triangle.place, (triangle.id, bits(triangle.values)))).collect();
    let topology = &layout.check_topology(bytes).unwrap()[number];
    Stated {
        closed: topology.closed,
        components: topology.components(bytes).iter().map(|place| place.get()).collect(),
        nets: topology.nets(bytes).iter().map(|net| (net.place.get(), net.net.get())).collect(),
        triangles,
    }
}

/// Returns the net of each set of equal triangles, by the rotation of their corners that starts at the least one.
fn nets_of(triangles: &[[Point; 3]]) -> HashMap<[Point; 3], i64> {
    let mut nets = HashMap::new();
    for &[a, b, c] in triangles {
        let first = |triangle: [[Point; 3]; 3]| triangle.into_iter().min().unwrap();
        let own = first([[a, b, c], [b, c, a], [c, a, b]]);
        let other = first([[b, a, c], [a, c, b], [c, b, a]]);
        *nets.entry(own).or_insert(0) += 1;
        if other != own {
            *nets.entry(other).or_insert(0) -= 1;
        }
    }
    nets
}

/// Returns the edges of a triangle between two vertices, the lesser one first, and whether each starts there.
fn edges([a, b, c]: &[Point; 3]) -> Vec<([Point; 2], bool)> {
    let ways = [(*a, *b), (*b, *c), (*c, *a)].into_iter().filter(|(from, to)| from != to);
    ways.map(|(from, to)| ([from.min(to), from.max(to)], from < to)).collect()
}

fn is_closed(triangles: &[[Point; 3]]) -> bool {
    let mut all: Vec<_> = triangles.iter().flat_map(edges).collect();
    all.sort_unstable();
    let of_edge = all.chunk_by(|a, b| a.0 == b.0);
    of_edge.into_iter().all(|edge| 2 * edge.iter().filter(|(_, starts)| *starts).count() == edge.len())
}

/// Returns the places of each edge-connected component.
fn components_of(triangles: &BTreeMap<u32, (u32, [Point; 3])>) -> Vec<BTreeSet<u32>> {
    let of = |(place, (_, corners)): (&u32, &(u32, _))| {
        edges(corners).into_iter().map(|(edge, _)| (edge, *place)).collect::<Vec<_>>()
    };
    let mut all: Vec<_> = triangles.iter().flat_map(of).collect();
    all.sort_unstable();
    let mut left: BTreeSet<u32> = triangles.keys().copied().collect();
    let mut components = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut component, mut next) = (BTreeSet::from([first]), vec![first]);
        while let Some(place) = next.pop() {
            for (edge, _) in edges(&triangles[&place].1) {
                let with_edge = &all[all.partition_point(|(other, _)| *other < edge)..];
                let found = with_edge.iter().take_while(|(other, _)| *other == edge).map(|(_, place)| *place);
                let new: Vec<u32> = found.filter(|place| left.remove(place)).collect();
                component.extend(&new);
                next.extend(new);
            }
        }
        components.push(component);
    }
    components
}

/// Compares what a file states with the triangles of the input, whose coordinates are stored as they are. `exact` says
/// that edges are those of at most two triangles, so that each component is listed once.
fn compare(name: &str, input: &[Triangle], bytes: &[u8], exact: bool) -> Stated {
    let stated = stated(bytes, 0);
    let origin = Layout::read(bytes).unwrap().objects[0].origin();
    let bits =
        |corner: [f64; 3]| [0, 1, 2].map(|axis| ((corner[axis] - origin[axis]) as f32 + 0.0).to_bits());
    let input: Vec<[Point; 3]> = input.iter().map(|triangle| triangle.map(bits)).collect();
    assert_eq!(stated.closed, is_closed(&input), "{name}");
    let nets = nets_of(&input);
    for (place, (id, [a, b, c])) in &stated.triangles {
        let own = [[*a, *b, *c], [*b, *c, *a], [*c, *a, *b]].into_iter().min().unwrap();
        let net = stated.nets.get(place).copied().unwrap_or(1);
        assert_eq!(i64::from(net), nets[&own], "{name}: triangle {id}");
    }
    assert!(stated.nets.iter().all(|(place, &net)| net != 1 && stated.triangles.contains_key(place)));
    assert!(stated.components.is_sorted_by(|a, b| a < b), "{name}");
    let components = components_of(&stated.triangles);
    if stated.components.is_empty() {
        assert!(components.len() > 64 || !exact, "{name}: {} components", components.len());
    } else {
        let listed: BTreeSet<u32> = stated.components.iter().copied().collect();
        assert!(components.iter().all(|places| places.first().is_some_and(|least| listed.contains(least))));
        assert!(listed.iter().all(|place| stated.triangles.contains_key(place)));
        assert!(!exact || listed.len() == components.len(), "{name}: {} {}", listed.len(), components.len());
    }
    stated
}

fn check(name: &str, input: &[Triangle], exact: bool) -> Stated {
    compare(name, input, &bake(&mesh(input), &Options::default()), exact)
}

const ORIGIN: [f64; 3] = [0.0; 3];

#[test]
fn surfaces_of_all_kinds_are_told_apart() {
    let sphere = ball_of(3000, ORIGIN, 1.0);
    let whole = check("sphere", &sphere, true);
    assert!(whole.closed && whole.components.len() == 1 && whole.nets.is_empty());
    assert!(!check("hole", &sphere[1..], true).closed);
    let mut flipped = sphere.clone();
    flipped[7].swap(0, 1);
    assert!(!check("flipped triangle", &flipped, true).closed);
    let shell = [sphere.clone(), turned(&ball_of(500, ORIGIN, 0.5))].concat();
    let nested = check("nested", &shell, true);
    assert!(nested.closed && nested.components.len() == 2);
    // A vertex in the middle of an edge of one side leaves a gap of no width.
    let [a, b, c] = sphere[0];
    let middle = [0, 1, 2].map(|axis| (a[axis] + b[axis]) / 2.0);
    let split = [&sphere[1..], &[[a, middle, c], [middle, b, c]]].concat();
    assert!(!check("T-junction", &split, true).closed);
    let slit = [&split[..], &[[a, b, middle]]].concat();
    assert!(check("T-junction that a triangle without area closes", &slit, true).closed);
    let point = [&sphere[..], &[[a, a, a], [a, a, b], [b, c, c]]].concat();
    assert!(check("triangles without area", &point, false).closed);
    assert!(check("point", &[[a; 3]], true).closed);
    assert!(check("segments", &[[a, a, b], [a, b, b], [b, a, b]], false).closed);
    assert!(!check("triangle", &sphere[..1], true).closed);
}

#[test]
fn duplicates_count_by_their_orientations() {
    let sphere = ball_of(1000, ORIGIN, 1.0);
    let all = |stated: &Stated, net: i32| {
        stated.nets.len() == sphere.len() && stated.nets.values().all(|&n| n == net)
    };
    let twice = check("twice", &[sphere.clone(), sphere.clone()].concat(), true);
    assert!(twice.closed && all(&twice, 2));
    let cancelled = check("and reversed", &[sphere.clone(), turned(&sphere)].concat(), true);
    assert!(cancelled.closed && all(&cancelled, 0));
    let minus =
        check("and twice reversed", &[sphere.clone(), turned(&sphere), turned(&sphere)].concat(), true);
    assert!(minus.closed && all(&minus, -1));
    assert!(!check("a triangle twice", &[&sphere[..], &sphere[3..4]].concat(), true).closed);
    let reversed = [&sphere[..], &turned(&sphere[3..4])].concat();
    assert!(!check("a triangle and its reverse", &reversed, true).closed);
    let three = [&sphere[..], &turned(&sphere[3..4]), &sphere[3..4]].concat();
    let three = check("a triangle three times", &three, true);
    assert!(three.closed && three.nets.is_empty());
    // Two cells share a wall, which is given once for each of them and adds nothing to the whole.
    let [o, x, y, z, w] = [ORIGIN, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let above = [[o, y, x], [o, x, z], [x, y, z], [y, o, z]];
    let below = [[o, x, y], [x, o, w], [y, x, w], [o, y, w]];
    let cells = check("wall", &[above, below].concat(), false);
    assert!(cells.closed && cells.nets.values().eq([&0]));
}

/// Random triangles over few vertices share edges in all ways.
#[test]
fn crowded_meshes_agree_with_brute_force() {
    let mut random = Random::new(5);
    let mut closed = 0;
    for round in 0..400 {
        let points: Vec<[f64; 3]> =
            (0..4 + round % 9).map(|_| [(); 3].map(|()| random.below(3) as f64 - 1.0)).collect();
        let mut point = || points[random.below(points.len())];
        let count = 1 + round % 50;
        let mut triangles: Vec<Triangle> = (0..count).map(|_| [(); 3].map(|()| point())).collect();
        if round % 2 == 0 {
            // The boundary of tetrahedra is closed, however they meet.
            triangles = (0..1 + count / 8).map(|_| [(); 4].map(|()| point())).flat_map(tetrahedron).collect();
        }
        closed += usize::from(check(&format!("round {round}"), &triangles, false).closed);
    }
    assert!((200..300).contains(&closed), "{closed}");
}

fn tetrahedron([a, b, c, d]: [[f64; 3]; 4]) -> [Triangle; 4] {
    [[a, c, b], [a, b, d], [b, c, d], [c, a, d]]
}

#[test]
fn components_are_listed_unless_they_are_many() {
    let mut random = Random::new(9);
    let mut cells = |count: usize, triangles: u64| -> Vec<Triangle> {
        let mut one = |_| ball_of(triangles, random.point().map(|c| 100.0 * c), 0.25);
        (0..count).flat_map(&mut one).collect()
    };
    for (count, triangles, listed) in [(64, 8, 64), (65, 8, 0), (130, 112, 130), (70, 84, 0)] {
        let stated = check(&format!("{count} of {triangles}"), &cells(count, triangles), true);
        assert_eq!((stated.closed, stated.components.len()), (true, listed), "{count} of {triangles}");
    }
    let soup = cells(500, 8).into_iter().step_by(8).collect::<Vec<_>>();
    assert!(!check("soup", &soup, true).closed);
}

#[test]
fn negative_zeros_are_zeros() {
    let [o, x, y, z] = [[-0.0; 3], [1.0, 0.0, -0.0], [-0.0, 1.0, 0.0], [0.0, -0.0, 1.0]];
    let mut triangles = tetrahedron([o, x, y, z]);
    triangles[2] = triangles[2].map(|corner| corner.map(|c| c + 0.0));
    let stated = check("zeros", &triangles, true);
    assert!(stated.closed && stated.components.len() == 1);
}

/// More triangles than a brick holds: edges between bricks, and parts that only together are components.
#[test]
fn shells_of_several_bricks_agree_with_brute_force() {
    let outer = ball_of(280_000, ORIGIN, 1.0);
    let inner = turned(&ball_of(20_000, [0.1, 0.0, 0.0], 0.5));
    let shells = [outer.clone(), inner.clone(), outer[..9].to_vec(), turned(&outer[..9])].concat();
    let stated = check("shells", &shells, true);
    assert!(stated.closed && stated.components.len() == 2 && stated.nets.is_empty());
    assert!(!check("hole", &shells[1..outer.len()], true).closed);
    let stated = check("duplicates", &[outer, inner.clone(), turned(&inner), turned(&inner)].concat(), true);
    assert!(stated.closed && stated.nets.len() == inner.len() && stated.nets.values().all(|&net| net == -1));
}

/// A strip that leads through several bricks, and the same strip with its back.
#[test]
fn strips_of_several_bricks_agree_with_brute_force() {
    let mut strip = Vec::new();
    for x in (0..140_000).map(f64::from) {
        let [a, b, c, d] = [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0], [x + 1.0, 1.0, 0.0]];
        strip.extend([[a, b, c], [b, d, c]]);
    }
    let stated = check("strip", &strip, true);
    assert!(!stated.closed && stated.components.len() == 1);
    let doubled = check("with its back", &[strip.clone(), turned(&strip)].concat(), true);
    assert!(doubled.closed && doubled.nets.len() == strip.len() && doubled.components.len() == 1);
}

/// Quantised corners may coincide or part; the file is about the corners that it stores.
#[test]
fn what_is_quantized_is_what_is_stored() {
    let sphere = ball_of(2000, ORIGIN, 1.0);
    for max_error in [1e-5, 1e-2] {
        let options = Options::default().triangles(TriangleEncoding::Quantized).max_error(max_error);
        let bytes = bake(&mesh(&sphere), &options);
        let stated = stated(&bytes, 0);
        assert!(stated.closed, "{max_error}");
        let components = components_of(&stated.triangles);
        let listed: BTreeSet<u32> = stated.components.iter().copied().collect();
        assert!(components.iter().all(|places| places.first().is_some_and(|least| listed.contains(least))));
        let stored: Vec<[Point; 3]> = stated.triangles.values().map(|(_, corners)| *corners).collect();
        assert!(is_closed(&stored) || !stated.nets.is_empty());
    }
}

#[test]
fn each_object_of_a_file_is_stated() {
    let object = |name: &str, triangles: &[Triangle], first: u32| {
        let one = mesh(triangles).objects.remove(0);
        let triangle_ids = (first..).take(triangles.len()).collect();
        Object { name: name.to_owned(), triangle_ids, ..one }
    };
    let sphere = ball_of(500, ORIGIN, 1.0);
    let open = object("open", &sphere[2..], 0);
    let closed = object("closed", &sphere, 1000);
    let doubled = object("doubled", &[sphere.clone(), sphere.clone()].concat(), 2000);
    let mesh = Mesh { objects: vec![open, closed, doubled], ..Mesh::default() };
    let bytes = bake(&mesh, &Options::default().split_objects(true));
    let found = [0, 1, 2].map(|number| {
        let Stated { closed, components, nets, .. } = stated(&bytes, number);
        (closed, components, nets.len())
    });
    assert_eq!(found, [(false, vec![0], 0), (true, vec![0], 0), (true, vec![0], sphere.len())]);
    let without = bake(&mesh, &Options::default().split_objects(true).topology(false));
    assert!(!Layout::read(&without).unwrap().has_topology());
}

#[test]
fn threads_do_not_matter() {
    let shells = [ball_of(300_000, ORIGIN, 1.0), turned(&ball_of(2000, ORIGIN, 0.5))].concat();
    let mesh = mesh(&[shells.clone(), shells[..500].to_vec()].concat());
    let with = |threads: usize| {
        let pool = cbvh_testkit::pool(threads);
        pool.install(|| bake(&mesh, &Options::default()))
    };
    assert!(with(1) == with(3));
}

/// `verify` finds what no rule does: statements that do not follow from the mesh.
#[test]
fn statements_about_another_mesh_are_found() {
    let sphere = ball_of(200, ORIGIN, 1.0);
    let mesh = mesh(&[sphere.clone(), sphere.clone()].concat());
    for ids in [true, false] {
        let bytes = bake(&mesh, &Options::default().ids(ids));
        bvh_bake::verify(&bytes, &mesh).unwrap();
        let places: Vec<u32> = stated(&bytes, 0).nets.into_keys().collect();
        let refused = |closed: u32, net: i32, count: usize| {
            let mut section = vec![1, 1, count as u32, 0, closed, 1, count as u32, 0, 0];
            places.iter().take(count).for_each(|&place| section.extend([place, net as u32]));
            let mut sections = take_apart(&bytes);
            sections.last_mut().unwrap().2 = section.iter().flat_map(|number| number.to_le_bytes()).collect();
            let bytes = put_together(&sections);
            validate(&bytes).unwrap();
            bvh_bake::verify(&bytes, &mesh).unwrap_err().to_string()
        };
        assert_eq!(refused(0, 0, 0), "the surface of object 0: expected closed, found open");
        assert_eq!(refused(1, 0, 0), "the nets of object 0: expected 2 at place 0, found no further net");
        assert_eq!(
            refused(1, 3, places.len()),
            "the nets of object 0: expected 2 at place 0, found 3 at place 0"
        );
    }
}

/// A stored file is checked a piece at a time, with the same outcome.
#[test]
fn stored_files_are_checked_as_files_in_memory_are() {
    let sphere = ball_of(3000, ORIGIN, 1.0);
    let doubled: Vec<Triangle> = [sphere.clone(), sphere].concat();
    let bytes = bake(&mesh(&doubled), &Options::default());
    let directory = cbvh_testkit::folder();
    let path = directory.path().join("sphere.cbvh");
    std::fs::write(&path, &bytes).unwrap();
    let file = StoredFile::open(&path, None).unwrap();
    bvh_bake::validate_in_parallel(&file).unwrap();
}
