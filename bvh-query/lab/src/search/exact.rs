//! The fast oracle of contact: do two closed triangles share a point? It shares no code with queries.
//!
//! The corners become integers of 61 bits on a common grid, and the answer follows from comparisons and from the signs
//! of orientations of three and four points, which are computed in 128 and 192 bits. Where the corners of a pair do not
//! fit, the slow oracle of the tests decides, in integers of any length. A pair takes a few hundred nanoseconds.
//!
//! The common part of two triangles is convex. If it is not empty, it has an extreme point, which lies on an edge of one
//! or the other. So the triangles meet exactly if an edge of one meets the other.

use super::slow::decide::{Boxed, Decided, intersect};
use cbvh_testkit::Triangle;
use std::cmp::Ordering::{self, Equal, Greater, Less};

type Point = [i64; 3];

/// Corners have fewer bits than this, so differences fit in 61 bits, minors in 124 and their sums of products in 187.
const MAX_BITS: i32 = 60;

/// Returns whether two closed triangles share a point, and whether the fast integers sufficed.
pub(super) fn meet(a: &Triangle, b: &Triangle) -> (bool, bool) {
    match on_common_grid(a, b) {
        Some([a, b]) => (triangles_meet(&a, &b), true),
        None => (intersect(&Boxed::new(*a), &Boxed::new(*b), &mut Decided::default()), false),
    }
}

/// Returns the corners in units of the coarsest grid that contains all of them, if they have few enough bits there.
fn on_common_grid(a: &Triangle, b: &Triangle) -> Option<[[Point; 3]; 2]> {
    let (mut lowest, mut highest) = (i32::MAX, i32::MIN);
    for &x in a.iter().chain(b).flatten() {
        let (mantissa, exponent) = parts(x);
        if mantissa != 0 {
            let zeros = mantissa.trailing_zeros() as i32;
            lowest = lowest.min(exponent + zeros);
            highest = highest.max(exponent + 64 - mantissa.leading_zeros() as i32);
        }
    }
    if lowest < highest && highest - lowest > MAX_BITS {
        return None;
    }
    let integer = |x: f64| {
        let (mantissa, exponent) = parts(x);
        if mantissa == 0 {
            return 0;
        }
        let shift = exponent - lowest;
        let magnitude = if shift >= 0 { mantissa << shift } else { mantissa >> -shift } as i64;
        if x < 0.0 { -magnitude } else { magnitude }
    };
    Some([a, b].map(|t| t.map(|p| p.map(integer))))
}

/// Returns the integer mantissa and the exponent of the magnitude of a finite number.
fn parts(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, bits & ((1 << 52) - 1));
    if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) }
}

fn triangles_meet(a: &[Point; 3], b: &[Point; 3]) -> bool {
    let heights = [(a, b), (b, a)].map(|(t, other)| {
        let normal = cross(subtract(&t[1], &t[0]), subtract(&t[2], &t[0]));
        let heights = (normal != [0; 3]).then(|| other.map(|p| sign_of_dot(normal, subtract(&p, &t[0]))));
        (normal, heights)
    });
    // All corners of one strictly on one side of the other's plane.
    if heights.iter().any(|(_, heights)| *heights == Some([Less; 3]) || *heights == Some([Greater; 3])) {
        return false;
    }
    [(a, b), (b, a)].iter().zip(&heights).any(|((t, other), (normal, heights))| {
        (0..3).any(|i| {
            let (j, ends) = ((i + 1) % 3, (&other[i], &other[(i + 1) % 3]));
            edge_meets(ends, heights.map(|heights| (heights[i], heights[j])), t, normal)
        })
    })
}

/// Returns whether the segment from `p` to `q` meets a triangle, of whose plane its ends are on these sides. Without
/// sides, the triangle has no area.
fn edge_meets(
    (p, q): (&Point, &Point),
    sides: Option<(Ordering, Ordering)>,
    t: &[Point; 3],
    normal: &[i128; 3],
) -> bool {
    let sides_of = [(0, 1), (1, 2), (2, 0)];
    match sides {
        Some((Less, Less) | (Greater, Greater)) => return false,
        // The segment is in the plane: it starts inside the triangle, or meets one of its sides as below.
        Some((Equal, Equal)) => {
            let axis = (0..3).find(|&k| normal[k] != 0).unwrap_or(0);
            let turns = sides_of.map(|(i, j)| turn(&t[i], &t[j], p, axis));
            if !(turns.contains(&Less) && turns.contains(&Greater)) {
                return true;
            }
        }
        // One point of the segment is in the plane. It is in the triangle if the line passes all sides the same way.
        Some(_) => {
            let along = subtract(q, p);
            let ways =
                sides_of.map(|(i, j)| sign_of_dot(cross(subtract(&t[i], p), subtract(&t[j], p)), along));
            return !(ways.contains(&Less) && ways.contains(&Greater));
        }
        None => {}
    }
    sides_of.iter().any(|&(i, j)| segments_meet([p, q], [&t[i], &t[j]]))
}

