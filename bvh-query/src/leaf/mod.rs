//! Tests 16 triangle pairs at a time in f32: filters with derived error bounds.
//!
//! The filters discard only pairs that cannot matter: pairs that are certainly apart, or certainly farther
//! apart than others. The rest goes to `narrow`.

pub(crate) mod frame;
pub(crate) mod line_shear;
pub(crate) mod line_sides;
pub(crate) mod local;
pub(crate) mod math;
pub(crate) mod pair_bounds;
pub(crate) mod placed_packet;
pub(crate) mod point_bounds;
pub(crate) mod queue;
pub(crate) mod self_packet;
pub(crate) mod separating_axes;
