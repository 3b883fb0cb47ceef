//! Draws plots as SVG: panels with two logarithmic axes, lines, marks and labels.
//!
//! Panels stand below each other, so that their text can still be read when a page 400 pixels wide shows them. Labels are
//! numbers in a column to the right of their panel, moved apart where they would overlap; the names are below the panel. A
//! thin line leads from each number to its mark. Text is never measured, so no fonts are needed; the reader's program chooses
//! them.

use std::fmt::Write;

/// Colours that people with any colour vision can tell apart (Okabe and Ito), darkened for white paper.
const COLOURS: [&str; 4] = ["#0072b2", "#b35a00", "#00805c", "#a03c82"];
/// The corners of each shape around its middle, in pixels.
const SHAPES: [&[[f64; 2]]; 3] = [
    &[[5.0, 2.0], [2.0, 5.0], [-2.0, 5.0], [-5.0, 2.0], [-5.0, -2.0], [-2.0, -5.0], [2.0, -5.0], [5.0, -2.0]],
    &[[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]],
    &[[0.0, -6.0], [5.0, 4.0], [-5.0, 4.0]],
];

/// Width of a figure and height of a panel without its names, in pixels.
const PANEL: [f64; 2] = [500.0, 360.0];
/// What is left free around the axes of a panel, in pixels: left, right, above and below.
const MARGINS: [f64; 4] = [72.0, 54.0, 40.0, 56.0];
/// Height of the title of a figure, in pixels.
const TITLE: f64 = 36.0;
/// Height of a line of the legend or of names, in pixels.
const LINE: f64 = 20.0;
/// The least distance between two numbers of the column, in pixels.
const STEP: f64 = 15.0;
/// The part of an axis that is left of its least figure and holds those that are 0, as a fraction of the rest.
const ZERO: f64 = 0.1;

/// Panels below a title and a legend.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// Its title.
    pub title: String,
    /// The legend: what each colour and shape means.
    pub legend: Vec<(Look, String)>,
    /// The panels in groups, all below each other.
    pub rows: Vec<Vec<Panel>>,
}

/// One plot.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Its title.
    pub title: String,
    /// What is on the axis to the right, with its unit.
    pub x: &'static str,
    /// What is on the axis upwards, with its unit.
    pub y: &'static str,
    /// Lines, below the marks.
    pub lines: Vec<Line>,
    /// The marks. A figure of 0 stands at the left end of the axis to the right; it has no place on the other axis.
    pub marks: Vec<Mark>,
    /// Names of points.
    pub labels: Vec<((f64, f64), String)>,
}

/// A line through points.
#[derive(Debug, Clone)]
pub struct Line {
    /// The points, from left to right.
    pub points: Vec<(f64, f64)>,
    /// Its colour; `None` for a dashed one without colour.
    pub look: Option<Look>,
}

/// A point.
#[derive(Debug, Clone)]
pub struct Mark {
    /// The figures.
    pub at: (f64, f64),
    /// Its colour and shape.
    pub look: Look,
}

/// Colour and shape of marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// A number that stands for a colour and a shape.
    pub kind: usize,
    /// Whether the shape is filled.
    pub is_filled: bool,
}

/// Draws figures below each other.
pub fn svg(figures: &[Figure]) -> String {
    let (mut body, mut height) = (String::new(), 0.0);
    figures.iter().for_each(|figure| height = figure.draw(&mut body, height));
    let width = PANEL[0];
    format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" fill=\"#282828\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{body}</svg>\n"
    )
}

impl Figure {
    /// Draws the figure below `top`, and returns where it ends.
    fn draw(&self, svg: &mut String, mut top: f64) -> f64 {
        text(svg, [12.0, top + 18.0], "font-size=\"18\"", &self.title);
        top += TITLE;
        for (look, name) in &self.legend {
            look.draw(svg, [16.0, top + 10.0]);
            text(svg, [28.0, top + 10.0], TEXT, name);
            top += LINE;
        }
        self.rows.iter().flatten().for_each(|panel| top = panel.draw(svg, top));
        top
    }
}