/// Returns whether two closed segments meet, each of which may be a point.
///
/// They do if they are in one plane and their projections along an axis meet, where the axis is not parallel to that
/// plane. Without such an axis all four points are on one line, where overlap is seen along every axis.
fn segments_meet([p, q]: [&Point; 2], [r, s]: [&Point; 2]) -> bool {
    let overlap = (0..3).all(|k| p[k].min(q[k]) <= r[k].max(s[k]) && r[k].min(s[k]) <= p[k].max(q[k]));
    if !overlap {
        return false;
    }
    let faces =
        [[p, q, r], [p, q, s], [r, s, p], [r, s, q]].map(|[x, y, z]| cross(subtract(y, x), subtract(z, x)));
    if sign_of_dot(faces[0], subtract(s, p)) != Equal {
        return false;
    }
    let Some(axis) = (0..3).find(|&k| faces.iter().any(|face| face[k] != 0)) else { return true };
    let crossed = |one: i128, two: i128| one.signum() * two.signum() <= 0;
    crossed(faces[0][axis], faces[1][axis]) && crossed(faces[2][axis], faces[3][axis])
}

/// Returns on which side of the line from `p` to `q` the point `r` is, seen along an axis.
fn turn(p: &Point, q: &Point, r: &Point, axis: usize) -> Ordering {
    cross(subtract(q, p), subtract(r, p))[axis].cmp(&0)
}

fn subtract(p: &Point, q: &Point) -> Point {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

fn cross(p: Point, q: Point) -> [i128; 3] {
    let product = |x: i64, y: i64| i128::from(x) * i128::from(y);
    let minor = |i: usize, j: usize| product(p[i], q[j]) - product(p[j], q[i]);
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Returns the sign of a sum of three products, each of 124 and 61 bits, as a high part in units of 2^64 and a low part.
fn sign_of_dot(p: [i128; 3], q: Point) -> Ordering {
    let (mut high, mut low) = (0i128, 0i128);
    for k in 0..3 {
        let factor = i128::from(q[k]);
        high += (p[k] >> 64) * factor;
        low += (p[k] & i128::from(u64::MAX)) * factor;
    }
    (high + (low >> 64)).cmp(&0).then((low & i128::from(u64::MAX)).cmp(&0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;
    use cbvh_testkit::depth::rounds;

    /// Makes a triangle of small integers, or a segment or a point.
    fn triangle(random: &mut Random, spread: usize) -> Triangle {
        let mut number = || random.below(2 * spread + 1) as f64 - spread as f64;
        let [p, u, v] = [(); 3].map(|()| [(); 3].map(|()| number()));
        let plus = |q: [f64; 3], x: f64| [0, 1, 2].map(|k| p[k] + x * q[k]);
        match random.below(8) {
            0 => [p, p, p],
            1 => [p, plus(u, 1.0), plus(u, 2.0)],
            2 => [p, plus(u, 1.0), p],
            3 => [p, plus(u, 1.0), plus(u, -0.5)],
            _ => [p, plus(u, 1.0), plus(v, 1.0)],
        }
    }

    /// Moves a triangle so that a corner of it is a corner of another or the middle of an edge.
    fn touching(t: Triangle, other: &Triangle, random: &mut Random) -> Triangle {
        let [i, j] = [0; 2].map(|_| random.below(3));
        let from = t[random.below(3)];
        t.map(|p| [0, 1, 2].map(|k| p[k] - from[k] + (other[i][k] + other[j][k]) / 2.0))
    }

    /// Moves a coordinate by a rounding.
    fn nudge(t: &mut Triangle, random: &mut Random) {
        let x = &mut t[random.below(3)][random.below(3)];
        *x = if random.below(2) == 0 { x.next_up() } else { x.next_down() };
    }

    /// The slow oracle tests the same theorem in other arithmetic; both must say the same.
    #[test]
    fn the_fast_and_the_slow_oracle_agree() {
        let (mut random, mut fast, mut met) = (Random::new(1), 0u64, 0u64);
        let pairs = rounds(100_000);
        for pair in 0..pairs {
            let spread = 1 + (pair % 5) as usize;
            let a = triangle(&mut random, spread);
            let mut b = triangle(&mut random, spread);
            if pair % 3 != 0 {
                b = touching(b, &a, &mut random);
            }
            let scale = 2f64.powi(random.below(200) as i32 - 100);
            let far = if pair % 4 == 0 { 2f64.powi(random.below(50) as i32) } else { 0.0 };
            let [a, mut b] = [a, b].map(|t| t.map(|p| p.map(|x| (x + far) * scale)));
            if random.below(2) == 0 {
                nudge(&mut b, &mut random);
            }
            let (answer, was_fast) = meet(&a, &b);
            let slow = intersect(&Boxed::new(a), &Boxed::new(b), &mut Decided::default());
            assert_eq!(answer, slow, "{a:?} {b:?}");
            fast += u64::from(was_fast);
            met += u64::from(answer);
        }
        assert!(2 * fast > pairs && 10 * met > pairs && 10 * met < 9 * pairs, "{fast} fast, {met} met");
    }

    #[test]
    fn the_largest_integers_do_not_overflow() {
        let most = (1i64 << MAX_BITS) - 1;
        let corners = [[most, most, -most], [-most, most, most], [most, -most, most]];
        // In parallel planes, whose x + y + z differ by 1.
        let shifted = corners.map(|p| p.map(|x| if x < 0 { x + 1 } else { x }));
        assert!(!triangles_meet(&corners, &shifted) && !triangles_meet(&shifted, &corners));
        let tilted = [shifted[0], shifted[1], [most, -most, most - 1]];
        assert!(triangles_meet(&corners, &corners) && triangles_meet(&corners, &tilted));
        let product = [i128::from(most) * i128::from(most) * 8, 0, 0];
        assert_eq!(sign_of_dot(product, [2 * most, 0, 0]), Greater);
        assert_eq!(sign_of_dot(product.map(|x| -x), [2 * most, 0, 0]), Less);
        assert_eq!(sign_of_dot([1, -1, 0], [most, most, 0]), Equal);
    }
}
