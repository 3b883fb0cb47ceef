//! The C interface of cbvh: what `include/cbvh.h` declares, function by function.
//!
//! The header documents every function for its users, and says what callers must ensure; it is written by hand, and
//! `tests/header.py` compares it with what is here. Functions that differ in little are lines of `questions!`. Below the
//! functions there are four ideas:
//!
//! - `entry`: nothing unwinds out of a function; it returns a status, and a message stays with the thread.
//! - `table`: a handle is a number, looked up in a table, so that a freed or foreign one is recognised and never
//!   followed.
//! - `input`: pointers are checked for null, alignment and length before anything is read, and what they point to is
//!   copied before anything is written.
//! - `output`: answers are written through raw pointers, because C's memory may hold no values yet and may overlap.

mod at_hand;
mod bake;
mod cores;
mod entry;
mod input;
mod mesh;
mod motions;
mod output;
mod overlaps;
mod pairs;
mod paths;
mod poses;
mod probes;
mod queriers;
mod robots;
mod scene;
mod shapes;
mod shared;
mod status;
mod stops;
mod table;
mod trackers;
mod types;
