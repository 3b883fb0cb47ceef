//! Where triangles in contact meet: points, segments and polygons.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::leaf::queue::TrianglePair;
use crate::narrow::{Closest, MAX_POINTS, Triangle, common_region, unit, unit_normal};
use crate::pose::Pose;
use crate::query::contacts::Contact;
use crate::query::exact::{TriangleDistance, placed, stored_at};
use crate::query::querier::Querier;
use crate::query::rounded::{between, sum_of_radii};
use std::ops::ControlFlow;

/// What two triangles have in common. The bindings of other languages use its numbers: `kind as u8`.
///
/// [`Querier::contact_regions`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum RegionKind {
    /// They touch in one point.
    Point = 0,
    /// They meet in a segment: they cross, or an edge touches.
    Segment = 1,
    /// They overlap in one plane, in a convex polygon.
    Polygon = 2,
}

/// Where two triangles in contact meet, in A's frame and in mesh units.
///
/// [`Querier::contact_regions`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ContactRegion {
    /// The triangles.
    pub contact: Contact,
    /// What they have in common, by exact predicates.
    pub kind: RegionKind,
    /// The number of [`points`](Self::points).
    pub count: u8,
    /// The first `count` of these are the points; the rest are 0.
    pub all_points: [[f64; 3]; 6],
    /// The unit normal of A's triangle, in the orientation that its corners have; 0 if it has no area. Between two rounded
    /// shapes whose cores are apart, the direction from A's core to B's.
    pub normal_a: [f64; 3],
    /// The unit normal of B's triangle; between two rounded shapes whose cores are apart, the opposite of `normal_a`.
    pub normal_b: [f64; 3],
    /// A certified bound: each point is at most this far from the exact one, and so from both triangles. For rounded shapes, the
    /// point is at most this far outside of either.
    pub error: f64,
    /// How far two rounded triangles overlap: the sum of the radii less the distance of the triangles, at least 0; 0 for shapes
    /// without radii.
    pub overlap: f64,
}

impl ContactRegion {
    /// Returns the points: one point, the two ends of a segment, or up to six corners of a polygon.
    ///
    /// Where two planes cross, the ends follow the cross product of `normal_a` and `normal_b`, so that the segments of closed
    /// meshes form directed loops; the ends of other segments are in ascending order. The corners of a polygon go around it
    /// counterclockwise, seen from where `normal_a` points to. A polygon so thin that rounding aligns its corners has fewer of
    /// them, and perhaps only one.
    pub fn points(&self) -> &[[f64; 3]] {
        self.all_points.get(..usize::from(self.count)).unwrap_or(&self.all_points)
    }
}

/// The answer of [`Querier::contact_regions`], which has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ContactRegions {
    /// The first contacts in ascending order, up to the limit.
    pub regions: Vec<ContactRegion>,
    /// The number of all contacts.
    pub total: u64,
}

impl ContactRegions {
    /// Returns whether there are more contacts than were asked for.
    pub fn is_truncated(&self) -> bool {
        (self.regions.len() as u64) < self.total
    }
}

