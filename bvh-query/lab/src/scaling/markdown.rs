//! `scaling.md`: the tables for people.

use super::record::Record;
use super::row::{Part, gap_name};
use crate::output;
use crate::output::markdown;
use cbvh_measure::table::{Cell, Cells, micro, whole};

/// A column: its head, the cell of a row, and how that is shown.
type Column = (&'static str, &'static str, fn(f64) -> String);

const GROWTH: [Column; 4] = [
    ("gap", "gap", gap_name),
    ("turning slabs", "turning_slabs", yes),
    ("slope of time", "growth", thousandths),
    ("slope of node tests", "node_growth", thousandths),
];

const SIZES: [Column; 12] = [
    ("triangles", "triangles", whole),
    ("profile", "profile", whole),
    ("encoding", "triangle_encoding", whole),
    ("turning slabs", "turning_slabs", yes),
    ("gap", "gap", gap_name),
    ("median, \u{b5}s", "warm_ns_median", micro),
    ("90 %, \u{b5}s", "warm_ns_p90", micro),
    ("node tests", "node_tests", tenths),
    ("packet tests", "packet_tests", tenths),
    ("exact tests", "exact_tests", tenths),
    ("bytes per triangle", "file_bytes_per_tri", tenths),
    ("bake, s", "bake_seconds", hundredths),
];

const BATCHES: [Column; 5] = [
    ("triangles", "triangles", whole),
    ("threads", "threads", whole),
    ("poses", "poses", whole),
    ("\u{b5}s per pose", "warm_ns_median", micro),
    ("times as fast", "speedup", hundredths),
];

const PATHS: [Column; 8] = [
    ("triangles", "triangles", whole),
    ("gap", "gap", gap_name),
    ("step", "step", gap_name),
    ("tracker", "tracker", yes),
    ("touching", "touching", whole),
    ("mean, \u{b5}s", "warm_ns_median", micro),
    ("times as fast", "speedup", hundredths),
    ("node tests", "node_tests", tenths),
];

/// Returns the page.
pub(super) fn page(record: &Record) -> String {
    let settings = &record.settings;
    let unoptimised = if record.origin.unoptimised {
        "\n**The program was built without optimisation, so its times mean nothing.**\n"
    } else {
        ""
    };
    let mut page = format!(
        "# Time against size\n\n\
         A closed ball with bumps against itself, cbvh {}. Measured on {} with the backend {}: {} poses per gap, {} \
         rounds, {}. Single queries and paths run on one thread, {}.\n{unoptimised}\n",
        record.origin.version,
        record.origin.date,
        settings.isa,
        settings.poses,
        settings.rounds,
        record.origin.machine.text(),
        output::pinned(record.pinned)
    );
    page.extend(record.findings().iter().map(|finding| format!("- {finding}\n")));
    page += "\n![Microseconds and node tests against triangles](scaling.svg)\n";
    for (head, text, part, columns) in [
        (
            "Growth",
            "The slope of the least-squares line between logarithms over all sizes: 1 is proportional growth and 0.5 that \
             of the square root. The logarithm has about 0.09 between 1,000 and 10,000,000.",
            Part::Growth,
            &GROWTH[..],
        ),
        (
            "Sizes",
            "Per query: the median over the poses and then over the rounds, the time that nine tenths of the poses stay \
             below, and mean work. All sizes follow the same surface, in poses with the same turns and directions; gaps \
             are fractions of the diagonal, reached to a hundredth. A bake is timed once, on all processors.",
            Part::Size,
            &SIZES[..],
        ),
        (
            "Batches",
            "Per pose of a batch of all gaps: the median over the rounds. Threads are not bound to processors.",
            Part::Batch,
            &BATCHES[..],
        ),
        (
            "Paths",
            "Per query along a path: the median over the rounds of the mean over the path, with and without a tracker. B \
             moves around A by one step at a time, a fraction of the diagonal, turns by the same angle, and stays at the \
             gap or sways in and out of contact.",
            Part::Path,
            &PATHS[..],
        ),
    ] {
        let heads: Vec<&str> =
            ["question"].into_iter().chain(columns.iter().map(|column| column.0)).collect();
        let row = |row: &super::row::Row| {
            let cells = row.cells();
            let shown = |column: &Column| {
                let cell =
                    cells.iter().find(|(name, _)| *name == column.1).map_or(&Cell::Absent, |(_, cell)| cell);
                match cell {
                    Cell::Text(text) => text.clone(),
                    Cell::Count(count) => (column.2)(*count as f64),
                    Cell::Number(number) => (column.2)(*number),
                    Cell::Flag(flag) => (column.2)(f64::from(u8::from(*flag))),
                    Cell::Absent => String::new(),
                }
            };
            [row.question.to_owned()].into_iter().chain(columns.iter().map(shown)).collect()
        };
        page += &format!("\n## {head}\n\n{text}\n\n{}", markdown(&heads, record.of(part).map(row)));
    }
    page
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
