//! What two meshes have in common: its volume, its box, and how thick the one is where the other passes through it.
//!
//! ```text
//! surface   the triangles of each mesh in the other's box, with shared vertices
//! cuts      where triangles pass through each other: points and segments, decided exactly
//! windings  how often the other mesh winds around vertices
//! measure   volume, areas and box
//! polygons  the parts of a face, with their holes
//! pierced   which parts of a surface are connected, and how far apart those are that are not
//! ```
//!
//! What of a face is inside the other mesh is known by the lines around it: parts of edges, and segments in which triangles cross. Sums
//! over these give areas and the volume; polygons are made of them where holes matter, and for those who draw them.

mod cuts;
mod measure;
mod pierced;
mod polygons;
mod surface;
mod windings;

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::pose::Pose;
use crate::query::depth::balls::bounds;
use crate::query::depth::options::check_closed;
use crate::query::intersection::cuts::Cuts;
use crate::query::intersection::measure::Measure;
use crate::query::intersection::pierced::Parts;
use crate::query::intersection::polygons::polygons;
use crate::query::intersection::surface::Surface;
use crate::query::placed_pair::each_pair;
use crate::query::probe::placed::PlacedShape;
use crate::query::querier::Querier;
use crate::traverse::walk::Order;
use std::ops::ControlFlow;

/// What two shapes have in common, in mesh units.
///
/// [`Querier::intersection`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Intersection {
    /// The volume of the intersection.
    pub volume: f64,
    /// A certified bound: the volume is off by at most this.
    pub volume_error: f64,
    /// The area of A's surface inside B. It is rounded, and not certified, like all numbers below.
    pub area_a: f64,
    /// The area of B's surface inside A.
    pub area_b: f64,
    /// The least and the largest coordinates of the intersection, in A's frame; `None` if it is empty.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// How thick A is where B passes through it; `None` if B passes through A nowhere. See [`Querier::intersection`].
    pub pierced_a: Option<f64>,
    /// How thick B is where A passes through it.
    pub pierced_b: Option<f64>,
}

/// The boundary of what two meshes have in common, in A's frame.
///
/// [`Querier::intersection_surface`] has an example.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Unchecked"))]
#[non_exhaustive]
pub struct IntersectionSurface {
    /// The corners of all polygons, loop by loop.
    pub points: Vec<[f64; 3]>,
    /// The number of corners of each loop. Seen from outside, an outline goes around counterclockwise and holes clockwise, unless the mesh
    /// is turned inside out.
    pub loops: Vec<u32>,
    /// The number of loops of each polygon: its outline and then its holes.
    pub polygons: Vec<u32>,
}

/// A boundary as it is read, whose numbers need not add up.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Unchecked {
    points: Vec<[f64; 3]>,
    loops: Vec<u32>,
    polygons: Vec<u32>,
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for IntersectionSurface {
    type Error = &'static str;

    fn try_from(Unchecked { points, loops, polygons }: Unchecked) -> Result<Self, &'static str> {
        let sum = |numbers: &[u32]| numbers.iter().map(|&number| u64::from(number)).sum::<u64>();
        if sum(&loops) == points.len() as u64 && sum(&polygons) == loops.len() as u64 {
            return Ok(Self { points, loops, polygons });
        }
        Err("expected as many points and loops as the loops and polygons count, found others")
    }
}

/// What the boundary of an intersection is made of.
struct Common {
    surfaces: [Surface; 2],
    cuts: Cuts,
    /// How often the other mesh winds around each vertex.
    windings: [Vec<i64>; 2],
}

