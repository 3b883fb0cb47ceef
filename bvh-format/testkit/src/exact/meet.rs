//! The oracle of contact: do two closed triangles share a point?
//!
//! The common part of two triangles is convex. If it is not empty, it has an extreme point, which lies on an edge of
//! one or the other. So the triangles meet exactly if an edge of one meets the other. The answer is `None` if a sign
//! is not certain.

use super::{Corners, Number, Vector, cross, dot, edges, is_zero, subtract};
use std::cmp::Ordering::{Equal, Greater, Less};

/// Returns whether two closed triangles share a point, or `None` if that is not certain.
pub fn meet<N: Number>(a: &Corners<N>, b: &Corners<N>) -> Option<bool> {
    for (one, other) in [(a, b), (b, a)] {
        for i in 0..3 {
            if edge_meets(&one[i], &one[(i + 1) % 3], other)? {
                return Some(true);
            }
        }
    }
    Some(false)
}

fn edge_meets<N: Number>(p: &Vector<N>, q: &Vector<N>, t: &Corners<N>) -> Option<bool> {
    let [first, second, third] = edges(t);
    let normal = cross(&first, &second);
    let flat = is_zero(&normal)?;
    if !flat {
        let height = |point: &Vector<N>| dot(&normal, &subtract(point, &t[0])).sign();
        match (height(p)?, height(q)?) {
            (Greater, Greater) | (Less, Less) => return Some(false),
            // The edge is in the plane, so it starts inside the triangle or crosses one of its edges.
            (Equal, Equal) => {
                let mut inside = true;
                for (edge, corner) in [&first, &second, &third].into_iter().zip(t) {
                    inside &= dot(&normal, &cross(edge, &subtract(p, corner))).sign()?.is_ge();
                }
                if inside {
                    return Some(true);
                }
            }
            // One point of the edge is in the plane. It is inside if the edge's line passes all edges on the same
            // side.
            _ => {
                let along = subtract(q, p);
                let mut sides = [Equal; 3];
                for i in 0..3 {
                    let (from, to) = (subtract(&t[i], p), subtract(&t[(i + 1) % 3], p));
                    sides[i] = dot(&along, &cross(&from, &to)).sign()?;
                }
                return Some(!(sides.contains(&Less) && sides.contains(&Greater)));
            }
        }
    }
    // A triangle without area, or in whose plane the edge lies, is met if one of its edges is met.
    for i in 0..3 {
        if edges_meet([p, q], [&t[i], &t[(i + 1) % 3]])? {
            return Some(true);
        }
    }
    Some(false)
}

/// Returns whether two closed segments meet, each of which may be a point.
fn edges_meet<N: Number>([p, q]: [&Vector<N>; 2], [r, s]: [&Vector<N>; 2]) -> Option<bool> {
    let (u, v, w) = (subtract(q, p), subtract(s, r), subtract(r, p));
    let normal = cross(&u, &v);
    if !is_zero(&normal)? {
        // If w = x u - y v, the lines cross at p + x u and r + y v.
        let whole = dot(&normal, &normal);
        let inside = |part: N| Some(part.sign()?.is_ge() && part.minus(&whole).sign()?.is_le());
        return Some(
            dot(&normal, &w).sign()?.is_eq()
                && inside(dot(&cross(&w, &v), &normal))?
                && inside(dot(&cross(&w, &u), &normal))?,
        );
    }
    if !is_zero(&cross(&w, &u))? || !is_zero(&cross(&w, &v))? {
        return Some(false);
    }
    // Segments on one line overlap if they overlap along every axis.
    for axis in 0..3 {
        let beyond = |x: &[&Vector<N>; 2], y: &[&Vector<N>; 2]| {
            let mut all = true;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                all &= x[i][axis].minus(&y[j][axis]).sign()?.is_gt();
            }
            Some(all)
        };
        if beyond(&[p, q], &[r, s])? || beyond(&[r, s], &[p, q])? {
            return Some(false);
        }
    }
    Some(true)
}
