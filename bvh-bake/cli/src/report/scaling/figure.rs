//! The figure: times and node tests against triangles, both axes logarithmic, beside two dashed lines to compare with.
//!
//! A gap has a colour and a shape, those of the triangle encodings in the figures of `plot`. Marks of distance are
//! filled, those of contact are not.

use super::row::{Part, Row, gap_name};
use crate::report::axes::{Frame, Scale};
use crate::report::html::escape;
use crate::report::plot::{BOTTOM, HEIGHT, LEFT, PANEL, TOP, micro, shape};
use std::fmt::Write;

/// Looks, in the order of gaps.
const LOOKS: [&str; 3] = ["f32", "packed", "quantized"];
/// Room at the right for the names of lines.
const NAMES: f64 = 118.0;
/// Between names below each other.
const LINE: f64 = 13.0;
/// Points of a curve.
const POINTS: usize = 24;

/// Both panels.
pub(super) fn figures(rows: &[Row]) -> String {
    let mut text = format!(
        "<text class=\"title\" x=\"{}\" y=\"20\">Ball against ball, warm</text>\n\
         <text x=\"{}\" y=\"20\">filled: distance; empty: collide; dashed: growth of the square root and of the \
         logarithm</text>\n",
        LEFT[0],
        LEFT[0] + 250.0
    );
    let times = Panel { left: LEFT[0], name: "median \u{b5}s a query", figure: Row::time, show: micro };
    times.draw(rows, &mut text);
    let tests = Panel {
        left: LEFT[1],
        name: "node tests a query, on average",
        figure: |row| row.work.node_tests,
        show: |value| value.to_string(),
    };
    tests.draw(rows, &mut text);
    text
}

/// A figure of its own.
struct Panel {
    left: f64,
    name: &'static str,
    figure: fn(&Row) -> Option<f64>,
    show: fn(f64) -> String,
}

/// The sizes of one question and gap: triangles, figure, row.
type Line<'a> = Vec<(f64, f64, &'a Row)>;

impl Panel {
    fn draw(&self, rows: &[Row], text: &mut String) {
        let lines = self.lines(rows);
        let curves = curves(&lines);
        let (left, right) = (self.left, self.left + PANEL);
        let frame = Frame { left, right, top: TOP, bottom: HEIGHT - BOTTOM };
        let all = || lines.iter().flatten().map(|point| (point.0, point.1));
        let compared = curves.iter().flat_map(|curve| curve.points.iter().copied());
        let x = Scale::logarithmic(all().map(|point| point.0), [left + 12.0, right - NAMES]);
        let y = Scale::logarithmic(all().chain(compared).map(|point| point.1), frame.upward());
        let across = x.ticks().into_iter().map(|value| (x.place(value), format!("{value:e}")));
        let up = y.ticks().into_iter().map(|value| (y.place(value), (self.show)(value)));
        frame.draw(across, "triangles", up, self.name, text);
        let mut names = Vec::new();
        for curve in &curves {
            let places: Vec<_> = curve.points.iter().map(|&(n, v)| (x.place(n), y.place(v))).collect();
            let _ = writeln!(text, "<path class=\"front-line\" d=\"{}\"/>", joined(&places));
            names.extend(places.last().map(|last| (last.1, curve.name.to_owned())));
        }
        let mut gaps: Vec<f64> = lines.iter().flatten().filter_map(|point| point.2.gap).collect();
        gaps.sort_unstable_by(f64::total_cmp);
        gaps.dedup();
        for line in &lines {
            let Some(&(_, last, row)) = line.last() else { continue };
            let gap = row.gap.unwrap_or_default();
            let place = gaps.iter().position(|&other| other == gap).unwrap_or(0);
            let look = LOOKS[place % LOOKS.len()];
            let places: Vec<_> = line.iter().map(|&(n, value, _)| (x.place(n), y.place(value))).collect();
            let _ = writeln!(text, "<path class=\"line {look}\" d=\"{}\"/>", joined(&places));
            for (&(_, value, row), &place) in line.iter().zip(&places) {
                self.mark(row, value, place, look, text);
            }
            names.push((y.place(last), format!("{}, {}", row.question, gap_name(gap))));
        }
        name_lines(names, right - NAMES + 8.0, &frame, text);
    }

    fn lines<'a>(&self, rows: &'a [Row]) -> Vec<Line<'a>> {
        let mut lines: Vec<Line<'a>> = Vec::new();
        for row in rows.iter().filter(|row| row.part == Part::Size) {
            // A figure of 0 has no place on a logarithmic axis.
            let Some(value) = (self.figure)(row).filter(|&value| value > 0.0) else { continue };
            let Some(triangles) = row.triangles() else { continue };
            let point = (triangles, value, row);
            match lines.iter_mut().find(|line| line[0].2.is_beside(row)) {
                Some(line) => line.push(point),
                None => lines.push(vec![point]),
            }
        }
        lines
    }

    fn mark(&self, row: &Row, value: f64, (x, y): (f64, f64), look: &str, text: &mut String) {
        let filled = if row.question == "distance" { " front" } else { "" };
        let (triangles, gap) = (row.triangles().unwrap_or_default(), row.gap.unwrap_or_default());
        let _ = writeln!(
            text,
            "<path class=\"mark {look}{filled}\" d=\"{}\" data-question=\"{}\" data-gap=\"{gap:?}\" \
             data-triangles=\"{triangles:?}\" data-value=\"{value:?}\"><title>{}, gap {}, {triangles} triangles: {} \
             {}</title></path>",
            shape(look, x, y),
            row.question,
            row.question,
            gap_name(gap),
            (self.show)(value),
            escape(self.name),
        );
    }
}

/// What growth of some kind would look like.
struct Curve {
    name: &'static str,
    points: Vec<(f64, f64)>,
}

/// From the middle of where lines begin: the square root, and the logarithm.
fn curves(lines: &[Line<'_>]) -> Vec<Curve> {
    let starts: Vec<(f64, f64)> =
        lines.iter().filter_map(|line| Some((line.first()?.0, line.first()?.1))).collect();
    let ends = lines.iter().flatten().map(|point| point.0);
    let (from, to) = ends.fold((f64::INFINITY, 0.0f64), |(lo, hi), n| (lo.min(n), hi.max(n)));
    if starts.is_empty() || from >= to {
        return Vec::new();
    }
    let begin = (starts.iter().map(|start| start.1.ln()).sum::<f64>() / starts.len() as f64).exp();
    let curve = |name, growth: fn(f64) -> f64| {
        let at = |number: usize| from * (to / from).powf(number as f64 / POINTS as f64);
        let points = (0..=POINTS).map(|number| (at(number), begin * growth(at(number)) / growth(from)));
        Curve { name, points: points.collect() }
    };
    vec![curve("square root", f64::sqrt), curve("logarithm", f64::ln)]
}

fn joined(places: &[(f64, f64)]) -> String {
    let each = places.iter().map(|(x, y)| format!("{x:.1} {y:.1}"));
    format!("M{}", each.collect::<Vec<_>>().join("L"))
}

/// Names at these heights, moved apart where they would meet.
fn name_lines(mut names: Vec<(f64, String)>, x: f64, frame: &Frame, text: &mut String) {
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lowest = frame.bottom - LINE * names.len() as f64;
    let mut above = f64::NEG_INFINITY;
    for (y, name) in names {
        // Below the one before, and no lower than leaves room for those behind.
        lowest += LINE;
        above = (y + 4.0).max(above + LINE).min(lowest);
        let _ = writeln!(text, "<text x=\"{x}\" y=\"{above:.1}\">{}</text>", escape(&name));
    }
}
