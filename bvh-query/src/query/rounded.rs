//! Shapes with a radius, and solid shapes: what is asked of their cores, and what that means for the shapes.
//!
//! Two shapes touch if their cores are within the sum of their radii, so a question about shapes is one about cores with a
//! larger distance to compare with. If the surfaces do not touch, each connected part of one shape is wholly inside the other
//! or wholly outside, and one point of the part tells which.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::options::DistanceOptions;
use crate::query::pair_search::PairSearch;
use crate::query::probe::placed::PlacedShape;
use crate::query::querier::Querier;

/// Returns how far apart two cores may be for the shapes to touch.
pub(crate) fn sum_of_radii(a: Shape<'_>, b: Shape<'_>) -> f64 {
    a.radius() + b.radius()
}

/// Returns how far apart two cores may be for the shapes to be within a distance.
pub(crate) fn limit_of_cores(a: Shape<'_>, b: Shape<'_>, d: f64) -> f64 {
    (sum_of_radii(a, b) + d).min(f64::MAX)
}

impl Querier {
    /// Returns whether two shapes are within a distance that has been checked, insides of solids included.
    pub(super) fn shapes_within(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        let near = self.cores_within(a, b, pose, limit_of_cores(a, b, d))?;
        Ok(near || self.inside_point(a, b, pose)?.is_some())
    }

    /// Returns whether the surfaces of two cores are within a distance that has been checked.
    pub(super) fn cores_within(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        if d == 0.0 {
            return Ok(self.any_contact(a, b, pose)?.is_some());
        }
        let mut search = PairSearch::new(DistanceOptions::default(), d);
        self.search(a, b, pose, &mut search)?;
        Ok(search.done)
    }

    /// Returns a point of one shape's core that is inside the other shape, which is solid, in A's frame. The surfaces of the
    /// shapes do not touch.
    pub(super) fn inside_point(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Option<[f64; 3]>, QueryError> {
        if !a.is_solid() && !b.is_solid() {
            return Ok(None);
        }
        let (own, placed) = (PlacedShape::from(a), b.at(pose));
        let mut found = None;
        if b.is_solid() {
            found = self.first_inside(&own, &placed)?;
        }
        if found.is_none() && a.is_solid() {
            found = self.first_inside(&placed, &own)?;
        }
        Ok(found)
    }
}

/// Returns the point at a share of the way from one point to another.
pub(super) fn between(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + share * (to[k] - from[k]))
}
