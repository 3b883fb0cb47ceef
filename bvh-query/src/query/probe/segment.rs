//! Whether a segment meets a mesh.

use crate::error::QueryError;
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
}

/// Does any triangle meet the segment?
pub(crate) struct MeetsSegment {
    ends: [Point; 2],
    pub(crate) met: bool,
}

impl MeetsSegment {
    #[inline(always)]
    pub(crate) fn new(from: Point, to: Point) -> Result<Self, QueryError> {
        Ok(Self::about([check_point(&from)?, check_point(&to)?]))
    }

    #[inline(always)]
    pub(super) fn about(ends: [Point; 2]) -> Self {
        Self { ends, met: false }
    }
}

impl LineQuestion for MeetsSegment {
    fn line(&self) -> Line {
        Line::between(self.ends[0], self.ends[1])
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        if self.met { -1.0 } else { 1.0 }
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
