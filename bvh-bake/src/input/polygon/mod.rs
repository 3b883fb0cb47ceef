//! Cuts 3D polygons into triangles that cover them and nothing else.
//!
//! A polygon is projected along the dominant axis of its Newell normal (Sutherland, Sproull and Schumacker 1974;
//! Tampieri, Graphics Gems III). The projection drops a coordinate, so nothing is rounded. Triangles need no cut. A
//! quad is cut along the diagonal that lies inside it. Larger polygons are cut by ear clipping, because a fan would
//! cover area outside a concave polygon. The crate `earcut` does this, or module `ears` for long polygons. Ear clipping
//! leaves out vertices that lie on an edge in projection. If such a vertex lies off that edge in space, the triangle
//! between the two is added.
//!
//! A polygon without area (its Newell normal is zero or not finite, or nothing is left to clip) becomes a fan, which
//! keeps the points and segments of the polygon. A long polygon that crosses itself also becomes a fan: definitions of
//! its inside differ, a fan covers every point that the polygon winds around, and clipping such polygons takes cubic
//! time. The same input always gives the same triangles.
//!
//! A polygon with holes is projected with the normal of its outline, and `earcut` connects the holes with it.
//!
//! A file may hold polygons whose time would grow with the square of the number of their corners. The steps for a long
//! polygon are therefore limited per corner, which limits the time per byte of a file. Usual outlines, and combs of
//! 32,000 teeth, take less than a quarter of the limit.

mod ears;

use crate::error::{Fault, Place};
use earcut::Earcut;
use ears::{OutOfSteps, Steps};

/// The most corners of a polygon.
pub(crate) const MAX_CORNERS: usize = 1 << 16;
/// The most corners of a polygon that `earcut` cuts, which takes up to quadratic time and counts no steps.
const MAX_UNCOUNTED: usize = 1 << 10;
/// The most steps per corner of a longer polygon: tests of one edge or one corner against another.
const STEPS_PER_CORNER: u64 = 1 << 10;
/// The most corners of a polygon that is clipped even if it crosses itself.
const MAX_TANGLED: usize = 256;
/// The most visits of a long polygon to one point. A hole that is connected by a bridge takes two visits.
const MAX_VISITS: usize = 8;

/// Scratch memory for cutting one polygon after another.
#[derive(Default)]
pub(crate) struct Cutter {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
    kept: Vec<bool>,
}