impl Querier {
    /// Returns the volume of what two closed meshes have in common, its box, the area of each surface in it, and how thick the meshes
    /// are where they pierce each other. B is placed by a pose in A's frame.
    ///
    /// **Volume.** Exact signs decide which triangles cross and what is inside; points where they cross are rounded, and the error that
    /// this and all sums can cause at most is returned. Each place counts as often as the surfaces wind around it: where parts of one
    /// mesh overlap, unite them before baking. A mesh turned inside out has the same volume.
    ///
    /// **Pierced.** B is pierced where A enters it through one part of B's surface and leaves it through another one: the thickness is
    /// the least distance between two such parts, which lie inside A and do not meet there. Both have to be on the boundary of one
    /// connected piece of the intersection, so that the gap between two teeth of a comb is no thickness. A duct of any length through a
    /// wall pierces the wall by the wall's thickness. If A only reaches into B, or takes a corner of it along, the parts of B's surface
    /// inside A are connected, and B is not pierced. If A cuts across a corner without its edge, the distance is that of the
    /// two sides there. Two plates that cross may pierce each other.
    ///
    /// **Flush faces.** The answer is that for a B moved by less than any number, down the y-axis, by much less down the z-axis, and by
    /// much less again down the x-axis. So a common
    /// face encloses nothing. Of two solids on one side of it, it belongs to the surface of either A or B. Of solids on both sides, it
    /// belongs to both surfaces if the move is towards A, and then is in the box; else to neither. Whether parts meet along it follows
    /// from that move, too.
    ///
    /// All numbers have the same bits on all backends. Radii are left out. Cost: that of [`Querier::contacts`], some 0.5 us for each of
    /// them, and some 0.1 us and 100 bytes for each triangle in the box of the other mesh; more, up to some 20 us for each contact, where
    /// hundreds of thousands of them lie in a few faces.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let overlapping = Pose::new(*Pose::IDENTITY.rotation(), [1.5, 1.0, 0.5])?;
    /// let shared = Querier::new()?.intersection(&block, &block, &overlapping)?;
    /// assert!((shared.volume - 0.5 * 1.0 * 1.5).abs() <= shared.volume_error);
    /// assert_eq!(shared.bounds, Some([[0.5, 0.0, -0.5], [1.0, 1.0, 1.0]]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::NotClosed`] if an object of a shape has no inside; [`QueryError::NoTopology`] if a file was baked without topology;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, or the topology states what is not so;
    /// [`QueryError::Budget`] if the budget does not suffice.
    pub fn intersection<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Intersection, QueryError> {
        self.start();
        self.intersection_along(a.into(), b.into(), pose, Pose::IDENTITY.rotation())
    }

    /// Returns the intersection, with its box along other axes than those of A's frame.
    pub(crate) fn intersection_along(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        axes: &[[f64; 3]; 3],
    ) -> Result<Intersection, QueryError> {
        let Common { surfaces, cuts, windings } = self.common(a, b, pose)?;
        let middle = cuts.middle().unwrap_or_else(|| {
            let [[lo_a, hi_a], [lo_b, hi_b]] = [PlacedShape::from(a), b.at(pose)].each_ref().map(bounds);
            [0, 1, 2].map(|k| (lo_a[k].max(lo_b[k]) + hi_a[k].min(hi_b[k])) / 2.0)
        });
        let mut measure = Measure::new(middle, axes);
        let mut parts = Parts::new(cuts.nodes.len());
        let budget = &mut self.memory.budget;
        cuts.each_face(&surfaces, &windings, |side, face, arcs| {
            measure.add(&cuts.nodes, side, arcs);
            parts.add(&cuts.nodes, &surfaces[side], side, face, arcs, budget)
        })?;
        let (volume, volume_error) = measure.volume();
        let budget = &mut self.memory.budget;
        let [pierced_a, pierced_b] =
            [parts.pierced(&cuts, &surfaces[0], 0, budget)?, parts.pierced(&cuts, &surfaces[1], 1, budget)?];
        let [area_a, area_b] = measure.areas;
        let bounds = measure.bounds;
        Ok(Intersection { volume, volume_error, area_a, area_b, bounds, pierced_a, pierced_b })
    }

