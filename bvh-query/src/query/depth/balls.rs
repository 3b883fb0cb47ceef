//! A point that is deep inside both shapes.
//!
//! Let a ball of radius `a` about a point be inside A, and one of radius `b` about the same point inside B. While B moves by less
//! than `a + b`, the balls have a common point, so interiors meet. The largest sum is the maximum of the depth in A plus the
//! depth in B. Each changes by no more than a point moves, so the sum at the centre of a cell bounds it in all of the cell:
//! the search takes the cell with the largest bound, looks at its centre and halves it (Piyavskii 1972, Hansen, Jaumard 1995).

use crate::error::QueryError;
use crate::narrow::{Point, common_region, cross, subtract};
use crate::query::depth::leaving::Leaving;
use crate::query::depth::translation::Translation;
use crate::query::probe::closest::{ClosestPoint, IsWithin};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::side::OpenObject;
use crate::query::probe::side::Side;
use crate::query::querier::Querier;
use bvh_format::vec3::length;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How deep a point is in both shapes, negative outside, and the points of their cores that are closest to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depths {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) closest: [Point; 2],
}

impl Depths {
    /// Returns how far B moves at least until the balls have no common point; 0 if one of them is none. On a surface there is none:
    /// it need not enclose anything.
    pub(super) fn common(&self) -> f64 {
        if self.a > 0.0 && self.b > 0.0 { self.a + self.b } else { 0.0 }
    }
}

/// Two balls about one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balls {
    pub(super) centre: Point,
    pub(super) depths: Depths,
    /// A bound on the errors of both depths.
    pub(super) error: f64,
    /// No point has a larger sum.
    pub(super) bound: f64,
}

impl Balls {
    /// Takes another point if its sum is larger.
    pub(super) fn take(&mut self, centre: Point, depths: Depths) {
        if depths.common() > self.depths.common() {
            (self.centre, self.depths) = (centre, depths);
        }
    }

    /// Returns a length that no translation which makes interiors disjoint is shorter than.
    pub(super) fn lower(&self) -> f64 {
        (self.depths.common() - self.error).max(0.0)
    }
}

/// A box in which the deepest point may be.
struct CentreBox {
    bound: f64,
    centre: Point,
    half: Point,
    /// Cells of equal bounds come in this order.
    number: u32,
}

impl Ord for CentreBox {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for CentreBox {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for CentreBox {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for CentreBox {}

/// The most steps by which a centre climbs to a greater sum.
pub(super) const ASCENT_STEPS: u32 = 10;
/// The search ends when no sum can exceed the one found by more than this part.
const PRECISION: f64 = 1.0 / 64.0;

impl Querier {
    /// Returns the deepest point that a search finds among some points, or the first one whose sum is `enough`.
    pub(super) fn balls(
        &mut self,
        line: &Translation<'_>,
        points: u32,
        enough: f64,
    ) -> Result<Balls, QueryError> {
        let (a, b) = (line.a.into(), line.b.at(line.pose));
        let Some((centre, half)) = common_box(&a, &b) else { return Ok(line.no_balls()) };
        let mut best = line.no_balls();
        let mut cells = BinaryHeap::new();
        cells.push(CentreBox { bound: f64::INFINITY, centre, half, number: 0 });
        for number in 1..points {
            let Some(mut cell) = cells.pop() else { break };
            best.bound = cell.bound;
            if cell.bound <= best.lower() * (1.0 + PRECISION) || best.lower() >= enough {
                break;
            }
            let depths = self.depths(&a, &b, &cell.centre)?;
            best.take(cell.centre, depths);
            let radius = length(cell.half);
            cell.bound = cell.bound.min(depths.a + depths.b + 2.0 * (radius + line.error));
            if cell.bound <= 0.0 || depths.a.min(depths.b) + radius + line.error <= 0.0 {
                continue;
            }
            let widest = (1..3).fold(0, |k, j| if cell.half[j] > cell.half[k] { j } else { k });
            let mut half = cell.half;
            half[widest] /= 2.0;
            for side in [-1.0, 1.0] {
                let mut centre = cell.centre;
                centre[widest] += side * half[widest];
                cells.push(CentreBox {
                    bound: cell.bound,
                    centre,
                    half,
                    number: 2 * number + u32::from(side > 0.0),
                });
            }
        }
        Ok(best)
    }

    /// Returns a deep point that is found from the contact that would be the last to leave along the line.
    pub(super) fn point_at_contact(
        &mut self,
        line: &Translation<'_>,
        leaving: &Leaving,
    ) -> Result<Balls, QueryError> {
        let (a, b) = (line.a.into(), line.b.at(line.pose));
        let mut balls = line.no_balls();
        if leaving.touches_until.is_none() {
            return Ok(balls);
        }
        let [of_a, of_b] = &leaving.last;
        let region = common_region(of_a, of_b);
        let ends = &region.points[..region.count];
        let point = [0, 1, 2].map(|k| ends.iter().map(|end| end[k]).sum::<f64>() / ends.len() as f64);
        let inwards = leaving.last.map(|[p, q, r]| {
            let normal = cross(subtract(q, p), subtract(r, p));
            let scale = length(normal).max(f64::MIN_POSITIVE);
            normal.map(|x| -x / scale)
        });
        let mut step = line.size / 8.0;
        for _ in 0..10 {
            let centre = [0, 1, 2].map(|k| point[k] + step * (inwards[0][k] + inwards[1][k]));
            self.offer(&a, &b, &mut balls, centre)?;
            step /= 4.0;
        }
        if balls.lower() > 0.0 {
            self.ascend(&a, &b, &mut balls, ASCENT_STEPS)?;
        }
        Ok(balls)
    }

