//! Tables of what was counted, and an estimate of time.

use super::bounds::Frames;
use super::forms::upper_form;
use super::scene::{GAP_NAMES, Row};
use super::variant::TODAY;
use super::vector::Vector;
use super::walk::Test;
use bvh_format::kdop::{DirectionSet, FACTORS};
use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

/// Nanoseconds per node test with 3, 7 and 13 slabs: what `notebook/trees.md` has for 13, and in proportion to the times of
/// profiles in `notebook/layouts.md` for fewer.
const NODE_COSTS: [f64; 3] = [75.0, 110.0, 151.0];
/// Nanoseconds per packet test, for contact and for distance (`notebook/trees.md`).
const PACKET_COSTS: [f64; 2] = [100.0, 170.0];
/// Nanoseconds per pair that takes the test of turning slabs (`notebook/walks.md`).
const TURNING_COST: f64 = 25.0;
/// Nanoseconds to align a treelet of 13 slabs with one more frame: 75 cycles at 3 GHz.
const ALIGNMENT_COST: f64 = 25.0;
/// Nanoseconds to make the forms of two frames of 13 slabs each for one another: a guess for vector code, and the measured
/// scalar code of [`set_up`].
const FRAME_PAIR_COSTS: [f64; 2] = [100.0, 220.0];

impl Row {
    /// Returns nanoseconds per query. The cost of a node test includes the alignments that `today` makes.
    fn cost(&self, today: &Self, frame_pair_cost: f64) -> f64 {
        let slabs = self.variant.making.set.slabs();
        // Nine products of axes make nearly as many directions of three slabs as there are of thirteen.
        let products = usize::from(self.variant.test == Test::Products);
        let node = NODE_COSTS[(usize::from(slabs > 3) + usize::from(slabs > 7)).max(2 * products)];
        let share = slabs as f64 / 13.0;
        let frames = (self.alignments - today.alignments).max(0.0) * ALIGNMENT_COST
            + (self.frame_pairs - today.frame_pairs).max(0.0) * frame_pair_cost;
        node * self.node_tests
            + PACKET_COSTS[usize::from(self.is_distance)] * self.packet_tests
            + TURNING_COST * self.turning_pairs
            + share * frames
    }

    /// Returns the row of what the format has about the same poses.
    fn today<'a>(&self, rows: &'a [Self]) -> &'a Self {
        let same = |row: &&Self| {
            row.pair == self.pair
                && (row.gap, row.is_distance) == (self.gap, self.is_distance)
                && row.variant == super::variant::VARIANTS[TODAY]
        };
        rows.iter().find(same).unwrap_or_else(|| unreachable!("all variants walk in all poses"))
    }

    fn question(&self) -> &'static str {
        if self.is_distance { "distance" } else { "collide" }
    }
}

/// Returns all rows as CSV.
pub(super) fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "kind,pair,triangles,variant,question,gap,node_tests,median_node_tests,packet_tests,turning_pairs,\
         searched_pairs,directions,frame_pairs,alignments,given_up,node_bytes_per_triangle,turned_frames,least_cost_ns,cost_ns\n",
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{},{},{},\"{}\",{},{},{:.1},{},{:.1},{:.1},{:.1},{:.1},{:.1},{:.1},{},{:.2},{:.3},{:.0},{:.0}",
            row.kind,
            row.pair,
            row.triangles,
            row.variant.name,
            row.question(),
            GAP_NAMES[row.gap],
            row.node_tests,
            row.median_node_tests,
            row.packet_tests,
            row.turning_pairs,
            row.searched_pairs,
            row.directions,
            row.frame_pairs,
            row.alignments,
            row.given_up,
            row.bytes,
            row.turned_frames,
            row.cost(row.today(rows), FRAME_PAIR_COSTS[0]),
            row.cost(row.today(rows), FRAME_PAIR_COSTS[1])
        );
    }
    text
}

