//! Asks a screen what may come near on a motion, and when.

use crate::clearances::Clearances;
use crate::cover::Ball;
use crate::error::RobotError;
use crate::frame::{Point, each, length};
use crate::moments::{Moments, is_too_far};
use crate::screen::{Screen, Screened};
use crate::setting::Setting;
use bvh_query::{MotionOptions, Querier, QueryError};

/// What a thread needs to screen.
#[derive(Default)]
pub(crate) struct Screening {
    pub(crate) moments: Moments,
    /// Where the balls around parts are in the middle, and how far from there they and their middles reach.
    middles: Vec<(Point, f64)>,
    /// Pairs that may come near, and in which steps, a bit each.
    pub(crate) found: Vec<(usize, u64)>,
    /// Pairs that are likely to touch, and a step: by how near their balls are, as a part of the radius.
    likely: Vec<Likely>,
}

#[derive(Clone, Copy)]
struct Likely {
    share: f64,
    pair: usize,
    step: usize,
}

/// More than the relative error of arithmetic with bounds.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;
/// Where the middle of a ball is so near to something, as a part of its radius, they may well touch.
const LIKELY: f64 = 1.6;
/// The same part where they surely do.
const SURE: f64 = 0.8;
/// The most pairs that are tested because of that.
const MOST_LIKELY: usize = 64;
/// Less than what roundings leave of a difference of products.
const ROUNDED_DOWN: f64 = 1.0 - 1.0 / (1u64 << 46) as f64;
/// Far more than what is lost where exact questions count coordinates below 2^-213 as 0, and than what squares lose here.
const FLUSHED: f64 = 1.0 / (1u128 << 100) as f64 / (1u128 << 100) as f64;
/// How often a step's chord is cut where it is all that is left to cut.
const CUTS: usize = 4;

/// A question: a screen, and what it is asked about.
pub(crate) struct Search<'a> {
    screen: &'a Screen,
    fields: &'a [Clearances],
    setting: &'a Setting,
    of: &'a mut Screening,
    test: &'a mut dyn Test,
    steps: usize,
    /// What is added to balls for what must stay clear.
    limit: f64,
}

/// Who answers about shapes.
pub(crate) trait Test {
    fn querier(&mut self) -> &mut Querier;

    /// Returns an error if the question has to stop.
    fn go_on(&self) -> Result<(), QueryError>;

