//! The search for wrong answers: it runs on its own for hours, in rounds that a seed repeats, and records what it covered.
//!
//! A round has a kind and a number, from which everything in it follows. Threads take rounds by turns, such that the time
//! of each kind is its share. The record is saved every few seconds. A panic is a finding, and so is a round that
//! takes minutes.

mod files;
mod hostile;
mod motions;
mod pairs;
mod probes;
mod record;
mod shrink;
mod stars;

use crate::arguments::SearchArguments;
use crate::{Failure, output};
use clap::ValueEnum;
use record::{Counts, Finding, Record, Session};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What a round is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(crate) enum Kind {
    /// Pairs of triangles near the boundary of contact
    Pairs,
    /// Files that a stranger may have made, valid ones with loose bounds among them
    Hostile,
    /// Points and segments that touch a mesh or almost do
    Probes,
    /// Motions into contact, past it and along it
    Motions,
}

/// How often the record is saved.
const SAVE_SECONDS: u64 = 20;
/// A round that takes longer than this is a finding; it takes a second or so otherwise.
const MAX_ROUND_SECONDS: u64 = 300;
/// The search ends after this number of findings.
const MAX_FINDINGS: usize = 50;

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Pairs => "pairs",
            Self::Hostile => "hostile",
            Self::Probes => "probes",
            Self::Motions => "motions",
        }
    }

    /// The share of the time, relative to other kinds.
    fn share(self) -> f64 {
        match self {
            Self::Pairs => 12.0,
            Self::Hostile => 4.0,
            Self::Probes | Self::Motions => 1.0,
        }
    }

    fn round(self, seed: u64, counts: &mut Counts) -> Result<Vec<Finding>, Failure> {
        match self {
            Self::Pairs => pairs::round(seed, |querier, a, b, pose| querier.contacts(a, b, pose), counts),
            Self::Hostile => hostile::round(seed, counts),
            Self::Probes => probes::round(seed, counts),
            Self::Motions => motions::round(seed, counts),
        }
    }

    /// Runs a round. A panic and a failure are findings, too.
    fn run(self, seed: u64, counts: &mut Counts) -> Vec<Finding> {
        let finding = |wrong: String| {
            vec![Finding { kind: self.name().into(), round: seed, wrong, case: None, file: None }]
        };
        match catch_unwind(AssertUnwindSafe(|| self.round(seed, counts))) {
            Ok(Ok(findings)) => findings,
            Ok(Err(failure)) => finding(failure.to_string()),
            Err(panic) => {
                let message = panic.downcast_ref::<String>().cloned();
                let message = message.or_else(|| panic.downcast_ref().map(|text: &&str| (*text).to_owned()));
                finding(format!("panicked: {}", message.unwrap_or_default()))
            }
        }
    }
}

/// What the threads share.
struct State {
    record: Record,
    running: BTreeMap<(Kind, u64), Instant>,
    /// The rounds that may still begin.
    left: u64,
}

pub(crate) fn run(arguments: &SearchArguments) -> Result<String, Failure> {
    if let Some(round) = arguments.again {
        return again(&arguments.kinds, round);
    }
    let path = &arguments.record;
    let (start, hours) = (Instant::now(), arguments.hours);
    let end = start
        + Duration::try_from_secs_f64(hours * 3600.0)
            .map_err(|_| "--hours: expected a time, found a negative or an endless one")?;
    let mut record = Record::open(path)?;
    let known = record.findings.len();
    record.sessions.push(Session::new(arguments.threads.into()));
    record.save(path)?;
    let state =
        Mutex::new(State { record, running: BTreeMap::new(), left: arguments.rounds.unwrap_or(u64::MAX) });
    let save = |state: &mut State| {
        if let Some(session) = state.record.sessions.last_mut() {
            session.seconds = start.elapsed().as_secs_f64();
        }
        state.record.save(path)
    };
    std::thread::scope(|scope| {
        let work = || while step(&state, &arguments.kinds, end, known) {};
        let workers: Vec<_> = (0..arguments.threads).map(|_| scope.spawn(work)).collect();
        let mut saved = Instant::now();
        while !workers.iter().all(|worker| worker.is_finished()) {
            std::thread::sleep(Duration::from_millis(50));
            if saved.elapsed() >= Duration::from_secs(SAVE_SECONDS) {
                let mut state = lock(&state);
                note_hangs(&mut state);
                save(&mut state)?;
                saved = Instant::now();
            }
        }
        Ok::<(), Failure>(())
    })?;
    let mut state = lock(&state);
    save(&mut state)?;
    let text = summary(&state.record);
    let found = state.record.findings.len() - known;
    if found == 0 { Ok(text) } else { Err(format!("{text}{}: {found} findings", path.display()).into()) }
}

