//! Stores the data of a bake or a check: in memory, in scratch files, and in the output.

pub(crate) mod atomic;
pub(crate) mod device_names;
pub(crate) mod disk_space;
pub(crate) mod external_sort;
pub(crate) mod output;
pub(crate) mod resources;
mod scratch;
mod scratch_file;
pub(crate) mod stored_file;
mod stream;

pub(crate) use scratch::{Piece, Scratch, Spill};
pub(crate) use scratch_file::{read_exact_at, write_all_at};
pub(crate) use stream::Stream;
