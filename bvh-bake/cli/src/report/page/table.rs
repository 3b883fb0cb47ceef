//! A table of the page. Each figure carries the value that `report.csv` has for it, and the best ones are bold.

use cbvh_measure::table::{Cell, Cells};
use std::fmt::Write;

/// The heads of columns, below a common one.
pub(in crate::report) struct Heads {
    pub(in crate::report) head: &'static str,
    pub(in crate::report) columns: Vec<&'static str>,
}

/// A line of a table.
pub(in crate::report) struct Line {
    /// The attributes that tell the rows of its figures.
    pub(in crate::report) of: String,
    /// The first cell, as HTML.
    pub(in crate::report) name: String,
    /// The other cells.
    pub(in crate::report) figures: Vec<Option<Figure>>,
}

/// A figure.
pub(in crate::report) struct Figure {
    /// The attributes that tell its row, beside those of the line.
    pub(in crate::report) of: String,
    /// The name of its cell.
    pub(in crate::report) field: &'static str,
    pub(in crate::report) value: f64,
    pub(in crate::report) shown: String,
}

/// Returns the number in a cell of a row.
pub(in crate::report) fn value(row: &impl Cells, field: &str) -> Option<f64> {
    match row.cells().into_iter().find(|(name, _)| *name == field)?.1 {
        Cell::Number(value) => Some(value),
        Cell::Count(count) => Some(count as f64),
        _ => None,
    }
}

/// Returns a table whose first column has the head `first`.
pub(in crate::report) fn table(first: &str, groups: &[Heads], lines: &[Line]) -> String {
    let mut text = String::from("<div class=\"scroll\"><table>\n<thead><tr class=\"groups\"><th></th>");
    for Heads { head, columns } in groups {
        let _ = write!(text, "<th class=\"first\" colspan=\"{}\">{head}</th>", columns.len());
    }
    let _ = write!(text, "</tr>\n<tr><th>{first}</th>");
    let columns = || groups.iter().flat_map(|heads| heads.columns.iter().enumerate());
    for (place, head) in columns() {
        let _ = write!(text, "<th{}>{head}</th>", class(place));
    }
    text += "</tr></thead>\n<tbody>\n";
    let least: Vec<Option<f64>> = (0..columns().count()).map(|column| least(lines, column)).collect();
    for line in lines {
        let _ = write!(text, "<tr {}><td>{}</td>", line.of, line.name);
        for (((place, _), least), figure) in columns().zip(&least).zip(&line.figures) {
            text += &cell(place, figure.as_ref(), *least);
        }
        text += "</tr>\n";
    }
    text + "</tbody></table></div>\n"
}

/// Returns the least figure of a column. If all are equal, none is the best.
fn least(lines: &[Line], column: usize) -> Option<f64> {
    let figures = || lines.iter().filter_map(|line| Some(line.figures.get(column)?.as_ref()?.value));
    figures().reduce(f64::min).filter(|&least| figures().any(|figure| figure > least))
}

fn cell(place: usize, figure: Option<&Figure>, least: Option<f64>) -> String {
    let class = class(place);
    let Some(Figure { of, field, value, shown }) = figure else {
        return format!("<td{class}>\u{2013}</td>");
    };
    let shown = if Some(*value) == least { format!("<b>{shown}</b>") } else { shown.clone() };
    let space = if of.is_empty() { "" } else { " " };
    format!("<td{class}{space}{of} data-field=\"{field}\" data-value=\"{value:?}\">{shown}</td>")
}

/// The class of the first column of a group.
fn class(place: usize) -> &'static str {
    if place == 0 { " class=\"first\"" } else { "" }
}

/// Writes a fraction in percent, with two digits.
pub(in crate::report) fn percent(value: f64) -> String {
    match 100.0 * value {
        0.0 => "0".to_owned(),
        percent @ 10.0.. => format!("{percent:.0} %"),
        percent @ 1.0.. => format!("{percent:.1} %"),
        percent @ 0.001.. => format!("{:.1$} %", percent, (1.0 - percent.log10().floor()) as usize),
        percent => format!("{percent:.0e} %"),
    }
}
