//! Poses from the matrices and quaternions of the crate mint, which many crates convert to.

use super::{Pose, PoseError};

impl TryFrom<mint::RowMatrix3x4<f64>> for Pose {
    type Error = PoseError;

    fn try_from(m: mint::RowMatrix3x4<f64>) -> Result<Self, PoseError> {
        let row = |v: mint::Vector4<f64>| [v.x, v.y, v.z];
        Self::new([row(m.x), row(m.y), row(m.z)], [m.x.w, m.y.w, m.z.w])
    }
}

impl TryFrom<mint::ColumnMatrix4<f64>> for Pose {
    type Error = PoseError;

    /// Converts a 4x4 matrix, the last row of which must be 0 0 0 1.
    fn try_from(m: mint::ColumnMatrix4<f64>) -> Result<Self, PoseError> {
        Self::from_matrix(&[
            [m.x.x, m.y.x, m.z.x, m.w.x],
            [m.x.y, m.y.y, m.z.y, m.w.y],
            [m.x.z, m.y.z, m.z.z, m.w.z],
            [m.x.w, m.y.w, m.z.w, m.w.w],
        ])
    }
}

impl TryFrom<(mint::Quaternion<f64>, mint::Vector3<f64>)> for Pose {
    type Error = PoseError;

    /// Converts a unit quaternion and a translation.
    fn try_from((q, t): (mint::Quaternion<f64>, mint::Vector3<f64>)) -> Result<Self, PoseError> {
        Self::from_quaternion([q.v.x, q.v.y, q.v.z, q.s], [t.x, t.y, t.z])
    }
}
