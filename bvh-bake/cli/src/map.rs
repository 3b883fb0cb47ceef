//! Maps `.cbvh` files. Only here, the command promises that nobody changes them.

use bvh_query::{Bvh, OpenError, ReadAhead};
use std::path::Path;

/// Maps a file that a person names. The README says that a mapped file must not change while it is open.
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
pub(crate) fn map(path: &Path, read_ahead: ReadAhead) -> Result<Bvh, OpenError> {
    // SAFETY: the command never writes to a file that it maps, and those who run it are told that nobody else may.
    unsafe { Bvh::map_with(path, read_ahead) }
}
