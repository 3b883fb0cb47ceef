//! Figures: time against error and time against bytes, one pair of them for each pair of meshes, in SVG.
//!
//! Encodings of triangles differ in shape as well as in colour (Okabe and Ito's), and what is on the Pareto front
//! is filled, joined and named. Each mark carries its row's figures, for those who point at it and for programs.

use super::axes::{Frame, Scale};
use super::html::escape;
use super::json::Report;
use super::row::Row;
use super::variant::Group;
use std::fmt::Write;

pub(super) const WIDTH: f64 = 960.0;
pub(super) const HEIGHT: f64 = 400.0;
/// Room around the panels: for the title, numbers and names of the axes.
pub(super) const TOP: f64 = 56.0;
pub(super) const BOTTOM: f64 = 52.0;
pub(super) const LEFT: [f64; 2] = [64.0, 552.0];
pub(super) const PANEL: f64 = 384.0;
/// The part of a panel with errors that is for those that are 0.
const ZERO: f64 = 40.0;

/// The look of all figures, light and dark. Without variables, which few programs besides browsers know.
pub(super) const STYLE: &str = "\
.plot text { font: 12px system-ui, sans-serif; fill: #1a1a1a; } .plot .title { font-weight: 600; font-size: 14px; }
.plot .paper { fill: #fff; } .plot .frame, .plot .tick { stroke: #d5d5d5; fill: none; }
.plot .front-line { stroke: #1a1a1a; fill: none; stroke-dasharray: 4 3; opacity: .7; }
.plot .line { fill: none; stroke-width: 1.2; } .plot .mark { fill: #fff; fill-opacity: .6; stroke-width: 1.6; } .plot .front { fill-opacity: 1; }
.plot .f32 { stroke: #0072b2; } .plot .f32.front { fill: #0072b2; }
.plot .packed { stroke: #b35a00; } .plot .packed.front { fill: #b35a00; }
.plot .quantized { stroke: #00805c; } .plot .quantized.front { fill: #00805c; }
@media (prefers-color-scheme: dark) {
.plot text { fill: #eaeaea; } .plot .paper, .plot .mark { fill: #16181b; }
.plot .frame, .plot .tick { stroke: #444; } .plot .front-line { stroke: #eaeaea; }
.plot .f32 { stroke: #56b4e9; } .plot .f32.front { fill: #56b4e9; }
.plot .packed { stroke: #e69f00; } .plot .packed.front { fill: #e69f00; }
.plot .quantized { stroke: #2fc79b; } .plot .quantized.front { fill: #2fc79b; }
}
";

/// `report.svg`: the figures of all pairs below each other.
pub(super) fn standalone(report: &Report) -> String {
    let rows: Vec<String> = report.pairs.iter().map(|pair| figures(report, &pair.name)).collect();
    stacked(&rows)
}

/// A drawing of its own, with rows of figures below each other.
pub(super) fn stacked(rows: &[String]) -> String {
    let height = HEIGHT * rows.len() as f64;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\">\n<style>{STYLE}</style>\n\
         <g class=\"plot\"><rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\"/></g>\n"
    );
    for (number, figures) in rows.iter().enumerate() {
        let down = HEIGHT * number as f64;
        let _ = writeln!(text, "<g class=\"plot\" transform=\"translate(0 {down})\">\n{figures}</g>");
    }
    text + "</svg>\n"
}

/// The figures of a pair as an element of a page.
pub(super) fn inline(report: &Report, pair: &str) -> String {
    element(&figures(report, pair), "Time against error, and time against bytes")
}

/// A row of figures as an element of a page, with words for those who cannot see it.
pub(super) fn element(figures: &str, what: &str) -> String {
    format!(
        "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{what}\">\n\
         {figures}</svg>\n"
    )
}

fn figures(report: &Report, pair: &str) -> String {
    let layouts = || report.rows.iter().filter(|row| row.pair == pair && row.group == Group::Layout);
    let by_error = layouts().filter_map(|row| Some((row, row.errors.max?, row.warm?.median)));
    let exact = layouts().filter(|row| row.rel_err == Some(0.0));
    let by_bytes = exact.filter_map(|row| Some((row, row.size.file_bytes?, row.warm?.median)));
    let mut text = String::new();
    let _ = writeln!(text, "<text class=\"title\" x=\"{}\" y=\"20\">{}</text>", LEFT[0], escape(pair));
    legend(&mut text);
    let error = Panel {
        left: LEFT[0],
        name: "largest relative error of the distance",
        is_error: true,
        on_front: |row| row.pareto_error == Some(true),
    };
    error.draw(&by_error.collect::<Vec<_>>(), &mut text);
    let bytes = Panel {
        left: LEFT[1],
        name: "bytes a triangle, whole file (no allowed error)",
        is_error: false,
        on_front: |row| row.pareto_bytes == Some(true),
    };
    bytes.draw(&by_bytes.collect::<Vec<_>>(), &mut text);
    text
}

fn legend(text: &mut String) {
    let mut x = LEFT[0] + 250.0;
    for (triangles, name) in
        [("f32", "f32 triangles"), ("packed", "packed, no loss"), ("quantized", "quantised, moved")]
    {
        let _ = write!(text, "<path class=\"mark front {triangles}\" d=\"{}\"/>", shape(triangles, x, 16.0));
        let _ = writeln!(text, "<text x=\"{}\" y=\"20\">{name}</text>", x + 10.0);
        x += 130.0;
    }
    let _ = writeln!(text, "<text x=\"{x}\" y=\"20\">filled: on the Pareto front</text>");
}

/// A figure of its own: axes, marks, front.
struct Panel {
    left: f64,
    name: &'static str,
    /// Errors are on a logarithmic axis, with room for 0.
    is_error: bool,
    on_front: fn(&Row) -> bool,
}

impl Panel {
    fn draw(&self, points: &[(&Row, f64, f64)], text: &mut String) {
        let (left, right) = (self.left, self.left + PANEL);
        let frame = Frame { left, right, top: TOP, bottom: HEIGHT - BOTTOM };
        let y = Scale::logarithmic(points.iter().map(|point| point.2), frame.upward());
        let x = if self.is_error {
            Scale::logarithmic(points.iter().map(|point| point.1), [left + ZERO + 8.0, right - 24.0])
        } else {
            Scale::linear(points.iter().map(|point| point.1), [left, right - 24.0])
        };
        let x_of =
            |value: f64| if self.is_error && value == 0.0 { left + ZERO / 2.0 } else { x.place(value) };
        let zero = self.is_error.then_some(0.0);
        let across = zero.into_iter().chain(x.ticks()).map(|value| {
            let shown = if self.is_error && value > 0.0 { format!("{value:e}") } else { value.to_string() };
            (x_of(value), shown)
        });
        let up = y.ticks().into_iter().map(|value| (y.place(value), micro(value)));
        frame.draw(across, self.name, up, "distance query, warm, median \u{b5}s", text);
        let mut marks: Vec<(f64, f64, &Row, f64)> =
            points.iter().map(|&(row, value, time)| (x_of(value), y.place(time), row, value)).collect();
        // What is on the front goes on top of the others, from left to right.
        marks.sort_by(|a, b| {
            (self.on_front)(a.2)
                .cmp(&(self.on_front)(b.2))
                .then(a.0.total_cmp(&b.0))
                .then(b.1.total_cmp(&a.1))
        });
        let front: Vec<_> = marks.iter().filter(|mark| (self.on_front)(mark.2)).collect();
        let mut line = String::new();
        for (number, (x, y, ..)) in front.iter().enumerate() {
            let _ = if number == 0 { write!(line, "M{x:.1} {y:.1}") } else { write!(line, "H{x:.1}V{y:.1}") };
        }
        if !line.is_empty() {
            let _ = writeln!(text, "<path class=\"front-line\" d=\"{line}\"/>");
        }
        for &(x, y, row, value) in &marks {
            self.mark(row, (x, y), value, text);
        }
        let mut labels = Labels { taken: Vec::new(), right };
        for (x, y, row, _) in front {
            let allowed = row.rel_err.filter(|&r| self.is_error && r > 0.0);
            let name = match allowed {
                Some(rel_err) => format!("{} {rel_err}", row.profile),
                None => row.profile.clone(),
            };
            labels.put(&name, *x, *y, text);
        }
    }

    fn mark(&self, row: &Row, (x, y): (f64, f64), value: f64, text: &mut String) {
        let front = if (self.on_front)(row) { " front" } else { "" };
        let (variant, rel_err) = (escape(&row.variant), row.rel_err.unwrap_or(0.0));
        let time = row.warm.map_or(0.0, |warm| warm.median);
        let what = if self.is_error { "largest error" } else { "bytes a triangle" };
        let figure = if self.is_error { "error" } else { "bytes" };
        let _ = writeln!(
            text,
            "<path class=\"mark {triangles}{front}\" d=\"{}\" data-pair=\"{}\" data-variant=\"{variant}\" \
             data-rel-err=\"{rel_err:?}\" data-ns=\"{time:?}\" data-{figure}=\"{value:?}\"><title>{variant}, allowed \
             error {rel_err}: {} \u{b5}s, {what} {value:.4}</title></path>",
            shape(row.triangles, x, y),
            escape(&row.pair),
            micro(time),
            triangles = row.triangles,
        );
    }
}

/// Puts names beside marks where there is room.
struct Labels {
    /// Boxes of names so far: left, top.
    taken: Vec<(f64, f64, f64)>,
    right: f64,
}

impl Labels {
    fn put(&mut self, name: &str, x: f64, y: f64, text: &mut String) {
        let width = 6.2 * name.chars().count() as f64;
        for (left, line) in
            [(x + 8.0, y - 5.0), (x + 8.0, y + 14.0), (x - 8.0 - width, y - 5.0), (x - 8.0 - width, y + 14.0)]
        {
            let is_free = |&(other, below, wide): &(f64, f64, f64)| {
                left > other + wide || other > left + width || (line - below).abs() > 12.0
            };
            if left + width < self.right && self.taken.iter().all(is_free) {
                self.taken.push((left, line, width));
                let _ = writeln!(text, "<text x=\"{left:.1}\" y=\"{line:.1}\">{}</text>", escape(name));
                return;
            }
        }
    }
}

/// A mark of its own for each encoding of triangles.
pub(super) fn shape(triangles: &str, x: f64, y: f64) -> String {
    match triangles {
        "packed" => format!("M{:.1} {:.1}h8v8h-8Z", x - 4.0, y - 4.0),
        "quantized" => format!("M{x:.1} {:.1}l5 9h-10Z", y - 5.5),
        _ => format!("M{:.1} {y:.1}a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0 -9 0Z", x - 4.5),
    }
}

/// Nanoseconds as microseconds of three digits.
pub(super) fn micro(nanoseconds: f64) -> String {
    let value = nanoseconds / 1000.0;
    let decimals = if value >= 100.0 { 0 } else { usize::from(value < 10.0) + 1 };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits() {
        assert_eq!([123456.0, 12345.0, 1234.0, 56.0].map(micro), ["123", "12.3", "1.23", "0.06"]);
    }
}
