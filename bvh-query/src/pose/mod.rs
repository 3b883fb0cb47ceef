//! Rigid placements: of B in A's frame, or of a body in the world.

mod error;
pub(crate) mod frames;
mod from;
#[cfg(feature = "mint")]
mod from_mint;

pub use error::PoseError;

use crate::numerics::LEAST_COORDINATE;
use bvh_format::instances::{departure, handedness};
use bvh_format::vec3::dot;

/// A rigid transform, from a body to the world or from B to A: a point `x` of the body is at `R x + t` in the world.
///
/// Conventions: points are columns, matrices are given row by row, rotations are right-handed, quaternions are
/// `[x, y, z, w]` with the real part last, lengths are mesh units.
///
/// Each coordinate of a placed vertex is the f64 value `((R0 * x + R1 * y) + R2 * z) + t`, where each product and sum
/// is rounded to nearest and none is fused. Queries are about exactly these points. To keep exact arithmetic within the
/// range of f64, a rotation entry below 2^-64 in magnitude counts as 0, and so does a translation below 2^-213.
///
/// # Other crates
/// With the feature `mint`, poses come from the matrices and quaternions of crates that convert to those of mint: glam
/// (`DMat4`, or `DQuat` and `DVec3`) with its feature `mint`, nalgebra (`Matrix4`, such as the result of
/// `Isometry3::to_homogeneous`) with its feature `convert-mint`, and others. The errors are those of [`Pose::new`].
///
#[cfg_attr(feature = "mint", doc = "```")]
#[cfg_attr(not(feature = "mint"), doc = "```ignore")]
/// use bvh_query::{Pose, PoseError};
///
/// // For glam: `of_matrix(DMat4::from_rotation_translation(rotation, translation))`, `of_parts(rotation, translation)`.
/// fn of_matrix(matrix: impl Into<mint::ColumnMatrix4<f64>>) -> Result<Pose, PoseError> {
///     Pose::try_from(matrix.into())
/// }
/// fn of_parts(
///     rotation: impl Into<mint::Quaternion<f64>>,
///     translation: impl Into<mint::Vector3<f64>>,
/// ) -> Result<Pose, PoseError> {
///     Pose::try_from((rotation.into(), translation.into()))
/// }
/// let columns = [[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [5.0, 0.0, 0.0, 1.0]];
/// let quarter_turn = of_matrix(columns)?;
/// assert_eq!(quarter_turn.place([1.0, 0.0, 0.0]), [5.0, 1.0, 0.0]);
/// assert_eq!(of_parts([0.0, 0.0, 1.0, 0.0], [5.0, 0.0, 0.0])?.place([1.0, 0.0, 0.0]), [4.0, 0.0, 0.0]);
/// # Ok::<(), PoseError>(())
/// ```
///
/// With the feature `serde`, a pose is the 12 numbers of [`Pose::from_rows`], and numbers that make no pose are refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[f64; 12]", into = "[f64; 12]"))]
pub struct Pose {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// How far from orthonormal a rotation may be: the largest entry of `R R^T - I`. This is ten digits more than a product
/// of a few f64 rotations loses, and five fewer than a wrong matrix is off by.
const MAX_RIGID_ERROR: f64 = 1.0 / (1u64 << 20) as f64;
/// The least error, 2^-10, measured like `MAX_RIGID_ERROR`, for which a message calls a matrix scaled. A factor nearer
/// to 1 would look like 1 to a reader, and a rounded rotation needs another remedy.
const MIN_SCALED_ERROR: f64 = 1.0 / 1024.0;
/// The largest translation along an axis in mesh units, as large as the largest coordinate of the format.
const MAX_TRANSLATION: f64 = bvh_format::object::MAX_COORDINATE;
/// Rotation entries below this, 2^-64, count as 0: see `Pose`.
const MIN_ROTATION_ENTRY: f64 = 1.0 / (1u128 << 64) as f64;
impl Pose {
    /// The identity: B's frame is A's.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// Creates a pose from the rows of a rotation matrix and a translation in mesh units.
    ///
    /// # Errors
    /// [`PoseError`] if an entry is not finite, if the translation exceeds 2^120 along an axis, or if the matrix is not a
    /// rotation to within 2^-20.
    pub fn new(rotation: [[f64; 3]; 3], translation: [f64; 3]) -> Result<Self, PoseError> {
        // All at once, which compilers turn into vector code. Only what is refused is looked for one by one.
        let finite = |entries: &[f64]| entries.iter().fold(true, |all, entry| all & entry.is_finite());
        if !(finite(rotation.as_flattened()) & finite(&translation)) {
            for row in 0..3 {
                let entries = rotation[row].into_iter().chain([translation[row]]);
                if let Some((column, found)) = entries.enumerate().find(|(_, entry)| !entry.is_finite()) {
                    return Err(PoseError::NotFinite { row: row + 1, column: column + 1, found });
                }
            }
        }
        if let Some(&far) = translation.iter().find(|v| v.abs() > MAX_TRANSLATION) {
            return Err(PoseError::TooFar(far));
        }
        let worst = departure(&rotation, 1.0);
        if worst.is_nan() || worst > MAX_RIGID_ERROR {
            let squared = dot(rotation[0], rotation[0]);
            let is_multiple = squared > 0.0 && departure(&rotation, squared) <= MAX_RIGID_ERROR * squared;
            let is_scaled = worst > MIN_SCALED_ERROR && is_multiple;
            return Err(if is_scaled {
                PoseError::Scaled(squared.sqrt())
            } else {
                PoseError::NotRigid(worst)
            });
        }
        if handedness(&rotation) < 0.0 {
            return Err(PoseError::Reflection);
        }
        Ok(Self::of_valid(rotation, translation))
    }

