//! This process and the system: memory and signals.

pub(crate) mod resident;
pub(crate) mod signals;
