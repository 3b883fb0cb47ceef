//! Balls that together contain a part: one around all of it, two that contain it, and so on.
//!
//! The part is cut by planes, and each piece gets a ball. Of a solid, what is inside counts: an extreme point of a piece of it is either on
//! the surface or, inside, a corner of the cell that the planes have left. So a ball around the surface in the cell and around
//! those corners of the cell that may be inside contains the piece.

use crate::frame::{Point, length};
use bvh_query::{OwnedShape, Querier, QueryError, Side};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A ball, in the frame of its part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    pub(crate) centre: Point,
    pub(crate) radius: f64,
    /// Where the first of its two children is, which contain what it contains; 0 without.
    pub(crate) children: u32,
}

/// Most balls around a part: 32 at the finest level.
const MOST: usize = 63;
/// Balls that are this part of the one around everything are not divided.
const FINEST: f64 = 1.0 / 16.0;
/// More than the error of a corner, which has been cut by at most `MOST` planes, as a part of the coordinates' size.
const ROUNDING: f64 = 1.0 / (1u64 << 44) as f64;

/// Returns the balls around a part, the one around all of it first.
///
/// Cost: reading the shape once, and some cuts of each triangle, all of which are in memory meanwhile.
pub(crate) fn cover(shape: &OwnedShape, querier: &mut Querier) -> Result<Vec<Ball>, QueryError> {
    let mut surface: Vec<Polygon> = Vec::new();
    shape.shape().visit_triangles(|_, corners| {
        // Duplicates follow each other. A damaged file may state any number of them.
        if surface.last().is_none_or(|last| *last != corners) {
            surface.push(corners.to_vec());
        }
    })?;
    let points = || surface.iter().flatten();
    let mut cell = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for point in points() {
        for k in 0..3 {
            cell = [least(cell[0], k, point[k]), most(cell[1], k, point[k])];
        }
    }
    let scale = cell.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let rounding = ROUNDING * (scale + shape.shape().radius());
    let mut pieces = vec![Piece { cell, surface }];
    let mut balls = vec![pieces[0].ball(shape, querier, rounding)?];
    // The largest ball is divided next.
    let mut heap = BinaryHeap::from([(OrderedRadius(balls[0].radius), 0)]);
    let finest = balls[0].radius * FINEST;
    while let Some((_, next)) = heap.pop().filter(|(radius, _)| radius.0 > finest && balls.len() + 2 <= MOST)
    {
        balls[next].children = balls.len() as u32;
        for half in std::mem::take(&mut pieces[next]).halves() {
            let ball = half.ball(shape, querier, rounding)?;
            heap.push((OrderedRadius(ball.radius), balls.len()));
            balls.push(ball);
            pieces.push(half);
        }
    }
    Ok(balls)
}

/// A radius that can be compared.
#[derive(PartialEq)]
struct OrderedRadius(f64);

impl Eq for OrderedRadius {}

impl Ord for OrderedRadius {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for OrderedRadius {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

type Polygon = Vec<Point>;

/// What of a part is in a cell of space.
#[derive(Default)]
struct Piece {
    /// The corners with the lowest and the highest coordinates.
    cell: [Point; 2],
    /// Convex polygons.
    surface: Vec<Polygon>,
}

impl Piece {
    fn ball(&self, shape: &OwnedShape, querier: &mut Querier, rounding: f64) -> Result<Ball, QueryError> {
        let mut points: Vec<Point> = self.surface.iter().flatten().copied().collect();
        if shape.shape().is_solid() {
            let core = shape.clone().rounded(0.0)?;
            for corner in 0..8 {
                let corner = [0, 1, 2].map(|k| self.cell[corner >> k & 1][k]);
                if querier.side(&core, corner)? != Side::Outside {
                    points.push(corner);
                }
            }
        }
        let (centre, radius) = ball_around(&points);
        Ok(Ball { centre, radius: (radius + shape.shape().radius()) * ROUNDED_UP + rounding, children: 0 })
    }

