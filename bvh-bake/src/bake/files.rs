//! Bakes mesh files to a `.cbvh` file, which is written completely or not at all, and skips outputs that are up to
//! date.
//!
//! An output is up to date if a bake would give the same content: the output is undamaged, and it was made by this
//! version of the format and the baker, with the same options and from inputs with the same bytes. The provenance
//! section of the output records all of this, so that no other file is needed.

use super::provenance::{self, Provenance};
use super::report::BakeReport;
use super::report::FileSummary;
use crate::bake;
use crate::error::{BakeError, InputError};
use crate::input::gather::Gatherer;
use crate::input::{Checksums, InputFile};
use crate::options::Options;
use crate::progress::{Progress, Step};
use crate::storage::atomic::{self, SCRATCH_NAME};
use crate::storage::disk_space;
use crate::storage::output::Output;
use crate::storage::resources::{Allowance, READING_BYTES, Resources};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The outcome of [`FileBake::run`].
///
/// [`FileBake`] has an example.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The output has been written.
    Baked(Box<BakeReport>),
    /// The output was up to date and was left alone. The summary is that of the existing file.
    UpToDate(FileSummary),
}

/// Returns the least bytes of memory with which a mesh of `triangles` triangles can be baked. The rest goes to scratch
/// files.
pub fn least_memory(triangles: u64) -> u64 {
    Resources::least(triangles)
}

/// A bake of mesh files into one `.cbvh` file: its inputs, its output and its options.
///
/// Several inputs are baked as if they were one: their objects follow each other, and the triangle ids continue from
/// each file to the next. The output is written completely or not at all: it is written under a temporary name beside
/// its own, synchronised and renamed. Until then, the old file stays in place.
///
/// The bytes of the output depend neither on the memory budget nor on the number of threads.
///
/// Cost: that of [`crate::to_bytes`], plus reading all inputs once, or twice if an existing output may be up to date. A
/// malformed file may be read again to find the place of the error. With a memory budget, up to 200 bytes of scratch
/// files per triangle are written and read two to three times. If the output is up to date, only the inputs and the
/// output are read.
///
/// ```no_run
/// use bvh_bake::{FileBake, Options, Outcome};
///
/// # fn main() -> Result<(), bvh_bake::BakeError> {
/// let bake = FileBake::new(["rock.obj"], "rock.cbvh").options(Options::default().ids(false)).max_memory(512 << 20);
/// match bake.run()? {
///     Outcome::Baked(report) => println!("{} triangles", report.file.triangles),
///     Outcome::UpToDate(_) => println!("rock.cbvh is up to date"),
/// }
/// # Ok(())
/// # }
/// ```
#[must_use = "nothing is baked until it is run"]
pub struct FileBake<'a> {
    inputs: Vec<PathBuf>,
    output: PathBuf,
    options: Options,
    force: bool,
    max_memory: Option<u64>,
    allow_outside: bool,
    scratch: Option<PathBuf>,
    progress: Progress,
    on_step: Box<dyn FnMut(Step) + 'a>,
}

impl<'a> FileBake<'a> {
    /// Makes a bake of the given inputs to the given output, with default options and no memory limit.
    pub fn new(inputs: impl IntoIterator<Item = impl Into<PathBuf>>, output: impl Into<PathBuf>) -> Self {
        Self {
            inputs: inputs.into_iter().map(Into::into).collect(),
            output: output.into(),
            options: Options::default(),
            force: false,
            max_memory: None,
            allow_outside: false,
            scratch: None,
            progress: Progress::default(),
            on_step: Box::new(|_| ()),
        }
    }

    /// Sets the options of the bake.
    pub fn options(self, options: Options) -> Self {
        Self { options, ..self }
    }

    /// Sets whether to bake even if the output is up to date.
    pub fn force(self, force: bool) -> Self {
        Self { force, ..self }
    }

    /// Sets the most memory that the whole process may have resident, in bytes; `None` for no limit. Data that do not
    /// fit go to scratch files. Inputs are read piece by piece; only COLLADA files, the JSON of glTF files, and files that are not
    /// regular such as pipes, are read into memory as a whole. If one of these is too large for the budget, the bake
    /// fails. Some allocators, such as that of the GNU C library, keep much of the freed memory and must be told not
    /// to: see its `mallopt`.
    pub fn max_memory(self, bytes: impl Into<Option<u64>>) -> Self {
        Self { max_memory: bytes.into(), ..self }
    }

