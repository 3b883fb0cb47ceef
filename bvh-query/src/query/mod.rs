//! The questions: collide, contacts, distance, within. Each is a visitor of the one pair walk.

pub(crate) mod answers;
#[cfg(feature = "parallel")]
pub(crate) mod batch;
mod bounding_volumes;
mod collide;
mod contacts;
mod distance;
mod exact;
mod motion;
pub(crate) mod options;
mod placed_pair;
pub(crate) mod querier;
mod search;
pub(crate) mod tracker;
