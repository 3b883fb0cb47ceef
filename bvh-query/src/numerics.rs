//! The errors of arithmetic that bounds charge, each with its derivation: one place, so that two of one meaning cannot drift apart.
//!
//! u is the largest relative error of one rounding to nearest: 2^-53 for `f64`, 2^-24 for `f32`. A bound multiplies a constant of
//! this file by the magnitudes at hand, and the comment beside it adds up what it charges. What a question takes as a parameter, such
//! as a tolerance, and the limits of what it accepts are elsewhere, beside what they limit.

/// u of `f64`: half a unit in the last place of 1.
pub(crate) const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// u of `f32`.
pub(crate) const U: f32 = f32::EPSILON / 2.0;

/// More than the relative error of a few thousand roundings of `f64`: 8192 u. Bounds are widened by it where arithmetic with
/// the bounds themselves is not charged.
pub(crate) const SLACK: f64 = 1.0 / (1u64 << 40) as f64;

/// More than the relative error of 15 roundings of `f32`: 16 u.
pub(crate) const F32_SLACK: f32 = 1.0 / (1 << 20) as f32;

// Poses. A pose is rigid but for 2^-20 in each entry of R R^T - I: see `Pose`.

/// 2^-48, or 32 u: all computations of a pose, three times the most that occur. A pose on a path takes half of it: a sine and a
/// cosine (one rounding each), Rodrigues' formula and a product of matrices.
pub(crate) const POSE_ERROR: f64 = 1.0 / (1u64 << 48) as f64;

/// 2^-45: taking a point into the frame of an object, and placed vertices. The coordinates of a point are off by 54 u, those of a
/// translation by 64 u (see `Placement::inverse`), and placed vertices by 8 u, of the magnitudes of what is added.
pub(crate) const PROBE_ERROR: f64 = 1.0 / (1u64 << 45) as f64;

/// Lengths in two frames differ by 2^-19 of themselves at most. A bound may come from one triangle and decide about another: that
/// counts twice, which gives 2^-18; this is twice that.
pub(crate) const MAX_STRETCH: f64 = 1.0 + 1.0 / (1 << 17) as f64;

/// More than the norm of the inverse of any pose's rotation.
pub(crate) const INVERSE_NORM: f64 = 1.0 + 1.0 / (1 << 18) as f64;

/// 2^-213 mesh units. Lesser coordinates of points and translations count as 0: all others are multiples of 2^-266, as exact
/// arithmetic needs them (`narrow`).
pub(crate) const LEAST_COORDINATE: f64 = f64::from_bits((1023 - 213) << 52);

/// More than four translations that count as 0, 2^-210 mesh units.
pub(crate) const FLUSHED: f64 = 8.0 * LEAST_COORDINATE;

// Paths.

/// 2^-51, or 4 u: a point on a line between two others. Three roundings occur.
pub(crate) const LINE_ERROR: f64 = 1.0 / (1u64 << 51) as f64;

/// 2^-50, or 8 u: both places of a corner on a way along a line. They take 3 u of how far the corner is from B's origin, u of the
/// sum with the translation, u of the translation, and 2 u of the way in it, which is a product with a sum: at most 8 u of the
/// distance, the first translation and the length of the way, which has a percent to spare.
pub(crate) const PLACING_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// 2^-49, or 16 u: what decides about a cell of a motion, of the sum of distances in `Question::limit`. Placing a corner of B
/// takes 7 u of its distance from B's origin and 4 u of the translation; products with a direction of unit length take 3 u of how far
/// corners are from A's origin, and their difference 2 u. That is 12 u of both radii and 9 u of a translation; the sum has both
/// radii thrice, and two translations. A relative error of 6 u is that of the limit itself.
pub(crate) const CELL_ERROR: f64 = 1.0 / (1u64 << 49) as f64;

/// 2^-47, or 64 u: four times what one composition of poses is off by. A point is compared with a segment, of which both ends are
/// off as well.
pub(crate) const COMPOSED_ERROR: f64 = 1.0 / (1u64 << 47) as f64;

/// 2^-43: the quotients of a direction's components by the largest one. Where a pose has turned a direction, its components are off by
/// 57 u of the largest one before, and by less than twice that, or 2^-45, of the largest one after.
pub(crate) const DIRECTION_ERROR: f64 = 1.0 / (1u64 << 43) as f64;

/// 2^-44: a path in the frame of another. A relative pose is off by less than 2^-46 of the magnitudes, for the point and both ends.
pub(crate) const RELATIVE_ERROR: f64 = 1.0 / (1u64 << 44) as f64;

// Exact signs and what is measured.

/// The determinant of three differences, as a fraction of its permanent: stage A of Shewchuk's `orient3d`.
pub(crate) const ORIENTATION_ERROR: f64 = (7.0 + 56.0 * UNIT_ROUNDOFF) * UNIT_ROUNDOFF;

/// 2^-50, or 8 u: a height along a direction shorter than 1, of the magnitudes of the coordinates. Three roundings of each term, one
/// of the difference, and as many of a limit.
pub(crate) const HEIGHT_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// A mean of unit normals of well-shaped triangles.
pub(crate) const NORMAL_ERROR: f64 = 32.0 * UNIT_ROUNDOFF;

// Underflow. A product of `f32` that is subnormal is off by 2^-150 at most.

/// 2^-140 in units of a leaf's frame: each coordinate that is placed there.
pub(crate) const COORDINATE_UNDERFLOW: f32 = f32::from_bits(1 << 9);

/// 2^-120 in cubes of a frame's unit: all products of a projection, or of a height, together.
pub(crate) const CUBE_UNDERFLOW: f32 = f32::from_bits((127 - 120) << 23);

/// 2^-126: some 30 products of a sign.
pub(crate) const SIGN_UNDERFLOW: f32 = f32::MIN_POSITIVE;

/// 2^-148 in mesh units: a number that becomes a subnormal `f32`.
pub(crate) const SUBNORMAL_LOSS: f64 = f64::from_bits((1023 - 148) << 52);

/// 2^-147 in mesh units: the end of a slab, twice what four roundings of subnormal numbers give.
pub(crate) const END_UNDERFLOW: f64 = f64::from_bits((1023 - 147) << 52);

/// 2^-110 in mesh units: a gap between nodes. 60 products lose 2^-150 each, and along the line between centres that is divided by
/// their distance, which is at least 2^-30.
pub(crate) const GAP_UNDERFLOW: f64 = f64::from_bits((1023 - 110) << 52);

/// Returns the least `f32` that is not below `value`.
pub(crate) fn round_up(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}
