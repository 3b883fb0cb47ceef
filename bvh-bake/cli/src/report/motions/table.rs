//! The table of a pair: a line for each way to ask. Each figure carries the value that `report.csv` has for it.

use super::Report;
use super::method::Method;
use super::row::Row;
use crate::report::page::escape;
use crate::report::page::table::{Figure, Heads, Line, percent, table, value};
use cbvh_measure::table::{micro, whole};

/// A column: its head, the field of its figures, and how they are shown.
type Column = (&'static str, &'static str, fn(f64) -> String);

/// The columns below their common heads.
const COLUMNS: [(&str, &[Column]); 4] = [
    ("contacts missed", &[("number", "missed", whole), ("share", "missed_share", percent)]),
    ("late, of the way", &[("median", "late_median", percent), ("largest", "late_max", percent)]),
    ("motions", &[("undecided", "undecided", whole)]),
    (
        "per motion, \u{b5}s",
        &[("median", "ns_median", micro), ("90 %", "ns_p90", micro), ("mean", "ns_mean", micro)],
    ),
];

/// Returns the table of a pair with its heading.
pub(super) fn of_pair(report: &Report, pair: &str) -> String {
    let heads = COLUMNS.map(|(head, columns)| {
        let columns = columns.iter().map(|&(head, ..)| head).collect();
        Heads { head, columns }
    });
    let lines: Vec<Line> = report.of(pair).map(line).collect();
    let hits = report.of(pair).next().map_or(0, |row| row.hits);
    format!(
        "<h3>Errors and times</h3>\n<p>What each way to ask misses of {hits} certified contacts, how late it is with the \
         others, and how long it takes. The best figure of each column is bold.</p>\n{}",
        table("way to ask", &heads, &lines)
    )
}

fn line(row: &Row) -> Line {
    let name = match row.method {
        Method::Ordered(samples) => format!("{} samples in the order of time", whole(samples.into())),
        Method::Spread(samples) => format!("{} samples in a spread order", whole(samples.into())),
        Method::Motion => "certified: first contact".to_owned(),
        Method::IsFree => "certified: any contact".to_owned(),
    };
    let samples = row.method.samples().map_or(String::new(), |samples| samples.to_string());
    let (pair, method) = (escape(&row.pair), row.method.name());
    let figure = |&(_, field, show): &Column| {
        let value = value(row, field)?;
        Some(Figure { of: String::new(), field, value, shown: show(value) })
    };
    Line {
        of: format!("data-pair=\"{pair}\" data-method=\"{method}\" data-samples=\"{samples}\""),
        name,
        figures: COLUMNS.iter().flat_map(|(_, columns)| columns.iter().map(figure)).collect(),
    }
}
