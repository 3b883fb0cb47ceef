//! Contact points of a patch, as simulators use them: finds candidates and measures how deep each is along a line.
//!
//! # Method
//! The curve in which two surfaces meet is where they are not deep at all: a box that is pressed into a floor is deep at its corners,
//! which are below the curve. So there are three kinds of candidates:
//!
//! - vertices of one mesh that are inside the other one, of the patch's triangles;
//! - points of the patch's regions, whose depth is 0;
//! - lines through the centre and, where walls are, a little inward of the outermost of these points. They find the depth where triangles
//!   are so fine that none of the patch reaches the bottom.
//!
//! Of the first two kinds, those are kept that reach farthest in some directions of the plane perpendicular to the normal, and of
//! vertices the deepest ones. Each is measured by up to four rays along the normal, so a patch takes a bounded number of them,
//! whatever its size. `choice` chooses from what remains.

use crate::error::QueryError;
use crate::narrow::{Triangle, dot, subtract, unit};
use crate::query::patches::choice::{PatchPoint, PointCandidate, choose};
use crate::query::patches::join::Vertices;
use crate::query::patches::thickness::{Deepest, PlacedSides};
use crate::query::probe::line::{Candidate, Line, LineQuestion};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::ray::{First, Ray};
use crate::query::querier::Querier;
use crate::query::regions::ContactRegion;

/// The contacts of a patch.
pub(super) struct Contacts<'p> {
    /// Of all patches.
    pub(super) regions: &'p [ContactRegion],
    pub(super) triangles: &'p [[Triangle; 2]],
    pub(super) vertices: &'p Vertices,
    /// Those of this patch.
    pub(super) numbers: &'p [usize],
}

impl<'p> Contacts<'p> {
    fn iter(&self) -> impl Iterator<Item = (&'p ContactRegion, &'p [Triangle; 2], &'p [usize])> {
        self.numbers.iter().map(|&i| (&self.regions[i], &self.triangles[i], self.vertices.of(i)))
    }
}

/// The number of directions in the plane in which candidates reach farthest, and where more than this many points are wanted.
const DIRECTIONS: usize = 8;
const MANY_DIRECTIONS: usize = 16;

/// A vertex that is deeper by some length counts as if it reached farther by this share of it. So of vertices one above the other the
/// deepest is kept.
const DEPTH_SHARE: f64 = 0.25;

/// How far inward from the outermost points of the curve lines are measured, as a share of their way to the centre. Beside a curve that
/// runs along a wall, they are inside both meshes; the area that is lost is less than what adds a point (`choice`).
const INWARD: f64 = 1.0 / 512.0;

/// How far a vertex may be outside of the outline, as a share of how far the outline reaches.
const UNDERCUT: f64 = 0.25;

/// Three directions at right angles, each of length 1, of which none is near that of an axis. The first one turns to the normal.
const FRAME: [[f64; 3]; 3] = [
    [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0],
    [3.0 / 7.0, -6.0 / 7.0, 2.0 / 7.0],
    [6.0 / 7.0, 2.0 / 7.0, -3.0 / 7.0],
];

/// The plane through the centre, perpendicular to the normal.
struct PatchPlane {
    center: [f64; 3],
    normal: [f64; 3],
    /// Evenly around the normal, each of length 1. The first one and the one after a quarter are the axes of the plane.
    directions: Vec<[f64; 3]>,
}

impl PatchPlane {
    /// Turns the frame on the shortest way, so that the directions change as little as the normal does. They jump only where the
    /// normal passes the one that is opposite to the frame's.
    fn new(center: [f64; 3], normal: [f64; 3], count: usize) -> Self {
        let [from, x, y] = FRAME;
        let sum = [0, 1, 2].map(|k| from[k] + normal[k]);
        let scale = 1.0 + dot(from, normal);
        let turned = |axis: [f64; 3]| {
            let share = if scale > 1.0 / (1 << 20) as f64 { dot(axis, normal) / scale } else { 0.0 };
            [0, 1, 2].map(|k| axis[k] - share * sum[k])
        };
        let (x, y) = (turned(x), turned(y));
        // Halved until there are enough: all are sums and square roots, which are the same on every machine.
        let mut directions = vec![x, y, x.map(|v| -v), y.map(|v| -v)];
        while directions.len() < count {
            let next = directions.iter().cycle().skip(1);
            let halves =
                directions.iter().zip(next).flat_map(|(p, q)| [*p, unit([0, 1, 2].map(|k| p[k] + q[k]))]);
            directions = halves.collect();
        }
        Self { center, normal, directions }
    }

