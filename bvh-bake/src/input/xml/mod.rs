//! Reads XML files that people have: COLLADA here, and the descriptions of robots in the crate `cbvh-robot`.
//!
//! Module `text` turns bytes into text, and module `tree` reads the elements that a schema knows. The other readers of XML
//! that were considered resolve namespaces and keep every element; a file with an undeclared prefix is an error to them, and their
//! time grows with the square of the number of attributes.

mod text;
mod tree;

pub(crate) use text::bytes_of_text;
pub use text::text_of;
pub(crate) use tree::Element;
pub use tree::{Children, Number, Schema, Tree, XmlError};
