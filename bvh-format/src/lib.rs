//! The `.cbvh` file format: bounding volume hierarchies of triangle meshes, in treelets of 32 to 256 bytes.
//!
//! This crate defines the bytes of a file: the place of each, how it is written and read, and the rules that it obeys.
//! It builds no trees and answers no queries about them. Most applications need only its siblings: `bvh-bake` makes
//! `.cbvh` files from meshes, and `bvh-query` maps them and answers collision and distance queries. Both build on this
//! crate. Use it directly to inspect files, to check them, or to write another baker, viewer or query.
//!
//! The normative text is `spec/format.md`. A test compares its tables with the types here.
//!
//! # How a file is read
//!
//! ```text
//! bytes ─ header, sections ─ objects ─ Layout ┬ Page ─ anchors, Links ─ decode ─ slabs
//!                                             ├ leaf block ─ Packet
//!                                             └ id block
//! ```
//!
//! 1. [`Layout::read`] checks the head of the file and the object table, and reads nothing else, however long the file is.
//! 2. A [page] of 4 KiB is found by its number. [`page::check_page`] checks it when it is first needed, and then
//!    [`page::Page`] reads it without any further check.
//! 3. A [treelet] in a page holds the bounds of up to eight children, and [`treelet::Links`] says where each
//!    child is: in the same page, in a later page, or a packet of triangles.
//! 4. [`page::decode::decode_child`] turns the bounds of a child into [slabs], given the slabs of its parent.
//! 5. The [leaf] block of a page holds its triangles, and the [ids] block their numbers in the input.
//! 6. A file may also state where its objects stand ([instances]), and which of them are closed ([topology]).
//!
//! [`validate::validate`] checks a whole file against all [rules](Rule) but R35, and [`bounds::check_bounds`] proves that
//! bounds contain their triangles (R35). A breach is a [`FormatError`]: it names the rule, the byte, what was expected,
//! what was found, and the remedy. No function panics on the bytes of a file, whatever they are.
//!
//! [`page::PageWriter`] writes pages and stands beside the reader; [`leaf::encode_block`], [`ids::encode_ids`],
//! [`object::write_objects`] and [`header::write_header`] write the rest.
//!
//! # Example
//!
//! This lists the objects of a file. The program `examples/inspect.rs` also walks the trees.
//!
//! ```
//! use bvh_format::Layout;
//!
//! fn list(bytes: &[u8]) -> Result<(), bvh_format::FormatError> {
//!     let layout = Layout::read(bytes)?;
//!     for object in &layout.objects {
//!         let (centre, radius) = object.bounding_sphere();
//!         println!("{}: {} triangles within {radius} of {centre:?}", object.name(), object.triangles());
//!     }
//!     Ok(())
//! }
//!
//! assert_eq!(list(b"not a mesh").unwrap_err().rule, bvh_format::Rule::Magic);
//! ```
#![forbid(unsafe_code)]

#[cfg(target_endian = "big")]
compile_error!(
    "cbvh supports little-endian targets only: queries use triangles of a file where they are, in its byte order"
);

mod bits;
pub mod bounds;
pub mod checksum;
mod error;
pub mod header;
pub mod ids;
pub mod instances;
pub mod kdop;
pub mod layout;
pub mod leaf;
pub mod object;
pub mod open_edges;
pub mod ordered;
pub mod page;
pub mod profile;
pub mod quantize;
pub mod rewrite_rounding;
mod rule;
pub mod slabs;
pub mod source;
mod stop;
pub mod topology;
pub mod treelet;
pub mod turning;
pub mod validate;
pub mod vec3;
pub mod vertex;

pub use error::FormatError;
pub use layout::Layout;
pub use rule::Rule;
pub use stop::Stop;

/// Compiles the example of the crate's README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
