//! Finds by brute force over all pairs of triangles, in f64, which pairs are near and how far the nearest are apart.
//!
//! Triangles are grouped into blocks of neighbours with boxes, which keeps larger meshes affordable. A pair of blocks
//! is skipped only if its boxes are too far apart. No code is shared with the library.

use super::Triangle;
use cbvh_testkit::exact::{Boxed, Decided, intersect};

type Point = [f64; 3];

fn subtract(p: Point, q: Point) -> Point {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

pub(crate) fn dot(p: Point, q: Point) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn cross(p: Point, q: Point) -> Point {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn along(p: Point, t: f64, direction: Point) -> Point {
    [0, 1, 2].map(|k| p[k] + t * direction[k])
}

/// Clamps to the range from 0 to 1; NaN becomes 0.
fn clamp(t: f64) -> f64 {
    t.clamp(0.0, 1.0).max(0.0)
}

/// Returns the squared distance from a point to a segment.
fn point_segment(p: Point, a: Point, b: Point) -> f64 {
    let edge = subtract(b, a);
    let gap = subtract(p, along(a, clamp(dot(subtract(p, a), edge) / dot(edge, edge)), edge));
    dot(gap, gap)
}

/// Returns the squared distance of two segments if both ends of the shortest line between them are inside the
/// segments, and otherwise something larger.
fn inner_segments(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let (u, v, w) = (subtract(b, a), subtract(d, c), subtract(a, c));
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    let s = clamp((uv * dot(v, w) - vv * dot(u, w)) / (uu * vv - uv * uv));
    let t = clamp(dot(v, subtract(along(a, s, u), c)) / vv);
    let s = clamp(dot(u, subtract(along(c, t, v), a)) / uu);
    let gap = subtract(along(a, s, u), along(c, t, v));
    dot(gap, gap)
}

/// Returns the squared distance from a point to the plane of a triangle if the point is over or under the triangle,
/// and infinity otherwise.
fn point_face(p: Point, [a, b, c]: Triangle) -> f64 {
    let normal = cross(subtract(b, a), subtract(c, a));
    let inside = |a: Point, b: Point| dot(cross(subtract(b, a), subtract(p, a)), normal) >= 0.0;
    let length = dot(normal, normal).sqrt();
    if length > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        (dot(subtract(p, a), normal) / length).powi(2)
    } else {
        f64::INFINITY
    }
}

/// Returns the distance of two triangles that do not meet: the least over corners and faces, and over pairs of edges.
/// All numbers are scaled by a power of two, so that squares stay in range. Slivers lose digits; the exact oracle has
/// the last word.
pub(crate) fn distance(a: &Triangle, b: &Triangle) -> f64 {
    let largest = a.iter().chain(b).flatten().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let scale = f64::from_bits(largest.to_bits() & 0x7ff << 52);
    let [a, b] = [a, b].map(|t| t.map(|p| p.map(|x| x / scale)));
    let mut least = f64::INFINITY;
    for i in 0..3 {
        least = least.min(point_face(a[i], b)).min(point_face(b[i], a));
        for j in 0..3 {
            let (next_i, next_j) = ((i + 1) % 3, (j + 1) % 3);
            least = least.min(point_segment(a[i], b[j], b[next_j]));
            least = least.min(point_segment(b[j], a[i], a[next_i]));
            least = least.min(inner_segments(a[i], a[next_i], b[j], b[next_j]));
        }
    }
    least.sqrt() * scale
}

/// Returns the distance from a point to a triangle.
pub(crate) fn point_triangle(p: Point, triangle: &Triangle) -> f64 {
    distance(&[p; 3], triangle)
}

/// Triangles in blocks of neighbours, each block with its box.
pub(crate) struct Blocks(Vec<(Boxed, Vec<(usize, Boxed)>)>);

impl Blocks {
    pub(crate) fn new(triangles: &[Boxed]) -> Self {
        let most = ((triangles.len() as f64).sqrt() as usize / 4).max(4);
        let mut blocks = Vec::new();
        let mut open: Vec<Vec<(usize, Boxed)>> = vec![triangles.iter().copied().enumerate().collect()];
        while let Some(mut block) = open.pop() {
            let Some(around) = Boxed::around(block.iter().map(|(_, boxed)| boxed)) else { continue };
            if block.len() <= most {
                blocks.push((around, block));
                continue;
            }
            let (axis, middle) = (around.longest_axis(), block.len() / 2);
            block.select_nth_unstable_by(middle, |p, q| p.1.middle(axis).total_cmp(&q.1.middle(axis)));
            open.push(block.split_off(middle));
            open.push(block);
        }
        Self(blocks)
    }

    /// Calls `visit` with each pair whose boxes are at most `reach` apart. `visit` returns a new reach, which counts if it
    /// is lower.
    fn pairs(
        &self,
        other: &Self,
        mut reach: f64,
        mut visit: impl FnMut(&(usize, Boxed), &(usize, Boxed)) -> f64,
    ) {
        for (around_a, block_a) in &self.0 {
            for (around_b, block_b) in &other.0 {
                if around_a.gap(around_b) > reach {
                    continue;
                }
                for a in block_a {
                    for b in block_b {
                        if a.1.gap(&b.1) <= reach {
                            reach = reach.min(visit(a, b));
                        }
                    }
                }
            }
        }
    }

    /// Returns the pairs that meet, in ascending order.
    pub(crate) fn contacts(&self, other: &Self, decided: &mut Decided) -> Vec<(usize, usize)> {
        let mut contacts = Vec::new();
        self.pairs(other, 0.0, |(i, a), (j, b)| {
            if intersect(a, b, decided) {
                contacts.push((*i, *j));
            }
            0.0
        });
        contacts.sort_unstable();
        contacts
    }

    /// Returns the nearest pairs of triangles, nearest first: those closer than `reach` whose distance exceeds the
    /// least one by at most `slack`.
    pub(crate) fn nearest(&self, other: &Self, reach: f64, slack: f64) -> Vec<(f64, usize, usize)> {
        let (mut found, mut best) = (Vec::new(), reach);
        self.pairs(other, reach + slack, |(i, a), (j, b)| {
            let distance = distance(&a.corners, &b.corners);
            best = best.min(distance);
            if distance <= best + slack {
                found.push((distance, *i, *j));
            }
            best + slack
        });
        found.retain(|&(distance, _, _)| distance <= best + slack);
        found.sort_by(|p, q| p.0.total_cmp(&q.0));
        found
    }
}
