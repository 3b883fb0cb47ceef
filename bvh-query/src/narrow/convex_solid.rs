//! Decides exactly whether triangles enclose a convex solid, and finds its farthest vertices.

use super::intersection::{are_collinear, heights};
use super::{Point, Triangle, cross, dot, subtract};
use crate::numerics::UNIT_ROUNDOFF;
use bvh_format::vec3::length;
use std::sync::Arc;

/// What the triangles of an object enclose.
#[derive(Clone, Debug)]
pub(crate) enum Enclosed {
    /// Nothing: none of them has area, as in clouds and segments.
    Nothing,
    /// A convex solid.
    Convex(Arc<ConvexSolid>),
    /// Perhaps something else.
    Unknown,
}

/// The most exact signs that are found, in some 0.15 s. Faces that are divided very finely need more.
const MAX_EXACT_SIGNS: u32 = 1 << 16;

/// The least radius of a ball inside, as a part of how far the vertices are from its centre. Rounding may bend thinner ones too much.
const MIN_THICKNESS: f64 = 1.0 / (1 << 16) as f64;

/// A convex solid.
#[derive(Debug)]
pub(crate) struct ConvexSolid {
    /// In the frame of the file.
    pub(crate) vertices: Vec<Point>,
    /// The vertices that share an edge with vertex `v` are `links[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    links: Vec<u32>,
    /// A ball of this radius about the centre is inside, and all vertices are within `reach` of the centre.
    pub(crate) centre: Point,
    pub(crate) inner: f64,
    pub(crate) reach: f64,
}

impl ConvexSolid {
    /// Returns the solid that triangles enclose, if each edge is between two of them, in exact arithmetic no vertex is beyond the plane
    /// of one, and it is not too thin.
    pub(crate) fn of_surface(triangles: &[Triangle]) -> Option<Self> {
        // In an order that does not depend on that of the triangles, so that depths do not either.
        let bits = |corner: &Point| corner.map(f64::to_bits);
        let mut distinct: Vec<[u64; 3]> = triangles.as_flattened().iter().map(bits).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let vertices: Vec<Point> = distinct.iter().map(|vertex| vertex.map(f64::from_bits)).collect();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for corners in triangles {
            let number = |corner| distinct.partition_point(|vertex| *vertex < bits(corner)) as u32;
            let [p, q, r] = corners.each_ref().map(number);
            edges.extend([[p, q], [q, r], [r, p]]);
        }
        edges.sort_unstable();
        let is_twice = edges.windows(2).any(|pair| pair[0] == pair[1]);
        if is_twice || !edges.iter().all(|&[from, to]| edges.binary_search(&[to, from]).is_ok()) {
            return None;
        }
        let count = vertices.len() as f64;
        let centre = [0, 1, 2].map(|k| vertices.iter().map(|v| v[k] / count).sum());
        let reach = vertices.iter().map(|v| length(subtract(*v, centre))).fold(0.0, f64::max)
            * (1.0 + 8.0 * UNIT_ROUNDOFF);
        let (mut inner, mut signs) = (f64::INFINITY, MAX_EXACT_SIGNS);
        for triangle in triangles {
            let plane = Plane::of(triangle, reach).supports(&vertices, triangle, &mut signs)?;
            inner = inner.min(plane.distance_above(&centre));
        }
        // Without faces it is infinite, and it is NaN where numbers are too large.
        if !inner.is_finite() || inner < MIN_THICKNESS * reach {
            return None;
        }
        let mut starts: Vec<u32> = vec![0; vertices.len() + 1];
        edges.iter().for_each(|edge| starts[edge[0] as usize + 1] += 1);
        for vertex in 0..vertices.len() {
            starts[vertex + 1] += starts[vertex];
        }
        // The edges are in the order of the vertices that they come from.
        let links = edges.iter().map(|edge| edge[1]).collect();
        Some(Self { vertices, starts, links, centre, inner, reach })
    }

    /// Returns a vertex that is farther along a direction than its neighbours: but for roundings, the farthest of all. The search
    /// goes from vertex to vertex.
    pub(crate) fn farthest(&self, direction: &Point, from: u32) -> u32 {
        let height = |vertex: u32| dot(self.vertices[vertex as usize], *direction);
        let (mut best, mut highest) = (from, height(from));
        loop {
            let at = best;
            let links = self.starts[at as usize] as usize..self.starts[at as usize + 1] as usize;
            for &next in &self.links[links] {
                let of_next = height(next);
                if of_next > highest {
                    (best, highest) = (next, of_next);
                }
            }
            if best == at {
                return best;
            }
        }
    }
}

/// Returns whether a triangle has area.
pub(crate) fn has_area([p, q, r]: &Triangle) -> bool {
    !are_collinear(*p, *q, *r)
}

/// The plane of a triangle, as precisely as roundings allow.
struct Plane {
    through: Point,
    normal: Point,
    /// A bound on the error of a product of the normal with the difference between a vertex and a corner.
    error: f64,
}

