//! `report.html`: one page for people, with sentences, plots and tables. It needs no other file.
//!
//! Each figure of a table carries the value that `report.csv` has for it, and the best ones are bold.

use super::{Cells, Report, SideRecord};
use cbvh_measure::plot;
use cbvh_measure::table::{Cell, whole};
use std::fmt::Write;

const STYLE: &str = "\
:root { color-scheme: light; } \
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 70rem; margin: 2rem auto; \
padding: 0 1rem; overflow-wrap: anywhere; }
h1 { line-height: 1.2; } h2 { margin-top: 3rem; border-bottom: 1px solid #bbb; } h3 { margin: 2rem 0 .3rem; }
a { color: #0059a8; } svg { display: block; max-width: 100%; height: auto; } p, li { max-width: 52rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: .85rem; \
font-variant-numeric: tabular-nums; overflow-wrap: normal; }
th, td { padding: .15rem .5rem; text-align: right; } td { white-space: nowrap; } th { vertical-align: bottom; \
font-weight: 600; } tr.groups th { text-align: center; } th.first, td.first { border-left: 1px solid #ccc; }
td:first-child, th:first-child { text-align: left; position: sticky; left: 0; background: #fff; } \
td:first-child { white-space: normal; min-width: 7rem; } tbody tr:nth-child(odd) td { background: #f3f5f8; }
thead { border-bottom: 1px solid #1a1a1a; } .wrong { border: 2px solid #a00; \
padding: .5rem 1rem; }
@media print { .scroll { overflow: visible; } table { font-size: .6rem; } }
";

/// The words of a kind of report, as HTML.
pub(super) struct Words {
    pub(super) title: &'static str,
    /// What the page is about.
    pub(super) about: &'static str,
    /// What is known if no answer is wrong.
    pub(super) right: &'static str,
    /// Says how it was measured in so many rounds and what the figures do not tell, as two lists with their headings.
    pub(super) methods: fn(usize) -> String,
}

/// Returns the page.
pub(super) fn page(report: &Report, words: &Words) -> Result<String, Box<dyn std::error::Error>> {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<title>cbvh: {0}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{0}</h1>\n",
        words.title
    );
    page += &opening(report, words);
    let side = |side: &SideRecord| {
        let triangles = whole(side.triangles as f64);
        format!("{}, {triangles} triangles, diagonal {:.4} mesh units", escape(&side.mesh), side.diagonal)
    };
    for pair in &report.pairs {
        let section = &pair.section;
        let _ = writeln!(page, "<h2 id=\"{0}\">{0}</h2>", escape(&pair.name));
        let (a, b, items) = (side(&pair.a), side(&pair.b), escape(&section.items));
        let _ = writeln!(page, "<p>A: {a}. B: {b}. {items}.</p>\n<ul>");
        for sentence in &section.sentences {
            let _ = writeln!(page, "<li>{}</li>", escape(sentence));
        }
        page += "</ul>\n";
        page += &plot::svg(std::slice::from_ref(&section.figure))?;
        page += &section.tables;
    }
    page += &(words.methods)(report.settings.rounds);
    Ok(page + "</body>\n</html>\n")
}

/// Says what the page is about, and whether the answers were right.
fn opening(report: &Report, words: &Words) -> String {
    let names: Vec<String> =
        report.pairs.iter().map(|pair| format!("<a href=\"#{0}\">{0}</a>", escape(&pair.name))).collect();
    let mut text = format!(
        "<p>{} Pairs: {}.</p>\n\
         <p>Measured on {} with cbvh {} (format {}), backend {}, one thread, on {}.</p>\n",
        words.about,
        names.join(", "),
        report.origin.date,
        report.origin.version,
        report.origin.format_version,
        report.settings.isa,
        escape(&report.origin.machine.text())
    );
    if report.wrong.is_empty() {
        text += &format!("<p>{}</p>\n", words.right);
    } else {
        let some: String =
            report.wrong.iter().take(20).map(|line| format!("<li>{}</li>\n", escape(line))).collect();
        text += &format!(
            "<div class=\"wrong\"><p><strong>{} wrong answers.</strong> Do not rely on any figure here before they \
             are explained.</p><ul>\n{some}</ul></div>\n",
            report.wrong.len()
        );
    }
    for (holds, warning) in [
        (
            report.settings.quick,
            "This was a quick run that asked little in two rounds. Do not quote its figures.",
        ),
        (report.origin.unoptimised, "The program was built without optimisation, so its times mean nothing."),
        (
            report.pairs.iter().any(|pair| pair.pinned.is_none()),
            "The system did not bind the measuring thread to a processor, so times scatter more.",
        ),
    ] {
        if holds {
            text += &format!("<p class=\"wrong\">{warning}</p>\n");
        }
    }
    text
}

/// Escapes text for an element or an attribute.
pub(super) fn escape(text: &str) -> String {
    let escaped = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        // XML has no way to write most of these.
        c if c.is_control() => "\u{fffd}".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// A column of a table.
pub(super) struct Column {
    pub(super) head: &'static str,
    /// Which of a line's rows has its figures, and the attributes that tell that row from the others.
    pub(super) row: usize,
    pub(super) of: String,
    /// The name of its cells, and how their figures are shown.
    pub(super) field: &'static str,
    pub(super) show: fn(f64) -> String,
}

/// Columns below a common head.
pub(super) type Group = (&'static str, Vec<Column>);

/// A line of a table.
pub(super) struct Line {
    /// The attributes that tell its rows.
    pub(super) of: String,
    /// The first cell, as HTML.
    pub(super) name: String,
    pub(super) rows: Vec<Cells>,
}

impl Line {
    /// Returns the number in the cell of a column.
    fn value(&self, column: &Column) -> Option<f64> {
        match self.rows.get(column.row)?.iter().find(|(name, _)| *name == column.field)?.1 {
            Cell::Number(value) => Some(value),
            Cell::Count(count) => Some(count as f64),
            _ => None,
        }
    }
}

/// Returns a table whose first column has the head `first`.
pub(super) fn table(first: &str, groups: &[Group], lines: &[Line]) -> String {
    let mut text =
        String::from("<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr class=\"groups\"><th></th>");
    for (head, columns) in groups {
        let _ = write!(text, "<th class=\"first\" colspan=\"{}\">{head}</th>", columns.len());
    }
    let _ = write!(text, "</tr>\n<tr><th>{first}</th>");
    // If all figures of a column are equal, none is the best.
    let least = |column: &Column| {
        let figures = || lines.iter().filter_map(|line| line.value(column));
        figures().reduce(f64::min).filter(|&least| figures().any(|figure| figure > least))
    };
    let mut columns = Vec::new();
    for (place, column) in groups.iter().flat_map(|(_, columns)| columns.iter().enumerate()) {
        let class = if place == 0 { " class=\"first\"" } else { "" };
        let _ = write!(text, "<th{class}>{}</th>", column.head);
        columns.push((class, column, least(column)));
    }
    text += "</tr></thead>\n<tbody>\n";
    for line in lines {
        let _ = write!(text, "<tr {}><td>{}</td>", line.of, line.name);
        for &(class, column, least) in &columns {
            let value = line.value(column);
            let shown = value.map_or("\u{2013}".to_owned(), column.show);
            let shown = if value.is_some() && value == least { format!("<b>{shown}</b>") } else { shown };
            let data = value.map_or(String::new(), |value| {
                format!("{} data-field=\"{}\" data-value=\"{value:?}\"", column.of, column.field)
            });
            let _ = write!(text, "<td{class}{data}>{shown}</td>");
        }
        text += "</tr>\n";
    }
    text + "</tbody></table></div>\n"
}

/// Writes a fraction in percent, with two digits.
pub(super) fn percent(value: f64) -> String {
    match 100.0 * value {
        0.0 => "0".to_owned(),
        percent @ 10.0.. => format!("{percent:.0} %"),
        percent @ 1.0.. => format!("{percent:.1} %"),
        percent @ 0.001.. => format!("{:.1$} %", percent, (1.0 - percent.log10().floor()) as usize),
        percent => format!("{percent:.0e} %"),
    }
}
