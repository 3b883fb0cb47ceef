//! How figures grow with the number of triangles, as slopes between logarithms.
//!
//! A slope of 1 is proportional growth, 0.5 that of the square root. The logarithm has no slope of its own: between
//! 10^3 and 10^7 it is about 0.09.

use super::Measured;
use super::row::{Part, Row};

/// The largest factor by which a size may differ from a tenth of another size and still count as that tenth.
const MAX_TENTH_FACTOR: f64 = 1.5;

/// Adds to each row its growth from a size a tenth as large, and appends one row per line over all its sizes.
pub(super) fn with_slopes(mut measured: Measured) -> Measured {
    let rows = &measured.rows;
    let local: Vec<[Option<f64>; 2]> = rows.iter().map(|row| from_a_tenth(rows, row)).collect();
    for (row, [time, tests]) in measured.rows.iter_mut().zip(local) {
        (row.growth, row.node_growth) = (time, tests);
    }
    let mut over_all: Vec<Row> = Vec::new();
    for row in &measured.rows {
        let line = |row: &Row| (row.without_slabs, row.question, row.gap);
        if over_all.iter().any(|other| line(other) == line(row)) {
            continue;
        }
        let line: Vec<&Row> = measured.rows.iter().filter(|other| other.is_beside(row)).collect();
        let [growth, node_growth] = slopes(&line);
        let (gap, without_slabs) = (row.gap, row.without_slabs);
        let new = Row::new(Part::Growth, None, row.question);
        over_all.push(Row { gap, without_slabs, growth, node_growth, ..new });
    }
    measured.rows.extend(over_all);
    measured
}

fn from_a_tenth(rows: &[Row], row: &Row) -> [Option<f64>; 2] {
    let Some(triangles) = row.triangles() else { return [None; 2] };
    let is_a_tenth = |other: &&Row| {
        let times = other.triangles().map_or(0.0, |fewer| triangles / fewer / 10.0);
        other.is_beside(row) && (1.0 / MAX_TENTH_FACTOR..=MAX_TENTH_FACTOR).contains(&times)
    };
    rows.iter().find(is_a_tenth).map_or([None; 2], |before| slopes(&[before, row]))
}

/// Returns the slopes of times and of node tests.
fn slopes(rows: &[&Row]) -> [Option<f64>; 2] {
    let of = |figure: fn(&Row) -> Option<f64>| {
        let points = rows.iter().filter_map(|row| Some((row.triangles()?, figure(row)?)));
        slope(&points.collect::<Vec<_>>())
    };
    [of(Row::time), of(|row| row.work.node_tests)]
}

/// Returns the slope of the least-squares line through the logarithms of points; `None` for fewer than two sizes, or where
/// a figure is 0.
pub(super) fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.iter().any(|&(x, y)| x <= 0.0 || y <= 0.0) {
        return None;
    }
    let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (mean_x, mean_y) =
        (logs.iter().map(|p| p.0).sum::<f64>() / count, logs.iter().map(|p| p.1).sum::<f64>() / count);
    let above: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let below: f64 = logs.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    (below > 0.0).then_some(above / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_have_their_slopes() {
        let points: Vec<(f64, f64)> = [1e3, 3e3, 1e4, 1e7].map(|x| (x, 5.0 * f64::sqrt(x))).to_vec();
        assert!((slope(&points).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(slope(&[(10.0, 3.0), (100.0, 3.0)]), Some(0.0));
        for none in [&points[..1], &[], &[(1.0, 0.0), (2.0, 1.0)]] {
            assert_eq!(slope(none), None);
        }
    }
}
