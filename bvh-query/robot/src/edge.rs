//! Motions in joint space, certain at every moment.
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

use crate::asker::{Asker, failed};
use crate::error::RobotError;
use crate::frame::{Frame, Point, length};
use crate::model::{Joint, Kind, Model, Value, quaternion_length};
use crate::questions::bodies;
use crate::robot::{Pair, Part, Robot, Setting};
use bvh_query::{Distance, MotionAnswer, MotionOptions, Pose, PoseError, QueryError, RigidPath};
use rayon::prelude::*;
use std::collections::VecDeque;

/// A motion of all joints: a polynomial of time, from 0 to 1, for each joint value.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The coefficients of each, the constant first.
    coefficients: Vec<Vec<f64>>,
}

impl Edge {
    /// Goes straight from one configuration to another, each joint at its constant rate. A floating joint turns about one axis, the
    /// shorter way.
    ///
    /// # Errors
    /// [`RobotError::Count`] if one has more values than the other.
    pub fn straight(from: &[f64], to: &[f64]) -> Result<Self, RobotError> {
        if from.len() != to.len() {
            return Err(RobotError::Count { expected: from.len(), found: to.len() });
        }
        let coefficients = from.iter().zip(to).map(|(from, to)| vec![*from, to - from]);
        Ok(Self { coefficients: coefficients.collect() })
    }

    /// Follows polynomials of time, from 0 to 1: the coefficients of each joint value, the constant first. Splines and trapezoidal
    /// profiles are some of these, one after the other.
    pub fn polynomials(coefficients: Vec<Vec<f64>>) -> Self {
        Self { coefficients }
    }

    /// Returns bounds of a joint value on the whole way.
    fn bounds(&self, number: usize) -> Bounds {
        let of = &self.coefficients[number];
        let first = derivative(of);
        let terms = of.len() as f64 * of.iter().map(|coefficient| coefficient.abs()).sum::<f64>();
        Bounds { way: most(of), rate: most(&first), acceleration: most(&derivative(&first)), terms }
    }

    /// Returns bounds of a joint that turns or slides by a multiple of a value.
    fn bounds_of(&self, by: &Value) -> Bounds {
        let of = self.bounds(by.number);
        let factor = by.factor.abs();
        Bounds {
            way: factor * of.way + by.offset.abs(),
            rate: factor * of.rate,
            acceleration: factor * of.acceleration,
            terms: factor * of.terms + by.offset.abs(),
        }
    }
}

/// Bounds of the magnitude of a value and of its derivatives.
#[derive(Clone, Copy, Default)]
struct Bounds {
    way: f64,
    rate: f64,
    acceleration: f64,
    /// The sum of the magnitudes of the terms that are added up, times their number: what roundings are proportional to.
    terms: f64,
}

impl Bounds {
    /// Returns bounds of the length of a vector of values.
    fn long<const N: usize>(of: [Self; N]) -> Self {
        let norm = |part: fn(&Self) -> f64| of.iter().map(|of| part(of).powi(2)).sum::<f64>().sqrt();
        Self {
            way: norm(|of| of.way),
            rate: norm(|of| of.rate),
            acceleration: norm(|of| of.acceleration),
            terms: norm(|of| of.terms),
        }
    }
}

/// Returns the coefficients of a derivative.
fn derivative(of: &[f64]) -> Vec<f64> {
    of.iter().enumerate().skip(1).map(|(power, coefficient)| power as f64 * coefficient).collect()
}

/// The most coefficients for which Bernstein's are computed. They take the cube of this number of steps, and their binomials are
/// exact up to here.
const MOST_COEFFICIENTS: usize = 32;

