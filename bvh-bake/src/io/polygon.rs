//! Cuts 3D polygons into triangles that cover them and nothing else.
//!
//! A polygon is projected along the dominant axis of its Newell normal (Sutherland, Sproull and Schumacker
//! 1974; Tampieri, Graphics Gems III): dropping a coordinate rounds nothing. Triangles pass through. A quad
//! is cut along the diagonal that lies inside it. Larger ones go to ear clipping (`earcut`), since a fan
//! would cover area outside a concave one. Ear clipping leaves out vertices that lie on an edge in
//! projection; where such a vertex lies off that edge in space, the triangle between them is put back.
//!
//! A polygon without area (Newell normal zero or not finite, or nothing left to clip) becomes a fan, which
//! keeps the points and segments that it is. So does a long one that crosses itself: it has no inside that
//! all agree on, a fan covers every point that it winds around, and clipping such polygons takes cubic time.
//! The same input always gives the same triangles.

use super::error::{Fault, Place};
use crate::mesh::MAX_TRIANGLES;
use earcut::Earcut;

/// The most corners of a polygon: clipping takes up to quadratic time.
pub(crate) const MAX_CORNERS: usize = 1 << 16;
/// Polygons of more corners than this are clipped only if they don't cross themselves.
const MAX_TANGLED: usize = 256;
/// How often a long polygon may come back to one point. A hole that is reached over a bridge takes two
/// visits.
const MAX_VISITS: usize = 8;

/// Triangulates polygons given as one run of corners and the number of corners of each; `arities` empty means
/// that all are triangles. Corners must be in range of `positions`.
pub(crate) fn triangulate(
    positions: &[[f64; 3]],
    corners: Vec<u32>,
    arities: &[u32],
) -> Result<Vec<[u32; 3]>, Fault> {
    if arities.is_empty() {
        return Ok(corners.as_chunks::<3>().0.to_vec());
    }
    let mut triangles = Vec::with_capacity(corners.len().saturating_sub(2 * arities.len()));
    let mut cutter = Cutter::default();
    let mut rest = &corners[..];
    for &arity in arities {
        let (polygon, after) = rest.split_at((arity as usize).min(rest.len()));
        rest = after;
        if polygon.len() > MAX_CORNERS {
            return Err(Fault::Limit {
                place: Place::File,
                most: MAX_CORNERS as u64,
                what: "corners in a polygon",
            });
        }
        cutter.cut(positions, polygon, &mut triangles);
    }
    if triangles.len() as u64 > MAX_TRIANGLES {
        return Err(Fault::Limit { place: Place::File, most: MAX_TRIANGLES, what: "triangles" });
    }
    Ok(triangles)
}

/// Scratch memory for cutting one polygon after another.
#[derive(Default)]
pub(crate) struct Cutter {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
    kept: Vec<bool>,
}

