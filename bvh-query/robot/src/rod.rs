//! A rod inside a shape and one around it, which decide most contacts of balls, capsules, cylinders and blocks without a walk.
//!
//! A *rod* is all points within a radius of an axis, of a cylinder or of a block. A ball is a rod whose axis is a point, and a capsule
//! one whose axis is a segment: both are their own rods. So is a block. A prism, which stands for a cylinder, contains the cylinder that
//! touches its sides from inside, and the one through its corners contains it. A margin is a radius of both. Rods only decide what is
//! certain. The shapes themselves answer the rest, so that answers have the same bits with and without rods.
//!
//! # Method
//! Let p and q be points of two inner rods, apart from their radii, and w = q - p.
//! - If w is no longer than the sum of the radii, some point is in both rods, and the shapes touch.
//! - If the outer rods are apart along w, the shapes are apart. Along w, a cylinder with the half axis h and the radius c reaches
//!   |h w| + c |v| from its middle, where v is the part of w across h; a block reaches the sum of |h w| for the halves h of its sides;
//!   and a radius r adds r |w| (support functions: G. van den Bergen, "Collision Detection in Interactive 3D Environments", 2003).
//!
//! Both hold for any p and q, which therefore need no error bound. They are the nearest points of both axes at first, and then those
//! that alternating projections give (W. Cheney, A. Goldstein, "Proximity maps for convex sets", Proceedings of the AMS 10, 1959),
//! which come as near as two convex bodies are. Axes alone are certain at once, but for roundings.
//!
//! # Rounding
//! With u = 2^-53, no length here is off by more than 64 u times the sizes that it is computed from: those of the rods in their own
//! frames, of the places of parts in their groups, and of those in the world. `ROUNDING` is 2^11 u. The shapes are asked about in the
//! frame of one of them. Where rotations R are not rigid, lengths there differ by the departure of R^T R from the identity, as a part
//! of the sizes. [`are_within`] charges both, and its caller what is proportional to places in the world. Where squares leave the range of
//! `f64`, nothing is decided.
//!
//! # Cost
//! About 20 ns for balls and capsules, and 30 to 100 ns for others, on a Zen 3 (2026-11-29). None allocates.

use crate::frame::{Frame, Point, departure, each, length};

/// The inner and the outer rod of a shape, which have an axis in common.
#[derive(Clone, Debug)]
pub(crate) struct Rods {
    /// In the frame of the shape.
    own: Axes,
    /// In the frame of the group that carries the shape.
    placed: Axes,
    /// Half of the length of the axis.
    half: f64,
    section: Section,
    /// The radius around both.
    radius: f64,
    /// Whether the inner rod belongs to the shape. The inside of a surface does not.
    pub(crate) is_solid: bool,
    /// How far anything of it is from the origins of its frame and of its group, at most.
    size: f64,
    /// How far the rotation into the group is from a rigid one: see [`departure`].
    departure: f64,
}

/// What is around the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Section {
    /// Nothing: the axis alone.
    Bare,
    /// The radii of the inner and the outer cylinder.
    Disc { inner: f64, outer: f64 },
    /// Half of the sides of a block along the second and the third axis.
    Rectangle([f64; 2]),
}

/// A point, and a unit vector along the axis. For a block, also along its other sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    pub(crate) middle: Point,
    pub(crate) along: Point,
    pub(crate) across: [Point; 2],
}

impl Axes {
    #[inline(always)]
    fn seen_from(&self, frame: &Frame, section: &Section) -> Self {
        let turn = |vector: &Point| each(|k| dot(&frame.rotation[k], vector));
        let across = match section {
            Section::Rectangle(_) => [turn(&self.across[0]), turn(&self.across[1])],
            _ => self.across,
        };
        Self { middle: frame.place(self.middle), along: turn(&self.along), across }
    }
}

/// More than what a length rounds, as a part of the sizes that it is computed from.
pub(crate) const ROUNDING: f64 = 1.0 / (1u64 << 42) as f64;
/// More than the roundings of a length.
pub(crate) const ROUNDED_UP: f64 = 1.0 + ROUNDING;
/// By which part of their least size the inner cylinders and blocks are taken smaller for each of some projections, with balls around
/// them that make up for it. Whole ones separate best. Where bodies overlap a little, projections onto whole ones go on and on, but
/// smaller ones are soon as near as the balls reach.
const SHRUNK: [f64; 5] = [0.0, 1.0 / 2.0, 1.0 / 4.0, 1.0 / 8.0, 1.0 / 16.0];
/// The square of the sine of an angle below which axes count as parallel.
const LEAST_SQUARE: f64 = 1.0 / (1u64 << 50) as f64;
/// The squares of lengths between which products of four lengths are within the range of `f64`.
const SQUARES: std::ops::Range<f64> = 1e-200..1e140;

