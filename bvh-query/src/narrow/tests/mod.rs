//! Compares the narrow phase with exact arithmetic.

mod distance;
mod generate;
mod intersect;
mod many;
mod region;
mod stretch;
mod within;
