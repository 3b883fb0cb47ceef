//! Why a matrix, a quaternion or a composition is no rigid pose, and why poses or numbers make no path.

/// Why a matrix is not a rigid placement, why an instance of a scene cannot have a pose, or why poses or numbers make no path.
///
/// ```
/// use bvh_query::{Pose, PoseError};
///
/// let doubled = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
/// assert_eq!(Pose::new(doubled, [0.0; 3]), Err(PoseError::Scaled(2.0)));
/// let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// assert_eq!(Pose::new(mirrored, [0.0; 3]), Err(PoseError::Reflection));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// An entry is NaN or infinite.
    #[error("row {row}, column {column}: expected a finite number, found {}", name(*.found))]
    NotFinite {
        /// The row of the 3x4 matrix, from 1 on.
        row: usize,
        /// The column of the 3x4 matrix, from 1 on; the fourth is the translation.
        column: usize,
        /// The entry.
        found: f64,
    },
    /// The translation exceeds the format's range.
    #[error(
        "expected a translation of at most 2^120 along each axis, found {0:e}; move both meshes near the origin"
    )]
    TooFar(f64),
    /// The matrix is a rotation, or a reflection, times this factor.
    #[error("expected a rotation, found a matrix scaled by {}; bake the mesh at its size", *.0 as f32)]
    Scaled(f64),
    /// The rows are not orthonormal; the number is the largest entry of R R^T - I. [`Pose::nearest`](super::Pose::nearest)
    /// orthonormalises a rounded matrix.
    #[error(
        "expected a rotation, found a matrix {0:e} away from orthonormal (limit 2^-20); if it shears or stretches, \
         bake the deformed mesh, if it is rounded, orthonormalise it"
    )]
    NotRigid(f64),
    /// The rows are too far from orthonormal for [`Pose::nearest`](super::Pose::nearest).
    #[error(
        "expected nearly a rotation, found a matrix {0:e} away from orthonormal (limit 2^-6); if it shears or stretches, \
         bake the deformed mesh"
    )]
    NotNearlyRigid(f64),
    /// The matrix has determinant -1.
    #[error("expected a rotation, found a reflection; bake the mirrored mesh")]
    Reflection,
    /// The last row of a 4x4 matrix is another one.
    #[error("row 4: expected 0 0 0 1, found {} {} {} {}; is the matrix transposed, or a projection?", .0[0], .0[1], .0[2], .0[3])]
    LastRow([f64; 4]),
    /// The length of a quaternion is not 1.
    #[error("expected a quaternion of length 1, found length {}; normalise it", *.0 as f32)]
    Quaternion(f64),
    /// The translation of an instance of a scene along an axis.
    #[error("expected a translation of at most 2^118 along each axis, nearer to the origin, found {0:e}")]
    TooFarInWorld(f64),
    /// The largest entry of `R R^T - I` of the rotation of an instance of a scene. [`Pose::nearest`](super::Pose::nearest)
    /// orthonormalises a rounded rotation.
    #[error(
        "expected a rotation within 2^-23 of orthonormal, with more digits or orthonormalised, found {0:e}"
    )]
    NotRigidInWorld(f64),
    /// The poses of a path are half a turn apart, so that neither way round is the shorter one.
    #[error("expected a turn of less than half a circle, found {0} radians; divide it by a pose between")]
    HalfTurn(f64),
    /// The direction of an axis, by its largest component.
    #[error("direction: expected a finite direction of a length above 0, found {0}")]
    Direction(f64),
    /// A coordinate of a point on an axis.
    #[error("point: expected finite coordinates, found {0}")]
    Point(f64),
    /// The angle of a screw, in radians.
    #[error("angle: expected a finite number of at most 1e9 radians, found {0}")]
    Angle(f64),
    /// The shift of a screw.
    #[error("shift: expected a finite number, found {0}")]
    Shift(f64),
    /// How far from A's origin a screw may take B.
    #[error("point: expected an axis and a shift with which B stays within 2^120, found {0}")]
    ScrewTooFar(f64),
    /// A polyline of fewer than two poses.
    #[error("expected at least two poses, found {0}")]
    TooFewPoses(usize),
}

/// Names a number that is not finite.
fn name(found: f64) -> &'static str {
    if found.is_nan() { "NaN" } else { "infinity" }
}