/// Returns a bound of the magnitude of a polynomial on [0, 1]: the largest of its Bernstein coefficients, of which its values are
/// averages, or the sum of its own coefficients if there are many.
fn most(of: &[f64]) -> f64 {
    let sum: f64 = of.iter().map(|coefficient| coefficient.abs()).sum();
    if of.len() > MOST_COEFFICIENTS {
        return sum * ROUNDED_UP;
    }
    let degree = of.len().saturating_sub(1);
    let binomial =
        |n: usize, k: usize| (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64);
    let bernstein = |i: usize| -> f64 {
        (0..=i.min(degree)).map(|k| binomial(i, k) / binomial(degree, k) * of.get(k).unwrap_or(&0.0)).sum()
    };
    // Terms may cancel, and what is left of them is off by a part of their sum.
    (0..=degree).map(|i| bernstein(i).abs()).fold(0.0, f64::max) + sum * (ROUNDED_UP - 1.0)
}

/// Whether a motion in joint space is free.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RobotMotion {
    /// At no time from 0 to 1 is any pair within the clearance.
    Free,
    /// Two bodies are within the clearance at `touching_at`.
    Hit {
        /// Before this time certainly no pair is within the clearance.
        free_until: f64,
        /// A time at which the bodies are within the clearance: the earliest one found.
        touching_at: f64,
        /// The joint values at that time.
        joints: Vec<f64>,
        /// The bodies.
        bodies: [String; 2],
        /// Their distance at that time, with the points in the frames of shapes.
        nearest: Distance,
        /// The nearest points of both at that time, in the world.
        points: [[f64; 3]; 2],
    },
    /// Two bodies come near, but it is undecided whether they come within the clearance: their gap falls below the tolerance
    /// beyond it.
    Near {
        /// Before this time certainly no pair is within the clearance.
        free_until: f64,
        /// The time of the first undecided configuration.
        at: f64,
        /// The joint values at that time.
        joints: Vec<f64>,
        /// The bodies.
        bodies: [String; 2],
        /// Their distance at that time.
        nearest: Distance,
        /// The nearest points of both at that time, in the world.
        points: [[f64; 3]; 2],
    },
}

impl Robot {
    /// Returns whether a straight motion in joint space is certainly free, at every moment. `false` means that two bodies touch at
    /// some moment, or that their gap falls below the tolerance: a millionth of the size of the larger part, unless another one is
    /// given ([`MotionOptions::tolerance`]).
    ///
    /// Cost: that of [`Querier::is_free`](bvh_query::Querier::is_free) for each pair that may come near on the way, until one is
    /// not free. It grows with the number of turns, and turns of more than 16,384 radians are refused.
    ///
    /// # Errors
    /// The errors of [`Robot::collide`].
    pub fn is_free(&mut self, from: &[f64], to: &[f64]) -> Result<bool, RobotError> {
        self.is_edge_free(&Edge::straight(from, to)?, &MotionOptions::default())
    }

    /// Returns whether a motion is certainly free, as [`Robot::is_free`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`].
    pub fn is_edge_free(&mut self, edge: &Edge, options: &MotionOptions) -> Result<bool, RobotError> {
        self.refresh();
        self.asker.is_free(&self.setting, edge, options)
    }

