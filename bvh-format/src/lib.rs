//! The `.cbvh` file format: bounding volume hierarchies of triangle meshes in 64-byte treelets.
//!
//! This crate knows bytes: what stands where, how it is written and read, and which rules it obeys.
//! It neither builds trees (`bvh-bake`) nor asks them anything (`bvh-query`). The normative text is
//! `spec/format.md`; a test compares its tables with the types here.
//!
//! The way through a file:
//!
//! ```text
//! bytes ─ header, sections ─ objects ─ Layout ┬ Page ─ anchors, Links ─ decode ─ slabs
//!                                             ├ leaf block ─ Packet
//!                                             └ id block
//! ```
#![forbid(unsafe_code)]

pub mod bits;
pub mod bounds;
pub mod checksum;
pub mod decode;
mod error;
pub mod header;
pub mod ids;
pub mod kdop;
pub mod layout;
pub mod leaf;
pub mod object;
pub mod page;
pub mod profile;
pub mod quantize;
mod rule;
pub mod slabs;
pub mod source;
pub mod support;
pub mod treelet;
pub mod validate;

pub use error::FormatError;
pub use layout::Layout;
pub use rule::Rule;