impl Querier {
    /// Returns where the triangles in contact meet, for the contacts of [`Querier::contacts`] in ascending order; at most `limit`
    /// of them, and the number of all.
    ///
    /// Exact predicates decide what two triangles have in common, and each constructed point has a certified error: a few
    /// roundings of its coordinates and at most 2^-40 of the edge that it is on. For shapes with radii, a contact of cores that
    /// are apart is one point between the closest points of both triangles. A part of a mesh that is inside a solid one without
    /// touching its surface has no region. The answer has the same bits on all backends. Triangles without radii have the same
    /// points whichever is A, as long as their vertices are placed on the same numbers.
    ///
    /// Cost: that of [`Querier::contacts`], some 40 bytes for each contact while it runs, and some 0.3 us for each region; some
    /// microseconds where triangles are almost in one plane. Each contact counts as a visit ([`Querier::set_budget`]). The
    /// method is that of P. Guigue and O. Devillers (2003); `spec/numerics.md` derives the error.
    ///
    /// ```
    /// use bvh_query::{ContactRegion, Pose, Querier, RegionKind};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
    /// # let triangle = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &Default::default())?.0)?;
    /// // The triangle lies in the plane z = 0, and its right angle is at x = 0.5 in the block.
    /// let across = Pose::new(*Pose::IDENTITY.rotation(), [0.5, 0.25, 0.0])?;
    /// let found = Querier::new()?.contact_regions(&block, &triangle, &across, usize::MAX)?;
    /// assert_eq!(found.total, found.regions.len() as u64);
    /// for region in &found.regions {
    ///     assert_eq!(region.kind, RegionKind::Segment);
    ///     assert!(region.points().iter().all(|point| point[0] == 1.0 || point[1] == 1.0));
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::contacts`].
    pub fn contact_regions<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        limit: usize,
    ) -> Result<ContactRegions, QueryError> {
        self.start();
        let (a, b) = (a.into(), b.into());
        let mut regions = Vec::new();
        let total = self.visit_regions(a, b, pose, limit, &mut |region, _| regions.push(region))?;
        Ok(ContactRegions { regions, total })
    }

    /// Calls `visit` for the first contacts in ascending order, with both triangles in A's frame. Returns the number of all.
    pub(super) fn visit_regions(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        limit: usize,
        visit: &mut dyn FnMut(ContactRegion, [Triangle; 2]),
    ) -> Result<u64, QueryError> {
        let mut contacts = Vec::new();
        let total = self.visit_places(a, b, pose, &mut |contact, pair| {
            contacts.push((contact, pair));
            ControlFlow::Continue(())
        })?;
        contacts.sort_unstable_by_key(|(contact, pair)| (*contact, pair.place_a(), pair.place_b()));
        contacts.truncate(limit);
        for (contact, pair) in contacts {
            if let Some(triangles) = triangles_of(a, b, pose, &contact, &pair)? {
                visit(self.region(a, b, contact, &triangles), triangles);
            }
        }
        Ok(total)
    }

    /// Returns where two triangles in contact meet.
    fn region(
        &self,
        a: Shape<'_>,
        b: Shape<'_>,
        contact: Contact,
        [of_a, of_b]: &[Triangle; 2],
    ) -> ContactRegion {
        let (radii, mut overlap) = (sum_of_radii(a, b), 0.0);
        if radii > 0.0 {
            let closest = self.backend.run(TriangleDistance(of_a, of_b));
            overlap = (radii - closest.distance).max(0.0);
            if closest.distance > 0.0 {
                return rounded_region(contact, [of_a, of_b], &closest, a.radius(), radii);
            }
        }
        let region = common_region(of_a, of_b);
        let kind = match region.corners {
            0 | 1 => RegionKind::Point,
            2 => RegionKind::Segment,
            _ => RegionKind::Polygon,
        };
        ContactRegion {
            contact,
            kind,
            count: region.count as u8,
            all_points: region.points,
            normal_a: unit_normal(of_a),
            normal_b: unit_normal(of_b),
            error: region.error,
            overlap,
        }
    }
}

/// Returns both triangles of a contact in A's frame. Contacts name objects that the shapes have.
fn triangles_of(
    a: Shape<'_>,
    b: Shape<'_>,
    pose: &Pose,
    contact: &Contact,
    pair: &TrianglePair,
) -> Result<Option<[Triangle; 2]>, QueryError> {
    let (Some(object_a), Some(object_b)) = (a.numbered(contact.object_a), b.numbered(contact.object_b))
    else {
        return Ok(None);
    };
    let of_a = stored_at(a.bvh(), object_a, pair.place_a())?;
    let of_b = stored_at(b.bvh(), object_b, pair.place_b())?;
    Ok(Some([of_a, placed(&of_b, pose)]))
}

/// Returns the contact of two rounded triangles that are apart: a point between the closest ones, in proportion to the radii.
///
/// The exact point is at most the radius of A, and that of B, from the exact feet of the closest points, but for what `upper`
/// is above the sum. The feet are placed with less than six roundings of the corners and of the edges, and the point between
/// them with three more.
fn rounded_region(
    contact: Contact,
    triangles: [&Triangle; 2],
    closest: &Closest,
    radius_a: f64,
    radii: f64,
) -> ContactRegion {
    let largest = |triangle: &Triangle| {
        (0..3).map(|k| triangle.iter().fold(0.0, |most: f64, p| most.max(p[k].abs()))).sum::<f64>()
    };
    let magnitude = largest(triangles[0]) + largest(triangles[1]);
    let direction = unit([0, 1, 2].map(|k| closest.point_b[k] - closest.point_a[k]));
    let mut all_points = [[0.0; 3]; MAX_POINTS];
    all_points[0] = between(closest.point_a, closest.point_b, radius_a / radii);
    ContactRegion {
        contact,
        kind: RegionKind::Point,
        count: 1,
        all_points,
        normal_a: direction,
        normal_b: direction.map(|x| -x),
        error: (closest.upper - radii).max(0.0) + 32.0 * f64::EPSILON * magnitude,
        overlap: (radii - closest.distance).max(0.0),
    }
}
