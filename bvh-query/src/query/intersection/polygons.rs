//! The parts of a face as polygons: closed ways along the lines around them, and which of these are holes in which.

use crate::error::QueryError;
use crate::narrow::{Point, Triangle, cross, largest_of, subtract};
use crate::query::intersection::cuts::{Arc, Node};
use crate::traverse::budget::Budget;
use std::collections::BTreeMap;

/// The comparisons of points that count as a visit.
pub(super) const COMPARISONS: u64 = 64;

/// The most times that a line counts: no solid has surfaces that lie on each other more often.
const MAX_WEIGHT: u64 = 8;

/// The nodes of a polygon's outline, and those of its holes.
pub(super) type Polygon = Vec<Vec<u32>>;

/// Returns the parts of a face, given the lines around them. Outlines go around them as the corners of the triangle do, and holes the
/// other way; the reverse if the other mesh is turned inside out.
pub(super) fn polygons(
    nodes: &[Node],
    triangle: &Triangle,
    arcs: &[Arc],
    budget: &mut Budget,
) -> Result<Vec<Polygon>, QueryError> {
    let mut ways = ways(arcs);
    if ways.len() < 2 {
        return Ok(ways.pop().map(|way| vec![way]).into_iter().collect());
    }
    let axis = steepest_axis(triangle);
    let flatten = |point: [f64; 3]| [point[(axis + 1) % 3], point[(axis + 2) % 3]];
    let flat = |node: u32| flatten(nodes[node as usize].point);
    let turn =
        |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let [a, b, c] = triangle.map(flatten);
    let orientation = turn(a, b, c).signum();
    let area = |way: &[u32]| {
        let first = flat(way[0]);
        orientation * way.windows(2).map(|pair| turn(first, flat(pair[0]), flat(pair[1]))).sum::<f64>()
    };
    let (mut outlines, mut holes): (Vec<(f64, Polygon)>, Vec<Vec<u32>>) = (Vec::new(), Vec::new());
    let areas: Vec<f64> = ways.iter().map(|way| area(way)).collect();
    // Outlines have more area than their holes. All ways lead the other way around where one mesh is turned inside out.
    let sign = if areas.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    for (way, area) in ways.into_iter().zip(areas) {
        let area = sign * area;
        if area < 0.0 {
            holes.push(way);
        } else {
            outlines.push((area, vec![way]));
        }
    }
    // The least outline around a hole is the one that it is in.
    outlines.sort_by(|x, y| x.0.total_cmp(&y.0));
    for hole in holes {
        let point = flat(hole[0]);
        for (_, polygon) in &mut outlines {
            let outline = &polygon[0];
            budget.charge(outline.len() as u64 / COMPARISONS + 1)?;
            let ends =
                (0..outline.len()).map(|at| [outline[at], outline[(at + 1) % outline.len()]].map(flat));
            if goes_around(ends, point) {
                polygon.push(hole);
                break;
            }
        }
    }
    Ok(outlines.into_iter().map(|(_, polygon)| polygon).collect())
}

/// Returns the axis along which a triangle is seen best: that of the largest component of its normal. A normal that is rounded has
/// components near 0 that tell nothing.
pub(super) fn steepest_axis([p, q, r]: &Triangle) -> usize {
    let normal: Point = cross(subtract(*q, *p), subtract(*r, *p));
    largest_of(normal.map(f64::abs))
}

/// Returns whether lines in a plane go around a point.
pub(super) fn goes_around(lines: impl Iterator<Item = [[f64; 2]; 2]>, [x, y]: [f64; 2]) -> bool {
    let crossed = lines
        .filter(|[p, q]| (p[1] > y) != (q[1] > y) && x < p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0]));
    crossed.count() % 2 == 1
}

/// Returns the closed ways that lines form, by their nodes.
fn ways(arcs: &[Arc]) -> Vec<Vec<u32>> {
    let mut leaving: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for arc in arcs {
        let (from, to) = if arc.weight > 0 { (arc.from, arc.to) } else { (arc.to, arc.from) };
        for _ in 0..arc.weight.unsigned_abs().min(MAX_WEIGHT) {
            leaving.entry(from).or_default().push(to);
        }
    }
    let mut ways = Vec::new();
    while let Some((&start, _)) = leaving.first_key_value() {
        let (mut way, mut at) = (Vec::new(), start);
        while let Some(next) = leaving.get_mut(&at).and_then(Vec::pop) {
            way.push(at);
            if leaving[&at].is_empty() {
                leaving.remove(&at);
            }
            at = next;
            if at == start {
                break;
            }
        }
        ways.push(way);
    }
    ways
}
