//! Paths: where B is at each time, and how far its points are from straight lines in between; and the path at constant rates.

use crate::motion::linear::{Matrix, difference, length, norm, transposed};
use crate::numerics::{LINE_ERROR, MAX_STRETCH, POSE_ERROR, SLACK};
use crate::pose::frames::{product, turn};
use crate::pose::{Pose, PoseError};
use bvh_format::object::MAX_COORDINATE;

/// A motion of B in A's frame, over times from 0 to 1.
///
/// [`Motion`] and [`Polyline`](crate::Polyline) are paths. Implement it for others, such as a link of a robot whose joints move.
///
/// ```
/// use bvh_query::{MotionAnswer, MotionOptions, Pose, Querier, RigidPath};
///
/// /// Falls from rest, by 3 units until time 1.
/// struct Fall;
///
/// impl RigidPath for Fall {
///     fn pose(&self, t: f64) -> Pose {
///         Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 4.0 - 3.0 * t * t]).expect("a valid pose")
///     }
///
///     fn sagitta(&self, _radius: f64, t0: f64, t1: f64) -> f64 {
///         6.0 / 8.0 * (t1 - t0).powi(2) + 1e-14 // the acceleration is 6; the rest is for roundings
///     }
/// }
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let answer = Querier::new()?.motion(&block, &block, &Fall, &MotionOptions::new())?;
/// let MotionAnswer::Hit { free_until, touching_at, .. } = answer else { panic!("{answer:?}") };
/// let exact = (2.0_f64 / 3.0).sqrt();
/// assert!(free_until <= exact && exact - 1e-12 <= touching_at && touching_at - free_until < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait RigidPath {
    /// Returns where B is at a time from 0 to 1. The same time must always give the same pose, to the bit.
    fn pose(&self, t: f64) -> Pose;

    /// Returns an upper bound of the *sagitta*, in mesh units.
    ///
    /// Take any point that moves with B and is at most `radius` from the origin of B's frame. Compare it with a point
    /// that moves on a straight line, at a constant speed, from its place at `t0` to its place at `t1`. The sagitta is
    /// the greatest distance between the two at any time in `[t0, t1]`. It is at most an eighth of the greatest
    /// acceleration times the square of `t1 - t0`.
    ///
    /// The bound must hold for all poses that [`RigidPath::pose`] returns, rounding included. Answers are only as
    /// certain as this bound. The smaller it is for short intervals, the less work a query takes. NaN or a negative
    /// number counts as infinite.
    ///
    /// Queries call this with a radius of at least 0 and `0 <= t0 <= t1 <= 1`. The paths of this library accept any
    /// numbers, so that other paths can be built on them. The times may be in any order, as on a path that is reversed.
    /// Before 0 and after 1, these paths stand still. For NaN, the bound is infinite.
    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64;

    /// Returns true only if B *slides* between two times: its rotation stays the same, and each coordinate of its translation
    /// never falls or never rises, in all poses that [`RigidPath::pose`] returns, to the bit. The sagitta of each part of the interval
    /// must be no larger than that of the whole.
    ///
    /// Boxes along the axes of A then bound where B is without any rounding. Queries thereby tell flush parts apart that slide
    /// along each other across a gap of a few roundings. Otherwise they would look at the pose in the middle of each cell.
    fn slides(&self, _t0: f64, _t1: f64) -> bool {
        false
    }
}

impl<P: RigidPath + ?Sized> RigidPath for &P {
    fn pose(&self, t: f64) -> Pose {
        (**self).pose(t)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        (**self).sagitta(radius, t0, t1)
    }

    fn slides(&self, t0: f64, t1: f64) -> bool {
        (**self).slides(t0, t1)
    }
}

/// The least cosine of half the angle between two poses for which it is certain which rotation is the shorter one.
const MIN_HALF_COSINE: f64 = 1e-9;

