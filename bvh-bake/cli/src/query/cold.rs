//! Times queries of files evicted from the page cache.

use super::question::{Answer, Question, Run};
use crate::asking::mesh::{How, LoadedMesh, blame};
use crate::console::Failure;
use crate::process::from_disk::{self, FromDisk};
use bvh_query::{Backend, Pose, Querier, QueryStats};
use cbvh_measure::rounds::add;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// The means over all queries that the JSON line has in addition.
#[derive(Serialize)]
pub(super) struct Means {
    cold: bool,
    open_ns_mean: Option<f64>,
    disk_faults_mean: Option<f64>,
    read_bytes_mean: Option<f64>,
    resident_bytes_mean: Option<f64>,
    touched_bytes_mean: Option<f64>,
}

/// Asks about the poses in order until `budget`, in seconds, is spent. Each time covers opening the files and the first
/// answer.
pub(super) fn run(
    paths: [&Path; 2],
    how: &How<'_>,
    poses: &[Pose],
    question: &Question,
    backend: Backend,
    budget: Option<f64>,
) -> Result<(Run, Means), Failure> {
    let mut querier = Querier::with_backend(backend);
    let mut found: Vec<FromDisk<Answer>> = Vec::new();
    let mut stats = QueryStats::default();
    let start = Instant::now();
    for pose in poses {
        let ask = |a: &LoadedMesh, b: &LoadedMesh| {
            question.ask(&mut querier, [a, b], pose).map_err(|error| blame(a, Some(b), error))
        };
        let Some(one) = from_disk::ask(paths, |path| LoadedMesh::open(path, how), ask)? else {
            let text = "--cold: this system cannot evict files from the page cache or count page faults";
            return Err(Failure::System(text.into()));
        };
        add(&mut stats, querier.stats());
        found.push(one);
        if budget.is_some_and(|budget| start.elapsed().as_secs_f64() > budget) {
            break;
        }
    }
    let mean = |of: fn(&FromDisk<Answer>) -> Option<u64>| {
        let sum = found.iter().map(of).sum::<Option<u64>>()?;
        (!found.is_empty()).then(|| sum as f64 / found.len() as f64)
    };
    let means = Means {
        cold: true,
        open_ns_mean: mean(|one| Some(one.open)),
        disk_faults_mean: mean(|one| Some(one.faults)),
        read_bytes_mean: mean(|one| one.read_bytes),
        resident_bytes_mean: mean(|one| one.resident_bytes),
        touched_bytes_mean: mean(|one| one.touched_bytes),
    };
    let run = Run {
        answers: found.iter().map(|one| (one.answer, one.total)).collect(),
        requested: poses.len(),
        jobs: 1,
        total_seconds: start.elapsed().as_secs_f64(),
        stats,
    };
    Ok((run, means))
}