    /// Says whether a pair is a hit in the middle of a step.
    fn is_hit(&mut self, pair: usize, step: usize) -> Result<bool, RobotError>;
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        (screen, fields): (&'a Screen, &'a [Clearances]),
        setting: &'a Setting,
        of: &'a mut Screening,
        test: &'a mut dyn Test,
    ) -> Self {
        of.found.clear();
        let steps = of.moments.steps;
        Self { screen, fields, setting, of, test, steps, limit: 0.0 }
    }

    /// Finds the pairs that may come within the clearance and the tolerance on a motion, and when, unless one of the pairs that are
    /// likely to touch is a hit. Returns whether one is.
    pub(crate) fn motion(&mut self, options: &MotionOptions) -> Result<bool, RobotError> {
        let (screen, fields) = (self.screen, self.fields);
        let MotionOptions { clearance, tolerance, .. } = *options;
        self.of.likely.clear();
        let all = mask(0, self.steps);
        if self.of.moments.is_far || fields.iter().any(|field| is_too_far(field.farthest)) {
            self.of.found.extend((0..self.setting.pairs.len()).map(|pair| (pair, all)));
            return Ok(false);
        }
        // First, in which steps a part may come near something, whatever it is.
        let mut near: Vec<(&Screened, &Clearances, u64)> = Vec::new();
        // What is farther from the base is more likely to touch.
        for of in screen.parts.iter().rev().filter(|of| !of.pairs.is_empty()) {
            let Some(field) = of.field else {
                self.of.found.extend(of.pairs.iter().map(|pair| (*pair, all)));
                continue;
            };
            let field = &fields[field];
            self.test.go_on()?;
            self.limit = self.limit_of(&[of], clearance + tolerance.unwrap_or(of.tolerance));
            let mut steps = 0;
            if self.field(of, field, of.root, [0, self.steps], &mut Near::Some(&mut steps))? {
                return Ok(true);
            }
            if steps != 0 {
                near.push((of, field, steps));
            }
        }
        self.find_middles();
        for &number in &screen.mutual {
            self.test.go_on()?;
            let pair = &self.setting.pairs[number];
            let [a, b] = [pair.a, pair.b].map(|part| &screen.parts[part]);
            let tolerance = tolerance.unwrap_or(a.tolerance.min(b.tolerance));
            self.limit = self.limit_of(&[a, b], clearance + tolerance);
            let [from, to] = [pair.a, pair.b].map(|part| self.of.middles[part]);
            if apart(&from.0, &to.0) > (from.1 + to.1 + self.limit) * ROUNDED_UP {
                continue;
            }
            let mut steps = 0;
            let quarter = (self.steps / 4).max(1);
            for first in (0..self.steps).step_by(quarter) {
                self.mutual(
                    number,
                    [a.group, b.group],
                    [a.root, b.root],
                    [first, first + quarter],
                    &mut steps,
                );
            }
            if steps != 0 {
                self.of.found.push((number, steps));
            }
        }
        let mut likely = std::mem::take(&mut self.of.likely);
        likely.sort_unstable_by(|a, b| {
            a.share.total_cmp(&b.share).then((a.pair, a.step).cmp(&(b.pair, b.step)))
        });
        for Likely { pair, step, .. } in likely.iter().take(MOST_LIKELY) {
            if self.test.is_hit(*pair, *step)? {
                return Ok(true);
            }
        }
        self.of.likely = likely;
        // Now what it comes near.
        for (of, field, steps) in near {
            self.test.go_on()?;
            self.limit = self.limit_of(&[of], clearance + tolerance.unwrap_or(of.tolerance));
            let first = self.of.found.len();
            self.field(of, field, of.root, [0, self.steps], &mut Near::All { steps, first })?;
        }
        Ok(false)
    }

    /// Returns what is added to the balls of parts that move, for a distance that must stay clear. Where the place of a part is not
    /// quite rigid, that distance depends on the frame as well.
    fn limit_of(&self, parts: &[&Screened], distance: f64) -> f64 {
        let rounding: f64 = parts.iter().map(|part| self.of.moments.moves[part.group].rounding).sum();
        let departure: f64 = parts.iter().map(|part| part.departure).sum();
        (distance + rounding) * (ROUNDED_UP + departure) + FLUSHED
    }

    /// Finds where the middles of the balls around all parts are in the middle of the motion, and how far they get from there at most.
    fn find_middles(&mut self) {
        self.of.middles.clear();
        for part in &self.screen.parts {
            // An obstacle has none.
            if part.root == self.screen.balls.len() {
                self.of.middles.push(([0.0; 3], f64::INFINITY));
                continue;
            }
            self.place(part.group, part.root);
            let middle = self.at(part.root, self.steps / 2);
            let way = [0, self.steps].map(|state| apart(&self.at(part.root, state), &middle));
            let off = self.off(part.group, (self.steps as f64 / 2.0).max(1.0));
            let reach = self.screen.balls[part.root].radius + way[0].max(way[1]) * ROUNDED_UP + off;
            self.of.middles.push((middle, reach));
        }
    }

    /// Places a ball at all moments.
    #[inline]
    fn place(&mut self, group: usize, ball: usize) {
        self.of.moments.place(group, ball, self.screen.balls[ball].centre);
    }

    #[inline]
    fn at(&self, ball: usize, moment: usize) -> Point {
        self.of.moments.at(ball, moment)
    }

    /// Returns how far a path is at most from the chord of some steps.
    fn off(&self, group: usize, steps: f64) -> f64 {
        self.of.moments.off(group, steps)
    }

    /// Finds the steps in which a ball may come near what stands still.
    fn field(
        &mut self,
        of: &Screened,
        field: &Clearances,
        ball: usize,
        [from, to]: [usize; 2],
        near: &mut Near<'_>,
    ) -> Result<bool, RobotError> {
        let steps = mask(from, to);
        match near {
            Near::Some(held) if **held & steps == steps => return Ok(false),
            Near::All { steps: of, .. } if *of & steps == 0 => return Ok(false),
            _ => {}
        }
        self.place(of.group, ball);
        let Ball { radius, children, .. } = self.screen.balls[ball];
        let (start, end) = (self.at(ball, from), self.at(ball, to));
        let is_step = to - from == 1;
        let (middle, off) = if is_step {
            (between(&start, &end, 0.5), self.off(of.group, 1.0))
        } else {
            (self.at(ball, from.midpoint(to)), self.off(of.group, (to - from) as f64 / 2.0))
        };
        let extent = apart(&start, &middle).max(apart(&end, &middle)) * ROUNDED_UP + off;
        let need = radius + self.limit;
        if field.is_beyond(self.setting, self.test.querier(), &middle, need + extent) {
            return Ok(false);
        }
        let children = children as usize;
        if children != 0 && (radius > extent || is_step) {
            return Ok(self.field(of, field, children, [from, to], near)?
                || self.field(of, field, children + 1, [from, to], near)?);
        }
        if !is_step && extent > 0.0 {
            let half = from.midpoint(to);
            return Ok(self.field(of, field, ball, [half, to], near)?
                || self.field(of, field, ball, [from, half], near)?);
        }
        let is_clear = extent > 0.25 * radius && {
            let piece = need + extent / CUTS as f64 + off;
            (0..CUTS).all(|cut| {
                let at = between(&start, &end, (cut as f64 + 0.5) / CUTS as f64);
                field.is_beyond(self.setting, self.test.querier(), &at, piece)
            })
        };
        if is_clear {
            return Ok(false);
        }
        let Screening { found, likely, .. } = &mut *self.of;
        match near {
            Near::Some(held) => {
                **held |= steps;
                let mut deepest: Option<(f64, usize)> = None;
                field.near(&middle, LIKELY * radius, |place, away| {
                    let share = away / radius;
                    likely.push(Likely { share, pair: of.pairs[place], step: from });
                    if deepest.is_none_or(|(held, _)| share < held) {
                        deepest = Some((share, of.pairs[place]));
                    }
                });
                match deepest {
                    Some((share, pair)) if share < SURE => self.test.is_hit(pair, from),
                    _ => Ok(false),
                }
            }
            Near::All { first, .. } => {
                field.near(&middle, need + extent, |place, _| {
                    let pair = of.pairs[place];
                    match found[*first..].iter_mut().find(|held| held.0 == pair) {
                        Some(held) => held.1 |= steps,
                        None => found.push((pair, steps)),
                    }
                });
                Ok(false)
            }
        }
    }

    /// Marks the steps in which two balls may come near each other.
    fn mutual(
        &mut self,
        pair: usize,
        groups: [usize; 2],
        balls: [usize; 2],
        [from, to]: [usize; 2],
        near: &mut u64,
    ) {
        let steps = mask(from, to);
        if *near & steps == steps {
            return;
        }
        for side in 0..2 {
            self.place(groups[side], balls[side]);
        }
        let way = |state: usize| {
            let (a, b) = (self.at(balls[0], state), self.at(balls[1], state));
            each(|k| b[k] - a[k])
        };
        let [start, end] = [way(from), way(to)];
        let (a, b) = (self.screen.balls[balls[0]], self.screen.balls[balls[1]]);
        let time = (to - from) as f64;
        let off = self.off(groups[0], time) + self.off(groups[1], time);
        let radii = a.radius + b.radius;
        let need = (radii + self.limit + off) * ROUNDED_UP;
        if is_beyond(&start, &end, need) {
            return;
        }
        let is_step = to - from == 1;
        match larger(&a, &b) {
            Some(side) if is_step || off < 0.5 * radii => {
                let children = [a, b][side].children as usize;
                for child in [children, children + 1] {
                    let mut balls = balls;
                    balls[side] = child;
                    self.mutual(pair, groups, balls, [from, to], near);
                }
            }
            _ if !is_step && (off > 0.0 || start != end) => {
                let middle = from.midpoint(to);
                for ends in [[from, middle], [middle, to]] {
                    self.mutual(pair, groups, balls, ends, near);
                }
            }
            _ => {
                *near |= steps;
                let share = length(between(&start, &end, 0.5)) / radii;
                if share < LIKELY {
                    self.of.likely.push(Likely { share, pair, step: from });
                }
            }
        }
    }
}

