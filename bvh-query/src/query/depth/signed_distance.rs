//! One number for two shapes: how far apart they are or, below zero, how deep they overlap.

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::narrow::{Point, unit};
use crate::pose::Pose;
use crate::query::depth::convex::has_inside;
use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::penetration::Penetration;
use crate::query::depth::translation::moved;
use crate::query::distance::Distance;
use crate::query::options::{DistanceOptions, check};
use crate::query::pair_search::PairSearch;
use crate::query::probe::relation::Relation;
use crate::query::querier::Querier;
use crate::query::rounded::limit_of_cores;
use crate::query::tracker::Tracker;

/// How far apart two shapes are or, below zero, how deep they overlap.
///
/// [`Querier::signed_distance`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SignedDistance {
    /// The signed distance is at least this, in mesh units.
    pub lower: f64,
    /// The signed distance is at most this, in mesh units.
    pub upper: f64,
    /// The signed distance as one number: that of [`Querier::distance`] or, where the shapes overlap, `lower`. It is the number that
    /// `normal` and both points belong to, as derivatives need it.
    pub distance: f64,
    /// The direction in which B moves away from A at unit length, in A's frame: from the closest point on A to that on B or, where
    /// they overlap, along `translation`. Zero where none is known, as for shapes that touch and have no depth.
    pub normal: [f64; 3],
    /// The closest point on A in A's frame or, where they overlap, the one that B touches after the translation.
    pub point_a: [f64; 3],
    /// The closest point on B in A's frame or, where they overlap, the one that touches `point_a` after the translation.
    pub point_b: [f64; 3],
    /// Where they overlap, a translation of B in A's frame, as long as `lower` is negative, at which interiors are disjoint; else zero.
    pub translation: [f64; 3],
    /// Whether both shapes have an inside: they are closed and have a radius or triangles with area. If not, they have no depth, and
    /// the number is their distance, 0 where they touch.
    pub is_signed: bool,
    /// Whether the budget ended the search for a depth.
    pub is_spent: bool,
}

impl SignedDistance {
    fn apart(found: &Distance, is_signed: bool) -> Self {
        let Distance { distance, lower, upper, point_a, point_b, .. } = *found;
        let normal = unit([0, 1, 2].map(|k| point_b[k] - point_a[k]));
        let translation = [0.0; 3];
        Self { lower, upper, distance, normal, point_a, point_b, translation, is_signed, is_spent: false }
    }

    fn deep(depth: &Penetration, [point_a, point_b]: [Point; 2]) -> Self {
        let Penetration { lower, upper, translation, is_spent, .. } = *depth;
        // Zero is written without a sign.
        let [lower, upper] = [0.0 - upper, 0.0 - lower];
        Self {
            lower,
            upper,
            distance: lower,
            normal: unit(translation),
            point_a,
            point_b,
            translation,
            is_signed: true,
            is_spent,
        }
    }
}

impl Querier {
    /// Returns the signed distance of two shapes: that of [`Querier::distance`] where they are apart, and minus the depth of
    /// [`Querier::penetration`] where they overlap or one is inside the other, between two certified bounds. Where they touch, 0 is
    /// between the bounds, which are some roundings apart.
    ///
    /// Shapes of which one is not closed, or a cloud or a segment without a radius, have no depth: [`SignedDistance::is_signed`] is
    /// false then. All
    /// numbers have the same bits on all backends.
    ///
    /// A translation of B changes the signed distance by at most its length. Points and normals may jump: where several are equally
    /// near, one of them is the answer.
    ///
    /// Cost: that of `distance`, and of a few sides of points; where the shapes overlap, that of `penetration`.
    ///
    /// ```
    /// use bvh_query::{PenetrationOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let (mut querier, options) = (Querier::new()?, PenetrationOptions::new());
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let apart = querier.signed_distance(&block, &block, &at(2.5)?, &options)?;
    /// assert_eq!((apart.distance, apart.normal), (0.5, [1.0, 0.0, 0.0]));
    ///
    /// let overlapping = querier.signed_distance(&block, &block, &at(1.5)?, &options)?;
    /// assert!(overlapping.lower <= -0.5 && -0.5 <= overlapping.upper && overlapping.translation[0] >= 0.5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; [`QueryError::NoTopology`] if a file was baked without topology;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged; [`QueryError::Budget`] if the budget does not suffice
    /// to find out whether the shapes are apart.
    pub fn signed_distance<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<SignedDistance, QueryError> {
        options.check()?;
        let (a, b) = (a.into(), b.into());
        self.start();
        self.signed_by(None, [a, b], pose, options)
    }

