//! How thick a mesh is where another one passes through it.
//!
//! The boundary of what two meshes have in common consists of parts of both surfaces. If a connected piece of it has two or more parts of
//! one mesh's surface that do not meet, the other mesh enters here and leaves there. What it pierces is as thick as the least distance
//! between two of these parts.
//!
//! Parts meet where they have a node in common. Within one face they also do if one of them is a hole in the other.

use crate::error::QueryError;
use crate::narrow::{Point, Triangle, dot, largest_of, subtract, triangle_distance};
use crate::query::intersection::cuts::{Arc, Cuts, Node};
use crate::query::intersection::polygons::{COMPARISONS, goes_around, polygons, steepest_axis};
use crate::query::intersection::surface::Surface;
use crate::traverse::budget::Budget;
use std::collections::BTreeMap;
use std::ops::Range;

/// Sets of nodes that are connected.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            let parent = self.0[of as usize];
            self.0[of as usize] = self.0[parent as usize];
            of = parent;
        }
        of
    }

    /// The least node of a set is its root.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// A piece of a part of a surface.
struct Piece {
    shape: PieceShape,
    part: u32,
    lo: Point,
    hi: Point,
}

enum PieceShape {
    /// A face that is in the other mesh as a whole.
    Whole(Triangle),
    /// A line around the part of a face.
    Line([Point; 2]),
    /// What is between the lines around the part of a face.
    Inside(Triangle, Vec<[Point; 2]>),
}

/// Which parts of both surfaces are connected.
pub(super) struct Parts {
    /// By each surface alone, and by both.
    sets: [Sets; 3],
    /// The faces with parts, and which of the lines are around these.
    faces: [Vec<(u32, Range<usize>)>; 2],
    lines: Vec<Arc>,
}

impl Parts {
    pub(super) fn new(nodes: usize) -> Self {
        Self { sets: [(); 3].map(|()| Sets::new(nodes)), faces: Default::default(), lines: Vec::new() }
    }

    /// Adds the parts of a face of one of the surfaces.
    pub(super) fn add(
        &mut self,
        nodes: &[Node],
        surface: &Surface,
        side: usize,
        face: u32,
        arcs: &[Arc],
        budget: &mut Budget,
    ) -> Result<(), QueryError> {
        let Self { sets: [of_a, of_b, of_both], faces, lines } = self;
        let own = if side == 0 { of_a } else { of_b };
        for arc in arcs {
            own.join(arc.from, arc.to);
            of_both.join(arc.from, arc.to);
        }
        if surface.faces[face as usize].is_cut {
            for part in polygons(nodes, &surface.triangle(face), arcs, budget)? {
                for hole in &part[1..] {
                    own.join(part[0][0], hole[0]);
                    of_both.join(part[0][0], hole[0]);
                }
            }
        }
        let first = lines.len();
        lines.extend_from_slice(arcs);
        faces[side].push((face, first..lines.len()));
        Ok(())
    }

