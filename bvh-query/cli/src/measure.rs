//! The common part of `cbvh report` and the laboratory of this project: the origin of a report, which is the program, the
//! date, and what the system reports about the machine.
//!
//! This library is not meant for applications, and nothing in it is stable.

use bvh_format::header::{MAJOR, MINOR, version_name};
use serde::Serialize;
use std::fs::read_to_string;
use std::time::{SystemTime, UNIX_EPOCH};

/// The program, the date and the machine.
#[derive(Debug, Serialize)]
pub struct Origin {
    /// The name of the program.
    pub tool: &'static str,
    /// The version of cbvh.
    pub version: &'static str,
    /// Major and minor version of the format.
    pub format_version: String,
    /// True if the program was built without optimisation.
    pub unoptimised: bool,
    /// Year, month and day, in UTC.
    pub date: String,
    /// The machine.
    pub machine: Machine,
}

impl Origin {
    /// Describes a program that runs here and now.
    pub fn of(tool: &'static str) -> Self {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
        Self {
            tool,
            version: env!("CARGO_PKG_VERSION"),
            format_version: version_name((MAJOR, MINOR)),
            unoptimised: cfg!(debug_assertions),
            date: date(seconds / 86400),
            machine: Machine::here(),
        }
    }
}

/// A machine, as far as its system describes it.
#[derive(Debug, Serialize)]
pub struct Machine {
    /// The name of the processor, or of its architecture.
    pub processor: String,
    /// How many processors the program may use.
    pub processors: usize,
    /// True in a virtual machine that says so.
    pub is_virtual: bool,
    /// Name and release of the operating system.
    pub system: String,
}

impl Machine {
    /// Describes this machine.
    pub fn here() -> Self {
        let cpu = read_to_string("/proc/cpuinfo").unwrap_or_default();
        let field = |name: &str| {
            let mut fields = cpu.lines().filter_map(|line| line.split_once(':'));
            fields.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim())
        };
        let name = field("model name").unwrap_or(std::env::consts::ARCH);
        let processor = match (field("cpu family"), field("model")) {
            (Some(family), Some(model)) => format!("{name}, family {family}, model {model}"),
            _ => name.to_owned(),
        };
        let release = read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        Self {
            processor,
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            is_virtual: field("flags").is_some_and(|flags| flags.split(' ').any(|flag| flag == "hypervisor")),
            system: format!("{} {}", std::env::consts::OS, release.trim()).trim().to_owned(),
        }
    }

    /// Describes the machine in one phrase.
    pub fn text(&self) -> String {
        let Self { processor, processors, system, is_virtual } = self;
        let plural = if *processors == 1 { "" } else { "s" };
        let kind = if *is_virtual { " of a virtual machine" } else { "" };
        format!("{processor} ({processors} processor{plural}{kind}), {system}")
    }
}

/// Returns the date `days` days after 1970-01-01. The Gregorian calendar repeats every 400 years, or 146097 days, and a year
/// that begins in March ends with its leap day.
pub fn date(days: u64) -> String {
    // Days since 0000-03-01.
    let days = days + 719468;
    let (era, day) = (days / 146097, days % 146097);
    let year = (day - day / 1460 + day / 36524 - day / 146096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // Months from March on have 153 days in five.
    let month = (5 * day + 2) / 153;
    let (day, is_next_year) = (day - (153 * month + 2) / 5 + 1, month >= 10);
    let month = if is_next_year { month - 9 } else { month + 3 };
    format!("{}-{month:02}-{day:02}", 400 * era + year + u64::from(is_next_year))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_become_dates() {
        for (days, expected) in [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (11016, "2000-02-29"),
            (11017, "2000-03-01"),
            (20453, "2025-12-31"),
            (20454, "2026-01-01"),
            (47541, "2100-03-01"),
            (146097, "2370-01-01"),
        ] {
            assert_eq!(date(days), expected);
        }
    }
}