    fn place(&self, point: [f64; 3]) -> [f64; 2] {
        let from = subtract(point, self.center);
        [dot(self.directions[0], from), dot(self.directions[self.directions.len() / 4], from)]
    }
}

/// The points that reach farthest in each direction of a plane, each with something that belongs to it.
struct Farthest<T> {
    found: Vec<Option<(f64, [f64; 3], T)>>,
}

impl<T: Copy> Farthest<T> {
    fn new(plane: &PatchPlane) -> Self {
        Self { found: vec![None; plane.directions.len()] }
    }

    /// Of points that reach equally far, the one with the greatest coordinates counts, whatever their order.
    fn add(&mut self, plane: &PatchPlane, point: [f64; 3], bonus: f64, of: T) {
        let from = subtract(point, plane.center);
        for (found, direction) in self.found.iter_mut().zip(&plane.directions) {
            let reach = dot(*direction, from) + bonus;
            let is_farther =
                |(most, held, _): &(f64, [f64; 3], T)| reach > *most || reach == *most && point > *held;
            if found.as_ref().is_none_or(is_farther) {
                *found = Some((reach, point, of));
            }
        }
    }

    /// Returns how far the points reach in each direction.
    fn reaches(&self) -> impl Iterator<Item = f64> {
        self.found.iter().map(|found| found.as_ref().map_or(0.0, |(reach, _, _)| *reach))
    }

    /// Returns the points, each once.
    fn points(&self) -> Vec<([f64; 3], T)> {
        let mut points = Vec::<([f64; 3], T)>::new();
        for (_, point, of) in self.found.iter().flatten() {
            if points.iter().all(|(other, _)| other != point) {
                points.push((*point, *of));
            }
        }
        points
    }
}

/// The vertices of one mesh that may be inside the other one.
struct Inner {
    farthest: Farthest<()>,
    deepest: Deepest,
}

impl Inner {
    fn points(&self) -> Vec<[f64; 3]> {
        let mut points: Vec<_> = self.farthest.points().into_iter().map(|(point, ())| point).collect();
        for corner in self.deepest.corners() {
            if !points.contains(&corner) {
                points.push(corner);
            }
        }
        points
    }
}

impl Querier {
    /// Returns at most `most` points of a patch.
    pub(super) fn points_of_patch(
        &mut self,
        sides: &PlacedSides<'_>,
        [center, normal]: [[f64; 3]; 2],
        contacts: &Contacts<'_>,
        most: usize,
    ) -> Result<Vec<PatchPoint>, QueryError> {
        if normal == [0.0; 3] || most == 0 {
            return Ok(Vec::new());
        }
        let plane =
            PatchPlane::new(center, normal, if most > DIRECTIONS { MANY_DIRECTIONS } else { DIRECTIONS });
        let mut outline = Farthest::new(&plane);
        for (region, _, vertices) in contacts.iter() {
            for (point, vertex) in region.points().iter().zip(vertices) {
                outline.add(&plane, *point, 0.0, *vertex);
            }
        }
        let [of_a, of_b] = inner_vertices(sides, &plane, contacts, &outline);
        let mut lines = Lines { querier: self, sides, plane: &plane, found: Vec::new() };
        for (mesh, inner, side, sign) in [(&sides.a, of_b, B, 1.0), (&sides.b, of_a, A, -1.0)] {
            let vertices = inner.points();
            let faces = faces_above(&vertices, &plane, contacts, side);
            for (vertex, face) in vertices.into_iter().zip(faces) {
                lines.add_vertex(mesh, vertex, face, sign)?;
            }
        }
        lines.add_line(plane.center, LineKind::Center)?;
        for (point, vertex) in outline.points() {
            let is_at_wall = lines.add_region_point(contacts, vertex);
            let inward = subtract(plane.center, point);
            let near = [0, 1, 2].map(|k| point[k] + INWARD * inward[k]);
            if is_at_wall && !lines.has_deep_point_beyond(near) {
                lines.add_line(near, LineKind::Rim)?;
            }
        }
        Ok(choose(lines.found, most))
    }

