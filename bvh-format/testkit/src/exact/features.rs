//! The oracle that bounds a distance from above, by the least distance over pairs of features of the triangles.
//!
//! Each candidate is the distance between two points of the triangles, so the least one is never too small.
//! `separation` proves that it is never too large.

use super::{Corners, Number, Vector, cross, dot, edges, is_zero, meet, subtract};

/// A squared length: numerator and positive denominator.
pub type Fraction<N> = (N, N);

/// Returns whether the first fraction is smaller.
pub fn is_less<N: Number>(p: &Fraction<N>, q: &Fraction<N>) -> Option<bool> {
    Some(p.0.times(&q.1).minus(&q.0.times(&p.1)).sign()?.is_lt())
}

/// Returns the squared distance of two closed triangles. `zero` and `one` are the numbers 0 and 1.
pub fn squared_distance<N: Number>(
    a: &Corners<N>,
    b: &Corners<N>,
    [zero, one]: &[N; 2],
) -> Option<Fraction<N>> {
    if meet(a, b)? {
        return Some((zero.clone(), one.clone()));
    }
    let mut candidates = Vec::with_capacity(64);
    for (corner_a, corner_b) in a.iter().flat_map(|p| b.iter().map(move |q| (p, q))) {
        let gap = subtract(corner_a, corner_b);
        candidates.push((dot(&gap, &gap), one.clone()));
    }
    for (points, t) in [(a, b), (b, a)] {
        let edges = edges(t);
        let normal = cross(&edges[0], &edges[1]);
        for point in points {
            let gaps = [0, 1, 2].map(|i: usize| subtract(point, &t[i]));
            let mut inside = !is_zero(&normal)?;
            for (gap, edge) in gaps.iter().zip(&edges) {
                candidates.extend(off_edge(gap, edge)?);
                inside = inside && dot(&normal, &cross(edge, gap)).sign()?.is_ge();
            }
            if inside {
                let height = dot(&normal, &gaps[0]);
                candidates.push((height.times(&height), dot(&normal, &normal)));
            }
        }
    }
    for (corner_a, edge_a) in a.iter().zip(&edges(a)) {
        for (corner_b, edge_b) in b.iter().zip(&edges(b)) {
            candidates.extend(between_edges(&subtract(corner_b, corner_a), edge_a, edge_b)?);
        }
    }
    let mut least = candidates.swap_remove(0);
    for candidate in candidates {
        if is_less(&candidate, &least)? {
            least = candidate;
        }
    }
    Some(least)
}

/// Returns the squared distance perpendicular to an edge, from a point that is `gap` away from the start of the edge,
/// if the foot of the perpendicular is between the edge's ends.
fn off_edge<N: Number>(gap: &Vector<N>, edge: &Vector<N>) -> Option<Option<Fraction<N>>> {
    let (along, whole) = (dot(gap, edge), dot(edge, edge));
    let between = along.sign()?.is_gt() && along.minus(&whole).sign()?.is_lt();
    let square = || dot(gap, gap).times(&whole).minus(&along.times(&along));
    Some(between.then(|| (square(), whole.clone())))
}

/// Returns the squared distance perpendicular to two edges, whose starts are `gap` apart, if both feet of the
/// perpendicular are between the edges' ends.
fn between_edges<N: Number>(gap: &Vector<N>, u: &Vector<N>, v: &Vector<N>) -> Option<Option<Fraction<N>>> {
    let normal = cross(u, v);
    let whole = dot(&normal, &normal);
    // For gap = x u - y v + z normal, these parts are x and y, multiplied by `whole`.
    for part in [dot(&cross(gap, v), &normal), dot(&cross(gap, u), &normal)] {
        if part.sign()?.is_le() || part.minus(&whole).sign()?.is_ge() {
            return Some(None);
        }
    }
    let height = dot(&normal, gap);
    Some(Some((height.times(&height), whole)))
}
