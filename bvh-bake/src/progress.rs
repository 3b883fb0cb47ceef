//! The progress of a bake, and its bytes read and written: counters that the stages update and any thread may read.
//!
//! A stage goes through its triangles in several passes, each of which takes about the same share of the stage's time.
//! Progress is counted in such passes, one part or batch of pages at a time, in relaxed atomic sums. The bake does not
//! depend on them. While the bake runs, counters that are read together may be from slightly different moments. When it
//! has ended, they are exact.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A stage of a bake, as shown to users.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Chooses origins, rounds coordinates and finds duplicates.
    Prepare,
    /// Dividing the triangles into bricks, building their trees and encoding their pages.
    Build,
    /// Writes the pages with their numbers, the sections and the checksums.
    Encode,
    /// Proves the finished bytes.
    Prove,
}

impl Stage {
    /// The stage's name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepare => "preparing",
            Self::Build => "building bricks",
            Self::Encode => "assembling",
            Self::Prove => "proving bounds",
        }
    }
}

/// A step of [`crate::FileBake`], in the order in which they begin. With several objects, those of
/// [`Stage::Prepare`] and [`Stage::Build`] take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Reads the inputs, and checks whether the output is up to date.
    Read,
    /// A stage of the bake.
    Bake(Stage),
    /// Completes the output: the bytes that the system has not written yet, and the name.
    Write,
}

impl Step {
    /// All steps, in order.
    pub const ALL: [Self; 6] = [
        Self::Read,
        Self::Bake(Stage::Prepare),
        Self::Bake(Stage::Build),
        Self::Bake(Stage::Encode),
        Self::Bake(Stage::Prove),
        Self::Write,
    ];

    /// The step's name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "reading",
            Self::Bake(stage) => stage.name(),
            Self::Write => "writing",
        }
    }

    fn index(self) -> usize {
        match self {
            Self::Read => 0,
            Self::Bake(stage) => 1 + stage as usize,
            Self::Write => 5,
        }
    }
}

/// The bytes that a bake asks the system to read and write. Repeated reads and writes count each time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Bytes read from the inputs: each once, and once more if an existing output may be up to date.
    pub input_read: u64,
    /// Bytes written to scratch files; none without a memory budget.
    pub scratch_written: u64,
    /// Bytes read from scratch files; some are read several times.
    pub scratch_read: u64,
    /// The most bytes that scratch files had at one time.
    pub scratch_most: u64,
    /// Bytes written to the output: each once, and the header once more when all its values are known.
    pub output_written: u64,
    /// Bytes read from the output: those of an old one to see whether it is up to date, and under a memory budget also
    /// those of the new one to prove it.
    pub output_read: u64,
}

impl Traffic {
    /// Returns the bytes read from all files.
    pub fn read(&self) -> u64 {
        self.input_read + self.scratch_read + self.output_read
    }

    /// Returns the bytes written to all files.
    pub fn written(&self) -> u64 {
        self.scratch_written + self.output_written
    }
}

/// The progress of a bake. Clones show the same bake, and each bake needs a progress of its own.
#[derive(Debug, Clone, Default)]
pub struct Progress(Arc<Counters>);

#[derive(Debug, Default)]
struct Counters {
    work: [Work; Step::ALL.len()],
    /// Triangles found in the inputs.
    found: AtomicU64,
    input_read: AtomicU64,
    scratch_written: AtomicU64,
    scratch_read: AtomicU64,
    scratch_held: AtomicU64,
    scratch_most: AtomicU64,
    output_written: AtomicU64,
    output_read: AtomicU64,
}

/// The work of a step and the part of it that is done: bytes while reading and triangles later, times [`WHOLE`].
#[derive(Debug, Default)]
struct Work {
    done: AtomicU64,
    total: AtomicU64,
}

/// The sum of the weights of all passes of a step over one triangle or byte: a weight counts sixteenths of the step.
pub(crate) const WHOLE: u64 = 16;

