//! The oracle: rays, segments and winding numbers in rational numbers, over all triangles.
//!
//! It shares neither code nor method with the library, which looks at the signs of edges: here the ray meets the plane of a
//! triangle at a rational point, which is inside if it is so in a projection; and in a plane with the ray a triangle is what
//! three half-planes have in common. Sides come from rays in random directions that meet no edge.

use crate::common::Triangle;
use cbvh_testkit::exact::{Dyadic, Number, cross, dot, is_zero, subtract};
use std::cmp::Ordering::{self, Equal, Greater, Less};

type Vector = [Dyadic; 3];

/// A rational number: the numerator and a positive denominator.
#[derive(Clone, Debug)]
pub(crate) struct Rational(Dyadic, Dyadic);

impl Rational {
    fn new(numerator: Dyadic, denominator: Dyadic) -> Self {
        let is_negative = denominator < Dyadic::ZERO;
        Self(if is_negative { negative(&numerator) } else { numerator }, denominator.abs())
    }

    pub(crate) fn of(x: f64) -> Self {
        Self(Dyadic::of(x), Dyadic::ONE)
    }

    pub(crate) fn compare(&self, other: &Self) -> Ordering {
        self.0.times(&other.1).cmp(&other.0.times(&self.1))
    }

    fn is_negative(&self) -> bool {
        self.0 < Dyadic::ZERO
    }
}

fn negative(x: &Dyadic) -> Dyadic {
    Dyadic::ZERO.minus(x)
}

fn vector(p: &[f64; 3]) -> Vector {
    p.map(Dyadic::of)
}

/// Returns the least parameter, at least 0, at which a ray meets a closed triangle.
pub(crate) fn first(origin: &[f64; 3], direction: &[f64; 3], triangle: &Triangle) -> Option<Rational> {
    let (o, d) = (vector(origin), vector(direction));
    let corners = triangle.each_ref().map(vector);
    let [a, b, c] = &corners;
    let normal = cross(&subtract(b, a), &subtract(c, a));
    if is_zero(&normal).unwrap() {
        return first_on_segment(&o, &d, corners);
    }
    let (height, slope) = (dot(&normal, &subtract(a, &o)), dot(&normal, &d));
    let axis = (0..3).find(|&k| normal[k] != Dyadic::ZERO).unwrap();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    // Twice the area of two vectors in the projection, with the sign that makes the triangle counterclockwise.
    let turn = |v: &Vector, w: &Vector| {
        let area = v[i].times(&w[j]).minus(&v[j].times(&w[i]));
        if normal[axis] > Dyadic::ZERO { area } else { negative(&area) }
    };
    if slope != Dyadic::ZERO {
        let t = Rational::new(height, slope);
        // The point, times the denominator.
        let point = [0, 1, 2].map(|k| o[k].times(&t.1).plus(&d[k].times(&t.0)));
        let is_inside = (0..3).all(|n| {
            let (p, q) = (&corners[n], &corners[(n + 1) % 3]);
            let from = [0, 1, 2].map(|k| point[k].minus(&p[k].times(&t.1)));
            turn(&subtract(q, p), &from) >= Dyadic::ZERO
        });
        return (is_inside && !t.is_negative()).then_some(t);
    }
    if height != Dyadic::ZERO {
        return None;
    }
    // All is in one plane: the ray is cut by the half-plane of each edge.
    let (mut from, mut to) = (Rational::of(0.0), None::<Rational>);
    for n in 0..3 {
        let (p, q) = (&corners[n], &corners[(n + 1) % 3]);
        let edge = subtract(q, p);
        // Inside is where start + t * change >= 0.
        let (start, change) = (turn(&edge, &subtract(&o, p)), turn(&edge, &d));
        if change == Dyadic::ZERO {
            if start < Dyadic::ZERO {
                return None;
            }
            continue;
        }
        let enters = change > Dyadic::ZERO;
        let t = Rational::new(negative(&start), change);
        if enters {
            if t.compare(&from).is_gt() {
                from = t;
            }
        } else if to.as_ref().is_none_or(|to| t.compare(to).is_lt()) {
            to = Some(t);
        }
    }
    to.is_none_or(|to| from.compare(&to).is_le()).then_some(from)
}

/// The same for the segment or point that three points on a line span.
fn first_on_segment(o: &Vector, d: &Vector, mut corners: [Vector; 3]) -> Option<Rational> {
    corners.sort();
    let [p, _, q] = &corners;
    let (edge, from) = (subtract(q, p), subtract(p, o));
    let normal = cross(d, &edge);
    let axis = (0..3).find(|&k| d[k] != Dyadic::ZERO).unwrap();
    let along = |v: &Vector| Rational::new(v[axis].clone(), d[axis].clone());
    if is_zero(&normal).unwrap() {
        if !is_zero(&cross(d, &from)).unwrap() {
            return None;
        }
        let (s, t) = (along(&from), along(&subtract(q, o)));
        let (near, far) = if s.compare(&t).is_lt() { (s, t) } else { (t, s) };
        return match (near.is_negative(), far.is_negative()) {
            (false, _) => Some(near),
            (true, false) => Some(Rational::of(0.0)),
            (true, true) => None,
        };
    }
    // o + t d = p + s e, crossed with e and with d.
    let squared = dot(&normal, &normal);
    if dot(&from, &normal) != Dyadic::ZERO {
        return None;
    }
    let t = Rational::new(dot(&cross(&from, &edge), &normal), squared.clone());
    let s = dot(&cross(&from, d), &normal);
    (!t.is_negative() && s >= Dyadic::ZERO && s <= squared).then_some(t)
}

/// Returns how often closed triangles wind around a point that is on none of them, by a ray in some direction; nothing if that
/// meets an edge or a corner.
pub(crate) fn winding(point: &[f64; 3], direction: &[f64; 3], triangles: &[Triangle]) -> Option<i64> {
    let (o, d) = (vector(point), vector(direction));
    let mut winding = 0;
    for triangle in triangles {
        let seen = triangle.each_ref().map(|corner| subtract(&vector(corner), &o));
        let normal = cross(&subtract(&seen[1], &seen[0]), &subtract(&seen[2], &seen[0]));
        if is_zero(&normal).unwrap() {
            continue;
        }
        let sides =
            [(0, 1), (1, 2), (2, 0)].map(|(i, j)| dot(&d, &cross(&seen[i], &seen[j])).sign().unwrap());
        if sides.contains(&Less) && sides.contains(&Greater) {
            continue;
        }
        if sides.contains(&Equal) {
            return None;
        }
        let (height, slope) = (dot(&normal, &seen[0]), dot(&normal, &d));
        if (height > Dyadic::ZERO) == (slope > Dyadic::ZERO) {
            winding += if sides[0] == Greater { 1 } else { -1 };
        }
    }
    Some(winding)
}
