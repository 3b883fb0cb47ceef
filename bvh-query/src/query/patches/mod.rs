//! Contact patches: contacts whose regions meet, with a centre, a normal and a depth.
//!
//! `join` finds which contacts belong together, `measure` what each patch is like, and rays how deep it is.

mod join;
mod measure;

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::narrow::{Triangle, dot, subtract};
use crate::pose::Pose;
use crate::query::options::{check, options};
use crate::query::patches::join::{Joined, Vertices};
use crate::query::patches::measure::Measured;
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::ray::{First, Ray};
use crate::query::querier::Querier;
use crate::query::regions::ContactRegion;
use crate::query::rounded::sum_of_radii;
use std::ops::Range;

options! {
    /// How contacts are joined into patches, and how many of them. By default contacts with a point in common are joined, and all
    /// of them are considered.
    pub struct PatchOptions {
        /// How far apart points of two contacts may be that belong together, in mesh units, beyond their errors. A query refuses a
        /// length that is negative or not finite.
        tolerance(f64): f64 = 0.0,
        /// The number of contacts that are considered, the first ones in ascending order. With fewer than all, patches may be cut
        /// off.
        max_contacts(usize): usize = usize::MAX,
    }
}

impl PatchOptions {
    pub(crate) fn check(&self) -> Result<(), QueryError> {
        check(NumberError::PatchTolerance, self.tolerance)
    }
}

/// Contacts that belong together, in A's frame and in mesh units. All but the first two numbers are rounded, and not certified.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

/// The answer of [`Querier::patches`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Patches {
    /// In the order of their lowest contacts.
    pub patches: Vec<Patch>,
    /// The contacts of the first patch, of the second one, and so on, in ascending order within each.
    pub regions: Vec<ContactRegion>,
    /// The number of all contacts.
    pub total: u64,
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
    /// The answer has the same bits on all backends. Cost: that of `contact_regions`, some 0.3 us more for each contact,
    /// up to ten rays for each patch, some 10 us, and while it runs some 1 KiB for each contact. These count as visits
    /// ([`Querier::set_budget`]), as do comparisons of points that are almost alike.
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
        let sides = PlacedSides { a: a.into(), b: b.at(pose), is_rounded: sum_of_radii(a, b) > 0.0 };
        let mut patches = Vec::with_capacity(ranges.len());
        for Range { start, end } in ranges {
            let contacts = &order[start..end];
            let Measured { center, normal, length, area } = measure::measure(&found, &vertices, contacts);
            let mut patch =
                Patch { first: start, count: end - start, center, normal, length, area, depth: 0.0 };
            patch.depth = if sides.is_rounded {
                contacts.iter().fold(0.0, |most: f64, &i| most.max(found[i].overlap))
            } else {
                self.thickness(&sides, &patch, contacts.iter().map(|&i| &triangles[i]))?
            };
            patches.push(patch);
        }
        Ok(Patches { patches, regions: order.iter().map(|&i| found[i]).collect(), total })
    }

    /// Returns the largest thickness of the overlap along some lines.
    fn thickness<'t>(
        &mut self,
        sides: &PlacedSides<'_>,
        patch: &Patch,
        triangles: impl Iterator<Item = &'t [Triangle; 2]>,
    ) -> Result<f64, QueryError> {
        let (up, down) = (patch.normal, patch.normal.map(|x| -x));
        if up == [0.0; 3] {
            return Ok(0.0);
        }
        let (mut deepest_a, mut deepest_b) = (Deepest::default(), Deepest::default());
        for [of_a, of_b] in triangles {
            of_a.iter().for_each(|corner| deepest_a.add(*corner, dot(up, subtract(*corner, patch.center))));
            of_b.iter().for_each(|corner| deepest_b.add(*corner, dot(down, subtract(*corner, patch.center))));
        }
        let mut depth =
            self.way_out(&sides.a, patch.center, up)? + self.way_out(&sides.b, patch.center, down)?;
        for corner in deepest_b.corners() {
            depth = depth.max(self.way_out(&sides.a, corner, up)?);
        }
        for corner in deepest_a.corners() {
            depth = depth.max(self.way_out(&sides.b, corner, down)?);
        }
        Ok(depth)
    }

    /// Returns how far it is from a point in a mesh to its surface, in a direction of length 1; 0 if what is hit first is the
    /// outside of the mesh, or nothing.
    fn way_out(
        &mut self,
        mesh: &PlacedShape<'_>,
        from: [f64; 3],
        direction: [f64; 3],
    ) -> Result<f64, QueryError> {
        // Placed vertices may be farther out than rays can start.
        let Ok(mut first) = First::new(&Ray::new(from, direction)) else { return Ok(0.0) };
        self.ask_line(mesh, &mut first)?;
        Ok(first.way_out().unwrap_or(0.0))
    }
}

/// The shapes of a question, in A's frame.
struct PlacedSides<'a> {
    a: PlacedShape<'a>,
    b: PlacedShape<'a>,
    is_rounded: bool,
}

/// The number of vertices of each mesh from which the depth of a patch is measured.
const DEEP_VERTICES: usize = 4;

/// The vertices that reach farthest beyond the centre in a direction.
#[derive(Default)]
struct Deepest {
    found: [(f64, [f64; 3]); DEEP_VERTICES],
    count: usize,
}

impl Deepest {
    /// Ties go to the corner that comes first.
    fn add(&mut self, corner: [f64; 3], depth: f64) {
        let found = &self.found[..self.count];
        let place = found.iter().position(|(other, _)| depth > *other).unwrap_or(self.count);
        if depth <= 0.0 || place == DEEP_VERTICES || found.iter().any(|(_, other)| *other == corner) {
            return;
        }
        self.count = (self.count + 1).min(DEEP_VERTICES);
        self.found[place..self.count].rotate_right(1);
        self.found[place] = (depth, corner);
    }

    fn corners(&self) -> impl Iterator<Item = [f64; 3]> {
        self.found.into_iter().take(self.count).map(|(_, corner)| corner)
    }
}