    /// Moves a common point to where the sum is larger, away from the closest points.
    pub(super) fn ascend(
        &mut self,
        a: &PlacedShape<'_>,
        b: &PlacedShape<'_>,
        balls: &mut Balls,
        steps: u32,
    ) -> Result<(), QueryError> {
        let mut step = balls.depths.common() / 2.0;
        for _ in 0..steps {
            let (from, depths) = (balls.centre, balls.depths);
            let away = depths.closest.map(|closest| {
                let way = [0, 1, 2].map(|k| from[k] - closest[k]);
                let length = length(way).max(f64::MIN_POSITIVE);
                way.map(|x| x / length)
            });
            let centre = [0, 1, 2].map(|k| from[k] + step * (away[0][k] + away[1][k]));
            self.offer(a, b, balls, centre)?;
            if balls.centre == from {
                step /= 2.0;
            }
        }
        Ok(())
    }

    /// Takes a point if its sum is larger. The sides of a point are found only where its distances leave room for that.
    pub(super) fn offer(
        &mut self,
        a: &PlacedShape<'_>,
        b: &PlacedShape<'_>,
        balls: &mut Balls,
        centre: Point,
    ) -> Result<(), QueryError> {
        let (Some(of_a), Some(of_b)) = (self.nearest_to(a, &centre)?, self.nearest_to(b, &centre)?) else {
            return Ok(());
        };
        if of_a.lower + a.shape.radius() + of_b.lower + b.shape.radius() <= balls.depths.common() {
            return Ok(());
        }
        let depth_a = self.depth_at(a, &centre, &of_a)?;
        if depth_a > 0.0 {
            let depth_b = self.depth_at(b, &centre, &of_b)?;
            balls.take(centre, Depths { a: depth_a, b: depth_b, closest: [of_a.point, of_b.point] });
        }
        Ok(())
    }

    /// Returns how deep a point is in both shapes.
    fn depths(
        &mut self,
        a: &PlacedShape<'_>,
        b: &PlacedShape<'_>,
        point: &Point,
    ) -> Result<Depths, QueryError> {
        let ((a, closest_a), (b, closest_b)) = (self.depth_in(a, point)?, self.depth_in(b, point)?);
        Ok(Depths { a, b, closest: [closest_a, closest_b] })
    }

    /// Returns how deep a point is in a shape, and the closest point of the core.
    fn depth_in(&mut self, shape: &PlacedShape<'_>, point: &Point) -> Result<(f64, Point), QueryError> {
        match self.nearest_to(shape, point)? {
            Some(closest) => Ok((self.depth_at(shape, point, &closest)?, closest.point)),
            None => Ok((f64::NEG_INFINITY, *point)),
        }
    }

    /// Returns the closest point of a core.
    fn nearest_to(
        &mut self,
        shape: &PlacedShape<'_>,
        point: &Point,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        self.closest_of_core(shape, point, f64::INFINITY, IsWithin::Closed)
    }

    /// Returns how deep a point is in a shape at least, or minus how far away it is at most, given the closest point of the core.
    fn depth_at(
        &mut self,
        shape: &PlacedShape<'_>,
        point: &Point,
        closest: &ClosestPoint,
    ) -> Result<f64, QueryError> {
        let depth = match self.side_of(shape, point, OpenObject::Empty)? {
            Side::Inside => closest.lower,
            Side::On => 0.0,
            Side::Outside | Side::Undefined => -closest.upper,
        };
        Ok(depth + shape.shape.radius())
    }
}

impl Translation<'_> {
    /// No point is known that is inside both shapes.
    pub(super) fn no_balls(&self) -> Balls {
        let nowhere = Depths { a: -1.0, b: -1.0, closest: [[0.0; 3]; 2] };
        Balls { centre: [0.0; 3], depths: nowhere, error: 4.0 * self.error, bound: 0.0 }
    }
}

/// Returns the centre and the half sides of the box in which both shapes are; none if there is no such box.
fn common_box(a: &PlacedShape<'_>, b: &PlacedShape<'_>) -> Option<(Point, Point)> {
    let [[lo_a, hi_a], [lo_b, hi_b]] = [a, b].map(bounds);
    let (mut centre, mut half) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        let (lo, hi) = (lo_a[k].max(lo_b[k]), hi_a[k].min(hi_b[k]));
        if lo > hi {
            return None;
        }
        (centre[k], half[k]) = (lo + (hi - lo) / 2.0, (hi - lo) / 2.0);
    }
    Some((centre, half))
}

/// Returns a box around a shape.
pub(in crate::query) fn bounds(placed: &PlacedShape<'_>) -> [Point; 2] {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for object in placed.shape.objects() {
        let [low, high] = object.bounding_box();
        let middle = [0, 1, 2].map(|k| low[k] + (high[k] - low[k]) / 2.0);
        let half = [0, 1, 2].map(|k| (high[k] - low[k]) / 2.0);
        let centre = placed.pose.map_or(middle, |pose| pose.place(middle));
        for k in 0..3 {
            let reach = placed.shape.radius()
                + placed
                    .pose
                    .map_or(half[k], |pose| (0..3).map(|j| pose.rotation()[k][j].abs() * half[j]).sum());
            (lo[k], hi[k]) = (lo[k].min(centre[k] - reach), hi[k].max(centre[k] + reach));
        }
    }
    [lo, hi]
}
