//! Walks two trees together, or one tree for a probe: decoding, re-alignment, node tests, and the order of visits.

pub(crate) mod align;
pub(crate) mod budget;
pub(crate) mod cached_node;
pub(crate) mod decode;
pub(crate) mod forms;
pub(crate) mod large_leaf;
pub(crate) mod leaf_pairs;
pub(crate) mod line_filter;
pub(crate) mod node_cache;
pub(crate) mod node_filter;
mod open_child;
pub(crate) mod packet_tree;
pub(crate) mod pending;
mod per_node;
pub(crate) mod placement;
pub(crate) mod point_filter;
pub(crate) mod probe_walk;
pub(crate) mod ray_build;
pub(crate) mod ray_walk;
pub(crate) mod slab_filter;
pub(crate) mod slab_memory;
#[cfg(feature = "__trace")]
pub(crate) mod trace;
pub(crate) mod walk;
pub(crate) mod walk_memory;
