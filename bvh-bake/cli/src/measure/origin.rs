//! The origin of a report: the program, the date, and what the system reports about the machine.

use bvh_format::header::{MAJOR, MINOR, version_name};
use serde::Serialize;
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
        Self {
            tool,
            version: env!("CARGO_PKG_VERSION"),
            format_version: version_name((MAJOR, MINOR)),
            unoptimised: cfg!(debug_assertions),
            date: today(),
            machine: Machine::here(),
        }
    }
}

/// A machine, as far as its system describes it.
#[derive(Debug, Serialize)]
pub struct Machine {
    /// The name of the processor.
    pub processor: String,
    /// How many processors the program may use.
    pub processors: usize,
    /// True in a virtual machine that says so.
    pub is_virtual: bool,
    /// Name and release of the operating system.
    pub system: String,
    /// The data caches of the first processor, the nearest one first; empty if unknown.
    pub caches: Vec<Cache>,
}

impl Machine {
    /// Describes this machine.
    pub fn here() -> Self {
        Self {
            processor: processor(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            is_virtual: is_virtual(),
            system: system(),
            caches: caches(),
        }
    }

    /// Describes the machine in one phrase.
    pub fn text(&self) -> String {
        let plural = if self.processors == 1 { "" } else { "s" };
        let kind = if self.is_virtual { " of a virtual machine" } else { "" };
        let size = |bytes: u64| {
            if bytes >= 1 << 20 { format!("{} MiB", bytes >> 20) } else { format!("{} KiB", bytes >> 10) }
        };
        let caches: Vec<String> =
            self.caches.iter().map(|cache| format!("L{} {}", cache.level, size(cache.bytes))).collect();
        let caches = if caches.is_empty() { "unknown".to_owned() } else { caches.join(", ") };
        format!(
            "{} ({} processor{plural}{kind}), {}, data caches: {caches}",
            self.processor, self.processors, self.system
        )
    }
}

/// Returns year, month and day, in UTC.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    date(seconds / 86400)
}

/// Returns the date `days` days after 1970-01-01. The Gregorian calendar repeats every 400 years, or 146097 days.
fn date(mut days: u64) -> String {
    let is_leap =
        |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = 1970 + 400 * (days / 146097);
    days %= 146097;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let february = 28 + u64::from(is_leap(year));
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", days + 1)
}

/// Returns the name of the processor, or that of its architecture if the system does not tell.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        let line = text.lines().find(|line| line.split(':').next().is_some_and(|key| key.trim() == name))?;
        Some(line.split(':').nth(1)?.trim().to_owned())
    };
    let name = field("model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    match (field("cpu family"), field("model")) {
        (Some(family), Some(model)) => format!("{name}, family {family}, model {model}"),
        _ => name,
    }
}

/// A cache of the processor.
#[derive(Debug, Clone, Serialize)]
pub struct Cache {
    /// 1 for the nearest.
    pub level: u64,
    /// `Data` or `Unified`.
    pub kind: String,
    /// Its size.
    pub bytes: u64,
}

fn caches() -> Vec<Cache> {
    let read = |index: usize, name: &str| {
        let path = format!("/sys/devices/system/cpu/cpu0/cache/index{index}/{name}");
        Some(std::fs::read_to_string(path).ok()?.trim().to_owned())
    };
    let cache = |index| {
        let kind = read(index, "type")?;
        let bytes = read(index, "size")?.strip_suffix('K')?.parse::<u64>().ok()? * 1024;
        Some(Cache { level: read(index, "level")?.parse().ok()?, kind, bytes })
    };
    (0..8).map_while(cache).filter(|cache| cache.kind != "Instruction").collect()
}

fn system() -> String {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/sys/kernel/{name}")).ok();
    match (read("ostype"), read("osrelease")) {
        (Some(name), Some(release)) => format!("{} {}", name.trim(), release.trim()),
        _ => std::env::consts::OS.to_owned(),
    }
}

fn is_virtual() -> bool {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    text.lines().any(|line| line.starts_with("flags") && line.split_whitespace().any(|f| f == "hypervisor"))
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
            (146097, "2370-01-01"),
        ] {
            assert_eq!(date(days), expected);
        }
    }
}
