//! Writes a report into four files that hold the same figures, and tells of it in a few lines.

use super::document::Report;
use super::kind::Kind;
use super::page;
use crate::console::{self, Failure, plural};
use cbvh_measure::plot::Figure;
use cbvh_measure::{plot, table};
use std::path::Path;

/// Makes the folder to write to.
pub(super) fn make_folder(out: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(out).map_err(|error| {
        Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()))
    })
}

/// Writes the four files, and prints a summary. Wrong answers are a failure, of which the files tell.
pub(super) fn write<K: Kind>(report: &Report<K>, out: &Path) -> Result<(), Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::System(format!("{}: {error}", out.display()));
    let figures: Vec<Figure> = report.pairs.iter().map(|pair| K::figure(report, &pair.name)).collect();
    for (name, text) in [
        ("report.csv", table::csv(&report.rows)),
        ("report.json", table::json(report).map_err(|error| failed(&error))?),
        ("report.svg", plot::svg(&figures).map_err(|error| failed(&error))?),
        ("report.html", page::page(report).map_err(|error| failed(&error))?),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    console::text(&summary(report, &out.join("report.html")))?;
    match report.wrong.first() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("report.json"),
            format!("expected right answers, found {} wrong; the first: {first}", report.wrong.len()),
        )),
    }
}

/// A few lines for the terminal.
fn summary<K: Kind>(report: &Report<K>, page: &Path) -> String {
    let Report { pairs, rows, wrong, .. } = report;
    let counted = |count: usize, word| format!("{count} {}", plural(count as u64, word));
    let mut text = format!(
        "{}: {}, {}, {}\n",
        page.display(),
        counted(pairs.len(), "pair"),
        counted(rows.len(), "row"),
        counted(wrong.len(), "wrong answer")
    );
    for pair in pairs {
        for line in K::sentences(report, pair) {
            text.push_str(&format!("  {}: {line}\n", pair.name));
        }
    }
    text
}
