//! Compares the narrow phase with exact arithmetic.

mod distance;
mod generate;
mod intersect;
mod many;
mod ray;
mod region;
mod stretch;
mod within;
