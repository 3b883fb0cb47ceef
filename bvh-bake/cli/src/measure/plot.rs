//! Draws plots as SVG with the library plotters: panels with two logarithmic axes, lines, marks and labels.
//!
//! Panels stand below each other, so that their text can still be read when a page 400 pixels wide shows them. Labels are
//! numbers in a column to the right of their panel, moved apart where they would overlap; the names are below the panel. A
//! thin line leads from each number to its mark. Text is never measured, so no fonts are needed; the reader's program chooses
//! them.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours that people with any colour vision can tell apart (Okabe and Ito), darkened for white paper.
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(179, 90, 0), RGBColor(0, 128, 92), RGBColor(160, 60, 130)];
const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(200, 200, 200);

/// Width of a figure and height of a panel without its names, in pixels.
const PANEL: (u32, u32) = (500, 360);
/// Height of the title of a figure, in pixels.
const TITLE: u32 = 36;
/// Width of the room at the right of a panel for its numbers, in pixels.
const NUMBERS: u32 = 44;
/// Height of a line of the legend or of names, in pixels.
const LINE: u32 = 20;
/// Size of all text but titles. plotters writes a font size of 1/1.24 of it, here 14.5 pixels.
const TEXT: u32 = 18;
/// The least distance between two numbers of the column, in pixels.
const STEP: f64 = 15.0;
/// The part of an axis that is left of its least figure and holds those that are 0, as a fraction of the rest.
const ZERO: f64 = 0.1;

type Error = Box<dyn std::error::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Panels below a title and a legend.
#[derive(Debug, Clone)]
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
///
/// # Errors
/// Returns the error of the drawing library.
pub fn svg(figures: &[Figure]) -> Result<String, Error> {
    let height = figures.iter().map(Figure::height).sum();
    let mut text = String::new();
    {
        let mut rest = SVGBackend::with_string(&mut text, (PANEL.0, height)).into_drawing_area();
        rest.fill(&WHITE)?;
        for figure in figures {
            let (area, below) = rest.split_vertically(figure.height());
            figure.draw(area)?;
            rest = below;
        }
        rest.present()?;
    }
    Ok(text)
}

impl Figure {
    fn height(&self) -> u32 {
        let panels = self.rows.iter().flatten().map(Panel::height).sum::<u32>();
        TITLE + LINE * self.legend.len() as u32 + panels
    }

    fn draw(&self, area: Area<'_>) -> Result<(), Error> {
        area.draw(&Text::new(printable(&self.title), (12, 18), text_style(22)))?;
        let (_, mut rest) = area.split_vertically(TITLE);
        for (look, name) in &self.legend {
            let (line, below) = rest.split_vertically(LINE);
            look.draw(&line, (16, 10))?;
            line.draw(&Text::new(name.clone(), (28, 10), text_style(TEXT)))?;
            rest = below;
        }
        for panel in self.rows.iter().flatten() {
            let (area, below) = rest.split_vertically(panel.height());
            panel.draw(area)?;
            rest = below;
        }
        Ok(())
    }
}

impl Panel {
    fn height(&self) -> u32 {
        PANEL.1 + LINE * self.labels.len() as u32
    }

    fn draw(&self, area: Area<'_>) -> Result<(), Error> {
        let (area, names) = area.split_vertically(PANEL.1);
        let points = || {
            let lines = self.lines.iter().flat_map(|line| line.points.iter().copied());
            lines.chain(self.marks.iter().map(|mark| mark.at))
        };
        let (x, y) =
            (Axis::around(points().map(|point| point.0)), Axis::around(points().map(|point| point.1)));
        let mut chart = ChartBuilder::on(&area)
            .margin(10)
            .margin_right(NUMBERS)
            .caption(printable(&self.title), text_style(20))
            .x_label_area_size(46)
            .y_label_area_size(62)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(FAINT.mix(0.6))
            .axis_style(FAINT)
            .label_style(text_style(TEXT))
            .axis_desc_style(text_style(TEXT))
            .x_desc(self.x)
            .y_desc(self.y)
            .draw()?;
        for line in &self.lines {
            let points = line.points.iter().copied();
            match line.look {
                Some(look) => chart.draw_series(LineSeries::new(points, look.colour().stroke_width(2)))?,
                None => {
                    chart.draw_series(DashedLineSeries::new(points, 4, 4, INK.mix(0.6).stroke_width(1)))?
                }
            };
        }
        let (left, top) = area.get_base_pixel();
        let pixel = |at| {
            let (x, y) = chart.backend_coord(&at);
            (x - left, y - top)
        };
        for mark in &self.marks {
            mark.look.draw(&area, pixel(mark.at))?;
        }
        label([&area, &names], self.labels.iter().map(|(at, name)| (pixel(*at), name.as_str())).collect())
    }
}

