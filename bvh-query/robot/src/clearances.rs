//! How far what stands still is away, from any point of the world: certified, kept, and shared by all threads.
//!
//! Space is divided into cells of two sizes. A cell holds a lower bound of how far its middle is from everything; from another point
//! of the cell, everything is at least as far less the way to the middle. A bound is computed when it is first asked for. Cells
//! share a table of fixed size, in which the last one of those with one place stays. What is held never affects an answer, only who
//! is asked: a bound is one whether it was kept or not.

use crate::around::{Around, long};
use crate::frame::{Frame, Point, each, length};
use crate::setting::{OFF_RIGID, Part, Setting};
use bvh_query::{Querier, QueryError, Side};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The clearances of some parts that stand still.
#[derive(Debug)]
pub(crate) struct Clearances {
    still: Vec<Still>,
    /// No part reaches farther from the origin.
    pub(crate) farthest: f64,
    /// The side of a small cell, and its inverse.
    side: f64,
    inverse: f64,
    /// More than the roundings of a bound within one unit of the origin.
    rounding: f64,
    small: Table,
    large: Table,
}

/// A table of cells, in blocks that are there once they are needed.
type Table = OnceLock<Box<[OnceLock<Box<Block>>]>>;
type Block = [AtomicU64; 1 << (3 * BLOCK)];

/// A part that stands still, in simple bounds.
#[derive(Debug)]
struct Still {
    part: usize,
    frame: Frame,
    /// The box around its core: its middle, and half of its sides.
    middle: Point,
    half: Point,
    around: Around,
    /// What the core is rounded with.
    radius: f64,
    /// How much lengths may depend on the frame, as a part of them, where its place is not quite rigid, and the part's size.
    off: f64,
    size: f64,
}

/// Cells of a table along each axis, and of a block, as powers of two. A table has 4096 blocks of 4 KiB, 16 MiB.
const ACROSS: u32 = 7;
const BLOCK: u32 = 3;
/// How many small cells are in a large one along each axis, as a power of two.
const LARGE: u32 = 3;
/// More than the relative rounding of a bound.
const ROUNDING: f64 = 1.0 / (1u64 << 42) as f64;

impl Clearances {
    /// Takes the parts with these numbers, and the side of a cell.
    pub(crate) fn new(setting: &Setting, still: &[usize], side: f64) -> Self {
        let still: Vec<Still> = still.iter().map(|&part| Still::new(part, &setting.parts[part])).collect();
        let far = still
            .iter()
            .map(|of| length(of.frame.translation) + length(of.middle) + length(of.half) + of.radius);
        let farthest = far.fold(0.0, f64::max);
        let rounding = ROUNDING * farthest;
        Self {
            still,
            farthest,
            side,
            inverse: 1.0 / side,
            rounding,
            small: OnceLock::new(),
            large: OnceLock::new(),
        }
    }

    /// Returns whether everything is farther away from a point than a distance. `false` says nothing.
    #[inline]
    pub(crate) fn is_beyond(
        &self,
        setting: &Setting,
        querier: &mut Querier,
        point: &Point,
        distance: f64,
    ) -> bool {
        let scaled = each(|k| point[k] * self.inverse);
        // NaN and infinite points are not within it.
        if !scaled.iter().all(|x| x.abs() < MOST_CELLS) {
            return self.distance_of_bounds(point).0 > distance;
        }
        let distance = distance + self.rounding;
        let large = Cell::at::<LARGE>(&scaled);
        if large.bound(point, self.side, self.bound_of(&large)) > distance {
            return true;
        }
        let small = Cell::at::<0>(&scaled);
        let held = self.bound_of(&small);
        if small.bound(point, self.side, held) > distance {
            return true;
        }
        !held.is_tight() && small.bound(point, self.side, self.shapes(setting, querier, &small)) > distance
    }

    /// Returns what is held of a cell or, if it is nothing, the distance from boxes.
    #[inline]
    fn bound_of(&self, cell: &Cell) -> Held {
        let (place, key) = cell.place();
        let held = self.held(cell, place).load(Ordering::Relaxed);
        if held >> 32 == key { Held(held as u32) } else { self.keep_bounds(cell) }
    }

