//! `cbvh validate` and `cbvh verify`: checks a file by itself, and against the mesh it was baked from.

mod breach;
mod validate;
mod verify;

pub(crate) use validate::{ValidateArguments, validate};
pub(crate) use verify::{VerifyArguments, verify};
