//! From mesh files to a `.cbvh` file: read, bake, write whole or not at all, and not twice.
//!
//! An output is up to date if a bake would give the same content: it is undamaged, of this version of
//! the format and the baker, of the same options, and of inputs with the same bytes. All that is noted
//! in its provenance section, so nothing else is kept beside it.

mod atomic;
mod provenance;
mod room;

pub(crate) use atomic::{Temporary, remove_stale_of};
pub use atomic::{discard_unfinished, write_atomically};

use crate::bake::{self, Baker, Stage};
use crate::error::BakeError;
use crate::gather::Gatherer;
use crate::io::{self, Input, MeshFormat, ReadError};
use crate::means::Means;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::progress::{Progress, Step};
use crate::report::BakeReport;
use crate::scratch;
use crate::summary::FileSummary;
use crate::target::Target;
use bvh_format::checksum::checksum;
pub(crate) use provenance::Checksums;
use provenance::Provenance;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How to go about files; how to bake is said by [`Options`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileOptions {
    /// Bake even if the output is up to date.
    pub force: bool,
    /// The most memory that the whole process may have resident, in bytes; `None` for no limit. What does not fit
    /// goes to scratch files. glTF files are read into memory, other inputs piece by piece. An allocator that keeps
    /// much of what is freed, as that of the GNU C library does, is to be told not to: see its `mallopt`.
    pub max_memory: Option<u64>,
    /// The directory for scratch files; `None` for the output's. They have no names there: nothing of them is left,
    /// however the process ends.
    pub scratch: Option<PathBuf>,
}

/// What came of [`bake_files`].
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The output has been written.
    Baked(Box<BakeReport>),
    /// The output was up to date and has been left alone; what it says of itself.
    UpToDate(FileSummary),
}

/// Bytes of memory that baking a mesh of so many triangles within a budget needs at least. The rest goes to files.
pub fn least_memory(triangles: u64) -> u64 {
    Means::least(triangles)
}

/// Bakes mesh files into one `.cbvh` file.
///
/// Several inputs are baked as if they were one: their objects follow each other, and triangle ids run
/// on from each file to the next. The output appears whole under its name or not at all: it is written
/// beside it, synchronised and renamed. What was there before stays until then.
///
/// The bytes of the output do not depend on the budget of memory, nor on the number of threads.
///
/// Cost: that of [`crate::to_bytes`], and reading all inputs; within a budget, OBJ twice, all once more if there is an
/// output that may be up to date, and up to 200 bytes of scratch a triangle, each written and read two to three times. If
/// the output is up to date, reading inputs and output.
///
/// How far it is, and what has been read and written, can be seen in `progress` at any time, from any thread. `begin` is
/// called when a step begins, and what the step before has done is in `progress` then.
///
/// # Errors
/// [`BakeError::Read`] if an input cannot be read or is wrong; [`BakeError::OutputIsInput`];
/// [`BakeError::Memory`] if the budget is too small; [`BakeError::Room`] if there is too little room for scratch
/// files and output; [`BakeError::Write`] if the system refuses the output or scratch files; and those of
/// [`crate::to_bytes`]. After any of them the output is as it was, and nothing else is left.
pub fn bake_files(
    inputs: &[PathBuf],
    output: &Path,
    options: &Options,
    file_options: &FileOptions,
    progress: &Progress,
    begin: &mut dyn FnMut(Step),
) -> Result<Outcome, BakeError> {
    begin(Step::Read);
    refuse_output(inputs, output)?;
    progress.expect_bytes(file_lengths(inputs));
    let job = Job { inputs, output, options, file_options, progress };
    scratch::remove_stale(job.scratch());
    match file_options.max_memory {
        Some(budget) => job.within(budget, begin),
        None => job.in_memory(begin),
    }
}

/// A bake from files to a file.
struct Job<'a> {
    inputs: &'a [PathBuf],
    output: &'a Path,
    options: &'a Options,
    file_options: &'a FileOptions,
    progress: &'a Progress,
}

