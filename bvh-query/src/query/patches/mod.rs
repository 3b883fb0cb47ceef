//! Contact patches: contacts whose regions meet, with a centre, a normal and a depth.
//!
//! `join` finds which contacts belong together, `measure` what each patch is like, and `thickness` how deep it is. `points`
//! finds where it pushes, and `choice` chooses a few of these points.

pub(crate) mod choice;
mod join;
mod measure;
mod points;
mod thickness;

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::options::{check, options};
use crate::query::patches::choice::PatchPoint;
use crate::query::patches::join::{Joined, Vertices};
use crate::query::patches::measure::Measured;
use crate::query::patches::points::Contacts;
use crate::query::patches::thickness::PlacedSides;
use crate::query::querier::Querier;
use crate::query::regions::ContactRegion;
use crate::query::rounded::sum_of_radii;
use std::ops::Range;

options! {
    /// How contacts are joined into patches, and how many of them. By default contacts with a point in common are joined, and all
    /// of them are considered.
    ///
    /// [`Querier::patches`] has an example.
    pub struct PatchOptions {
        /// How far apart points of two contacts may be that belong together, in mesh units, beyond their errors. A query refuses a
        /// length that is negative or not finite.
        tolerance(f64): f64 = 0.0,
        /// The number of contacts that are considered, the first ones in ascending order. With fewer than all, patches may be cut
        /// off.
        max_contacts(usize): usize = usize::MAX,
        /// The largest number of contact points of each patch, of which [`Querier::patches`] says which these are. By default
        /// none are computed.
        max_points(usize): usize = 0,
    }
}

impl PatchOptions {
    pub(crate) fn check(&self) -> Result<(), QueryError> {
        check(NumberError::PatchTolerance, self.tolerance)
    }
}

/// Contacts that belong together, in A's frame and in mesh units. All but the first two numbers are rounded, and not certified.
///
/// [`Querier::patches`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Patch {
    /// The place of its first contact in [`Patches::regions`].
    pub first: usize,
    /// The number of its contacts.
    pub count: usize,
    /// The mean of its polygons by area, if triangles face each other in one plane; else of its curves by length; else of its
    /// points, which for rounded shapes count by how far they overlap.
    pub center: [f64; 3],
    /// The direction in which A pushes B, at length 1; 0 if the normals cancel. See [`Querier::patches`].
    pub normal: [f64; 3],
    /// The length of the curves in which the surfaces meet. Each curve counts once, also along an edge that triangles share.
    pub length: f64,
    /// The area of what triangles have in common that are in one plane.
    pub area: f64,
    /// An estimate of how far B has to move along the normal to leave A here. See [`Querier::patches`].
    pub depth: f64,
    /// The place of its first contact point in [`Patches::points`].
    pub first_point: usize,
    /// The number of its contact points, at most [`PatchOptions::max_points`].
    pub point_count: usize,
}

/// The answer of [`Querier::patches`], which has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Unchecked"))]
#[non_exhaustive]
pub struct Patches {
    /// In the order of their lowest contacts.
    pub patches: Vec<Patch>,
    /// The contacts of the first patch, of the second one, and so on, in ascending order within each.
    pub regions: Vec<ContactRegion>,
    /// The contact points of the first patch, of the second one, and so on; none unless [`PatchOptions::max_points`] is above 0.
    pub points: Vec<PatchPoint>,
    /// The number of all contacts.
    pub total: u64,
}

/// Patches as they are read, which may name places beyond the lists.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Unchecked {
    patches: Vec<Patch>,
    regions: Vec<ContactRegion>,
    points: Vec<PatchPoint>,
    total: u64,
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for Patches {
    type Error = &'static str;

    fn try_from(Unchecked { patches, regions, points, total }: Unchecked) -> Result<Self, &'static str> {
        let is_within =
            |first: usize, count: usize, of: usize| first.checked_add(count).is_some_and(|end| end <= of);
        let are_within = patches.iter().all(|patch| {
            is_within(patch.first, patch.count, regions.len())
                && is_within(patch.first_point, patch.point_count, points.len())
        });
        if are_within && regions.len() as u64 <= total {
            return Ok(Self { patches, regions, points, total });
        }
        Err("expected patches whose contacts and points are in the lists, found others")
    }
}

impl Patches {
    /// Returns whether there are more contacts than were considered.
    pub fn is_truncated(&self) -> bool {
        (self.regions.len() as u64) < self.total
    }
}

