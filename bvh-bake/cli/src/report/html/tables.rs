//! The tables of a pair. Each figure carries the value that `report.csv` has for it.

use super::escape;
use crate::report::json::Report;
use crate::report::plot::micro;
use crate::report::row::{Cell, Row};
use crate::report::variant::Group;
use std::fmt::Write;

/// A column: whose figure it is and how it is shown.
struct Column {
    head: &'static str,
    /// Which of a variant's rows: the question, and of distances the allowed error.
    question: &'static str,
    rel_err: f64,
    field: &'static str,
    show: fn(f64) -> String,
}

const fn column(
    head: &'static str,
    question: &'static str,
    field: &'static str,
    show: fn(f64) -> String,
) -> Column {
    Column { head, question, rel_err: 0.0, field, show }
}

const fn allowed(head: &'static str, rel_err: f64, field: &'static str, show: fn(f64) -> String) -> Column {
    Column { head, question: "distance", rel_err, field, show }
}

const TIMES: [Column; 10] = [
    column("collide", "collide", "warm_ns_median", micro),
    column("rounds from", "collide", "warm_ns_q1", micro),
    column("to", "collide", "warm_ns_q3", micro),
    column("p90", "collide", "warm_ns_p90", micro),
    column("cold", "collide", "cold_ns_median", micro),
    column("distance", "distance", "warm_ns_median", micro),
    column("rounds from", "distance", "warm_ns_q1", micro),
    column("to", "distance", "warm_ns_q3", micro),
    column("p90", "distance", "warm_ns_p90", micro),
    column("cold", "distance", "cold_ns_median", micro),
];

const BOUNDS: [Column; 9] = [
    column("file", "collide", "file_bytes_per_tri", tenths),
    column("nodes", "collide", "node_bytes_per_tri", tenths),
    column("triangles", "collide", "triangle_bytes_per_tri", tenths),
    column("ids", "collide", "id_bytes_per_tri", tenths),
    column("width", "collide", "width_inflation", thousandths),
    column("volume", "collide", "volume_inflation", thousandths),
    column("in vain, collide", "collide", "false_positive_rate", percent),
    column("in vain, distance", "distance", "false_positive_rate", percent),
    column("vertices moved by", "collide", "vertex_error", scientific),
];

const WORK: [Column; 6] = [
    column("collide: node tests", "collide", "node_tests", tenths),
    column("packet tests", "collide", "packet_tests", tenths),
    column("exact tests", "collide", "exact_tests", tenths),
    column("distance: node tests", "distance", "node_tests", tenths),
    column("packet tests", "distance", "packet_tests", tenths),
    column("exact tests", "distance", "exact_tests", tenths),
];

const ALLOWED: [Column; 12] = [
    allowed("0: time", 0.0, "warm_ns_median", micro),
    allowed("largest error", 0.0, "distance_error_max", scientific),
    allowed("median", 0.0, "distance_error_median", scientific),
    allowed("0.1 %: time", 1e-3, "warm_ns_median", micro),
    allowed("largest error", 1e-3, "distance_error_max", scientific),
    allowed("median", 1e-3, "distance_error_median", scientific),
    allowed("1 %: time", 1e-2, "warm_ns_median", micro),
    allowed("largest error", 1e-2, "distance_error_max", scientific),
    allowed("median", 1e-2, "distance_error_median", scientific),
    allowed("10 %: time", 1e-1, "warm_ns_median", micro),
    allowed("largest error", 1e-1, "distance_error_max", scientific),
    allowed("median", 1e-1, "distance_error_median", scientific),
];

const SPLITS: [Column; 10] = [
    column("collide", "collide", "warm_ns_median", micro),
    column("rounds from", "collide", "warm_ns_q1", micro),
    column("to", "collide", "warm_ns_q3", micro),
    column("node tests", "collide", "node_tests", tenths),
    column("distance", "distance", "warm_ns_median", micro),
    column("rounds from", "distance", "warm_ns_q1", micro),
    column("to", "distance", "warm_ns_q3", micro),
    column("node tests", "distance", "node_tests", tenths),
    column("packet tests", "distance", "packet_tests", tenths),
    column("node bytes", "collide", "node_bytes_per_tri", tenths),
];

