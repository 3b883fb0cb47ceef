//! `cbvh report`: which layout suits these meshes, how fast it answers, and with what error.
//!
//! Each pair is baked in every profile with every encoding of triangles, asked in all its poses, and judged. The rows go
//! into four files that hold the same figures: a table, JSON, a drawing and a page for people.

mod answers;
mod arguments;
mod best;
mod document;
mod figure;
mod layout;
mod measured;
mod page;
mod pareto;
mod row;
mod source;

pub(crate) use arguments::ReportArguments;

use crate::console::{self, Failure, spinner};
use crate::query::{self, poses};
use bvh_query::Pose;
use cbvh_measure::pairs::{self, Pair};
use cbvh_measure::rounds::Question;
use cbvh_measure::{plot, table};
use document::{Report, Settings};
use measured::Subject;
use std::path::{Path, PathBuf};

/// What is asked: contact, the exact distance, and distances with an allowed relative error.
const QUESTIONS: [Question; 5] = [
    Question::Collide,
    Question::Distance(0.0),
    Question::Distance(1e-3),
    Question::Distance(1e-2),
    Question::Distance(1e-1),
];
/// The index of the exact distance in `QUESTIONS`.
const EXACT_DISTANCE: usize = 1;

pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    let backend = query::backend(&arguments.isa)?;
    let pairs = read_pairs(arguments)?;
    // Everything is read before the first pair is measured, so that an error in the last one shows at once.
    let given = pairs.iter().map(|pair| read_poses(&pair.poses)).collect::<Result<Vec<_>, _>>()?;
    let meshes = pairs.iter().map(|pair| Ok([source::mesh(&pair.a)?, source::mesh(&pair.b)?]));
    let meshes = meshes.collect::<Result<Vec<_>, Failure>>()?;
    std::fs::create_dir_all(out).map_err(|error| {
        Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()))
    })?;
    let spinner = spinner(false);
    let mut report = Report::new(Settings::new(arguments, backend));
    for ((pair, given), meshes) in pairs.iter().zip(given).zip(&meshes) {
        let tell = |what: &str| spinner.set_message(format!("{}: {what}", pair.name));
        let subject = Subject { pair, settings: &report.settings, backend, tell: &tell };
        let measured = subject.measure(meshes, given)?;
        report.add(measured);
    }
    spinner.finish_and_clear();
    let failed = |error: &dyn std::fmt::Display| Failure::System(format!("{}: {error}", out.display()));
    for (name, text) in [
        ("report.csv", table::csv(&report.rows)),
        ("report.json", table::json(&report).map_err(|error| failed(&error))?),
        ("report.svg", plot::svg(&figure::of_all_pairs(&report)).map_err(|error| failed(&error))?),
        ("report.html", page::page(&report).map_err(|error| failed(&error))?),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    console::text(&summary(&report, &out.join("report.html")))?;
    match report.wrong.first() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("report.json"),
            format!("expected right answers, found {} wrong; the first: {first}", report.wrong.len()),
        )),
    }
}

fn read_pairs(arguments: &ReportArguments) -> Result<Vec<Pair>, Failure> {
    let list: &Path = &arguments.pairs;
    let bytes = std::fs::read(list).map_err(|error| Failure::from_input(list, &error))?;
    let pairs = pairs::parse(&bytes, list, arguments.meshes.as_deref(), arguments.poses.as_deref());
    pairs.map_err(|error| Failure::invalid(list, error))
}

fn read_poses(files: &[PathBuf]) -> Result<Vec<Pose>, Failure> {
    let mut all = Vec::new();
    for file in files {
        let read = poses::read(file)?;
        if read.is_empty() {
            return Err(Failure::invalid(file, "expected poses, found none"));
        }
        all.extend(read);
    }
    Ok(all)
}

/// A few lines for the terminal.
fn summary(report: &Report, page: &Path) -> String {
    let Report { pairs, rows, wrong, .. } = report;
    let (page, pairs_count, rows) = (page.display(), pairs.len(), rows.len());
    let mut text = format!("{page}: {pairs_count} pairs, {rows} rows, {} wrong answers\n", wrong.len());
    for pair in pairs {
        for line in best::sentences(report, pair) {
            text.push_str(&format!("  {}: {line}\n", pair.name));
        }
    }
    text
}