/// A rotation at a constant rate about an axis of A's frame, with a translation at a constant rate: [`Motion::between`] two
/// poses, or a [`Motion::screw`].
///
/// ```
/// use bvh_query::{Motion, Pose, RigidPath};
///
/// let start = Pose::new(*Pose::IDENTITY.rotation(), [2.0, 0.0, 0.0])?;
/// let end = Pose::new([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 2.0, 0.0])?;
/// let motion = Motion::between(&start, &end)?;
/// assert_eq!(motion.pose(0.5).translation(), [1.0, 1.0, 0.0]); // the origin moves on a line
/// assert!((motion.angle().to_degrees() - 90.0).abs() < 1e-12);
///
/// let turn = Motion::screw(&start, [0.0; 3], [0.0, 0.0, 1.0], motion.angle(), 0.0)?;
/// let [x, y, _] = turn.pose(0.5).translation();
/// assert!((x * x + y * y - 4.0).abs() < 1e-12); // here it stays on a circle
/// # Ok::<(), bvh_query::PoseError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    pub(super) start: Pose,
    end: Pose,
    /// The rotation at the start; between poses, the nearest orthonormal one.
    rotation: Matrix,
    /// The differences of the rotations of `start` and `end` from orthonormal ones.
    defects: [Matrix; 2],
    /// Of length 1.
    axis: [f64; 3],
    /// In radians.
    angle: f64,
    course: Course,
}

/// The movement of the origin of B's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Course {
    /// It moves on a line from the start to the end.
    Line,
    /// It turns about a point on the axis, and is shifted along the axis.
    Screw { point: [f64; 3], shift: f64 },
}

impl Motion {
    /// Returns the motion that planners call interpolation in SE(3): the origin of B's frame moves on a line, and B
    /// turns about one axis by the shorter angle (slerp), both at a constant rate. `pose(0)` and `pose(1)` are `start`
    /// and `end`, bit for bit.
    ///
    /// If a rotation is not orthonormal (a pose may be 2^-20 off), the nearest orthonormal rotation is interpolated,
    /// and the difference from it is interpolated linearly. If both rotations are equal, B keeps that rotation, bit for bit.
    ///
    /// # Errors
    /// [`PoseError::HalfTurn`] if the poses are half a turn apart, to within 2e-9 radians.
    pub fn between(start: &Pose, end: &Pose) -> Result<Self, PoseError> {
        let nearest = |pose: &Pose| Pose::nearest(*pose.rotation(), [0.0; 3]).map(|pose| *pose.rotation());
        let (first, last) = (nearest(start)?, nearest(end)?);
        let [x, y, z, w] = quaternion(&product(&last, &transposed(&first)));
        let sine = (x * x + y * y + z * z).sqrt();
        let angle = 2.0 * libm::atan2(sine, w);
        if w < MIN_HALF_COSINE {
            return Err(PoseError::HalfTurn(angle));
        }
        let axis = if sine > 0.0 { [x / sine, y / sine, z / sine] } else { [1.0, 0.0, 0.0] };
        let reached = product(&rodrigues(axis, angle), &first);
        Ok(Self {
            start: *start,
            end: *end,
            rotation: first,
            defects: [difference(start.rotation(), &first), difference(end.rotation(), &reached)],
            axis,
            angle: if start.rotation() == end.rotation() { 0.0 } else { angle },
            course: Course::Line,
        })
    }