const PAGES: [Column; 14] = [
    column("collide", "collide", "warm_ns_median", micro),
    column("cold", "collide", "cold_ns_median", micro),
    column("from disk", "collide", "disk_ns_median", micro),
    column("sparse", "collide", "sparse_ns_median", micro),
    column("faults", "collide", "sparse_faults", tenths),
    column("KiB brought in", "collide", "resident_bytes", kibibytes),
    column("touched", "collide", "touched_bytes", kibibytes),
    column("distance", "distance", "warm_ns_median", micro),
    column("cold", "distance", "cold_ns_median", micro),
    column("from disk", "distance", "disk_ns_median", micro),
    column("sparse", "distance", "sparse_ns_median", micro),
    column("faults", "distance", "sparse_faults", tenths),
    column("KiB brought in", "distance", "resident_bytes", kibibytes),
    column("touched", "distance", "touched_bytes", kibibytes),
];

const MODELLED: [Column; 9] = [
    column("node bytes", "collide", "node_bytes_per_tri", tenths),
    column("triangles a leaf", "collide", "triangles_per_leaf", tenths),
    column("width", "collide", "width_inflation", thousandths),
    column("volume", "collide", "volume_inflation", thousandths),
    column("in vain, collide", "collide", "false_positive_rate", percent),
    column("collide: node tests", "collide", "modelled_node_tests", tenths),
    column("packet tests", "collide", "modelled_packet_tests", tenths),
    column("distance: node tests", "distance", "modelled_node_tests", tenths),
    column("packet tests", "distance", "modelled_packet_tests", tenths),
];

/// Branching of whole profiles: their names, with children, bytes of a treelet and what differs beside.
const BRANCHING: [(&str, &str); 7] = [
    ("dop26-u8", "26-DOP, u8: 2 children in 64 bytes"),
    ("dop26-u8-wide", "26-DOP, u8: 4 children in 128 bytes"),
    ("dop14-f16", "14-DOP, f16: 2 children in 64 bytes"),
    ("dop14-f16-wide", "14-DOP, f16: 4 children in 128 bytes"),
    ("dop6-f16", "6-DOP, f16: 4 children in 64 bytes"),
    ("dop6-u8", "6-DOP, u8, a coarser code: 8 children in 64 bytes"),
    ("dop14-u4", "14-DOP, u4, a coarser code: 8 children in 64 bytes"),
];

/// All tables of a pair.
pub(super) fn all(report: &Report, pair: &str) -> String {
    let rows = Rows(report.rows.iter().filter(|row| row.pair == pair).collect());
    let mut text = String::from("<h3>Layouts</h3>\n");
    let layouts = rows.variants(Group::Layout);
    let layout = |caption: &str, columns: &[Column]| rows.table(caption, Group::Layout, &layouts, columns);
    text += &layout(
        "Microseconds a query: the median over poses; quartiles of it over the rounds; nine tenths of the poses take \
         less than p90. No allowed error. The least of each column is underlined.",
        &TIMES,
    );
    text += &layout(
        "Bytes a triangle, and how loose bounds are: decoded width / tight width, the same of box volumes, the part \
         of node pairs let through that tight bounds would have stopped, and how far vertices moved (mesh units).",
        &BOUNDS,
    );
    text += &layout(
        "Work of a query on average: tests of up to 16 pairs of nodes, of up to 16 pairs of triangles, and pairs of \
         triangles decided exactly.",
        &WORK,
    );
    text += &layout(
        "Distance with an allowed relative error: median microseconds, and the error found, relative to the exact \
         distance of the mesh, over the poses that are apart.",
        &ALLOWED,
    );
    text += "<h3>What the parts are worth</h3>\n";
    let branching: Vec<(String, String)> = BRANCHING
        .iter()
        .map(|(profile, what)| (format!("{profile} f32"), format!("{profile} \u{2013} {what}")))
        .collect();
    text += &rows.table(
        "Branching, by profiles that are there. Microseconds.",
        Group::Layout,
        &branching,
        &SPLITS,
    );
    let named = |group| rows.variants(group);
    text += &rows.table(
        "How nodes are split (dop14-u8, f32 triangles). Microseconds.",
        Group::Splits,
        &named(Group::Splits),
        &SPLITS,
    );
    text += &rows.table(
        "Order of pages (dop14-u8, f32 triangles). Microseconds; from disk: opening both files and the first query, \
         as the system reads ahead and sparse, with page faults that waited for the disk, what was brought into memory, \
         and what the same query touches when asked again, in whole pages of 4 KiB.",
        Group::Pages,
        &named(Group::Pages),
        &PAGES,
    );
    for (group, caption) in [
        (
            Group::Predictor,
            "What residuals are relative to: the decoded parent (chain, the format's way), the parent's tight bound, \
             the whole object (none). 14-DOP, 4 children, 4 triangles a leaf.",
        ),
        (Group::Branching, "Children of a treelet. 14-DOP, u8, chain, 4 triangles a leaf."),
        (Group::Leaf, "Triangles of a leaf, at most. 14-DOP, u8, chain, 4 children."),
    ] {
        text += &rows.table(caption, group, &named(group), &MODELLED);
    }
    text
}