/// Returns a table per kind of mesh and question, with one line per variant and one column per gap.
pub(super) fn page(rows: &[Row]) -> String {
    let mut groups: Vec<(&str, bool)> = Vec::new();
    for row in rows {
        let group = (row.kind.as_str(), row.is_distance);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    let mut text = String::new();
    for (kind, is_distance) in groups {
        let question = if is_distance { "distance" } else { "collide" };
        let _ = writeln!(text, "\n## {kind}: {question}\n\n| bounds | bytes | {} |", GAP_NAMES.join(" | "));
        let _ = writeln!(text, "|---|---{}|", "|---".repeat(GAP_NAMES.len()));
        for variant in super::variant::VARIANTS {
            let of_gap = |gap: usize| -> Vec<&Row> {
                let asked = |row: &&Row| {
                    row.kind == kind
                        && (row.gap, row.is_distance) == (gap, is_distance)
                        && row.variant == variant
                };
                rows.iter().filter(asked).collect()
            };
            let bytes = geometric_mean(of_gap(0).iter().map(|row| row.bytes));
            let cells = (0..GAP_NAMES.len()).map(|gap| {
                let found = of_gap(gap);
                let mean = |of: &dyn Fn(&Row) -> f64| geometric_mean(found.iter().map(|row| of(row)));
                let mut cell =
                    format!("{:.0} / {:.0}", mean(&|row| row.node_tests), mean(&|row| row.packet_tests));
                if variant.bytes[0] > 0 {
                    let ratio = |forms: f64| {
                        geometric_mean(found.iter().map(|row| {
                            let today = row.today(rows);
                            row.cost(today, forms) / today.cost(today, forms)
                        }))
                    };
                    let pairs = mean(&|row| row.frame_pairs);
                    let [least, most] = FRAME_PAIR_COSTS.map(ratio);
                    let _ = match variant.making.frames {
                        Frames::Object => write!(cell, ": {most:.2}"),
                        _ => write!(cell, " / {pairs:.0}: {least:.2} to {most:.2}"),
                    };
                }
                if found.iter().any(|row| row.given_up > 0) {
                    cell.push('+');
                }
                cell
            });
            let cells: Vec<String> = cells.collect();
            let _ = writeln!(text, "| {} | {bytes:.1} | {} |", variant.name, cells.join(" | "));
        }
    }
    if rows.iter().any(|row| row.kind == "ball") {
        text.push_str(&growth(rows));
    }
    text
}

/// Returns the exponents of node tests and of the least estimate of time by the number of triangles of balls, by least
/// squares.
fn growth(rows: &[Row]) -> String {
    let mut text = String::from(
        "\n## Growth on the ball: exponents of node tests and of the least estimate of time\n\n| bounds |",
    );
    for question in ["collide", "distance"] {
        for gap in GAP_NAMES {
            let _ = write!(text, " {question} {gap} |");
        }
    }
    let _ = writeln!(text, "\n|---{}|", "|---".repeat(2 * GAP_NAMES.len()));
    for variant in super::variant::VARIANTS {
        let _ = write!(text, "| {} |", variant.name);
        for is_distance in [false, true] {
            for gap in 0..GAP_NAMES.len() {
                let balls: Vec<&Row> = (rows.iter())
                    .filter(|row| row.kind == "ball" && row.variant == variant)
                    .filter(|row| (row.gap, row.is_distance) == (gap, is_distance))
                    .collect();
                let slope = |of: &dyn Fn(&Row) -> f64| {
                    slope(balls.iter().map(|row| [f64::from(row.triangles).ln(), of(row).max(1.0).ln()]))
                };
                let _ = write!(
                    text,
                    " {:.2}, {:.2} |",
                    slope(&|row| row.node_tests),
                    slope(&|row| row.cost(row.today(rows), FRAME_PAIR_COSTS[0]))
                );
            }
        }
        text.push('\n');
    }
    text
}

/// Returns the slope of the line of least squares.
fn slope(points: impl Iterator<Item = [f64; 2]>) -> f64 {
    let points: Vec<[f64; 2]> = points.collect();
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let squares: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>() / squares
}

/// Returns the geometric mean; numbers below 1 count as they are, and 0 as a tenth.
fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let logarithms: Vec<f64> = values.map(|value| value.max(0.1).ln()).collect();
    (logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64).exp()
}

/// Measures how long the forms of two frames take that see each other, without vector code.
pub(super) fn set_up() -> String {
    const ROUNDS: u32 = 100_000;
    let mut text = String::from("Forms of both frames for each other, scalar code:");
    for set in [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26] {
        let mut rotation: [Vector; 3] = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
        let start = Instant::now();
        for _ in 0..ROUNDS {
            rotation = black_box(rotation);
            for direction in &FACTORS[..set.slabs()] {
                for turned in [super::vector::turned(&rotation, *direction), columns(&rotation, *direction)] {
                    black_box(upper_form(turned, set));
                }
            }
        }
        let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / f64::from(ROUNDS);
        let _ = write!(text, " {} slabs {nanoseconds:.0} ns;", set.slabs());
    }
    text.push('\n');
    text
}

fn columns(rows: &[Vector; 3], v: Vector) -> Vector {
    [0, 1, 2].map(|i| rows[0][i] * v[0] + rows[1][i] * v[1] + rows[2][i] * v[2])
}