    /// Sets whether a glTF file may name buffers outside its own folder, by `..` or by symbolic links. By default that
    /// is refused, because the author of the file could choose which files of this system end up in the output.
    pub fn allow_outside(self, allow: bool) -> Self {
        Self { allow_outside: allow, ..self }
    }

    /// Sets the directory for scratch files; `None` for the directory of the output. Scratch files have no names, so
    /// nothing is left however the process ends.
    pub fn scratch(self, directory: impl Into<Option<PathBuf>>) -> Self {
        Self { scratch: directory.into(), ..self }
    }

    /// Sets the progress that the bake updates. Any thread may read it at any time.
    pub fn progress(self, progress: &Progress) -> Self {
        Self { progress: progress.clone(), ..self }
    }

    /// Sets a function that is called when a step begins. The progress then contains the work of the previous step.
    pub fn on_step(self, on_step: impl FnMut(Step) + 'a) -> Self {
        Self { on_step: Box::new(on_step), ..self }
    }

    /// Runs the bake.
    ///
    /// # Errors
    /// [`BakeError::Read`] if an input cannot be read or is malformed; [`BakeError::Input`] if there are no inputs or no
    /// triangles; [`BakeError::OutputIsInput`] if the output is one of the inputs; [`BakeError::Memory`] if the memory
    /// budget is too small; [`BakeError::Room`] if there is too little room for scratch files and the output;
    /// [`BakeError::Scratch`] if the system refuses scratch files; [`BakeError::Write`] if it refuses the output; and the
    /// errors of [`crate::to_bytes`]. After any of them, the output is unchanged, and no other file is left.
    pub fn run(mut self) -> Result<Outcome, BakeError> {
        self.progress = self.progress.stopped_by(self.options.stop.clone());
        let progress = self.progress.clone();
        progress.ended(self.finish())
    }

    fn finish(mut self) -> Result<Outcome, BakeError> {
        (self.on_step)(Step::Read);
        self.progress.go_on()?;
        if self.inputs.is_empty() {
            return Err(InputError::Empty.into());
        }
        refuse_output(&self.inputs, &self.output)?;
        // Everything else is beside the file that is replaced, whichever link leads there.
        self.output = atomic::target(&self.output)?;
        let may_be_up_to_date = !self.force && self.output.exists();
        let readings = if may_be_up_to_date { 2 } else { 1 };
        self.progress.expect(Step::Read, file_lengths(&self.inputs).saturating_mul(readings));
        atomic::remove_stale_beside(&self.output);
        if let Some(scratch) = &self.scratch {
            atomic::remove_stale(scratch, &[SCRATCH_NAME.as_ref()]);
        }
        bake::check_numbers(&self.options)?;
        // If the budget is too small for any mesh, the inputs are not even read.
        self.require_memory(0, Resources::least(0))?;
        let inputs = self.find_inputs()?;
        let longest = inputs.iter().map(InputFile::length).max().unwrap_or_default();
        self.require_memory(0, Resources::least(0) + longest.min(READING_BYTES))?;
        // Reading the inputs gives their checksums. They are needed before that only if an existing output may be up to
        // date.
        let taken = inputs.iter().map(InputFile::bytes_in_memory).sum();
        if may_be_up_to_date {
            let memory = self.memory_of_inputs(taken);
            let checksums = inputs.iter().map(|input| {
                Checksums::of(input, memory, &self.progress).map_err(|halt| halt.in_file(input.path()))
            });
            let provenance = self.provenance(&checksums.collect::<Result<Vec<_>, _>>()?);
            if let Some(summary) = provenance::up_to_date(&self.output, &provenance, &self.progress) {
                return Ok(Outcome::UpToDate(summary));
            }
        }
        // If the output cannot be written, the bake fails here, before the work. Without a memory budget, the output stays in
        // memory until it is proved.
        let new_output = if self.max_memory.is_some() { Output::beside } else { Output::kept_beside };
        let mut output = new_output(&self.output, &self.progress)?;
        let resources = match self.max_memory {
            Some(budget) => {
                disk_space::check(&[(self.scratch_directory(), file_lengths(&self.inputs))])?;
                Resources::within(budget, taken, self.scratch_directory(), &self.progress)
            }
            None => Resources::unlimited(&self.progress),
        };
        let mut start = Instant::now();
        let split = self.options.split_objects || self.options.scene;
        let mut gatherer = Gatherer::new(&resources, split).rounding(self.options.round);
        let checksums = inputs.iter().map(|input| gatherer.read(input)).collect::<Result<Vec<_>, _>>()?;
        drop(inputs);
        if self.max_memory.is_some() {
            self.require_resources(gatherer.triangles(), taken + resources.kept())?;
        } else {
            start = Instant::now();
        }
        let provenance = self.provenance(&checksums).to_text();
        let on_step = &mut self.on_step;
        let mut on_stage = |stage| on_step(Step::Bake(stage));
        let mut report = bake::bake(gatherer, &self.options, &provenance, &mut output, &mut on_stage)?;
        on_step(Step::Write);
        output.rename()?;
        self.progress.end(Step::Write);
        report.seconds = start.elapsed().as_secs_f64();
        Ok(Outcome::Baked(Box::new(report)))
    }

