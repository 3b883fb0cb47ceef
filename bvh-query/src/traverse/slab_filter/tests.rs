//! Compares the bounds of turning slabs with points placed exactly, also where numbers are extreme.

use super::*;
use crate::isa::{Backend, Task};
use crate::numerics::POSE_ERROR;
use crate::pose::Pose;
use crate::traverse::decode::{Coding, Parent, decode_group};
use bvh_format::kdop::Kdop;
use bvh_format::leaf::{Packet, TriangleEncoding};
use bvh_format::page::{Page, PageShape, PageWriter, TightBound, WrittenPage};
use bvh_format::profile::Profile;
use bvh_format::slabs::NodeSlabs;
use bvh_format::turning::{TurningDirection, TurningSlab, decode_turning};
use bvh_format::vertex::Vertices;
use cbvh_testkit::Random;

type Point = [f64; 3];

const PROFILE: Profile = Profile::Dop26U8Wide;

/// Four flat patches of up to four triangles in one treelet. Some have no turning slab.
struct Node {
    page: WrittenPage,
    triangles: Vec<Vec<[[f32; 3]; 3]>>,
}

impl Node {
    fn new(random: &mut Random, centre: Point, size: f64) -> Self {
        let mut triangles = Vec::new();
        for _ in 0..4 {
            let (at, normal) = (random.point(), random.point());
            let square: f64 = normal.iter().map(|c| c * c).sum::<f64>().max(1e-3);
            let corner = |random: &mut Random| {
                let p = random.point();
                let along = 0.97 * (0..3).map(|i| p[i] * normal[i]).sum::<f64>() / square;
                [0, 1, 2].map(|i| (centre[i] + size * (2.0 * at[i] + p[i] - along * normal[i])) as f32)
            };
            let patch: Vec<_> = (0..4).map(|_| [corner(random), corner(random), corner(random)]).collect();
            triangles.push(patch);
        }
        Self::of_patches(triangles, |patch| {
            let [a, b, c] = patch[0].map(|corner| corner.map(f64::from));
            let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            (random.signed() > -0.8).then_some(TurningDirection::near(normal))
        })
    }

    /// A treelet of patches. `direction` chooses the directions of their turning slabs.
    fn of_patches(
        triangles: Vec<Vec<[[f32; 3]; 3]>>,
        mut direction: impl FnMut(&[[[f32; 3]; 3]]) -> Option<TurningDirection>,
    ) -> Self {
        let mut writer =
            PageWriter::new(PROFILE, 1.0, PageShape { roots: 1, treelets: 1, ..PageShape::default() });
        writer.root(&Kdop::of_points(triangles.iter().flatten().flatten().copied()), None);
        writer.begin_treelet();
        for patch in &triangles {
            let around = |direction| TurningSlab::around(direction, [&Packet::new(patch)], [0.0; 3]);
            let turning = direction(patch).map(around);
            let kdop = Kdop::of_points(patch.as_flattened().iter().copied());
            writer.leaf(&TightBound { kdop, turning }, patch.iter().map(|&corners| (corners, 0)));
        }
        Self { page: writer.finish(TriangleEncoding::F32, &Vertices::around([0.0; 3]), false), triangles }
    }

    fn magnitude(&self) -> f32 {
        let coordinates = self.triangles.iter().flatten().flatten().flatten();
        coordinates.fold(0.0, |most, c| if c.abs() > most { c.abs() } else { most })
    }

    /// Corners and points within the triangles of a child.
    fn points(&self, child: usize, random: &mut Random) -> Vec<Point> {
        let mut points = Vec::new();
        for triangle in &self.triangles[child] {
            let corners = triangle.map(|corner| corner.map(f64::from));
            points.extend(corners);
            let (p, q) = (random.signed().abs(), random.signed().abs());
            let weights = [p * q, p * (1.0 - q), 1.0 - p];
            points.push([0, 1, 2].map(|i| (0..3).map(|k| weights[k] * corners[k][i]).sum()));
        }
        points
    }
}

