//! The report on scaling: one shape in many sizes, then batches and paths; judges; writes four files.

mod ball;
mod batch;
mod figure;
mod growth;
mod page;
mod path;
mod record;
mod row;
mod sizes;

use super::{json, pin, row as cells};
use crate::arguments::ReportArguments;
use crate::bake::spinner;
use crate::error::Failure;
use crate::{output, query};
use bvh_query::QueryError;
use record::{Record, Settings};
use row::Row;

/// Batches and paths are about the largest ball of at most so many triangles, or a little more.
const MIDDLE: u64 = 300_000;

/// What came of a part: figures, and answers that do not agree.
#[derive(Default)]
struct Measured {
    rows: Vec<Row>,
    wrong: Vec<String>,
}

pub(super) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    let backend = query::backend(&arguments.isa)?;
    std::fs::create_dir_all(out).map_err(|error| {
        Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()))
    })?;
    let settings = Settings::new(arguments, backend);
    let spinner = spinner(false);
    let failed = |error: QueryError| Failure::Invalid(format!("ball: {error}"));
    let mut sizes = Vec::new();
    for target in sizes::targets(arguments.largest) {
        spinner.set_message(format!("baking {target} triangles"));
        sizes.push(sizes::Size::new(target, backend, settings.poses)?);
    }
    let targets = sizes::targets(arguments.largest);
    let middle = targets.iter().rposition(|&target| target <= MIDDLE).unwrap_or(0);
    spinner.set_message("measuring");
    // A thread of its own is bound to one processor; batches go on using several.
    let (pinned, by_size, paths) = std::thread::scope(|scope| {
        let work = || {
            let pinned = pin::pin();
            let by_size = sizes::measure(&sizes, backend, settings.rounds)?;
            let paths = path::measure(&sizes[middle], backend, &settings)?;
            Ok((pinned, by_size, paths))
        };
        scope.spawn(work).join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
    .map_err(failed)?;
    spinner.set_message("measuring batches");
    let batches = batch::measure(&sizes[middle], backend, settings.rounds)?;
    spinner.finish_and_clear();
    let mut record = Record::new(settings, pinned);
    for part in [growth::with_slopes(by_size), batches, paths] {
        record.rows.extend(part.rows);
        record.wrong.extend(part.wrong);
    }
    for (name, text) in [
        ("scaling.csv", cells::lines(record.rows.iter().map(Row::cells))),
        ("scaling.json", json::text(&record)?),
        ("scaling.svg", super::plot::stacked(&[figure::figures(&record.rows)])),
        ("scaling.html", page::page(&record)),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    output::text(&record.summary(&out.join("scaling.html")))?;
    match record.wrong.first() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("scaling.json"),
            format!(
                "expected answers that agree, found {} that do not; the first: {first}",
                record.wrong.len()
            ),
        )),
    }
}
