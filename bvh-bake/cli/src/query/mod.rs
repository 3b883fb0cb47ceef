//! `cbvh query`: asks two meshes about files of poses, timing each query, or about one pose.

mod arguments;
mod cold;
mod once;
mod question;

pub(crate) use arguments::QueryArguments;

use crate::asking::files::read_all;
use crate::asking::mesh::{LoadedMesh, blame, is_baked, load_both};
use crate::asking::{self, Record, poses, runner};
use crate::console::Failure;
use arguments::Mode;
use bvh_query::{Backend, Pose, Querier};
use cold::Means;
use question::{Question, Run};
use serde::Serialize;

/// The JSON line: that of all commands that ask, and what files evicted from the page cache cost.
#[derive(Serialize)]
struct QueryRecord {
    #[serde(flatten)]
    record: Record,
    #[serde(flatten)]
    cold: Option<Means>,
}

/// Answers the question about pose files or about one pose.
pub(crate) fn run(arguments: &QueryArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.asking.isa)?;
    let question = Question::new(arguments)?;
    if let Some(pose) = &arguments.pose {
        let pose = poses::parse_one(pose)?;
        let [a, b] = &meshes(arguments)?;
        let querier = Querier::with_backend(backend);
        return once::answer([a, b], &pose, &question, querier, arguments.witness.as_deref());
    }
    let files = read_all(arguments.poses.as_deref(), "pose files", &arguments.asking, poses::read)?;
    if arguments.cold {
        return run_cold(arguments, &question, backend, &files);
    }
    let [mut a, mut b] = meshes(arguments)?;
    a.check()?;
    b.check()?;
    for (stem, poses) in &files {
        let ask = |querier: &mut Querier, pose: &Pose| question.ask(querier, [&a, &b], pose);
        let run = runner::run(poses, ask, backend, &arguments.asking.limits());
        let run = run.map_err(|error| blame(&a, Some(&b), error))?;
        tell(arguments, [&a, &b], &question, backend, stem, &run, None)?;
    }
    Ok(())
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
        let (run, means) =
            cold::run(paths, &arguments.asking.how(), poses, question, backend, arguments.asking.budget)?;
        // The files are opened only now, because the system does not evict what a process has mapped.
        let [a, b] = &meshes(arguments)?;
        tell(arguments, [a, b], question, backend, stem, &run, Some(means))?;
    }
    Ok(())
}

/// Writes and prints the answers about a pose file.
fn tell(
    arguments: &QueryArguments,
    [a, b]: [&LoadedMesh; 2],
    question: &Question,
    backend: Backend,
    stem: &str,
    run: &Run,
    cold: Option<Means>,
) -> Result<(), Failure> {
    let mut record = Record::new(a, Some(b), question.mode.name(), backend, stem, run);
    if !question.is_exact() {
        record.answers_xxh3 = None;
    }
    let what = match question.mode {
        Mode::Within => "within the distance",
        Mode::Relation => "touching or inside",
        _ => "touching",
    };
    let record = QueryRecord { record, cold };
    asking::tell(&arguments.asking, stem, run, &record, || {
        let counts = format!("{} {what}", record.record.positives);
        record.record.listing(run, "pose", &counts, |answer| question.in_words(answer))
    })
}

fn meshes(arguments: &QueryArguments) -> Result<[LoadedMesh; 2], Failure> {
    load_both(&arguments.a, &arguments.b, &arguments.asking.how())
}