    /// Returns where a line first meets the core of a shape, at which length, and the normal of the triangle.
    fn first_of_core(
        &mut self,
        mesh: &PlacedShape<'_>,
        from: [f64; 3],
        direction: [f64; 3],
    ) -> Result<Option<(f64, [f64; 3])>, QueryError> {
        // Placed vertices may be farther out than rays can start.
        let Ok(first) = First::new(&Ray::new(from, direction)) else { return Ok(None) };
        let mut first = FirstOfCore(first);
        self.ask_line(mesh, &mut first)?;
        Ok(first.0.met())
    }
}

/// Returns the vertices of A and of B that may be inside the other mesh, by the planes of the triangles in contact.
fn inner_vertices(
    sides: &PlacedSides<'_>,
    plane: &PatchPlane,
    contacts: &Contacts<'_>,
    outline: &Farthest<usize>,
) -> [Inner; 2] {
    let mut inner = [(); 2].map(|()| Inner { farthest: Farthest::new(plane), deepest: Deepest::default() });
    for (region, [of_a, of_b], _) in contacts.iter() {
        let Some(on_both) = region.points().first() else { continue };
        let add = |inner: &mut Inner, corners: &Triangle, outside: [f64; 3], cosine: f64| {
            for corner in corners.iter().filter(|_| cosine > 0.0) {
                let depth = dot(outside, subtract(*on_both, *corner));
                let from = subtract(*corner, plane.center);
                // Below an undercut, a vertex may be a little outside of the outline. Farther away, it belongs to another patch of its
                // triangle. Single points of rounded shapes tell no outline.
                let is_here = || {
                    let mut reaches = plane.directions.iter().zip(outline.reaches());
                    reaches.all(|(direction, reach)| {
                        dot(*direction, from) <= reach + depth.min(UNDERCUT * reach)
                    })
                };
                if depth > -sides.radii && (sides.radii > 0.0 || is_here()) {
                    inner.farthest.add(plane, *corner, DEPTH_SHARE * depth, ());
                    inner.deepest.add(*corner, depth);
                }
            }
        };
        let [inner_a, inner_b] = &mut inner;
        add(inner_b, of_b, region.normal_a, dot(region.normal_a, plane.normal));
        add(inner_a, of_a, region.normal_b, -dot(region.normal_b, plane.normal));
    }
    inner
}

/// The sides of a contact.
const A: usize = 0;
const B: usize = 1;

/// A plane of the other mesh above a vertex: how far it is along the patch's normal, and its own normal, which points out of the
/// other mesh.
#[derive(Clone, Copy)]
struct Face {
    length: f64,
    normal: [f64; 3],
}

/// Planes with a lesser cosine to the patch's normal are walls.
const LEAST_COSINE_OF_FACES: f64 = 0.25;

/// Returns for each vertex the plane above it: that of the nearest triangle with which its own triangles are in contact. A wall counts
/// only if there is no other one.
fn faces_above(
    vertices: &[[f64; 3]],
    plane: &PatchPlane,
    contacts: &Contacts<'_>,
    side: usize,
) -> Vec<Option<Face>> {
    // Each with the square of its distance.
    let mut faces = vec![[None::<(f64, Face)>; 2]; vertices.len()];
    for (region, triangles, _) in contacts.iter() {
        let (normal, sign) = if side == B { (region.normal_a, 1.0) } else { (region.normal_b, -1.0) };
        let cosine = sign * dot(normal, plane.normal);
        if cosine <= 0.0 {
            continue;
        }
        for (vertex, [face, wall]) in vertices.iter().zip(&mut faces) {
            if !triangles[side].contains(vertex) {
                continue;
            }
            for point in region.points() {
                let way = subtract(*point, *vertex);
                let square = dot(way, way);
                let held = if cosine >= LEAST_COSINE_OF_FACES { &mut *face } else { &mut *wall };
                if held.is_none_or(|(least, _)| square < least) {
                    *held = Some((square, Face { length: dot(normal, way) / cosine, normal }));
                }
            }
        }
    }
    faces.into_iter().map(|[face, wall]| face.or(wall).map(|(_, face)| face)).collect()
}

