//! The queries, each in a file or a folder of its own. Queries about two meshes and motions are visitors of the pair walk, but
//! `self_contacts` walks trees of packets, and `relation` and `patches` are made of other queries. Queries about points, rays and
//! segments (`probe`) are visitors of the walk of one tree.

#[cfg(feature = "parallel")]
pub(crate) mod batch;
mod bounding_volumes;
mod collide;
pub(crate) mod contacts;
pub(crate) mod depth;
pub(crate) mod displacement;
pub(crate) mod distance;
mod exact;
pub(crate) mod intersection;
pub(crate) mod motion;
pub(crate) mod options;
mod pair_search;
pub(crate) mod patches;
mod placed_pair;
pub(crate) mod pool;
pub(crate) mod probe;
pub(crate) mod querier;
pub(crate) mod regions;
pub(crate) mod rounded;
pub(crate) mod self_contacts;
pub(crate) mod stats;
pub(crate) mod tracker;
