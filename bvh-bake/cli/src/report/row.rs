//! A row of the report: one question put to one variant about one pair of meshes.
//!
//! What a row holds is listed once, in `Row::cells`; the table and the JSON are both written from there, so that
//! they hold the same figures under the same names. A figure that was not taken is absent, never 0 or NaN.

use super::spread::Spread;
use super::variant::Group;
use serde::{Serialize, Serializer};

/// Figures of a variant that do not depend on the question.
#[derive(Debug, Clone, Default)]
pub(super) struct Size {
    /// Both sides together, bytes a triangle.
    pub(super) node_bytes: Option<f64>,
    pub(super) triangle_bytes: Option<f64>,
    pub(super) id_bytes: Option<f64>,
    pub(super) file_bytes: Option<f64>,
    /// Mean over nodes of decoded width / tight width.
    pub(super) width_inflation: Option<f64>,
    /// The same of the boxes' volumes.
    pub(super) volume_inflation: Option<f64>,
    /// The farthest that a vertex was moved, mesh units.
    pub(super) vertex_error: Option<f64>,
    /// Modelled trees: triangles in a leaf, on average.
    pub(super) triangles_per_leaf: Option<f64>,
}

/// How far distances are from the exact ones.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    /// Relative, over the poses that are apart.
    pub(super) median: Option<f64>,
    pub(super) max: Option<f64>,
    /// Over all poses, mesh units.
    pub(super) max_length: Option<f64>,
}

/// Work of a query, on average over the poses.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Work {
    pub(super) node_tests: Option<f64>,
    pub(super) packet_tests: Option<f64>,
    pub(super) exact_tests: Option<f64>,
}

/// What a walk over the trees in memory counts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Modelled {
    pub(super) node_tests: Option<f64>,
    pub(super) packet_tests: Option<f64>,
    /// Of the pairs of nodes that are let through, the part that tight bounds would have stopped.
    pub(super) false_positives: Option<f64>,
}

/// A row.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) pair: String,
    pub(super) group: Group,
    pub(super) variant: String,
    pub(super) profile: String,
    pub(super) triangles: &'static str,
    pub(super) question: &'static str,
    pub(super) rel_err: Option<f64>,
    pub(super) poses: u64,
    pub(super) touching: u64,
    pub(super) warm: Option<Spread>,
    pub(super) cold: Option<Spread>,
    /// The first query of files that are on disk only, and faults that wait for the disk.
    pub(super) disk: Option<Spread>,
    pub(super) disk_faults: Option<f64>,
    /// The same where no more is read than the query touches; bytes in memory then, in whole pages of both files, and
    /// bytes touched when it is asked again.
    pub(super) sparse: Option<Spread>,
    pub(super) sparse_faults: Option<f64>,
    pub(super) resident_bytes: Option<f64>,
    pub(super) touched_bytes: Option<f64>,
    pub(super) work: Work,
    pub(super) modelled: Modelled,
    pub(super) size: Size,
    pub(super) errors: Errors,
    /// No other row of the pair's layouts is as fast with as small an error.
    pub(super) pareto_error: Option<bool>,
    /// No other layout without loss is as fast with as few bytes.
    pub(super) pareto_bytes: Option<bool>,
}

/// What a cell of the table holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Text(String),
    Count(u64),
    Number(f64),
    Flag(bool),
    Absent,
}

impl Cell {
    /// A number if there is one and it is finite.
    pub(super) fn number(value: Option<f64>) -> Self {
        value.filter(|value| value.is_finite()).map_or(Self::Absent, Self::Number)
    }

    pub(super) fn flag(value: Option<bool>) -> Self {
        value.map_or(Self::Absent, Self::Flag)
    }

    /// As the table has it: numbers in the fewest digits that give them back.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(number) => format!("{number:?}"),
            Self::Flag(flag) => u8::from(*flag).to_string(),
            Self::Absent => String::new(),
        }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(text) => serializer.serialize_str(text),
            Self::Count(count) => serializer.serialize_u64(*count),
            Self::Number(number) => serializer.serialize_f64(*number),
            Self::Flag(flag) => serializer.serialize_bool(*flag),
            Self::Absent => serializer.serialize_none(),
        }
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.cells())
    }
}

