//! From mesh files to a `.cbvh` file: read, bake, write whole or not at all, and not twice.
//!
//! An output is up to date if a bake would give the same content: it is undamaged, of this version of
//! the format and the baker, of the same options, and of inputs with the same bytes. All that is noted
//! in its provenance section, so nothing else is kept beside it.

mod atomic;
mod provenance;

pub use atomic::write_atomically;

use crate::bake::{Stage, to_bytes_with};
use crate::error::BakeError;
use crate::io::{self, MeshFormat, ReadError};
use crate::mesh::Mesh;
use crate::options::Options;
use crate::report::BakeReport;
use crate::summary::FileSummary;
use atomic::Temporary;
use bvh_format::checksum::{Hasher, checksum};
use provenance::Provenance;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How to go about files; how to bake is said by [`Options`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileOptions {
    /// Bake even if the output is up to date.
    pub force: bool,
    /// The most memory that a bake may be expected to need, in bytes; `None` for no limit.
    pub max_memory: Option<u64>,
}

/// A step of [`bake_files`], for those who show progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Reading inputs and looking at what the output already is.
    Read,
    /// A stage of the bake.
    Bake(Stage),
    /// Writing the output.
    Write,
}

impl Step {
    /// The step's name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "reading",
            Self::Bake(stage) => stage.name(),
            Self::Write => "writing",
        }
    }
}

/// What came of [`bake_files`].
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The output has been written.
    Baked(Box<BakeReport>),
    /// The output was up to date and has been left alone; what it says of itself.
    UpToDate(FileSummary),
}

/// Bytes of memory a triangle at the peak of a bake, less the input files' bytes. Measured as peak resident
/// size on x86-64 Linux, 2026-11-21: 158 to 223 over profiles and encodings on a sphere of 5.0 million
/// triangles, 203 to 263 where no two triangles share a vertex.
const BYTES_A_TRIANGLE: u64 = 300;
/// Bytes that any bake needs: the program, its threads and what is allocated page by page.
const BYTES_AT_LEAST: u64 = 8 << 20;

/// Bytes of memory that baking a mesh of so many triangles is expected to need at most, its input files of
/// `input_bytes` bytes included.
pub fn estimate_memory(triangles: u64, input_bytes: u64) -> u64 {
    triangles.saturating_mul(BYTES_A_TRIANGLE).saturating_add(input_bytes).saturating_add(BYTES_AT_LEAST)
}