    /// Returns the answer of [`Querier::signed_distance`] if the shapes overlap or are at most `margin` apart, in mesh units, and
    /// otherwise `None`. [`Querier::within`] decides exactly what is at most that far apart.
    ///
    /// Cost: that of `within` where they are farther apart, and a few sides of points if their boxes meet; else that of
    /// `signed_distance`.
    ///
    /// ```
    /// use bvh_query::{PenetrationOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let (mut querier, options) = (Querier::new()?, PenetrationOptions::new());
    /// let beside = Pose::new(*Pose::IDENTITY.rotation(), [2.5, 0.0, 0.0])?;
    /// assert!(querier.signed_distance_within(&block, &block, &beside, 0.4, &options)?.is_none());
    /// let near = querier.signed_distance_within(&block, &block, &beside, 0.6, &options)?;
    /// assert_eq!(near.map(|near| near.distance), Some(0.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if the margin is negative, NaN or infinite; the errors of [`Querier::signed_distance`].
    pub fn signed_distance_within<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Option<SignedDistance>, QueryError> {
        check(NumberError::Margin, margin)?;
        options.check()?;
        let (a, b) = (a.into(), b.into());
        self.start();
        let is_signed = has_inside(a)? && has_inside(b)?;
        let limit = limit_of_cores(a, b, margin);
        let mut search = PairSearch::new(DistanceOptions::default(), f64::INFINITY);
        search.limit_to(limit.next_up());
        let core = self.nearest(a, b, pose, &mut search)?.map(|best| best.distance(search.proved()));
        let is_near = match &core {
            // Whether the search has met the nearest triangles is certain only within the limit.
            Some(core) => {
                core.upper <= limit || core.lower <= limit && self.cores_within(a, b, pose, limit)?
            }
            None => false,
        };
        let found = core.filter(|_| is_near).map(|core| self.distance_of_shapes(a, b, pose, core));
        match found.transpose()? {
            Some(found) if !is_signed => return Ok(Some(SignedDistance::apart(&found, false))),
            Some(found) if found.distance == 0.0 => {}
            None if !is_signed => {
                if self.inside_point(a, b, pose)?.is_none() {
                    return Ok(None);
                }
            }
            found => {
                if self.relation_of_disjoint(a, b, pose)? == Relation::Apart {
                    return Ok(found.map(|found| SignedDistance::apart(&found, true)));
                }
            }
        }
        self.signed_by(None, [a, b], pose, options).map(Some)
    }

    /// Returns the signed distance of two shapes, unless they are apart.
    pub(crate) fn signed_unless_apart(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<Option<SignedDistance>, QueryError> {
        self.start();
        if self.relation_of(a, b, pose)? == Relation::Apart {
            return Ok(None);
        }
        self.signed_by(None, [a, b], pose, options).map(Some)
    }

    /// Returns the signed distance. A tracker finds the distance, if there is one.
    fn signed_by(
        &mut self,
        tracker: Option<&mut Tracker>,
        [a, b]: [Shape<'_>; 2],
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<SignedDistance, QueryError> {
        let is_signed = has_inside(a)? && has_inside(b)?;
        if is_signed && let Some(found) = self.convex_depth(a, b, pose, options)? {
            return Ok(SignedDistance::deep(&found.into(), found.points));
        }
        let found = match tracker {
            Some(tracker) => tracker.distance_between(self, a, b, pose),
            None => self.distance_between(a, b, pose, &DistanceOptions::default()),
        }?;
        if !is_signed {
            return Ok(SignedDistance::apart(&found, false));
        }
        if found.distance > 0.0 && self.relation_of_disjoint(a, b, pose)? == Relation::Apart {
            return Ok(SignedDistance::apart(&found, true));
        }
        let depth = self.search_depth(a, b, pose, options)?;
        let free = moved(pose, depth.translation);
        // What the search has not spent may not suffice for this.
        let points = match self.distance_between(a, b, &free, &DistanceOptions::default()) {
            Ok(Distance { point_a, point_b, .. }) => {
                [point_a, [0, 1, 2].map(|k| point_b[k] - depth.translation[k])]
            }
            Err(QueryError::Budget { .. }) => [found.point_a, found.point_b],
            Err(error) => return Err(error),
        };
        Ok(SignedDistance::deep(&depth, points))
    }
}

impl Tracker {
    /// Answers [`Querier::signed_distance`], by means of `querier`.
    ///
    /// # Errors
    /// The errors of [`Querier::signed_distance`].
    pub fn signed_distance<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<SignedDistance, QueryError> {
        options.check()?;
        let (a, b) = (a.into(), b.into());
        querier.start();
        querier.signed_by(Some(self), [a, b], pose, options)
    }
}
