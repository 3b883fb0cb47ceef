//! The progress of a bake, its bytes read and written, and what may stop it: counters that the stages update and any thread may read.
//!
//! Each step counts in a unit of its own what it has done, where a part of it is done: bytes where inputs are read and where the
//! output is written, triangles where a part or a brick is ready, pages where they are proved. Counters are relaxed atomic
//! sums, and the bake does not depend on them. While the bake runs, counters that are read together may be from slightly
//! different moments. When it has ended, they are exact.

use crate::error::BakeError;
use bvh_format::Stop;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A stage of a bake, as shown to users.
///
/// [`Progress`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
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
///
/// [`Progress`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
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
///
/// [`Progress`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
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
///
/// ```
/// use bvh_bake::{FileBake, Progress, Stage, Step, Traffic};
///
/// # let folder = std::env::temp_dir().join(format!("cbvh-progress-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # let output = folder.join("robot.cbvh");
/// # let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/fclrob.obj");
/// let (progress, mut steps) = (Progress::default(), Vec::new());
/// FileBake::new([mesh], &output).progress(&progress).on_step(|step| steps.push(step)).run()?;
/// assert_eq!(steps, Step::ALL);
/// assert_eq!(progress.share(Step::Bake(Stage::Build)), Some(1.0)); // any thread may read it during the bake
/// let Traffic { input_read, output_written, .. } = progress.traffic();
/// assert!(input_read == std::fs::metadata(mesh)?.len() && output_written > 0);
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Progress {
    counters: Arc<Counters>,
    /// What may stop the bake, in the clones that the bake itself uses.
    ending: Option<Arc<Ending>>,
}

/// What may stop a bake, and whether it has.
#[derive(Debug)]
struct Ending {
    stop: Arc<dyn Stop>,
    /// Whether a thread has found the stop set. All others then end, too, without asking it.
    has_come: AtomicBool,
}

#[derive(Debug, Default)]
struct Counters {
    work: [Work; Step::ALL.len()],
    /// Triangles found in the inputs, and duplicates among them, which take part in no step after [`Stage::Prepare`].
    found: AtomicU64,
    left_out: AtomicU64,
    input_read: AtomicU64,
    scratch_written: AtomicU64,
    scratch_read: AtomicU64,
    scratch_held: AtomicU64,
    scratch_most: AtomicU64,
    output_written: AtomicU64,
    output_read: AtomicU64,
}

/// The work of a step and the part of it that is done, in the unit of the step. The total is 0 until it is known.
#[derive(Debug, Default)]
struct Work {
    done: AtomicU64,
    total: AtomicU64,
}

/// Both [`Stage::Prepare`] and [`Stage::Build`] count each triangle twice, after two passes over it.
const PASSES: u64 = 2;

impl Progress {
    /// Returns the share of a step that is done, from 0 to 1, or `None` while it is unknown.
    pub fn share(&self, step: Step) -> Option<f64> {
        let (done, total) = self.work(step);
        (total > 0).then(|| done as f64 / total as f64)
    }

    /// Returns the number of triangles that a step has done. While reading, these are the triangles found so far.
    /// Later, they are as many as the work so far is worth. When a step has ended, the number is that of the input up to
    /// [`Stage::Prepare`], and then that of the stored triangles.
    pub fn triangles(&self, step: Step) -> u64 {
        let found = self.counters.found.load(Ordering::Relaxed);
        if step == Step::Read {
            return found;
        }
        let is_input = step == Step::Bake(Stage::Prepare);
        let left_out = if is_input { 0 } else { self.counters.left_out.load(Ordering::Relaxed) };
        let (done, total) = self.work(step);
        (u128::from(done) * u128::from(found.saturating_sub(left_out)) / u128::from(total.max(1))) as u64
    }