impl Panel {
    /// Draws the panel below `top`, and returns where it ends.
    fn draw(&self, svg: &mut String, top: f64) -> f64 {
        let [left, right, above, below] = MARGINS;
        let [left, right] = [left, PANEL[0] - right];
        let [above, below] = [top + above, top + PANEL[1] - below];
        let points = || {
            let lines = self.lines.iter().flat_map(|line| line.points.iter().copied());
            lines.chain(self.marks.iter().map(|mark| mark.at))
        };
        let x = Axis::around(points().map(|point| point.0));
        let y = Axis::around(points().map(|point| point.1));
        let at = |point: (f64, f64)| {
            [left + (right - left) * x.share(point.0), below + (above - below) * y.share(point.1)]
        };
        text(svg, [PANEL[0] / 2.0, top + 20.0], "font-size=\"16\" text-anchor=\"middle\"", &self.title);
        let faint = "stroke=\"#dedede\"";
        for tick in x.ticks() {
            let across = left + (right - left) * x.share(tick);
            path(svg, &[[across, above], [across, below]], faint);
            text(svg, [across, below + 14.0], MIDDLE, &Axis::format(tick));
        }
        for tick in y.ticks() {
            let up = below + (above - below) * y.share(tick);
            path(svg, &[[left, up], [right, up]], faint);
            text(svg, [left - 6.0, up], "font-size=\"14.5\" text-anchor=\"end\"", &Axis::format(tick));
        }
        path(svg, &[[left, above], [left, below], [right, below]], "stroke=\"#c8c8c8\"");
        text(svg, [(left + right) / 2.0, below + 38.0], MIDDLE, self.x);
        let middle = (above + below) / 2.0;
        text(svg, [14.0, middle], &format!("{MIDDLE} transform=\"rotate(-90 14 {middle})\""), self.y);
        for line in &self.lines {
            let dashed = || "stroke=\"#7e7e7e\" stroke-dasharray=\"4\"".to_owned();
            let style = line.look.map_or_else(dashed, |look| look.stroke());
            path(svg, &line.points.iter().map(|&point| at(point)).collect::<Vec<_>>(), &style);
        }
        self.marks.iter().for_each(|mark| mark.look.draw(svg, at(mark.at)));
        label(svg, top, self.labels.iter().map(|(point, name)| (at(*point), name.as_str())).collect());
        top + PANEL[1] + LINE * self.labels.len() as f64
    }
}

/// Puts numbers into the column at the right of a panel, each with a line to its point, and their names below.
fn label(svg: &mut String, top: f64, mut named: Vec<([f64; 2], &str)>) {
    named.sort_by(|([ax, ay], _), ([bx, by], _)| ay.total_cmp(by).then(ax.total_cmp(bx)));
    let heights: Vec<f64> = named.iter().map(|&([_, y], _)| y).collect();
    let column = PANEL[0] - MARGINS[1] + 12.0;
    let heights = moved_apart(&heights, top + PANEL[1] - MARGINS[3]);
    for (number, (&([x, y], name), height)) in named.iter().zip(heights).enumerate() {
        path(svg, &[[x + 7.0, y], [column, y], [column + 12.0, height]], "stroke=\"#c9c9c9\"");
        text(svg, [column + 15.0, height], TEXT, &(number + 1).to_string());
        let line = top + PANEL[1] + LINE * number as f64 + 10.0;
        text(svg, [16.0, line], TEXT, &format!("{}  {name}", number + 1));
    }
}

/// Moves sorted heights down, or up where the column ends, until lines of text do not meet.
fn moved_apart(heights: &[f64], bottom: f64) -> Vec<f64> {
    let count = heights.len();
    let mut above = f64::NEG_INFINITY;
    let place = |(number, &height): (usize, &f64)| {
        let lowest = bottom - STEP * (count - 1 - number) as f64;
        above = height.max(above + STEP).min(lowest);
        above
    };
    heights.iter().enumerate().map(place).collect()
}

impl Look {
    /// Returns the attributes of a line of this look.
    fn stroke(self) -> String {
        format!("stroke=\"{}\" stroke-width=\"2\"", COLOURS[self.kind % COLOURS.len()])
    }

    /// Draws a mark around a point.
    fn draw(self, svg: &mut String, [x, y]: [f64; 2]) {
        let corners = SHAPES[self.kind % SHAPES.len()].iter().map(|[dx, dy]| [x + dx, y + dy]);
        let fill = if self.is_filled { COLOURS[self.kind % COLOURS.len()] } else { "#ffffff" };
        let (points, stroke) = (pixels(&corners.collect::<Vec<_>>()), self.stroke());
        let _ = writeln!(svg, "<polygon points=\"{points}\" fill=\"{fill}\" fill-opacity=\"0.8\" {stroke}/>");
    }
}

/// The attributes of usual text, and of text around a middle.
const TEXT: &str = "font-size=\"14.5\"";
const MIDDLE: &str = "font-size=\"14.5\" text-anchor=\"middle\"";

fn text(svg: &mut String, [x, y]: [f64; 2], style: &str, content: &str) {
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" dy=\"0.35em\" {style}>{}</text>", escape(content));
}

fn path(svg: &mut String, points: &[[f64; 2]], style: &str) {
    let _ = writeln!(svg, "<polyline points=\"{}\" fill=\"none\" {style}/>", pixels(points));
}