impl Job<'_> {
    fn in_memory(&self, begin: &mut dyn FnMut(Step)) -> Result<Outcome, BakeError> {
        let mut sources = Sources::new(self.progress);
        for input in self.inputs {
            sources.add(input)?;
        }
        let provenance = Provenance::new(self.inputs, self.options, &sources.checksums);
        if let Some(summary) = self.up_to_date(&provenance) {
            return Ok(Outcome::UpToDate(summary));
        }
        let mut mesh = sources.into_mesh()?;
        let parsed = Instant::now();
        if !self.options.split_objects {
            mesh = mesh.merged();
        }
        let mut target = Target::beside(self.output, self.progress)?;
        let means = Means::unlimited(self.progress);
        let mut stage = |stage| begin(Step::Bake(stage));
        let (mesh, text) = (Cow::Owned(mesh), provenance.to_text());
        let report = bake::of_objects(mesh, self.options, &text, &means, &mut target, &mut stage)?;
        self.close(report, target, parsed, begin)
    }

    fn within(&self, budget: u64, begin: &mut dyn FnMut(Step)) -> Result<Outcome, BakeError> {
        // What certainly does not fit is not even read.
        self.check_budget(budget, 0, Means::least(0))?;
        let progress = self.progress;
        let mut formats = Vec::new();
        for input in self.inputs {
            let (format, length) = format_of(input, progress)?;
            if format == MeshFormat::Gltf {
                let needed = Means::least(0).saturating_add(length.saturating_mul(GLTF_BYTES));
                self.check_budget(budget, 0, needed)?;
            }
            formats.push(format);
        }
        // What inputs are is known when they have been parsed; before, it matters only where the output may be what they
        // would give.
        if !self.file_options.force && self.output.exists() {
            let inputs = self.inputs.iter().zip(&formats);
            let checksums = inputs.map(|(input, &format)| Checksums::of_file(input, format, progress));
            let checksums = checksums.collect::<Result<Vec<_>, _>>()?;
            let provenance = Provenance::new(self.inputs, self.options, &checksums);
            if let Some(summary) = self.up_to_date(&provenance) {
                return Ok(Outcome::UpToDate(summary));
            }
        }
        // Fails before the work, where the output cannot be written.
        drop(Target::beside(self.output, progress)?);
        let parsed = Instant::now();
        let scratch = self.scratch();
        room::check(&[(scratch, file_lengths(self.inputs))])?;
        let means = Means::within(budget, scratch, progress);
        let mut gatherer = Gatherer::new(&means, self.options.split_objects);
        let inputs = self.inputs.iter().zip(formats);
        let checksums = inputs.map(|(input, format)| gatherer.read(input, format));
        let checksums = checksums.collect::<Result<Vec<_>, _>>()?;
        let provenance = Provenance::new(self.inputs, self.options, &checksums);
        let triangles = gatherer.triangles();
        self.check_budget(budget, triangles, Means::least(triangles))?;
        let bytes = |each: u64| triangles.saturating_mul(each);
        let output = atomic::directory_of(self.output);
        room::check(&[(scratch, bytes(room::SCRATCH_A_TRIANGLE)), (output, bytes(room::OUTPUT_A_TRIANGLE))])?;
        let prepared = gatherer.finish(|diagonal| bake::grid_error(self.options, diagonal))?;
        progress.expect(triangles);
        let mut stage = |stage| begin(Step::Bake(stage));
        let mut baker = Baker::new(self.options, triangles, &means);
        for prepared in prepared {
            stage(Stage::Prepare);
            baker.add(prepared, &mut stage)?;
        }
        let mut target = Target::beside(self.output, progress)?;
        let report = baker.finish(&provenance.to_text(), &mut target, &mut stage)?;
        self.close(report, target, parsed, begin)
    }

    /// The directory for scratch files.
    fn scratch(&self) -> &Path {
        let scratch = self.file_options.scratch.as_deref();
        scratch.unwrap_or_else(|| atomic::directory_of(self.output))
    }

    fn check_budget(&self, budget: u64, triangles: u64, needed: u64) -> Result<(), BakeError> {
        if needed <= budget {
            return Ok(());
        }
        let input = self.inputs.first().cloned().unwrap_or_default();
        Err(BakeError::Memory { input, triangles, needed, budget })
    }

    fn up_to_date(&self, provenance: &Provenance) -> Option<FileSummary> {
        if self.file_options.force {
            None
        } else {
            provenance::up_to_date(self.output, provenance, self.progress)
        }
    }

    /// Gives the output its name.
    fn close(
        &self,
        mut report: BakeReport,
        target: Target,
        parsed: Instant,
        begin: &mut dyn FnMut(Step),
    ) -> Result<Outcome, BakeError> {
        begin(Step::Write);
        target.rename()?;
        self.progress.reach(Step::Write, report.file.triangles);
        report.seconds = parsed.elapsed().as_secs_f64();
        Ok(Outcome::Baked(Box::new(report)))
    }
}

