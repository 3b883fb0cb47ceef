//! Convex pieces of two shapes about a point in both: these have at most the depth of the shapes.
//!
//! A piece is what planes leave of a box around the shape. The triangles are taken from the nearest to the farthest one, and those
//! that reach into the piece are cut off, by their own plane where that faces the point, else by the plane across the way to their
//! closest point. In the end no triangle reaches into the piece, so that it is inside where the point is. Region inflation for free
//! space begins in this way (Deits and Tedrake, *Computing Large Convex Regions of Obstacle-Free Space through Semidefinite
//! Programming*, 2014).

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::narrow::{Point, Triangle, dot, subtract, triangle_distance, unit, unit_normal};
use crate::pose::Pose;
use crate::query::depth::planes::{Plane, meeting};
use crate::query::depth::polytope::{Corner, Polytope};
use crate::query::depth::translation::Translation;
use crate::query::exact::placed;
use crate::query::querier::Querier;
use crate::traverse::budget::Budget;
use std::cmp::Ordering;

/// The most triangles of a shape that pieces are made of.
const MAX_TRIANGLES: usize = 1024;

/// The most planes of a piece. If more are needed, there is none.
const MAX_PLANES: usize = 32;

/// How far planes keep from what they cut off, as a part of the size: far more than roundings.
const MARGIN: f64 = 1.0 / (1u64 << 34) as f64;

/// The least sine between a plane and the way to a triangle for which the triangle's own plane is taken.
const FACING: f64 = 0.5;

/// How far apart the bounds of the depth of two pieces may be, as a part of the lower one.
const PRECISION: f64 = 1.0 / 1024.0;

/// The least volume that the normals of three planes span for their meeting point to be a vertex. Others would be off by more than 1000
/// roundings; without them, a piece is smaller.
const LEAST_SPANNED: f64 = 1.0 / 1024.0;

impl Querier {
    /// Returns the depth of convex pieces of two shapes about a point that is certainly inside both; 0 if there are none.
    pub(super) fn depth_of_pieces(
        &mut self,
        line: &Translation<'_>,
        centre: &Point,
    ) -> Result<f64, QueryError> {
        if line.radii > 0.0 {
            return Ok(0.0);
        }
        // Far more than what cutting rounds, and more than what placing B anew does.
        let margin = (MARGIN * line.size).max(line.error);
        let mut pieces = [Vec::new(), Vec::new()];
        for ((shape, pose), vertices) in
            [(line.a, None), (line.b, Some(line.pose))].into_iter().zip(&mut pieces)
        {
            let Some(triangles) = self.triangles(shape, pose)? else { return Ok(0.0) };
            *vertices = piece(triangles, centre, margin);
        }
        let depth = depth(&pieces, &mut self.memory.budget)?;
        Ok((depth - 4.0 * line.error).max(0.0))
    }

    /// Returns the triangles of a shape in A's frame; none if they are too many.
    fn triangles(
        &mut self,
        shape: Shape<'_>,
        pose: Option<&Pose>,
    ) -> Result<Option<Vec<Triangle>>, QueryError> {
        let mut triangles = Vec::new();
        // A damaged file may hold more than it states.
        if shape.triangles() <= MAX_TRIANGLES as u64 {
            shape.visit_stored_until(|corners| {
                triangles.push(pose.map_or(corners, |pose| placed(&corners, pose)));
                triangles.len() > MAX_TRIANGLES
            })?;
        }
        for _ in 0..triangles.len() / 4 {
            self.memory.budget.visit()?;
        }
        Ok((1..=MAX_TRIANGLES).contains(&triangles.len()).then_some(triangles))
    }
}