    /// Returns the least distance between two parts of a surface in one piece of the boundary; nothing if no piece has two.
    pub(super) fn pierced(
        &mut self,
        cuts: &Cuts,
        surface: &Surface,
        side: usize,
        budget: &mut Budget,
    ) -> Result<Option<f64>, QueryError> {
        let Self { sets: [of_a, of_b, of_both], faces, lines: all } = self;
        let (own, faces) = (if side == 0 { of_a } else { of_b }, &faces[side]);
        // The parts of each piece that has more than one.
        let mut parts: BTreeMap<u32, Option<u32>> = BTreeMap::new();
        for (_, range) in faces {
            for arc in &all[range.clone()] {
                let (part, piece) = (own.root(arc.from), of_both.root(arc.from));
                let first = parts.entry(piece).or_insert(Some(part));
                if *first != Some(part) {
                    *first = None;
                }
            }
        }
        parts.retain(|_, first| first.is_none());
        let mut by_piece: BTreeMap<u32, Vec<Piece>> =
            parts.keys().map(|&piece| (piece, Vec::new())).collect();
        for (face, range) in faces {
            // One face may have several parts, of several pieces.
            let mut lines: BTreeMap<[u32; 2], Vec<[Point; 2]>> = BTreeMap::new();
            for arc in &all[range.clone()] {
                let line = [arc.from, arc.to].map(|node| cuts.nodes[node as usize].point);
                lines.entry([of_both.root(arc.from), own.root(arc.from)]).or_default().push(line);
            }
            let triangle = surface.triangle(*face);
            for ([piece, part], lines) in lines {
                let Some(pieces) = by_piece.get_mut(&piece) else { continue };
                if surface.faces[*face as usize].is_cut {
                    pieces.extend(lines.iter().map(|line| Piece::new(PieceShape::Line(*line), part, line)));
                    let bounds = lines.as_flattened().to_vec();
                    pieces.push(Piece::new(PieceShape::Inside(triangle, lines), part, &bounds));
                } else {
                    pieces.push(Piece::new(PieceShape::Whole(triangle), part, &triangle));
                }
            }
        }
        let mut least = None;
        for mut pieces in by_piece.into_values() {
            let found = Tree::new(&mut pieces).least(budget)?;
            least = Some(least.map_or(found, |least: f64| least.min(found)));
        }
        Ok(least)
    }
}

impl Piece {
    fn new(shape: PieceShape, part: u32, points: &[Point]) -> Self {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points {
            for k in 0..3 {
                (lo[k], hi[k]) = (lo[k].min(point[k]), hi[k].max(point[k]));
            }
        }
        Self { shape, part, lo, hi }
    }

    /// Returns the distance of two pieces if it is less than a limit, else some number that is not.
    ///
    /// Two parts of faces are nearest in lines around them, or where such a line ends above the inside of the other one: along a line,
    /// the distance from a plane is least at an end of what lies above the part.
    fn distance(&self, other: &Self, limit: f64, budget: &mut Budget) -> Result<f64, QueryError> {
        use PieceShape::{Inside, Line, Whole};
        let (inside, corners): (&Self, &[Point]) = match (&self.shape, &other.shape) {
            (Whole(t), Whole(u)) => return Ok(triangle_distance(t, u).distance),
            (Whole(t), Line([p, q])) | (Line([p, q]), Whole(t)) => {
                return Ok(triangle_distance(t, &[*p, *q, *q]).distance);
            }
            (Line([p, q]), Line([r, s])) => {
                return Ok(triangle_distance(&[*p, *q, *q], &[*r, *s, *s]).distance);
            }
            (Inside(..), Inside(..)) => return Ok(f64::INFINITY),
            (Inside(..), Line(line)) => (self, &line[..1]),
            (Line(line), Inside(..)) => (other, &line[..1]),
            (Inside(..), Whole(t)) => (self, t),
            (Whole(t), Inside(..)) => (other, t),
        };
        let Inside(triangle, outline) = &inside.shape else { return Ok(f64::INFINITY) };
        let mut least = f64::INFINITY;
        for corner in corners {
            let over = triangle_distance(triangle, &[*corner; 3]);
            if over.distance < limit.min(least) {
                budget.charge(outline.len() as u64 / COMPARISONS)?;
                if is_around(outline, triangle, over.point_a) {
                    least = over.distance;
                }
            }
        }
        Ok(least)
    }
}

/// Returns whether lines in the plane of a triangle go around a point of it.
fn is_around(outline: &[[Point; 2]], triangle: &Triangle, point: Point) -> bool {
    let axis = steepest_axis(triangle);
    let flat = |point: Point| [point[(axis + 1) % 3], point[(axis + 2) % 3]];
    goes_around(outline.iter().map(|line| line.map(flat)), flat(point))
}

/// Pieces in a binary tree of boxes: those of a node are adjacent, and halved in the middle.
struct Tree<'a> {
    pieces: &'a [Piece],
    /// The box of each node, and the part of its pieces if they have one: the children of node `n` are `2 n + 1` and `2 n + 2`.
    nodes: Vec<([Point; 2], Option<u32>)>,
}

