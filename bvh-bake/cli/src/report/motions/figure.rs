//! The plots of a pair: time against the share of contacts missed, and against how late the others are found.

use super::Report;
use super::method::Method;
use super::row::Row;
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};
use cbvh_measure::table::whole;

const TIME: &str = "median time per motion, \u{b5}s";

/// Ways to ask that share a line and a look: which ones, and their name.
type WaysToAsk = (fn(Method) -> bool, &'static str);

const KINDS: [WaysToAsk; 4] = [
    (|method| matches!(method, Method::Ordered(_)), "samples in the order of time"),
    (|method| matches!(method, Method::Spread(_)), "samples in a spread order"),
    (|method| method == Method::Motion, "certified: first contact"),
    (|method| method == Method::IsFree, "certified: any contact"),
];

/// Returns the plots of a pair.
pub(super) fn of_pair(report: &Report, pair: &str) -> Figure {
    let rows: Vec<&Row> = report.of(pair).collect();
    let missed = panel(
        format!("{pair}: time against contacts missed"),
        "contacts missed, % of the certified ones",
        &rows,
        |row| row.missed_share(),
    );
    let late = panel(
        format!("{pair}: time against how late contacts are found"),
        "late in the median, % of the way",
        &rows,
        |row| row.errors.late_median,
    );
    let legend = KINDS.iter().enumerate().map(|(kind, (_, name))| (look(kind), (*name).to_owned()));
    Figure { title: pair.to_owned(), legend: legend.collect(), rows: vec![vec![missed, late]] }
}

/// Returns a plot of time against an error that is a fraction.
fn panel(title: String, x: &'static str, rows: &[&Row], error: fn(&Row) -> Option<f64>) -> Panel {
    let mut panel = Panel { title, x, y: TIME, lines: Vec::new(), marks: Vec::new(), labels: Vec::new() };
    for (kind, (is_of_kind, _)) in KINDS.iter().enumerate() {
        let points: Vec<((f64, f64), &Row)> = rows
            .iter()
            .filter(|row| is_of_kind(row.method))
            .filter_map(|row| Some(((100.0 * error(row)?, row.nanoseconds()? / 1000.0), *row)))
            .collect();
        panel.marks.extend(points.iter().map(|&(at, _)| Mark { at, look: look(kind) }));
        panel.labels.extend(points.iter().map(|&(at, row)| (at, label(row.method))));
        let points = points.into_iter().map(|(at, _)| at).collect();
        panel.lines.push(Line { points, look: Some(look(kind)) });
    }
    panel
}

fn label(method: Method) -> String {
    match method {
        Method::Ordered(samples) => whole(samples.into()),
        Method::Spread(samples) => format!("{}, spread", whole(samples.into())),
        Method::Motion => "first contact".to_owned(),
        Method::IsFree => "any contact".to_owned(),
    }
}

fn look(kind: usize) -> Look {
    Look { kind, is_filled: true }
}
