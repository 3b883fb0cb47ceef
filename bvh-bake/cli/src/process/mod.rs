//! This process and the system: memory, the page cache, signals.

pub(crate) mod from_disk;
pub(crate) mod resident;
pub(crate) mod signals;
