//! The directions and the unit in which all pairs of packets of a query are compared.
//!
//! The unit makes the larger object about 1 in size, so that squares and products stay within f32's range whatever the
//! mesh's unit.

use crate::numerics::COORDINATE_UNDERFLOW;
use crate::traverse::placement::Placement;
use bvh_format::object::Object;

/// The frame that all pairs of packets of a query share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalFrame {
    pub(crate) rotation: [[f64; 3]; 3],
    pub(crate) translation: [f64; 3],
    /// Rotation in units of the frame.
    pub(crate) rotation32: [[f32; 3]; 3],
    /// Units of the frame in a mesh unit, a power of two.
    pub(crate) scale: f32,
    /// Bound on the f64 error, units of the frame.
    pub(super) error: f32,
}

impl LocalFrame {
    pub(crate) fn new(placement: &Placement, a: &Object, b: &Object) -> Self {
        let size = |object: &Object| object.volumes().half_sides.into_iter().fold(0.0, f64::max) * 2.0;
        let scale = scale_of(size(a).max(size(b)));
        let rotation32 = placement.rotation.map(|row| row.map(|r| (r * scale) as f32));
        Self {
            rotation: placement.rotation,
            translation: placement.translation,
            rotation32,
            scale: scale as f32,
            error: ((placement.error * scale) as f32).next_up() + COORDINATE_UNDERFLOW,
        }
    }
}

/// Returns a power of two near 1 / size, by its exponent, from 2^-120 to 2^120; what has no size takes any unit.
#[inline(always)]
pub(crate) fn scale_of(size: f64) -> f64 {
    let exponent = (size.to_bits() >> 52) as i64 - 1023;
    f64::from_bits(((1023 - exponent.clamp(-120, 120)) as u64) << 52)
}
