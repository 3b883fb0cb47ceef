//! Rigid placements of B in A's frame.

/// A rigid transform: a point `x` of B is at `R x + t` in A's frame.
///
/// A placed vertex is, coordinate by coordinate, the f64 value `((R0 * x + R1 * y) + R2 * z) + t` with
/// each product and sum rounded to nearest, never fused; queries are about these points exactly.
/// For that arithmetic to be exact where it must be, entries are canonical: a rotation entry below
/// 2^-64 in magnitude counts as 0, a translation below 2^-213 too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// How far from orthonormal a rotation may be: the largest entry of `R R^T - I`. Ten digits more
/// than a product of a few f64 rotations loses, five fewer than would let a wrong matrix through.
const RIGID_TOLERANCE: f64 = 1.0 / (1u64 << 20) as f64;
/// The largest translation, as large as the largest coordinate of the format.
const MAX_TRANSLATION: f64 = bvh_format::object::MAX_COORDINATE;
/// 2^-64: see `Pose`.
const TINY_ROTATION: f64 = 1.0 / (1u128 << 64) as f64;
/// 2^-213: see `Pose`.
const TINY_TRANSLATION: f64 = f64::from_bits((1023 - 213) << 52);

impl Pose {
    /// A in B's place: no motion.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// From the rows of a rotation matrix and a translation in mesh units.
    ///
    /// # Errors
    /// If an entry is not finite, the translation beyond 2^120, or the rotation further than 2^-20
    /// from orthonormal or a reflection; the error says by how much.
    pub fn new(rotation: [[f64; 3]; 3], translation: [f64; 3]) -> Result<Self, PoseError> {
        if !rotation.iter().flatten().chain(&translation).all(|v| v.is_finite()) {
            return Err(PoseError::NotFinite);
        }
        if let Some(&far) = translation.iter().find(|v| v.abs() > MAX_TRANSLATION) {
            return Err(PoseError::TooFar(far));
        }
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut worst = 0.0f64;
        for i in 0..3 {
            for j in 0..3 {
                let error = dot(rotation[i], rotation[j]) - f64::from(u8::from(i == j));
                worst = if error.abs() > worst || error.is_nan() { error.abs() } else { worst };
            }
        }
        if worst.is_nan() || worst > RIGID_TOLERANCE {
            return Err(PoseError::NotRigid(worst));
        }
        let [x, y, z] = rotation;
        let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        if dot(cross, z) < 0.0 {
            return Err(PoseError::Reflection);
        }
        let flush = |tiny: f64| move |v: f64| if v.abs() < tiny { 0.0 } else { v };
        Ok(Self {
            rotation: rotation.map(|row| row.map(flush(TINY_ROTATION))),
            translation: translation.map(flush(TINY_TRANSLATION)),
        })
    }

    /// From the 12 numbers of a row-major 3x4 matrix `[R | t]`.
    ///
    /// # Errors
    /// As `new`.
    pub fn from_rows(m: &[f64; 12]) -> Result<Self, PoseError> {
        Self::new([[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]], [m[3], m[7], m[11]])
    }

    /// Rows of the rotation.
    pub fn rotation(&self) -> &[[f64; 3]; 3] {
        &self.rotation
    }

    /// The translation in mesh units.
    pub fn translation(&self) -> [f64; 3] {
        self.translation
    }

    /// Where a point of B is in A's frame: the definition of a placed vertex.
    #[inline]
    pub fn place(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = point;
        let along = |i: usize| {
            let r = &self.rotation[i];
            ((r[0] * x + r[1] * y) + r[2] * z) + self.translation[i]
        };
        [along(0), along(1), along(2)]
    }
}

/// A matrix that is not a rigid placement.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// An entry is NaN or infinite.
    #[error("expected finite pose entries, found NaN or infinity")]
    NotFinite,
    /// The translation is beyond the format's range.
    #[error("expected a translation of at most 2^120, found {0:e}")]
    TooFar(f64),
    /// Rows are not orthonormal; the largest entry of R R^T - I.
    #[error("expected a rigid pose, found a matrix {0:e} away from orthonormal (limit 2^-20)")]
    NotRigid(f64),
    /// Determinant -1.
    #[error("expected a rotation, found a reflection")]
    Reflection,
}

#[cfg(feature = "mint")]
mod mint_conversions {
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

        /// The last row is taken to be 0 0 0 1.
        fn try_from(m: mint::ColumnMatrix4<f64>) -> Result<Self, PoseError> {
            Self::new(
                [[m.x.x, m.y.x, m.z.x], [m.x.y, m.y.y, m.z.y], [m.x.z, m.y.z, m.z.z]],
                [m.w.x, m.w.y, m.w.z],
            )
        }
    }

    impl TryFrom<(mint::Quaternion<f64>, mint::Vector3<f64>)> for Pose {
        type Error = PoseError;

        /// A unit quaternion and a translation.
        fn try_from((q, t): (mint::Quaternion<f64>, mint::Vector3<f64>)) -> Result<Self, PoseError> {
            let (x, y, z, w) = (q.v.x, q.v.y, q.v.z, q.s);
            Self::new(
                [
                    [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
                    [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
                    [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
                ],
                [t.x, t.y, t.z],
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_not_rigid_and_says_by_how_much() {
        let mut rows = Pose::IDENTITY.rotation;
        rows[0][0] = 1.0 + 1e-3;
        assert!(
            matches!(Pose::new(rows, [0.0; 3]), Err(PoseError::NotRigid(e)) if (e - 2.001e-3).abs() < 1e-6)
        );
        rows[0][0] = f64::NAN;
        assert_eq!(Pose::new(rows, [0.0; 3]), Err(PoseError::NotFinite));
        rows[0][0] = -1.0;
        assert_eq!(Pose::new(rows, [0.0; 3]), Err(PoseError::Reflection));
        assert!(matches!(Pose::new(Pose::IDENTITY.rotation, [1e300, 0.0, 0.0]), Err(PoseError::TooFar(_))));
        assert!(matches!(Pose::new([[1e200; 3]; 3], [0.0; 3]), Err(PoseError::NotRigid(_))));
    }

    #[test]
    fn tiny_entries_count_as_zero() {
        let mut rows = Pose::IDENTITY.rotation;
        rows[0][1] = 1e-30;
        let pose = Pose::new(rows, [1e-100, -0.0, 1.0]).unwrap();
        assert_eq!(pose.rotation, Pose::IDENTITY.rotation);
        assert_eq!(pose.translation, [0.0, 0.0, 1.0]);
    }
}