    #[inline(never)]
    fn keep_bounds(&self, cell: &Cell) -> Held {
        let (bound, is_tight) = self.distance_of_bounds(&cell.middle(self.side));
        self.keep(cell, bound, is_tight)
    }

    /// Returns the distance of the middle of a cell from the shapes, and keeps it, unless the question was stopped. It is no less than that
    /// from boxes, so that what was beyond a distance before still is.
    #[inline(never)]
    fn shapes(&self, setting: &Setting, querier: &mut Querier, cell: &Cell) -> Held {
        let point = cell.middle(self.side);
        let exact =
            self.still.iter().filter(|still| still.around.is_tight).map(|still| still.distance_of(&point));
        let mut least = exact.fold(f64::INFINITY, f64::min);
        for still in self.still.iter().filter(|still| !still.around.is_tight) {
            if still.distance_of(&point) < least {
                match still.distance_of_shape(setting, querier, &point, least) {
                    Some(distance) => least = least.min(distance),
                    None => return Held::below(self.distance_of_bounds(&point).0, false),
                }
            }
        }
        let (of_bounds, _) = self.distance_of_bounds(&point);
        self.keep(cell, (least - self.rounding - ROUNDING * length(point)).max(of_bounds), true)
    }

    fn keep(&self, cell: &Cell, bound: f64, is_tight: bool) -> Held {
        let held = Held::below(bound, is_tight);
        let (place, key) = cell.place();
        self.held(cell, place).store(key << 32 | u64::from(held.0), Ordering::Relaxed);
        held
    }

    /// Returns what is held at the place of a cell.
    #[inline]
    fn held(&self, cell: &Cell, place: [usize; 2]) -> &AtomicU64 {
        let table = if cell.is_large { &self.large } else { &self.small };
        let blocks =
            table.get_or_init(|| (0..1 << (3 * (ACROSS - BLOCK))).map(|_| OnceLock::new()).collect());
        &blocks[place[0]].get_or_init(bytemuck::zeroed_box)[place[1]]
    }

    /// Returns a lower bound of the distance of all bounds from a point, and whether no shape is much farther.
    fn distance_of_bounds(&self, point: &Point) -> (f64, bool) {
        let (mut least, mut is_tight) = (f64::INFINITY, true);
        for still in &self.still {
            let away = still.distance_of(point);
            if away < least {
                (least, is_tight) = (away, still.around.is_tight);
            }
        }
        ((least - self.rounding - ROUNDING * length(*point)).max(0.0), is_tight)
    }

    /// Calls `visit` with the place of each part whose box may be within a distance of a point, and how far away the box is.
    pub(crate) fn near(&self, point: &Point, distance: f64, mut visit: impl FnMut(usize, f64)) {
        let distance = distance + self.rounding + ROUNDING * length(*point);
        for (place, still) in self.still.iter().enumerate() {
            let away = still.distance_of(point);
            // Nothing is beyond NaN.
            if away <= distance || distance.is_nan() {
                visit(place, away);
            }
        }
    }
}

/// Points farther away, in small cells, are not kept.
const MOST_CELLS: f64 = (1u32 << (ACROSS + HIGH - 1)) as f64;
/// Bits of a cell's coordinate that are not its place in the table.
const HIGH: u32 = 9;
/// More than the rounding of a way.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

/// What is held of a cell: the bits of a bound in `f32`, of which the last one does not count as such.
#[derive(Clone, Copy)]
struct Held(u32);

impl Held {
    /// The last bit: the bound is that of shapes, or nearly so, not only that of the boxes around them.
    const TIGHT: u32 = 1;

    /// Rounds a bound down.
    fn below(bound: f64, is_tight: bool) -> Self {
        let rounded = (bound as f32).next_down().max(0.0).to_bits();
        Self(rounded & !Self::TIGHT | u32::from(is_tight))
    }