    /// Returns a screw motion from `start`: a rotation about an axis, and a shift along it. The axis goes through
    /// `point` in `direction` (of any length), both in A's frame. The rotation is by `angle` radians, which may be many
    /// turns. The shift is by `shift` mesh units.
    ///
    /// # Errors
    /// [`PoseError::Direction`], [`PoseError::Point`], [`PoseError::Angle`] and [`PoseError::Shift`] for a number that is
    /// not finite, a direction of length 0 or an angle beyond 1e9 radians; [`PoseError::ScrewTooFar`] and [`PoseError`]
    /// if the screw takes B farther away than poses may be.
    pub fn screw(
        start: &Pose,
        point: [f64; 3],
        direction: [f64; 3],
        angle: f64,
        shift: f64,
    ) -> Result<Self, PoseError> {
        let most = direction.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let length = direction.map(|value| value / most);
        let length = (length[0] * length[0] + length[1] * length[1] + length[2] * length[2]).sqrt();
        if !(most > 0.0 && length.is_finite()) {
            return Err(PoseError::Direction(most));
        }
        if let Some(&found) = point.iter().find(|value| !value.is_finite()) {
            return Err(PoseError::Point(found));
        }
        if angle.is_nan() || angle.abs() > 1e9 {
            return Err(PoseError::Angle(angle));
        }
        if !shift.is_finite() {
            return Err(PoseError::Shift(shift));
        }
        // On its way, B's origin stays within this of A's origin along each axis.
        let from = start.translation();
        let far = (0..3).map(|k| 2.0 * point[k].abs() + from[k].abs()).sum::<f64>() + shift.abs();
        if far > MAX_COORDINATE {
            return Err(PoseError::ScrewTooFar(far));
        }
        let mut screw = Self {
            start: *start,
            end: *start,
            // What it is off by turns with it.
            rotation: *start.rotation(),
            defects: [[[0.0; 3]; 3]; 2],
            axis: direction.map(|value| value / most / length),
            angle,
            course: Course::Screw { point, shift },
        };
        let (rotation, translation) = screw.parts(1.0);
        screw.end = Pose::new(rotation, translation)?;
        Ok(screw)
    }

    /// Returns the angle that B turns by, in radians.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Whether B does not turn.
    fn keeps_rotation(&self) -> bool {
        self.course == Course::Line && self.start.rotation() == self.end.rotation()
    }

    /// Returns rotation and translation at a time from 0 to 1.
    fn parts(&self, t: f64) -> (Matrix, [f64; 3]) {
        let turn_by = rodrigues(self.axis, t * self.angle);
        let ideal = product(&turn_by, &self.rotation);
        let rotation = if self.keeps_rotation() {
            *self.start.rotation()
        } else {
            [0, 1, 2].map(|i| {
                [0, 1, 2]
                    .map(|j| ideal[i][j] + ((1.0 - t) * self.defects[0][i][j] + t * self.defects[1][i][j]))
            })
        };
        let (from, to) = (self.start.translation(), self.end.translation());
        let translation = match self.course {
            // Monotonic in t, as each operation is.
            Course::Line => [0, 1, 2].map(|k| {
                let reached = from[k] + t * (to[k] - from[k]);
                reached.clamp(from[k].min(to[k]), from[k].max(to[k]))
            }),
            Course::Screw { point, shift } => {
                let turned = turn(&turn_by, [0, 1, 2].map(|k| from[k] - point[k]));
                [0, 1, 2].map(|k| turned[k] + (point[k] + t * shift * self.axis[k]))
            }
        };
        (rotation, translation)
    }

    /// Returns how far rounding may move a point within `radius` of B's origin from its ideal place.
    pub(super) fn rounding(&self, radius: f64) -> f64 {
        let sum = |v: [f64; 3]| v.iter().map(|x| x.abs()).sum::<f64>();
        let ends = sum(self.start.translation()) + sum(self.end.translation());
        // The angle is rounded before its sine is taken.
        let turned = POSE_ERROR * (1.0 + self.angle.abs());
        match self.course {
            // A difference, a product and a sum, however far away the line is.
            Course::Line if self.keeps_rotation() => LINE_ERROR * ends,
            Course::Line => turned * radius + LINE_ERROR * ends,
            Course::Screw { point, shift } => turned * (radius + ends + 2.0 * sum(point) + 3.0 * shift.abs()),
        }
    }