    /// Returns what a step has done, and all that it has to do.
    fn work(&self, step: Step) -> (u64, u64) {
        let Work { done, total } = &self.counters.work[step.index()];
        let (done, total) = (done.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
        (done.min(total), total)
    }

    /// Returns the bytes read and written so far.
    pub fn traffic(&self) -> Traffic {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let counters = &*self.counters;
        Traffic {
            input_read: of(&counters.input_read),
            scratch_written: of(&counters.scratch_written),
            scratch_read: of(&counters.scratch_read),
            scratch_most: of(&counters.scratch_most),
            output_written: of(&counters.output_written),
            output_read: of(&counters.output_read),
        }
    }

    /// Returns the same progress, for the parts of a bake that may be stopped.
    pub(crate) fn stopped_by(&self, stop: Option<Arc<dyn Stop>>) -> Self {
        let ending = stop.map(|stop| Arc::new(Ending { stop, has_come: AtomicBool::new(false) }));
        Self { counters: self.counters.clone(), ending }
    }

    /// Returns an error if the bake has to stop. Every stage calls this for each piece of its work.
    pub(crate) fn go_on(&self) -> Result<(), BakeError> {
        let Some(Ending { stop, has_come }) = self.ending.as_deref() else { return Ok(()) };
        if has_come.load(Ordering::Relaxed) || stop.is_set() {
            has_come.store(true, Ordering::Relaxed);
            return Err(BakeError::Stopped);
        }
        Ok(())
    }

    /// Returns an error of input or output if the bake has to stop.
    pub(crate) fn go_on_with_io(&self) -> io::Result<()> {
        self.go_on().map_err(io::Error::other)
    }

    /// Returns how a bake ended. One that was stopped has no other error, whatever that stopped first.
    pub(crate) fn ended<T>(&self, ended: Result<T, BakeError>) -> Result<T, BakeError> {
        let is_stopped = self.ending.as_ref().is_some_and(|ending| ending.has_come.load(Ordering::Relaxed));
        ended.map_err(|error| if is_stopped { BakeError::Stopped } else { error })
    }

    /// Adds triangles that were found.
    pub(crate) fn find(&self, triangles: u64) {
        self.counters.found.fetch_add(triangles, Ordering::Relaxed);
    }

    /// Records that all inputs have been read.
    pub(crate) fn end_reading(&self) {
        self.end(Step::Read);
        let passes = PASSES * self.counters.found.load(Ordering::Relaxed);
        self.expect(Step::Bake(Stage::Prepare), passes);
        self.expect(Step::Bake(Stage::Build), passes);
    }

    /// Records duplicates, of which the second pass of [`Stage::Prepare`] and all later steps know nothing.
    pub(crate) fn leave_out(&self, triangles: u64) {
        self.counters.left_out.fetch_add(triangles, Ordering::Relaxed);
        self.add(Step::Bake(Stage::Prepare), triangles);
        let build = &self.counters.work[Step::Bake(Stage::Build).index()];
        build.total.fetch_sub(PASSES * triangles, Ordering::Relaxed);
    }

    /// Records how much work a step has, in its unit.
    pub(crate) fn expect(&self, step: Step, total: u64) {
        self.counters.work[step.index()].total.store(total, Ordering::Relaxed);
    }

    /// Adds work that a step has done.
    pub(crate) fn add(&self, step: Step, done: u64) {
        self.counters.work[step.index()].done.fetch_add(done, Ordering::Relaxed);
    }

    /// Records that a step has ended.
    pub(crate) fn end(&self, step: Step) {
        let Work { done, total } = &self.counters.work[step.index()];
        total.fetch_max(1, Ordering::Relaxed);
        done.store(total.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    pub(crate) fn add_input_read(&self, bytes: u64) {
        self.counters.input_read.fetch_add(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_scratch_read(&self, bytes: u64) {
        self.counters.scratch_read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Records that scratch files have grown.
    pub(crate) fn add_scratch_written(&self, bytes: u64) {
        let held = self.counters.scratch_held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.counters.scratch_most.fetch_max(held, Ordering::Relaxed);
        self.counters.scratch_written.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Records that a scratch file was deleted.
    pub(crate) fn drop_scratch(&self, bytes: u64) {
        self.counters.scratch_held.fetch_sub(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_output_written(&self, bytes: u64) {
        self.counters.output_written.fetch_add(bytes, Ordering::Relaxed);
    }

    pub(crate) fn add_output_read(&self, bytes: u64) {
        self.counters.output_read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// The present size of all scratch files, in bytes.
    #[cfg(test)]
    pub(crate) fn scratch_held(&self) -> u64 {
        self.counters.scratch_held.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads")]
    fn work_adds_up_to_the_whole() {
        let progress = Progress::default();
        let (prepare, build, prove) =
            (Step::Bake(Stage::Prepare), Step::Bake(Stage::Build), Step::Bake(Stage::Prove));
        assert!(Step::ALL.iter().all(|&step| progress.share(step).is_none()));
        progress.find(1000);
        progress.end_reading();
        let triangles = |step, done| {
            std::thread::scope(|scope| {
                (0..4).for_each(|_| drop(scope.spawn(|| (0..done / 4).for_each(|_| progress.add(step, 1)))));
            });
        };
        assert_eq!((progress.share(Step::Read), progress.triangles(Step::Read)), (Some(1.0), 1000));
        assert_eq!((progress.share(prepare), progress.triangles(prepare)), (Some(0.0), 0));
        triangles(prepare, 1000);
        assert_eq!((progress.share(prepare), progress.triangles(prepare)), (Some(0.5), 500));
        progress.leave_out(200);
        triangles(prepare, 800);
        assert_eq!((progress.share(prepare), progress.triangles(prepare)), (Some(1.0), 1000));
        assert_eq!(progress.share(build), Some(0.0));
        triangles(build, 1600);
        assert_eq!((progress.share(build), progress.triangles(build)), (Some(1.0), 800));
        // The unit of the proof is a page. More than all is all.
        progress.expect(prove, 3);
        progress.add(prove, 1);
        assert_eq!((progress.share(prove), progress.triangles(prove)), (Some(1.0 / 3.0), 266));
        progress.add(prove, 3);
        assert_eq!((progress.share(prove), progress.triangles(prove)), (Some(1.0), 800));
        assert_eq!(progress.share(Step::Write), None);
        progress.end(Step::Write);
        assert_eq!((progress.share(Step::Write), progress.triangles(Step::Write)), (Some(1.0), 800));
    }

    #[test]
    fn steps_are_numbered_in_order() {
        assert!(Step::ALL.iter().enumerate().all(|(number, step)| step.index() == number));
        assert!(Step::ALL.is_sorted());
    }
}
