//! `scaling.html`: the figure, the tables and what to mind, for people. It needs no other file.

use super::figure;
use super::record::Record;
use super::row::{Part, Row, gap_name};
use crate::report::html::{self, escape};
use crate::report::plot::{self, micro};
use crate::report::row::Cell;
use std::fmt::Write;

/// A column: its head, the cell of a row, and how that is shown.
type Column = (&'static str, &'static str, fn(f64) -> String);

const SIZES: [Column; 15] = [
    ("triangles", "triangles", whole),
    ("profile", "profile", whole),
    ("triangles as", "triangle_encoding", whole),
    ("gap", "gap", gap_name),
    ("\u{b5}s", "warm_ns_median", micro),
    ("rounds from", "warm_ns_q1", micro),
    ("to", "warm_ns_q3", micro),
    ("p90", "warm_ns_p90", micro),
    ("slope", "growth", hundredths),
    ("node tests", "node_tests", tenths),
    ("slope", "node_growth", hundredths),
    ("packet tests", "packet_tests", tenths),
    ("exact tests", "exact_tests", tenths),
    ("bytes a triangle", "file_bytes_per_tri", tenths),
    ("bake, s", "bake_seconds", hundredths),
];

const GROWTH: [Column; 3] = [
    ("gap", "gap", gap_name),
    ("slope of time", "growth", thousandths),
    ("of node tests", "node_growth", thousandths),
];

const BATCHES: [Column; 7] = [
    ("triangles", "triangles", whole),
    ("threads", "threads", whole),
    ("poses", "poses", whole),
    ("\u{b5}s a pose", "warm_ns_median", micro),
    ("rounds from", "warm_ns_q1", micro),
    ("to", "warm_ns_q3", micro),
    ("times as fast", "speedup", hundredths),
];

const PATHS: [Column; 12] = [
    ("triangles", "triangles", whole),
    ("gap", "gap", gap_name),
    ("step", "step", gap_name),
    ("tracker", "tracker", yes),
    ("poses", "poses", whole),
    ("touching", "touching", whole),
    ("mean \u{b5}s", "warm_ns_median", micro),
    ("rounds from", "warm_ns_q1", micro),
    ("to", "warm_ns_q3", micro),
    ("times as fast", "speedup", tenths),
    ("node tests", "node_tests", tenths),
    ("packet tests", "packet_tests", tenths),
];

/// The page.
pub(super) fn page(record: &Record) -> String {
    let mut page = html::head("cbvh: time against size");
    page += &opening(record);
    page.push_str("<ul>\n");
    for finding in record.findings() {
        let _ = writeln!(page, "<li>{}</li>", escape(&finding));
    }
    page.push_str("</ul>\n");
    let figures = figure::figures(&record.rows);
    page += &plot::element(&figures, "Time and node tests against triangles");
    let mut add = |head: &str, caption: &str, part, columns: &[Column]| {
        let _ = writeln!(page, "<h2>{head}</h2>");
        page += &table(caption, &record.of(part).collect::<Vec<_>>(), columns);
    };
    add(
        "Growth",
        "The slope between logarithms over all sizes, by least squares: 1 is proportional growth, 0.5 that of the square \
         root, and the logarithm has about 0.09 between 1,000 and 10,000,000.",
        Part::Growth,
        &GROWTH,
    );
    add(
        "Sizes",
        "A query: the median over poses; quartiles of it over the rounds; nine tenths of the poses take less than p90. \
         Tests are means. The slopes are those from a size a tenth as large.",
        Part::Size,
        &SIZES,
    );
    add(
        "Batches",
        "A pose of a batch of all gaps: median and quartiles over the rounds. Threads are not bound to processors.",
        Part::Batch,
        &BATCHES,
    );
    add(
        "Paths",
        "A query along a path, with and without a tracker: the mean over the path, of which median and quartiles over \
         the rounds. B goes around A by a step at a time, a fraction of the diagonal, turns by the same angle about an \
         axis of its own, and stays at the gap, or sways in and out of contact.",
        Part::Path,
        &PATHS,
    );
    page += METHODS;
    page + html::FOOT
}

fn opening(record: &Record) -> String {
    let settings = &record.settings;
    let mut text = format!(
        "<p>How the time of queries grows with the number of triangles: a closed ball with bumps against itself, \
         cbvh {} (format {}). Measured on {} with the backend {}: {} of each gap, {}.</p>\n{}",
        record.origin.version,
        record.origin.format_version,
        record.origin.date,
        settings.isa,
        html::count(settings.poses, "pose"),
        html::count(settings.rounds, "round"),
        html::machine(&record.origin.machine)
    );
    for (holds, warning) in [
        (!record.wrong.is_empty(), "There are answers that do not agree: see scaling.json."),
        (settings.quick, "A quick run, to try the command: a few poses and two rounds. Nothing to quote."),
        (record.origin.unoptimised, "The program was built without optimisation: times say nothing."),
        (record.pinned.is_none(), "The measuring thread was not bound to a processor: the system would not."),
    ] {
        if holds {
            let _ = writeln!(text, "<p class=\"wrong\">{warning}</p>");
        }
    }
    text
}

const METHODS: &str = "\
<h2>How it was measured</h2>
<ul>
<li>All sizes follow the same surface, and turns and directions of the poses are the same for all. How near B comes is
found for each size by its own distances, to a hundredth of the gap; gaps are fractions of the diagonal.</li>
<li>A and B are the same file in memory, in the layout that the baker chose, with ids. Pages had been checked.</li>
<li>Single queries and paths run on one thread that is bound to one processor. In each round all sizes take turns at each
question and gap, with three untimed queries before each turn. Caches hold what the queries before left there: with many
sizes and poses, that is rather the last cache than the first.</li>
<li>Contact and distance must agree; batches and trackers must answer as single queries do, to the bit.</li>
<li>A bake is timed once, on all processors, from the mesh in memory to the proved bytes.</li>
</ul>
";

fn table(caption: &str, rows: &[&Row], columns: &[Column]) -> String {
    let mut text =
        format!("<div class=\"scroll\"><table><caption>{caption}</caption>\n<thead><tr><th>question</th>");
    for (head, ..) in columns {
        let _ = write!(text, "<th>{head}</th>");
    }
    text.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        let cells = row.cells();
        let _ = write!(text, "<tr><td>{}</td>", row.question);
        for (_, field, show) in columns {
            let cell = cells.iter().find(|(name, _)| name == field).map_or(&Cell::Absent, |(_, cell)| cell);
            let shown = match cell {
                Cell::Text(text) => escape(text),
                Cell::Count(count) => show(*count as f64),
                Cell::Number(number) => show(*number),
                Cell::Flag(flag) => show(f64::from(u8::from(*flag))),
                Cell::Absent => "\u{2013}".to_owned(),
            };
            let _ = write!(text, "<td>{shown}</td>");
        }
        text.push_str("</tr>\n");
    }
    text + "</tbody></table></div>\n"
}

/// With commas between thousands.
fn whole(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

fn hundredths(value: f64) -> String {
    format!("{value:.2}")
}

fn thousandths(value: f64) -> String {
    format!("{value:.3}")
}

fn yes(value: f64) -> String {
    if value > 0.0 { "yes" } else { "no" }.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_have_commas() {
        let shown = [0.0, 960.0, 1000.0, 299_200.0, 9_998_244.0].map(whole);
        assert_eq!(shown, ["0", "960", "1,000", "299,200", "9,998,244"]);
    }
}
