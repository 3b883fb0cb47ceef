//! Scaling: measures one shape in many sizes, then batches and paths, judges the answers, and writes four files.

mod batch;
mod figure;
mod growth;
mod markdown;
mod path;
mod record;
mod row;
mod sizes;

use crate::arguments::ScalingArguments;
use crate::{Failure, output};
use bvh_query::Backend;
use cbvh_measure::pin::pinned;
use cbvh_measure::{plot, table};
use record::{Record, Settings};
use row::Row;
use sizes::Size;

/// Batches and paths use the largest ball with at most about this many triangles.
const MAX_BATCH_TRIANGLES: u64 = 300_000;

/// The results of a part: rows, and answers that do not agree.
#[derive(Default)]
struct Measured {
    rows: Vec<Row>,
    wrong: Vec<String>,
}

pub(crate) fn run(arguments: &ScalingArguments) -> Result<String, Failure> {
    let out = &arguments.out;
    let backend = arguments.isa.map_or_else(Backend::detect, Ok)?;
    output::make_folder(out)?;
    let settings = Settings::new(arguments, backend);
    let targets = sizes::targets(arguments.largest);
    let middle = targets.iter().rposition(|&target| target <= MAX_BATCH_TRIANGLES).unwrap_or(0);
    let bake = |&target| {
        output::tell(&format!("baking {target} triangles"));
        Size::both(target, backend, settings.poses)
    };
    let both = targets.iter().map(bake).collect::<Result<Vec<_>, _>>()?;
    let (with, without): (Vec<_>, Vec<_>) = both.into_iter().map(|[with, without]| (with, without)).unzip();
    // Those with turning slabs come first, so that `middle` is one of them.
    let sizes: Vec<Size> = with.into_iter().chain(without).collect();
    output::tell("measuring");
    // Batches go on using several processors.
    let (pinned, results) = pinned(|| {
        let by_size = sizes::measure(&sizes, backend, settings.rounds)?;
        Ok::<_, Failure>((by_size, path::measure(&sizes[middle], backend, &settings)?))
    });
    let (by_size, paths) = results?;
    let batches = batch::measure(&sizes[middle], backend, settings.rounds)?;
    let mut record = Record::new(settings, pinned);
    for part in [growth::with_slopes(by_size), batches, paths] {
        record.rows.extend(part.rows);
        record.wrong.extend(part.wrong);
    }
    let svg = plot::svg(&[figure::figure(&record.rows)]);
    let files = [
        ("scaling.csv", table::csv(&record.rows)),
        ("scaling.json", output::json(&record)?),
        ("scaling.svg", svg),
        ("scaling.md", markdown::page(&record)),
    ];
    output::write(out, &files)?;
    match record.wrong.first() {
        None => Ok(record.summary(&out.join("scaling.md"))),
        Some(first) => {
            let (path, wrong) = (out.join("scaling.json"), record.wrong.len());
            Err(format!("{}: {wrong} answers do not agree; the first: {first}", path.display()).into())
        }
    }
}