impl Plane {
    /// `reach` is how far vertices are from a centre at most.
    ///
    /// With E the largest component of an edge, each edge is rounded once, so that a component of the normal is off by less than
    /// 4 u E^2 and 3 u (2 E^2). Its product with a difference of at most 2 `reach` sums three of these, which also round.
    fn of(&[p, q, r]: &Triangle, reach: f64) -> Self {
        let (to_q, to_r) = (subtract(q, p), subtract(r, p));
        let extent = [to_q, to_r].as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        Self { through: p, normal: cross(to_q, to_r), error: 128.0 * UNIT_ROUNDOFF * extent * extent * reach }
    }

    fn height(&self, point: &Point) -> f64 {
        dot(self.normal, subtract(*point, self.through))
    }

    /// Returns itself if no vertex is beyond it, and no more exact signs are needed to say so than are left.
    fn supports(self, vertices: &[Point], triangle: &Triangle, signs: &mut u32) -> Option<Self> {
        for vertex in vertices {
            let height = self.height(vertex);
            if height < -self.error {
                continue;
            }
            *signs = signs.checked_sub(1)?;
            if height > self.error || heights(triangle, &[*vertex])[0] > 0.0 {
                return None;
            }
        }
        Some(self)
    }

    /// Returns how far a point is below the plane at least; infinite for a triangle without area, which has none.
    fn distance_above(&self, point: &Point) -> f64 {
        let length = length(self.normal);
        if length == 0.0 {
            return f64::INFINITY;
        }
        ((-self.height(point) - self.error) / length) * (1.0 - 16.0 * UNIT_ROUNDOFF)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    /// The cube from 0 to 1, with the middle of one face as a vertex, at some height over it.
    fn cube(height: f64) -> Vec<Triangle> {
        let corner = |i: usize| [0, 1, 2].map(|axis| f64::from(i as u32 >> axis & 1));
        let quads = [[0, 2, 3, 1], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut triangles: Vec<Triangle> = quads
            .iter()
            .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
            .map(|t| t.map(corner))
            .collect();
        let (top, middle) = ([4, 5, 7, 6].map(corner), [0.5, 0.5, 1.0 + height]);
        triangles.extend((0..4).map(|k| [top[k], top[(k + 1) % 4], middle]));
        triangles
    }

    /// A vertex in the plane of its neighbours is one of a convex solid, and one that is lower by the least number is not.
    #[test]
    fn convexity_is_exact() {
        let below = 1.0 - 1.0f64.next_down();
        assert!(
            ConvexSolid::of_surface(&cube(0.0)).is_some() && ConvexSolid::of_surface(&cube(0.1)).is_some()
        );
        assert!(ConvexSolid::of_surface(&cube(f64::EPSILON)).is_some());
        assert!(
            ConvexSolid::of_surface(&cube(-below)).is_none()
                && ConvexSolid::of_surface(&cube(-0.1)).is_none()
        );
    }

    #[test]
    fn what_is_open_doubled_inside_out_or_thin_is_no_solid() {
        let whole = cube(0.0);
        assert!(ConvexSolid::of_surface(&whole[1..]).is_none());
        assert!(ConvexSolid::of_surface(&[whole.clone(), whole.clone()].concat()).is_none());
        assert!(
            ConvexSolid::of_surface(&whole.iter().map(|[p, q, r]| [*p, *r, *q]).collect::<Vec<_>>())
                .is_none()
        );
        let flat = |by: f64| -> Vec<Triangle> {
            whole.iter().map(|triangle| triangle.map(|[x, y, z]| [x, y, by * z])).collect()
        };
        assert!(
            ConvexSolid::of_surface(&flat(0.0)).is_none() && ConvexSolid::of_surface(&flat(1e-9)).is_none()
        );
        assert!(ConvexSolid::of_surface(&flat(1e-3)).is_some());
        assert!(ConvexSolid::of_surface(&[]).is_none());
    }

    /// From any vertex, the farthest one is found; the ball inside touches the nearest face.
    #[test]
    fn the_farthest_vertex_and_the_ball_inside() {
        let mut random = Random::new(3);
        let solid = ConvexSolid::of_surface(&cube(0.25)).unwrap();
        assert_eq!(solid.vertices.len(), 9);
        for _ in 0..200 {
            let direction = random.point();
            let height = |vertex: &Point| dot(*vertex, direction);
            let highest = solid.vertices.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
            for from in 0..9 {
                assert_eq!(height(&solid.vertices[solid.farthest(&direction, from) as usize]), highest);
            }
        }
        let centre = solid.centre;
        // The sides are the nearest.
        assert!((0.499..=0.5).contains(&solid.inner));
        assert!(solid.vertices.iter().all(|vertex| length(subtract(*vertex, centre)) <= solid.reach));
    }
}
