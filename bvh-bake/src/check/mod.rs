//! Checks of finished files: the proof that is part of every bake, and the comparison of a file with its mesh.

pub(crate) mod prove;
pub(crate) mod verify;
