//! The path of one part in the frame of another one while all joints move, and bounds of it.
//!
//! While all joints follow polynomials of time, each link moves on a path, and so does B in A's frame for each pair: along the chain
//! of joints between both, and whatever moves both alike does not matter. Such a path needs a bound of its sagitta.
//!
//! # Bound
//! Follow the points of a ball of B from B's frame along the chain. In the frame that has been reached, let them have a speed of at
//! most V and an acceleration of at most A on an interval. In the next frame:
//!
//! | step | V | A |
//! |---|---|---|
//! | a fixed frame | V | A |
//! | a turn at a rate of at most w, with an angular acceleration of at most a, no point farther than d from the axis | V + w d | A + 2 w V + (w^2 + a) d |
//! | a slide at a speed of at most v, with an acceleration of at most a | V + v | A + a |
//!
//! A turn takes y(t) = Q(t) z(t). With the angular velocity w and its derivative a, y' = w x y + Q z', and
//! y'' = a x y + w x (w x y) + 2 w x Q z' + Q z''; w x y is no longer than w d. A step and its inverse have the same bounds, with the
//! slide of an inverse planar or floating joint before its turn. In the middle of the interval, the distance of the ball's middle
//! from the axis is known; on all of it, d is at most that, the radius, and V times half of the interval.
//!
//! A function on [t0, t1] with a second derivative of at most A leaves its chord by at most A (t1 - t0)^2 / 8.
//!
//! # Rounding
//! With u = 2^-53, a step rounds a point within R by less than 16 u R: a product with a rotation 8 u, its sine and cosine 4 u, a
//! translation 2 u. The angle of a turn is off by less than 2 u n times the sum S of the magnitudes of the n terms of its polynomial,
//! which moves the point by that times R. A point and both ends of its chord are off: 64 u R (1 + n S) for each step.

use crate::edge::{Bounds, Edge, at};
use crate::error::RobotError;
use crate::frame::{Frame, Point, length};
use crate::model::{Joint, Kind, Model};
use crate::setting::{Pair, Part, Setting};
use bvh_query::{Pose, PoseError, RigidPath};

/// What all pairs need of a motion of the joints, computed once: hundreds of pairs share a dozen joints.
pub(crate) struct JointPaths<'a> {
    model: &'a Model,
    edge: &'a Edge,
    /// How each joint turns and slides.
    bounds: &'a [[Bounds; 2]],
    /// The frame of each joint's child in that of its parent in the middle of the motion.
    middle: Vec<Frame>,
}

impl<'a> JointPaths<'a> {
    /// Takes bounds of how each joint turns and slides.
    pub(crate) fn new(model: &'a Model, edge: &'a Edge, bounds: &'a [[Bounds; 2]]) -> Self {
        let numbers = at(model, edge, MIDDLE);
        Self { model, edge, bounds, middle: model.joints.iter().map(|joint| joint.at(&numbers)).collect() }
    }
}

/// The time in the middle of a motion.
const MIDDLE: f64 = 0.5;

/// The path of B in A's frame, where B is the smaller one of a pair: its points are nearer to the axes that it turns about.
pub(crate) struct PairPath<'a> {
    joints: &'a JointPaths<'a>,
    pub(crate) a: &'a Part,
    pub(crate) b: &'a Part,
    /// The sum of the radii of the balls around both.
    pub(crate) reach: f64,
    /// How the joints turn and slide, in the order of the chain from B to A.
    steps: Vec<Step<'a>>,
}

/// A joint on the way from B to A.
struct Step<'a> {
    joint: &'a Joint,
    /// Whether the way leads from its parent to its child.
    is_inverse: bool,
    turn: &'a Bounds,
    slide: &'a Bounds,
    /// The joint's frame in the middle of the motion.
    middle: &'a Frame,
}

