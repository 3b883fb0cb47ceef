//! `layouts.md`: the tables for people, the fastest layout first.

use super::Report;
use super::row::Row;
use crate::output::markdown;
use cbvh_measure::table::micro;

/// Returns the page.
pub(super) fn page(report: &Report) -> String {
    let mut page = format!(
        "# Layouts with cold caches\n\n\
         Microseconds per query after {} MiB of other memory were read through, medians over the poses, the fastest \
         distance first. Tests are means of walks to the end, with the distance known from the start; *in vain* is the \
         share of the node pairs let through that tight bounds would have stopped. Contact / distance. Measured on {} \
         with cbvh {}, backend {}, on {}.\n",
        report.sweep_bytes >> 20,
        report.origin.date,
        report.origin.version,
        report.isa,
        report.origin.machine.text()
    );
    let mut pairs: Vec<&str> = report.rows.iter().map(|row| row.pair.as_str()).collect();
    pairs.dedup();
    for pair in pairs {
        // The rows of a layout follow each other: contact, distance.
        let of_pair: Vec<&Row> = report.rows.iter().filter(|row| row.pair == pair).collect();
        let mut layouts: Vec<&[&Row]> = of_pair.chunks(2).collect();
        let time = |row: &Row| row.cold.map_or(f64::INFINITY, |cold| cold.median);
        layouts.sort_by(|a, b| time(a[1]).total_cmp(&time(b[1])));
        let heads =
            ["layout", "contact, \u{b5}s", "distance, \u{b5}s", "node tests", "packet tests", "in vain"];
        let row = |rows: &[&Row]| {
            let both = |figure: &dyn Fn(&Row) -> Option<String>| {
                let shown = rows.iter().map(|row| figure(row).unwrap_or_else(|| "-".to_owned()));
                shown.collect::<Vec<_>>().join(" / ")
            };
            let tests = |of: fn(&super::Walked) -> f64| {
                both(&|row| row.walked.as_ref().map(|walked| format!("{:.0}", of(walked))))
            };
            vec![
                format!("{} {}", rows[0].profile, rows[0].triangles),
                micro(time(rows[0])),
                micro(time(rows[1])),
                tests(|walked| walked.node_tests),
                tests(|walked| walked.packet_tests),
                both(&|row| row.walked?.in_vain.map(|share| format!("{:.1} %", 100.0 * share))),
            ]
        };
        page += &format!("\n## {pair}\n\n{}", markdown(&heads, layouts.into_iter().map(row)));
    }
    page
}
