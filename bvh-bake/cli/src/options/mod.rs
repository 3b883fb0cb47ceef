//! Options that several commands have, and the values they take.

mod layout;
mod values;

pub(crate) use layout::{LayoutArguments, profile, triangles};
pub(crate) use values::{not_negative, positive, size, threads, whole};
