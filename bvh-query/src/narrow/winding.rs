//! Counts exactly how often closed surfaces wind around a point, triangle by triangle.
//!
//! Along a ray from the point in the direction of an axis, the number of times that the ray leaves the surface, less
//! the number of times that it enters it, is the winding number. If the ray meets an edge or a corner, each passage
//! must still count once. Therefore the ray is treated as if it were moved by ε along the next axis and by ε² along the
//! one after, for an ε smaller than any other number in question (H. Edelsbrunner, E. P. Mücke, "Simulation of
//! Simplicity", ACM Transactions on Graphics 9(1), 1990). The moved ray meets no edge. Nothing else changes, because
//! only a triangle that contains the point itself could cause a change, and then the point is on the surface.
//!
//! Seen along the axis, the problem is two-dimensional: signs are those of `orient2d` and, for the triangles that the
//! ray's line meets, of one `orient3d`. Both are exact under the precondition of [`narrow`](super).

use super::edge_crossing::moved_height;
use super::intersection::{area, triangles_intersect, volume};
use super::{Point, Triangle};

/// A ray along an axis of the frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisRay {
    pub(crate) origin: Point,
    pub(crate) axis: usize,
    /// It leads towards larger coordinates.
    pub(crate) ascends: bool,
}

/// How a ray passes a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passing {
    /// The moved ray does not meet it.
    Misses,
    /// Its origin is on the triangle.
    Starts,
    /// The moved ray meets the triangle from behind, with its normal, as it does where it leaves a solid.
    Leaves,
    /// The moved ray meets the front of the triangle.
    Enters,
}

impl AxisRay {
    /// Returns the direction, of length 1.
    pub(crate) fn direction(&self) -> Point {
        let mut direction = [0.0; 3];
        direction[self.axis] = if self.ascends { 1.0 } else { -1.0 };
        direction
    }

    /// Decides how the ray passes a triangle.
    #[inline(always)]
    pub(crate) fn passing(&self, triangle: &Triangle) -> Passing {
        self.passing_if(triangle, None)
    }

    /// Decides how the ray passes a triangle if its origin, too, is moved: by (ε³, ε, ε²), or the other way for a sign of -1. The ray has
    /// to be along the first axis, so that this moves it as it is moved anyway.
    pub(crate) fn passing_beside(&self, triangle: &Triangle, sign: f64) -> Passing {
        self.passing_if(triangle, Some(sign))
    }

    /// Decides how the ray passes a triangle, and whether its origin is on it, unless that is moved as well.
    #[inline(always)]
    fn passing_if(&self, triangle: &Triangle, moved: Option<f64>) -> Passing {
        let sign = moved.unwrap_or(1.0);
        let [a, b, c] = *triangle;
        let edges = [(a, b), (b, c), (c, a)];
        let sides = edges.map(|(p, q)| area(self.axis, p, q, self.origin));
        let (positive, negative) =
            (sides.iter().any(|side| *side > 0.0), sides.iter().any(|side| *side < 0.0));
        if positive && negative {
            return Passing::Misses;
        }
        if !positive && !negative {
            // Seen along the axis, the triangle has no area: the moved ray does not meet it.
            let starts = moved.is_none() && triangles_intersect(triangle, &[self.origin; 3]);
            return if starts { Passing::Starts } else { Passing::Misses };
        }
        let mut height = volume(a, b, c, self.origin);
        if height == 0.0 {
            let Some(beside) = moved.and_then(|_| moved_height(triangle)) else { return Passing::Starts };
            height = sign * beside;
        }
        let forwards = positive == self.ascends;
        let is_ahead = forwards == (height < 0.0);
        let meets = (0..3).all(|i| {
            let side = if sides[i] == 0.0 { sign * self.side_of_moved(edges[i]) } else { sides[i] };
            (side > 0.0) == positive
        });
        match (is_ahead && meets, forwards) {
            (false, _) => Passing::Misses,
            (true, true) => Passing::Leaves,
            (true, false) => Passing::Enters,
        }
    }

    /// Returns a number with the sign of the side on which the moved ray passes an edge whose line the ray meets.
    ///
    /// The area that p and q span with a point x is (q - p) × (x - p). Its derivative along the first axis of the plane
    /// is the negated second component of the edge; along the second axis, it is the first component.
    fn side_of_moved(&self, (p, q): (Point, Point)) -> f64 {
        let (first, second) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        if p[second] == q[second] { q[first] - p[first] } else { p[second] - q[second] }
    }
}