impl Cutter {
    /// Cuts a polygon given by the positions of its corners, and gives the triangles one after the other, as places
    /// among the corners.
    pub(crate) fn cut_polygon<E>(
        &mut self,
        corners: &[[f64; 3]],
        mut give: impl FnMut([usize; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        if corners.len() == 3 {
            return give([0, 1, 2]);
        }
        let polygon: Vec<u32> = (0..corners.len() as u32).collect();
        let mut triangles = Vec::new();
        self.cut(corners, &polygon, &mut triangles);
        triangles.into_iter().try_for_each(|triangle| give(triangle.map(|corner| corner as usize)))
    }

    fn cut(&mut self, positions: &[[f64; 3]], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
        match *polygon {
            [] | [_] | [_, _] => {}
            [a, b, c] => triangles.push([a, b, c]),
            _ if !self.flatten(positions, polygon) => fan(polygon, triangles),
            [a, b, c, d] => {
                let [fa, fb, fc, fd] = [self.flat[0], self.flat[1], self.flat[2], self.flat[3]];
                let along_ac = doubled_area(fa, fb, fc) > 0.0 && doubled_area(fc, fd, fa) > 0.0;
                let along_bd = doubled_area(fb, fc, fd) > 0.0 && doubled_area(fd, fa, fb) > 0.0;
                if along_bd && !along_ac {
                    triangles.extend([[b, c, d], [d, a, b]]);
                } else {
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            _ if polygon.len() > MAX_TANGLED && is_tangled(&self.flat) => fan(polygon, triangles),
            _ => self.clip(positions, polygon, triangles),
        }
    }

    fn clip(&mut self, positions: &[[f64; 3]], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
        self.earcut.earcut_slice::<u32>(&self.flat, &[], &mut self.ears);
        let ears = self.ears.as_chunks::<3>().0;
        // Ear clipping has its own winding; the polygon's is positive here, and should stay.
        let area = |ear: &[u32; 3]| {
            let [a, b, c] = ear.map(|corner| self.flat[corner as usize]);
            doubled_area(a, b, c)
        };
        let flip = ears.iter().map(area).sum::<f64>() < 0.0;
        triangles.extend(ears.iter().map(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|corner| polygon[corner as usize]);
            if flip { [a, c, b] } else { [a, b, c] }
        }));

        self.kept.clear();
        self.kept.resize(polygon.len(), false);
        self.ears.iter().for_each(|&corner| self.kept[corner as usize] = true);
        let Some(start) = self.kept.iter().position(|&kept| kept) else {
            return fan(polygon, triangles);
        };
        let ring = |step: usize| (start + step) % polygon.len();
        let mut last = polygon[start];
        for step in 1..polygon.len() {
            let (here, next) = (polygon[ring(step)], polygon[ring(step + 1)]);
            if self.kept[ring(step)] {
                last = here;
            } else if has_area([last, here, next].map(|corner| positions[corner as usize])) {
                triangles.push([last, here, next]);
            }
        }
    }

    /// Projects the polygon into `self.flat`, counter-clockwise. False when it has no area.
    fn flatten(&mut self, positions: &[[f64; 3]], polygon: &[u32]) -> bool {
        let at = |corner: u32| positions[corner as usize];
        let origin = at(polygon[0]);
        let relative =
            |corner: u32| -> [f64; 3] { std::array::from_fn(|axis| at(corner)[axis] - origin[axis]) };
        let mut normal = [0.0; 3];
        let mut previous = relative(polygon[polygon.len() - 1]);
        for &corner in polygon {
            let current = relative(corner);
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                normal[axis] += (previous[u] - current[u]) * (previous[v] + current[v]);
            }
            previous = current;
        }
        let mut dominant = 0;
        for axis in 1..3 {
            if normal[axis].abs() > normal[dominant].abs() {
                dominant = axis;
            }
        }
        if !normal.iter().all(|n| n.is_finite()) || normal[dominant] == 0.0 {
            return false;
        }
        let (mut u, mut v) = ((dominant + 1) % 3, (dominant + 2) % 3);
        if normal[dominant] < 0.0 {
            (u, v) = (v, u);
        }
        self.flat.clear();
        self.flat.extend(polygon.iter().map(|&corner| [at(corner)[u], at(corner)[v]]));
        true
    }
}

fn fan(polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend(polygon[1..].windows(2).map(|pair| [polygon[0], pair[0], pair[1]]));
}

/// Whether a triangle's normal differs from zero as far as f64 can tell.
fn has_area([a, b, c]: [[f64; 3]; 3]) -> bool {
    let edge = |to: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| to[axis] - a[axis]) };
    let (u, v) = (edge(b), edge(c));
    (0..3).any(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        u[i] * v[j] != u[j] * v[i]
    })
}

/// Whether two edges cross inside both, or more edges meet in one point than in any sensible polygon.
/// Sweeps over the edges sorted by x: usually about n log n, at worst a test for each pair.
fn is_tangled(flat: &[[f64; 2]]) -> bool {
    let mut points: Vec<[u64; 2]> = flat.iter().map(|point| point.map(|c| (c + 0.0).to_bits())).collect();
    points.sort_unstable();
    if points.windows(MAX_VISITS + 1).any(|visits| visits[0] == visits[MAX_VISITS]) {
        return true;
    }
    let mut edges: Vec<[[f64; 2]; 2]> = flat
        .iter()
        .zip(flat.iter().cycle().skip(1))
        .map(|(&p, &q)| if p[0] <= q[0] { [p, q] } else { [q, p] })
        .collect();
    edges.sort_unstable_by(|a, b| a[0][0].total_cmp(&b[0][0]));
    edges.iter().enumerate().any(|(place, &[a, b])| {
        edges[place + 1..].iter().take_while(|other| other[0][0] < b[0]).any(|&[c, d]| {
            a[1].min(b[1]) < c[1].max(d[1])
                && c[1].min(d[1]) < a[1].max(b[1])
                && doubled_area(a, b, c) * doubled_area(a, b, d) < 0.0
                && doubled_area(c, d, a) * doubled_area(c, d, b) < 0.0
        })
    })
}

