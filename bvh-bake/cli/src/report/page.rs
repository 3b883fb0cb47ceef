//! `report.html`: one page for people, with sentences, plots and tables. It needs no other file.
//!
//! Each figure of a table carries the value that `report.csv` has for it, and the best ones are bold.

use super::{Cells, Report, number};
use cbvh_measure::plot::{self, escape};
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
font-weight: 600; }
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
    /// Says how it was measured and what the figures do not tell.
    pub(super) methods: &'static str,
}

/// Returns the page.
pub(super) fn page(report: &Report, words: &Words) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<title>cbvh: {0}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{0}</h1>\n",
        words.title
    );
    page += &opening(report, words);
    for section in &report.sections {
        let (name, about) = (escape(&section.name), escape(&section.about));
        let _ = writeln!(page, "<h2 id=\"{name}\">{name}</h2>\n<p>{about}</p>\n<ul>");
        for sentence in &section.sentences {
            let _ = writeln!(page, "<li>{}</li>", escape(sentence));
        }
        page += "</ul>\n";
        page += &plot::svg(std::slice::from_ref(&section.figure));
        page += &section.tables;
    }
    format!(
        "{page}<h2 id=\"methods\">How it was measured, and what the figures do not tell</h2>\n<ul>\n{}\n</ul>\n\
         </body>\n</html>\n",
        words.methods
    )
}

/// Says what the page is about, and whether the answers were right.
fn opening(report: &Report, words: &Words) -> String {
    let names: Vec<String> =
        report.sections.iter().map(|of| format!("<a href=\"#{0}\">{0}</a>", escape(&of.name))).collect();
    let mut text = format!(
        "<p>{} Pairs: {}.</p>\n\
         <p>Measured on {} with cbvh {} (format {}), backend {}, one thread, on {}.</p>\n",
        words.about,
        names.join(", "),
        report.origin.date,
        report.origin.version,
        report.origin.format_version,
        report.settings["isa"].as_str().unwrap_or_default(),
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
            report.settings["quick"] == true,
            "This was a quick run that asked little in two rounds. Do not quote its figures.",
        ),
        (report.origin.unoptimised, "The program was built without optimisation, so its times mean nothing."),
        (
            report.pairs.iter().any(|pair| pair["pinned"].is_null()),
            "The system did not bind the measuring thread to a processor, so times scatter more.",
        ),
    ] {
        if holds {
            text += &format!("<p class=\"wrong\">{warning}</p>\n");
        }
    }
    text
}

/// A column of a table: its head, the name of its figures, and how they are shown.
pub(super) type Column = (&'static str, &'static str, fn(f64) -> String);

/// Returns a table of rows, each with the text of its first cell. The attributes of a row are its cells named `keys`. Columns
/// without figures are left out.
pub(super) fn table(title: &str, keys: &[&str], rows: &[(String, &Cells)], columns: &[Column]) -> String {
    let figures = |field| rows.iter().filter_map(move |(_, row)| number(row, field));
    let columns: Vec<&Column> =
        columns.iter().filter(|(_, field, _)| figures(field).next().is_some()).collect();
    // If all figures of a column are equal, none is the best.
    let best =
        |field| figures(field).reduce(f64::min).filter(|&least| figures(field).any(|figure| figure > least));
    let heads: String = columns.iter().map(|(head, ..)| format!("<th>{head}</th>")).collect();
    let mut text = format!(
        "<h3>{title}</h3>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr><th></th>{heads}</tr></thead>\n<tbody>\n"
    );
    for (name, row) in rows {
        text += "<tr";
        for (key, cell) in row.iter().filter(|(key, _)| keys.contains(key)) {
            let _ = write!(text, " data-{}=\"{}\"", key.replace('_', "-"), escape(&cell.field()));
        }
        let _ = write!(text, "><td>{}</td>", escape(name));
        for &&(_, field, show) in &columns {
            let Some(value) = number(row, field) else {
                text += "<td>\u{2013}</td>";
                continue;
            };
            let (left, right) = if best(field) == Some(value) { ("<b>", "</b>") } else { ("", "") };
            let shown = show(value);
            let _ =
                write!(text, "<td data-field=\"{field}\" data-value=\"{value:?}\">{left}{shown}{right}</td>");
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

pub(super) fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// Formats a ratio by its excess over 1.
pub(super) fn excess(value: f64) -> String {
    format!("{:.1} %", 100.0 * (value - 1.0))
}

pub(super) fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}
