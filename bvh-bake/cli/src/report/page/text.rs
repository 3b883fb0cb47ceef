//! The words around plots and tables: what was measured, where, and whether the answers were right.

use super::escape;
use crate::report::document::{PairRecord, Report, SideRecord};
use crate::report::kind::Kind;
use cbvh_measure::table::whole;

/// Says what the page is about, and whether the answers were right.
pub(super) fn opening<K: Kind>(report: &Report<K>) -> String {
    let names: Vec<String> =
        report.pairs.iter().map(|pair| format!("<a href=\"#{0}\">{0}</a>", escape(&pair.name))).collect();
    let mut text = format!(
        "<p>{} Pairs: {}.</p>\n\
         <p>Measured on {} with cbvh {} (format {}), backend {}, one thread, on {}.</p>\n",
        K::ABOUT,
        names.join(", "),
        report.origin.date,
        report.origin.version,
        report.origin.format_version,
        report.settings.isa,
        escape(&report.origin.machine.text())
    );
    if report.wrong.is_empty() {
        text += &format!("<p>{}</p>\n", K::RIGHT);
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

/// Says what a pair is and what it was asked about.
pub(super) fn pair<K: Kind>(pair: &PairRecord<K::Items>) -> String {
    let side = |side: &SideRecord| {
        let triangles = whole(side.triangles as f64);
        format!("{}, {triangles} triangles, diagonal {:.4} mesh units", escape(&side.mesh), side.diagonal)
    };
    format!("<p>A: {}. B: {}. {}.</p>\n", side(&pair.a), side(&pair.b), escape(&K::items(&pair.items)))
}
