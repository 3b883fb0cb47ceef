//! The plots of a pair: time against bytes for both exact questions, and time against error for distance.

use super::Report;
use super::row::Row;
use bvh_format::leaf::TriangleEncoding;
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};
use cbvh_measure::rounds::Question;

const TIME: &str = "median time per query, \u{b5}s";

/// Returns the plots of a pair.
pub(super) fn of_pair(report: &Report, pair: &str) -> Figure {
    let exact = |question: Question| report.of(pair).filter(move |row| row.question == question);
    let by_bytes = |question: Question| {
        let title = format!("{pair}: {}, time against size", question.name());
        let points = exact(question).filter_map(|row| Point::new(row, row.size.file_bytes, row.pareto_bytes));
        panel(title, "bytes per triangle, whole file", points.collect())
    };
    let distances = report.of(pair).filter(|row| row.question != Question::Collide);
    let by_error = distances.filter_map(|row| Point::new(row, row.errors.max?, row.pareto_error));
    let title = format!("{pair}: distance, time against error");
    let error = panel(title, "largest relative error found", by_error.collect());
    let names = [
        (TriangleEncoding::F32, "f32 triangles"),
        (TriangleEncoding::Packed, "packed: the same values"),
        (TriangleEncoding::Quantized, "quantised: vertices moved"),
    ];
    let mut legend: Vec<_> =
        names.map(|(triangles, name)| (look(triangles, false), name.to_owned())).to_vec();
    legend.push((
        look(TriangleEncoding::F32, true),
        "filled and named: no layout without loss beats it in both figures".into(),
    ));
    let [collide, distance] = Question::EXACT.map(by_bytes);
    Figure { title: pair.to_owned(), legend, rows: vec![vec![collide, distance], vec![error]] }
}

/// A row as a point of a plot.
struct Point<'a> {
    row: &'a Row,
    at: (f64, f64),
    is_on_front: bool,
}

impl<'a> Point<'a> {
    fn new(row: &'a Row, x: f64, is_on_front: Option<bool>) -> Option<Self> {
        Some(Self { row, at: (x, row.nanoseconds()? / 1000.0), is_on_front: is_on_front == Some(true) })
    }

    fn name(&self) -> String {
        let allowed = self.row.question.rel_err().filter(|&rel_err| rel_err > 0.0);
        let allowed = allowed.map_or(String::new(), |rel_err| format!(", {} %", 100.0 * rel_err));
        format!("{}{allowed}", self.row.layout.name())
    }
}

fn panel(title: String, x: &'static str, mut points: Vec<Point<'_>>) -> Panel {
    // The Pareto front is drawn on top of the other marks, from left to right.
    points.sort_by(|a, b| a.is_on_front.cmp(&b.is_on_front).then(a.at.0.total_cmp(&b.at.0)));
    let front = || points.iter().filter(|point| point.is_on_front);
    Panel {
        title,
        x,
        y: TIME,
        lines: vec![Line { points: front().map(|point| point.at).collect(), look: None }],
        marks: points
            .iter()
            .map(|point| Mark { at: point.at, look: look(point.row.layout.triangles, point.is_on_front) })
            .collect(),
        labels: front().map(|point| (point.at, point.name())).collect(),
    }
}

fn look(triangles: TriangleEncoding, is_filled: bool) -> Look {
    Look { kind: triangles as usize, is_filled }
}
