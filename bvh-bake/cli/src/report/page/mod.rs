//! `report.html`: one page for people, with sentences, plots and tables. It needs no other file.

pub(super) mod table;
mod text;

use super::document::Report;
use super::kind::Kind;
use cbvh_measure::plot;
use std::fmt::Write;

const STYLE: &str = "\
:root { color-scheme: light; } \
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 70rem; margin: 2rem auto; \
padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 3rem; border-bottom: 1px solid #bbb; } h3 { margin: 2rem 0 .3rem; }
a { color: #0059a8; } svg { max-width: 100%; height: auto; } p, li { max-width: 52rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: .85rem; \
font-variant-numeric: tabular-nums; }
th, td { padding: .15rem .6rem; text-align: right; white-space: nowrap; } th { vertical-align: bottom; \
font-weight: 600; } tr.groups th { text-align: center; } th.first, td.first { border-left: 1px solid #ccc; }
td:first-child, th:first-child { text-align: left; } tbody tr:nth-child(odd) { background: #f3f5f8; }
thead { border-bottom: 1px solid #1a1a1a; } .wrong { border: 2px solid #a00; \
padding: .5rem 1rem; }
";

/// Returns the page.
pub(super) fn page<K: Kind>(report: &Report<K>) -> Result<String, Box<dyn std::error::Error>> {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<title>cbvh: {0}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{0}</h1>\n",
        K::TITLE
    );
    page.push_str(&text::opening(report));
    for pair in &report.pairs {
        let _ = writeln!(page, "<h2 id=\"{0}\">{0}</h2>", escape(&pair.name));
        page.push_str(&text::pair::<K>(pair));
        page.push_str("<ul>\n");
        for sentence in K::sentences(report, pair) {
            let _ = writeln!(page, "<li>{}</li>", escape(&sentence));
        }
        page.push_str("</ul>\n");
        page.push_str(&plot::svg(&[K::figure(report, &pair.name)])?);
        page.push_str(&K::tables(report, &pair.name));
    }
    page.push_str(&K::methods(&report.settings));
    Ok(page + "</body>\n</html>\n")
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