    /// Returns whether each of many motions is certainly free. Uses all threads of the rayon pool in which it is called.
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`], of the first motion that has one.
    pub fn are_free(&mut self, edges: &[Edge], options: &MotionOptions) -> Result<Vec<bool>, RobotError> {
        self.many_edges(edges, |asker, setting, edge| asker.is_free(setting, edge, options))
    }

    /// Asks about many motions.
    fn many_edges<R: Send>(
        &mut self,
        edges: &[Edge],
        ask: impl Fn(&mut Asker, &Setting, &Edge) -> Result<R, RobotError> + Sync,
    ) -> Result<Vec<R>, RobotError> {
        self.refresh();
        let (setting, asker) = (&*self.setting, &self.asker);
        let ask = |asker: &mut Asker, edge: &Edge| ask(asker, setting, edge);
        edges.par_iter().map_init(|| asker.clone(), ask).collect::<Vec<_>>().into_iter().collect()
    }

    /// Returns an error unless a motion is one of this robot: with a polynomial for each joint value, valid ends, and turns at no more
    /// than 16,384 radians per motion. A quaternion's polynomials are straight.
    ///
    /// # Errors
    /// [`RobotError::Count`] and [`RobotError::Value`].
    pub fn check_edge(&self, edge: &Edge) -> Result<(), RobotError> {
        check(&self.setting, edge)
    }

    /// Returns whether a motion is free, and otherwise what touches first, and when.
    ///
    /// Cost: that of [`Robot::is_edge_free`], and of [`Querier::motion`](bvh_query::Querier::motion) for each pair that is not free. Links
    /// that slide along each other, less than the tolerance apart, take long, since each moment is undecided: allow their contact, or
    /// give a larger tolerance.
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`].
    pub fn motion(&mut self, edge: &Edge, options: &MotionOptions) -> Result<RobotMotion, RobotError> {
        self.refresh();
        self.asker.motion(&self.setting, edge, options)
    }

    /// Returns for each of many motions what [`Robot::motion`] does. Uses all threads of the rayon pool in which it is called.
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`], of the first motion that has one.
    pub fn motions(
        &mut self,
        edges: &[Edge],
        options: &MotionOptions,
    ) -> Result<Vec<RobotMotion>, RobotError> {
        self.many_edges(edges, |asker, setting, edge| asker.motion(setting, edge, options))
    }

    /// Returns what touches first on a path of straight motions through many configurations, with the number of the motion; `None`
    /// if the whole path is free.
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`].
    pub fn first_hit<'a>(
        &mut self,
        path: impl IntoIterator<Item = &'a [f64]>,
        options: &MotionOptions,
    ) -> Result<Option<(usize, RobotMotion)>, RobotError> {
        let mut path = path.into_iter();
        let Some(mut from) = path.next() else { return Ok(None) };
        for (number, to) in path.enumerate() {
            let found = self.motion(&Edge::straight(from, to)?, options)?;
            if found != RobotMotion::Free {
                return Ok(Some((number, found)));
            }
            from = to;
        }
        Ok(None)
    }
}