/// Where the corners of boxes that reach furthest along their slabs meet, no gap is left for a bound that is too large.
#[test]
fn bounds_hold_to_the_last_bit_where_extreme_corners_meet() {
    let random = &mut Random::new(5);
    let (mut found, mut near) = (0, 0);
    for round in 0..4_000 {
        let size = 10f64.powi(round % 21 - 10);
        let far = size * [0.0, 1.0, 30.0, 1e3][(round / 2 % 4) as usize];
        let direction = TurningDirection::near(random.point());
        let n = direction.vector().map(f64::from);
        let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
        let unit = n.map(|c| c / length);
        // One patch, four times: two triangles with the corners of the box that reach furthest both ways.
        let patch = |random: &mut Random| {
            // In every other round all lies on the line between the centres.
            let half = if round % 2 == 0 { random.point() } else { unit };
            let centre = random.point();
            let corner = |sign: f64| {
                [0, 1, 2].map(|i| (far * centre[i] + size * half[i].abs() * (sign * n[i]).signum()) as f32)
            };
            let (low, high) = (corner(-1.0), corner(1.0));
            let inside = [0, 1, 2].map(|i| low[i] + (high[i] - low[i]) * random.signed().abs() as f32 * 0.5);
            vec![[low, high, inside]]
        };
        let nodes = [0, 1].map(|_| Node::of_patches(vec![patch(random); 4], |_| Some(direction)));
        // A turn around the direction, and B's lowest corner above A's highest one.
        let (sin, cos) = (3.0 * random.signed()).sin_cos();
        let [x, y, z] = unit;
        let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let rotation = [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| cos * f64::from(i == j) + sin * cross[i][j] + (1.0 - cos) * unit[i] * unit[j])
        });
        let gap = [0.0, 1e-7, 1e-3, 1.0][(round / 8 % 4) as usize] * size;
        let corner = |node: &Node, at: usize| node.triangles[0][0][at].map(f64::from);
        let (p, q) = (corner(&nodes[0], 1), corner(&nodes[1], 0));
        let turned = rotation.map(|row: [f64; 3]| row[0] * q[0] + row[1] * q[1] + row[2] * q[2]);
        let translation = [0, 1, 2].map(|i| p[i] + gap * unit[i] - turned[i]);
        let (test, placement) = prepared(&nodes, rotation, translation);
        let b = placement.place(q);
        let least = (0..3).map(|i| (p[i] - b[i]) * (p[i] - b[i])).sum::<f64>().sqrt();
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let run = |measure| Run { test: &test, nodes: [&nodes[0], &nodes[1]], measure, limit: 0.0 };
            let (overlap, _) = backend.run(run(Measure::Overlap));
            let (_, bounds) = backend.run(run(Measure::Distance));
            assert!(bounds.iter().all(|&bound| f64::from(bound) <= least), "{round}: {bounds:?} > {least}");
            assert!(gap > 0.0 || overlap == 0xffff, "{round}");
            found += 1;
            near += u32::from(f64::from(bounds[0]) > 0.98 * least && gap > 0.0);
        }
    }
    assert!(near > found / 8, "{near} of {found}");
}

/// Nodes so large that products along the line between their centres overflow: the slab of B lies far from the centre of
/// its box, which is near that of A's.
#[test]
fn bounds_hold_where_products_overflow() {
    let mut found = 0.0f64;
    for exponent in 30..=118 {
        let h = 2f32.powi(exponent);
        let direction = TurningDirection::near([1.0; 3]);
        let flat = |h: f32, at: f32| {
            vec![[[at - h, at + h, at + h], [at + h, at - h, at + h], [at + h, at + h, at - h]]]
        };
        let nodes = [flat(h / 1024.0, 0.0), flat(h, h / 1024.0)]
            .map(|patch| Node::of_patches(vec![patch; 4], |_| Some(direction)));
        let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let (test, _) = prepared(&nodes, unit, [0.0; 3]);
        // Both planes are perpendicular to (1, 1, 1).
        let h = f64::from(h);
        let least = ((h + 3.0 * h / 1024.0) - h / 1024.0) / 3f64.sqrt();
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let nodes = [&nodes[0], &nodes[1]];
            let run = Run { test: &test, nodes, measure: Measure::Distance, limit: 0.0 };
            let (_, bounds) = backend.run(run);
            let what = format!("2^{exponent}, {backend}: {} > {least:e}", bounds[0]);
            assert!(bounds.iter().all(|&bound| f64::from(bound) <= least), "{what}");
            found = found.max(f64::from(bounds[0]) / least);
        }
    }
    assert!(found > 0.5, "{found}");
}

