//! Walks two trees together: decoding, re-alignment, node tests, order of visits.

pub(crate) mod align;
pub(crate) mod decode;
pub(crate) mod node_test;
pub(crate) mod opened;
pub(crate) mod pair;
pub(crate) mod pairs;
