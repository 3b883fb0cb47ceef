//! Files that nobody vouches for: damaged, forged, with loose bounds, and truncated while they are open.

#[path = "../common/mod.rs"]
mod common;

mod hostile;
mod loosened;
mod mutation;
/// WebAssembly maps no files.
#[cfg(not(target_family = "wasm"))]
mod truncation;