    fn find_inputs(&self) -> Result<Vec<InputFile<'_>>, BakeError> {
        let (mut inputs, mut taken) = (Vec::new(), 0);
        for path in &self.inputs {
            let input = InputFile::find(path, self.memory_of_inputs(taken), &self.progress)
                .map_err(|halt| halt.in_file(path))?;
            taken += input.bytes_in_memory();
            inputs.push(input.with_options(&self.options).allow_outside(self.allow_outside));
        }
        Ok(inputs)
    }

    /// Returns the memory for what is read as a whole, of which inputs have taken `taken` bytes.
    fn memory_of_inputs(&self, taken: u64) -> Allowance {
        self.max_memory.map_or(Allowance::UNLIMITED, |budget| Allowance::of_inputs(budget, taken))
    }

    fn provenance(&self, checksums: &[Checksums]) -> Provenance {
        Provenance::new(&self.inputs, &self.options, checksums)
    }

    /// Returns the directory for scratch files.
    fn scratch_directory(&self) -> &Path {
        self.scratch.as_deref().unwrap_or_else(|| atomic::directory_of(&self.output))
    }

    /// Refuses a mesh of `triangles` triangles that needs more memory, besides what inputs have taken, or more room on disk
    /// than there is.
    fn require_resources(&self, triangles: u64, taken: u64) -> Result<(), BakeError> {
        self.require_memory(triangles, Resources::least(triangles).saturating_add(taken))?;
        let bytes = |each: u64| triangles.saturating_mul(each);
        disk_space::check(&[
            (self.scratch_directory(), bytes(disk_space::SCRATCH_BYTES_PER_TRIANGLE)),
            (atomic::directory_of(&self.output), bytes(disk_space::OUTPUT_BYTES_PER_TRIANGLE)),
        ])
    }

    fn require_memory(&self, triangles: u64, needed: u64) -> Result<(), BakeError> {
        match self.max_memory {
            Some(budget) if needed > budget => {
                let input = self.inputs.first().cloned().unwrap_or_default();
                Err(BakeError::Memory { input, triangles, needed, budget })
            }
            _ => Ok(()),
        }
    }
}

/// Returns the bytes of all inputs. Missing inputs are reported when they are read.
fn file_lengths(inputs: &[PathBuf]) -> u64 {
    inputs.iter().filter_map(|input| std::fs::metadata(input).ok()).map(|metadata| metadata.len()).sum()
}

/// Refuses outputs that a rename would destroy: an input, a directory or a device.
fn refuse_output(inputs: &[PathBuf], output: &Path) -> Result<(), BakeError> {
    if let Ok(existing) = std::fs::canonicalize(output) {
        for input in inputs {
            if std::fs::canonicalize(input).is_ok_and(|input| input == existing) {
                return Err(BakeError::OutputIsInput { path: output.to_owned() });
            }
        }
    }
    atomic::refuse_special(output)
}