/// Decodes the turning slabs of a treelet whose fixed slabs are given.
struct Decode<'a>(&'a TurningCodes, &'a Group);

impl Task for Decode<'_> {
    type Output = TurningGroup;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> TurningGroup {
        let mut decoded = TurningGroup::zeroed();
        decoded.decode(isa, self.0, self.1);
        decoded
    }
}

/// Codes of any value, and boxes of any size and place.
#[test]
fn slabs_are_those_of_the_reference_decoder_to_the_last_bit() {
    let random = &mut Random::new(21);
    for round in 0..5_000 {
        let mut treelet = [0; 128];
        treelet.iter_mut().for_each(|byte| *byte = (random.signed() * 128.0 + 128.0) as u8);
        if round % 3 == 0 {
            [28, 92, 56, 120].iter().for_each(|row| treelet[row + round as usize % 4] = 0);
        }
        let size = 2f64.powi(round % 60 - 30);
        let mut group = Group::ZERO;
        let mut nodes = [NodeSlabs::default(); 4];
        for (child, node) in nodes.iter_mut().enumerate() {
            for row in 0..3 {
                let (p, q) = ((random.signed() * size) as f32, (random.signed() * size) as f32);
                (node.lo[row], node.hi[row]) = (p.min(q), p.max(q));
                (group.lo[0][4 * row + child], group.hi[0][4 * row + child]) = (node.lo[row], node.hi[row]);
            }
        }
        let codes = TurningCodes::read(&treelet);
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let decoded = backend.run(Decode(&codes, &group));
            for (child, node) in nodes.iter().enumerate() {
                let slab = decode_turning(PROFILE, &treelet, child, node);
                let n = slab.map_or([0.0; 3], |slab| slab.direction.vector());
                let scale =
                    if slab.is_some() { 1.0 / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt() } else { 0.0 };
                let centre = [0, 1, 2].map(|row| (node.lo[row] + node.hi[row]) * 0.5);
                let [x, y, z] = [0, 1, 2].map(|row| n[row] * scale * centre[row]);
                let (lo, hi) = slab.map_or((0.0, 0.0), |slab| (slab.lo, slab.hi));
                let middle = (lo + hi) * (scale * 0.5) - ((x + y) + z);
                let width = (hi - lo) * (scale * 0.5);
                let found = [decoded.centre.row(3)[child], decoded.half.row(3)[child]];
                if slab.is_some() {
                    assert_eq!(found.map(f32::to_bits), [middle, width].map(f32::to_bits), "{backend}");
                } else {
                    assert_eq!(found, [0.0; 2], "{backend}");
                }
                for row in 0..3 {
                    assert_eq!(decoded.direction.row(row)[child], n[row] * scale, "{backend}");
                    assert_eq!(decoded.centre.row(row)[child].to_bits(), centre[row].to_bits(), "{backend}");
                }
            }
        }
    }
}

/// Decodes both nodes and tests all pairs of their children.
struct Run<'a> {
    test: &'a SlabFilter,
    nodes: [&'a Node; 2],
    measure: Measure,
    limit: f32,
}

impl Task for Run<'_> {
    type Output = (u16, [f32; 16]);

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let mut decoded = [TurningGroup::zeroed(); 2];
        for side in 0..2 {
            let page = Page::new(&self.nodes[side].page.bytes, PROFILE);
            let (mut parent, mut group) = (Group::of_one(&page.anchor_slabs(0)), Group::ZERO);
            let coding = Coding { profile: PROFILE, f16_scale: 1.0 };
            decode_group(isa, coding, (page.treelet(0), 0), Parent::Node(&parent, 0), &mut group);
            parent = group;
            let codes = TurningCodes::read(page.treelet(0).first_chunk().expect("128 bytes"));
            decoded[side].decode(isa, &codes, &parent);
        }
        let mut bounds = [f32::NEG_INFINITY; 16];
        let groups = (&decoded[0], &decoded[1]);
        let mask = self.test.run(isa, self.measure, groups, self.limit, &mut bounds);
        (mask, bounds)
    }
}