impl Row {
    /// True if the figures are from a model, not from queries of a file.
    pub(super) fn is_modelled(&self) -> bool {
        matches!(self.group, Group::Predictor | Group::Branching | Group::Leaf)
    }

    /// All that a row holds, with names.
    pub(super) fn cells(&self) -> Vec<(&'static str, Cell)> {
        let text = |text: &str| Cell::Text(text.to_owned());
        let how = if self.is_modelled() { "modelled" } else { "measured" };
        let mut cells = vec![
            ("pair", text(&self.pair)),
            ("group", text(self.group.name())),
            ("how", text(how)),
            ("variant", text(&self.variant)),
            ("profile", text(&self.profile)),
            ("triangles", text(self.triangles)),
            ("question", text(self.question)),
            ("rel_err", Cell::number(self.rel_err)),
            ("poses", Cell::Count(self.poses)),
            ("touching", Cell::Count(self.touching)),
        ];
        for (names, spread) in [
            (["warm_ns_median", "warm_ns_q1", "warm_ns_q3", "warm_ns_p90"], self.warm),
            (["cold_ns_median", "cold_ns_q1", "cold_ns_q3", "cold_ns_p90"], self.cold),
            (["disk_ns_median", "disk_ns_q1", "disk_ns_q3", "disk_ns_p90"], self.disk),
            (["sparse_ns_median", "sparse_ns_q1", "sparse_ns_q3", "sparse_ns_p90"], self.sparse),
        ] {
            let values = spread.map(|s| [s.median, s.quartiles[0], s.quartiles[1], s.p90]);
            for (place, name) in names.into_iter().enumerate() {
                cells.push((name, Cell::number(values.map(|values| values[place]))));
            }
        }
        let numbers = [
            ("disk_faults", self.disk_faults),
            ("sparse_faults", self.sparse_faults),
            ("resident_bytes", self.resident_bytes),
            ("touched_bytes", self.touched_bytes),
            ("node_tests", self.work.node_tests),
            ("packet_tests", self.work.packet_tests),
            ("exact_tests", self.work.exact_tests),
            ("modelled_node_tests", self.modelled.node_tests),
            ("modelled_packet_tests", self.modelled.packet_tests),
            ("false_positive_rate", self.modelled.false_positives),
            ("node_bytes_per_tri", self.size.node_bytes),
            ("triangle_bytes_per_tri", self.size.triangle_bytes),
            ("id_bytes_per_tri", self.size.id_bytes),
            ("file_bytes_per_tri", self.size.file_bytes),
            ("width_inflation", self.size.width_inflation),
            ("volume_inflation", self.size.volume_inflation),
            ("vertex_error", self.size.vertex_error),
            ("triangles_per_leaf", self.size.triangles_per_leaf),
            ("distance_error_median", self.errors.median),
            ("distance_error_max", self.errors.max),
            ("distance_error_max_length", self.errors.max_length),
        ];
        cells.extend(numbers.map(|(name, value)| (name, Cell::number(value))));
        cells.push(("pareto_error", Cell::flag(self.pareto_error)));
        cells.push(("pareto_bytes", Cell::flag(self.pareto_bytes)));
        cells
    }
}

/// `report.csv`: a line a row.
pub(super) fn table(rows: &[Row]) -> String {
    lines(rows.iter().map(Row::cells))
}

/// Cells with the same names in each row, as a line of names and a line a row.
pub(super) fn lines(rows: impl Iterator<Item = Vec<(&'static str, Cell)>>) -> String {
    let mut text = String::new();
    for row in rows {
        let (names, fields): (Vec<String>, Vec<String>) =
            row.iter().map(|(name, cell)| ((*name).to_owned(), cell.text())).unzip();
        if text.is_empty() {
            text = super::csv::line(&names);
        }
        text += &super::csv::line(&fields);
    }
    text
}
