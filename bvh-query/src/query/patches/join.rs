//! Joins the points of regions into vertices, and regions with a vertex in common into patches.

use crate::error::QueryError;
use crate::narrow::{dot, subtract};
use crate::numerics::HEIGHT_ERROR;
use crate::query::regions::ContactRegion;
use crate::traverse::budget::Budget;
use std::ops::Range;

/// A direction, shorter than 1, along which points are sorted. Few meshes have many points at one height along it.
const DIRECTION: [f64; 3] = [0.531, 0.323, 0.762];

/// The comparisons of points that count as a visit.
const COMPARISONS_PER_VISIT: u64 = 64;

/// The points of all regions, of which those are one vertex that are close to each other.
pub(super) struct Vertices {
    /// For each region, where its points start.
    starts: Vec<usize>,
    /// For each point, the first point of its vertex.
    vertices: Vec<usize>,
}

/// Which contacts belong together.
pub(super) struct Joined {
    /// The contacts, those of each patch together.
    pub(super) order: Vec<usize>,
    /// The places of each patch's contacts in `order`.
    pub(super) ranges: Vec<Range<usize>>,
}

/// A point to be compared with others.
struct SortedPoint {
    /// A lower bound.
    height: f64,
    point: [f64; 3],
    error: f64,
    number: usize,
}

impl SortedPoint {
    fn new(point: [f64; 3], error: f64, number: usize) -> Self {
        let height = dot(DIRECTION, point) - height_error(point);
        Self { height, point, error, number }
    }
}

fn height_error(point: [f64; 3]) -> f64 {
    HEIGHT_ERROR * point.iter().map(|x| x.abs()).sum::<f64>()
}

impl Vertices {
    pub(super) fn new(
        regions: &[ContactRegion],
        tolerance: f64,
        budget: &mut Budget,
    ) -> Result<Self, QueryError> {
        let (mut starts, mut points) = (Vec::with_capacity(regions.len() + 1), Vec::new());
        for region in regions {
            starts.push(points.len());
            for point in region.points() {
                points.push(SortedPoint::new(*point, region.error + tolerance / 2.0, points.len()));
            }
        }
        starts.push(points.len());
        let mut sets = Sets::new(points.len());
        join_points(points, &mut sets, budget)?;
        Ok(Self { starts, vertices: sets.firsts() })
    }

    /// Returns the vertices of a region's points.
    pub(super) fn of(&self, region: usize) -> &[usize] {
        &self.vertices[self.starts[region]..self.starts[region + 1]]
    }

    /// Joins regions with a vertex in common.
    pub(super) fn join(&self) -> Joined {
        let regions = self.starts.len() - 1;
        let mut sets = Sets::new(regions);
        let mut seen = vec![None; self.vertices.len()];
        for region in 0..regions {
            for &vertex in self.of(region) {
                match seen[vertex] {
                    None => seen[vertex] = Some(region),
                    Some(other) => sets.join(other, region),
                }
            }
        }
        let firsts = sets.firsts();
        // The number of contacts of each patch, by its first contact, and then the place of the next one.
        let mut places = vec![0; regions];
        firsts.iter().for_each(|&first| places[first] += 1);
        let (mut ranges, mut end) = (Vec::new(), 0);
        for place in places.iter_mut().filter(|count| **count > 0) {
            ranges.push(end..end + *place);
            (*place, end) = (end, end + *place);
        }
        let mut order = vec![0; regions];
        for (region, &first) in firsts.iter().enumerate() {
            order[places[first]] = region;
            places[first] += 1;
        }
        Joined { order, ranges }
    }
}

