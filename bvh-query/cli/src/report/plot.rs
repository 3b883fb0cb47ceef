//! Draws plots as SVG: panels with two logarithmic axes, series of marks, and labels.
//!
//! Panels stand below each other, so that their text can still be read when a page 400 pixels wide shows them. Labels are
//! numbers in a column to the right of their panel, moved apart where they would overlap; the names are below the panel. A
//! thin line leads from each number to its mark. Text is never measured, so no fonts are needed; the reader's program chooses
//! them.

use crate::console::escape;

/// Colours that people with any colour vision can tell apart (Okabe and Ito), darkened for white paper.
const COLOURS: [&str; 4] = ["#0072b2", "#b35a00", "#00805c", "#a03c82"];
/// The corners of the mark of each colour around its middle, in pixels.
const SHAPES: [&[[f64; 2]]; 4] = [
    &[[5.0, 2.0], [2.0, 5.0], [-2.0, 5.0], [-5.0, 2.0], [-5.0, -2.0], [-2.0, -5.0], [2.0, -5.0], [5.0, -2.0]],
    &[[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]],
    &[[0.0, -6.0], [5.0, 4.0], [-5.0, 4.0]],
    &[[0.0, -3.0], [3.0, 0.0], [0.0, 3.0], [-3.0, 0.0]],
];

/// Width of a figure and height of a panel without its names, in pixels.
const PANEL: [f64; 2] = [500.0, 360.0];
/// What is left free around the axes of a panel, in pixels: left, right, above and below.
const MARGINS: [f64; 4] = [72.0, 54.0, 40.0, 56.0];
/// Height of a line of the legend or of names, in pixels.
const LINE: f64 = 20.0;
/// The least distance between two numbers of the column, in pixels.
const STEP: f64 = 15.0;
/// The part of an axis that is left of its least figure and holds those that are 0, as a fraction of the rest.
const ZERO: f64 = 0.1;

/// One plot.
#[derive(Debug)]
pub(super) struct Panel {
    pub(super) title: String,
    /// What is on the axis to the right, and on the axis upwards, with their units.
    pub(super) x: &'static str,
    pub(super) y: &'static str,
    /// What is shown, each with its own colour. The last series is on top.
    pub(super) series: Vec<Series>,
}

/// Marks of one kind.
#[derive(Debug)]
pub(super) struct Series {
    /// Its name in the legend.
    pub(super) name: &'static str,
    /// Whether a line leads from mark to mark.
    pub(super) is_joined: bool,
    /// The points, and their names where they are named. A figure of 0 stands at the left end of the axis to the right; it has
    /// no place on the other axis.
    pub(super) points: Vec<((f64, f64), Option<String>)>,
}

/// Draws groups of panels below each other. The panels of a group have series of the same names.
pub(super) fn svg(groups: &[&[Panel]]) -> String {
    let (mut body, mut top) = (String::new(), 0.0);
    for group in groups {
        let series = group.first().map_or(&[][..], |panel| &panel.series);
        for (kind, series) in series.iter().enumerate() {
            body += &mark(kind, [16.0, top + 10.0]);
            body += &text([28.0, top + 10.0], TEXT, series.name);
            top += LINE;
        }
        group.iter().for_each(|panel| top = panel.draw(&mut body, top));
    }
    let width = PANEL[0];
    format!(
        "<svg width=\"{width}\" height=\"{top}\" viewBox=\"0 0 {width} {top}\" xmlns=\"http://www.w3.org/2000/svg\" \
         font-family=\"sans-serif\" fill=\"#282828\">\n<rect width=\"{width}\" height=\"{top}\" \
         fill=\"#ffffff\"/>\n{body}</svg>\n"
    )
}