impl Asker {
    fn is_free(
        &mut self,
        setting: &Setting,
        edge: &Edge,
        options: &MotionOptions,
    ) -> Result<bool, RobotError> {
        check(setting, edge)?;
        // Pairs that stay apart would not refuse them.
        options.check()?;
        // Most motions that are not free touch at one of these.
        if options.clearance == 0.0 {
            for t in [1.0, 0.5, 0.25, 0.75] {
                if self.collide(setting, &at(&setting.model, edge, t))? {
                    return Ok(false);
                }
            }
        }
        for pair in &setting.pairs {
            let path = PairPath::new(setting, pair, edge)?;
            let free = self.is_pair_free(&path, options).map_err(|source| failed(setting, pair, source))?;
            if !free {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns whether B stays farther from A than the clearance. An interval is free if what separates both in its middle is more
    /// than B moves on the way there: seen from the balls around both, or else from the shapes. Others are halved, until the bound
    /// of the sagitta decides, which is the better one for short intervals.
    fn is_pair_free(&mut self, path: &PairPath<'_>, options: &MotionOptions) -> Result<bool, QueryError> {
        let (a, b) = (path.a, path.b);
        let size = a.radius.min(b.radius);
        let limit =
            options.clearance + options.tolerance.unwrap_or(DEFAULT_TOLERANCE * a.radius.max(b.radius));
        let mut todo = VecDeque::from([[0.0, 1.0]]);
        let mut halved = 0;
        while let Some([t0, t1]) = todo.pop_front() {
            let (middle, bound) = path.follow(b.middle, b.radius, [t0, t1]);
            let moved = (bound.speed * (t1 - t0) / 2.0 + bound.rounding) * ROUNDED_UP + limit;
            if length([0, 1, 2].map(|k| middle[k] - a.middle[k])) > path.reach + moved {
                continue;
            }
            let at = (t0 + t1) / 2.0;
            let bent = bound.acceleration * (t1 - t0).powi(2) / 8.0;
            if bent > LITTLE_BENT * moved {
                // Where the balls are all that is known, and far apart, a look at the shapes would not help.
                let is_near =
                    moved > size || self.querier.within(&a.shape, &b.shape, &path.pose(at), moved)?;
                if is_near {
                    halved += 1;
                    if halved == MOST_HALVED {
                        return self.querier.is_free(&a.shape, &b.shape, path, options);
                    }
                    todo.extend([[t0, at], [at, t1]]);
                }
            } else if !self.querier.is_free(
                &a.shape,
                &b.shape,
                &Interval { path, ends: [t0, t1] },
                options,
            )? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn motion(
        &mut self,
        setting: &Setting,
        edge: &Edge,
        options: &MotionOptions,
    ) -> Result<RobotMotion, RobotError> {
        check(setting, edge)?;
        // Pairs that stay apart would not refuse them.
        options.check()?;
        let (mut free_until, mut first): (f64, Option<(bool, f64, usize)>) = (1.0, None);
        for (number, pair) in setting.pairs.iter().enumerate() {
            let path = PairPath::new(setting, pair, edge)?;
            let failed = |source| failed(setting, pair, source);
            if self.is_pair_free(&path, options).map_err(failed)? {
                continue;
            }
            let answer = self.querier.motion(&path.a.shape, &path.b.shape, &path, options);
            let (free, found) = match answer.map_err(failed)? {
                MotionAnswer::Free => continue,
                MotionAnswer::Hit { free_until, touching_at, .. } => {
                    (free_until, (true, touching_at, number))
                }
                MotionAnswer::Near { free_until, at, .. } => (free_until, (false, at, number)),
            };
            free_until = free_until.min(free);
            // A hit counts before what is only near, however early that is, because it is certain.
            let order = |of: &(bool, f64, usize)| (!of.0, of.1);
            if first.as_ref().is_none_or(|held| order(&found) < order(held)) {
                first = Some(found);
            }
        }
        let Some((is_hit, time, number)) = first else { return Ok(RobotMotion::Free) };
        let (joints, bodies) = (at(&setting.model, edge, time), bodies(setting, number));
        self.place(setting, &joints)?;
        let nearest = self.distance(setting, &setting.pairs[number])?;
        let world = self.frame(setting, setting.pairs[number].a);
        let points = [nearest.point_a, nearest.point_b].map(|point| world.place(point));
        Ok(if is_hit {
            RobotMotion::Hit { free_until, touching_at: time, joints, bodies, nearest, points }
        } else {
            RobotMotion::Near { free_until, at: time, joints, bodies, nearest, points }
        })
    }
}

/// Returns an error unless the edge is of all joint values, and both ends are valid. Quaternions only turn at a constant rate.
fn check(setting: &Setting, edge: &Edge) -> Result<(), RobotError> {
    let model = &setting.model;
    for t in [0.0, 1.0] {
        let numbers: Vec<f64> = edge.coefficients.iter().map(|of| value(of, t)).collect();
        model.check(&numbers)?;
    }
    for joint in &model.joints {
        let [turn, _] = parts_of(&joint.kind, edge);
        // NaN is not within anything.
        if !(turn.rate <= MAX_TURN) {
            let (joint, expected) = (joint.name.clone(), "a turn at no more than 16,384 radians per motion");
            return Err(RobotError::Value { joint, expected, found: turn.rate });
        }
        if let Kind::Floating(first) = joint.kind
            && let Some(found) = edge.coefficients[first + 3..first + 7].iter().find(|of| of.len() > 2)
        {
            let (joint, expected) =
                (joint.name.clone(), "a quaternion on a straight motion, with 2 coefficients");
            return Err(RobotError::Value { joint, expected, found: found.len() as f64 });
        }
    }
    Ok(())
}

/// The path of B in A's frame, where B is the smaller one of a pair: its points are nearer to the axes that it turns about.
struct PairPath<'a> {
    model: &'a Model,
    edge: &'a Edge,
    a: &'a Part,
    b: &'a Part,
    /// The sum of the radii of the balls around both.
    reach: f64,
    /// How the joints turn and slide, in the order of the chain from B to A.
    steps: Vec<Step<'a>>,
}

/// A joint on the way from B to A.
struct Step<'a> {
    joint: &'a Joint,
    /// Whether the way leads from its parent to its child.
    is_inverse: bool,
    turn: Bounds,
    slide: Bounds,
}

impl<'a> PairPath<'a> {
    fn new(setting: &'a Setting, pair: &'a Pair, edge: &'a Edge) -> Result<Self, RobotError> {
        let model = &*setting.model;
        let step = |joint: usize, is_inverse: bool| {
            let joint = &model.joints[joint];
            let [turn, slide] = parts_of(&joint.kind, edge);
            Step { joint, is_inverse, turn, slide }
        };
        let [first, second] = [pair.a, pair.b].map(|part| &setting.parts[part]);
        let ((a, b), (above_a, above_b)) = if first.radius < second.radius {
            ((second, first), (&pair.chain.b, &pair.chain.a))
        } else {
            ((first, second), (&pair.chain.a, &pair.chain.b))
        };
        let from_b = above_b.iter().map(|&joint| step(joint, false));
        let steps: Vec<_> = from_b.chain(above_a.iter().rev().map(|&joint| step(joint, true))).collect();
        let still = |part: &Part| length(part.origin.translation) + length(part.middle) + part.radius;
        let way = |step: &Step<'_>| length(step.joint.origin.translation) + step.slide.way;
        let farthest = still(a) + still(b) + steps.iter().map(way).sum::<f64>();
        // NaN does not stay below anything.
        if farthest < MOST_REACH {
            Ok(Self { model, edge, a, b, reach: pair.reach, steps })
        } else {
            Err(PoseError::TooFar(farthest).into())
        }
    }

    /// Returns the frame of B in A's.
    fn frame(&self, t: f64) -> Frame {
        let numbers = at(self.model, self.edge, t);
        let mut frame = self.b.origin;
        for step in &self.steps {
            let joint = step.joint.at(&numbers);
            frame = if step.is_inverse { joint.relative(&frame) } else { joint.of(&frame) };
        }
        self.a.origin.relative(&frame)
    }

    /// Follows the points in a ball of B to A's frame: returns where its middle is in the middle of an interval, and bounds on all
    /// of it.
    fn follow(&self, middle: Point, radius: f64, [t0, t1]: [f64; 2]) -> (Point, Bound) {
        let (a, b) = (self.a, self.b);
        let numbers = at(self.model, self.edge, (t0 + t1) / 2.0);
        let half = (t1 - t0).abs() / 2.0;
        let mut point = b.origin.place(middle);
        let mut reach = length(b.origin.translation) + length(middle) + radius;
        let mut bound = Bound { speed: 0.0, acceleration: 0.0, rounding: ROUNDING * reach };
        for Step { joint, is_inverse, turn, slide } in &self.steps {
            let frame = joint.at(&numbers);
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

/// On an interval, paths that bend by no more than this part of their length are left to [`Querier`](bvh_query::Querier).
const LITTLE_BENT: f64 = 0.25;
/// The fastest turn of a joint, in radians per motion. What a motion costs is proportional to it.
const MAX_TURN: f64 = 16384.0;
/// The most intervals that are halved before all of the motion is left to the querier, which keeps fewer
/// intervals in memory.
const MOST_HALVED: u32 = 1 << 12;
/// More than what [`MotionOptions`] takes for a tolerance, as a part of the radius of the larger ball.
const DEFAULT_TOLERANCE: f64 = 4e-6;
/// 64 u: see above.
const ROUNDING: f64 = 1.0 / (1u64 << 47) as f64;
/// More than the relative error of all arithmetic with bounds.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;
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

/// A part of the time of a path, as a path of its own.
struct Interval<'a> {
    path: &'a PairPath<'a>,
    ends: [f64; 2],
}

impl Interval<'_> {
    fn time(&self, t: f64) -> f64 {
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
struct Bound {
    speed: f64,
    acceleration: f64,
    rounding: f64,
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

/// Returns bounds of how a joint turns and of how it slides.
fn parts_of(kind: &Kind, edge: &Edge) -> [Bounds; 2] {
    let still = Bounds::default();
    match kind {
        Kind::Turn { by, .. } => [edge.bounds_of(by), still],
        Kind::Slide { by, .. } => [still, edge.bounds_of(by)],
        &Kind::Planar(first) => {
            [edge.bounds(first + 2), Bounds::long([0, 1].map(|k| edge.bounds(first + k)))]
        }
        &Kind::Floating(first) => {
            let angle = Turning::of(edge, first).angle;
            let turn = Bounds { way: angle, rate: angle, acceleration: 0.0, terms: 4.0 };
            [turn, Bounds::long([0, 1, 2].map(|k| edge.bounds(first + k)))]
        }
    }
}

/// How the quaternion of a floating joint turns: about one axis, at a constant rate, the shorter way.
struct Turning {
    from: [f64; 4],
    to: [f64; 4],
    /// The whole angle of the turn.
    angle: f64,
}

impl Turning {
    fn of(edge: &Edge, first: usize) -> Self {
        let unit = |t: f64| {
            let numbers: Vec<f64> =
                edge.coefficients[first..first + 7].iter().map(|of| value(of, t)).collect();
            let long = quaternion_length(&numbers, 0);
            [3, 4, 5, 6].map(|k| numbers[k] / long)
        };
        let (from, to) = (unit(0.0), unit(1.0));
        let cosine: f64 = from.iter().zip(&to).map(|(a, b)| a * b).sum();
        let to = if cosine < 0.0 { to.map(|x| -x) } else { to };
        // From the chord, which is accurate for small angles as well.
        let chord = |to: &[f64; 4]| from.iter().zip(to).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        Self { from, to, angle: 4.0 * libm::asin((chord(&to) / 2.0).min(1.0)) }
    }

    /// Returns the quaternion at a time.
    fn at(&self, t: f64) -> [f64; 4] {
        let half = self.angle / 2.0;
        if half < 1e-9 {
            // Linear to within 1e-19, and the length is divided out.
            return [0, 1, 2, 3].map(|k| (1.0 - t) * self.from[k] + t * self.to[k]);
        }
        let [a, b] = [(1.0 - t) * half, t * half].map(libm::sin);
        let whole = libm::sin(half);
        [0, 1, 2, 3].map(|k| (a * self.from[k] + b * self.to[k]) / whole)
    }
}

/// Returns the value of a polynomial.
fn value(of: &[f64], t: f64) -> f64 {
    match of {
        // Exactly what was given, at the end as well.
        &[from, way] if t == 1.0 => from + way,
        of => of.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient),
    }
}

/// Returns the joint values at a time, with quaternions that turn at a constant rate.
fn at(model: &Model, edge: &Edge, t: f64) -> Vec<f64> {
    let mut numbers: Vec<f64> = edge.coefficients.iter().map(|of| value(of, t)).collect();
    for joint in &model.joints {
        if let Kind::Floating(first) = joint.kind {
            numbers[first + 3..first + 7].copy_from_slice(&Turning::of(edge, first).at(t));
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Base;
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
            for pair in &robot.setting.pairs {
                let path = PairPath::new(&robot.setting, pair, &edge).unwrap();
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
            for pair in &robot.setting.pairs {
                let path = PairPath::new(&robot.setting, pair, &edge).unwrap();
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

    #[test]
    fn bounds_of_polynomials_hold() {
        let random = &mut Random::new(37);
        for _ in 0..500 {
            let of: Vec<f64> = (0..1 + random.below(6)).map(|_| random.signed()).collect();
            let bound = most(&of) * (1.0 + 1e-12);
            let largest = (0..=100).map(|k| value(&of, f64::from(k) / 100.0).abs()).fold(0.0, f64::max);
            assert!(largest <= bound && bound <= of.iter().map(|x| x.abs()).sum::<f64>() * (1.0 + 1e-9));
        }
    }
}