impl Rods {
    /// Returns rods whose radius is around an axis and what is around that. They are to be placed.
    pub(crate) fn new(own: Axes, half: f64, section: Section, radius: f64, is_solid: bool) -> Self {
        Self { own, placed: own, half, section, radius, is_solid, size: 0.0, departure: 0.0 }
    }

    /// Moves the shape to a place in its group.
    pub(crate) fn place(&mut self, origin: &Frame) {
        self.placed = self.own.seen_from(origin, &self.section);
        let across = match self.section {
            Section::Bare => 0.0,
            Section::Disc { outer, .. } => outer,
            Section::Rectangle(sides) => long(sides),
        };
        let far = length(origin.translation) + length(self.own.middle);
        self.size = far + self.half + across + self.radius;
        self.departure = departure(&origin.rotation);
    }

    #[inline(always)]
    fn in_world(&self, group: &Frame) -> Placed {
        let least = match self.section {
            Section::Bare => 0.0,
            Section::Disc { inner, .. } => self.half.min(inner),
            Section::Rectangle([first, second]) => self.half.min(first).min(second),
        };
        let axes = self.placed.seen_from(group, &self.section);
        Placed { axes, half: self.half, section: self.section, least, shrunk: 0.0 }
    }
}

/// Returns whether two shapes are within a distance, 0 for contact, or `None` if their rods do not tell. The frames are those of the
/// groups that carry them, in the world, and `slack` is more than what their places there are off by.
pub(crate) fn are_within(
    a: &Rods,
    b: &Rods,
    [in_a, in_b]: [&Frame; 2],
    distance: f64,
    slack: f64,
) -> Option<bool> {
    let slack = slack + (ROUNDING + a.departure + b.departure) * (a.size + b.size + distance);
    let radius = a.radius + b.radius + distance;
    let is_solid = a.is_solid && b.is_solid;
    let [mut a, mut b] = [a.in_world(in_a), b.in_world(in_b)];
    let way = each(|k| b.axes.middle[k] - a.axes.middle[k]);
    let is_bare = matches!((a.section, b.section), (Section::Bare, Section::Bare));
    let mut shares = SHRUNK.iter();
    a.shrink(0.0, slack);
    b.shrink(0.0, slack);
    let (mut p, mut q) = nearest_on_axes(&a, &b, &way);
    loop {
        let between = each(|k| q[k] - p[k]);
        let square = dot(&between, &between);
        let most = radius + a.shrunk + b.shrunk - slack;
        if is_solid && most > 0.0 && SQUARES.contains(&(most * most)) && square <= most * most {
            return Some(true);
        }
        if !SQUARES.contains(&square) {
            return None;
        }
        let reach = a.reach(&between) + b.reach(&between);
        if dot(&way, &between) - reach > (radius + slack) * square.sqrt() {
            return Some(false);
        }
        let share = *shares.next().filter(|_| !is_bare)?;
        a.shrink(share, slack);
        b.shrink(share, slack);
        p = a.project(&q);
        q = b.project(&p);
    }
}

/// Rods in the world.
struct Placed {
    axes: Axes,
    half: f64,
    section: Section,
    /// The least of half of the length and the inner radius, or of half of the sides; 0 of an axis alone.
    least: f64,
    /// How much smaller the inner cylinder or block is taken, so that all points this far from it belong to it.
    shrunk: f64,
}

impl Placed {
    /// Takes the inner cylinder or block smaller by a part of its least size, and by more than lengths are off by.
    #[inline(always)]
    fn shrink(&mut self, share: f64, slack: f64) {
        self.shrunk = self.least.min((2.0 * slack).max(share * self.least));
    }

    /// Returns how far the outer cylinder or block reaches from its middle along a vector, times the length of the vector.
    #[inline(always)]
    fn reach(&self, vector: &Point) -> f64 {
        let Axes { along, across, .. } = &self.axes;
        let height = dot(along, vector);
        let reach = self.half * height.abs();
        match self.section {
            Section::Bare => reach,
            // As the root of a difference of squares it would lose half of the digits.
            Section::Disc { outer, .. } => reach + outer * length(each(|k| vector[k] - height * along[k])),
            Section::Rectangle([first, second]) => {
                reach + first * dot(&across[0], vector).abs() + second * dot(&across[1], vector).abs()
            }
        }
    }