/// Takes a round and runs it. Returns false at the end of the search.
fn step(state: &Mutex<State>, kinds: &[Kind], end: Instant, known: usize) -> bool {
    let (kind, round) = {
        let mut state = lock(state);
        let is_full = state.record.findings.len() >= known + MAX_FINDINGS;
        if Instant::now() >= end || state.left == 0 || is_full {
            return false;
        }
        state.left -= 1;
        let Some(next) = state.next(kinds) else { return false };
        state.running.insert(next, Instant::now());
        next
    };
    let (start, mut counts) = (Instant::now(), Counts::default());
    let findings = kind.run(round, &mut counts);
    let mut state = lock(state);
    state.running.remove(&(kind, round));
    findings.iter().for_each(|finding| output::tell(&format!("{} {round}: {}", kind.name(), finding.wrong)));
    state.record.findings.extend(findings);
    let covered = state.record.kinds.entry(kind.name().into()).or_default();
    covered.add(round, start.elapsed().as_secs_f64(), &counts);
    true
}

impl State {
    /// Returns a round of the kind that lags most behind its share of the time.
    fn next(&self, kinds: &[Kind]) -> Option<(Kind, u64)> {
        let lag = |kind: &Kind| {
            let running = self.running.keys().filter(|(other, _)| other == kind).count();
            let seconds = self.record.kinds.get(kind.name()).map_or(0.0, |covered| covered.seconds);
            (seconds + running as f64) / kind.share()
        };
        let kind = *kinds.iter().min_by(|one, two| lag(one).total_cmp(&lag(two)))?;
        let running: Vec<u64> = self.running.keys().filter(|key| key.0 == kind).map(|key| key.1).collect();
        let round = self.record.kinds.get(kind.name()).unwrap_or(&Default::default()).next(&running);
        Some((kind, round))
    }
}

/// Notes rounds that take too long, once each; they go on running.
fn note_hangs(state: &mut State) {
    let is_slow = |start: &Instant| start.elapsed() > Duration::from_secs(MAX_ROUND_SECONDS);
    let slow: Vec<_> =
        state.running.iter().filter(|(_, start)| is_slow(start)).map(|(key, _)| *key).collect();
    for (kind, round) in slow {
        let is_same = |finding: &Finding| finding.kind == kind.name() && finding.round == round;
        if !state.record.findings.iter().any(is_same) {
            let wrong = format!("running for more than {MAX_ROUND_SECONDS} seconds");
            let kind = kind.name().into();
            state.record.findings.push(Finding { kind, round, wrong, case: None, file: None });
        }
    }
}

/// Runs one round of each kind again and prints what it finds.
fn again(kinds: &[Kind], round: u64) -> Result<String, Failure> {
    let mut counts = Counts::default();
    let findings: Vec<Finding> = kinds.iter().flat_map(|kind| kind.run(round, &mut counts)).collect();
    if findings.is_empty() {
        return Ok(format!("round {round}: nothing wrong; {:?}\n", counts.0));
    }
    Err(output::json(&findings)?.into())
}

fn summary(record: &Record) -> String {
    let mut text = String::new();
    for (kind, covered) in &record.kinds {
        let rounds: u64 = covered.rounds.iter().map(|range| range[1] - range[0]).sum();
        text += &format!("{kind}: {rounds} rounds in {:.0} s", covered.seconds);
        for (name, count) in &covered.counts.0 {
            text += &format!(", {count} {name}");
        }
        text += "\n";
    }
    text
}

/// A thread that panicked outside of a round has left the state as it was.
fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}
