//! Finds during which stretch of a straight way a triangle is in contact with another one.
//!
//! Two convex bodies meet exactly if their projections on every axis meet. If one of them moves on a line, each axis leaves an
//! interval of the way, and the contact is what all intervals have in common. The differences of the points of two triangles
//! form a body with facets along eleven axes, two normals and nine products of edges, as in [`crate::leaf::separating_axes`]. Triangles
//! in parallel planes have no body; the axes in their plane take the place of the products, and the coordinate axes bound
//! triangles without area.
//!
//! Any axis gives an interval that no contact is outside of, so an axis that is rounded does no harm there, and only
//! projections are charged. Whether triangles certainly cross depends on the axes being those of the body, so the roundings of
//! an axis are charged as well. The specification derives both (`spec/numerics.md`, "How deep").

use super::{Point, Triangle, cross, dot, subtract};
use crate::numerics::UNIT_ROUNDOFF as U;

/// The stretch of a way during which two triangles are in contact, in units of the direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// All contacts are in this closed interval. It is empty if its start exceeds its end.
    pub(crate) outer: [f64; 2],
    /// The triangles certainly cross at all moments of this open interval: points inside both are common. It is empty unless
    /// its start is less than its end.
    pub(crate) inner: [f64; 2],
    /// The unit normal of the facet through which the way leaves the contact.
    pub(crate) normal: Point,
}

/// A line on which a triangle moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// Of about unit length.
    pub(crate) direction: Point,
    /// A bound of the way: stretches are valid as far as this in both directions.
    pub(crate) length: f64,
    /// A bound on how far rounding moves each coordinate of the triangle that moves, from where the way takes it.
    pub(crate) error: f64,
}

/// What the axes have left of a way.
struct Clip<'a> {
    way: &'a Way,
    /// Corners around one of them.
    a: Triangle,
    b: Triangle,
    /// The largest coordinate of these.
    reach: f64,
    stretch: Stretch,
}

/// Returns the stretch of a way of `b` during which it is in contact with `a`. Cost: about 200 ns.
pub(crate) fn stretch(a: &Triangle, b: &Triangle, way: &Way) -> Stretch {
    let around = |triangle: &Triangle| triangle.map(|corner| subtract(corner, a[0]));
    let (a, b) = (around(a), around(b));
    let reach = a.iter().chain(&b).flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    let everything = [f64::NEG_INFINITY, f64::INFINITY];
    let stretch = Stretch { outer: everything, inner: everything, normal: way.direction };
    let mut clip = Clip { way, a, b, reach, stretch };
    let edges = |t: &Triangle| [subtract(t[1], t[0]), subtract(t[2], t[1]), subtract(t[0], t[2])];
    let (edges_a, edges_b) = (edges(&a), edges(&b));
    let (normal_a, normal_b) = (cross(edges_a[0], edges_a[1]), cross(edges_b[0], edges_b[1]));
    clip.by(normal_a, error_of_product(edges_a[0], edges_a[1]));
    clip.by(normal_b, error_of_product(edges_b[0], edges_b[1]));
    for edge_a in edges_a {
        for edge_b in edges_b {
            if clip.is_empty() {
                return clip.stretch;
            }
            let (axis, error) = (cross(edge_a, edge_b), error_of_product(edge_a, edge_b));
            // Edges that are parallel but for roundings span no facet wider than these.
            if largest(axis) > error {
                clip.by(axis, error);
            }
        }
    }
    if clip.stretch.inner[0] >= clip.stretch.inner[1] {
        let in_planes = edges_a.map(|edge| cross(normal_a, edge)).into_iter();
        for axis in in_planes.chain(edges_b.map(|edge| cross(normal_b, edge))) {
            clip.by(axis, f64::INFINITY);
        }
        for k in 0..3 {
            let mut axis = [0.0; 3];
            axis[k] = 1.0;
            clip.by(axis, f64::INFINITY);
        }
    }
    clip.stretch
}

/// Returns whether the boxes of two triangles show that `b` has left `a` before a place on the way. Cost: a tenth of that of
/// [`stretch`].
pub(crate) fn leaves_before(a: &Triangle, b: &Triangle, way: &Way, place: f64) -> bool {
    (0..3).any(|k| {
        let [a, b] = [a, b].map(|t| t.map(|corner| corner[k]));
        let rate = way.direction[k];
        let overlap = if rate > 0.0 {
            a[0].max(a[1]).max(a[2]) - b[0].min(b[1]).min(b[2])
        } else {
            b[0].max(b[1]).max(b[2]) - a[0].min(a[1]).min(a[2])
        };
        overlap + 2.0 * way.error + 32.0 * U * (overlap.abs() + way.length) < place * rate.abs()
    })
}

impl Clip<'_> {
    fn is_empty(&self) -> bool {
        self.stretch.outer[0] > self.stretch.outer[1]
    }

    /// Clips by an axis, each component of which is off from that of a normal by at most `error`.
    fn by(&mut self, axis: Point, error: f64) {
        let project = |t: &Triangle| t.map(|corner| dot(axis, corner));
        let ([a0, a1, a2], [b0, b1, b2]) = (project(&self.a), project(&self.b));
        let (least_a, most_a) = (a0.min(a1).min(a2), a0.max(a1).max(a2));
        let (least_b, most_b) = (b0.min(b1).min(b2), b0.max(b1).max(b2));
        let (start, end) = (least_a - most_b, most_a - least_b);
        let rate = dot(axis, self.way.direction);
        let length = axis[0].abs() + axis[1].abs() + axis[2].abs();
        let roundings = length * U * (self.reach + self.way.length);
        let spare = length * self.way.error + 16.0 * roundings;
        let certain = spare + 128.0 * roundings + error * (8.0 * self.reach + 4.0 * self.way.length);
        let outer = interval([start - spare, end + spare], rate, |start, end| start <= 0.0 && end >= 0.0);
        let inner = interval([start + certain, end - certain], rate, |start, end| start < 0.0 && end > 0.0);
        let Stretch { outer: all, inner: sure, normal } = &mut self.stretch;
        all[0] = all[0].max(outer[0] - 4.0 * U * outer[0].abs());
        let outer_end = outer[1] + 4.0 * U * outer[1].abs();
        if outer_end < all[1] {
            all[1] = outer_end;
            let to = rate.signum() / dot(axis, axis).sqrt();
            *normal = axis.map(|x| to * x);
        }
        sure[0] = sure[0].max(inner[0] + 4.0 * U * inner[0].abs());
        sure[1] = sure[1].min(inner[1] - 4.0 * U * inner[1].abs());
    }
}

/// Returns a bound on the error of each component of a product of edges. Each edge is off by `U` of itself, and a component by
/// three more roundings of two products.
fn error_of_product(e: Point, f: Point) -> f64 {
    16.0 * U * largest(e) * largest(f)
}

fn largest(v: Point) -> f64 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// Returns where on a way the part along an axis, which grows by `rate`, is from `start` to `end`. Where it does not grow,
/// `holds` tells whether the numbers allow all of the way.
fn interval([start, end]: [f64; 2], rate: f64, holds: fn(f64, f64) -> bool) -> [f64; 2] {
    if rate > 0.0 {
        [start / rate, end / rate]
    } else if rate < 0.0 {
        [end / rate, start / rate]
    } else if holds(start, end) {
        [f64::NEG_INFINITY, f64::INFINITY]
    } else {
        [f64::INFINITY, f64::NEG_INFINITY]
    }
}
