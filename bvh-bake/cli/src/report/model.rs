//! Counts work on trees in memory, for bounds that files have and for some that they cannot have.
//!
//! A walk here visits what a query must visit whatever its order: all pairs of nodes whose bounds are within a
//! limit, 0 for contact and the true distance for distance. Queries of meshes that touch stop at the first
//! contact, and queries for a distance do not know it at the start: the first do less than is counted here,
//! the second more.

mod bounds;
mod cut;
mod tree;
mod walk;

pub(super) use bounds::Predictor;
pub(super) use cut::Cut;
pub(super) use tree::Tree;
pub(super) use walk::{Counts, walk};

#[cfg(test)]
mod tests;
