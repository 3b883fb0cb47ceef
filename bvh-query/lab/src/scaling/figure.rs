//! The plots: times and node tests against triangles, with dashed lines for distances without turning slabs and to
//! compare growth with.

use super::row::{Part, Row, gap_name};
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};

/// Points of a dashed curve.
const CURVE_POINTS: usize = 24;

/// Returns both plots.
pub(super) fn figure(rows: &[Row]) -> Figure {
    let lines = lines(rows);
    let mut legend: Vec<(Look, String)> = Vec::new();
    for line in &lines {
        let (look, gap) = (look(rows, line[0]), line[0].gap.unwrap_or_default());
        if look.is_filled && !line[0].without_slabs {
            legend.push((look, format!("gap {} of the diagonal", gap_name(gap))));
        }
    }
    legend.push((Look { kind: 0, is_filled: true }, "filled: distance".into()));
    legend.push((Look { kind: 0, is_filled: false }, "empty: contact".into()));
    let times =
        panel(rows, &lines, "Time", "median time per query, \u{b5}s", |row| Some(row.time()? / 1000.0));
    let tests = panel(rows, &lines, "Work", "node tests per query, mean", |row| row.work.node_tests);
    Figure { title: "A ball against itself, warm".into(), legend, rows: vec![vec![times, tests]] }
}

/// The rows of one question and gap, by size.
fn lines(rows: &[Row]) -> Vec<Vec<&Row>> {
    let mut lines: Vec<Vec<&Row>> = Vec::new();
    for row in rows.iter().filter(|row| row.part == Part::Size) {
        match lines.iter_mut().find(|line| line[0].is_beside(row)) {
            Some(line) => line.push(row),
            None => lines.push(vec![row]),
        }
    }
    lines
}

/// Gaps differ in colour and shape, questions in whether marks are filled.
fn look(rows: &[Row], row: &Row) -> Look {
    let mut gaps: Vec<f64> =
        rows.iter().filter(|row| row.part == Part::Size).filter_map(|row| row.gap).collect();
    gaps.sort_unstable_by(f64::total_cmp);
    gaps.dedup();
    let kind = gaps.iter().position(|&gap| Some(gap) == row.gap).unwrap_or(0);
    Look { kind, is_filled: row.question == "distance" }
}

fn panel(
    rows: &[Row],
    lines: &[Vec<&Row>],
    title: &str,
    y: &'static str,
    figure: fn(&Row) -> Option<f64>,
) -> Panel {
    let mut panel = Panel {
        title: title.to_owned(),
        x: "triangles",
        y,
        lines: Vec::new(),
        marks: Vec::new(),
        labels: Vec::new(),
    };
    let mut starts = Vec::new();
    for line in lines {
        // A figure of 0 has no place on a logarithmic axis.
        let point = |row: &&Row| Some((row.triangles()?, figure(row).filter(|&figure| figure > 0.0)?));
        let points: Vec<_> = line.iter().filter_map(point).collect();
        let (Some(&first), Some(&last)) = (points.first(), points.last()) else { continue };
        starts.push(first.1);
        let look = look(rows, line[0]);
        let gap = gap_name(line[0].gap.unwrap_or_default());
        if line[0].without_slabs {
            // Most lines for contact would lie on those with slabs.
            if look.is_filled {
                panel.labels.push((last, format!("without slabs, {gap}")));
                panel.lines.push(Line { points, look: None });
            }
            continue;
        }
        panel.labels.push((last, format!("{}, {gap}", line[0].question)));
        panel.marks.extend(points.iter().map(|&at| Mark { at, look }));
        panel.lines.push(Line { points, look: Some(look) });
    }
    for (name, points) in curves(&panel.marks, &starts) {
        panel.labels.extend(points.last().map(|&last| (last, name.to_owned())));
        panel.lines.push(Line { points, look: None });
    }
    panel
}

/// Returns what growth of the square root and of the logarithm would look like, from the geometric mean of where lines
/// start.
fn curves(marks: &[Mark], starts: &[f64]) -> Vec<(&'static str, Vec<(f64, f64)>)> {
    let sizes = marks.iter().map(|mark| mark.at.0);
    let (from, to) = sizes.fold((f64::INFINITY, 0.0f64), |(lo, hi), n| (lo.min(n), hi.max(n)));
    if from >= to {
        return Vec::new();
    }
    let start = (starts.iter().map(|start| start.ln()).sum::<f64>() / starts.len() as f64).exp();
    let curve = |growth: fn(f64) -> f64| {
        let at = |number: usize| from * (to / from).powf(number as f64 / CURVE_POINTS as f64);
        (0..=CURVE_POINTS).map(|number| (at(number), start * growth(at(number)) / growth(from))).collect()
    };
    vec![("square root", curve(f64::sqrt)), ("logarithm", curve(f64::ln))]
}
