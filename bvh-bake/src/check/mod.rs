//! Checks of finished files: the proof that is part of every bake, the count of open edges, and the comparison of a file with its mesh.

pub(crate) mod open_edges;
pub(crate) mod prove;
pub(crate) mod provenance;
pub(crate) mod verify;