impl Progress {
    /// Returns the share of a step that is done, from 0 to 1, or `None` while it is unknown.
    pub fn share(&self, step: Step) -> Option<f64> {
        let Work { done, total } = &self.0.work[step.index()];
        let (done, total) = (done.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
        (total > 0).then(|| done.min(total) as f64 / total as f64)
    }

    /// Returns the number of triangles that a step has done. While reading, these are the triangles found so far.
    /// Later, they are the triangles that all passes have completed, or as many as the passes so far are worth. When a
    /// step has ended, the number is that of the input up to [`Stage::Prepare`], and then that of the stored triangles.
    pub fn triangles(&self, step: Step) -> u64 {
        match step {
            Step::Read => self.0.found.load(Ordering::Relaxed),
            step => self.0.work[step.index()].done.load(Ordering::Relaxed) / WHOLE,
        }
    }

    /// Returns the bytes read and written so far.
    pub fn traffic(&self) -> Traffic {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let counters = &*self.0;
        Traffic {
            input_read: of(&counters.input_read),
            scratch_written: of(&counters.scratch_written),
            scratch_read: of(&counters.scratch_read),
            scratch_most: of(&counters.scratch_most),
            output_written: of(&counters.output_written),
            output_read: of(&counters.output_read),
        }
    }

    /// Records the total bytes of the inputs, which are read or parsed.
    pub(crate) fn expect_bytes(&self, bytes: u64) {
        self.0.work[Step::Read.index()].total.store(bytes.saturating_mul(WHOLE), Ordering::Relaxed);
    }

    /// Adds triangles that were found.
    pub(crate) fn find(&self, triangles: u64) {
        self.0.found.fetch_add(triangles, Ordering::Relaxed);
    }

    /// Records that all inputs have been read, and the number of triangles that go through all later steps.
    pub(crate) fn expect(&self, triangles: u64) {
        let [read, others @ ..] = &self.0.work;
        read.done.store(read.total.load(Ordering::Relaxed), Ordering::Relaxed);
        others.iter().for_each(|work| work.total.store(triangles * WHOLE, Ordering::Relaxed));
    }

    /// Records the number of duplicates, which take part in no step after [`Stage::Prepare`].
    pub(crate) fn leave_out(&self, triangles: u64) {
        for work in &self.0.work[Step::Bake(Stage::Build).index()..] {
            work.total.fetch_sub(triangles * WHOLE, Ordering::Relaxed);
        }
    }

    /// Records that a step has completed the first `triangles` triangles.
    pub(crate) fn reach(&self, step: Step, triangles: u64) {
        self.0.work[step.index()].done.store(triangles * WHOLE, Ordering::Relaxed);
    }

    /// Starts to count a pass over `amount` triangles or bytes of inputs. The pass is complete when `units` units have
    /// been added; `weight` is its share of [`WHOLE`].
    pub(crate) fn tally(&self, step: Step, weight: u64, amount: u64, units: u64) -> Tally<'_> {
        let work = &self.0.work[step.index()].done;
        Tally { work, worth: amount.saturating_mul(weight), units, done: AtomicU64::new(0) }
    }

    pub(crate) fn add_input_read(&self, bytes: u64) {
        self.0.input_read.fetch_add(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_scratch_read(&self, bytes: u64) {
        self.0.scratch_read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Records that scratch files have grown.
    pub(crate) fn add_scratch_written(&self, bytes: u64) {
        let held = self.0.scratch_held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.0.scratch_most.fetch_max(held, Ordering::Relaxed);
        self.0.scratch_written.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Records that a scratch file was deleted.
    pub(crate) fn drop_scratch(&self, bytes: u64) {
        self.0.scratch_held.fetch_sub(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_output_written(&self, bytes: u64) {
        self.0.output_written.fetch_add(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_output_read(&self, bytes: u64) {
        self.0.output_read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// The present size of all scratch files, in bytes.
    #[cfg(test)]
    pub(crate) fn scratch_held(&self) -> u64 {
        self.0.scratch_held.load(Ordering::Relaxed)
    }
}

/// A part of a step's work, which is done unit by unit.
pub(crate) struct Tally<'a> {
    work: &'a AtomicU64,
    /// The work of all units.
    worth: u64,
    units: u64,
    done: AtomicU64,
}

impl Tally<'_> {
    /// Adds units that are done. Units beyond the stated number are ignored.
    pub(crate) fn add(&self, units: u64) {
        let before = self.done.fetch_add(units, Ordering::Relaxed);
        let worth = self.worth_of(before + units) - self.worth_of(before);
        self.work.fetch_add(worth, Ordering::Relaxed);
    }

    /// Returns the work of `units` units, computed such that rounding errors do not accumulate.
    fn worth_of(&self, units: u64) -> u64 {
        let part = u128::from(self.worth) * u128::from(units.min(self.units)) / u128::from(self.units.max(1));
        part as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads")]
    fn passes_add_up_to_the_whole() {
        let progress = Progress::default();
        let step = Step::Bake(Stage::Build);
        assert_eq!(progress.share(step), None);
        progress.expect(1000);
        for (weight, units) in [(5, 7), (WHOLE - 5, 100_001)] {
            let tally = progress.tally(step, weight, 1000, units);
            let before = progress.share(step).unwrap();
            std::thread::scope(|scope| {
                (0..4).for_each(|_| drop(scope.spawn(|| (0..units).for_each(|_| tally.add(1)))));
            });
            let passed = progress.share(step).unwrap() - before;
            assert!((passed - weight as f64 / WHOLE as f64).abs() < 1e-12, "{passed}");
        }
        assert_eq!((progress.share(step), progress.triangles(step)), (Some(1.0), 1000));
        progress.leave_out(200);
        progress.reach(step, 800);
        assert_eq!((progress.share(step), progress.triangles(step)), (Some(1.0), 800));
        assert_eq!(progress.share(Step::Bake(Stage::Prepare)), Some(0.0));
    }

    #[test]
    fn steps_are_numbered_in_order() {
        assert!(Step::ALL.iter().enumerate().all(|(number, step)| step.index() == number));
        assert!(Step::ALL.is_sorted());
    }
}
