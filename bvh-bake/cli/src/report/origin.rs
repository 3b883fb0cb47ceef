//! What a report starts with: the program, and where and when it measured.

use super::machine::{self, Cache};
use serde::Serialize;

/// The program, the day and the machine.
#[derive(Debug, Serialize)]
pub(super) struct Origin {
    tool: &'static str,
    pub(super) version: &'static str,
    /// Major and minor version of the format.
    pub(super) format_version: String,
    /// True if the program was built without optimisation.
    pub(super) unoptimised: bool,
    pub(super) date: String,
    pub(super) machine: Machine,
}

impl Origin {
    /// This program, here and today.
    pub(super) fn here() -> Self {
        Self {
            tool: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            format_version: format!("{}.{}", bvh_format::header::MAJOR, bvh_format::header::MINOR),
            unoptimised: cfg!(debug_assertions),
            date: machine::today(),
            machine: Machine::here(),
        }
    }
}

/// Where it was measured.
#[derive(Debug, Serialize)]
pub(super) struct Machine {
    pub(super) processor: String,
    pub(super) processors: usize,
    pub(super) is_virtual: bool,
    pub(super) system: String,
    pub(super) caches: Vec<Cache>,
}

impl Machine {
    /// This one, as far as the system tells.
    pub(super) fn here() -> Self {
        Self {
            processor: machine::processor(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            is_virtual: machine::is_virtual(),
            system: machine::system(),
            caches: machine::caches(),
        }
    }
}