    #[inline]
    fn bound(self) -> f64 {
        f64::from(f32::from_bits(self.0 & !Self::TIGHT))
    }

    #[inline]
    fn is_tight(self) -> bool {
        self.0 & Self::TIGHT != 0
    }
}

/// A cell, by its coordinates.
struct Cell {
    at: [i32; 3],
    is_large: bool,
}

impl Cell {
    /// Returns the cell that a point is in, given in small cells.
    #[inline]
    fn at<const LEVEL: u32>(scaled: &Point) -> Self {
        let at = each(|k| {
            let x = scaled[k] * (1.0 / (1u32 << LEVEL) as f64);
            // Rounded towards zero, and then down.
            let whole = x as i32;
            whole - i32::from(f64::from(whole) > x)
        });
        Self { at, is_large: LEVEL == LARGE }
    }

    /// Returns its place in the table, a block and one in it, and what tells it from others with this place, and from none.
    #[inline]
    fn place(&self) -> ([usize; 2], u64) {
        let at = each(|k| self.at[k] as u32);
        let bits = |from: u32, count: u32| {
            let of = |k: usize| u64::from(at[k] >> from & ((1 << count) - 1)) << (k as u32 * count);
            of(0) | of(1) | of(2)
        };
        ([bits(BLOCK, ACROSS - BLOCK) as usize, bits(0, BLOCK) as usize], bits(ACROSS, HIGH) << 1 | 1)
    }

    #[inline]
    fn middle(&self, side: f64) -> Point {
        let side = if self.is_large { side * f64::from(1u32 << LARGE) } else { side };
        each(|k| (f64::from(self.at[k]) + 0.5) * side)
    }

    /// Returns a lower bound at a point of the cell, given the one that is held.
    #[inline]
    fn bound(&self, point: &Point, side: f64, held: Held) -> f64 {
        let middle = self.middle(side);
        held.bound() - length(each(|k| point[k] - middle[k])) * ROUNDED_UP
    }
}

impl Still {
    fn new(number: usize, part: &Part) -> Self {
        let radius = part.shape.shape().radius();
        let (middle, half) = (part.middle_of_box, part.half_of_core());
        let off = OFF_RIGID * part.departure;
        let size = length(middle) + length(half) + radius;
        Self { part: number, frame: part.origin, middle, half, around: *part.around(), radius, off, size }
    }

    /// Returns how far a point is from the bounds.
    #[inline]
    fn distance_of(&self, point: &Point) -> f64 {
        let found = self.frame.find(*point);
        let at = each(|k| (found[k] - self.middle[k]).abs());
        let beyond = match self.around.cylinder {
            None => length(each(|k| (at[k] - self.half[k]).max(0.0))),
            Some((axis, radius)) => {
                let away = long(at[(axis + 1) % 3], at[(axis + 2) % 3]);
                long((away - radius).max(0.0), (at[axis] - self.half[axis]).max(0.0))
            }
        };
        (beyond - self.radius - self.off_rigid(&found)).max(0.0)
    }

    /// Returns how far a distance from a point, given in the frame of the part, may be off because its place is not quite rigid.
    #[inline]
    fn off_rigid(&self, at: &Point) -> f64 {
        if self.off == 0.0 {
            0.0
        } else {
            self.off * (length(*at) + self.size + length(self.frame.translation))
        }
    }

