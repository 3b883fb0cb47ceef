//! The record of a search: what it covered, where and when, and what it found. It is written at least once a minute. A
//! search that is started again continues from its record.

use super::shrink::Case;
use crate::Failure;
use cbvh_measure::origin::Origin;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

#[derive(Default, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) kinds: BTreeMap<String, Covered>,
    pub(super) findings: Vec<Finding>,
    pub(super) sessions: Vec<Session>,
}

/// What was covered of one kind of question.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Covered {
    /// The rounds that are done: ranges in ascending order, from the first number up to but not including the second.
    pub(super) rounds: Vec<[u64; 2]>,
    /// Seconds of all threads together.
    pub(super) seconds: f64,
    pub(super) counts: Counts,
}

/// Sums by name.
#[derive(Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Counts(pub(super) BTreeMap<String, u64>);

/// One run of the program.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    pub(super) date: String,
    /// The commit that the program was built from, if the build named it in `CBVH_COMMIT`.
    pub(super) commit: String,
    pub(super) processor: String,
    pub(super) system: String,
    pub(super) backends: Vec<String>,
    pub(super) threads: usize,
    pub(super) seconds: f64,
}

/// A wrong answer, with all that is needed to ask again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Finding {
    pub(super) kind: String,
    /// The round, which is asked again by `--kinds KIND --again ROUND`.
    pub(super) round: u64,
    pub(super) wrong: String,
    /// The shrunk question about pairs.
    pub(super) case: Option<Case>,
    /// The forged file that takes the place of one of the two.
    pub(super) file: Option<Forged>,
}

/// A forged file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Forged {
    /// Whether it is A.
    pub(super) is_a: bool,
    /// Its bytes, as hexadecimal digits.
    pub(super) hex: String,
}

impl Record {
    /// Reads a record, or begins one if there is no such file.
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        match fs::read(path) {
            Ok(bytes) => Ok(serde_json::from_slice(&bytes)
                .map_err(|error| format!("{}: expected the record of a search: {error}", path.display()))?),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(format!("{}: cannot read: {error}", path.display()).into()),
        }
    }

    /// Writes the record beside its place and moves it there, so that a kill at any time leaves a whole one.
    pub(super) fn save(&self, path: &Path) -> Result<(), Failure> {
        let beside = path.with_extension("new");
        let failed = |error| format!("{}: cannot write: {error}", path.display());
        fs::write(&beside, crate::output::json(self)?).map_err(failed)?;
        Ok(fs::rename(&beside, path).map_err(failed)?)
    }
}

impl Covered {
    /// Returns the first round that is neither done nor running.
    pub(super) fn next(&self, running: &[u64]) -> u64 {
        let is_free = |round: &u64| !running.contains(round) && !self.is_done(*round);
        let after = self.rounds.iter().map(|range| range[1]);
        let candidates = std::iter::once(0).chain(after).chain(running.iter().map(|round| round + 1));
        candidates.filter(is_free).min().unwrap_or(0)
    }

    fn is_done(&self, round: u64) -> bool {
        self.rounds.iter().any(|range| (range[0]..range[1]).contains(&round))
    }

    /// Notes that a round is done.
    pub(super) fn add(&mut self, round: u64, seconds: f64, counts: &Counts) {
        self.seconds += seconds;
        counts.0.iter().for_each(|(name, count)| self.counts.add(name, *count));
        self.rounds.push([round, round + 1]);
        self.rounds.sort_unstable();
        self.rounds.dedup_by(|next, range| {
            let joins = next[0] <= range[1];
            range[1] = if joins { range[1].max(next[1]) } else { range[1] };
            joins
        });
    }
}

impl Counts {
    pub(super) fn add(&mut self, name: &str, count: u64) {
        match self.0.get_mut(name) {
            Some(sum) => *sum += count,
            None => _ = self.0.insert(name.to_owned(), count),
        }
    }
}

impl Session {
    pub(super) fn new(threads: usize) -> Self {
        let origin = Origin::of("cbvh-lab search");
        let backends = super::pairs::queriers();
        Self {
            date: origin.date,
            commit: option_env!("CBVH_COMMIT").unwrap_or("not named").to_owned(),
            processor: origin.machine.processor,
            system: origin.machine.system,
            backends: backends.iter().map(|querier| querier.backend().name().to_owned()).collect(),
            threads,
            seconds: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_that_are_done_or_running_are_not_begun() {
        let mut covered = Covered::default();
        assert_eq!([covered.next(&[]), covered.next(&[0]), covered.next(&[1, 0])], [0, 1, 2]);
        for round in [0, 3, 1, 5, 4] {
            covered.add(round, 0.5, &Counts::default());
        }
        assert_eq!(covered.rounds, [[0, 2], [3, 6]]);
        assert_eq!([covered.next(&[]), covered.next(&[2]), covered.next(&[2, 6])], [2, 6, 7]);
        covered.add(2, 0.5, &Counts::default());
        assert_eq!((covered.rounds, covered.seconds), (vec![[0, 6]], 3.0));
    }

    #[test]
    fn a_record_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.json");
        let mut record = Record::open(&path).unwrap();
        let mut counts = Counts::default();
        counts.add("pairs", 5);
        record.kinds.entry("pairs".into()).or_default().add(7, 1.5, &counts);
        record.sessions.push(Session::new(2));
        record.save(&path).unwrap();
        let again = Record::open(&path).unwrap();
        assert_eq!(serde_json::to_string(&again).unwrap(), serde_json::to_string(&record).unwrap());
        fs::write(&path, "{").unwrap();
        let error = Record::open(&path).err().unwrap().to_string();
        assert!(error.contains("record.json: expected the record of a search"), "{error}");
    }
}
