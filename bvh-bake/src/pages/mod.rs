//! Turns a tree of treelets into the pages of a file.

pub(crate) mod assemble;
pub(crate) mod brick;
mod encode;
mod plan;
mod style;
pub(crate) mod unnumbered;

pub(crate) use style::Style;