    /// Cuts the piece across its longest side, in the middle.
    fn halves(self) -> [Self; 2] {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in self.surface.iter().flatten() {
            for k in 0..3 {
                (lo, hi) = (least(lo, k, point[k]), most(hi, k, point[k]));
            }
        }
        // Without a surface, what is left is full.
        if self.surface.is_empty() {
            [lo, hi] = self.cell;
        }
        let side = |k: usize| hi[k] - lo[k];
        let axis = [1, 2].into_iter().fold(0, |longest, k| if side(k) > side(longest) { k } else { longest });
        let at = lo[axis] + side(axis) / 2.0;
        let mut halves =
            [Self { cell: self.cell, surface: vec![] }, Self { cell: self.cell, surface: vec![] }];
        halves[0].cell[1][axis] = at;
        halves[1].cell[0][axis] = at;
        for polygon in self.surface {
            let is_below = polygon.iter().all(|point| point[axis] <= at);
            let is_above = polygon.iter().all(|point| point[axis] >= at);
            match (is_below, is_above) {
                (true, _) => halves[0].surface.push(polygon),
                (_, true) => halves[1].surface.push(polygon),
                _ => {
                    for (half, sign) in halves.iter_mut().zip([1.0, -1.0]) {
                        half.surface.push(cut(&polygon, |point| sign * (point[axis] - at)));
                    }
                }
            }
        }
        halves
    }
}

/// Returns what of a convex polygon has no positive height.
fn cut(polygon: &[Point], height: impl Fn(&Point) -> f64) -> Polygon {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (place, from) in polygon.iter().enumerate() {
        let to = &polygon[(place + 1) % polygon.len()];
        let [start, end] = [height(from), height(to)];
        if start <= 0.0 {
            left.push(*from);
        }
        if (start < 0.0 && end > 0.0) || (start > 0.0 && end < 0.0) {
            let share = start / (start - end);
            left.push([0, 1, 2].map(|k| from[k] + share * (to[k] - from[k])));
        }
    }
    left
}

/// Returns a ball around points that is not much larger than the least one: its middle moves to the farthest point by ever smaller
/// steps (Badoiu and Clarkson, 2003).
fn ball_around(points: &[Point]) -> (Point, f64) {
    let apart = |a: &Point, b: &Point| length([0, 1, 2].map(|k| a[k] - b[k]));
    let farthest = |from: &Point, of: &[Point]| {
        of.iter()
            .map(|point| (apart(from, point), *point))
            .fold((0.0, *from), |most, one| if one.0 > most.0 { one } else { most })
    };
    // Nothing is in the cell, and nothing is near it.
    let Some(first) = points.first() else { return ([0.0; 3], f64::NEG_INFINITY) };
    // The extreme points along some directions stand for all.
    let mut extreme = Vec::new();
    for direction in 0..13 {
        let way = [direction % 3, direction / 3 % 3, direction / 9].map(|k| k as f64 - 1.0);
        let along = |point: &Point| -> f64 { (0..3).map(|k| way[k] * point[k]).sum() };
        let by = |a: &&Point, b: &&Point| along(a).total_cmp(&along(b));
        extreme.extend(points.iter().min_by(by).into_iter().chain(points.iter().max_by(by)));
    }
    let mut centre = *first;
    for step in 1..=STEPS {
        let (_, to) = farthest(&centre, &extreme);
        centre = [0, 1, 2].map(|k| centre[k] + (to[k] - centre[k]) / f64::from(step + 1));
    }
    (centre, farthest(&centre, points).0)
}

/// How often the middle of a ball moves.
const STEPS: u32 = 100;
/// More than the roundings of a radius.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

fn least(mut of: Point, k: usize, value: f64) -> Point {
    of[k] = of[k].min(value);
    of
}

fn most(mut of: Point, k: usize, value: f64) -> Point {
    of[k] = of[k].max(value);
    of
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::Bvh;
    use cbvh_testkit::Random;

    fn shape(mesh: &Mesh) -> OwnedShape {
        Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
    }

    /// Returns whether each ball on some way from a ball to one without children contains a point.
    fn contains(balls: &[Ball], ball: usize, point: &Point, radius: f64) -> bool {
        let Ball { centre, radius: of, children } = balls[ball];
        let children = children as usize;
        length([0, 1, 2].map(|k| point[k] - centre[k])) + radius <= of * (1.0 + 1e-12)
            && (children == 0 || (children..children + 2).any(|child| contains(balls, child, point, radius)))
    }

    #[test]
    fn balls_contain_all_of_a_part() {
        let random = &mut Random::new(51);
        let querier = &mut Querier::new().unwrap();
        let (mut inside, mut on) = (0, 0);
        for round in 0..60 {
            let scale = [1.0, 1e-6, 1e6][round / 5 % 3];
            let sides = [(); 3].map(|()| scale * (0.01 + random.unit()));
            let ball = cbvh_testkit::ball::ball(300);
            let mut shape = match round % 5 {
                0 => shape(&shapes::block(sides).unwrap()).solid().unwrap(),
                1 => shape(&shapes::cylinder(sides[0], sides[1], sides[0] * 1e-2).unwrap().mesh)
                    .solid()
                    .unwrap(),
                2 => shape(&shapes::segment([0.0; 3], sides)).rounded(0.1 * scale).unwrap(),
                3 => shape(&shapes::point(sides)).rounded(sides[0]).unwrap(),
                _ => {
                    let positions = ball.0.iter().map(|p| [0, 1, 2].map(|k| sides[k] * p[k])).collect();
                    shape(&Mesh::from_triangles(positions, ball.1))
                }
            };
            if round % 7 == 0 {
                shape = shape.clone().rounded(shape.shape().radius() + 0.05 * scale).unwrap();
            }
            let balls = cover(&shape, querier).unwrap();
            assert!(balls.len() <= MOST);
            let mut corners = Vec::new();
            shape.shape().visit_triangles(|_, triangle| corners.push(triangle)).unwrap();
            let radius = shape.shape().radius();
            for _ in 0..300 {
                let [a, b, c] = corners[random.below(corners.len())];
                let (u, v) = (random.unit(), random.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                assert!(contains(&balls, 0, &point, radius), "round {round}: {point:?}");
                on += 1;
            }
            if shape.shape().is_solid() {
                for _ in 0..300 {
                    let point = [0, 1, 2].map(|k| balls[0].centre[k] + balls[0].radius * random.signed());
                    if querier.side(&shape, point).unwrap() == Side::Inside {
                        assert!(contains(&balls, 0, &point, 0.0), "round {round}: {point:?}");
                        inside += 1;
                    }
                }
            }
        }
        assert!(inside > 500 && on > 10_000, "{inside} {on}");
    }
}
