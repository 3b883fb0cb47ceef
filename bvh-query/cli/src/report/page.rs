//! `report.html`: one page for people, with sentences, plots and tables. It needs no other file, and links to pages that show the
//! pairs.
//!
//! Each figure of a table carries the value that `report.csv` has for it, and the best ones are bold.

use super::plot;
use super::{Measured, Report, view_name};
use crate::console::{Record, escape, trimmed};

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
    let Words { title, methods, .. } = words;
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n<title>cbvh: {title}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{title}</h1>\n{}",
        opening(report, words)
    );
    for (number, section) in report.sections.iter().enumerate() {
        let (name, about) = (escape(&section.name), escape(&section.about));
        let see = section
            .view
            .as_ref()
            .map_or(String::new(), |_| format!(" <a href=\"{}\">See the pair</a>.", view_name(number)));
        page += &format!("<h2 id=\"{name}\">{name}</h2>\n<p>{about}{see}</p>\n{}", list(&section.sentences));
        page += &plot::svg(&[&section.panels]);
        section.tables.iter().for_each(|table| page += &table.html(section));
    }
    format!(
        "{page}<h2 id=\"methods\">How it was measured, and what the figures do not tell</h2>\n<ul>\n{methods}\n</ul>\n\
         </body>\n</html>\n"
    )
}

/// Returns a list of sentences.
fn list<'a>(sentences: impl IntoIterator<Item = &'a String>) -> String {
    let items = sentences.into_iter().map(|sentence| format!("<li>{}</li>\n", escape(sentence)));
    format!("<ul>\n{}</ul>\n", items.collect::<String>())
}

/// Says what the page is about, and whether the answers were right.
fn opening(report: &Report, words: &Words) -> String {
    let names: Vec<String> =
        report.sections.iter().map(|of| format!("<a href=\"#{0}\">{0}</a>", escape(&of.name))).collect();
    let origin = &report.origin;
    let mut text = format!(
        "<p>{} Pairs: {}.</p>\n\
         <p>Measured on {} with cbvh {} (format {}), backend {}, one thread, on {}.</p>\n",
        words.about,
        names.join(", "),
        origin.date,
        origin.version,
        origin.format_version,
        report.settings["isa"].as_str().unwrap_or_default(),
        escape(&origin.machine.text())
    );
    let wrong: Vec<&String> = report.sections.iter().flat_map(|section| &section.wrong).collect();
    if wrong.is_empty() {
        text += &format!("<p>{}</p>\n", words.right);
    } else {
        text += &format!(
            "<div class=\"wrong\"><p><strong>{} wrong results.</strong> Do not rely on any figure here before they \
             are explained.</p>{}</div>\n",
            wrong.len(),
            list(wrong.into_iter().take(20))
        );
    }
    let quick = "This was a quick run of few queries in two rounds. Do not quote its figures.";
    let unoptimised = "The program was built without optimisation, so its times mean nothing.";
    for (holds, warning) in [(report.settings["quick"] == true, quick), (origin.unoptimised, unoptimised)] {
        if holds {
            text += &format!("<p class=\"wrong\">{warning}</p>\n");
        }
    }
    text
}

/// A column of a table: its head, the name of its figures, and how they are shown.
pub(super) type Column = (&'static str, &'static str, fn(f64) -> String);

/// A table of some rows of a pair.
pub(super) struct Table {
    pub(super) title: String,
    /// Columns without figures are left out.
    pub(super) columns: &'static [Column],
    /// The text of the first cell, and the place of the row among those of the pair.
    pub(super) rows: Vec<(String, usize)>,
}

impl Table {
    fn html(&self, section: &Measured) -> String {
        let rows = || self.rows.iter().map(|&(_, place)| &section.rows[place]);
        let figures = |field| rows().filter_map(move |row: &Record| row.number(field));
        let columns: Vec<&Column> =
            self.columns.iter().filter(|(_, field, _)| figures(field).next().is_some()).collect();
        let heads: String = columns.iter().map(|(head, ..)| format!("<th>{head}</th>")).collect();
        let mut text = format!(
            "<h3>{}</h3>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr><th></th>{heads}</tr></thead>\n<tbody>\n",
            self.title
        );
        for ((name, place), row) in self.rows.iter().zip(rows()) {
            // The number of the row in report.csv, from 0.
            text += &format!("<tr data-row=\"{}\"><td>{}</td>", section.first_row + place, escape(name));
            for &&(_, field, show) in &columns {
                text += &match row.number(field) {
                    None => "<td>\u{2013}</td>".to_owned(),
                    Some(value) => {
                        // If all figures of a column are equal, none is the best.
                        let is_best = figures(field).all(|other| value <= other)
                            && figures(field).any(|other| value < other);
                        let (left, right) = if is_best { ("<b>", "</b>") } else { ("", "") };
                        let shown = show(value);
                        format!(
                            "<td data-field=\"{field}\" data-value=\"{value:?}\">{left}{shown}{right}</td>"
                        )
                    }
                };
            }
            text += "</tr>\n";
        }
        text + "</tbody></table></div>\n"
    }
}

/// Writes a number with three digits or more, and 0 and very small ones shortly.
pub(super) fn figure(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size @ 1e-4..1e9 => {
            let decimals = (2.0 - size.log10().floor()).max(0.0) as usize;
            trimmed(&format!("{value:.decimals$}")).to_owned()
        }
        _ => format!("{value:.1e}"),
    }
}

/// Writes nanoseconds as microseconds.
pub(super) fn micro(nanoseconds: f64) -> String {
    figure(nanoseconds / 1000.0)
}

/// Writes a fraction in percent.
pub(super) fn percent(value: f64) -> String {
    figure(100.0 * value) + if value == 0.0 { "" } else { " %" }
}

/// Writes a ratio by its excess over 1.
pub(super) fn excess(value: f64) -> String {
    format!("{:.1} %", 100.0 * (value - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0, 123456.0, 99.96, 12.345, 9.996, 1.5, 0.056, 0.01234, 1.26e-7];
        let shown = ["0", "123456", "100", "12.3", "10", "1.5", "0.056", "0.0123", "1.3e-7"];
        assert_eq!(figures.map(figure), shown);
        assert_eq!((percent(0.0), percent(0.25), micro(1500.0)), ("0".into(), "25 %".into(), "1.5".into()));
    }
}