    /// Returns the point of the inner cylinder or block that is nearest to a point.
    #[inline(always)]
    fn project(&self, point: &Point) -> Point {
        let Axes { middle, along, across } = &self.axes;
        let way = each(|k| point[k] - middle[k]);
        let within = |height: f64, half: f64| height.max(self.shrunk - half).min(half - self.shrunk);
        let height = dot(&way, along);
        let on_axis = within(height, self.half);
        match self.section {
            Section::Bare => each(|k| middle[k] + on_axis * along[k]),
            Section::Disc { inner, .. } => {
                let across = each(|k| way[k] - height * along[k]);
                let (long, radius) = (length(across), inner - self.shrunk);
                let share = if long > radius { radius / long } else { 1.0 };
                each(|k| middle[k] + on_axis * along[k] + share * across[k])
            }
            Section::Rectangle(sides) => {
                let [x, y] = [0, 1].map(|k| within(dot(&way, &across[k]), sides[k]));
                each(|k| middle[k] + on_axis * along[k] + x * across[0][k] + y * across[1][k])
            }
        }
    }
}

/// Returns points of both axes that are nearest to each other, up to roundings.
#[inline(always)]
fn nearest_on_axes(a: &Placed, b: &Placed, way: &Point) -> (Point, Point) {
    let [half_a, half_b] = [a.half - a.shrunk, b.half - b.shrunk];
    let (u, v) = (&a.axes.along, &b.axes.along);
    let (cosine, on_a, on_b) = (dot(u, v), dot(u, way), dot(v, way));
    // Where the axes are parallel, any point of A's is as good as the others.
    let square = (1.0 - cosine * cosine).max(LEAST_SQUARE);
    let s = ((on_a - cosine * on_b) / square).max(-half_a).min(half_a);
    let t = (s * cosine - on_b).max(-half_b).min(half_b);
    let s = (on_a + t * cosine).max(-half_a).min(half_a);
    (each(|k| a.axes.middle[k] + s * u[k]), each(|k| b.axes.middle[k] + t * v[k]))
}

