//! How deep a patch is: the thickness of the overlap along some lines.

use crate::error::QueryError;
use crate::narrow::{Triangle, dot, subtract};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::ray::{First, Ray};
use crate::query::querier::Querier;

impl Querier {
    /// Returns the largest thickness of the overlap along some lines. Its centre and its normal tell where the patch is.
    pub(super) fn thickness<'t>(
        &mut self,
        sides: &PlacedSides<'_>,
        [center, normal]: [[f64; 3]; 2],
        triangles: impl Iterator<Item = &'t [Triangle; 2]>,
    ) -> Result<f64, QueryError> {
        let (up, down) = (normal, normal.map(|x| -x));
        if up == [0.0; 3] {
            return Ok(0.0);
        }
        let (mut deepest_a, mut deepest_b) = (Deepest::default(), Deepest::default());
        for [of_a, of_b] in triangles {
            of_a.iter().for_each(|corner| deepest_a.add(*corner, dot(up, subtract(*corner, center))));
            of_b.iter().for_each(|corner| deepest_b.add(*corner, dot(down, subtract(*corner, center))));
        }
        let mut depth = self.way_out(&sides.a, center, up)? + self.way_out(&sides.b, center, down)?;
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
pub(super) struct PlacedSides<'a> {
    pub(super) a: PlacedShape<'a>,
    pub(super) b: PlacedShape<'a>,
    pub(super) radius_a: f64,
    /// The sum of both radii.
    pub(super) radii: f64,
}

/// The number of vertices of each mesh from which the depth of a patch is measured.
const DEEP_VERTICES: usize = 4;

/// The deepest vertices.
#[derive(Default)]
pub(super) struct Deepest {
    found: [(f64, [f64; 3]); DEEP_VERTICES],
    count: usize,
}

impl Deepest {
    /// Ties go to the corner that comes first.
    pub(super) fn add(&mut self, corner: [f64; 3], depth: f64) {
        let found = &self.found[..self.count];
        let place = found.iter().position(|(other, _)| depth > *other).unwrap_or(self.count);
        if depth <= 0.0 || place == DEEP_VERTICES || found.iter().any(|(_, other)| *other == corner) {
            return;
        }
        self.count = (self.count + 1).min(DEEP_VERTICES);
        self.found[place..self.count].rotate_right(1);
        self.found[place] = (depth, corner);
    }

    pub(super) fn corners(&self) -> impl Iterator<Item = [f64; 3]> {
        self.found.into_iter().take(self.count).map(|(_, corner)| corner)
    }
}