    /// Returns a lower bound of how far a point is from the shape, or of what is less than `within`. 0 where there is no answer: the
    /// question about both parts will tell why. `None` if the question was stopped.
    fn distance_of_shape(
        &self,
        setting: &Setting,
        querier: &mut Querier,
        point: &Point,
        within: f64,
    ) -> Option<f64> {
        let shape = &setting.parts[self.part].shape;
        let at = self.frame.find(*point);
        // Deep inside a solid, no surface need be near.
        let may_be_inside = shape.shape().is_solid() && self.distance_of(point) == 0.0;
        if may_be_inside {
            match querier.side(shape, at) {
                Ok(Side::Outside) => {}
                Err(QueryError::Stopped) => return None,
                _ => return Some(0.0),
            }
        }
        match querier.closest_point(shape, at, within) {
            Ok(closest) => Some(closest.map_or(within, |closest| closest.lower) - self.off_rigid(&at)),
            Err(QueryError::Stopped) => None,
            Err(_) => Some(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Base;
    use crate::robot::Robot;
    use crate::testing::{robot, tree};
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape, Pose};
    use cbvh_testkit::Random;

    fn shape(mesh: &Mesh) -> OwnedShape {
        Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
    }

    /// A robot among obstacles of all kinds.
    fn world(random: &mut Random, scale: f64) -> Robot {
        let mut robot = robot(&tree(random, 2), Base::Fixed);
        for number in 0..1 + random.below(8) {
            let sides = [(); 3].map(|()| scale * (0.02 + 0.5 * random.unit()));
            let (positions, triangles) = cbvh_testkit::ball::ball(200);
            let shape = match random.below(7) {
                0 => shape(&shapes::block(sides).unwrap()).solid().unwrap(),
                1 => shape(&shapes::cylinder(sides[0], sides[1], sides[0] * 1e-2).unwrap().mesh)
                    .solid()
                    .unwrap(),
                2 => shape(&shapes::segment([0.0; 3], sides)).rounded(sides[0]).unwrap(),
                3 => shape(&shapes::point(sides)).rounded(sides[1]).unwrap(),
                4 => shape(&shapes::block(sides).unwrap()),
                kind => {
                    let positions = positions.iter().map(|p| [0, 1, 2].map(|k| sides[k] * p[k])).collect();
                    let ball = shape(&Mesh::from_triangles(positions, triangles));
                    if kind == 5 { ball } else { ball.solid().unwrap() }
                }
            };
            let pose = Pose::from_quaternion(random.quaternion(), random.point().map(|x| scale * x)).unwrap();
            robot.add_obstacle(format!("obstacle{number}"), shape, &pose).unwrap();
        }
        robot.refresh();
        robot
    }

    /// Returns a robot whose base is a small ball, among obstacles, and the clearances of these.
    fn among(obstacles: &[(OwnedShape, Point)]) -> (Robot, Clearances) {
        let text = "<robot name=\"one\"><link name=\"base\"><collision><geometry><sphere radius=\"0.01\"/></geometry>\
                    </collision></link></robot>";
        let mut robot = robot(text, Base::Fixed);
        for (number, (shape, at)) in obstacles.iter().enumerate() {
            let pose = Pose::new(*Pose::IDENTITY.rotation(), *at).unwrap();
            robot.add_obstacle(format!("obstacle{number}"), shape.clone(), &pose).unwrap();
        }
        robot.refresh();
        let parts = &robot.setting.parts;
        let still: Vec<usize> = (0..parts.len()).filter(|part| parts[*part].is_still).collect();
        let clearances = Clearances::new(&robot.setting, &still, 0.01);
        (robot, clearances)
    }

    /// A point deep inside a solid is not beyond anything, however near something else is.
    #[test]
    fn what_is_inside_a_solid_is_not_beyond_it() {
        let (positions, triangles) = cbvh_testkit::ball::ball(300);
        let ball = shape(&Mesh::from_triangles(positions, triangles)).solid().unwrap();
        let small = shape(&shapes::block([0.2; 3]).unwrap()).solid().unwrap();
        let (robot, clearances) = among(&[(ball, [0.0; 3]), (small, [0.5, 0.0, 0.0])]);
        let mut querier = Querier::new().unwrap();
        assert!(!clearances.is_beyond(&robot.setting, &mut querier, &[0.01, 0.0, 0.0], 0.1));
    }

    /// What has been asked before does not affect what is said of a point: bounds from shapes are no lower than those from boxes.
    #[test]
    fn what_is_held_does_not_matter() {
        // The surface is as far away as the box around it.
        let wall = [(shape(&shapes::block([1.0; 3]).unwrap()), [0.0; 3])];
        let (robot, fresh) = among(&wall);
        let mut querier = Querier::new().unwrap();
        for place in 0..200 {
            let (_, asked) = among(&wall);
            let cell = Cell { at: [60 + place, 0, 0], is_large: false };
            let middle = cell.middle(fresh.side);
            let distance = (fresh.bound_of(&cell).bound() - fresh.rounding).next_down();
            assert!(!asked.is_beyond(&robot.setting, &mut querier, &middle, 100.0));
            let answers =
                [&fresh, &asked].map(|of| of.is_beyond(&robot.setting, &mut querier, &middle, distance));
            assert_eq!(answers, [true; 2], "{place}");
        }
    }

    #[test]
    fn no_bound_is_rounded_up() {
        let (_, clearances) = among(&[(shape(&shapes::block([1.0; 3]).unwrap()), [0.0; 3])]);
        let cell = Cell { at: [0; 3], is_large: false };
        for bound in [0.0, 1e-50, 1e-45, 1e-39, 1e-9, 0.1, 1.0, 1.0 + 1e-9, 1e30, 1e300] {
            for is_tight in [false, true] {
                clearances.keep(&cell, bound, is_tight);
                let held = clearances.bound_of(&cell);
                assert!(held.bound() <= bound && held.is_tight() == is_tight, "{bound}: {}", held.bound());
                assert!(!(1e-30..=1e38).contains(&bound) || held.bound() > bound * (1.0 - 1e-6), "{bound}");
            }
        }
    }

    #[test]
    fn all_is_near_where_nothing_is_known() {
        let (_, clearances) = among(&[(shape(&shapes::block([1.0; 3]).unwrap()), [0.0; 3])]);
        for (point, distance) in [([9.0; 3], f64::NAN), ([f64::NAN; 3], 0.0), ([9.0; 3], f64::INFINITY)] {
            let mut seen = 0;
            clearances.near(&point, distance, |_, _| seen += 1);
            assert_eq!(seen, 1, "{point:?} {distance}");
        }
    }

    /// What is beyond a distance really is, and what is well beyond is found to be.
    #[test]
    fn clearances_are_lower_bounds() {
        let random = &mut Random::new(52);
        let mut querier = Querier::new().unwrap();
        let (mut beyond, mut found, mut asked) = (0, 0, 0);
        for round in 0..40 {
            let scale = [1.0, 1e-3, 1e3, 1.0][round % 4];
            let robot = world(random, scale);
            let setting = &*robot.setting;
            let still: Vec<usize> =
                (0..setting.parts.len()).filter(|part| setting.parts[*part].is_still).collect();
            let side = 0.03 * scale;
            let clearances = Clearances::new(setting, &still, side);
            for turn in 0..300 {
                let far = [2.0, 2.0, 100.0][turn % 3];
                let point = random.point().map(|x| far * scale * x);
                let mut least = f64::INFINITY;
                for &part in &still {
                    let Part { shape, origin, .. } = &setting.parts[part];
                    let placed = shape.shape().at(&origin.pose().unwrap());
                    let closest = querier.closest_point(placed, point, f64::INFINITY).unwrap().unwrap();
                    let is_inside =
                        shape.shape().is_solid() && querier.side(placed, point).unwrap() == Side::Inside;
                    least = least.min(if is_inside { 0.0 } else { closest.distance });
                }
                for share in [0.5, 0.9, 0.99, 1.0, 1.000_001, 1.2] {
                    let distance = share * least;
                    let is_beyond = clearances.is_beyond(setting, &mut querier, &point, distance);
                    assert!(!is_beyond || least > distance, "round {round}: {point:?} {distance} {least}");
                    beyond += u32::from(is_beyond);
                    // A point may be as far from the middle of its cell as half of the diagonal.
                    if far < 10.0 && distance + 2.0 * side < 0.95 * least {
                        asked += 1;
                        found += u32::from(is_beyond);
                    }
                }
                assert!(!clearances.is_beyond(setting, &mut querier, &[f64::NAN, 0.0, 0.0], 0.0));
            }
        }
        assert!(beyond > 10_000 && f64::from(found) > 0.9 * f64::from(asked), "{beyond} {found} {asked}");
    }
}
