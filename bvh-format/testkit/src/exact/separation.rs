//! The oracle that bounds a distance from below, by the widest slab that separates the triangles.
//!
//! A slab between the triangles is never wider than their distance, whatever its direction. The widest one is
//! perpendicular to the line between the closest points. That line is the normal of a face or of two edges, or joins
//! two corners, or is such a join without its part along an edge. So where the widest slab equals the least distance
//! over features, both are proved right, no matter how they were found.

use super::features::{Fraction, is_less};
use super::{Corners, Number, Vector, cross, dot, edges, is_zero, subtract};

/// Returns the vectors from each corner of `a` to each corner of `b`.
pub(super) fn gaps<N: Number>(a: &Corners<N>, b: &Corners<N>) -> Vec<Vector<N>> {
    a.iter().flat_map(|p| b.iter().map(|q| subtract(q, p))).collect()
}

/// Calls `visit` with all directions along which triangles may be apart, some of them zero, until it breaks.
pub(super) fn directions<N: Number>(
    a: &Corners<N>,
    b: &Corners<N>,
    mut visit: impl FnMut(Vector<N>) -> Option<bool>,
) -> Option<bool> {
    let (edges_a, edges_b) = (edges(a), edges(b));
    let mut done = visit(cross(&edges_a[0], &edges_a[1]))? || visit(cross(&edges_b[0], &edges_b[1]))?;
    for (edge_a, edge_b) in edges_a.iter().flat_map(|p| edges_b.iter().map(move |q| (p, q))) {
        done = done || visit(cross(edge_a, edge_b))?;
    }
    for (i, j) in (0..9).map(|pair| (pair / 3, pair % 3)) {
        let gap = subtract(&b[j], &a[i]);
        for edge in [&edges_a[i], &edges_b[j]] {
            done = done || visit(cross(&cross(edge, &gap), edge))?;
        }
        done = done || visit(gap)?;
    }
    Some(done)
}

/// Returns the squared width of the widest slab between the triangles, or `None` if there is none.
pub(super) fn widest<N: Number>(a: &Corners<N>, b: &Corners<N>, zero: &N) -> Option<Fraction<N>> {
    let gaps = gaps(a, b);
    let mut best: Option<Fraction<N>> = None;
    directions(a, b, |direction| {
        let heights: Vec<N> = gaps.iter().map(|gap| dot(&direction, gap)).collect();
        let below: Vec<N> = heights.iter().map(|height| zero.minus(height)).collect();
        for heights in [heights, below] {
            let mut least = heights[0].clone();
            for height in &heights[1..] {
                if height.minus(&least).sign()?.is_lt() {
                    least = height.clone();
                }
            }
            if !is_zero(&direction)? && least.sign()?.is_gt() {
                let found = (least.times(&least), dot(&direction, &direction));
                let wider = best.as_ref().is_none_or(|best| is_less(best, &found) == Some(true));
                best = if wider { Some(found) } else { best.take() };
            }
        }
        Some(false)
    })?;
    best
}