/// Bytes of memory a byte of a glTF file, at least.
pub(crate) const GLTF_BYTES: u64 = 8;

/// What passes over an input's bytes are worth in memory: reading, parsing.
const IN_MEMORY: [u64; 2] = [3, 13];

/// A file's format and length.
pub(crate) fn format_of(input: &Path, progress: &Progress) -> Result<(MeshFormat, u64), BakeError> {
    let failed = |source| ReadError::Io { path: input.to_owned(), source };
    let mut file = Input::open(input, progress, 0).map_err(failed)?;
    let length = file.length();
    let head = file.read_up_to(4096).map_err(failed)?;
    let format = MeshFormat::from_extension(input).or_else(|| MeshFormat::from_head(&head, length));
    Ok((format.ok_or_else(|| io::unknown_format(input))?, length))
}

/// Reads mesh files as [`bake_files`] does: objects one file after the other, ids running on.
///
/// # Errors
/// As [`io::read`]; also if the files together have more triangles than there are ids.
pub fn read_meshes(inputs: &[PathBuf]) -> Result<Mesh, BakeError> {
    let mut joined = Mesh::default();
    for input in inputs {
        append(&mut joined, io::read(input)?)?;
    }
    Ok(joined)
}

/// Adds the objects of a mesh, their ids after those that are there.
fn append(joined: &mut Mesh, mut mesh: Mesh) -> Result<(), BakeError> {
    let first = joined.triangle_count();
    let all = first + mesh.triangle_count();
    if all > crate::mesh::MAX_TRIANGLES {
        return Err(crate::mesh::InputError::TooManyTriangles(all).into());
    }
    let ids = mesh.objects.iter_mut().flat_map(|object| &mut object.triangle_ids);
    ids.for_each(|id| *id = id.saturating_add(first as u32));
    joined.objects.append(&mut mesh.objects);
    Ok(())
}

/// Inputs that have been read into memory; text is parsed only once it is known that it has to be.
struct Sources<'a> {
    files: Vec<Source>,
    checksums: Vec<Checksums>,
    progress: &'a Progress,
}

enum Source {
    Bytes(PathBuf, Vec<u8>, MeshFormat),
    Mesh(Mesh),
}

impl<'a> Sources<'a> {
    fn new(progress: &'a Progress) -> Self {
        Self { files: Vec::new(), checksums: Vec::new(), progress }
    }

    fn add(&mut self, input: &Path) -> Result<(), BakeError> {
        let failed = |source| ReadError::Io { path: input.to_owned(), source };
        let [reading, parsing] = IN_MEMORY;
        let whole = Input::open(input, self.progress, reading).and_then(|mut file| file.read_all());
        let bytes = whole.map_err(failed)?;
        let mut checksums = Checksums { file: checksum(&bytes), mesh: None };
        let format = MeshFormat::from_extension(input).or_else(|| MeshFormat::from_content(&bytes));
        self.files.push(match format {
            // A glTF file may name others, which its own bytes say nothing of: what is read counts.
            Some(MeshFormat::Gltf) => {
                let mesh = io::parse(&bytes, MeshFormat::Gltf, input, self.progress, parsing)?;
                checksums.mesh = Some(mesh.checksum());
                Source::Mesh(mesh)
            }
            Some(format) => Source::Bytes(input.to_owned(), bytes, format),
            None => return Err(io::unknown_format(input).into()),
        });
        self.checksums.push(checksums);
        Ok(())
    }

    fn into_mesh(self) -> Result<Mesh, BakeError> {
        let mut joined = Mesh::default();
        for source in self.files {
            let mesh = match source {
                Source::Bytes(input, bytes, format) => {
                    io::parse(&bytes, format, &input, self.progress, IN_MEMORY[1])?
                }
                Source::Mesh(mesh) => mesh,
            };
            self.progress.find(mesh.triangle_count());
            append(&mut joined, mesh)?;
        }
        Ok(joined)
    }
}

