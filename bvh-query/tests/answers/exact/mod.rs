//! Compares the library with an exact oracle: all answers, where they are hardest, in large numbers.
//!
//! Queries are about the placed corners, each of which is an f64 that `Pose` defines. `placement` checks that
//! definition, and everything else is exact on those corners. The everyday amount takes seconds;
//! `CBVH_TEST_DEPTH=100` searches a hundred times as much. `--nocapture` shows the counts.

mod ask;
mod boundary;
mod far_apart;
mod frames;
mod given;
mod hard_cases;
mod kinds;
mod lattice;
mod near_tie;
mod placement;
mod subnormal;
mod tiny_origin;
mod touching;
mod walk;