/// Why a line is measured.
#[derive(Clone, Copy, PartialEq)]
enum LineKind {
    /// It passes through the centre.
    Center,
    /// It passes just inside of the rim.
    Rim,
}

/// How many times as long as others a length may be that is measured along a line. In a sliver between two walls, a line along the
/// normal of a patch that also has a floor leaves it anywhere.
const MAX_RATIO: f64 = 2.0;

/// Measures how deep candidates are.
struct Lines<'l, 's> {
    querier: &'l mut Querier,
    sides: &'l PlacedSides<'s>,
    plane: &'l PatchPlane,
    found: Vec<PointCandidate>,
}

impl Lines<'_, '_> {
    /// Adds a point in the middle of a length on a line along the plane's normal, which is negative between cores that are apart.
    fn add(&mut self, middle: [f64; 3], length: f64, normal: [f64; 3]) {
        let depth = length * dot(normal, self.plane.normal);
        if depth >= -self.sides.radii && normal != [0.0; 3] {
            let point = PatchPoint { point: middle, normal, depth };
            self.found.push(PointCandidate { place: self.plane.place(middle), point });
        }
    }

    /// Measures from a vertex of one mesh to the surface of the other one, which pushes it along the normal (1) or against it (-1). If
    /// that is much farther than the plane above it, the vertex is in a sliver, and the plane is what counts.
    fn add_vertex(
        &mut self,
        mesh: &PlacedShape<'_>,
        vertex: [f64; 3],
        face: Option<Face>,
        sign: f64,
    ) -> Result<(), QueryError> {
        let out = self.plane.normal.map(|x| sign * x);
        let mut met = self.way_out(mesh, vertex, out)?;
        if let (Some((length, _)), Some(face)) = (met, face)
            && length > MAX_RATIO * (face.length.max(0.0) + self.sides.radii)
        {
            met = Some((face.length.max(0.0), face.normal));
        }
        if met.is_none() && self.sides.radii > 0.0 {
            let below = self.querier.first_of_core(mesh, vertex, out.map(|x| -x))?;
            met = below.filter(|(_, normal)| dot(*normal, out) > 0.0).map(|(t, normal)| (-t, normal));
        }
        if let Some((length, normal)) = met {
            let middle = [0, 1, 2].map(|k| vertex[k] + length / 2.0 * out[k]);
            self.add(middle, length, normal.map(|x| sign * x));
        }
        Ok(())
    }

    /// Measures the overlap on a line: from a point in B backwards out of B, and from there out of A; or, from a point in A, the other
    /// way around. The point may be on the surface of either mesh, so that rounding decides what it is in.
    fn add_line(&mut self, through: [f64; 3], kind: LineKind) -> Result<(), QueryError> {
        let (up, down) = (self.plane.normal, self.plane.normal.map(|x| -x));
        let along = |from: [f64; 3], length: f64, direction: [f64; 3]| {
            [0, 1, 2].map(|k| from[k] + length * direction[k])
        };
        let (a, b) = (&self.sides.a, &self.sides.b);
        let mut met = None;
        if let Some((t, normal_b)) = self.way_out(b, through, down)? {
            let bottom = along(through, t, down);
            let top = self.way_out(a, bottom, up)?;
            met = top.map(|(length, normal_a)| (along(bottom, length / 2.0, up), length, normal_a, normal_b));
        }
        if met.is_none()
            && let Some((t, normal_a)) = self.way_out(a, through, up)?
        {
            let top = along(through, t, up);
            let bottom = self.way_out(b, top, down)?;
            met =
                bottom.map(|(length, normal_b)| (along(top, length / 2.0, down), length, normal_a, normal_b));
        }
        if let Some((middle, length, normal_a, normal_b)) = met {
            let mut mean = MeanNormal::new(self.plane);
            mean.add(normal_a, normal_b);
            let deepest = self.deepest();
            if kind == LineKind::Center {
                self.add(middle, length, up);
            } else if deepest <= 0.0 || length <= MAX_RATIO * deepest {
                self.add(middle, length, unit(mean.0));
            }
        }
        Ok(())
    }