    /// Returns how far any point within `radius` of B's origin moves at most, between two poses.
    pub(super) fn way(&self, radius: f64) -> f64 {
        let (from, to) = (self.start.translation(), self.end.translation());
        let line = length([0, 1, 2].map(|k| to[k] - from[k]));
        let defects = norm(&difference(&self.defects[1], &self.defects[0]));
        (line + (self.angle.abs() + defects) * radius) * MAX_STRETCH
    }

    /// Returns how far a point within `radius` of B's origin is at most from the axis about which it turns.
    fn arm(&self, radius: f64) -> f64 {
        match self.course {
            Course::Line => radius,
            Course::Screw { point, .. } => {
                let from = self.start.translation();
                let offset = [0, 1, 2].map(|k| from[k] - point[k]);
                radius + (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]).sqrt()
            }
        }
    }
}

/// A point at distance r from the axis moves on an arc of angle a, and linearly along the axis and with the origin, which
/// adds nothing. On the arc its acceleration is r a^2, for any a. Defects of rotations are linear in time, and stretch lengths
/// by less than 2^-18.
impl RigidPath for Motion {
    fn pose(&self, t: f64) -> Pose {
        // NaN is no time; it counts as the start.
        if t.is_nan() || t <= 0.0 {
            return self.start;
        }
        if t >= 1.0 {
            return self.end;
        }
        let (rotation, translation) = self.parts(t);
        Pose::of_valid(rotation, translation)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        sagitta_of(self, radius, [t0, t1], |radius, [t0, t1]| {
            let turned = (t1 - t0) * self.angle;
            let arc = self.arm(radius) * (turned * turned) / 8.0;
            // Thrice: of the point, and of both ends of the segment.
            arc * MAX_STRETCH + 3.0 * self.rounding(radius)
        })
    }

    fn slides(&self, _t0: f64, _t1: f64) -> bool {
        self.keeps_rotation()
    }
}

/// Returns the sagitta of a path for any numbers, given what it is for radii of at least 0 and times in their order from 0
/// to 1.
pub(super) fn sagitta_of(
    path: &impl RigidPath,
    radius: f64,
    times: [f64; 2],
    within: impl Fn(f64, [f64; 2]) -> f64,
) -> f64 {
    let [t0, t1] = times;
    if !radius.is_finite() || t0.is_nan() || t1.is_nan() {
        return f64::INFINITY;
    }
    let (radius, [t0, t1]) = (radius.abs(), [t0.min(t1), t0.max(t1)]);
    let [from, to] = [t0, t1].map(|t| t.clamp(0.0, 1.0));
    let inside = within(radius, [from, to]);
    let outside = (from - t0) + (t1 - to);
    if outside == 0.0 {
        return inside;
    }
    // Outside it stands still, where one that goes straight at a constant rate is on its way.
    let (start, end) = (path.pose(from), path.pose(to));
    let turned = norm(&difference(end.rotation(), start.rotation()));
    let moved = length([0, 1, 2].map(|k| end.translation()[k] - start.translation()[k])) + turned * radius;
    inside + moved * (outside / (t1 - t0)).min(1.0) * (1.0 + SLACK)
}

/// Returns the rotation by an angle about an axis of length 1 (Rodrigues' formula).
fn rodrigues([x, y, z]: [f64; 3], angle: f64) -> Matrix {
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    // 1 - cos a without cancellation.
    let half = libm::sin(0.5 * angle);
    let versine = 2.0 * half * half;
    [
        [cosine + x * x * versine, x * y * versine - z * sine, x * z * versine + y * sine],
        [x * y * versine + z * sine, cosine + y * y * versine, y * z * versine - x * sine],
        [x * z * versine - y * sine, y * z * versine + x * sine, cosine + z * z * versine],
    ]
}

