//! How `cbvh report` and the laboratory measure queries: questions, poses, rounds, spreads, tables and plots.
//!
//! This library is the part of the command that both programs share. It is not meant for applications, and nothing in
//! it is stable.

pub mod motions;
pub mod origin;
pub mod pairs;
pub mod pin;
pub mod plot;
pub mod poses;
pub mod rounds;
pub mod spread;
pub mod table;
