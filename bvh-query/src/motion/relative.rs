//! The path of B in A's frame when both move in the world.

use crate::motion::RigidPath;
use crate::motion::linear::{difference, length, norm};
use crate::numerics::{INVERSE_NORM, RELATIVE_ERROR};
use crate::pose::Pose;
use bvh_format::object::MAX_COORDINATE;

/// The path of B in A's frame, given the paths of both in the world. At each time, its pose is the `Pose::relative` of
/// their poses. [`Scene::motion`](crate::Scene::motion) asks a querier about such paths.
///
/// All poses of both paths must be rigid to within 2^-23, and no translation may exceed 2^118. Within these limits
/// there is always a relative pose. At a time without one, B counts as farther away than any mesh, and the sagitta of an
/// interval that begins or ends there as infinite: neither a hit nor free. A query about such a path is refused with
/// [`NumberError::Unresolved`](crate::NumberError::Unresolved), unless it finds a hit before.
///
/// ```
/// use bvh_query::{Motion, Pose, RelativePath, RigidPath};
///
/// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
/// let slow = Motion::between(&at(0.0)?, &at(1.0)?)?;
/// let fast = Motion::between(&at(2.0)?, &at(6.0)?)?;
/// let path = RelativePath::new(&slow, &fast);
/// assert_eq!(path.pose(1.0).translation(), [5.0, 0.0, 0.0]);
/// # Ok::<(), bvh_query::PoseError>(())
/// ```
#[derive(Clone, Copy)]
pub struct RelativePath<'a> {
    a: &'a dyn RigidPath,
    b: &'a dyn RigidPath,
}

impl<'a> RelativePath<'a> {
    /// Returns the path of B in A's frame.
    pub fn new(a: &'a dyn RigidPath, b: &'a dyn RigidPath) -> Self {
        Self { a, b }
    }
}

/// A pose is the path of a body that stands still in the world.
impl RigidPath for Pose {
    fn pose(&self, _t: f64) -> Pose {
        *self
    }

    fn sagitta(&self, _radius: f64, _t0: f64, _t1: f64) -> f64 {
        0.0
    }

    fn slides(&self, _t0: f64, _t1: f64) -> bool {
        true
    }
}