/// Returns the unit quaternion of a rotation, with w >= 0: of four times the squares of its entries, the largest is taken
/// from the diagonal, and the others from sums and differences (S. W. Shepperd, "Quaternion from rotation matrix", 1978).
fn quaternion(r: &Matrix) -> [f64; 4] {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let [x, y, z] = [0, 1, 2].map(|k| 1.0 + 2.0 * r[k][k] - trace);
    let w = 1.0 + trace;
    let sums = [r[2][1] + r[1][2], r[0][2] + r[2][0], r[1][0] + r[0][1]];
    let differences = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let most = x.max(y).max(z).max(w);
    let q = if most == w {
        [differences[0], differences[1], differences[2], w]
    } else if most == x {
        [x, sums[2], sums[1], differences[0]]
    } else if most == y {
        [sums[2], y, sums[0], differences[1]]
    } else {
        [sums[1], sums[0], z, differences[2]]
    };
    let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    let sign = if q[3] < 0.0 { -length } else { length };
    q.map(|value| value / sign)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::motion::Polyline;

    fn pose(axis: [f64; 3], angle: f64, translation: [f64; 3]) -> Pose {
        let length = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
        Pose::new(rodrigues(axis.map(|v| v / length), angle), translation).unwrap()
    }

    pub(in crate::motion) fn signed(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(state: &mut u64) -> [f64; 3] {
        [signed(state), signed(state), signed(state)]
    }

    pub(in crate::motion) fn paths(state: &mut u64) -> Vec<Box<dyn RigidPath + Sync>> {
        let mut paths: Vec<Box<dyn RigidPath + Sync>> = Vec::new();
        for angle in [0.0, 1e-9, 0.1, 1.0, 3.0, 3.1] {
            let start = pose(vector(state), 3.0 * signed(state), vector(state).map(|v| 10.0 * v));
            let turned = pose(vector(state), angle, vector(state));
            let end = Pose::new(product(turned.rotation(), start.rotation()), vector(state)).unwrap();
            paths.push(Box::new(Motion::between(&start, &end).unwrap()));
            for turns in [0.3, 2.0, -17.0] {
                let shift = 3.0 * signed(state);
                paths.push(Box::new(
                    Motion::screw(&start, vector(state), vector(state), turns, shift).unwrap(),
                ));
            }
            let third = pose(vector(state), signed(state), vector(state));
            paths.push(Box::new(Polyline::new(&[start, end, third]).unwrap()));
        }
        // A rotation near the limit of what is rigid.
        let mut skewed = *Pose::IDENTITY.rotation();
        skewed[0][1] = 0.9 / (1 << 20) as f64;
        let start = Pose::new(skewed, [0.0; 3]).unwrap();
        paths.push(Box::new(Motion::between(&start, &pose([1.0, 2.0, 3.0], 1.0, [1.0; 3])).unwrap()));
        // A polyline on which nothing but what rotations are off by changes.
        let mut sheared = *Pose::IDENTITY.rotation();
        (sheared[0][1], sheared[1][0]) = (0.45 / (1 << 20) as f64, 0.45 / (1 << 20) as f64);
        let sheared = Pose::new(sheared, [0.0; 3]).unwrap();
        let there_and_back = [Pose::IDENTITY, sheared, Pose::IDENTITY, sheared, Pose::IDENTITY];
        for knots in 3..=5 {
            paths.push(Box::new(Polyline::new(&there_and_back[..knots]).unwrap()));
        }
        // Without a turn, on which nothing but translations are rounded.
        let turned = pose(vector(state), 1.0, vector(state));
        for far in [0.0, 1e6] {
            let to = vector(state).map(|v| v + far);
            let slide = Motion::between(&turned, &Pose::new(*turned.rotation(), to).unwrap()).unwrap();
            assert!(slide.slides(0.0, 1.0) && slide.angle() == 0.0);
            paths.push(Box::new(slide));
        }
        // Far from the origin.
        let far = |x: f64| pose([0.0, 0.0, 1.0], x, [4e6, 5e6 + x, 0.0]);
        paths.push(Box::new(Motion::between(&far(0.0), &far(1.0)).unwrap()));
        paths.push(Box::new(Polyline::new(&[far(0.0), far(1.0), far(0.5)]).unwrap()));
        paths
    }

    #[test]
    fn motions_begin_and_end_at_their_poses() {
        let state = &mut 5;
        for _ in 0..100 {
            let [start, end] = [(); 2].map(|()| pose(vector(state), 3.0 * signed(state), vector(state)));
            let motion = Motion::between(&start, &end).unwrap();
            assert_eq!((motion.pose(0.0), motion.pose(1.0)), (start, end));
            assert!(motion.angle() <= std::f64::consts::PI);
            // Nothing jumps at either end.
            for (near, at) in [(1e-12, start), (1.0 - 1e-12, end)] {
                let pose = motion.pose(near);
                let off = difference(pose.rotation(), at.rotation()).into_iter().flatten();
                assert!(
                    off.chain([0, 1, 2].map(|k| pose.translation()[k] - at.translation()[k]))
                        .all(|v| v.abs() < 1e-11)
                );
            }
        }
        let half = pose([0.0, 0.0, 1.0], std::f64::consts::PI, [0.0; 3]);
        assert!(matches!(Motion::between(&Pose::IDENTITY, &half), Err(PoseError::HalfTurn(_))));
        let most = pose([0.0, 0.0, 1.0], 179.9f64.to_radians(), [0.0; 3]);
        let motion = Motion::between(&Pose::IDENTITY, &most).unwrap();
        let middle = pose([0.0, 0.0, 1.0], 89.95f64.to_radians(), [0.0; 3]);
        assert!(
            difference(motion.pose(0.5).rotation(), middle.rotation())
                .as_flattened()
                .iter()
                .all(|v| v.abs() < 1e-14)
        );
        assert!(Polyline::new(&[half]).is_err());
        assert!(Motion::screw(&half, [0.0; 3], [0.0; 3], 1.0, 1.0).is_err());
        assert!(Motion::screw(&half, [0.0; 3], [1.0, 0.0, 0.0], f64::NAN, 1.0).is_err());
        assert!(Motion::screw(&half, [0.0; 3], [1.0, 0.0, 0.0], 1.0, 1e300).is_err());
        // A whole turn ends where it begins, but would lead too far.
        let axis = [1e300, 0.0, 0.0];
        assert!(Motion::screw(&half, axis, [0.0, 0.0, 1.0], std::f64::consts::TAU, 0.0).is_err());
        assert!(Motion::screw(&half, axis, [0.0, 0.0, 1.0], 0.0, 0.0).is_err());
        assert_eq!(motion.pose(f64::NAN), motion.pose(0.0));
        assert_eq!((motion.pose(-1.0), motion.pose(f64::INFINITY)), (motion.pose(0.0), motion.pose(1.0)));
        let line = Polyline::new(&[Pose::IDENTITY, most]).unwrap();
        assert_eq!((line.pose(f64::NAN), line.pose(9.0)), (line.pose(0.0), line.pose(1.0)));
    }

    /// Where a path slides, its rotation stays and each coordinate goes one way, to the bit. Those that turn or have a corner do not slide.
    #[test]
    fn what_slides_goes_one_way_along_each_axis() {
        let state = &mut 13;
        let turned = pose(vector(state), 1.0, [0.0; 3]);
        let at = |to: [f64; 3]| Pose::new(*turned.rotation(), to).unwrap();
        for _ in 0..200 {
            let far = 10f64.powi((signed(state) * 8.0) as i32);
            let [from, mut to] = [(); 2].map(|()| vector(state).map(|v| v * far));
            // Along one axis hardly, along another not at all.
            (to[0], to[1]) = (from[0].next_up().next_up(), from[1]);
            let slide = Motion::between(&at(from), &at(to)).unwrap();
            let bent = Polyline::new(&[at(from), at(to), at([0.0; 3])]).unwrap();
            assert!(bent.slides(0.0, 0.5) && bent.slides(0.5, 1.0) && !bent.slides(0.25, 0.75));
            let mut times: Vec<f64> = (0..200).map(|_| signed(state).abs()).collect();
            times.extend([0.0, 1.0]);
            times.sort_by(f64::total_cmp);
            for axis in 0..3 {
                let reached: Vec<f64> = times.iter().map(|&t| slide.pose(t).translation()[axis]).collect();
                assert!(reached.is_sorted() || reached.iter().rev().is_sorted(), "{reached:?}");
            }
            assert!(times.iter().all(|&t| slide.pose(t).rotation() == turned.rotation()));
        }
        assert!(!Motion::between(&turned, &Pose::IDENTITY).unwrap().slides(0.0, 1.0));
        assert!(!Motion::screw(&turned, [0.0; 3], [0.0, 0.0, 1.0], 1.0, 1.0).unwrap().slides(0.0, 1.0));
    }

    /// How far a random point is at most from where it would be on its way straight through a random interval of length
    /// 2^-level, as a share of the bound.
    pub(in crate::motion) fn departure(path: &dyn RigidPath, level: i32, state: &mut u64) -> f64 {
        let size = 0.5f64.powi(level);
        let t0 = (signed(state).abs() / size).floor() * size;
        departure_between(path, [t0, (t0 + size).min(1.0)], state)
    }

    fn departure_between(path: &dyn RigidPath, [t0, t1]: [f64; 2], state: &mut u64) -> f64 {
        let radius = 2.0 * signed(state).abs() + 1e-6;
        let bound = path.sagitta(radius, t0, t1);
        let p = vector(state);
        let length = p.iter().map(|v| v * v).sum::<f64>().sqrt();
        let p = p.map(|v| v / length * radius);
        let (a, b) = (path.pose(t0).place(p), path.pose(t1).place(p));
        let mut largest: f64 = 0.0;
        for step in 0..=64 {
            let share = f64::from(step) / 64.0;
            let at = path.pose(t0 + (t1 - t0) * share).place(p);
            let off = (0..3).map(|k| (at[k] - a[k] - share * (b[k] - a[k])).powi(2)).sum::<f64>().sqrt();
            largest = largest.max(off / bound);
        }
        largest
    }

    /// Points on the sphere of the radius never leave the segment by more than the bound, and some come near it.
    #[test]
    fn no_point_leaves_its_segment_by_more_than_the_sagitta() {
        let state = &mut 11;
        let mut largest: f64 = 0.0;
        for path in paths(state) {
            for _ in 0..60 {
                let level = (signed(state).abs() * 20.0) as i32;
                let ratio = departure(&*path, level, state);
                assert!(ratio <= 1.0, "{ratio} at level {level}");
                largest = largest.max(if level < 8 { ratio } else { 0.0 });
            }
        }
        assert!(largest > 0.5, "{largest}");
    }

    #[test]
    fn sagittas_hold_for_ways_back_and_beyond_the_ends() {
        let state = &mut 12;
        for path in paths(state) {
            for _ in 0..60 {
                let [t0, t1] = [(); 2].map(|()| 0.5 + signed(state));
                let ratio = departure_between(&*path, [t0, t1], state);
                assert!(ratio <= 1.0, "{ratio} from {t0} to {t1}");
            }
            assert_eq!(path.sagitta(1.0, 0.25, 0.75), path.sagitta(-1.0, 0.75, 0.25));
            for [radius, t0, t1] in [[f64::NAN, 0.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, 0.0, f64::NAN]] {
                assert_eq!(path.sagitta(radius, t0, t1), f64::INFINITY);
            }
            assert!(path.sagitta(1.0, f64::NEG_INFINITY, f64::INFINITY).is_finite());
        }
    }
}
