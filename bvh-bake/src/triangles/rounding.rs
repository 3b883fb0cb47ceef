//! Rounds the coordinates of the input to `f32` numbers on request, before anything else is done with them.

use super::placement::Moved;
use crate::options::Rounding;

impl Rounding {
    /// Returns the vertex that is baked for a vertex of the input, and records in `moved` how far it moved. -0.0 becomes
    /// 0.0.
    #[inline]
    pub(crate) fn round(self, position: [f64; 3], moved: &mut Moved) -> [f64; 3] {
        match self {
            // The sum turns -0.0 into 0.0.
            Self::None => position.map(|value| value + 0.0),
            Self::F32 => {
                let vertex = position.map(|value| f64::from(value as f32) + 0.0);
                // Exact (Sterbenz): `vertex` is 0, or neither is more than twice the other.
                moved.record_rounding([0, 1, 2].map(|axis| position[axis] - vertex[axis]));
                vertex
            }
        }
    }
}