impl Panel {
    /// Draws the panel below `top`, and returns where it ends.
    fn draw(&self, svg: &mut String, top: f64) -> f64 {
        let [left, right, above, below] = MARGINS;
        let [left, right] = [left, PANEL[0] - right];
        let [above, below] = [top + above, top + PANEL[1] - below];
        let points = || self.series.iter().flat_map(|series| series.points.iter());
        let (x, y) = (Axis::around(points().map(|of| of.0.0)), Axis::around(points().map(|of| of.0.1)));
        let across = |figure| left + (right - left) * x.share(figure);
        let up = |figure| below + (above - below) * y.share(figure);
        let at = |(x, y): (f64, f64)| [across(x), up(y)];
        *svg += &text([PANEL[0] / 2.0, top + 20.0], "font-size=\"16\" text-anchor=\"middle\"", &self.title);
        for tick in x.ticks() {
            *svg += &path(&[[across(tick), above], [across(tick), below]], FAINT);
            *svg += &text([across(tick), below + 14.0], MIDDLE, &Axis::format(tick));
        }
        for tick in y.ticks() {
            *svg += &path(&[[left, up(tick)], [right, up(tick)]], FAINT);
            let style = "font-size=\"14.5\" text-anchor=\"end\"";
            *svg += &text([left - 6.0, up(tick)], style, &Axis::format(tick));
        }
        *svg += &path(&[[left, above], [left, below], [right, below]], "stroke=\"#c8c8c8\"");
        *svg += &text([(left + right) / 2.0, below + 38.0], MIDDLE, self.x);
        let middle = (above + below) / 2.0;
        *svg += &text([14.0, middle], &format!("{MIDDLE} transform=\"rotate(-90 14 {middle})\""), self.y);
        for (kind, series) in self.series.iter().enumerate() {
            let points: Vec<[f64; 2]> = series.points.iter().map(|&(point, _)| at(point)).collect();
            if series.is_joined {
                *svg += &path(&points, &format!("stroke=\"{}\"", COLOURS[kind % COLOURS.len()]));
            }
            points.into_iter().for_each(|point| *svg += &mark(kind, point));
        }
        let mut named: Vec<([f64; 2], &str)> =
            points().filter_map(|(point, name)| Some((at(*point), name.as_deref()?))).collect();
        named.sort_by(|([ax, ay], _), ([bx, by], _)| ay.total_cmp(by).then(ax.total_cmp(bx)));
        let heights: Vec<f64> = named.iter().map(|&([_, y], _)| y).collect();
        let heights = moved_apart(&heights, below);
        // The column of numbers, each with a line to its point, and the names below.
        let (column, mut end) = (right + 12.0, top + PANEL[1]);
        for (number, (([x, y], name), height)) in (1..).zip(named.into_iter().zip(heights)) {
            *svg += &path(&[[x + 7.0, y], [column, y], [column + 12.0, height]], "stroke=\"#c9c9c9\"");
            *svg += &text([column + 15.0, height], TEXT, &format!("{number}"));
            *svg += &text([16.0, end + 10.0], TEXT, &format!("{number}  {name}"));
            end += LINE;
        }
        end
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

/// The attributes of faint lines, of usual text, and of text around a middle.
const FAINT: &str = "stroke=\"#dedede\"";
const TEXT: &str = "font-size=\"14.5\"";
const MIDDLE: &str = "font-size=\"14.5\" text-anchor=\"middle\"";

fn text([x, y]: [f64; 2], style: &str, content: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" dy=\"0.35em\" {style}>{}</text>\n", escape(content))
}

fn path(points: &[[f64; 2]], style: &str) -> String {
    format!("<polyline points=\"{}\" fill=\"none\" {style}/>\n", pixels(points))
}

/// Draws a mark of a series around a point.
fn mark(kind: usize, [x, y]: [f64; 2]) -> String {
    let (shape, colour) = (SHAPES[kind % SHAPES.len()], COLOURS[kind % COLOURS.len()]);
    let corners = pixels(&shape.iter().map(|[dx, dy]| [x + dx, y + dy]).collect::<Vec<_>>());
    format!("<polygon points=\"{corners}\" fill=\"{colour}\" fill-opacity=\"0.6\" stroke=\"{colour}\"/>\n")
}

fn pixels(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
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
        let points = vec![((0.0, 3.0), None), ((7.0, 4.0), Some("last".into()))];
        let series = vec![Series { name: "square", is_joined: true, points }];
        let panel = Panel { title: "a < b\u{1}".into(), x: "bytes", y: "time", series };
        let text = svg(&[&[panel]]);
        assert!(text.starts_with("<svg") && text.contains("a &lt; b\u{fffd}") && text.contains("last"));
        assert_eq!(text.matches("<polygon").count(), 3);
    }
}