impl Querier {
    /// Returns the contacts of [`Querier::contact_regions`], joined into connected patches.
    ///
    /// **Which contacts belong together.** Two contacts do if a point of one is no farther from a point of the other than the sum
    /// of their errors and `tolerance`, and so do chains of them. A curve that passes from one triangle to the next has the same
    /// point on both sides of the edge, so closed meshes give closed loops. Meshes whose triangles meet in the middle of an edge
    /// may need a tolerance, and so do rounded shapes, whose contacts are single points.
    ///
    /// **Normal.** Let S be the sum of the area vectors of the patch's curves, directed as
    /// [`ContactRegion::points`] says, and of its polygons. For a closed loop this is the integral of A's normal over the part
    /// of A's surface that the loop bounds, and moving B along it reduces the volume of the overlap fastest. The normal is S
    /// at length 1. If S is zero to within its error, as for points and for edges that only touch, or if it points against the
    /// mean of A's normals less B's, as for the inner rim of a pipe, the normal is that mean, by area, length or number.
    ///
    /// **Depth.** A line along the normal is followed from the centre until it leaves A, and backwards until it leaves B. The sum
    /// is the thickness of the overlap there. Likewise from four vertices of the patch's triangles of B that reach farthest into
    /// A, and from four of A. The depth is the largest thickness. Moving B by depth times normal separates the meshes along
    /// these lines, which is all of the patch where its deepest point is a vertex or below the centre; it is an estimate. For
    /// rounded shapes the depth is the largest `overlap`.
    ///
    /// **Points.** Simulators need a few points at which a patch pushes ([`PatchOptions::max_points`]). The curve does not give
    /// them, because surfaces that cross are not deep there. Candidates are the vertices of the patch's triangles that are
    /// inside the other mesh, the points of its regions, and the middles of the overlap on lines along the normal: through the
    /// centre, and a 512th inward of the outermost points of regions that are at walls. Each has its depth along its line
    /// ([`PatchPoint::depth`]); that of points of regions is 0. If the line from a vertex is more than twice as long as the way
    /// to the plane of the nearest triangle with which its own ones are in contact, that plane counts: in a sliver between
    /// walls, the line may leave the overlap anywhere. The deepest candidate is chosen first, and then, one by one, that which
    /// most enlarges the outline of those chosen, seen along the normal. There, deep points count for up to twice as much as
    /// those that are not deep. A point that enlarges the outline by less than a 256th is not chosen, so there may be fewer
    /// points than `max_points`: four for a box on a floor, and about 16 at most for a round outline.
    ///
    /// A small change of the pose changes the points by little, unless another candidate becomes the better one. Candidates that are
    /// equal but for a thousandth are told apart by a fixed direction of A's frame, turned into the plane of the patch, so noise does
    /// not exchange them. What can still jump: points on a round outline, which pass from vertex to vertex; the order of points and,
    /// where there are more corners than `max_points`, the selection, if depths differ by just that thousandth; a normal, where a
    /// line passes from one face to another one across an edge; all points, where patches join or part.
    ///
    /// Patches of rounded shapes need a `tolerance`, or most of them are one contact. A vertex whose triangles are in several
    /// patches may be a point of each.
    ///
    /// The answer has the same bits on all backends. Cost: that of `contact_regions`, some 0.3 us more for each contact,
    /// up to ten rays for each patch, some 10 us, and while it runs some 1 KiB for each contact. Points take up to 60 rays more for
    /// each patch, or 108 if more than eight are wanted, and 84 or 148 for rounded shapes: some 8 us for a box on a floor, and 40 us
    /// for a round patch. All of these count as visits ([`Querier::set_budget`]), as do comparisons of points that are almost alike.
    ///
    /// ```
    /// use bvh_query::{Patch, PatchOptions, PatchPoint, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let small = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([1.0; 3])?, &Default::default())?.0)?;
    /// // The small block has sunk into the top of the other one by 0.1.
    /// let sunk = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 1.4])?;
    /// let found = Querier::new()?.patches(&block, &small, &sunk, &PatchOptions::new().max_points(4))?;
    /// let [Patch { normal, depth, first_point, point_count, .. }] = found.patches[..] else { panic!() };
    /// assert_eq!(normal, [0.0, 0.0, 1.0]);
    /// assert!((depth - 0.1).abs() < 1e-9);
    /// for PatchPoint { point, depth, .. } in &found.points[first_point..first_point + point_count] {
    ///     assert!(point[2] < 1.0 && (depth - 0.1).abs() < 1e-9); // the four lower corners
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if the tolerance is negative, NaN or infinite; else the errors of [`Querier::contacts`].
    pub fn patches<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &PatchOptions,
    ) -> Result<Patches, QueryError> {
        options.check()?;
        self.start();
        let (a, b) = (a.into(), b.into());
        let (mut found, mut triangles) = (Vec::new(), Vec::new());
        let total = self.visit_regions(a, b, pose, options.max_contacts, &mut |region, of_region| {
            found.push(region);
            triangles.push(of_region);
        })?;
        let vertices = Vertices::new(&found, 0.0, &mut self.memory.budget)?;
        let Joined { order, ranges } = if options.tolerance > 0.0 {
            Vertices::new(&found, options.tolerance, &mut self.memory.budget)?.join()
        } else {
            vertices.join()
        };
        let sides =
            PlacedSides { a: a.into(), b: b.at(pose), radius_a: a.radius(), radii: sum_of_radii(a, b) };
        let (mut patches, mut points) = (Vec::with_capacity(ranges.len()), Vec::new());
        for Range { start, end } in ranges {
            let contacts = &order[start..end];
            let Measured { center, normal, length, area } = measure::measure(&found, &vertices, contacts);
            let mut patch = Patch {
                first: start,
                count: end - start,
                center,
                normal,
                length,
                area,
                depth: 0.0,
                first_point: points.len(),
                point_count: 0,
            };
            patch.depth = if sides.radii > 0.0 {
                contacts.iter().fold(0.0, |most: f64, &i| most.max(found[i].overlap))
            } else {
                self.thickness(&sides, [center, normal], contacts.iter().map(|&i| &triangles[i]))?
            };
            let of_patch =
                Contacts { regions: &found, triangles: &triangles, vertices: &vertices, numbers: contacts };
            points.extend(self.points_of_patch(&sides, [center, normal], &of_patch, options.max_points)?);
            patch.point_count = points.len() - patch.first_point;
            patches.push(patch);
        }
        Ok(Patches { patches, regions: order.iter().map(|&i| found[i]).collect(), points, total })
    }
}