/// Bytes of all inputs; those that are not there are met when they are read.
fn file_lengths(inputs: &[PathBuf]) -> u64 {
    inputs.iter().filter_map(|input| std::fs::metadata(input).ok()).map(|metadata| metadata.len()).sum()
}

/// Refuses outputs that a rename would destroy: an input, a directory, a device.
fn refuse_output(inputs: &[PathBuf], output: &Path) -> Result<(), BakeError> {
    let Ok(existing) = std::fs::canonicalize(output) else { return Ok(()) };
    for input in inputs {
        if std::fs::canonicalize(input).is_ok_and(|input| input == existing) {
            return Err(BakeError::OutputIsInput { path: output.to_owned() });
        }
    }
    atomic::refuse_special(output)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn bake(inputs: &[PathBuf], output: &Path, options: &Options) -> Result<Outcome, BakeError> {
        bake_files(inputs, output, options, &FileOptions::default(), &Progress::default(), &mut |_| ())
    }

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_is_up_to_date_is_left_alone() {
        let directory = tempfile::tempdir().unwrap();
        let input = directory.path().join("in.obj");
        let output = directory.path().join("out.cbvh");
        fs::write(&input, TRIANGLE).unwrap();
        let inputs = [input.clone()];
        let options = Options::default();
        let skipped = |options: &Options| match bake(&inputs, &output, options).unwrap() {
            Outcome::UpToDate(_) => true,
            Outcome::Baked(_) => false,
        };
        assert!(!skipped(&options));
        assert!(skipped(&options));
        let other = Options { ids: false, ..Options::default() };
        assert!(!skipped(&other));
        assert!(skipped(&other));
        fs::write(&input, format!("{TRIANGLE}v 5 5 5\n")).unwrap();
        assert!(!skipped(&other));
        let mut damaged = fs::read(&output).unwrap();
        let last = damaged.len() - 1;
        damaged[last / 2] ^= 1;
        fs::write(&output, &damaged).unwrap();
        assert!(!skipped(&other), "a damaged output is no output");
        assert_eq!(names(directory.path()), ["in.obj", "out.cbvh"]);
    }

    #[test]
    fn ids_run_on_over_files() {
        let directory = tempfile::tempdir().unwrap();
        let inputs = ["a.obj", "b.obj"].map(|name| directory.path().join(name));
        inputs.iter().for_each(|input| fs::write(input, TRIANGLE).unwrap());
        let mesh = read_meshes(&inputs).unwrap();
        assert_eq!(mesh.objects.len(), 2);
        assert_eq!(mesh.objects[1].triangle_ids, [1]);
        assert_eq!(mesh.check(), Ok(()));
    }

    #[test]
    fn an_input_is_never_the_output() {
        let directory = tempfile::tempdir().unwrap();
        let input = directory.path().join("in.obj");
        fs::write(&input, TRIANGLE).unwrap();
        let output = directory.path().join(".").join("in.obj");
        let refused = bake(std::slice::from_ref(&input), &output, &Options::default());
        assert!(matches!(refused, Err(BakeError::OutputIsInput { .. })), "{refused:?}");
        let refused = bake(std::slice::from_ref(&input), directory.path(), &Options::default());
        assert!(matches!(refused, Err(BakeError::Write { .. })), "{refused:?}");
        assert_eq!(fs::read_to_string(&input).unwrap(), TRIANGLE);
        assert_eq!(names(directory.path()), ["in.obj"]);
    }

    #[test]
    fn a_small_budget_is_refused_before_the_work() {
        let directory = tempfile::tempdir().unwrap();
        let input = directory.path().join("in.obj");
        fs::write(&input, TRIANGLE).unwrap();
        let output = directory.path().join("out.cbvh");
        for budget in [0, 10, least_memory(1) - 1] {
            let options = FileOptions { max_memory: Some(budget), ..FileOptions::default() };
            let inputs = std::slice::from_ref(&input);
            let (how, progress) = (Options::default(), Progress::default());
            let refused = bake_files(inputs, &output, &how, &options, &progress, &mut |_| ());
            assert!(matches!(refused, Err(BakeError::Memory { .. })), "{refused:?}");
        }
        assert_eq!(names(directory.path()), ["in.obj"]);
    }
}