    /// Creates a pose from parts that are known to be valid, or that lie between those of valid poses. In the spectral
    /// norm, its rotation departs from a rigid one by at most three times the limit for an entry, as theirs may. That
    /// bounds the stretch, which is what queries charge.
    pub(crate) fn of_valid(rotation: [[f64; 3]; 3], translation: [f64; 3]) -> Self {
        let flush = |tiny: f64| move |v: f64| if v.abs() < tiny { 0.0 } else { v };
        Self {
            rotation: rotation.map(|row| row.map(flush(MIN_ROTATION_ENTRY))),
            translation: translation.map(flush(LEAST_COORDINATE)),
        }
    }

    /// Creates a pose from the 12 numbers of a row-major 3x4 matrix `[R | t]`.
    ///
    /// # Errors
    /// The errors of [`Pose::new`].
    pub fn from_rows(m: &[f64; 12]) -> Result<Self, PoseError> {
        Self::new([[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]], [m[3], m[7], m[11]])
    }

    /// Returns the rows of the rotation.
    pub fn rotation(&self) -> &[[f64; 3]; 3] {
        &self.rotation
    }

    /// Returns the translation in mesh units.
    pub fn translation(&self) -> [f64; 3] {
        self.translation
    }

    /// Returns where a point of B is in A's frame. This is the definition of a placed vertex.
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
        let refused = Pose::new(rows, [0.0; 3]).unwrap_err();
        assert_eq!(refused.to_string(), "row 1, column 1: expected a finite number, found NaN");
        let refused = Pose::new(Pose::IDENTITY.rotation, [0.0, 0.0, f64::NEG_INFINITY]).unwrap_err();
        assert_eq!(refused, PoseError::NotFinite { row: 3, column: 4, found: f64::NEG_INFINITY });
        rows[0][0] = -1.0;
        assert_eq!(Pose::new(rows, [0.0; 3]), Err(PoseError::Reflection));
        assert!(matches!(Pose::new(Pose::IDENTITY.rotation, [1e300, 0.0, 0.0]), Err(PoseError::TooFar(_))));
        assert!(matches!(Pose::new([[1e200; 3]; 3], [0.0; 3]), Err(PoseError::NotRigid(_))));
    }