fn pixels(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Escapes text for an element or an attribute.
pub fn escape(text: &str) -> String {
    let escaped = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        // XML has no way to write most of these.
        c if c.is_control() => "\u{fffd}".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// A logarithmic axis, with room at its lower end for figures that are 0.
struct Axis {
    /// The ends, decimal logarithms.
    ends: [f64; 2],
    /// Whether figures of 0 are at the lower end.
    has_zero: bool,
}

impl Axis {
    /// An axis that holds these figures.
    fn around(figures: impl Iterator<Item = f64>) -> Self {
        let (mut lo, mut hi, mut has_zero) = (f64::INFINITY, f64::NEG_INFINITY, false);
        for figure in figures {
            has_zero |= figure <= 0.0;
            if figure > 0.0 {
                (lo, hi) = (lo.min(figure.log10()), hi.max(figure.log10()));
            }
        }
        // Without figures, or with equal ones only, the axis is a decade long.
        let [lo, hi] = match hi - lo {
            range if range > 0.1 => [lo - 0.05 * range, hi + 0.05 * range],
            range if range >= 0.0 => [lo - 0.5, hi + 0.5],
            _ => [0.0, 1.0],
        };
        let zero = lo - ZERO * (hi - lo);
        Self { ends: [if has_zero { zero } else { lo }, hi], has_zero }
    }

    /// Returns where a figure stands, from 0 at the lower end to 1 at the upper one.
    fn share(&self, figure: f64) -> f64 {
        let place = if figure > 0.0 { figure.log10() } else { self.ends[0] };
        (place - self.ends[0]) / (self.ends[1] - self.ends[0])
    }

    /// Returns round figures to mark.
    fn ticks(&self) -> Vec<f64> {
        let [lo, hi] = self.ends;
        let lo = if self.has_zero { lo + ZERO / (1.0 + ZERO) * (hi - lo) } else { lo };
        let factors: &[f64] = match hi - lo {
            decades if decades > 2.5 => &[1.0],
            decades if decades > 1.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
        };
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        // Parses the decimal, because computed powers of ten may be off by a rounding error.
        let tick = |decade: i32, factor: f64| format!("{factor}e{decade}").parse::<f64>().unwrap_or(f64::NAN);
        let all = decades.flat_map(|decade| factors.iter().map(move |&factor| tick(decade, factor)));
        let all = all.filter(|tick| (lo..=hi).contains(&tick.log10()));
        self.has_zero.then_some(0.0).into_iter().chain(all).collect()
    }

    fn format(figure: f64) -> String {
        match figure {
            0.0 | 0.01..1e4 => format!("{figure}"),
            _ => format!("{figure:e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_round_ticks_within_their_ends() {
        let ticks = |figures: &[f64]| {
            Axis::around(figures.iter().copied()).ticks().into_iter().map(Axis::format).collect::<Vec<_>>()
        };
        assert_eq!(ticks(&[300.0, 9000.0]), ["500", "1000", "2000", "5000", "1e4"]);
        assert_eq!(ticks(&[15.1, 61.0]), ["15", "20", "30", "40", "50", "60"]);
        assert_eq!(ticks(&[0.0, 1e-9, 1e-6]), ["0", "1e-9", "1e-8", "1e-7", "1e-6"]);
        for none in [Axis::around(std::iter::empty()), Axis::around([0.0].into_iter())] {
            assert!(none.share(1.0).is_finite() && none.ticks().iter().all(|tick| tick.is_finite()));
        }
    }

    #[test]
    fn labels_do_not_meet_and_stay_in_their_column() {
        assert_eq!(moved_apart(&[10.0, 11.0, 90.0, 99.0], 100.0), [10.0, 25.0, 85.0, 100.0]);
        assert_eq!(moved_apart(&[], 100.0), [0.0; 0]);
    }

    #[test]
    fn a_figure_is_drawn_with_its_names_escaped() {
        let look = Look { kind: 1, is_filled: false };
        let mark = Mark { at: (0.0, 3.0), look };
        let line = Line { points: vec![(0.0, 3.0), (7.0, 4.0)], look: None };
        let panel = Panel {
            title: "a < b\u{1}".into(),
            x: "bytes",
            y: "time",
            lines: vec![line],
            marks: vec![mark],
            labels: vec![((7.0, 4.0), "last".into())],
        };
        let figure =
            Figure { title: "two".into(), legend: vec![(look, "square".into())], rows: vec![vec![panel]] };
        let text = svg(&[figure]);
        assert!(text.starts_with("<svg") && text.contains("a &lt; b\u{fffd}") && text.contains("last"));
    }
}
