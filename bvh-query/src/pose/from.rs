//! Poses from quaternions, from 4x4 matrices, and from matrices that are only nearly rigid.

use super::{MAX_RIGID_ERROR, Pose, PoseError, departure, dot};

/// How far from orthonormal a matrix may be for [`Pose::nearest`]: the largest entry of `R R^T - I`. Matrices of `f32`, or
/// with three printed digits, are nearer; what is farther was likely meant to scale or to shear.
const MAX_NEARLY_RIGID_ERROR: f64 = 1.0 / 64.0;
/// The steps of the iteration in `Pose::nearest`. An error of e leaves 3/4 e^2: from three times the limit, in the norm that
/// counts, four steps leave less than 2^-70. The fifth removes what the fourth rounded.
const STEPS_TO_NEAREST: usize = 5;

impl Pose {
    /// Creates a pose from a quaternion `[x, y, z, w]`, the real part last, and a translation in mesh units. The rotation
    /// is that of the quaternion over its length, so that it is orthonormal to a few roundings.
    ///
    /// # Errors
    /// [`PoseError::Quaternion`] if the square of the quaternion's length is not within 2^-20 of 1, [`PoseError::NotFinite`]
    /// and [`PoseError::TooFar`] for a translation.
    pub fn from_quaternion(quaternion: [f64; 4], translation: [f64; 3]) -> Result<Self, PoseError> {
        let [x, y, z, w] = quaternion;
        let squared = x * x + y * y + z * z + w * w;
        // NaN is not within anything.
        if (squared - 1.0).abs() <= MAX_RIGID_ERROR {
            let s = 2.0 / squared;
            let rotation = [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
            ];
            return Self::new(rotation, translation);
        }
        Err(PoseError::Quaternion(squared.sqrt()))
    }

    /// Creates a pose from the rows of a homogeneous 4x4 matrix, the last of which must be 0 0 0 1.
    ///
    /// # Errors
    /// [`PoseError::LastRow`], and the errors of [`Pose::new`].
    pub fn from_matrix(rows: &[[f64; 4]; 4]) -> Result<Self, PoseError> {
        let [x, y, z, last] = rows;
        if *last != [0.0, 0.0, 0.0, 1.0] {
            return Err(PoseError::LastRow(*last));
        }
        let row = |v: &[f64; 4]| [v[0], v[1], v[2]];
        Self::new([row(x), row(y), row(z)], [x[3], y[3], z[3]])
    }

    /// Creates the pose whose rotation is nearest to a nearly rigid matrix, in the sum of squares of entries: its polar
    /// factor (N. J. Higham, "Computing the polar decomposition", SIAM J. Sci. Stat. Comput. 7(4), 1986), by five steps of
    /// the iteration of Newton and Schulz, `X (3 I - X^T X) / 2`.
    ///
    /// # Errors
    /// [`PoseError::NotNearlyRigid`] if an entry of `R R^T - I` exceeds 2^-6; [`PoseError::Scaled`] if it does and the
    /// matrix is a multiple of a rotation; and the errors of [`Pose::new`] for numbers that are not finite, for a
    /// translation beyond the limit and for a reflection.
    pub fn nearest(rotation: [[f64; 3]; 3], translation: [f64; 3]) -> Result<Self, PoseError> {
        let worst = departure(&rotation, 1.0);
        if worst.is_nan() || worst > MAX_NEARLY_RIGID_ERROR {
            // What `new` says of numbers that are not finite, of scales and of reflections holds here, too.
            return Err(match Self::new(rotation, translation) {
                Err(PoseError::NotRigid(worst)) => PoseError::NotNearlyRigid(worst),
                Err(error) => error,
                Ok(_) => PoseError::NotNearlyRigid(worst),
            });
        }
        let mut x = rotation;
        for _ in 0..STEPS_TO_NEAREST {
            let column = |j: usize| [x[0][j], x[1][j], x[2][j]];
            let correction = [0, 1, 2].map(|i| {
                [0, 1, 2].map(|j| 0.5 * (if i == j { 3.0 } else { 0.0 } - dot(column(i), column(j))))
            });
            let columns = [0, 1, 2].map(|j| [correction[0][j], correction[1][j], correction[2][j]]);
            x = x.map(|row| columns.map(|column| dot(row, column)));
        }
        Self::new(x, translation)
    }
}

impl TryFrom<[f64; 12]> for Pose {
    type Error = PoseError;

    /// Does what [`Pose::from_rows`] does.
    fn try_from(rows: [f64; 12]) -> Result<Self, PoseError> {
        Self::from_rows(&rows)
    }
}

impl From<Pose> for [f64; 12] {
    /// Returns the numbers of [`Pose::from_rows`].
    fn from(Pose { rotation: [x, y, z], translation: t }: Pose) -> Self {
        [x[0], x[1], x[2], t[0], y[0], y[1], y[2], t[1], z[0], z[1], z[2], t[2]]
    }
}
