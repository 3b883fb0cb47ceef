//! The search for wrong answers: it runs for hours beside other work, in rounds that their numbers repeat.
//!
//! Even rounds are about meshes near the boundary of contact, odd ones about hostile files, and everything random in a round
//! follows from its number. A record gets a line for each round that is done, so that a later search does the others. A
//! panic is a finding, and so is a round that takes minutes.

mod hostile;
mod near;
mod stars;

use crate::arguments::SearchArguments;
use crate::common::{Random, Triangle, mesh};
use crate::{Failure, output};
use bvh_bake::{Effort, Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, Pose, Querier};
use cbvh_measure::Origin;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// A round that takes longer than this is a finding; it takes a second or so otherwise.
const MAX_ROUND_SECONDS: u64 = 300;
/// The search ends after this number of findings.
const MAX_FINDINGS: usize = 50;
/// The most smaller cases that are asked about, so that a finding takes seconds.
const MAX_TRIES: usize = 3000;

/// What was counted, by name.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
struct Counts(BTreeMap<String, u64>);

impl Counts {
    fn add(&mut self, name: &str, count: u64) {
        *self.0.entry(name.to_owned()).or_default() += count;
    }
}

/// A line of the record: a round that is done.
#[derive(Serialize, Deserialize)]
struct Done {
    round: u64,
    seconds: f64,
    /// The date, the commit, the machine and its backends.
    origin: String,
    counts: Counts,
    /// What the round found, with everything that a test needs.
    wrong: Option<String>,
}

impl Done {
    /// Runs a round. What takes too long goes on as long as the process does.
    fn run(round: u64) -> Self {
        let (sender, receiver) = mpsc::channel();
        let start = Instant::now();
        thread::spawn(move || {
            let mut counts = Counts::default();
            let found = caught(
                || if round.is_multiple_of(2) { near::round } else { hostile::round }(round, &mut counts),
            );
            // Nobody may be waiting any more.
            let _ = sender.send((counts, found.err().map(|wrong| wrong.to_string())));
        });
        let late =
            |_| (Counts::default(), Some(format!("running for more than {MAX_ROUND_SECONDS} seconds")));
        let (counts, wrong) =
            receiver.recv_timeout(Duration::from_secs(MAX_ROUND_SECONDS)).unwrap_or_else(late);
        let Origin { date, machine, .. } = Origin::of("cbvh-lab search");
        let commit = option_env!("CBVH_COMMIT").unwrap_or("a commit not named");
        let backends: Vec<_> = queriers().iter().map(|querier| querier.backend().name()).collect();
        let origin = format!("{date}, {commit}, {}, {}", machine.text(), backends.join(" "));
        Self { round, seconds: start.elapsed().as_secs_f64(), origin, counts, wrong }
    }
}

pub(crate) fn run(arguments: &SearchArguments) -> Result<String, Failure> {
    if let Some(round) = arguments.again {
        let Done { counts, wrong, .. } = Done::run(round);
        check(wrong.is_none(), || wrong.unwrap_or_default())?;
        return Ok(format!("nothing wrong; {counts:?}\n"));
    }
    let path = &arguments.record;
    let hours = Duration::try_from_secs_f64(arguments.hours * 3600.0);
    let end =
        Instant::now() + hours.map_err(|_| "--hours: expected a time, found a negative or an endless one")?;
    let done: BTreeSet<u64> = read(path)?.iter().map(|done| done.round).collect();
    let failed = |error| format!("{}: cannot write: {error}", path.display());
    let record = Mutex::new(OpenOptions::new().append(true).create(true).open(path).map_err(failed)?);
    let findings = AtomicUsize::new(0);
    let rounds =
        (0..u64::MAX).filter(|round| !done.contains(round)).take(arguments.rounds.unwrap_or(usize::MAX));
    let rounds =
        rounds.take_while(|_| Instant::now() < end && findings.load(Ordering::Relaxed) < MAX_FINDINGS);
    let work = |round| {
        let done = Done::run(round);
        if let Some(wrong) = &done.wrong {
            findings.fetch_add(1, Ordering::Relaxed);
            output::tell(&format!("round {round}: {wrong}"));
        }
        // One write, so that a kill leaves whole lines.
        let line = serde_json::to_string(&done)? + "\n";
        let mut record = record.lock().unwrap_or_else(PoisonError::into_inner);
        Ok::<(), Failure>(record.write_all(line.as_bytes()).map_err(failed)?)
    };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.into()).build()?;
    threads.install(|| rounds.par_bridge().try_for_each(work))?;
    let (mut rounds, mut seconds, mut counts) = (0, 0.0, Counts::default());
    for done in read(path)? {
        (rounds, seconds) = (rounds + 1, seconds + done.seconds);
        done.counts.0.iter().for_each(|(name, count)| counts.add(name, *count));
    }
    let (path, found) = (path.display(), findings.into_inner());
    check(found == 0, || format!("{path}: {found} findings"))?;
    Ok(format!("{path}: {rounds} rounds in {seconds:.0} s, {counts:?}\n"))
}

