//! The tables of a pair, the fastest layout first. Each figure carries the value that `report.csv` has for it.

use super::escape;
use crate::report::best::{Candidate, ranked};
use crate::report::document::Report;
use crate::report::row::Row;
use cbvh_measure::rounds::Question;
use cbvh_measure::table::{Cell, Cells, micro};
use std::fmt::Write;

/// A column: its head, the question and the field of its figures, and how they are shown.
struct Column {
    head: &'static str,
    question: Question,
    field: &'static str,
    show: fn(f64) -> String,
}

/// Columns below a common head.
type Columns = (&'static str, Vec<Column>);

const CONTACT: Question = Question::Collide;
const DISTANCE: Question = Question::Distance(0.0);

fn column(head: &'static str, question: Question, field: &'static str, show: fn(f64) -> String) -> Column {
    Column { head, question, field, show }
}

/// Median and 90 % time of a question.
fn times(question: Question) -> Vec<Column> {
    vec![column("median", question, "ns_median", micro), column("90 %", question, "ns_p90", micro)]
}

/// Time and error of a distance with an allowed error.
fn allowed(head: &'static str, rel_err: f64) -> Columns {
    let question = Question::Distance(rel_err);
    let error = column("largest error", question, "distance_error_max", percent);
    (head, vec![column("\u{b5}s", question, "ns_median", micro), error])
}

/// Returns all tables of a pair.
pub(super) fn all(report: &Report, pair: &str) -> String {
    let rows: Vec<&Row> = report.of(pair).collect();
    let (lossless, lossy) = (ranked(report, pair, false), ranked(report, pair, true));
    let bytes = |field, head| column(head, CONTACT, field, tenths);
    let file = || ("bytes per triangle", vec![bytes("file_bytes_per_tri", "file")]);
    let speed = || vec![("contact, \u{b5}s", times(CONTACT)), ("distance, \u{b5}s", times(DISTANCE)), file()];
    let work = |question| {
        vec![
            column("node tests", question, "node_tests", tenths),
            column("packet tests", question, "packet_tests", tenths),
            column("exact tests", question, "exact_tests", tenths),
        ]
    };
    let mut text = String::new();
    let mut add = |title: &str, caption: &str, candidates: &[Candidate<'_>], columns: &[Columns]| {
        let _ = writeln!(text, "<h3>{title}</h3>\n<p>{caption}</p>");
        text += &table(&rows, candidates, columns);
    };
    add(
        "Layouts without loss",
        "Microseconds per query and bytes per triangle, the fastest layout first. The best figure of each column is \
         bold; a dot marks layouts that no other one beats in both time and bytes.",
        &lossless,
        &speed(),
    );
    let mut quantised = speed();
    quantised.push(("vertices moved by", vec![column("mesh units", CONTACT, "vertex_error", scientific)]));
    quantised.push((
        "relative error of the distance",
        vec![
            column("largest", DISTANCE, "distance_error_max", percent),
            column("median", DISTANCE, "distance_error_median", percent),
        ],
    ));
    add(
        "Layouts with quantised triangles",
        "The same for layouts that move vertices a little to save bytes, the fastest first.",
        &lossy,
        &quantised,
    );
    add(
        "Distance with an allowed error",
        "Median microseconds per query and the largest relative error found, for layouts without loss, in the order of \
         the first table. An answer may exceed the exact distance by the allowed error.",
        &lossless,
        &[allowed("exact", 0.0), allowed("0.1 %", 1e-3), allowed("1 %", 1e-2), allowed("10 %", 1e-1)],
    );
    add(
        "Where bytes and time go",
        "Bytes per triangle by part of the file; by how much bounding volumes are wider and larger than their \
         triangles need; and the mean work per query.",
        &lossless,
        &[
            (
                "bytes per triangle",
                vec![
                    bytes("node_bytes_per_tri", "nodes"),
                    bytes("triangle_bytes_per_tri", "triangles"),
                    bytes("id_bytes_per_tri", "ids"),
                ],
            ),
            (
                "bounds, excess",
                vec![
                    column("width", CONTACT, "width_inflation", excess),
                    column("volume", CONTACT, "volume_inflation", excess),
                ],
            ),
            ("contact, per query", work(CONTACT)),
            ("distance, per query", work(DISTANCE)),
        ],
    );
    text
}

fn table(rows: &[&Row], candidates: &[Candidate<'_>], groups: &[Columns]) -> String {
    let mut text = String::from("<div class=\"scroll\"><table>\n<thead><tr class=\"groups\"><th></th>");
    for (head, columns) in groups {
        let _ = write!(text, "<th class=\"first\" colspan=\"{}\">{head}</th>", columns.len());
    }
    text += "</tr>\n<tr><th>layout</th>";
    let columns = || groups.iter().flat_map(|(_, columns)| columns.iter().enumerate());
    for (place, column) in columns() {
        let _ = write!(text, "<th{}>{}</th>", first(place), column.head);
    }
    text += "</tr></thead>\n<tbody>\n";
    let figure = |candidate: &Candidate<'_>, column: &Column| {
        let is_it = |row: &&&Row| row.layout == candidate.collide.layout && row.question == column.question;
        let (_, cell) =
            rows.iter().find(is_it)?.cells().into_iter().find(|(name, _)| *name == column.field)?;
        if let Cell::Number(value) = cell { Some(value) } else { None }
    };
    let least: Vec<Option<f64>> = columns()
        .map(|(_, column)| {
            let figures = || candidates.iter().filter_map(|one| figure(one, column));
            // If all values are equal, none is marked as the best.
            figures().reduce(f64::min).filter(|&least| figures().any(|figure| figure > least))
        })
        .collect();
    for candidate in candidates {
        let name = escape(&candidate.name());
        let is_on_front =
            [candidate.collide, candidate.distance].iter().any(|row| row.pareto_bytes == Some(true));
        let dot = if is_on_front { " \u{2022}" } else { "" };
        let pair = escape(&candidate.collide.pair);
        let _ = write!(text, "<tr data-pair=\"{pair}\" data-layout=\"{name}\"><td>{name}{dot}</td>");
        for ((place, column), least) in columns().zip(&least) {
            let Some(value) = figure(candidate, column) else {
                let _ = write!(text, "<td{}>\u{2013}</td>", first(place));
                continue;
            };
            let is_best = Some(value) == *least;
            let shown = (column.show)(value);
            let shown = if is_best { format!("<b>{shown}</b>") } else { shown };
            let _ = write!(
                text,
                "<td{} data-question=\"{}\" data-rel-err=\"{:?}\" data-field=\"{}\" data-value=\"{value:?}\">{shown}\
                 </td>",
                first(place),
                column.question.name(),
                column.question.rel_err().unwrap_or(0.0),
                column.field,
            );
        }
        text += "</tr>\n";
    }
    text + "</tbody></table></div>\n"
}

/// The class of the first column of a group.
fn first(place: usize) -> &'static str {
    if place == 0 { " class=\"first\"" } else { "" }
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// Formats a ratio by its excess over 1.
fn excess(value: f64) -> String {
    format!("{:.1} %", 100.0 * (value - 1.0))
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// A relative error in percent, with two digits.
fn percent(value: f64) -> String {
    match 100.0 * value {
        0.0 => "0".to_owned(),
        percent @ 10.0.. => format!("{percent:.0} %"),
        percent @ 1.0.. => format!("{percent:.1} %"),
        percent @ 0.001.. => format!("{:.1$} %", percent, (1.0 - percent.log10().floor()) as usize),
        percent => format!("{percent:.0e} %"),
    }
}
