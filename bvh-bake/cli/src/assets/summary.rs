//! Counts and sums over all assets of a run. They add up over shards.

use super::shown;
use crate::bake::{Report, Shard};
use crate::console::{Failure, plural};
use crate::process::resident;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The object that `--json` prints for many assets. All but `shard`, `elapsed_seconds` and `peak_rss_bytes` are sums.
#[derive(Serialize)]
pub(super) struct Summary {
    shard: Option<String>,
    assets: u64,
    done: u64,
    skipped: u64,
    failed: u64,
    /// The number of failures by exit code.
    exit_codes: BTreeMap<u8, u64>,
    triangles_in: u64,
    triangles: u64,
    degenerate: u64,
    duplicates: u64,
    file_bytes: u64,
    /// The sum of the seconds of all assets.
    seconds: f64,
    elapsed_seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// Exit codes of failures, the one that takes precedence first.
const CODES_BY_PRECEDENCE: [u8; 4] = [3, 4, 2, 1];

impl Summary {
    pub(super) fn new(shard: Option<Shard>, assets: usize) -> Self {
        Self {
            shard: shard.map(|shard| format!("{}/{}", shard.index, shard.count)),
            assets: assets as u64,
            done: 0,
            skipped: 0,
            failed: 0,
            exit_codes: BTreeMap::new(),
            triangles_in: 0,
            triangles: 0,
            degenerate: 0,
            duplicates: 0,
            file_bytes: 0,
            seconds: 0.0,
            elapsed_seconds: 0.0,
            peak_rss_bytes: None,
        }
    }

    pub(super) fn add(&mut self, report: &Report) {
        *if report.skipped { &mut self.skipped } else { &mut self.done } += 1;
        self.triangles_in += report.triangles_in;
        self.triangles += report.triangles;
        self.degenerate += report.degenerate;
        self.duplicates += report.duplicates;
        self.file_bytes += report.file_bytes;
        self.seconds += report.seconds;
    }

    pub(super) fn add_failed(&mut self, code: u8) {
        self.failed += 1;
        *self.exit_codes.entry(code).or_default() += 1;
    }

    /// Completes the summary after the last asset.
    pub(super) fn close(&mut self, elapsed_seconds: f64) {
        self.elapsed_seconds = elapsed_seconds;
        self.peak_rss_bytes = resident::peak_bytes();
    }

    /// Returns the counts so far for the progress line.
    pub(super) fn progress(&self) -> String {
        let ended = self.done + self.skipped + self.failed;
        format!("{ended} of {} {}, {} failed", self.assets, plural(self.assets, "asset"), self.failed)
    }

    /// Returns the summary for people.
    pub(super) fn to_text(&self) -> String {
        let memory = match self.peak_rss_bytes {
            Some(bytes) => format!(", {:.0} MiB of memory", bytes as f64 / 1048576.0),
            None => String::new(),
        };
        format!(
            "{} {}: {} baked, {} up to date, {} failed\n  triangles    {}\n  bytes        {}\n  \
             took         {:.2} s{memory}\n",
            self.assets,
            plural(self.assets, "asset"),
            self.done,
            self.skipped,
            self.failed,
            self.triangles,
            self.file_bytes,
            self.elapsed_seconds
        )
    }

    /// Returns the failure to end with, if any asset has failed. `results` is the file that has the details.
    pub(super) fn failure(&self, results: Option<&Path>) -> Option<Failure> {
        let code = CODES_BY_PRECEDENCE.into_iter().find(|code| self.exit_codes.contains_key(code))?;
        let told = results.map(|path| format!(", see {}", shown(path))).unwrap_or_default();
        let text =
            format!("{} of {} {} failed{told}", self.failed, self.assets, plural(self.assets, "asset"));
        Some(match code {
            1 => Failure::Usage(text),
            3 => Failure::Invalid(text),
            4 => Failure::Limit(text),
            _ => Failure::System(text),
        })
    }
}
