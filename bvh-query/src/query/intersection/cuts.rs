//! Where two surfaces pass through each other: the points in which edges of one pass through faces of the other, and the segments
//! between them.

use crate::error::QueryError;
use crate::narrow::{EdgeCrossing, Point, edge_crossings, largest_of};
use crate::query::intersection::surface::Surface;

/// A vertex of either surface, or a point where an edge passes through a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) point: Point,
    /// No coordinate is farther than this from the exact one.
    pub(super) error: f64,
}

/// Where an edge passes through a face of the other surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeCut {
    /// Its vertices, the lesser number first.
    edge: [u32; 2],
    /// How far from the first vertex it is, along the axis on which the edge is longest.
    at: f64,
    face: u32,
    /// How much the winding number rises here from the first vertex to the other one.
    pub(super) rise: i64,
    pub(super) node: u32,
}

impl EdgeCut {
    /// Returns the sorted cuts of an edge, from its lesser vertex to the other one.
    pub(super) fn between(cuts: &[Self], from: u32, to: u32) -> &[Self] {
        let edge = [from.min(to), from.max(to)];
        let start = cuts.partition_point(|cut| cut.edge < edge);
        let rest = &cuts[start..];
        &rest[..rest.iter().take_while(|cut| cut.edge == edge).count()]
    }
}

/// What two faces have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// The face of A and that of B.
    pub(super) faces: [u32; 2],
    /// The nodes at its ends: inside of B, A's surface is on its left.
    pub(super) ends: [u32; 2],
}

/// A directed line along which a part of a face ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) from: u32,
    pub(super) to: u32,
    /// How often the part on its left counts.
    pub(super) weight: i64,
}

/// Where two surfaces pass through each other.
#[derive(Default)]
pub(super) struct Cuts {
    /// The vertices of A, those of B, and the points of cuts.
    pub(super) nodes: Vec<Node>,
    /// The number of vertices among them.
    vertices: usize,
    /// The number of the first vertex of each surface among the nodes.
    pub(super) first: [u32; 2],
    /// The cuts of the edges of each surface, sorted by edges and along each.
    pub(super) of_edges: [Vec<EdgeCut>; 2],
    /// By faces of A, and by faces of B.
    segments: [Vec<Segment>; 2],
}

impl Cuts {
    /// Finds where pairs of faces pass through each other.
    pub(super) fn new(surfaces: &[Surface; 2], pairs: &[[u32; 2]]) -> Self {
        let mut cuts = Self { first: [0, surfaces[0].points.len() as u32], ..Self::default() };
        let exact = |point: &Point| Node { point: *point, error: 0.0 };
        cuts.nodes.extend(surfaces.iter().flat_map(|surface| &surface.points).map(exact));
        cuts.vertices = cuts.nodes.len();
        let mut found: Vec<Found> = Vec::new();
        let mut segments = Vec::new();
        for &faces in pairs {
            let [a, b] = [0, 1].map(|side| surfaces[side].triangle(faces[side]));
            let Some(ends) = edge_crossings(&a, &b) else { continue };
            let first = found.len() as u32;
            found.extend(ends.map(|crossing| Found::new(surfaces, faces, crossing)));
            segments.push(Segment { faces, ends: [first, first + 1] });
        }
        // The two triangles beside an edge find the same points.
        let mut order: Vec<u32> = (0..found.len() as u32).collect();
        order.sort_unstable_by_key(|&number| found[number as usize].key());
        let mut nodes = vec![0; found.len()];
        let mut last = None;
        for number in order {
            let Found { side, ref crossing, mut cut } = found[number as usize];
            if last.replace(found[number as usize].key()) != Some(found[number as usize].key()) {
                cut.node = cuts.nodes.len() as u32;
                cuts.nodes.push(Node { point: crossing.point, error: crossing.error });
                cuts.of_edges[side].push(cut);
            }
            nodes[number as usize] = cuts.nodes.len() as u32 - 1;
        }
        for of_side in &mut cuts.of_edges {
            of_side.sort_unstable_by(|x, y| {
                (x.edge.cmp(&y.edge)).then(x.at.total_cmp(&y.at)).then(x.face.cmp(&y.face))
            });
        }
        for segment in &mut segments {
            segment.ends = segment.ends.map(|number| nodes[number as usize]);
        }
        cuts.segments[0].clone_from(&segments);
        segments.sort_by_key(|segment| segment.faces[1]);
        cuts.segments[1] = segments;
        cuts
    }