impl<'a> PairPath<'a> {
    pub(crate) fn new(
        setting: &'a Setting,
        pair: &'a Pair,
        joints: &'a JointPaths<'a>,
    ) -> Result<Self, RobotError> {
        let step = |joint: usize, is_inverse: bool| {
            let [turn, slide] = &joints.bounds[joint];
            Step {
                joint: &joints.model.joints[joint],
                is_inverse,
                turn,
                slide,
                middle: &joints.middle[joint],
            }
        };
        let [first, second] = [pair.a, pair.b].map(|part| &setting.parts[part]);
        let (a, b) = if first.radius < second.radius { (second, first) } else { (first, second) };
        let model = joints.model;
        let top = model.common(a.group, b.group);
        let mut steps: Vec<_> = model.between(b.group, top).map(|joint| step(joint, false)).collect();
        let down = steps.len();
        steps.extend(model.between(a.group, top).map(|joint| step(joint, true)));
        steps[down..].reverse();
        let still = |part: &Part| length(part.origin.translation) + length(part.middle) + part.radius;
        let way = |step: &Step<'_>| length(step.joint.origin.translation) + step.slide.way;
        let farthest = still(a) + still(b) + steps.iter().map(way).sum::<f64>();
        // NaN does not stay below anything.
        if farthest < MOST_REACH {
            Ok(Self { joints, a, b, reach: pair.reach(&setting.parts), steps })
        } else {
            Err(PoseError::TooFar(farthest).into())
        }
    }

    /// Returns the frame of B in A's.
    fn frame(&self, t: f64) -> Frame {
        let numbers = at(self.joints.model, self.joints.edge, t);
        let mut frame = self.b.origin;
        for step in &self.steps {
            let joint = step.joint.at(&numbers);
            frame = if step.is_inverse { joint.relative(&frame) } else { joint.of(&frame) };
        }
        self.a.origin.relative(&frame)
    }

    /// Follows the points in a ball of B to A's frame: returns where its middle is in the middle of an interval, and bounds on all
    /// of it.
    pub(crate) fn follow(&self, middle: Point, radius: f64, [t0, t1]: [f64; 2]) -> (Point, Bound) {
        let (a, b) = (self.a, self.b);
        let time = (t0 + t1) / 2.0;
        let numbers = if time == MIDDLE { Vec::new() } else { at(self.joints.model, self.joints.edge, time) };
        let half = (t1 - t0).abs() / 2.0;
        let mut point = b.origin.place(middle);
        let mut reach = length(b.origin.translation) + length(middle) + radius;
        let mut bound = Bound { speed: 0.0, acceleration: 0.0, rounding: ROUNDING * reach };
        for Step { joint, is_inverse, turn, slide, middle } in &self.steps {
            let computed;
            let frame = if time == MIDDLE {
                *middle
            } else {
                computed = joint.at(&numbers);
                &computed
            };
            let inner = if *is_inverse { frame.find(point) } else { point };
            reach += length(joint.origin.translation) + slide.way;
            let rounding = ROUNDING * (reach * (1.0 + turn.terms) + slide.terms);
            if *is_inverse {
                bound.slide(slide);
            }
            let away = joint.kind.distance_to_axis(inner) + radius + bound.speed * half + rounding;
            bound.turn(turn, away * ROUNDED_UP);
            if !is_inverse {
                bound.slide(slide);
            }
            bound.rounding += rounding;
            point = if *is_inverse { inner } else { frame.place(point) };
        }
        bound.rounding += ROUNDING * (reach + length(a.origin.translation));
        (a.origin.find(point), bound)
    }
}

/// 64 u: see above.
const ROUNDING: f64 = 1.0 / (1u64 << 47) as f64;
/// More than the relative error of all arithmetic with bounds.
pub(crate) const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;
/// Paths that reach farther have no poses, as [`Pose::new`] says.
const MOST_REACH: f64 = (1u128 << 118) as f64;

