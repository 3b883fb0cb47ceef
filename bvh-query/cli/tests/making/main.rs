//! The command bakes and checks files: of one mesh and of many, from files of every kind.

#[path = "../common/mod.rs"]
mod common;

mod bake;
mod exit_codes;
mod forged;
mod hard;
mod manifest;
#[cfg(unix)]
mod named_files;
mod names_and_texts;
#[cfg(windows)]
mod windows;