    /// Returns the middle of the box of all points of cuts; nothing if there are none.
    pub(super) fn middle(&self) -> Option<Point> {
        let points = self.nodes[self.vertices..].iter().map(|node| node.point);
        let boxes = points.map(|point| [point; 2]);
        let [lo, hi] = boxes.reduce(|[lo, hi], [point, _]| {
            [[0, 1, 2].map(|k| lo[k].min(point[k])), [0, 1, 2].map(|k| hi[k].max(point[k]))]
        })?;
        Some([0, 1, 2].map(|k| lo[k] + (hi[k] - lo[k]) / 2.0))
    }

    /// Calls `visit` with each face of A and then of B that has parts inside the other mesh, and with the lines around these.
    pub(super) fn each_face(
        &self,
        surfaces: &[Surface; 2],
        windings: &[Vec<i64>; 2],
        mut visit: impl FnMut(usize, u32, &[Arc]) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let mut arcs = Vec::new();
        for side in [0, 1] {
            for face in 0..surfaces[side].faces.len() as u32 {
                self.arcs(surfaces, side, face, &windings[side], &mut arcs);
                if !arcs.is_empty() {
                    visit(side, face, &arcs)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the lines around the parts of a face that are inside the other mesh: along the edges and where the other surface passes
    /// through it. The face counts as often as its net.
    fn arcs(&self, surfaces: &[Surface; 2], side: usize, face: u32, windings: &[i64], arcs: &mut Vec<Arc>) {
        arcs.clear();
        let of_face = &surfaces[side].faces[face as usize];
        let net = i64::from(of_face.net);
        let mut add = |from, to, weight| {
            if weight != 0 && from != to {
                arcs.push(Arc { from, to, weight });
            }
        };
        for corner in 0..3 {
            let (from, to) = (of_face.corners[corner], of_face.corners[(corner + 1) % 3]);
            let cuts = if of_face.is_cut { EdgeCut::between(&self.of_edges[side], from, to) } else { &[] };
            let (mut node, mut winding) = (self.first[side] + from, windings[from as usize]);
            let mut pass = |cut: &EdgeCut, sign: i64| {
                add(node, cut.node, net.wrapping_mul(winding));
                (node, winding) = (cut.node, winding + sign * cut.rise);
            };
            if from < to {
                cuts.iter().for_each(|cut| pass(cut, 1));
            } else {
                cuts.iter().rev().for_each(|cut| pass(cut, -1));
            }
            add(node, self.first[side] + to, net.wrapping_mul(winding));
        }
        let segments = &self.segments[side];
        let start = segments.partition_point(|segment| segment.faces[side] < face);
        for segment in segments[start..].iter().take_while(|segment| segment.faces[side] == face) {
            let other = &surfaces[1 - side].faces[segment.faces[1 - side] as usize];
            let [from, to] = if side == 0 { segment.ends } else { [segment.ends[1], segment.ends[0]] };
            add(from, to, net * i64::from(other.net));
        }
    }
}

/// A crossing that was found for a pair of faces.
struct Found {
    /// The surface that the edge is of.
    side: usize,
    crossing: EdgeCrossing,
    cut: EdgeCut,
}

impl Found {
    fn new(surfaces: &[Surface; 2], faces: [u32; 2], crossing: EdgeCrossing) -> Self {
        let side = usize::from(!crossing.is_of_a);
        let (own, other) = (&surfaces[side], &surfaces[1 - side]);
        let corners = own.faces[faces[side] as usize].corners;
        let (from, to) = (corners[crossing.edge], corners[(crossing.edge + 1) % 3]);
        let [first, last] = [from.min(to), from.max(to)];
        let [p, q] = [first, last].map(|vertex| own.points[vertex as usize]);
        let along = [0, 1, 2].map(|axis| (q[axis] - p[axis]).abs());
        let axis = largest_of(along);
        let net = i64::from(other.faces[faces[1 - side] as usize].net);
        let rise = if crossing.enters == (from < to) { net } else { -net };
        let at = (crossing.point[axis] - p[axis]).abs();
        Self {
            side,
            crossing,
            cut: EdgeCut { edge: [first, last], at, face: faces[1 - side], rise, node: 0 },
        }
    }

    fn key(&self) -> (usize, [u32; 2], u32) {
        (self.side, self.cut.edge, self.cut.face)
    }
}