    fn deepest(&self) -> f64 {
        self.found.iter().fold(0.0, |most, of| most.max(of.point.depth))
    }

    /// Returns whether there is a point just outward of this one that is at least half as deep as the deepest one, so that measuring
    /// here would find none that is better. Of a box, these are its corners.
    fn has_deep_point_beyond(&self, near: [f64; 3]) -> bool {
        let deepest = self.deepest();
        let [x, y] = self.plane.place(near);
        let square = x * x + y * y;
        let is_beyond = |[p, q]: [f64; 2]| {
            let [along, across] = [p * x + q * y - square, p * y - q * x];
            along >= 0.0 && along <= 2.0 * INWARD * square && across.abs() <= 2.0 * INWARD * square
        };
        deepest > 0.0 && self.found.iter().any(|of| of.point.depth >= 0.5 * deepest && is_beyond(of.place))
    }

    /// Adds a point in which regions meet. It is on both surfaces, or between cores that are apart. Returns whether one of the surfaces
    /// is a wall there: only beside a wall may the overlap be deep.
    fn add_region_point(&mut self, contacts: &Contacts<'_>, vertex: usize) -> bool {
        let (mut mean, mut is_at_wall) = (MeanNormal::new(self.plane), false);
        let mut nearest: Option<(&ContactRegion, [f64; 3])> = None;
        for (region, _, vertices) in contacts.iter() {
            if let Some(place) = vertices.iter().position(|other| *other == vertex) {
                mean.add(region.normal_a, region.normal_b);
                let cosines = [region.normal_a, region.normal_b].map(|normal| dot(normal, self.plane.normal));
                is_at_wall |= cosines[0].min(-cosines[1]) < LEAST_COSINE_OF_FACES;
                if nearest.is_none_or(|(other, _)| region.overlap > other.overlap) {
                    nearest = region.points().get(place).map(|point| (region, *point));
                }
            }
        }
        let Some((region, point)) = nearest else { return false };
        let normal = unit(mean.0);
        let gap = self.sides.radii - region.overlap;
        // The point between cores is nearer to the one with the lesser radius.
        let to_middle = if gap > 0.0 { gap * (0.5 - self.sides.radius_a / self.sides.radii) } else { 0.0 };
        let middle = [0, 1, 2].map(|k| point[k] + to_middle * region.normal_a[k]);
        let cosine = dot(normal, self.plane.normal);
        if cosine > 0.0 {
            // Not minus zero where they meet.
            self.add(middle, 0.0 - gap / cosine, normal);
        }
        is_at_wall
    }

    /// Returns how far it is from a point in the core of a mesh to its surface, and the normal there; nothing if what is met first is
    /// the outside, or nothing.
    fn way_out(
        &mut self,
        mesh: &PlacedShape<'_>,
        from: [f64; 3],
        direction: [f64; 3],
    ) -> Result<Option<(f64, [f64; 3])>, QueryError> {
        let met = self.querier.first_of_core(mesh, from, direction)?;
        Ok(met.filter(|(_, normal)| dot(*normal, direction) > 0.0))
    }
}

/// A sum of normals. Each counts by the square of its cosine to the patch's normal, so that where a floor meets a wall, the floor's
/// counts, and the sum changes little where either turns a little.
struct MeanNormal<'p>([f64; 3], &'p PatchPlane);

impl<'p> MeanNormal<'p> {
    fn new(plane: &'p PatchPlane) -> Self {
        Self([0.0; 3], plane)
    }

    fn add(&mut self, normal_a: [f64; 3], normal_b: [f64; 3]) {
        for normal in [normal_a, normal_b.map(|x| -x)] {
            let cosine = dot(normal, self.1.normal).max(0.0);
            (0..3).for_each(|k| self.0[k] += cosine * cosine * normal[k]);
        }
    }
}

/// Which triangle of the core of a shape is met first?
struct FirstOfCore(First);

impl LineQuestion for FirstOfCore {
    fn line(&self) -> Line {
        self.0.line()
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.0.limit()
    }

    fn is_about_cores(&self) -> bool {
        true
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        self.0.decide(candidate)
    }
}
