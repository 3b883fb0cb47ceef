//! `report.html`: one page for people, with the figures, tables, and what to mind. It needs no other file.

mod findings;
mod tables;
mod text;

use super::json::Report;
use super::plot;
use std::fmt::Write;

pub(super) use findings::findings;
pub(super) use text::{count, machine};

const STYLE: &str = "\
:root { color-scheme: light dark; --ink: #1a1a1a; --paper: #fff; --faint: #d5d5d5; --band: #f4f5f7; --link: #0059a8; }
@media (prefers-color-scheme: dark) { :root { --ink: #eaeaea; --paper: #16181b; --faint: #444; --band: #1f2327; \
--link: #7ab8ff; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 62rem; \
margin: 2rem auto; padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--faint); } h3 { margin-top: 2rem; }
a { color: var(--link); } svg.plot { width: 100%; height: auto; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: .8rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding: .4rem 0; max-width: 60rem; } th, td { padding: .15rem .5rem; text-align: right; \
white-space: nowrap; } th { vertical-align: bottom; } tbody tr:nth-child(odd) { background: var(--band); }
td:first-child, th:first-child { text-align: left; } thead { border-bottom: 1px solid var(--ink); }
.best { font-weight: 700; text-decoration: underline; } .spread { font-size: .9em; opacity: .75; }
.modelled caption::before { content: \"Modelled. \"; font-weight: 700; } .wrong { border: 2px solid; padding: .5rem 1rem; }
";

/// The page.
pub(super) fn page(report: &Report) -> String {
    let mut page = head("cbvh: speed against error");
    page.push_str(&text::opening(report));
    for pair in &report.pairs {
        let _ = writeln!(page, "<h2 id=\"{0}\">{0}</h2>", escape(&pair.name));
        page.push_str(&text::pair(pair));
        page.push_str("<ul>\n");
        for finding in findings(report, &pair.name) {
            let _ = writeln!(page, "<li>{}</li>", escape(&finding));
        }
        page.push_str("</ul>\n");
        page.push_str(&plot::inline(report, &pair.name));
        page.push_str(&tables::all(report, &pair.name));
    }
    page.push_str(&text::methods(report));
    page + FOOT
}

/// A page up to what stands below its title.
pub(super) fn head(title: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
         <style>{STYLE}{}</style>\n</head>\n<body>\n<h1>{title}</h1>\n",
        plot::STYLE
    )
}

/// How a page ends.
pub(super) const FOOT: &str = "</body>\n</html>\n";

/// Text as an element or attribute may hold it.
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
