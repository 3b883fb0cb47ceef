//! The path through several poses.

use crate::motion::path::{Motion, RigidPath, sagitta_of};
use crate::numerics::SLACK;
use crate::pose::{Pose, PoseError};

/// A path through several poses. The motion from each pose to the next takes the same share of the time.
///
/// ```
/// use bvh_query::{Polyline, Pose, RigidPath};
///
/// let at = |x, y| Pose::new(*Pose::IDENTITY.rotation(), [x, y, 0.0]);
/// let path = Polyline::new(&[at(0.0, 0.0)?, at(4.0, 0.0)?, at(4.0, 2.0)?])?;
/// assert_eq!(path.pose(0.25).translation(), [2.0, 0.0, 0.0]);
/// assert_eq!(path.pose(0.75).translation(), [4.0, 1.0, 0.0]);
/// # Ok::<(), bvh_query::PoseError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    motions: Vec<Motion>,
}

impl Polyline {
    /// Returns the path through the poses, with [`Motion::between`] from each to the next.
    ///
    /// # Errors
    /// [`PoseError::TooFewPoses`] for fewer than two poses, and the errors of [`Motion::between`].
    pub fn new(poses: &[Pose]) -> Result<Self, PoseError> {
        if poses.len() < 2 {
            return Err(PoseError::TooFewPoses(poses.len()));
        }
        let motions = poses.windows(2).map(|pair| Motion::between(&pair[0], &pair[1]));
        Ok(Self { motions: motions.collect::<Result<_, _>>()? })
    }

    /// Returns the number of the motion at a time, and the time within it.
    fn at(&self, t: f64) -> (usize, f64) {
        let scaled = t.clamp(0.0, 1.0) * self.motions.len() as f64;
        let number = (scaled as usize).min(self.motions.len() - 1);
        (number, scaled - number as f64)
    }

    /// Returns how far any point within `radius` of B's origin is from the straight line between two poses, in the
    /// first pose of the motion with this number.
    fn bend(&self, number: usize, radius: f64, [t0, t1]: [f64; 2], [from, to]: &[Pose; 2]) -> f64 {
        let share = (number as f64 / self.motions.len() as f64 - t0) / (t1 - t0);
        let between = |from: f64, to: f64, at: f64| at - (from + share * (to - from));
        let knot = &self.motions[number].start;
        let (mut moved, mut turned) = (0.0, 0.0);
        for i in 0..3 {
            let ends = (from.translation()[i], to.translation()[i]);
            moved += between(ends.0, ends.1, knot.translation()[i]).powi(2);
            for j in 0..3 {
                let ends = (from.rotation()[i][j], to.rotation()[i][j]);
                turned += between(ends.0, ends.1, knot.rotation()[i][j]).powi(2);
            }
        }
        moved.sqrt() + turned.sqrt() * radius
    }

    /// The path is within the largest sagitta of its motions of the polygon through the knots, and this polygon is
    /// farthest from the straight line at a knot.
    fn sagitta_within(&self, radius: f64, [t0, t1]: [f64; 2]) -> f64 {
        let ((first, from), (mut last, mut to)) = (self.at(t0), self.at(t1));
        if to == 0.0 && last > first {
            // The end of one motion is the start of the next, to the bit.
            (last, to) = (last - 1, 1.0);
        }
        // The time within a motion is rounded, by less than this share of it.
        let slack = 1.0 / (1u64 << 50) as f64 * self.motions.len() as f64;
        let of_motion = |number: usize| {
            let start = if number == first { from } else { 0.0 };
            let end = if number == last { to } else { 1.0 };
            let motion = &self.motions[number];
            motion.sagitta(radius, start, end) + 4.0 * slack * motion.way(radius) + motion.rounding(radius)
        };
        let bent = (first..=last).map(of_motion).fold(0.0, f64::max);
        if first == last {
            return bent;
        }
        let ends = [self.pose(t0), self.pose(t1)];
        let knot = |number: usize| self.bend(number, radius, [t0, t1], &ends);
        let knots = (first + 1..=last).map(knot).fold(0.0, f64::max);
        bent + knots * (1.0 + SLACK)
    }
}

impl RigidPath for Polyline {
    fn pose(&self, t: f64) -> Pose {
        let (number, t) = self.at(t);
        self.motions[number].pose(t)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        sagitta_of(self, radius, [t0, t1], |radius, times| self.sagitta_within(radius, times))
    }

    fn slides(&self, t0: f64, t1: f64) -> bool {
        let ((first, _), (last, to)) = (self.at(t0), self.at(t1));
        (first == last || first + 1 == last && to == 0.0) && self.motions[first].slides(t0, t1)
    }
}