/// Bakes mesh files into one `.cbvh` file.
///
/// Several inputs are baked as if they were one: their objects follow each other, and triangle ids run
/// on from each file to the next. The output appears whole under its name or not at all: it is written
/// beside it, synchronised and renamed. What was there before stays until then.
///
/// Cost: that of [`crate::to_bytes`], and reading all inputs. If the output is up to date, reading
/// inputs and output.
///
/// # Errors
/// [`BakeError::Read`] if an input cannot be read or is wrong; [`BakeError::OutputIsInput`];
/// [`BakeError::Memory`] if the budget is too small; [`BakeError::Write`] if the system refuses the
/// output; and those of [`crate::to_bytes`]. After any of them the output is as it was.
pub fn bake_files(
    inputs: &[PathBuf],
    output: &Path,
    options: &Options,
    file_options: &FileOptions,
    progress: &mut dyn FnMut(Step),
) -> Result<Outcome, BakeError> {
    progress(Step::Read);
    refuse_output(inputs, output)?;
    let input_bytes = file_lengths(inputs);
    let within = |triangles: u64| {
        let needed = estimate_memory(triangles, input_bytes);
        match file_options.max_memory {
            Some(budget) if needed > budget => {
                let input = inputs.first().cloned().unwrap_or_default();
                Err(BakeError::Memory { input, triangles, needed, budget })
            }
            _ => Ok(()),
        }
    };
    // What certainly does not fit is not even read.
    within(0)?;
    let mut sources = Sources::default();
    let mut provenance = Provenance::new(inputs, options);
    for input in inputs {
        sources.add(input)?;
    }
    provenance.checksums(&sources.file_checksums, &sources.mesh_checksums);
    if !file_options.force
        && let Some(summary) = provenance::up_to_date(output, &provenance)
    {
        return Ok(Outcome::UpToDate(summary));
    }
    let mut mesh = sources.into_mesh()?;
    let parsed = Instant::now();
    within(mesh.triangle_count())?;
    // Fails before the work, where the output cannot be written.
    drop(Temporary::beside(output)?);
    if !options.split_objects {
        mesh = mesh.merged();
    }
    let mut stage = |stage| progress(Step::Bake(stage));
    let (bytes, mut report) = to_bytes_with(&mesh, options, &provenance.to_text(), &mut stage)?;
    drop(mesh);
    progress(Step::Write);
    write_atomically(output, &bytes)?;
    report.seconds = parsed.elapsed().as_secs_f64();
    Ok(Outcome::Baked(Box::new(report)))
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
#[derive(Default)]
struct Sources {
    files: Vec<Source>,
    file_checksums: Vec<u64>,
    mesh_checksums: Vec<u64>,
}

enum Source {
    Bytes(PathBuf, Vec<u8>, MeshFormat),
    Mesh(Mesh),
}

impl Sources {
    fn add(&mut self, input: &Path) -> Result<(), BakeError> {
        let failed = |source| ReadError::Io { path: input.to_owned(), source };
        let bytes = std::fs::read(input).map_err(failed)?;
        self.file_checksums.push(checksum(&bytes));
        let format = MeshFormat::from_extension(input).or_else(|| MeshFormat::from_content(&bytes));
        self.files.push(match format {
            // A glTF file may name others, which its own bytes say nothing of: what is read counts.
            Some(MeshFormat::Gltf) => {
                let mesh = io::read_bytes(&bytes, MeshFormat::Gltf, input)?;
                self.mesh_checksums.push(mesh_checksum(&mesh));
                Source::Mesh(mesh)
            }
            Some(format) => Source::Bytes(input.to_owned(), bytes, format),
            // Of no known format: the reader says so.
            None => Source::Mesh(io::read(input)?),
        });
        Ok(())
    }

    fn into_mesh(self) -> Result<Mesh, BakeError> {
        let mut joined = Mesh::default();
        for source in self.files {
            let mesh = match source {
                Source::Bytes(input, bytes, format) => io::read_bytes(&bytes, format, &input)?,
                Source::Mesh(mesh) => mesh,
            };
            append(&mut joined, mesh)?;
        }
        Ok(joined)
    }
}

/// A checksum of all that a bake takes from a mesh.
fn mesh_checksum(mesh: &Mesh) -> u64 {
    let mut hasher = Hasher::default();
    for object in &mesh.objects {
        let lengths = [object.name.len(), object.positions.len(), object.triangles.len()];
        lengths.iter().for_each(|&length| hasher.update(&(length as u64).to_le_bytes()));
        hasher.update(object.name.as_bytes());
        object.positions.iter().flatten().for_each(|value| hasher.update(&value.to_le_bytes()));
        object.triangles.iter().flatten().for_each(|index| hasher.update(&index.to_le_bytes()));
    }
    hasher.finish()
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
        bake_files(inputs, output, options, &FileOptions::default(), &mut |_| ())
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
        for budget in [0, 10, estimate_memory(1, TRIANGLE.len() as u64) - 1] {
            let options = FileOptions { max_memory: Some(budget), ..FileOptions::default() };
            let inputs = std::slice::from_ref(&input);
            let refused = bake_files(inputs, &output, &Options::default(), &options, &mut |_| ());
            assert!(matches!(refused, Err(BakeError::Memory { .. })), "{refused:?}");
        }
        assert_eq!(names(directory.path()), ["in.obj"]);
    }
}
