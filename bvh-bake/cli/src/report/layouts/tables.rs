//! The tables of a pair, the fastest layout first. Each figure carries the value that `report.csv` has for it.

use super::Report;
use super::best::{Candidate, ranked};
use super::row::Row;
use crate::report::page::escape;
use crate::report::page::table::{Figure, Heads, Line, percent, table, value};
use cbvh_measure::rounds::Question;
use cbvh_measure::table::micro;
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
        text += &table_of(&rows, candidates, columns);
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

/// Returns the table of some layouts.
fn table_of(rows: &[&Row], candidates: &[Candidate<'_>], groups: &[Columns]) -> String {
    let heads: Vec<Heads> = groups
        .iter()
        .map(|(head, columns)| Heads { head, columns: columns.iter().map(|column| column.head).collect() })
        .collect();
    let figure = |candidate: &Candidate<'_>, column: &Column| {
        let is_it = |row: &&&Row| row.layout == candidate.collide.layout && row.question == column.question;
        let value = value(*rows.iter().find(is_it)?, column.field)?;
        let (question, rel_err) = (column.question.name(), column.question.rel_err().unwrap_or(0.0));
        let of = format!("data-question=\"{question}\" data-rel-err=\"{rel_err:?}\"");
        Some(Figure { of, field: column.field, value, shown: (column.show)(value) })
    };
    let line = |candidate: &Candidate<'_>| {
        let name = escape(&candidate.name());
        let is_on_front =
            [candidate.collide, candidate.distance].iter().any(|row| row.pareto_bytes == Some(true));
        let dot = if is_on_front { " \u{2022}" } else { "" };
        let columns = groups.iter().flat_map(|(_, columns)| columns);
        Line {
            of: format!("data-pair=\"{}\" data-layout=\"{name}\"", escape(&candidate.collide.pair)),
            name: format!("{name}{dot}"),
            figures: columns.map(|column| figure(candidate, column)).collect(),
        }
    };
    table("layout", &heads, &candidates.iter().map(line).collect::<Vec<_>>())
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