/// Returns the vertices of a convex piece about a point into which no triangle reaches; none if it would need too many planes.
///
/// Vertices are within planes by half a margin, and triangles that are left out do not reach within them by one and a half, so that
/// roundings do not matter.
fn piece(triangles: Vec<Triangle>, centre: &Point, margin: f64) -> Vec<Point> {
    let mut planes = Vec::new();
    for k in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = [0.0; 3];
            normal[k] = sign;
            let heights = triangles.as_flattened().iter().map(|corner| sign * (corner[k] - centre[k]));
            planes.push(Plane { normal, height: heights.fold(0.0, f64::max) });
        }
    }
    let mut by_distance: Vec<(f64, Triangle)> = triangles
        .into_iter()
        .map(|triangle| (triangle_distance(&triangle, &[*centre; 3]).distance, triangle))
        .collect();
    // Of equally near ones, the order does not depend on the file.
    let order = |x: &Triangle, y: &Triangle| {
        let pairs = x.as_flattened().iter().zip(y.as_flattened());
        pairs.map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    by_distance.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then_with(|| order(&x.1, &y.1)));
    for (distance, triangle) in by_distance {
        if !reaches_into(&triangle, &planes, centre, 1.5 * margin) {
            continue;
        }
        let to_first = subtract(triangle[0], *centre);
        let own = unit_normal(&triangle);
        let own = if dot(own, to_first) < 0.0 { own.map(|x| -x) } else { own };
        let normal = if dot(own, to_first) >= FACING * distance {
            own
        } else {
            unit(subtract(triangle_distance(&triangle, &[*centre; 3]).point_a, *centre))
        };
        let heights = triangle.map(|corner| dot(normal, subtract(corner, *centre)));
        let height = heights.into_iter().fold(f64::INFINITY, f64::min) - 2.0 * margin;
        if planes.len() == MAX_PLANES || height.is_nan() || height < 2.0 * margin {
            return Vec::new();
        }
        planes.push(Plane { normal, height });
    }
    vertices(&planes, centre, margin)
}

/// Returns whether a triangle has points that are in all half-spaces, or beyond them by no more than a distance. It is cut by one
/// plane after the other (Sutherland and Hodgman, 1974).
fn reaches_into(triangle: &Triangle, planes: &[Plane], centre: &Point, beyond: f64) -> bool {
    let mut polygon = triangle.map(|corner| subtract(corner, *centre)).to_vec();
    let mut cut = Vec::new();
    for plane in planes {
        cut.clear();
        let height = |p: &Point| dot(plane.normal, *p) - plane.height - beyond;
        for (at, p) in polygon.iter().enumerate() {
            let q = &polygon[(at + 1) % polygon.len()];
            let (of_p, of_q) = (height(p), height(q));
            if of_p <= 0.0 {
                cut.push(*p);
            }
            if (of_p < 0.0 && of_q > 0.0) || (of_p > 0.0 && of_q < 0.0) {
                let share = of_p / (of_p - of_q);
                cut.push([0, 1, 2].map(|k| p[k] + share * (q[k] - p[k])));
            }
        }
        std::mem::swap(&mut polygon, &mut cut);
        if polygon.is_empty() {
            return false;
        }
    }
    true
}

/// Returns the points in which three planes meet well within all half-spaces.
fn vertices(planes: &[Plane], centre: &Point, margin: f64) -> Vec<Point> {
    let mut found: Vec<Point> = Vec::new();
    for (i, p) in planes.iter().enumerate() {
        for (j, q) in planes[..i].iter().enumerate() {
            for r in &planes[..j] {
                let (spanned, at) = meeting([p, q, r]);
                if spanned.abs() < LEAST_SPANNED {
                    continue;
                }
                let is_within = |plane: &Plane| dot(plane.normal, at) <= plane.height + margin / 2.0;
                let vertex = [0, 1, 2].map(|k| centre[k] + at[k]);
                let is_known = |known: &Point| (0..3).all(|k| (known[k] - vertex[k]).abs() <= margin);
                if planes.iter().all(is_within) && !found.iter().any(is_known) {
                    found.push(vertex);
                }
            }
        }
    }
    found
}

/// Returns a lower bound of the depth of the hulls of two sets of points; 0 if they have hardly any volume.
fn depth([a, b]: &[Vec<Point>; 2], budget: &mut Budget) -> Result<f64, QueryError> {
    if a.len() < 4 || b.len() < 4 {
        return Ok(0.0);
    }
    let highest = |of: &[Point], direction: &Point| -> Point {
        let height = |p: &Point| dot(*p, *direction);
        of[1..].iter().fold(of[0], |best, p| if height(p) > height(&best) { *p } else { best })
    };
    let mut farthest = |direction: &Point| {
        let (of_a, of_b) = (highest(a, direction), highest(b, &direction.map(|x| -x)));
        Corner { difference: subtract(of_a, of_b), of_a, of_b }
    };
    let Some(mut polytope) = Polytope::spanning([1.0, 0.0, 0.0], &mut farthest) else { return Ok(0.0) };
    loop {
        budget.visit()?;
        let face = polytope.nearest();
        let corner = farthest(&face.normal);
        let height = dot(face.normal, corner.difference);
        let is_near = height - face.distance <= face.error.max(PRECISION * face.distance);
        if height <= 0.0 || is_near || !polytope.grow(corner) {
            return Ok(polytope.certain());
        }
    }
}