    #[test]
    fn a_scaled_matrix_is_named_with_its_factor() {
        let turned = ROWS.map(|row| row.map(|entry| entry / 121.0));
        for factor in [2.0, 1e-3, 25.4, -2.0] {
            let refused = Pose::new(turned.map(|row| row.map(|entry| factor * entry)), [0.0; 3]).unwrap_err();
            let expected = format!("found a matrix scaled by {}; bake the mesh at its size", factor.abs());
            assert!(refused.to_string().contains(&expected), "{refused}");
        }
        let stretched = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Pose::new(stretched, [0.0; 3]), Err(PoseError::NotRigid(3.0)));
        assert_eq!(Pose::new([[0.0; 3]; 3], [0.0; 3]), Err(PoseError::NotRigid(1.0)));
    }

    #[test]
    fn of_signed_permutations_the_turns_are_taken() {
        for (index, order) in
            [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]].iter().enumerate()
        {
            for signs in 0..8u32 {
                let mut rows = [[0.0; 3]; 3];
                for k in 0..3 {
                    rows[k][order[k]] = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
                }
                let turns = (signs.count_ones() % 2 == 0) == (index < 3);
                let refusal = Pose::new(rows, [0.0; 3]).err();
                assert_eq!(refusal, (!turns).then_some(PoseError::Reflection), "{rows:?}");
            }
        }
        for k in 0..3 {
            let mut rows = ROWS.map(|row| row.map(|entry| entry / 121.0));
            rows[k] = rows[k].map(|entry| -entry);
            assert_eq!(Pose::new(rows, [0.0; 3]), Err(PoseError::Reflection));
        }
    }

    #[test]
    fn limits_are_allowed_and_the_next_number_is_not() {
        let shear = |entry: f64| [[1.0, entry, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let limit = 2f64.powi(-20);
        assert!(Pose::new(shear(-limit), [0.0; 3]).is_ok());
        assert_eq!(Pose::new(shear(limit.next_up()), [0.0; 3]), Err(PoseError::NotRigid(limit.next_up())));
        let most = 2f64.powi(120);
        for axis in 0..3 {
            let far = |value: f64| [0, 1, 2].map(|k| if k == axis { value } else { 0.0 });
            assert!(Pose::new(Pose::IDENTITY.rotation, far(-most)).is_ok());
            let refused = Pose::new(Pose::IDENTITY.rotation, far(-most.next_up()));
            assert_eq!(refused, Err(PoseError::TooFar(-most.next_up())));
        }
    }

    #[test]
    fn tiny_entries_count_as_zero() {
        let (turn, shift) = (2f64.powi(-64), 2f64.powi(-213));
        let mut rows = Pose::IDENTITY.rotation;
        (rows[0][1], rows[0][2]) = (turn.next_down(), -turn);
        let pose = Pose::new(rows, [shift.next_down(), -0.0, -shift]).unwrap();
        assert_eq!(pose.rotation, [[1.0, 0.0, -turn], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(pose.translation, [0.0, 0.0, -shift]);
    }

    /// The rotation of the quaternion 10 + i + 2j + 4k, times 121.
    const ROWS: [[f64; 3]; 3] = [[81.0, -76.0, 48.0], [84.0, 87.0, -4.0], [-32.0, 36.0, 111.0]];

    /// Panics unless `pose` is by `ROWS` and (5, 7, -9).
    fn check_turn(pose: Result<Pose, PoseError>) {
        let pose = pose.unwrap();
        assert_eq!(pose.translation(), [5.0, 7.0, -9.0]);
        for (row, expected) in pose.rotation().as_flattened().iter().zip(ROWS.as_flattened()) {
            assert!((row - expected / 121.0).abs() < 1e-15, "{pose:?}");
        }
        // Rows times (4, 2, -3), over 121.
        let expected = [28.0 / 121.0 + 5.0, 522.0 / 121.0 + 7.0, -389.0 / 121.0 - 9.0];
        for (placed, expected) in pose.place([4.0, 2.0, -3.0]).into_iter().zip(expected) {
            assert!((placed - expected).abs() < 1e-14, "{pose:?}");
        }
    }

    #[test]
    fn rows_turn_and_move() {
        let [x, y, z] = ROWS.map(|row| row.map(|entry| entry / 121.0));
        check_turn(Pose::new([x, y, z], [5.0, 7.0, -9.0]));
        check_turn(Pose::from_rows(&[x[0], x[1], x[2], 5.0, y[0], y[1], y[2], 7.0, z[0], z[1], z[2], -9.0]));
    }

    #[test]
    #[cfg(feature = "mint")]
    fn matrices_and_quaternions_of_mint_turn_and_move_alike() {
        let [x, y, z] = ROWS.map(|row| row.map(|entry| entry / 121.0));
        let row = |x: [f64; 3], t: f64| mint::Vector4 { x: x[0], y: x[1], z: x[2], w: t };
        let rows = mint::RowMatrix3x4 { x: row(x, 5.0), y: row(y, 7.0), z: row(z, -9.0) };
        check_turn(rows.try_into());
        let column = |k: usize| mint::Vector4 { x: x[k], y: y[k], z: z[k], w: 0.0 };
        let w = mint::Vector4 { x: 5.0, y: 7.0, z: -9.0, w: 1.0 };
        check_turn(mint::ColumnMatrix4 { x: column(0), y: column(1), z: column(2), w }.try_into());
        let vector = mint::Vector3 { x: 1.0 / 11.0, y: 2.0 / 11.0, z: 4.0 / 11.0 };
        let translation = mint::Vector3 { x: 5.0, y: 7.0, z: -9.0 };
        check_turn((mint::Quaternion { v: vector, s: 10.0 / 11.0 }, translation).try_into());
    }

    #[test]
    #[cfg(feature = "mint")]
    fn projections_and_long_quaternions_of_mint_are_refused() {
        let unit = |k: usize| {
            let one = |i: usize| if i == k { 1.0 } else { 0.0 };
            mint::Vector4 { x: one(0), y: one(1), z: one(2), w: one(3) }
        };
        let identity = mint::ColumnMatrix4 { x: unit(0), y: unit(1), z: unit(2), w: unit(3) };
        assert_eq!(Pose::try_from(identity), Ok(Pose::IDENTITY));
        let mut transposed = identity;
        transposed.x.w = 5.0;
        assert_eq!(Pose::try_from(transposed), Err(PoseError::LastRow([5.0, 0.0, 0.0, 1.0])));
        let mut scaled = identity;
        scaled.w.w = 2.0;
        assert_eq!(Pose::try_from(scaled), Err(PoseError::LastRow([0.0, 0.0, 0.0, 2.0])));
        let quaternion = mint::Quaternion { v: mint::Vector3 { x: 0.0, y: 3.0, z: 0.0 }, s: 4.0 };
        let origin = mint::Vector3 { x: 0.0, y: 0.0, z: 0.0 };
        let refused = Pose::try_from((quaternion, origin)).unwrap_err();
        assert_eq!(refused.to_string(), "expected a quaternion of length 1, found length 5; normalise it");
    }
}