pub(crate) fn long([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

#[inline(always)]
fn dot(a: &Point, b: &Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asker::Asker;
    use crate::options::Base;
    use crate::robot::Robot;
    use crate::rod_of::rods_of;
    use crate::testing::robot;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape, Pose, Querier};
    use cbvh_testkit::Random;

    fn baked(mesh: &Mesh) -> OwnedShape {
        Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
    }

    /// Moves a mesh, and turns its axes, x to y to z, some times.
    fn moved(mut mesh: Mesh, turns: usize, by: Point) -> Mesh {
        for position in &mut mesh.objects[0].positions {
            *position = each(|k| position[(k + turns) % 3] + by[k]);
        }
        mesh
    }

    /// Returns a ball, capsule, cylinder or block of any proportions, some as surfaces, some with a radius, and not all where their
    /// frames are.
    fn any_shape(random: &mut Random, scale: f64) -> OwnedShape {
        let size = |random: &mut Random| scale * (0.02 + random.unit().powi(2));
        let [a, b, c] = [size(random), size(random), size(random)];
        let by = if random.below(2) == 0 { [0.0; 3] } else { random.point().map(|x| scale * x) };
        let turns = random.below(3);
        let solid = |mesh: Mesh, random: &mut Random| {
            let shape = baked(&moved(mesh, turns, by));
            let shape = if random.below(6) > 0 { shape.solid().unwrap() } else { shape };
            if random.below(4) > 0 { shape } else { shape.rounded(0.2 * c).unwrap() }
        };
        match random.below(4) {
            0 => baked(&shapes::point(by)).rounded(a).unwrap(),
            1 => {
                let way = random.point();
                baked(&shapes::segment(by, each(|k| by[k] + a * way[k]))).rounded(b).unwrap()
            }
            2 => {
                let error = [1e-3, 0.01, 0.1, 0.2][random.below(4)] * a;
                solid(shapes::cylinder(a, b, error).unwrap().mesh, random)
            }
            _ => solid(shapes::block([a, b, c]).unwrap(), random),
        }
    }

    fn any_pose(random: &mut Random, scale: f64) -> Pose {
        let quaternion = match random.below(3) {
            0 => [0.0, 0.0, 0.0, 1.0],
            1 => [0.0, 0.5f64.sqrt(), 0.0, 0.5f64.sqrt()],
            _ => random.quaternion(),
        };
        Pose::from_quaternion(quaternion, random.point().map(|x| scale * x)).unwrap()
    }

    /// What rods decided about pairs: those that touch and those that are apart by rods, and the rest.
    #[derive(Default, Debug)]
    struct Counts {
        touching: usize,
        apart: usize,
        left: [usize; 2],
        /// Pairs that are not within a distance, and those that are, by rods.
        within: [usize; 2],
        limit: f64,
    }

    /// Compares the answers about a configuration with those of the shapes alone.
    fn check(robot: &Robot, asker: &mut Asker, querier: &mut Querier, joints: &[f64], counts: &mut Counts) {
        let setting = &robot.setting;
        asker.place(setting, joints).unwrap();
        let mut expected: Vec<[usize; 2]> = Vec::new();
        for pair in &setting.pairs {
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
            let [in_a, in_b] = [pair.a, pair.b].map(|part| asker.frame(setting, part));
            let pose = in_a.relative(&in_b).pose().unwrap();
            let touches = querier.collide(&a.shape, &b.shape, &pose).unwrap();
            let bodies = [a.body, b.body];
            if touches && expected.last() != Some(&bodies) {
                expected.push(bodies);
            }
            let distance = counts.limit;
            if let Some(found) = asker.rods_are_within(setting, pair, distance) {
                assert_eq!(found, querier.within(&a.shape, &b.shape, &pose, distance).unwrap());
                counts.within[usize::from(found)] += 1;
            }
            match asker.rods_are_within(setting, pair, 0.0) {
                Some(found) => {
                    assert_eq!(found, touches, "{:?} {:?} {pose:?}", a.rods, b.rods);
                    if found { counts.touching += 1 } else { counts.apart += 1 }
                }
                None => counts.left[usize::from(touches)] += 1,
            }
        }
        let found = asker.touching(setting, joints).unwrap();
        let found: Vec<_> = found.into_iter().map(|pair| setting.bodies_of(&setting.pairs[pair])).collect();
        assert_eq!(found, expected);
        assert_eq!(asker.collide(setting, joints).unwrap(), !expected.is_empty());
    }

    /// Moves the floating base so that a pair is this far apart, or nearly so; along the way to the nearest points.
    fn approach(robot: &Robot, asker: &mut Asker, joints: &mut [f64], pair: usize, gap: f64) {
        let setting = &robot.setting;
        asker.place(setting, joints).unwrap();
        let pair = &setting.pairs[pair];
        let found = asker.distance(setting, pair).unwrap();
        if found.distance > 0.0 {
            let world = asker.frame(setting, pair.a);
            let [a, b] = [found.point_a, found.point_b].map(|point| world.place(point));
            for k in 0..3 {
                joints[k] += (b[k] - a[k]) * (1.0 - gap / found.distance);
            }
        }
    }

    #[test]
    fn answers_are_those_of_the_shapes_alone() {
        let random = &mut Random::new(91);
        let (mut querier, mut asker) = (Querier::new().unwrap(), Asker::new().unwrap());
        for (scale, far) in [(1.0, 0.0), (1.0, 1e4), (1e-6, 0.0), (1e9, 0.0)] {
            let mut counts = Counts { limit: 0.3 * scale, ..Counts::default() };
            for _ in 0..12 {
                let text = format!(
                    "<robot name=\"one\"><link name=\"base\"><collision><geometry><sphere radius=\"{}\"/></geometry>\
                     </collision></link></robot>",
                    0.1 * scale
                );
                let mut robot = robot(&text, Base::Floating);
                let place = random.point().map(|x| far * scale * x);
                for number in 0..6 {
                    let (name, pose) = (format!("attached {number}"), any_pose(random, 0.7 * scale));
                    robot.attach(&name, any_shape(random, scale), "base", &pose, &[]).unwrap();
                    let (other, pose) = (format!("obstacle {number}"), any_pose(random, 0.7 * scale));
                    let at = each(|k| pose.translation()[k] + place[k]);
                    let pose = Pose::new(*pose.rotation(), at).unwrap();
                    robot.add_obstacle(&other, any_shape(random, scale), &pose).unwrap();
                    if random.below(3) == 0 {
                        robot.set_margin(&name, 0.1 * scale * random.unit()).unwrap();
                        robot.set_margin(&other, 0.1 * scale * random.unit()).unwrap();
                    }
                    // As if it had been there from the start.
                    robot.set_pose(&other, &Pose::IDENTITY).unwrap();
                    robot.set_pose(&other, &pose).unwrap();
                }
                robot.refresh();
                for _ in 0..12 {
                    let turn = any_pose(random, 1.0);
                    let quaternion =
                        if random.below(2) == 0 { [0.0, 0.0, 0.0, 1.0] } else { random.quaternion() };
                    let mut joints: Vec<f64> =
                        (0..3).map(|k| place[k] + 1.5 * scale * turn.translation()[k]).collect();
                    joints.extend(quaternion);
                    check(&robot, &mut asker, &mut querier, &joints, &mut counts);
                    let pair = random.below(robot.setting.pairs.len());
                    let near = [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-8, -1e-8, 1e-3, -1e-3, -0.02];
                    let gap = scale * near[random.below(near.len())];
                    approach(&robot, &mut asker, &mut joints, pair, gap);
                    check(&robot, &mut asker, &mut querier, &joints, &mut counts);
                }
            }
            // Surfaces that touch are left, and pairs that nearly touch or do not touch.
            let Counts { touching, apart, left: [left_apart, left_touching], within, .. } = counts;
            assert!(within.iter().all(|&count| count > 1000), "{counts:?}");
            assert!(touching > 500 && apart > 2000 && left_apart > 10 && left_touching > 50, "{counts:?}");
            assert!(left_apart < apart / 20, "{counts:?}");
        }
    }

    #[test]
    fn rods_decide_nearly_all_pairs_of_solids() {
        let random = &mut Random::new(92);
        let mut counts = [0; 3];
        while counts.iter().sum::<usize>() < 4000 {
            let [a, b] = [(); 2].map(|()| any_shape(random, 1.0));
            let [rods_a, rods_b] = [&a, &b].map(|of| rods_of(of.shape(), &Frame::IDENTITY).unwrap());
            if !rods_a.is_solid || !rods_b.is_solid {
                continue;
            }
            let there = Frame::from(&any_pose(random, 1.0));
            let found = are_within(&rods_a, &rods_b, [&Frame::IDENTITY, &there], 0.0, 1e-12);
            counts[found.map_or(2, usize::from)] += 1;
        }
        assert!(counts[0] > 500 && counts[1] > 500 && counts[2] < 40, "{counts:?}");
    }

    /// Poses of programs that compute in `f32` are not quite rigid.
    #[test]
    fn rotations_that_are_not_quite_rigid_are_charged() {
        let random = &mut Random::new(93);
        let (mut querier, mut counts) = (Querier::new().unwrap(), [0; 3]);
        let coarse = |pose: Pose| {
            let rotation = pose.rotation().map(|row| row.map(|entry| f64::from(entry as f32)));
            Frame { rotation, translation: pose.translation() }
        };
        for _ in 0..3000 {
            let [a, b] = [(); 2].map(|()| any_shape(random, 1.0));
            let [own_a, mut own_b] = [(); 2].map(|()| coarse(any_pose(random, 3.0)));
            let pose = own_a.relative(&own_b).pose().unwrap();
            let apart = querier.distance(&a, &b, &pose).unwrap();
            let [p, q] = [apart.point_a, apart.point_b].map(|point| own_a.place(point));
            let gap = [0.0, 1e-9, -1e-9, 1e-7, -1e-7, 1e-5][random.below(6)];
            let share = if apart.distance > 0.0 { 1.0 - gap / apart.distance } else { 0.0 };
            own_b.translation = each(|k| own_b.translation[k] - share * (q[k] - p[k]));
            let rods = [(&a, &own_a), (&b, &own_b)].map(|(of, origin)| rods_of(of.shape(), origin).unwrap());
            let found = are_within(&rods[0], &rods[1], [&Frame::IDENTITY; 2], 0.0, 1e-12);
            counts[found.map_or(2, usize::from)] += 1;
            if let Some(found) = found {
                let pose = own_a.relative(&own_b).pose().unwrap();
                assert_eq!(found, querier.collide(&a, &b, &pose).unwrap());
            }
        }
        assert!(counts.iter().all(|&count| count > 150), "{counts:?}");
    }
}
