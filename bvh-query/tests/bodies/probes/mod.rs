//! Points, rays and segments: against labels from exact arithmetic, and against rationals over all triangles where it is hard.
//!
//! The everyday amount takes seconds; `CBVH_TEST_DEPTH=100` searches a hundred times as much. `--nocapture` shows the counts.

mod hard;
mod labels;
mod points;
mod rationals;
mod ray_tree;
mod rays;
mod relations;
mod sides;
mod visible;