/// Puts numbers into the column at the right of a panel, each with a line to its point, and their names below.
fn label([area, names]: [&Area<'_>; 2], mut named: Vec<((i32, i32), &str)>) -> Result<(), Error> {
    named.sort_by_key(|&((x, y), _)| (y, x));
    let heights: Vec<f64> = named.iter().map(|&((_, y), _)| f64::from(y)).collect();
    let column = (PANEL.0 - NUMBERS + 2) as i32;
    let heights = moved_apart(&heights, f64::from(PANEL.1 - 56));
    for (number, (&((x, y), name), height)) in (1..).zip(named.iter().zip(heights)) {
        let height = height as i32;
        area.draw(&PathElement::new([(x + 7, y), (column, y), (column + 12, height)], INK.mix(0.25)))?;
        area.draw(&Text::new(number.to_string(), (column + 15, height), text_style(TEXT)))?;
        let line = (number - 1) * LINE as i32 + 10;
        names.draw(&Text::new(format!("{number}  {}", printable(name)), (16, line), text_style(TEXT)))?;
    }
    Ok(())
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
    fn colour(self) -> RGBColor {
        COLOURS[self.kind % COLOURS.len()]
    }

    /// Draws a mark around a pixel.
    fn draw(self, area: &Area<'_>, (x, y): (i32, i32)) -> Result<(), Error> {
        let corners: &[(i32, i32)] = match self.kind % 3 {
            0 => &[(5, 2), (2, 5), (-2, 5), (-5, 2), (-5, -2), (-2, -5), (2, -5), (5, -2)],
            1 => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
            _ => &[(0, -6), (5, 4), (-5, 4)],
        };
        let mut outline: Vec<(i32, i32)> =
            corners.iter().map(|corner| (x + corner.0, y + corner.1)).collect();
        let fill = if self.is_filled { self.colour().filled() } else { WHITE.mix(0.7).filled() };
        area.draw(&Polygon::new(outline.clone(), fill))?;
        outline.extend_from_within(..1);
        area.draw(&PathElement::new(outline, self.colour().stroke_width(2)))?;
        Ok(())
    }
}

/// A logarithmic axis, with room at its lower end for figures that are 0.
struct Axis {
    /// The ends, decimal logarithms.
    ends: [f64; 2],
    /// Where figures of 0 are, if there are any.
    zero: Option<f64>,
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
        if has_zero {
            Self { ends: [zero, hi], zero: Some(zero) }
        } else {
            Self { ends: [lo, hi], zero: None }
        }
    }

    fn place(&self, figure: f64) -> f64 {
        if figure > 0.0 { figure.log10() } else { self.zero.unwrap_or(self.ends[0]) }
    }

    /// Returns round figures to mark.
    fn ticks(&self) -> Vec<f64> {
        let [lo, hi] = self.ends;
        let lo = if self.zero.is_some() { lo + ZERO / (1.0 + ZERO) * (hi - lo) } else { lo };
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
        self.zero.map(|_| 0.0).into_iter().chain(all).collect()
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, figure: &f64, limit: (i32, i32)) -> i32 {
        let part = (self.place(*figure) - self.ends[0]) / (self.ends[1] - self.ends[0]);
        limit.0 + (part * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks() }
    }

    fn range(&self) -> std::ops::Range<f64> {
        10f64.powf(self.ends[0])..10f64.powf(self.ends[1])
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(figure: &f64) -> String {
        match *figure {
            figure @ (0.0 | 0.01..1e4) => format!("{figure}"),
            figure => format!("{figure:e}"),
        }
    }
}

fn text_style(size: u32) -> TextStyle<'static> {
    TextStyle::from(("sans-serif", size).into_font()).color(&INK).pos(Pos::new(HPos::Left, VPos::Center))
}

/// XML has no way to write control characters.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_round_ticks_within_their_ends() {
        let ticks = |figures: &[f64]| {
            Axis::around(figures.iter().copied()).ticks().iter().map(Axis::format).collect::<Vec<_>>()
        };
        assert_eq!(ticks(&[300.0, 9000.0]), ["500", "1000", "2000", "5000", "1e4"]);
        assert_eq!(ticks(&[15.1, 61.0]), ["15", "20", "30", "40", "50", "60"]);
        assert_eq!(ticks(&[0.0, 1e-9, 1e-6]), ["0", "1e-9", "1e-8", "1e-7", "1e-6"]);
        for none in [Axis::around(std::iter::empty()), Axis::around([0.0].into_iter())] {
            assert!(none.place(1.0).is_finite() && none.ticks().iter().all(|tick| tick.is_finite()));
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
        let text = svg(&[figure]).unwrap();
        assert!(text.starts_with("<svg") && text.contains("a &lt; b\u{fffd}") && text.contains("last"));
    }
}