/// What is looked for of a part that may come near what stands still.
enum Near<'a> {
    /// The steps in which it comes near something, until a test of what surely touches says that it does.
    Some(&'a mut u64),
    /// What it comes near in these steps. Pairs of the part are found from a place on.
    All { steps: u64, first: usize },
}

/// Returns which of two balls to divide; none if neither has children.
fn larger(a: &Ball, b: &Ball) -> Option<usize> {
    match [a, b].map(|ball| ball.children != 0) {
        [false, false] => None,
        [true, false] => Some(0),
        [false, true] => Some(1),
        [true, true] => Some(usize::from(b.radius > a.radius)),
    }
}

/// Returns a bit for each step.
pub(crate) fn mask(from: usize, to: usize) -> u64 {
    u64::MAX >> (64 - (to - from)) << from
}

fn between(a: &Point, b: &Point, share: f64) -> Point {
    each(|k| a[k] + share * (b[k] - a[k]))
}

fn apart(a: &Point, b: &Point) -> f64 {
    length(each(|k| a[k] - b[k]))
}

/// Returns whether the segment between two points is farther from the origin than a distance.
#[inline]
fn is_beyond(a: &Point, b: &Point, distance: f64) -> bool {
    let way = each(|k| b[k] - a[k]);
    let dot = |p: &Point, q: &Point| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let (squared, along, long) = (distance * distance, -dot(a, &way), dot(&way, &way));
    // The nearest point is the start, the end, or between both.
    let (height, limit) = if along <= 0.0 {
        (dot(a, a), squared)
    } else if along >= long {
        (dot(b, b), squared)
    } else {
        (dot(a, a) * long * ROUNDED_DOWN - along * along, squared * long)
    };
    height > limit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::{Edge, bounds};
    use crate::model::Kind;
    use crate::options::Base;
    use crate::pair_path::{JointPaths, PairPath};
    use crate::robot::Robot;
    use crate::testing::{ball, robot, scaled_tree, slider, tree, values};
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape, Pose, RigidPath};
    use cbvh_testkit::Random;

    /// Nothing is a hit.
    struct Nothing(Querier);

    impl Test for Nothing {
        fn querier(&mut self) -> &mut Querier {
            &mut self.0
        }

        fn go_on(&self) -> Result<(), QueryError> {
            Ok(())
        }

        fn is_hit(&mut self, _: usize, _: usize) -> Result<bool, RobotError> {
            Ok(false)
        }
    }

    /// Screens a motion, and asserts that what is left out is farther apart than the limit, at many moments. Returns the number of
    /// steps of pairs that are left out and of those that are not, and how near to the limit those left out come, as a part of
    /// their sizes.
    fn check(robot: &mut Robot, edge: &Edge, options: &MotionOptions, what: &str) -> (u32, u32, f64) {
        robot.refresh();
        let (mut querier, setting) = (Querier::new().unwrap(), &*robot.setting);
        let (mut left_out, mut kept, mut closest) = (0, 0, f64::INFINITY);
        let bounds = bounds(&setting.model, edge);
        let screen = robot.screens.of(setting, &mut querier).unwrap();
        let mut screening = Screening::default();
        let steps = screening.moments.start(screen.0, setting, edge, &bounds);
        let asked = &mut Nothing(Querier::new().unwrap());
        Search::new(screen, setting, &mut screening, asked).motion(options).unwrap();
        let joints = JointPaths::new(&setting.model, edge, &bounds);
        for (number, pair) in setting.pairs.iter().enumerate() {
            let near = screening.found.iter().find(|found| found.0 == number).map_or(0, |found| found.1);
            let path = PairPath::new(setting, pair, &joints).unwrap();
            let limit = options.clearance + options.tolerance_between(&path.a.shape, &path.b.shape);
            for step in 0..steps {
                if near >> step & 1 == 1 {
                    kept += 1;
                    continue;
                }
                left_out += 1;
                for share in [0.0, 0.3, 0.5, 0.8, 1.0] {
                    let pose = path.pose((step as f64 + share) / steps as f64);
                    let apart = querier.distance(&path.a.shape, &path.b.shape, &pose).unwrap().lower;
                    assert!(apart > limit, "{what}, pair {number}, step {step}: {apart} {limit}");
                    closest = closest.min((apart - limit) / path.reach);
                }
            }
        }
        (left_out, kept, closest)
    }

    /// In the frame of something whose place is not quite rigid, a clearance that is much larger than it has another length as well.
    #[test]
    fn large_clearances_are_kept_from_what_is_not_placed_rigidly() {
        let smaller = Pose::IDENTITY.rotation().map(|row| row.map(|x| x * (1.0 - 2f64.powi(-22))));
        let mut kept = 0;
        for step in 0..40 {
            let mut robot = slider(10.0);
            robot.attach("tool", ball(1e-3), "hand", &Pose::new(smaller, [0.0; 3]).unwrap(), &[]).unwrap();
            let gap = 1.0 + 1e-8 * f64::from(step);
            let at = [10.0 + gap + 1.5e-3, 0.0, 0.0];
            robot
                .add_obstacle("ball", ball(5e-4), &Pose::new(*Pose::IDENTITY.rotation(), at).unwrap())
                .unwrap();
            let options = MotionOptions::new().clearance(1.0);
            let edge = Edge::straight(&[0.0], &[0.0]).unwrap();
            kept += check(&mut robot, &edge, &options, &format!("gap {gap}")).1;
        }
        assert!(kept > 10);
    }

    /// Parts and obstacles of all kinds, in all units, far out and in meshes that are, placed as programs do that compute in `f32`, and on
    /// motions of many kinds.
    #[test]
    fn what_is_left_out_stays_apart_in_all_worlds() {
        let random = &mut Random::new(54);
        let (mut left_out, mut kept) = (0, 0);
        for round in 0..120 {
            let scale = [1.0, 1e-9, 1e9, 1e-3][round % 4];
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&scaled_tree(random, 2 + round % 6, scale), base);
            for number in 0..random.below(5) {
                // In a frame whose origin is far from the mesh.
                let off = random.point().map(|x| [0.0, 0.0, 1e4][number % 3] * scale * x);
                let shape = any_shape(random, scale, off);
                let turned = match random.below(2) {
                    0 => random.quaternion(),
                    _ => random.quaternion().map(|x| f64::from(x as f32)),
                };
                let turned = Pose::from_quaternion(turned, [0.0; 3]).unwrap_or(Pose::IDENTITY);
                let [at, back] = [random.point().map(|x| 0.7 * scale * x), turned.place(off)];
                let pose = Pose::new(*turned.rotation(), [0, 1, 2].map(|k| at[k] - back[k])).unwrap();
                let link = robot.links().nth(random.below(robot.links().count())).unwrap().to_owned();
                match random.below(3) {
                    0 => robot.attach(format!("tool{number}"), shape, &link, &pose, &[]).unwrap(),
                    _ => robot.add_obstacle(format!("obstacle{number}"), shape, &pose).unwrap(),
                }
            }
            if round % 5 == 0 {
                robot.set_margin("link0", 0.05 * scale).unwrap();
            }
            robot.refresh();
            let far = [0.1, 1.0, 3.0][random.below(3)];
            let mut ends = [(); 2].map(|()| values(random, &robot, far));
            let is_long: Vec<bool> = (0..ends[0].len()).map(|number| is_length(&robot, number)).collect();
            let away = [0.0, 0.0, 1e3][random.below(3)];
            for end in &mut ends {
                for (value, _) in end.iter_mut().zip(&is_long).filter(|(_, is_long)| **is_long) {
                    *value = scale * (*value + away);
                }
            }
            let mut edge = Edge::straight(&ends[0], &ends[1]).unwrap();
            let is_turning = robot.joints().iter().any(|name| name.ends_with("/qx"));
            if round % 2 == 1 && !is_turning {
                let degree = [1, 3, 40][random.below(3)];
                for (of, is_long) in edge.coefficients.iter_mut().zip(&is_long) {
                    let unit = if *is_long { scale } else { 1.0 };
                    of.extend((0..degree).map(|_| unit * random.signed() / f64::from(degree)));
                }
            }
            let options = MotionOptions::new()
                .clearance([0.0, 0.0, 0.1][random.below(3)] * scale)
                .tolerance([None, Some(1e-4 * scale)][random.below(2)]);
            let found = check(&mut robot, &edge, &options, &format!("round {round}"));
            (left_out, kept) = (left_out + found.0, kept + found.1);
        }
        assert!(left_out > 10_000 && kept > 1000, "{left_out} {kept}");
    }

    /// Returns whether a joint value is a length.
    fn is_length(robot: &Robot, number: usize) -> bool {
        let model = &robot.setting.model;
        model.joints.iter().any(|joint| match joint.kind {
            Kind::Turn { .. } => false,
            Kind::Slide { by, .. } => by.number == number,
            Kind::Planar(first) => (first..first + 2).contains(&number),
            Kind::Floating(first) => (first..first + 3).contains(&number),
        })
    }

    /// Returns a shape of some kind, somewhere in its frame.
    fn any_shape(random: &mut Random, scale: f64, at: Point) -> OwnedShape {
        let sides = [(); 3].map(|()| scale * (0.02 + 0.4 * random.unit()));
        let (positions, triangles) = cbvh_testkit::ball::ball(200);
        let baked = |mut mesh: Mesh| -> OwnedShape {
            for object in &mut mesh.objects {
                object.positions.iter_mut().for_each(|p| *p = each(|k| p[k] + at[k]));
            }
            Bvh::from_bytes(to_bytes(&mesh, &Options::default()).unwrap().0).unwrap().into()
        };
        let cylinder = || shapes::cylinder(sides[0], sides[1], sides[0] * 1e-2).unwrap().mesh;
        let ball = || {
            Mesh::from_triangles(
                positions.iter().map(|p| each(|k| sides[k] * p[k])).collect(),
                triangles.clone(),
            )
        };
        match random.below(9) {
            0 => baked(shapes::block(sides).unwrap()).solid().unwrap(),
            1 => baked(shapes::block(sides.map(|x| 3.0 * x)).unwrap()),
            2 => baked(cylinder()).solid().unwrap(),
            3 => baked(ball()).solid().unwrap(),
            4 => baked(ball()),
            5 => baked(shapes::segment([0.0; 3], sides)).rounded(0.5 * sides[0]).unwrap(),
            6 => baked(shapes::block(sides).unwrap()).rounded(0.3 * sides[1]).unwrap(),
            7 => {
                let cloud: Vec<_> = (0..30).map(|_| random.point().map(|x| 0.5 * scale * x)).collect();
                baked(shapes::cloud(&cloud)).rounded(0.1 * sides[0]).unwrap()
            }
            _ => baked(Mesh::from_triangles(
                (0..12).map(|_| random.point().map(|x| 0.3 * scale * x)).collect(),
                (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
            )),
        }
    }

    /// What is so small that exact questions count coordinates as 0 touches.
    #[test]
    fn what_counts_as_nothing_is_kept() {
        let mut robot = slider(0.0);
        let pose = |at: Point| Pose::new(*Pose::IDENTITY.rotation(), at).unwrap();
        robot.attach("tool", ball(1e-72), "hand", &pose([0.0; 3]), &[]).unwrap();
        robot.attach("other", ball(1e-72), "base", &pose([0.0; 3]), &[]).unwrap();
        let edge = Edge::straight(&[1e-70], &[2e-70]).unwrap();
        check(&mut robot, &edge, &MotionOptions::new().tolerance(1e-75), "tiny");
    }

    /// What the screen leaves out is farther apart than the limit, at all of many moments.
    #[test]
    fn what_is_left_out_stays_apart() {
        let random = &mut Random::new(53);
        let (mut left_out, mut kept, mut closest) = (0, 0, f64::INFINITY);
        for round in 0..60 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&tree(random, 3 + round % 7), base);
            for number in 0..random.below(5) {
                let sides = [(); 3].map(|()| 0.02 + 0.4 * random.unit());
                let (bytes, _) = to_bytes(&shapes::block(sides).unwrap(), &Options::default()).unwrap();
                let shape = OwnedShape::from(Bvh::from_bytes(bytes).unwrap()).solid().unwrap();
                let pose = Pose::from_quaternion(random.quaternion(), random.point()).unwrap();
                robot.add_obstacle(format!("block{number}"), shape, &pose).unwrap();
            }
            robot.refresh();
            let far = [0.3, 1.0, 3.0][random.below(3)];
            let [mut from, mut to] = [(); 2].map(|()| values(random, &robot, far));
            // Far round, where a joint can be.
            let whole = [0.0, 0.0, 0.0, 1e4, 1e8, 1e17][random.below(6)];
            if base == Base::Fixed {
                from.iter_mut().chain(&mut to).for_each(|value| *value += whole);
            }
            let share = [0.0, 1.0, 0.03, 1.0][round % 4];
            to = from.iter().zip(&to).map(|(from, to)| from + share * (to - from)).collect();
            let mut edge = Edge::straight(&from, &to).unwrap();
            if round % 5 == 1 && base != Base::Floating {
                edge.coefficients
                    .iter_mut()
                    .for_each(|of| of.extend([random.signed(), 0.5 * random.signed()]));
            }
            let mut options = MotionOptions::default();
            options.clearance = [0.0, 0.0, 0.05][random.below(3)];
            let found = check(&mut robot, &edge, &options, &format!("round {round}"));
            (left_out, kept, closest) = (left_out + found.0, kept + found.1, closest.min(found.2));
        }
        assert!(left_out > 20_000 && kept > 200, "{left_out} {kept}");
        assert!(closest < 0.1, "{closest}");
    }
}