impl RigidPath for PairPath<'_> {
    fn pose(&self, t: f64) -> Pose {
        // The ends are valid, and a pose in between is as rigid as they are.
        self.frame(t).pose().unwrap_or(Pose::IDENTITY)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let (_, bound) = self.follow([0.0; 3], radius, [t0, t1]);
        (bound.acceleration * (t1 - t0).powi(2) / 8.0 + bound.rounding) * ROUNDED_UP
    }
}

/// An interval of a path's time, as a path of its own.
pub(crate) struct Interval<'a> {
    pub(crate) path: &'a PairPath<'a>,
    pub(crate) ends: [f64; 2],
}

impl Interval<'_> {
    /// Returns the time of the path.
    pub(crate) fn time(&self, t: f64) -> f64 {
        if t == 1.0 { self.ends[1] } else { self.ends[0] + t * (self.ends[1] - self.ends[0]) }
    }
}

impl RigidPath for Interval<'_> {
    fn pose(&self, t: f64) -> Pose {
        self.path.pose(self.time(t))
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        self.path.sagitta(radius, self.time(t0), self.time(t1))
    }
}

/// How the points of B move in the frame that has been reached, and how far they are off.
pub(crate) struct Bound {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    pub(crate) rounding: f64,
}

impl Bound {
    /// Turns the frame about an axis that no point is farther from.
    fn turn(&mut self, of: &Bounds, away: f64) {
        self.acceleration += 2.0 * of.rate * self.speed + (of.rate * of.rate + of.acceleration) * away;
        self.speed += of.rate * away;
    }

    fn slide(&mut self, of: &Bounds) {
        self.speed += of.rate;
        self.acceleration += of.acceleration;
    }
}