/// Joins points that are no farther apart than their errors together. Which they are depends on no order.
fn join_points(mut points: Vec<SortedPoint>, sets: &mut Sets, budget: &mut Budget) -> Result<(), QueryError> {
    points.sort_unstable_by(|p, q| {
        let order = |p: f64, q: f64| p.total_cmp(&q);
        let by_point = || (0..3).map(|k| order(p.point[k], q.point[k])).find(|order| order.is_ne());
        order(p.height, q.height)
            .then_with(|| by_point().unwrap_or(std::cmp::Ordering::Equal))
            // Of equal points, the one with the largest error stands for all.
            .then(order(q.error, p.error))
            .then(p.number.cmp(&q.number))
    });
    points.dedup_by(|later, earlier| {
        let is_equal = later.point == earlier.point;
        if is_equal {
            sets.join(later.number, earlier.number);
        }
        is_equal
    });
    let widest = points.iter().fold(0.0_f64, |most, point| most.max(point.error));
    let mut compared = 0;
    for (i, p) in points.iter().enumerate() {
        let reach = p.error + widest;
        let limit = p.height + (reach + 2.0 * height_error(p.point)) * (1.0 + f64::EPSILON);
        for q in points[i + 1..].iter().take_while(|q| q.height <= limit) {
            compared += 1;
            if compared % COMPARISONS_PER_VISIT == 0 {
                budget.visit()?;
            }
            if is_within(subtract(p.point, q.point), p.error + q.error) {
                sets.join(p.number, q.number);
            }
        }
    }
    Ok(())
}

/// Returns whether a vector is no longer than a length, but for roundings.
fn is_within(v: [f64; 3], length: f64) -> bool {
    let largest = v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    // Of numbers near the smallest, and of the largest, squares tell nothing.
    let scaled = v.map(|x| x / length);
    largest <= length && (length == 0.0 || dot(scaled, scaled) <= 1.0 + 8.0 * f64::EPSILON)
}

/// Disjoint sets of numbers, each of which is known by its least one (B. A. Galler and M. J. Fischer, "An Improved Equivalence
/// Algorithm", 1964).
struct Sets(Vec<usize>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn first(&mut self, mut number: usize) -> usize {
        while self.0[number] != number {
            self.0[number] = self.0[self.0[number]];
            number = self.0[number];
        }
        number
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.first(one), self.first(other));
        self.0[one.max(other)] = one.min(other);
    }

    /// Returns the least number of each number's set.
    fn firsts(mut self) -> Vec<usize> {
        (0..self.0.len()).map(|number| self.first(number)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    /// Joins by comparing all points.
    fn of_all_pairs(points: &[SortedPoint]) -> Vec<usize> {
        let mut sets = Sets::new(points.len());
        for p in points {
            for q in points {
                if is_within(subtract(p.point, q.point), p.error + q.error) {
                    sets.join(p.number, q.number);
                }
            }
        }
        sets.firsts()
    }

    #[test]
    fn points_are_joined_as_all_pairs_say() {
        let mut random = Random::new(6);
        let mut joined = 0;
        for round in 0..200 {
            // Far from the origin, the points are as near as roundings are large.
            let (far, scale) = [(0.0, 1.0), (1e9, 1e-6), (0.0, 1e-300), (1e30, 1e14)][round % 4];
            let mut points = Vec::new();
            for number in 0..60 {
                let p = random.point().map(|x| far + scale * (4.0 * x).round() / 4.0);
                let nudge = [0.0, f64::EPSILON * far, scale * 1e-3][random.below(3)];
                let point = [p[0] + nudge, p[1], p[2] - nudge];
                let error = scale * [0.0, 1e-4, 0.01, 0.12][random.below(4)];
                points.push(SortedPoint::new(point, error, number));
            }
            let expected = of_all_pairs(&points);
            let mut sets = Sets::new(points.len());
            join_points(points, &mut sets, &mut Budget::new(u64::MAX)).unwrap();
            joined += expected.iter().enumerate().filter(|(i, first)| i != *first).count();
            assert_eq!(sets.firsts(), expected);
        }
        assert!(joined > 1000 && joined < 11_000, "{joined}");
    }
}