fn prepared(nodes: &[Node; 2], rotation: [[f64; 3]; 3], translation: Point) -> (SlabFilter, Placement) {
    let pose = Pose::new(rotation, translation).unwrap();
    let magnitudes = (nodes[0].magnitude(), nodes[1].magnitude());
    let all = f64::from(magnitudes.0) + f64::from(magnitudes.1);
    let whole = 9.0 * all + translation.iter().map(|t| t.abs()).sum::<f64>();
    let placement = Placement { rotation: *pose.rotation(), translation, error: POSE_ERROR * whole };
    let mut test = SlabFilter::NONE;
    test.prepare(&placement, &placement.inverse(), magnitudes);
    (test, placement)
}

/// A matrix as far from a rotation as a pose may be, and nodes of any size, near the origin and far from it.
#[test]
fn bounds_hold_for_all_points_of_both_nodes() {
    let random = &mut Random::new(99);
    let (mut apart, mut pairs) = (0, 0);
    for round in 0..3_000 {
        let size = 10f64.powi(round % 31 - 15) * 3f64.powi(-(round % 7));
        let far = if round % 3 == 0 { 0.0 } else { size * 10f64.powi(round % 5) };
        let centres = [random.point(), random.point()].map(|p| p.map(|c| c * far));
        let nodes = centres.map(|centre| Node::new(random, centre, size));
        let (sin, cos) = (3.0 * random.signed()).sin_cos();
        let shear = if round % 2 == 0 { 0.9e-6 } else { -0.9e-6 };
        let rotation = [[cos, -sin, shear * cos], [sin, cos, shear * sin], [0.0, 0.0, 1.0]];
        // A point of A and one of B meet, or are a part of the size apart.
        let points: Vec<Vec<Point>> = (0..8).map(|i| nodes[i / 4].points(i % 4, random)).collect();
        let (of_a, of_b) = ((round % 4) as usize, 4 + (round / 4 % 4) as usize);
        let gap = [0.0, 1e-6, 1e-3, 1.0][(round / 7 % 4) as usize] * size;
        let towards = random.point().map(|c| c * gap);
        let turned = |p: Point| rotation.map(|row: [f64; 3]| row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
        let (p, q) = (points[of_a][(round % 16) as usize], turned(points[of_b][(round % 13) as usize]));
        let translation = [0, 1, 2].map(|i| p[i] - q[i] + towards[i]);
        let (test, placement) = prepared(&nodes, rotation, translation);
        let mut masks = Vec::new();
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let run = |measure| Run { test: &test, nodes: [&nodes[0], &nodes[1]], measure, limit: 0.0 };
            let ((overlap, _), (mask, bounds)) =
                (backend.run(run(Measure::Overlap)), backend.run(run(Measure::Distance)));
            for lane in 0..16 {
                let mut least = f64::INFINITY;
                for a in &points[lane / 4] {
                    for b in &points[4 + lane % 4] {
                        let b = placement.place(*b);
                        let d = (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt();
                        least = least.min(d);
                    }
                }
                assert!(f64::from(bounds[lane]) <= least, "{round} {lane}: {} > {least}", bounds[lane]);
                assert_eq!(mask >> lane & 1 == 1, bounds[lane] <= 0.0);
                // Whoever says that nodes do not overlap knows a distance.
                assert!(least > 0.0 || overlap >> lane & 1 == 1, "{round} {lane}");
                pairs += 1;
                apart += u32::from(overlap >> lane & 1 == 0);
            }
            masks.push(overlap);
        }
        // Pairs that meet are met on all backends.
        let meeting = if gap == 0.0 { 1 << (4 * of_a + of_b - 4) } else { 0 };
        assert!(masks.iter().all(|mask| mask & meeting == meeting));
    }
    // The test is worth something.
    assert!(apart > pairs / 3, "{apart} of {pairs}");
}
