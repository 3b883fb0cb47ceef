//! `cbvh query`: asks two meshes about files of poses, timing each query, or about one pose.

mod arguments;
mod cold;
pub(crate) mod listing;
pub(crate) mod number;
pub(crate) mod once;
pub(crate) mod poses;
mod question;
pub(crate) mod record;
pub(crate) mod runner;
pub(crate) mod side;

pub(crate) use arguments::QueryArguments;

use crate::console::{self, Failure};
use bvh_query::{Backend, Pose, Querier};
use question::{Question, Run};
use record::Record;
use runner::Limits;
use side::{How, Side, Sides, is_baked};
use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};

/// Answers the question about pose files or about one pose.
pub(crate) fn run(arguments: &QueryArguments) -> Result<(), Failure> {
    let backend = backend(&arguments.isa)?;
    let question = Question::new(arguments)?;
    match (&arguments.pose, &arguments.poses) {
        (Some(pose), _) => {
            let pose = poses::parse_one(pose)?;
            let (a, b) = sides(arguments)?;
            let sides = Sides { a: &a, b: &b };
            once::answer(
                &sides,
                &pose,
                &question,
                Querier::with_backend(backend),
                arguments.witness.as_deref(),
            )
        }
        (None, Some(files)) => run_files(arguments, &question, backend, files),
        (None, None) => Err(Failure::Usage("expected pose files or --pose (see --help)".into())),
    }
}

fn run_files(
    arguments: &QueryArguments,
    question: &Question,
    backend: Backend,
    files: &str,
) -> Result<(), Failure> {
    let files = read_files(arguments, files)?;
    if arguments.cold {
        return run_cold(arguments, question, backend, &files);
    }
    let (mut a, mut b) = sides(arguments)?;
    a.check()?;
    b.check()?;
    let sides = Sides { a: &a, b: &b };
    let limits = Limits { jobs: usize::from(arguments.jobs), warm: arguments.warm, budget: arguments.budget };
    for (stem, poses) in &files {
        let ask = |querier: &mut Querier, pose: &Pose| question.ask(querier, &sides, pose);
        let run = runner::run(poses, ask, backend, &limits).map_err(|e| sides.blame(e))?;
        tell(arguments, question, &Record::of_poses(&sides, question, backend, stem, &run, None), &run)?;
    }
    Ok(())
}

/// Reads all pose files, so that a mistake in the last one is told before the first one is asked about.
fn read_files(arguments: &QueryArguments, files: &str) -> Result<Vec<(String, Vec<Pose>)>, Failure> {
    let files: Vec<PathBuf> = files.split(',').filter(|name| !name.is_empty()).map(PathBuf::from).collect();
    if files.is_empty() {
        return Err(Failure::Usage("expected pose files, found none (see --help)".into()));
    }
    if files.len() > 1 && arguments.out.as_ref().is_some_and(|out| !out.contains("%s")) {
        return Err(Failure::Usage(
            "--out: expected %s in the name, because there are several pose files (see --help)".into(),
        ));
    }
    let read = |file: PathBuf| {
        let mut poses = poses::read(&file)?;
        if poses.is_empty() {
            return Err(Failure::invalid(&file, poses::NONE));
        }
        if arguments.limit > 0 {
            poses.truncate(arguments.limit);
        }
        Ok((stem(&file), poses))
    };
    files.into_iter().map(read).collect()
}

/// Times queries of files that are evicted from the page cache before each query.
fn run_cold(
    arguments: &QueryArguments,
    question: &Question,
    backend: Backend,
    files: &[(String, Vec<Pose>)],
) -> Result<(), Failure> {
    let paths = [&*arguments.a, &*arguments.b];
    for path in paths {
        if !is_baked(path)? {
            let path = path.display();
            return Err(Failure::Usage(format!(
                "--cold: expected .cbvh files, found {path}; bake it first (see --help)"
            )));
        }
    }
    for (stem, poses) in files {
        let (run, means) = cold::run(paths, &how(arguments), poses, question, backend, arguments.budget)?;
        // The files are opened only now, because the system does not evict what a process has mapped.
        let (a, b) = sides(arguments)?;
        let sides = Sides { a: &a, b: &b };
        tell(
            arguments,
            question,
            &Record::of_poses(&sides, question, backend, stem, &run, Some(means)),
            &run,
        )?;
    }
    Ok(())
}

/// Writes the raw answers about a pose file, if asked to, and prints the answers for a person or the JSON line.
fn tell(arguments: &QueryArguments, question: &Question, record: &Record, run: &Run) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        write_file(Path::new(&out.replacen("%s", record.poses(), 1)), &record::raw(&run.answers))?;
    }
    if arguments.json || !stdout().is_terminal() {
        console::json(record)
    } else {
        console::text(&listing::listing(record, question, run))
    }
}

/// Writes a text file whole or not at all.
pub(crate) fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    let written = bvh_bake::write_atomically(path, text.as_bytes());
    written.map_err(|error| Failure::from_bake(&path.display().to_string(), &error))
}

/// Returns the backend of `--isa`. `auto` leaves the choice to `CBVH_ISA` or to the CPU.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// Returns the name of a file without its folders and its extension.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns how both sides are prepared.
fn how(arguments: &QueryArguments) -> How<'_> {
    let (layout, object) = (&arguments.layout, arguments.object.as_deref());
    How { layout, object, read_ahead: arguments.read_ahead.into() }
}

fn sides(arguments: &QueryArguments) -> Result<(Side, Side), Failure> {
    let how = how(arguments);
    let (a, b) = (Side::load(&arguments.a, &how)?, Side::load(&arguments.b, &how)?);
    if let Some(name) = &arguments.object
        && a.object.is_none()
        && b.object.is_none()
    {
        return Err(Failure::Usage(format!(
            "--object: expected an object of this name in {} or {}, found none named {name:?}; cbvh dump lists the \
             objects of a file",
            arguments.a.display(),
            arguments.b.display()
        )));
    }
    Ok((a, b))
}