    /// Returns the boundary of what two closed meshes have in common, as polygons, for those who draw it: the parts of A's faces inside B,
    /// and then those of B's faces inside A. See [`Querier::intersection`]. Its points are rounded; parts that are next to each other have
    /// the same points, so that there is no gap between them.
    ///
    /// ```
    /// use bvh_query::{IntersectionSurface, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let overlapping = Pose::new(*Pose::IDENTITY.rotation(), [1.5, 1.0, 0.5])?;
    /// let IntersectionSurface { points, loops, polygons, .. } =
    ///     Querier::new()?.intersection_surface(&block, &block, &overlapping)?;
    /// let mut rest = &points[..];
    /// for &corners in &loops {
    ///     let (corners, after) = rest.split_at(corners as usize); // the corners of one loop
    ///     assert!(corners.len() >= 3);
    ///     rest = after;
    /// }
    /// assert!(rest.is_empty() && polygons.iter().all(|&loops| loops == 1)); // no holes
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::intersection`].
    pub fn intersection_surface<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<IntersectionSurface, QueryError> {
        self.start();
        let Common { surfaces, cuts, windings } = self.common(a.into(), b.into(), pose)?;
        let mut found = IntersectionSurface::default();
        cuts.each_face(&surfaces, &windings, |side, face, arcs| {
            for polygon in
                polygons(&cuts.nodes, &surfaces[side].triangle(face), arcs, &mut self.memory.budget)?
            {
                found.polygons.push(polygon.len() as u32);
                for way in polygon {
                    found.loops.push(way.len() as u32);
                    found.points.extend(way.into_iter().map(|node| cuts.nodes[node as usize].point));
                }
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Finds what the boundary of the intersection is made of.
    fn common(&mut self, a: Shape<'_>, b: Shape<'_>, pose: &Pose) -> Result<Common, QueryError> {
        check_closed(a, b)?;
        let (own, other) = (PlacedShape::from(a), b.at(pose));
        let mut surfaces = [self.surface_near(&own, &other)?, self.surface_near(&other, &own)?];
        let pairs = self.touching_faces(a, b, pose, &mut surfaces)?;
        let cuts = Cuts::new(&surfaces, &pairs);
        let windings = [
            self.windings(&surfaces[0], &cuts.of_edges[0], &other, 1.0)?,
            self.windings(&surfaces[1], &cuts.of_edges[1], &own, -1.0)?,
        ];
        Ok(Common { surfaces, cuts, windings })
    }

    /// Returns the pairs of faces that touch, in ascending order, and marks these.
    fn touching_faces(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        surfaces: &mut [Surface; 2],
    ) -> Result<Vec<[u32; 2]>, QueryError> {
        let mut pairs = Vec::new();
        let [of_a, of_b] = surfaces;
        each_pair(a, b, pose, |placed| {
            self.memory.budget.visit()?;
            // The walk has the budget meanwhile: it may report no more than is left now.
            let budget = self.memory.budget.clone();
            let before = pairs.len() as u64;
            let (object_a, object_b) = placed.numbers;
            let objects = [object_a - a.first() as u32, object_b - b.first() as u32];
            let visit = &mut |pair: TrianglePair| {
                if pairs.len() as u64 - before == budget.left() {
                    return Err(budget.error());
                }
                let face_a = of_a.face_at(objects[0], pair.place_a())?;
                let face_b = of_b.face_at(objects[1], pair.place_b())?;
                of_a.faces[face_a as usize].is_cut = true;
                of_b.faces[face_b as usize].is_cut = true;
                pairs.push([face_a, face_b]);
                Ok(ControlFlow::Continue(()))
            };
            self.walk_contacts(placed, Order::Any, TriangleQueue::FULL, visit)?;
            self.memory.budget.charge(pairs.len() as u64 - before)?;
            Ok(None::<()>)
        })?;
        pairs.sort_unstable();
        Ok(pairs)
    }
}
