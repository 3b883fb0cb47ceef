//! The questions: collide, contacts, distance, within, motion. Each is a visitor of the one pair walk.

pub(crate) mod answers;
#[cfg(feature = "parallel")]
pub(crate) mod batch;
mod bounding_volumes;
mod closest_point;
mod collide;
mod contacts;
pub(crate) mod displacement;
mod distance;
mod exact;
pub(crate) mod motion;
pub(crate) mod options;
mod placed_pair;
#[cfg(feature = "parallel")]
pub(crate) mod probe_batch;
pub(crate) mod querier;
mod search;
pub(crate) mod tracker;
