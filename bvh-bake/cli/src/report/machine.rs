//! When and where: the date, and what the system tells of the machine.

use serde::Serialize;
use std::time::{SystemTime, UNIX_EPOCH};

/// Year, month and day, in UTC.
pub(super) fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    date(seconds / 86400)
}

/// Days since 1970-01-01 in the Gregorian calendar, which repeats every 400 years of 146097 days.
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

/// The processor's name, where the system tells it.
pub(super) fn processor() -> String {
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
pub(super) struct Cache {
    pub(super) level: u64,
    pub(super) kind: String,
    pub(super) bytes: u64,
}

/// The caches of the first processor that hold data, the nearest first; none where the system does not tell.
pub(super) fn caches() -> Vec<Cache> {
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

/// The system's name and release.
pub(super) fn system() -> String {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/sys/kernel/{name}")).ok();
    match (read("ostype"), read("osrelease")) {
        (Some(name), Some(release)) => format!("{} {}", name.trim(), release.trim()),
        _ => std::env::consts::OS.to_owned(),
    }
}

/// True in a virtual machine that says so.
pub(super) fn is_virtual() -> bool {
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
