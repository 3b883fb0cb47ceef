//! A closed ball of radius about 1 with bumps, in any number of triangles.
//!
//! Its triangles form a grid of rows and columns and become smaller towards the poles. The bumps are the same at every
//! size: more triangles follow the same surface more closely.

use libm::{cos, sin};
use std::f64::consts::{PI, TAU};

/// The least and the largest distance of a vertex from the centre, widened by more than rounding adds.
pub const RADII: [f64; 2] = [0.899, 1.101];

/// Returns the positions of the vertices, and the triangles as indices, of a ball of about this many triangles, at least
/// eight.
pub fn ball(triangles: u64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    // A ball has 4 rows (rows - 1) triangles.
    let rows = ((1.0 + (1.0 + triangles as f64).sqrt()) / 2.0).round().max(2.0) as u32;
    let columns = 2 * rows;
    let point = |row: u32, column: u32| {
        let polar = PI * f64::from(row) / f64::from(rows);
        let around = TAU * f64::from(column) / f64::from(columns);
        // The functions of the standard library are those of the system, and differ between systems.
        let bump = 1.0 + 0.1 * sin(5.0 * polar) * cos(7.0 * around);
        let unit = [sin(polar) * cos(around), sin(polar) * sin(around), cos(polar)];
        // Coordinates are `f32` numbers, so that storing moves nothing.
        unit.map(|c| f64::from((bump * c) as f32))
    };
    let inner = (1..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let mut positions = vec![[0.0, 0.0, 1.0]];
    positions.extend(inner.map(|(row, column)| point(row, column)));
    positions.push([0.0, 0.0, -1.0]);
    let last = positions.len() as u32 - 1;
    let at = |row: u32, column: u32| 1 + (row - 1) * columns + column % columns;
    let mut triangles = Vec::new();
    for column in 0..columns {
        triangles.push([0, at(1, column), at(1, column + 1)]);
        triangles.push([last, at(rows - 1, column + 1), at(rows - 1, column)]);
        for row in 1..rows - 1 {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    (positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn each_edge_is_there_once_each_way() {
        for target in [8, 1000, 3000] {
            let (positions, triangles) = ball(target);
            let ways = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
            let edges: HashSet<(u32, u32)> = ways.collect();
            let count = triangles.len();
            assert_eq!(edges.len(), 3 * count);
            assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
            // This is Euler's formula for the sphere.
            assert_eq!(positions.len() + count, 3 * count / 2 + 2);
            assert!(positions.iter().all(|p| {
                let radius = p.iter().map(|c| c * c).sum::<f64>().sqrt();
                (RADII[0]..=RADII[1]).contains(&radius)
            }));
        }
        for target in [1000u64, 3000, 10_000, 100_000] {
            let count = ball(target).1.len() as u64;
            assert!(count.abs_diff(target) <= target / 20, "{count} for {target}");
        }
    }
}
