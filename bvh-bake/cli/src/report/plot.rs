//! Figures: time against error and time against bytes, one pair of them for each pair of meshes, in SVG.
//!
//! Encodings of triangles differ in shape as well as in colour (Okabe and Ito's), and what is on the Pareto front
//! is filled, joined and named. Each mark carries its row's figures, for those who point at it and for programs.

use super::html::escape;
use super::json::Report;
use super::row::Row;
use super::variant::Group;
use std::fmt::Write;

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 400.0;
/// Room around the panels: for the title, numbers and names of the axes.
const TOP: f64 = 56.0;
const BOTTOM: f64 = 52.0;
const LEFT: [f64; 2] = [64.0, 552.0];
const PANEL: f64 = 384.0;
/// The part of a panel with errors that is for those that are 0.
const ZERO: f64 = 40.0;

/// The look of all figures, light and dark. Without variables, which few programs besides browsers know.
pub(super) const STYLE: &str = "\
.plot text { font: 12px system-ui, sans-serif; fill: #1a1a1a; } .plot .title { font-weight: 600; font-size: 14px; }
.plot .paper { fill: #fff; } .plot .frame, .plot .tick { stroke: #d5d5d5; fill: none; }
.plot .front-line { stroke: #1a1a1a; fill: none; stroke-dasharray: 4 3; opacity: .7; }
.plot .mark { fill: #fff; fill-opacity: .6; stroke-width: 1.6; } .plot .front { fill-opacity: 1; }
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
    let height = HEIGHT * report.pairs.len() as f64;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\">\n<style>{STYLE}</style>\n\
         <g class=\"plot\"><rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\"/></g>\n"
    );
    for (number, pair) in report.pairs.iter().enumerate() {
        let down = HEIGHT * number as f64;
        let figures = figures(report, &pair.name);
        let _ = writeln!(text, "<g class=\"plot\" transform=\"translate(0 {down})\">\n{figures}</g>");
    }
    text + "</svg>\n"
}

/// The figures of a pair as an element of a page.
pub(super) fn inline(report: &Report, pair: &str) -> String {
    let figures = figures(report, pair);
    format!(
        "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Time against error, and \
         time against bytes\">\n{figures}</svg>\n"
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
        let bottom = HEIGHT - BOTTOM;
        let (left, right) = (self.left, self.left + PANEL);
        let _ = writeln!(
            text,
            "<rect class=\"frame\" x=\"{left}\" y=\"{TOP}\" width=\"{PANEL}\" height=\"{}\"/>",
            bottom - TOP
        );
        let y = Scale::logarithmic(points.iter().map(|point| point.2), [bottom - 8.0, TOP + 8.0]);
        let x = if self.is_error {
            Scale::logarithmic(points.iter().map(|point| point.1), [left + ZERO + 8.0, right - 24.0])
        } else {
            Scale::linear(points.iter().map(|point| point.1), [left, right - 24.0])
        };
        let x_of =
            |value: f64| if self.is_error && value == 0.0 { left + ZERO / 2.0 } else { x.place(value) };
        for value in y.ticks() {
            let at = y.place(value);
            let shown = micro(value);
            let _ = writeln!(text, "<path class=\"tick\" d=\"M{left} {at:.1}H{right}\"/>");
            let _ = writeln!(
                text,
                "<text text-anchor=\"end\" x=\"{}\" y=\"{:.1}\">{shown}</text>",
                left - 6.0,
                at + 4.0
            );
        }
        let zero = self.is_error.then_some(0.0);
        for value in zero.into_iter().chain(x.ticks()) {
            let at = x_of(value);
            let shown = if self.is_error && value > 0.0 { format!("{value:e}") } else { value.to_string() };
            let _ = writeln!(text, "<path class=\"tick\" d=\"M{at:.1} {TOP}V{bottom}\"/>");
            let _ = writeln!(
                text,
                "<text text-anchor=\"middle\" x=\"{at:.1}\" y=\"{}\">{shown}</text>",
                bottom + 16.0
            );
        }
        let middle = (left + right) / 2.0;
        let _ = writeln!(
            text,
            "<text text-anchor=\"middle\" x=\"{middle}\" y=\"{}\">{}</text>",
            bottom + 36.0,
            self.name
        );
        let _ = writeln!(
            text,
            "<text x=\"{left}\" y=\"{}\">distance query, warm, median \u{b5}s</text>",
            TOP - 8.0
        );
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
fn shape(triangles: &str, x: f64, y: f64) -> String {
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

/// From figures to places.
struct Scale {
    is_logarithmic: bool,
    /// Least and largest figure, or their logarithms.
    ends: [f64; 2],
    places: [f64; 2],
}

impl Scale {
    /// Around the positive ones of some values.
    fn logarithmic(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let logs = values.filter(|&value| value > 0.0).map(f64::log10);
        let [lo, hi] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        // Nothing to show, or all the same: a decade around it.
        let ends = match hi - lo {
            range if range > 0.1 => [lo, hi],
            range if range >= 0.0 => [lo - 0.5, hi + 0.5],
            _ => [0.0, 1.0],
        };
        Self { is_logarithmic: true, ends, places }
    }

    /// From 0 on.
    fn linear(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let largest = values.fold(0.0, f64::max);
        Self { is_logarithmic: false, ends: [0.0, if largest > 0.0 { largest } else { 1.0 }], places }
    }

    fn place(&self, value: f64) -> f64 {
        let value = if self.is_logarithmic { value.log10() } else { value };
        let part = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.places[0] + part * (self.places[1] - self.places[0])
    }

    /// Round figures: 1, 2 and 5 of each decade, or only 1 if there are many; of a linear scale about six.
    fn ticks(&self) -> Vec<f64> {
        let [lo, hi] = self.ends;
        if !self.is_logarithmic {
            let step = 10f64.powf((hi / 6.0).log10().ceil());
            let step = if hi / step < 3.0 { step / 5.0 } else { step };
            let count = (hi / step) as u32;
            return (0..=count).map(|number| f64::from(number) * step).collect();
        }
        let factors: &[f64] = if hi - lo > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        // Parsed, since powers of ten may come out a rounding away from the figure that is meant.
        let tick = |decade: i32, factor: f64| format!("{factor}e{decade}").parse::<f64>().unwrap_or(f64::NAN);
        let all = decades.flat_map(|decade| factors.iter().map(move |&factor| tick(decade, factor)));
        all.filter(|tick| (lo..=hi).contains(&tick.log10())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_ticks_within_their_ends() {
        let scale = Scale::logarithmic([300.0, 9000.0, 0.0].into_iter(), [100.0, 0.0]);
        assert_eq!(scale.ticks(), [500.0, 1000.0, 2000.0, 5000.0]);
        assert_eq!((scale.place(300.0), scale.place(9000.0)), (100.0, 0.0));
        assert_eq!(
            Scale::linear([60.0].into_iter(), [0.0, 1.0]).ticks(),
            [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
        );
        for none in
            [Scale::logarithmic(std::iter::empty(), [0.0, 1.0]), Scale::linear([0.0].into_iter(), [0.0, 1.0])]
        {
            assert!(none.place(1.0).is_finite() && none.ticks().iter().all(|tick| tick.is_finite()));
        }
    }

    #[test]
    fn times_have_three_digits() {
        assert_eq!([123456.0, 12345.0, 1234.0, 56.0].map(micro), ["123", "12.3", "1.23", "0.06"]);
    }
}
