//! The path of what is attached to a body that moves on a path, and the path of B in A's frame if both are.
//!
//! What is attached to a body stands still in its frame, so its points move as points of the body do that are farther from
//! the body's origin: the path bends no more than the body's for a larger radius. Poses are composed in `f64`, and what that
//! rounds is charged.
//!
//! Error, with u = 2^-53: let a pose P in the world be composed with one that is kept, of translation s. For a point at
//! distance r from the child's origin, the product of rotations is off by 12u r (entries by 4u: see `pose/frames.rs`) and the
//! translation by 4u |P's translation| + 7u |s|. Over n parents, one after the other, that adds up to 16u n times the sum of
//! the body's translation and of the distance, in the body's frame, that the point is from the body's origin. A translation
//! below 2^-213 counts as 0, which adds less than 2^-212 each time.

use crate::motion::RigidPath;
use crate::motion::linear::length;
use crate::motion::relative::RelativePath;
use crate::numerics::{COMPOSED_ERROR, FLUSHED, INVERSE_NORM, RELATIVE_ERROR};
use crate::pose::Pose;

/// The path of an instance: that of a body in the world, and the poses that are kept from there down to the instance.
#[derive(Clone)]
pub(crate) struct AttachedPath<'a> {
    body: &'a (dyn RigidPath + Sync),
    /// Each in the frame of the one before, the first in the body's. Without any, this is the body itself.
    kept: Vec<Pose>,
}

impl<'a> AttachedPath<'a> {
    pub(crate) fn new(body: &'a (dyn RigidPath + Sync)) -> Self {
        Self { body, kept: Vec::new() }
    }

    /// Returns the path of what is attached to what moves on this path, given its pose there.
    pub(crate) fn of_child(&self, kept: Pose) -> Self {
        Self { body: self.body, kept: self.kept.iter().copied().chain([kept]).collect() }
    }

    /// Returns how far points within `radius` of the origin are at most from the origin of the body.
    fn reach(&self, radius: f64) -> f64 {
        let kept = self.kept.iter().rev();
        kept.fold(radius, |reach, kept| {
            (INVERSE_NORM * reach + length(kept.translation())) * (1.0 + RELATIVE_ERROR)
        })
    }

    /// Returns by how much the roundings of poses may bend the path of a point at this distance from the body's origin.
    fn rounding(&self, reach: f64, t0: f64, t1: f64) -> f64 {
        let times = self.kept.len() as f64;
        let ends = [t0, t1].map(|t| length(self.body.pose(t).translation()));
        let away = ends[0].max(ends[1]) + valid(self.body.sagitta(0.0, t0, t1));
        times * (COMPOSED_ERROR * (away + reach) + FLUSHED)
    }
}

impl RigidPath for AttachedPath<'_> {
    fn pose(&self, t: f64) -> Pose {
        self.kept.iter().fold(self.body.pose(t), |parent, kept| kept.then_of_attached(&parent))
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        if self.kept.is_empty() {
            return self.body.sagitta(radius, t0, t1);
        }
        let reach = self.reach(radius);
        (valid(self.body.sagitta(reach, t0, t1)) + self.rounding(reach, t0, t1)) * (1.0 + RELATIVE_ERROR)
    }

    fn slides(&self, t0: f64, t1: f64) -> bool {
        self.kept.is_empty() && self.body.slides(t0, t1)
    }
}

/// A sagitta that is no number of at least 0 counts as infinite.
fn valid(sagitta: f64) -> f64 {
    if sagitta >= 0.0 { sagitta } else { f64::INFINITY }
}

/// The path of B in A's frame if both are attached to one body: B stands still there, but for rounding. The bound of
/// [`RelativePath`] for any two paths would grow with the turn of the body.
///
/// With exact poses, a point of B is at the same place q of A's frame all the time. Let the poses of A and B be off by at most e_a
/// for the point q and e_b. Then the point is within m (e_a + e_b) of q, where m bounds the norms of inverses, and the relative pose adds its own
/// rounding, which is below 2^-46 of the distance of A's origin and the point.
pub(crate) struct TogetherPath<'a> {
    pub(crate) a: &'a AttachedPath<'a>,
    pub(crate) b: &'a AttachedPath<'a>,
}

impl RigidPath for TogetherPath<'_> {
    fn pose(&self, t: f64) -> Pose {
        RelativePath::new(self.a, self.b).pose(t)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let is_lost = |t: f64| Pose::relative(&self.a.pose(t), &self.b.pose(t)).is_err();
        if is_lost(t0) || is_lost(t1) {
            return f64::INFINITY;
        }
        let of_b = self.b.reach(radius);
        let between = INVERSE_NORM * (self.a.reach(0.0) + of_b);
        let rounded = self.a.rounding(self.a.reach(between), t0, t1) + self.b.rounding(of_b, t0, t1);
        (INVERSE_NORM * rounded + RELATIVE_ERROR * between + FLUSHED) * (1.0 + RELATIVE_ERROR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::path::tests::{departure, paths, signed};

    fn kept(state: &mut u64, far: f64) -> Pose {
        let q = [(); 4].map(|()| signed(state));
        let long = q.iter().map(|v| v * v).sum::<f64>().sqrt();
        Pose::from_quaternion(q.map(|v| v / long), [(); 3].map(|()| far * signed(state))).unwrap()
    }

    #[test]
    fn no_point_of_what_is_attached_leaves_its_segment() {
        let state = &mut 15;
        let (mut largest, mut rounded): (f64, f64) = (0.0, 0.0);
        for (number, body) in paths(state).iter().enumerate() {
            let mut path = AttachedPath::new(&**body);
            for depth in 0..4 {
                for _ in 0..6 {
                    let level = (signed(state).abs() * 40.0) as i32;
                    let ratio = departure(&path, level, state);
                    assert!(ratio <= 1.0, "{ratio} at level {level}, path {number}, depth {depth}");
                    largest = largest.max(if (3..8).contains(&level) { ratio } else { 0.0 });
                    rounded = rounded.max(if level > 30 && depth > 0 { ratio } else { 0.0 });
                }
                path = path.of_child(kept(state, [0.1, 3.0, 1e4][number % 3]));
            }
        }
        // Where the path bends, and where there is hardly more than rounding.
        assert!(largest > 0.2 && rounded > 1e-3, "{largest} {rounded}");
    }

    #[test]
    fn two_that_are_attached_to_one_body_stand_still_but_for_rounding() {
        let state = &mut 16;
        let mut largest: f64 = 0.0;
        for (number, body) in paths(state).iter().enumerate() {
            let far = [0.1, 3.0, 1e4][number % 3];
            let a = AttachedPath::new(&**body);
            let b = a.of_child(kept(state, far)).of_child(kept(state, far));
            let c = a.of_child(kept(state, far));
            for (a, b) in [(&a, &b), (&b, &a), (&b, &c)] {
                let path = TogetherPath { a, b };
                for _ in 0..6 {
                    let ratio = departure(&path, (signed(state).abs() * 20.0) as i32, state);
                    assert!(ratio <= 1.0, "{ratio}, path {number}");
                    largest = largest.max(ratio);
                }
            }
        }
        assert!(largest > 1e-3, "{largest}");
    }
}
