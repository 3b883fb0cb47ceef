//! The library against an exact oracle: all answers, where they are hardest, in numbers.
//!
//! What is promised about poses is that queries are about the placed corners, each an f64 that `Pose` defines;
//! `placement` checks that definition, and everything else is exact on those corners. The usual amount takes
//! seconds; `CBVH_TEST_PAIRS=100` searches a hundred times as much. Counts are shown with `--nocapture`.

#[path = "../common/mod.rs"]
mod common;

mod agreement;
mod ask;
mod ball;
mod boundary;
mod decide;
mod dyadic;
mod effort;
mod features;
mod hard_cases;
mod kinds;
mod lattice;
mod length;
mod meet;
mod near_tie;
mod number;
mod placement;
mod separation;
mod subnormal;
mod tally;
mod tiny_origin;
mod touching;
mod truth;
mod walk;
