//! Shapes with a radius, and solid shapes: what is asked of their cores, and what that means for the shapes.
//!
//! Two shapes touch if their cores are within the sum of their radii, so a question about shapes is one about cores with a
//! larger distance to compare with. If the surfaces do not touch, each connected part of one shape is wholly inside the other
//! or wholly outside, and one point of the part tells which.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::answers::Distance;
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

    /// Turns the distance of two cores into that of the shapes.
    pub(super) fn distance_of_shapes(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        core: Distance,
    ) -> Result<Distance, QueryError> {
        let sum = sum_of_radii(a, b);
        let meet_at = |point| Distance {
            distance: 0.0,
            lower: 0.0,
            upper: 0.0,
            point_a: point,
            point_b: point,
            ..core
        };
        if sum > 0.0 {
            let near = core.upper <= sum || core.lower <= sum && self.cores_within(a, b, pose, sum)?;
            if near {
                // At most as far from either core as the radius there.
                return Ok(meet_at(between(core.point_a, core.point_b, a.radius() / sum)));
            }
        }
        if core.distance == 0.0 {
            return Ok(core);
        }
        if let Some(point) = self.inside_point(a, b, pose)? {
            return Ok(meet_at(point));
        }
        if sum == 0.0 {
            return Ok(core);
        }
        // The shapes do not touch, so the distance must not round to zero.
        let distance = (core.distance - sum).max(f64::MIN_POSITIVE);
        let share = |radius: f64| (radius / core.distance).min(1.0);
        Ok(Distance {
            distance,
            lower: (core.lower - sum).next_down().clamp(0.0, distance),
            upper: (core.upper - sum).next_up().max(distance),
            point_a: between(core.point_a, core.point_b, share(a.radius())),
            point_b: between(core.point_b, core.point_a, share(b.radius())),
            ..core
        })
    }
}

/// Returns the point at a share of the way from one point to another.
pub(super) fn between(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + share * (to[k] - from[k]))
}