/// Pieces that are compared with each other one by one.
const FEW: usize = 4;

impl<'a> Tree<'a> {
    fn new(pieces: &'a mut [Piece]) -> Self {
        let mut nodes = Vec::new();
        build(pieces, 0, &mut nodes);
        Self { pieces, nodes }
    }

    /// Returns the least distance between pieces of different parts.
    fn least(&self, budget: &mut Budget) -> Result<f64, QueryError> {
        let mut least = f64::INFINITY;
        let all = (0, 0, self.pieces.len());
        let mut pairs = vec![(0.0, all, all)];
        while let Some((gap, one, two)) = pairs.pop() {
            budget.visit()?;
            if gap >= least {
                continue;
            }
            let is_few = |(_, start, end): (usize, usize, usize)| end - start <= FEW;
            if is_few(one) && is_few(two) {
                for p in &self.pieces[one.1..one.2] {
                    for q in &self.pieces[two.1..two.2] {
                        if p.part != q.part && gap_of(&[p.lo, p.hi], &[q.lo, q.hi]) < least {
                            least = least.min(p.distance(q, least, budget)?);
                        }
                    }
                }
                continue;
            }
            let halves = |of: (usize, usize, usize)| {
                let (node, start, end) = of;
                let middle = start + (end - start) / 2;
                [(2 * node + 1, start, middle), (2 * node + 2, middle, end)]
            };
            let is_first_larger = one.2 - one.1 >= two.2 - two.1;
            let mut next: Vec<_> = match (one == two, is_first_larger) {
                (true, _) => {
                    let [low, high] = halves(one);
                    vec![(low, low), (low, high), (high, high)]
                }
                (false, true) => halves(one).map(|half| (half, two)).to_vec(),
                (false, false) => halves(two).map(|half| (one, half)).to_vec(),
            };
            next.retain(|(one, two)| {
                let (part, other) = (self.nodes[one.0].1, self.nodes[two.0].1);
                part.is_none() || part != other
            });
            let mut next: Vec<_> = next
                .into_iter()
                .map(|(one, two)| (gap_of(&self.nodes[one.0].0, &self.nodes[two.0].0), one, two))
                .collect();
            // The nearest pair is taken first.
            next.sort_by(|x, y| y.0.total_cmp(&x.0));
            pairs.extend(next);
        }
        Ok(least)
    }
}

/// Sorts pieces into a tree and computes its nodes.
fn build(pieces: &mut [Piece], node: usize, nodes: &mut Vec<([Point; 2], Option<u32>)>) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for piece in &*pieces {
        for k in 0..3 {
            (lo[k], hi[k]) = (lo[k].min(piece.lo[k]), hi[k].max(piece.hi[k]));
        }
    }
    let part = pieces.first().map(|piece| piece.part);
    let part = part.filter(|part| pieces.iter().all(|piece| piece.part == *part));
    if nodes.len() <= node {
        nodes.resize(node + 1, ([[0.0; 3]; 2], None));
    }
    nodes[node] = ([lo, hi], part);
    if pieces.len() <= FEW {
        return;
    }
    let axis = largest_of(subtract(hi, lo));
    let middle = pieces.len() / 2;
    let place = |piece: &Piece| piece.lo[axis] + piece.hi[axis];
    pieces.select_nth_unstable_by(middle, |x, y| place(x).total_cmp(&place(y)));
    let (low, high) = pieces.split_at_mut(middle);
    build(low, 2 * node + 1, nodes);
    build(high, 2 * node + 2, nodes);
}

/// Returns how far apart two boxes are.
fn gap_of([lo, hi]: &[Point; 2], [low, high]: &[Point; 2]) -> f64 {
    let gaps = [0, 1, 2].map(|k| (low[k] - hi[k]).max(lo[k] - high[k]).max(0.0));
    dot(gaps, gaps).sqrt()
}
