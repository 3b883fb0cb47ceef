//! Questions that belong together, in batches, trackers, motions and scenes: they have the answers of single questions, to the
//! bit.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "parallel")]
mod batch;
mod default_tolerance;
mod labelled_motions;
mod memory;
mod motion;
#[cfg(feature = "parallel")]
mod scene;
mod stop;
mod tracker;
