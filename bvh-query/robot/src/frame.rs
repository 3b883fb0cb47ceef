//! Rigid frames in plain `f64`, as kinematics composes them.
//!
//! A [`Pose`] checks that it is rigid and flushes tiny numbers whenever one is made. Along a chain of joints that is only of use at
//! the end.

use bvh_query::{Pose, PoseError};

pub(crate) type Point = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// A rotation, by rows, and a translation in mesh units. A point x of the body is at R x + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) rotation: Matrix,
    pub(crate) translation: Point,
}

impl Frame {
    pub(crate) const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// Returns the frame of turns about the fixed axes x, y and z, and then a translation, as URDF writes it.
    pub(crate) fn from_angles([roll, pitch, yaw]: Point, translation: Point) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(libm::sincos);
        let rotation = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        Self { rotation, translation }
    }

    /// Returns the frame of a unit quaternion, the real part last.
    pub(crate) fn from_quaternion([x, y, z, w]: [f64; 4], translation: Point) -> Self {
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Self { rotation, translation }
    }

    /// Returns this frame with a body's own rotation and translation in front of it: first `inner`, then this one.
    pub(crate) fn of(&self, inner: &Self) -> Self {
        Self {
            rotation: product(&self.rotation, &inner.rotation),
            translation: self.place(inner.translation),
        }
    }

    /// Returns the frame with the inner one seen from this one.
    pub(crate) fn relative(&self, inner: &Self) -> Self {
        let way = each(|k| inner.translation[k] - self.translation[k]);
        let column = |k: usize, v: Point| {
            self.rotation[0][k] * v[0] + self.rotation[1][k] * v[1] + self.rotation[2][k] * v[2]
        };
        let of = |k: usize, j: usize| column(k, each(|row| inner.rotation[row][j]));
        Self { rotation: each(|k| each(|j| of(k, j))), translation: each(|k| column(k, way)) }
    }

    /// Returns where a point of the body is.
    #[inline]
    pub(crate) fn place(&self, [x, y, z]: Point) -> Point {
        each(|k| {
            let row = &self.rotation[k];
            row[0] * x + row[1] * y + row[2] * z + self.translation[k]
        })
    }

    /// Returns where a point of the world is in the body's frame.
    pub(crate) fn find(&self, point: Point) -> Point {
        let way = each(|k| point[k] - self.translation[k]);
        each(|k| (0..3).map(|row| self.rotation[row][k] * way[row]).sum())
    }

    /// Returns the rotation alone, which turns directions.
    pub(crate) fn turning(&self) -> Self {
        Self { translation: [0.0; 3], ..*self }
    }

    /// Returns the frame as a pose.
    pub(crate) fn pose(&self) -> Result<Pose, PoseError> {
        Pose::new(self.rotation, self.translation)
    }
}

impl From<&Pose> for Frame {
    fn from(pose: &Pose) -> Self {
        Self { rotation: *pose.rotation(), translation: pose.translation() }
    }
}

/// Returns the product of two matrices.
#[inline]
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    each(|i| each(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

/// Returns what is said of each of three coordinates. Unlike `map` of an array, it is always compiled in place.
#[inline(always)]
pub(crate) fn each<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

pub(crate) fn length(v: Point) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Returns more than how far a rotation is from a rigid one, as a part of lengths: twice the sum of the entries of R^T R - I.
///
/// Frames of joints are rigid but for roundings. A pose that a caller gives may be 2^-20 from rigid, as those that were computed in
/// `f32` are.
pub(crate) fn departure(rotation: &Matrix) -> f64 {
    let entry = |i: usize, j: usize| {
        let product: f64 = (0..3).map(|row| rotation[row][i] * rotation[row][j]).sum();
        (product - if i == j { 1.0 } else { 0.0 }).abs()
    };
    2.0 * (0..9).map(|place| entry(place / 3, place % 3)).sum::<f64>()
}
