//! The command answers questions: its lines and fields, and that answers do not depend on how they are found.

#[path = "../common/mod.rs"]
mod common;

mod clash;
mod documents;
mod labelled;
mod motion;
mod probe;
mod query;
mod report;
mod report_motions;
mod robot;
mod rounding;
mod scene;
mod suite;
mod view;
