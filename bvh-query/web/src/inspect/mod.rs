//! What the page of `cbvh view` shows of the inside of a file. The feature `inspect` adds it.

mod contents;
mod levels;
mod tree;
mod triangles;
mod visits;
