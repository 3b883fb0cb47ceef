//! `cbvh query`: asks two meshes about poses, timed like the peers of the benchmark kit, or about one pose.

mod cold;
pub(crate) mod number;
mod once;
pub(crate) mod poses;
pub(crate) mod record;
mod runner;
pub(crate) mod side;

use crate::arguments::{Mode, QueryArguments};
use crate::error::Failure;
use crate::output;
use bvh_query::{Backend, Bvh, DistanceOptions, Pose, Querier, QueryError, QueryStats, Shape};
use record::Record;
use runner::{Answer, Limits, Run};
use side::{How, Side, is_baked};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

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
    let files: Vec<PathBuf> = files.split(',').filter(|name| !name.is_empty()).map(PathBuf::from).collect();
    if files.is_empty() {
        return Err(Failure::Usage("expected pose files, found none (see --help)".into()));
    }
    if files.len() > 1 && arguments.out.as_ref().is_some_and(|out| !out.contains("%s")) {
        return Err(Failure::Usage(
            "--out: expected %s in the name for several pose files (see --help)".into(),
        ));
    }
    // A mistake in the last file is told before the first is asked.
    let mut all = Vec::new();
    for file in files {
        let mut poses = poses::read(&file)?;
        if arguments.limit > 0 {
            poses.truncate(arguments.limit);
        }
        all.push((stem(&file), poses));
    }
    if arguments.cold {
        for path in [&arguments.a, &arguments.b] {
            if !is_baked(path)? {
                let path = path.display();
                return Err(Failure::Usage(format!(
                    "--cold: expected .cbvh files, found {path} (see --help)"
                )));
            }
        }
    }
    if arguments.cold {
        let paths = [&*arguments.a, &*arguments.b];
        for (stem, poses) in &all {
            let (run, means) = cold::run(paths, &how(arguments), poses, question, backend, arguments.budget)?;
            // Open only now: what a process maps the system does not forget.
            let (a, b) = sides(arguments)?;
            tell(
                arguments,
                &Record::new(&Sides { a: &a, b: &b }, question, backend, stem, &run, Some(means)),
                &run,
            )?;
        }
        return Ok(());
    }
    let (mut a, mut b) = sides(arguments)?;
    a.check()?;
    b.check()?;
    let sides = Sides { a: &a, b: &b };
    let limits = Limits { jobs: usize::from(arguments.jobs), warm: arguments.warm, budget: arguments.budget };
    for (stem, poses) in &all {
        let run = runner::run(&sides, poses, question, backend, &limits).map_err(|e| sides.blame(e))?;
        tell(arguments, &Record::new(&sides, question, backend, stem, &run, None), &run)?;
    }
    Ok(())
}

/// Writes the raw answers of a pose file, if asked to, and then its line.
fn tell(arguments: &QueryArguments, record: &Record, run: &Run) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        let path = PathBuf::from(out.replacen("%s", record.poses(), 1));
        let raw = record::raw(&run.answers);
        bvh_bake::write_atomically(&path, raw.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    output::json(record)
}

/// The backend of `--isa`; what it does not decide, `CBVH_ISA` may.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// A file's name without directories and what follows its last dot.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// How both sides are made ready.
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
            "--object: expected an object of this name in {} or {}, found none named {name:?}",
            arguments.a.display(),
            arguments.b.display()
        )));
    }
    Ok((a, b))
}

/// Both sides of a query.
#[derive(Clone, Copy)]
pub(crate) struct Sides<'a> {
    pub(crate) a: &'a Side,
    pub(crate) b: &'a Side,
}

impl<'a> Sides<'a> {
    fn shapes(&self) -> (Shape<'a>, Shape<'a>) {
        (self.a.shape(), self.b.shape())
    }

    /// An error of a query as one of the file that it is about.
    fn blame(&self, error: QueryError) -> Failure {
        match error {
            QueryError::Backend(error) => error.into(),
            QueryError::Budget { .. } => Failure::Limit(error.to_string()),
            QueryError::Damaged(breach) => {
                // The error does not say which file; the one that is not valid is it.
                let damaged = |bvh: &Bvh| bvh_format::validate::validate(bvh.bytes()).is_err();
                let side = if damaged(&self.a.bvh) { self.a } else { self.b };
                Failure::invalid(&side.path, breach)
            }
        }
    }
}

/// What is asked about every pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Question {
    pub(crate) mode: Mode,
    /// For `Mode::Within`.
    pub(crate) within: f64,
    pub(crate) errors: DistanceOptions,
}

impl Question {
    fn new(arguments: &QueryArguments) -> Result<Self, Failure> {
        let mode = arguments.mode;
        let wrong = |text: &str| Err(Failure::Usage(format!("{text} (see --help)")));
        if arguments.within.is_some() != (mode == Mode::Within) {
            return wrong("--within D and --mode within go together only");
        }
        if (arguments.rel_err.is_some() || arguments.abs_err.is_some()) && mode != Mode::Distance {
            return wrong("--rel-err and --abs-err go with --mode distance only");
        }
        // Not left to the parser: where --pose is excluded by pose files, it waives what requires it.
        if arguments.witness.is_some() && (arguments.pose.is_none() || mode != Mode::Distance) {
            return wrong("--witness goes with --pose and --mode distance only");
        }
        let errors = DistanceOptions {
            rel_err: arguments.rel_err.unwrap_or(0.0),
            abs_err: arguments.abs_err.unwrap_or(0.0),
        };
        Ok(Self { mode, within: arguments.within.unwrap_or(0.0), errors })
    }

    /// True if the answer is the same on every backend and with every number of threads.
    fn is_exact(&self) -> bool {
        self.errors == DistanceOptions::default()
    }

    /// Asks it.
    #[inline]
    fn ask(&self, querier: &mut Querier, sides: &Sides<'_>, pose: &Pose) -> Result<Answer, QueryError> {
        let (a, b) = sides.shapes();
        Ok(match self.mode {
            Mode::Collide => Answer::Flag(querier.collide(a, b, pose)?),
            Mode::Contacts => {
                Answer::Count(querier.visit_contacts(a, b, pose, |_| ControlFlow::Continue(()))?)
            }
            Mode::Distance => Answer::Length(querier.distance_with(a, b, pose, &self.errors)?.distance),
            Mode::Within => Answer::Flag(querier.within(a, b, pose, self.within)?),
        })
    }
}

/// Adds what one query did to what others did.
pub(crate) fn add(sum: &mut QueryStats, stats: QueryStats) {
    sum.node_tests += stats.node_tests;
    sum.packet_tests += stats.packet_tests;
    sum.exact_tests += stats.exact_tests;
}
