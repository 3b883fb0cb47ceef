//! Whether a segment meets a mesh.

use crate::error::QueryError;
use crate::narrow::{Point, triangles_intersect};
use crate::query::probe::line::{Candidate, Line, LineQuestion};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::check_point;
use crate::query::querier::Querier;
use crate::traverse::probe_walk::PROBES;

impl Querier {
    /// Returns whether the closed segment between two points meets a mesh: whether it is free to see or to go along.
    ///
    /// Decided exactly, by the predicates of [`Querier::collide`]: a segment that only touches a corner, an edge or a face meets
    /// it. The points may be equal. Cost: a microsecond or so.
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate is not finite or beyond 2^120; [`QueryError::Damaged`] if a page that the query
    /// touches is damaged, [`QueryError::Budget`] if the budget does not suffice.
    pub fn meets_segment<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        from: [f64; 3],
        to: [f64; 3],
    ) -> Result<bool, QueryError> {
        let [meets, ..] = self.meet_segments(&shape.into(), &[[from, to]])?;
        Ok(meets)
    }

    /// Returns whether up to four segments meet a mesh, side by side.
    pub(super) fn meet_segments(
        &mut self,
        shape: &PlacedShape<'_>,
        segments: &[[Point; 2]],
    ) -> Result<[bool; PROBES], QueryError> {
        let mut question = Segments { ends: [[[0.0; 3]; 2]; PROBES], met: [false; PROBES] };
        let mut lines = [Line::NONE; PROBES];
        for ((ends, line), segment) in question.ends.iter_mut().zip(&mut lines).zip(segments) {
            *ends = [check_point(&segment[0])?, check_point(&segment[1])?];
            *line = Line::between(ends[0], ends[1]);
        }
        self.ask_lines(shape, &lines[..segments.len().min(PROBES)], &mut question)?;
        Ok(question.met)
    }
}

/// Does any triangle meet the segment?
struct Segments {
    ends: [[Point; 2]; PROBES],
    met: [bool; PROBES],
}

impl LineQuestion for Segments {
    #[inline(always)]
    fn limit(&self, line: usize) -> f64 {
        if self.met[line] { -1.0 } else { 1.0 }
    }

    fn decide(&mut self, line: usize, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        let [from, to] = self.ends[line];
        self.met[line] |= triangles_intersect(&candidate.triangle, &[from, to, to]);
        Ok(())
    }
}
