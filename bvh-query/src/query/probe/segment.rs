//! Whether a segment meets a mesh, and whether two points see each other past it.

use crate::error::{NumberError, QueryError};
use crate::narrow::{Point, segment_intersects, triangle_distance, triangles_within};
use crate::query::probe::line::{Candidate, Line, LineQuestion};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::check_point;
use crate::query::querier::Querier;

impl Querier {
    /// Returns whether the closed segment between two points meets a mesh. If it does not, there is a free line of
    /// sight between the points.
    ///
    /// The predicates of [`Querier::collide`] decide this exactly: a segment that only touches a corner, an edge or a
    /// face meets the mesh. The points may be equal. Cost: about a microsecond.
    ///
    /// ```
    /// use bvh_query::Querier;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// assert!(querier.segment_hit(&block, [-3.0, 0.0, 0.0], [3.0, 0.0, 0.0])?);
    /// assert!(querier.segment_hit(&block, [-3.0, 1.0, 1.0], [3.0, 1.0, 1.0])?); // along an edge
    /// assert!(!querier.segment_hit(&block, [-3.0, 0.0, 2.0], [3.0, 0.0, 2.0])?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate is not finite or beyond 2^120; [`QueryError::Damaged`] if a page that the query
    /// touches is damaged, [`QueryError::Budget`] if the budget does not suffice.
    pub fn segment_hit<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        from: [f64; 3],
        to: [f64; 3],
    ) -> Result<bool, QueryError> {
        let mut question = MeetsSegment::new(from, to)?;
        self.start();
        self.ask_line(&shape.into(), &mut question)?;
        Ok(question.met)
    }

    /// Returns whether two points see each other: whether no part of the segment between them, but for what is within `margin` of
    /// either of them, meets a mesh.
    ///
    /// With a margin of 0, this is the opposite of [`Querier::segment_hit`]: a point on the mesh sees nothing, as the segment touches
    /// the mesh there. For points on a surface, take a margin, in mesh units, that is longer than their coordinates are off and shorter
    /// than gaps that matter, such as a millionth of the size of the mesh; it is measured along the segment. Points that are at most
    /// two margins apart see each other. The ends of what is left of the segment are rounded to nearest, and the decision about it is
    /// exact. Cost: about a microsecond.
    ///
    /// ```
    /// use bvh_query::Querier;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let (mut querier, on_the_top, lamp) = (Querier::new()?, [0.0, 0.0, 1.0], [3.0, 0.0, 5.0]);
    /// assert!(!querier.visible(&block, on_the_top, lamp, 0.0)?); // the segment begins on the block
    /// assert!(querier.visible(&block, on_the_top, lamp, 1e-6)?);
    /// assert!(!querier.visible(&block, [0.0, 0.0, -1.0], lamp, 1e-6)?); // on the bottom
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if the margin is negative or not finite; else the errors of [`Querier::segment_hit`].
    pub fn visible<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        from: [f64; 3],
        to: [f64; 3],
        margin: f64,
    ) -> Result<bool, QueryError> {
        let mut question = MeetsSegment::without_ends(from, to, check_margin(margin)?)?;
        self.start();
        self.ask_line(&shape.into(), &mut question)?;
        Ok(!question.met)
    }
}

/// Refuses an invalid margin.
pub(crate) fn check_margin(margin: f64) -> Result<f64, QueryError> {
    if (0.0..f64::INFINITY).contains(&margin) { Ok(margin) } else { Err(NumberError::Margin(margin).into()) }
}

/// Does any triangle meet the segment?
pub(crate) struct MeetsSegment {
    ends: [Point; 2],
    /// Nothing is left of the segment.
    is_empty: bool,
    pub(crate) met: bool,
}

impl MeetsSegment {
    #[inline(always)]
    pub(crate) fn new(from: Point, to: Point) -> Result<Self, QueryError> {
        Ok(Self::about([check_point(&from)?, check_point(&to)?]))
    }

    /// The question about what is left of a segment without what is within a margin of its ends.
    pub(crate) fn without_ends(from: Point, to: Point, margin: f64) -> Result<Self, QueryError> {
        let whole = Self::new(from, to)?;
        if margin == 0.0 {
            return Ok(whole);
        }
        let vector = [0, 1, 2].map(|k| to[k] - from[k]);
        let largest = vector.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        // Squares of the shares of the largest component neither over- nor underflow in a way that matters.
        let length = largest * vector.map(|v| (v / largest).powi(2)).iter().sum::<f64>().sqrt();
        // Two equal points have no length that is a number.
        let is_empty = length.is_nan() || length <= 2.0 * margin;
        let moved = |end: Point, share: f64| [0, 1, 2].map(|k| end[k] + share * vector[k]);
        let ends =
            if is_empty { [from; 2] } else { [moved(from, margin / length), moved(to, -margin / length)] };
        Ok(Self { ends, is_empty, met: false })
    }

    #[inline(always)]
    pub(super) fn about(ends: [Point; 2]) -> Self {
        Self { ends, is_empty: false, met: false }
    }
}

impl LineQuestion for MeetsSegment {
    fn line(&self) -> Line {
        Line::between(self.ends[0], self.ends[1])
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        if self.met || self.is_empty { -1.0 } else { 1.0 }
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        let ([from, to], Candidate { triangle, radius, .. }) = (self.ends, candidate);
        self.met |= if *radius > 0.0 {
            let segment = [from, to, to];
            triangles_within(triangle, &segment, &triangle_distance(triangle, &segment), *radius)
        } else {
            segment_intersects(triangle, from, to)
        };
        Ok(())
    }
}
