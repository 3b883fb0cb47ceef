//! Limits of the meshes that a bake accepts.

use bvh_format::object::MAX_COORDINATE;

/// The most triangles that a mesh may have: ids have 32 bits, and the last id stays unused.
pub const MAX_TRIANGLES: u64 = u32::MAX as u64 - 1;
/// The most vertices that a mesh with vertex numbers may have: the numbers have 32 bits.
pub const MAX_VERTICES: u64 = u32::MAX as u64;

/// Returns whether the format can store this coordinate.
pub(crate) fn coordinate_fits(coordinate: f64) -> bool {
    // This comparison is false for NaN.
    coordinate.abs() <= MAX_COORDINATE
}