impl Kind {
    /// Returns how far a point of the child is from the axis that the joint turns about.
    fn distance_to_axis(&self, point: Point) -> f64 {
        let from = |axis: &Point| {
            let along: f64 = (0..3).map(|k| axis[k] * point[k]).sum();
            length([0, 1, 2].map(|k| point[k] - along * axis[k]))
        };
        match self {
            Self::Turn { axis, .. } => from(axis),
            Self::Planar(_) => from(&[0.0, 0.0, 1.0]),
            // Any axis, or none.
            Self::Slide { .. } | Self::Floating(_) => length(point),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::bounds;
    use crate::options::Base;
    use crate::testing::{robot, tree, values};
    use cbvh_testkit::Random;

    /// Returns how far a point of B is at most from its chord in A's frame, as a share of the bound, at one of some scales.
    fn departure(path: &PairPath<'_>, random: &mut Random) -> f64 {
        let long = [1.0, 0.1, 1e-3, 1e-9][random.below(4)];
        let t0 = (1.0 - long) * random.unit();
        let t1 = t0 + long;
        let radius = 0.5 * random.unit();
        let p = random.point();
        let p = p.map(|x| x * radius / length(p));
        let bound = path.sagitta(radius, t0, t1);
        let [from, to] = [t0, t1].map(|t| path.pose(t).place(p));
        let mut largest: f64 = 0.0;
        for step in 1..32 {
            let share = f64::from(step) / 32.0;
            let at = path.pose(t0 + share * (t1 - t0)).place(p);
            let off = length([0, 1, 2].map(|k| at[k] - from[k] - share * (to[k] - from[k])));
            largest = largest.max(off / bound);
        }
        largest
    }

    #[test]
    fn steps_lead_from_b_up_to_the_common_group_and_down_to_a() {
        let random = &mut Random::new(34);
        let mut turns = 0;
        for round in 0..20 {
            let robot = robot(&tree(random, 2 + round), Base::Floating);
            let (setting, numbers) = (&robot.setting, values(random, &robot, 1.0));
            let edge = Edge::straight(&numbers, &numbers).unwrap();
            let bounds = bounds(&setting.model, &edge);
            let joints = JointPaths::new(&setting.model, &edge, &bounds);
            for pair in &setting.pairs {
                let path = PairPath::new(setting, pair, &joints).unwrap();
                let [a, b] = [path.a, path.b].map(|part| setting.model.above(part.group).collect::<Vec<_>>());
                let up = b.iter().filter(|joint| !a.contains(joint)).map(|&joint| (joint, false));
                let down = a.iter().rev().filter(|joint| !b.contains(joint)).map(|&joint| (joint, true));
                let expected: Vec<_> = up.chain(down).collect();
                let joint = |step: &Step<'_>| {
                    setting.model.joints.iter().position(|joint| std::ptr::eq(joint, step.joint)).unwrap()
                };
                let found: Vec<_> = path.steps.iter().map(|step| (joint(step), step.is_inverse)).collect();
                assert_eq!(found, expected);
                turns += usize::from(found.windows(2).any(|two| two[0].1 != two[1].1));
            }
        }
        assert!(turns > 100, "{turns}");
    }

    #[test]
    fn no_point_leaves_its_chord_by_more_than_the_sagitta() {
        let random = &mut Random::new(35);
        let (mut largest, mut pairs): (f64, u32) = (0.0, 0);
        for round in 0..60 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&tree(random, 2 + round % 9), base);
            robot.refresh();
            let far = [0.3, 3.0, 1e5][round % 3];
            let [from, to] = [(); 2].map(|()| values(random, &robot, far));
            let mut edge = Edge::straight(&from, &to).unwrap();
            let is_turning = robot.joints().iter().any(|name| name.ends_with("/qx"));
            if round % 2 == 1 && !is_turning {
                for of in &mut edge.coefficients {
                    of.extend([0.5 * random.signed(), random.signed(), random.signed()]);
                }
            }
            let bounds = bounds(&robot.setting.model, &edge);
            let joints = JointPaths::new(&robot.setting.model, &edge, &bounds);
            for pair in &robot.setting.pairs {
                let path = PairPath::new(&robot.setting, pair, &joints).unwrap();
                for _ in 0..4 {
                    let ratio = departure(&path, random);
                    assert!(ratio <= 1.0, "{ratio} in round {round}");
                    largest = largest.max(ratio);
                    pairs += 1;
                }
            }
        }
        assert!(pairs > 1000 && largest > 0.3, "{pairs} {largest}");
    }

    /// The middle of a ball is where it is found, and no point of the ball moves farther than the bound.
    #[test]
    fn no_point_of_a_ball_moves_farther_than_its_speed_allows() {
        let random = &mut Random::new(36);
        let mut largest: f64 = 0.0;
        for round in 0..40 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&tree(random, 2 + round % 9), base);
            robot.refresh();
            let [from, to] = [(); 2].map(|()| values(random, &robot, [0.3, 3.0][round % 2]));
            let edge = Edge::straight(&from, &to).unwrap();
            let bounds = bounds(&robot.setting.model, &edge);
            let joints = JointPaths::new(&robot.setting.model, &edge, &bounds);
            for pair in &robot.setting.pairs {
                let path = PairPath::new(&robot.setting, pair, &joints).unwrap();
                let long = [1.0, 0.1, 1e-3][random.below(3)];
                let t0 = (1.0 - long) * random.unit();
                let ([middle, off], radius) = ([random.point(), random.point()], random.unit());
                let (found, bound) = path.follow(middle, radius, [t0, t0 + long]);
                let point = [0, 1, 2].map(|k| middle[k] + off[k] * radius / length(off));
                let from_middle = |t: f64, p: Point, of: Point| {
                    let at = path.frame(t).place(p);
                    length([0, 1, 2].map(|k| at[k] - of[k]))
                };
                let t = t0 + long / 2.0;
                assert!(from_middle(t, middle, found) <= bound.rounding);
                let start = path.frame(t).place(point);
                let most = bound.speed * long / 2.0 + bound.rounding;
                for step in 0..=16 {
                    let moved = from_middle(t0 + long * f64::from(step) / 16.0, point, start);
                    assert!(moved <= most, "{moved} {most} in round {round}");
                    largest = largest.max(moved / most);
                }
            }
        }
        assert!(largest > 0.9, "{largest}");
    }
}
