//! The command short of memory and disk, stopped at any moment, and watched: what it takes of the system. These tests are a
//! program of their own, because they load the machine and limit, stop and measure processes.

#[path = "../common/mod.rs"]
mod common;

#[cfg(target_os = "linux")]
mod budget;
#[cfg(any(target_os = "linux", windows))]
mod interrupted;
#[cfg(target_os = "linux")]
mod out_of_core;
mod progress;
