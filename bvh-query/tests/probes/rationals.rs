//! The oracle: rays, segments and winding numbers in rational numbers, over all triangles.
//!
//! It shares neither code nor method with the library, which looks at the signs of edges: here the ray meets the plane of a
//! triangle at a rational point, which is inside if it is so in a projection; and in a plane with the ray a triangle is what
//! three half-planes have in common. Sides come from rays in random directions that meet no edge.

use crate::common::Triangle;
use dashu_int::IBig;
use std::cmp::Ordering;

type Vector = [IBig; 3];

/// A rational number with a positive denominator.
#[derive(Clone, Debug)]
pub(crate) struct Rational {
    numerator: IBig,
    denominator: IBig,
}

impl Rational {
    fn new(numerator: IBig, denominator: IBig) -> Self {
        if denominator < IBig::ZERO {
            Self { numerator: -numerator, denominator: -denominator }
        } else {
            Self { numerator, denominator }
        }
    }

    pub(crate) fn of(x: f64) -> Self {
        let (mantissa, exponent) = parts(x);
        let one = IBig::from(1);
        Self {
            numerator: IBig::from(mantissa) << exponent.max(0) as usize,
            denominator: one << (-exponent).max(0) as usize,
        }
    }

    pub(crate) fn compare(&self, other: &Self) -> Ordering {
        (&self.numerator * &other.denominator).cmp(&(&other.numerator * &self.denominator))
    }

    fn is_negative(&self) -> bool {
        self.numerator < IBig::ZERO
    }
}

/// Returns mantissa and exponent; 0 has the exponent 0.
fn parts(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let mantissa = if field == 0 { fraction } else { fraction | 1 << 52 };
    if mantissa == 0 {
        return (0, 0);
    }
    let zeros = mantissa.trailing_zeros() as i32;
    ((mantissa >> zeros) * if x < 0.0 { -1 } else { 1 }, field.max(1) - 1075 + zeros)
}

/// Lengths are in units of 2^`UNIT`: the numbers of the tests are multiples of it.
const UNIT: i32 = -400;

fn vector(p: &[f64; 3]) -> Vector {
    p.map(|x| {
        let (mantissa, exponent) = parts(x);
        IBig::from(mantissa) << if mantissa == 0 { 0 } else { (exponent - UNIT) as usize }
    })
}

fn minus(p: &Vector, q: &Vector) -> Vector {
    [0, 1, 2].map(|k| &p[k] - &q[k])
}

fn dot(p: &Vector, q: &Vector) -> IBig {
    &p[0] * &q[0] + &p[1] * &q[1] + &p[2] * &q[2]
}

fn cross(p: &Vector, q: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &p[i] * &q[j] - &p[j] * &q[i])
}

fn is_zero(v: &Vector) -> bool {
    v.iter().all(|x| *x == IBig::ZERO)
}

/// Returns the least parameter, at least 0, at which a ray meets a closed triangle.
pub(crate) fn first(origin: &[f64; 3], direction: &[f64; 3], triangle: &Triangle) -> Option<Rational> {
    let (o, d) = (vector(origin), vector(direction));
    let corners = triangle.each_ref().map(vector);
    let [a, b, c] = &corners;
    let normal = cross(&minus(b, a), &minus(c, a));
    if is_zero(&normal) {
        return first_on_segment(&o, &d, corners);
    }
    let (height, slope) = (dot(&normal, &minus(a, &o)), dot(&normal, &d));
    let axis = (0..3).find(|&k| normal[k] != IBig::ZERO).unwrap();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    // Twice the area of two vectors in the projection, with the sign that makes the triangle counterclockwise.
    let turn = |v: &Vector, w: &Vector| {
        let area = &v[i] * &w[j] - &v[j] * &w[i];
        if normal[axis] > IBig::ZERO { area } else { -area }
    };
    if slope != IBig::ZERO {
        let t = Rational::new(height, slope);
        // The point, times the denominator.
        let point = [0, 1, 2].map(|k| &o[k] * &t.denominator + &d[k] * &t.numerator);
        let is_inside = (0..3).all(|n| {
            let (p, q) = (&corners[n], &corners[(n + 1) % 3]);
            let from = [0, 1, 2].map(|k| &point[k] - &p[k] * &t.denominator);
            turn(&minus(q, p), &from) >= IBig::ZERO
        });
        return (is_inside && !t.is_negative()).then_some(t);
    }
    if height != IBig::ZERO {
        return None;
    }
    // All is in one plane: the ray is cut by the half-plane of each edge.
    let (mut from, mut to) = (Rational::of(0.0), None::<Rational>);
    for n in 0..3 {
        let (p, q) = (&corners[n], &corners[(n + 1) % 3]);
        let edge = minus(q, p);
        // Inside is where start + t * change >= 0.
        let (start, change) = (turn(&edge, &minus(&o, p)), turn(&edge, &d));
        if change == IBig::ZERO {
            if start < IBig::ZERO {
                return None;
            }
            continue;
        }
        let enters = change > IBig::ZERO;
        let t = Rational::new(-start, change);
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
    let (edge, from) = (minus(q, p), minus(p, o));
    let normal = cross(d, &edge);
    let axis = (0..3).find(|&k| d[k] != IBig::ZERO).unwrap();
    let along = |v: &Vector| Rational::new(v[axis].clone(), d[axis].clone());
    if is_zero(&normal) {
        if !is_zero(&cross(d, &from)) {
            return None;
        }
        let (s, t) = (along(&from), along(&minus(q, o)));
        let (near, far) = if s.compare(&t).is_lt() { (s, t) } else { (t, s) };
        return match (near.is_negative(), far.is_negative()) {
            (false, _) => Some(near),
            (true, false) => Some(Rational::of(0.0)),
            (true, true) => None,
        };
    }
    // o + t d = p + s e, crossed with e and with d.
    let squared = dot(&normal, &normal);
    if dot(&from, &normal) != IBig::ZERO {
        return None;
    }
    let t = Rational::new(dot(&cross(&from, &edge), &normal), squared.clone());
    let s = dot(&cross(&from, d), &normal);
    (!t.is_negative() && s >= IBig::ZERO && s <= squared).then_some(t)
}

/// Returns how often closed triangles wind around a point that is on none of them, by a ray in some direction; nothing if that
/// meets an edge or a corner.
pub(crate) fn winding(point: &[f64; 3], direction: &[f64; 3], triangles: &[Triangle]) -> Option<i64> {
    let (o, d) = (vector(point), vector(direction));
    let mut winding = 0;
    for triangle in triangles {
        let seen = triangle.each_ref().map(|corner| minus(&vector(corner), &o));
        let normal = cross(&minus(&seen[1], &seen[0]), &minus(&seen[2], &seen[0]));
        if is_zero(&normal) {
            continue;
        }
        let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| dot(&d, &cross(&seen[i], &seen[j])).signum());
        let sum: IBig = sides.iter().sum();
        let zeros = sides.iter().filter(|side| **side == IBig::ZERO).count();
        let is_mixed = sides.contains(&IBig::from(1)) && sides.contains(&IBig::from(-1));
        if is_mixed {
            continue;
        }
        if zeros > 0 {
            return None;
        }
        let (height, slope) = (dot(&normal, &seen[0]), dot(&normal, &d));
        if (height > IBig::ZERO) == (slope > IBig::ZERO) {
            winding += if sum > IBig::ZERO { 1 } else { -1 };
        }
    }
    Some(winding)
}