/// Let M be the inverse of A's rotation R, w the way from A's origin to a point of B, in the world, and q = M w where the
/// point is in A's frame. An index "lin" stands for what is linear in time between both ends, which are indexed 0 and 1; D
/// for a difference of the ends.
///
/// - w is within e = s_b(r) + s_a(0) of w_lin, by both sagittas, and no longer than W, the larger of both ends and e.
/// - R_lin M_lin = I + X with |X| <= x = |DR|^2 m^2 / 4, where m bounds |M|. So R_lin^-1 is within m x / (1 - x) of M_lin.
/// - R c is within s_a(|c|) + s_a(0) of R_lin c. So M w is within m (s_a(W') + s_a(0)) of R_lin^-1 w, W' = m W / (1 - x).
/// - M_lin w_lin is within |DM| |Dw| / 4 of q_lin, and |DM| <= m^2 |DR|.
///
/// Together q is within m x W / (1 - x) + m (s_a(W') + s_a(0)) + m e + m^2 |DR| |Dw| / 4 of q_lin. Where x is no less than a
/// half, 2 m W takes the place of the first two terms. A relative pose is off by the rounding of its formulas, which subtract
/// translations first: less than 2^-46 W, for the point and both ends, wherever in the world they are.
impl RigidPath for RelativePath<'_> {
    fn pose(&self, t: f64) -> Pose {
        let far_away = || Pose::of_valid(*Pose::IDENTITY.rotation(), [MAX_COORDINATE, 0.0, 0.0]);
        Pose::relative(&self.a.pose(t), &self.b.pose(t)).unwrap_or_else(|_| far_away())
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let [a0, a1] = [self.a.pose(t0), self.a.pose(t1)];
        let [b0, b1] = [self.b.pose(t0), self.b.pose(t1)];
        if Pose::relative(&a0, &b0).is_err() || Pose::relative(&a1, &b1).is_err() {
            return f64::INFINITY;
        }
        let of = |path: &dyn RigidPath, radius: f64| {
            let sagitta = path.sagitta(radius, t0, t1);
            if sagitta >= 0.0 { sagitta } else { f64::INFINITY }
        };
        let [way_0, way_1] = [between(&a0, &b0), between(&a1, &b1)];
        let turned = norm(&difference(a1.rotation(), a0.rotation()));
        let moved = length([0, 1, 2].map(|k| way_1[k] - way_0[k]))
            + norm(&difference(b1.rotation(), b0.rotation())) * radius;
        let still_a = of(self.a, 0.0);
        let bent = of(self.b, radius) + still_a;
        let farthest = length(way_0).max(length(way_1)) + INVERSE_NORM * radius + bent;
        let x = turned * turned * INVERSE_NORM * INVERSE_NORM / 4.0;
        let turning = if x < 0.5 {
            let rest = 1.0 / (1.0 - x);
            INVERSE_NORM * (x * farthest * rest + of(self.a, INVERSE_NORM * farthest * rest) + still_a)
        } else {
            2.0 * INVERSE_NORM * farthest
        };
        let crossed = INVERSE_NORM * INVERSE_NORM * turned * moved / 4.0;
        (turning + INVERSE_NORM * bent + crossed) * (1.0 + RELATIVE_ERROR) + RELATIVE_ERROR * farthest
    }

    /// B slides along A's axes if it does along the world's, A stands still, and A's axes are the world's.
    fn slides(&self, t0: f64, t1: f64) -> bool {
        let stands = self.a.slides(t0, t1) && self.a.pose(t0) == self.a.pose(t1);
        let zeros = self.a.pose(t0).rotation().as_flattened().iter().filter(|&&entry| entry == 0.0).count();
        stands && zeros == 6 && self.b.slides(t0, t1)
    }
}

/// From A's origin to B's, in the world.
fn between(a: &Pose, b: &Pose) -> [f64; 3] {
    let (from, to) = (a.translation(), b.translation());
    [0, 1, 2].map(|k| to[k] - from[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::path::tests::{departure, paths, signed};

    #[test]
    fn no_point_of_b_leaves_its_segment_in_the_frame_of_a() {
        let state = &mut 5;
        let mut largest: f64 = 0.0;
        let worlds = paths(state);
        for a in &worlds {
            for b in worlds.iter().step_by(2) {
                let path = RelativePath::new(&**a, &**b);
                for _ in 0..6 {
                    let level = (signed(state).abs() * 20.0) as i32;
                    let ratio = departure(&path, level, state);
                    assert!(ratio <= 1.0, "{ratio} at level {level}");
                    largest = largest.max(if (3..8).contains(&level) { ratio } else { 0.0 });
                }
            }
        }
        assert!(largest > 0.2, "{largest}");
    }

    /// Among what stands still, there is nothing but rounding; and a path in the frame of what stands still keeps its sagitta.
    #[test]
    fn what_stands_still_adds_nothing() {
        let state = &mut 6;
        for path in paths(state) {
            let still = path.pose(0.3);
            let of = |a: &dyn RigidPath, b: &dyn RigidPath| RelativePath::new(a, b).sagitta(1.0, 0.25, 0.5);
            // Poses that are farther from rigid than those of a world have no relative pose.
            if Pose::relative(&still, &still).is_err() {
                assert_eq!(of(&still, &still), f64::INFINITY);
                continue;
            }
            assert!(of(&still, &still) < 1e-9, "{:e} {still:?}", of(&still, &still));
            let own = path.sagitta(1.0, 0.25, 0.5);
            let way =
                [0.25, 0.5].map(|t| length(between(&still, &path.pose(t)))).into_iter().fold(2.0, f64::max);
            assert!((of(&still, &*path) - own).abs() <= 1e-5 * own + 2.0 * RELATIVE_ERROR * way);
        }
    }
}
