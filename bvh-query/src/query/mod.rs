//! The questions: collide, contacts, distance, within, motion. Each is a visitor of the same pair walk.

pub(crate) mod answers;
#[cfg(feature = "parallel")]
pub(crate) mod batch;
mod bounding_volumes;
mod collide;
mod contacts;
pub(crate) mod depth;
pub(crate) mod displacement;
mod distance;
mod exact;
pub(crate) mod motion;
pub(crate) mod options;
pub(crate) mod patches;
mod placed_pair;
pub(crate) mod probe;
pub(crate) mod querier;
pub(crate) mod regions;
pub(crate) mod rounded;
mod search;
mod self_contacts;
pub(crate) mod tracker;