/// Twice the signed area of a flat triangle: positive when counter-clockwise.
fn doubled_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[[f64; 2]], lift: impl Fn([f64; 2]) -> [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let positions: Vec<_> = points.iter().map(|&point| lift(point)).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let arity = [points.len() as u32];
        let triangles = triangulate(&positions, corners, &arity).unwrap();
        (positions, triangles)
    }

    /// The sum of the signed areas and of their magnitudes, over the plane of x and y.
    fn areas(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> (f64, f64) {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|corner| points[corner as usize]);
            doubled_area(a, b, c) / 2.0
        };
        (triangles.iter().map(area).sum(), triangles.iter().map(|t| area(t).abs()).sum())
    }

    fn shoelace(points: &[[f64; 2]]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
    }

    /// Whole coordinates, so that every area is exact. A star, a comb and a dart from each corner.
    fn concave() -> Vec<Vec<[f64; 2]>> {
        let dart = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        let mut all: Vec<Vec<_>> =
            (0..4).map(|turn| (0..4).map(|i| dart[(i + turn) % 4]).collect()).collect();
        let mut comb = vec![[0.0, -1.0], [40.0, -1.0]];
        for tooth in (0..20).rev() {
            comb.extend([[2.0 * f64::from(tooth) + 2.0, 0.0], [2.0 * f64::from(tooth) + 1.0, 9.0]]);
        }
        comb.push([0.0, 0.0]);
        all.push(comb);
        all.push(
            (0..24)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / 24.0;
                    let radius = if i % 2 == 0 { 1000.0 } else { 300.0 };
                    [(radius * angle.cos()).round(), (radius * angle.sin()).round()]
                })
                .collect(),
        );
        all
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        for mut points in concave() {
            for _ in 0..2 {
                let lifts: [fn([f64; 2]) -> [f64; 3]; 3] =
                    [|[x, y]| [x, y, x + y], |[x, y]| [2.0 * y - x, x, y], |[x, y]| [y, 7.0, x]];
                for lift in lifts {
                    let (_, triangles) = cut(&points, lift);
                    let (signed, unsigned) = areas(&points, &triangles);
                    assert_eq!(signed, shoelace(&points), "{points:?}");
                    assert_eq!(unsigned, signed.abs(), "no triangle lies outside, and the winding is kept");
                }
                points.reverse();
            }
        }
    }

    #[test]
    fn a_convex_quad_is_cut_as_a_fan() {
        let (_, triangles) = cut(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_quad_with_a_corner_on_an_edge_gets_no_triangle_without_area() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
        let (_, triangles) = cut(&points, |[x, y]| [x, y, 0.0]);
        assert_eq!(areas(&points, &triangles), (2.0, 2.0));
        assert_eq!(triangles, [[1, 2, 3], [3, 0, 1]]);
    }

    #[test]
    fn polygons_without_area_become_fans() {
        let (_, triangles) =
            cut(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [5.0, 0.0]], |[x, _]| [x; 3]);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        let (_, triangles) = cut(&[[f64::NAN, 0.0]; 5], |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles.len(), 3);
    }

    #[test]
    fn a_corner_on_an_edge_in_projection_only_stays() {
        let positions =
            [[-5.0, 0.0, 5.0], [5.0, 0.0, 5.0], [5.0, 0.0, -5.0], [-5.0, 0.0, -5.0], [0.0, 5.0, -5.0]];
        let triangles = triangulate(&positions, vec![0, 1, 2, 3, 4], &[5]).unwrap();
        assert_eq!(triangles.len(), 3);
        assert!(triangles.iter().flatten().any(|&corner| corner == 4), "{triangles:?}");
        // On the edge in space too: nothing to add.
        let positions = positions.map(|[x, _, z]| [x, 0.0, z]);
        assert_eq!(triangulate(&positions, vec![0, 1, 2, 3, 4], &[5]).unwrap().len(), 2);
    }

    #[test]
    fn long_polygons_that_cross_themselves_become_fans() {
        let corner = |i: usize| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][i % 4];
        let (_, triangles) = cut(&(0..2000).map(corner).collect::<Vec<_>>(), |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles.len(), 1998);
        let golden = |i: usize| [(2.4 * i as f64).cos(), (2.4 * i as f64).sin()];
        let (_, triangles) = cut(&(0..2000).map(golden).collect::<Vec<_>>(), |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles[1997], [0, 1998, 1999]);
    }

    #[test]
    fn long_simple_polygons_are_clipped() {
        let spiral = |i: usize| {
            let (turn, radius) = if i < 500 { (i, 1.0) } else { (999 - i, 1.1) };
            let angle = 0.05 * turn as f64;
            [(radius + angle) * angle.cos(), (radius + angle) * angle.sin()]
        };
        let points: Vec<_> = (0..1000).map(spiral).collect();
        let (_, triangles) = cut(&points, |[x, y]| [x, y, 0.0]);
        let (signed, unsigned) = areas(&points, &triangles);
        assert!((unsigned - shoelace(&points).abs()).abs() <= 1e-12 * unsigned, "{signed} {unsigned}");
    }

    #[test]
    fn short_runs_and_tiny_polygons_are_no_panic() {
        assert_eq!(triangulate(&[[0.0; 3]], vec![0, 0], &[1, 9]).unwrap(), Vec::<[u32; 3]>::new());
    }
}