/// The rows of a pair.
struct Rows<'a>(Vec<&'a Row>);

impl Rows<'_> {
    /// Names of a group's variants, twice: to find them and to show.
    fn variants(&self, group: Group) -> Vec<(String, String)> {
        let mut names: Vec<String> =
            self.0.iter().filter(|row| row.group == group).map(|row| row.variant.clone()).collect();
        names.dedup();
        names.into_iter().map(|name| (name.clone(), name)).collect()
    }

    fn find(&self, group: Group, variant: &str, column: &Column) -> Option<(&Row, f64)> {
        let is_it = |row: &&&Row| {
            row.group == group
                && row.variant == variant
                && row.question == column.question
                && row.rel_err.unwrap_or(0.0) == column.rel_err
        };
        let row = self.0.iter().find(is_it)?;
        match row.cells().into_iter().find(|(name, _)| *name == column.field)?.1 {
            Cell::Number(value) => Some((row, value)),
            _ => None,
        }
    }

    fn table(
        &self,
        caption: &str,
        group: Group,
        variants: &[(String, String)],
        columns: &[Column],
    ) -> String {
        let is_modelled = matches!(group, Group::Predictor | Group::Branching | Group::Leaf);
        let class = if is_modelled { " class=\"modelled\"" } else { "" };
        let mut text = format!(
            "<div class=\"scroll\"><table{class}>\n<caption>{}</caption>\n<thead><tr><th></th>",
            caption
        );
        columns.iter().for_each(|column| {
            let _ = write!(text, "<th>{}</th>", column.head);
        });
        text += "</tr></thead>\n<tbody>\n";
        // The least of each column of times.
        let least: Vec<Option<f64>> = columns
            .iter()
            .map(|column| {
                let is_time = column.field.ends_with("_ns_median");
                let values = variants.iter().filter_map(|(name, _)| self.find(group, name, column));
                values.map(|(_, value)| value).filter(|_| is_time).reduce(f64::min)
            })
            .collect();
        for (name, shown) in variants {
            let _ = write!(text, "<tr><td>{}</td>", escape(shown));
            for (column, least) in columns.iter().zip(&least) {
                let Some((row, value)) = self.find(group, name, column) else {
                    text += "<td>\u{2013}</td>";
                    continue;
                };
                let class = if Some(value) == *least { " class=\"best\"" } else { "" };
                let _ = write!(
                    text,
                    "<td{class}><data data-pair=\"{}\" data-group=\"{}\" data-variant=\"{}\" data-question=\"{}\" \
                     data-rel-err=\"{:?}\" data-field=\"{}\" value=\"{value:?}\">{}</data></td>",
                    escape(&row.pair),
                    group.name(),
                    escape(name),
                    column.question,
                    column.rel_err,
                    column.field,
                    (column.show)(value)
                );
            }
            text += "</tr>\n";
        }
        text + "</tbody></table></div>\n"
    }
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

fn kibibytes(value: f64) -> String {
    format!("{:.0}", value / 1024.0)
}

fn thousandths(value: f64) -> String {
    format!("{value:.3}")
}

fn percent(value: f64) -> String {
    format!("{:.1} %", 100.0 * value)
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}