/// Reads a record, which may not exist yet.
fn read(path: &Path) -> Result<Vec<Done>, Failure> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text =
        fs::read_to_string(path).map_err(|error| format!("{}: cannot read: {error}", path.display()))?;
    let line = |(number, line): (usize, &str)| {
        let expected = format!("{}, line {}: expected a round of a search", path.display(), number + 1);
        serde_json::from_str(line).map_err(|error| format!("{expected}: {error}").into())
    };
    text.lines().enumerate().map(line).collect()
}

/// Returns the message of a panic as an error.
fn caught(work: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<String>().map(String::as_str);
        Err(format!("panicked: {}", message.or(panic.downcast_ref().copied()).unwrap_or_default()).into())
    })
}

/// Fails with what is wrong unless something holds.
fn check(holds: bool, wrong: impl FnOnce() -> String) -> Result<(), Failure> {
    if holds { Ok(()) } else { Err(wrong().into()) }
}

/// Leaves out stretches of items, first half of them, at last single ones, as long as what is left is wrong.
fn fewest<T: Clone>(mut items: Vec<T>, mut is_wrong: impl FnMut(&[T]) -> bool) -> Vec<T> {
    let (mut stretch, mut tries) = (items.len().div_ceil(2), 0);
    while stretch > 0 {
        let mut at = 0;
        while at < items.len() && tries < MAX_TRIES {
            tries += 1;
            let mut fewer = items.clone();
            fewer.drain(at..(at + stretch).min(items.len()));
            if is_wrong(&fewer) { items = fewer } else { at += stretch }
        }
        stretch /= 2;
    }
    items
}

/// Returns a querier for each backend that this CPU has.
fn queriers() -> Vec<Querier> {
    let here = Backend::ALL.into_iter().filter(|backend| backend.is_available());
    here.map(Querier::with_backend).collect()
}

/// Returns options of any layout of the first `encodings` triangle encodings.
fn any_layout(random: &mut Random, encodings: usize) -> Options {
    let encodings =
        &[TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized][..encodings];
    Options::default()
        .profile(Profile::ALL[random.below(Profile::ALL.len())])
        .triangles(encodings[random.below(encodings.len())])
        .effort(Effort::Quick)
        .topology(false)
}

/// Bakes triangles of one object, with their numbers as ids.
fn bake(triangles: &[Triangle], options: &Options) -> Result<Bvh, Failure> {
    Ok(Bvh::from_bytes(to_bytes(&mesh(triangles), options)?.0)?)
}

/// Describes two meshes in a pose, and how they are baked.
fn case([a, b]: [&[Triangle]; 2], options: &[Options; 2], pose: &Pose) -> String {
    let [of_a, of_b] = options.each_ref().map(Options::stamp);
    format!("A {a:?}, {of_a}; B {b:?}, {of_b}; {pose:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewest_items_are_left() {
        let is_wrong = |items: &[u32]| items.contains(&5) && items.contains(&77);
        assert_eq!(fewest((0..100).collect(), is_wrong), [5, 77]);
        assert_eq!(fewest(vec![1, 2, 3], |_| false), [1, 2, 3]);
        assert!(fewest(vec![1, 2, 3], |_| true).is_empty());
    }

    #[test]
    fn a_panic_is_a_finding() {
        assert_eq!(caught(|| panic!("no {}", 1)).unwrap_err().to_string(), "panicked: no 1");
        assert_eq!(caught(|| panic!("no")).unwrap_err().to_string(), "panicked: no");
    }
}