impl Cutter {
    /// Cuts a polygon, given by the positions of its corners. Passes the triangles on one after the other, as places
    /// among the corners. A long polygon that takes too many steps is refused.
    pub(crate) fn cut_polygon<E: From<Fault>>(
        &mut self,
        corners: &[[f64; 3]],
        mut give: impl FnMut([usize; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        if corners.len() == 3 {
            return give([0, 1, 2]);
        }
        let triangles = self.cut(corners).map_err(|OutOfSteps| Fault::Limit {
            place: Place::File,
            most: STEPS_PER_CORNER,
            what: "steps per corner to cut a face of more than 1024 corners into triangles (cut it into smaller faces)",
        })?;
        triangles.into_iter().try_for_each(give)
    }

    /// Cuts a polygon with holes as [`cut_polygon`](Self::cut_polygon) does without. The corners of the outline are followed by those of
    /// one hole after the other, which begin at `holes`.
    pub(crate) fn cut_with_holes<E: From<Fault>>(
        &mut self,
        corners: &[[f64; 3]],
        holes: &[u32],
        give: impl FnMut([usize; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Some(&outline) = holes.first() else { return self.cut_polygon(corners, give) };
        if corners.len() > MAX_UNCOUNTED {
            let what = "corners of a face with holes (cut it into smaller faces)";
            return Err(Fault::Limit { place: Place::File, most: MAX_UNCOUNTED as u64, what }.into());
        }
        let outline = outline as usize;
        // An outline without area has no inside for holes.
        if !self.flatten(corners, outline) {
            return fan(outline).into_iter().try_for_each(give);
        }
        self.ears.clear();
        self.earcut.earcut_slice(&self.flat, holes, &mut self.ears);
        let ends = holes.iter().map(|&hole| hole as usize).chain([corners.len()]);
        let ends: Vec<usize> = ends.collect();
        self.triangles_of_ears(corners, &ends).into_iter().try_for_each(give)
    }

    fn cut(&mut self, corners: &[[f64; 3]]) -> Result<Vec<[usize; 3]>, OutOfSteps> {
        let count = corners.len();
        if count < 4 || !self.flatten(corners, count) {
            return Ok(fan(count));
        }
        if let [a, b, c, d] = self.flat[..] {
            let along_ac = doubled_area(a, b, c) > 0.0 && doubled_area(c, d, a) > 0.0;
            let along_bd = doubled_area(b, c, d) > 0.0 && doubled_area(d, a, b) > 0.0;
            let is_along_bd = along_bd && !along_ac;
            return Ok(if is_along_bd { vec![[1, 2, 3], [3, 0, 1]] } else { fan(count) });
        }
        let mut steps = Steps { left: STEPS_PER_CORNER * count.max(MAX_UNCOUNTED) as u64 };
        if count > MAX_TANGLED && is_tangled(&self.flat, &mut steps)? {
            return Ok(fan(count));
        }
        self.ears.clear();
        if count <= MAX_UNCOUNTED {
            self.earcut.earcut_slice::<u32>(&self.flat, &[], &mut self.ears);
        } else if !ears::clip(&self.flat, &mut steps, &mut self.ears)? {
            return Ok(fan(count));
        }
        Ok(self.triangles_of_ears(corners, &[count]))
    }

    /// Turns ears into triangles of the polygon, and adds the corners that were left out, ring by ring. The
    /// rings follow each other, and end at `ends`.
    fn triangles_of_ears(&mut self, corners: &[[f64; 3]], ends: &[usize]) -> Vec<[usize; 3]> {
        let ears = self.ears.as_chunks::<3>().0.iter().map(|ear| ear.map(|corner| corner as usize));
        // Ear clipping has a winding of its own. The polygon's winding is positive here, and the triangles must keep
        // it.
        let area = |ear: [usize; 3]| {
            let [a, b, c] = ear.map(|corner| self.flat[corner]);
            doubled_area(a, b, c)
        };
        let flip = ears.clone().map(area).sum::<f64>() < 0.0;
        let mut triangles: Vec<_> = ears.map(|[a, b, c]| if flip { [a, c, b] } else { [a, b, c] }).collect();

        self.kept.clear();
        self.kept.resize(corners.len(), false);
        triangles.iter().flatten().for_each(|&corner| self.kept[corner] = true);
        if triangles.is_empty() {
            return fan(ends[0]);
        }
        let starts = [0].into_iter().chain(ends.iter().copied());
        for (first, &end) in starts.zip(ends) {
            let ring = first..end;
            let Some(start) = self.kept[ring.clone()].iter().position(|&kept| kept) else { continue };
            let mut last = ring.start + start;
            for step in 1..ring.len() {
                let [here, next] = [step, step + 1].map(|step| ring.start + (start + step) % ring.len());
                if self.kept[here] {
                    last = here;
                } else if has_area([last, here, next].map(|corner| corners[corner])) {
                    triangles.push([last, here, next]);
                }
            }
        }
        triangles
    }

    /// Projects the polygon into `self.flat`, so that its outline, the first corners, is counter-clockwise. Returns false if the
    /// outline has no area.
    fn flatten(&mut self, corners: &[[f64; 3]], outline: usize) -> bool {
        let relative = |corner: &[f64; 3]| [0, 1, 2].map(|axis| corner[axis] - corners[0][axis]);
        let mut normal = [0.0; 3];
        let outline = &corners[..outline];
        let Some(mut previous) = outline.last().map(relative) else { return false };
        for corner in outline {
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
        self.flat.extend(corners.iter().map(|corner| [corner[u], corner[v]]));
        true
    }
}

/// Returns the triangles between the first corner and the edges of a polygon.
fn fan(corners: usize) -> Vec<[usize; 3]> {
    (2..corners).map(|last| [0, last - 1, last]).collect()
}

/// Returns whether a triangle's normal differs from zero as far as f64 can represent it.
fn has_area([a, b, c]: [[f64; 3]; 3]) -> bool {
    let edge = |to: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| to[axis] - a[axis]) };
    let (u, v) = (edge(b), edge(c));
    (0..3).any(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        u[i] * v[j] != u[j] * v[i]
    })
}

/// Returns whether two edges cross in their interiors, or whether more edges meet in one point than in any sensible
/// polygon. Compares the edges that overlap along one axis: the one along which fewer pairs do. That usually takes
/// n log n steps.
fn is_tangled(flat: &[[f64; 2]], steps: &mut Steps) -> Result<bool, OutOfSteps> {
    let mut points: Vec<[u64; 2]> = flat.iter().map(|point| point.map(|c| (c + 0.0).to_bits())).collect();
    points.sort_unstable();
    if points.windows(MAX_VISITS + 1).any(|visits| visits[0] == visits[MAX_VISITS]) {
        return Ok(true);
    }
    let along_x = Sweep::of(flat.iter().copied());
    let along_y = Sweep::of(flat.iter().map(|&[x, y]| [y, x]));
    let sweep = if along_x.pairs <= along_y.pairs { along_x } else { along_y };
    steps.take(sweep.pairs)?;
    Ok(sweep.finds_crossing())
}

/// The edges of a polygon, from their lower to their upper end along the first axis, sorted by the lower end.
struct Sweep {
    edges: Vec<[[f64; 2]; 2]>,
    /// The pairs of edges that overlap along the first axis.
    pairs: usize,
}

impl Sweep {
    fn of(flat: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let next = flat.clone().cycle().skip(1);
        let upwards = |(p, q): ([f64; 2], [f64; 2])| if p[0] <= q[0] { [p, q] } else { [q, p] };
        let mut edges: Vec<[[f64; 2]; 2]> = flat.zip(next).map(upwards).collect();
        edges.sort_unstable_by(|a, b| a[0][0].total_cmp(&b[0][0]));
        let later = |(place, [_, b]): (usize, &[[f64; 2]; 2])| {
            edges[place + 1..].partition_point(|other| other[0][0] < b[0])
        };
        let pairs = edges.iter().enumerate().map(later).sum();
        Self { edges, pairs }
    }

    fn finds_crossing(&self) -> bool {
        self.edges.iter().enumerate().any(|(place, &[a, b])| {
            self.edges[place + 1..].iter().take_while(|other| other[0][0] < b[0]).any(|&[c, d]| {
                a[1].min(b[1]) < c[1].max(d[1])
                    && c[1].min(d[1]) < a[1].max(b[1])
                    && doubled_area(a, b, c) * doubled_area(a, b, d) < 0.0
                    && doubled_area(c, d, a) * doubled_area(c, d, b) < 0.0
            })
        })
    }
}

/// Returns twice the signed area of a flat triangle, which is positive if the triangle is counter-clockwise.
fn doubled_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[[f64; 2]], lift: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<[usize; 3]> {
        let corners: Vec<_> = points.iter().map(|&point| lift(point)).collect();
        Cutter::default().cut(&corners).unwrap()
    }

    /// Returns the sum of the signed areas and the sum of their magnitudes, in the plane of x and y.
    fn areas(points: &[[f64; 2]], triangles: &[[usize; 3]]) -> (f64, f64) {
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|corner| points[corner]);
            doubled_area(a, b, c) / 2.0
        };
        (triangles.iter().map(area).sum(), triangles.iter().map(|t| area(t).abs()).sum())
    }

    fn shoelace(points: &[[f64; 2]]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
    }

    /// Returns a star, a comb, and a dart that starts at each of its corners. All coordinates are whole, so that every
    /// area is exact.
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
                    let triangles = cut(&points, lift);
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
        let triangles = cut(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_quad_with_a_corner_on_an_edge_gets_no_triangle_without_area() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
        let triangles = cut(&points, |[x, y]| [x, y, 0.0]);
        assert_eq!(areas(&points, &triangles), (2.0, 2.0));
        assert_eq!(triangles, [[1, 2, 3], [3, 0, 1]]);
    }

    #[test]
    fn polygons_without_area_become_fans() {
        let triangles = cut(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [5.0, 0.0]], |[x, _]| [x; 3]);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        let triangles = cut(&[[f64::NAN, 0.0]; 5], |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles.len(), 3);
    }

    #[test]
    fn a_corner_on_an_edge_in_projection_only_stays() {
        let positions =
            [[-5.0, 0.0, 5.0], [5.0, 0.0, 5.0], [5.0, 0.0, -5.0], [-5.0, 0.0, -5.0], [0.0, 5.0, -5.0]];
        let triangles = Cutter::default().cut(&positions).unwrap();
        assert_eq!(triangles.len(), 3);
        assert!(triangles.iter().flatten().any(|&corner| corner == 4), "{triangles:?}");
        // The vertex is on the edge in space as well, so that no triangle is added.
        let positions = positions.map(|[x, _, z]| [x, 0.0, z]);
        assert_eq!(Cutter::default().cut(&positions).unwrap().len(), 2);
    }

    #[test]
    fn long_polygons_that_cross_themselves_become_fans() {
        let corner = |i: usize| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][i % 4];
        let triangles = cut(&(0..2000).map(corner).collect::<Vec<_>>(), |[x, y]| [x, y, 0.0]);
        assert_eq!(triangles.len(), 1998);
        let golden = |i: usize| [(2.4 * i as f64).cos(), (2.4 * i as f64).sin()];
        let triangles = cut(&(0..2000).map(golden).collect::<Vec<_>>(), |[x, y]| [x, y, 0.0]);
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
        let triangles = cut(&points, |[x, y]| [x, y, 0.0]);
        let (signed, unsigned) = areas(&points, &triangles);
        assert!((unsigned - shoelace(&points).abs()).abs() <= 1e-12 * unsigned, "{signed} {unsigned}");
    }

    /// Returns a comb with `teeth` teeth, whose edges all overlap along y.
    fn comb(teeth: usize) -> Vec<[f64; 2]> {
        let mut points = vec![[0.0, -1.0], [2.0 * teeth as f64, -1.0]];
        for tooth in (0..teeth).rev() {
            points.extend([[2.0 * tooth as f64 + 2.0, 0.0], [2.0 * tooth as f64 + 1.0, 1e4]]);
        }
        points.push([0.0, 0.0]);
        points
    }

    /// Returns a strip of `corners` corners that is wound up `turns` times.
    fn coil(corners: usize, turns: f64) -> Vec<[f64; 2]> {
        let half = corners / 2;
        let point = |i: usize| {
            let (step, lift) = if i < half { (i, 0.0) } else { (2 * half - 1 - i, 0.5) };
            let angle = std::f64::consts::TAU * turns * step as f64 / half as f64;
            let radius = 2.0 + angle / std::f64::consts::TAU + lift;
            [radius * angle.cos(), radius * angle.sin()]
        };
        (0..2 * half).map(point).collect()
    }

    /// Returns a square with square holes, each of which a bridge connects to the outline.
    fn holes(count: usize) -> Vec<[f64; 2]> {
        let width = 4.0 * count as f64;
        let mut points = vec![[width, 0.0], [width, 8.0], [0.0, 8.0], [0.0, 0.0]];
        for hole in 0..count {
            let x = 4.0 * hole as f64 + 1.0;
            points.extend([[x, 0.0], [x, 2.0], [x, 4.0], [x + 2.0, 4.0], [x + 2.0, 2.0], [x, 2.0], [x, 0.0]]);
        }
        points
    }

    /// Usual long polygons are far from the limit, and are covered exactly once.
    #[test]
    fn long_polygons_take_few_steps() {
        let circle = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / 65_536.0;
            [angle.cos(), angle.sin()]
        };
        let mut all = [
            (0..65_536).map(circle).collect(),
            comb(32_000),
            coil(60_000, 10.0),
            coil(3000, 3.0),
            holes(9000),
        ];
        for (number, points) in all.iter_mut().enumerate() {
            if shoelace(points) < 0.0 {
                points.reverse();
            }
            let given = STEPS_PER_CORNER * points.len() as u64;
            let mut steps = Steps { left: given };
            assert_eq!(is_tangled(points, &mut steps), Ok(false), "{number}");
            let mut ears = Vec::new();
            assert_eq!(ears::clip(points, &mut steps, &mut ears), Ok(true), "{number}");
            let taken = given - steps.left;
            assert!(taken < given / 4, "polygon {number}: {taken} steps for {} corners", points.len());
            let ears: Vec<usize> = ears.into_iter().map(|corner| corner as usize).collect();
            let (signed, unsigned) = areas(points, ears.as_chunks().0);
            let area = shoelace(points);
            assert!((signed - area).abs() <= 1e-9 * area, "polygon {number}: {signed}, not {area}");
            assert!((unsigned - area).abs() <= 1e-9 * area, "polygon {number}: {unsigned}, not {area}");
        }
    }

    /// Polygons whose edges are all near each other along both axes, as hostile files have them.
    #[test]
    fn hostile_polygons_are_given_up() {
        let corners = MAX_CORNERS;
        // A strip that is folded to and fro between two lines, turned by 45 degrees.
        let folded = |i: usize| {
            let (step, lift) = if i < corners / 2 { (i, 0.0) } else { (corners - 1 - i, 0.5) };
            let (x, y) = (step as f64, lift + if step.is_multiple_of(2) { 0.0 } else { 1e6 });
            [x - y, x + y]
        };
        let square = |i: usize| {
            let (step, lift) = if i < corners / 2 { (i, 0.0) } else { (corners - 1 - i, 0.25) };
            let radius = (step / 4) as f64 + 2.0 + lift;
            [[radius, -radius + 1.0], [radius, radius], [-radius, radius], [-radius, -radius]][step % 4]
        };
        let shapes: [Vec<[f64; 2]>; 2] =
            [(0..corners).map(folded).collect(), (0..corners).map(square).collect()];
        for (number, points) in shapes.iter().enumerate() {
            let corners: Vec<[f64; 3]> = points.iter().map(|&[x, y]| [x, y, 0.0]).collect();
            let given: Result<(), Fault> = Cutter::default().cut_polygon(&corners, |_| Ok(()));
            assert!(matches!(given, Err(Fault::Limit { most: STEPS_PER_CORNER, .. })), "{number}: {given:?}");
        }
        // The same shapes are cut where they have fewer corners.
        let short: Vec<[f64; 3]> = shapes[0][..900].iter().map(|&[x, y]| [x, y, 0.0]).collect();
        let mut count = 0;
        let given: Result<(), Fault> = Cutter::default().cut_polygon(&short, |_| {
            count += 1;
            Ok(())
        });
        assert!(given.is_ok() && count >= 898, "{given:?} {count}");
    }

    #[test]
    fn holes_are_left_free() {
        let square =
            |[x, y]: [f64; 2], side: f64| [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
        let ring = |points: [[f64; 2]; 4], turns: bool| {
            if turns { [3, 2, 1, 0].map(|at: usize| points[at]) } else { points }
        };
        // Holes of both windings, also with a corner on the outline, in outlines of both windings.
        for number in 0..8 {
            let [first, second, outline] = [1, 2, 4].map(|bit| number & bit > 0);
            let holes = [ring(square([1.0, 1.0], 2.0), first), ring(square([0.0, 4.0], 1.0), second)];
            let points = [ring(square([0.0, 0.0], 10.0), outline), holes[0], holes[1]].concat();
            let corners: Vec<_> = points.iter().map(|&[x, y]| [y, x, x + y]).collect();
            let mut triangles = Vec::new();
            let cut = Cutter::default().cut_with_holes(&corners, &[4, 8], |triangle| {
                triangles.push(triangle);
                Ok::<_, Fault>(())
            });
            cut.unwrap();
            let (signed, unsigned) = areas(&points, &triangles);
            assert_eq!((signed, unsigned), (if outline { -95.0 } else { 95.0 }, 95.0), "{number}");
        }
        let cut = |corners: usize, holes: &[u32]| {
            let mut count = 0;
            let give = |_| {
                count += 1;
                Ok::<_, Fault>(())
            };
            Cutter::default().cut_with_holes(&vec![[0.0; 3]; corners], holes, give).map(|()| count)
        };
        // Without an area, with no outline, and with too many corners.
        assert!(matches!((cut(8, &[4]), cut(4, &[0]), cut(3, &[1, 1, 3])), (Ok(2), Ok(0), Ok(0))));
        assert!(matches!(cut(MAX_UNCOUNTED + 1, &[4]), Err(Fault::Limit { most: 1024, .. })));
    }

    #[test]
    fn polygons_of_few_corners_are_no_panic() {
        (0..3)
            .for_each(|corners| assert!(Cutter::default().cut(&vec![[0.0; 3]; corners]).unwrap().is_empty()));
    }
}
