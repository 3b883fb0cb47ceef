//! Questions about motions in joint space, certain at every moment.

use crate::asker::{Asker, failed};
use crate::edge::{Bounds, Edge, at, bounds, value};
use crate::error::RobotError;
use crate::frame::length;
use crate::model::Kind;
use crate::pair_path::{Interval, JointPaths, PairPath, ROUNDED_UP};
use crate::questions::bodies;
use crate::robot::Robot;
use crate::screen::Screens;
use crate::screening::{Screening, Search, Test, mask};
use crate::setting::Setting;
use bvh_query::{Distance, MotionAnswer, MotionOptions, Querier, QueryError, RigidPath};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Whether a motion in joint space is free.
///
/// [`Robot::motion`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// some moment, or that their gap falls below the tolerance: a millionth of the size of the smaller part, unless another one is
    /// given ([`MotionOptions::tolerance_between`]).
    ///
    /// Each joint moves straight in its value: a continuous joint from 3.0 to -3.0 turns by 6 radians, the long way round. For the
    /// short way, take the goal that [`Robot::nearest_turns`] returns. A body that is inside a mesh all the way without touching
    /// it is free: see [`Robot::pairs_inside`].
    ///
    /// Cost: balls around the links, at some moments, against each other and against what stands still, until that of
    /// [`Querier::is_free`](bvh_query::Querier::is_free) for each pair and interval that they leave. It grows with the number of turns,
    /// and turns of more than 16,384 radians are refused.
    ///
    /// How far obstacles are away is kept, for all clones and threads, until one of them moves, comes or goes: in cells of space, which are
    /// filled where motions pass. That takes some MiB, at most 129 MiB for each world that a robot or a clone still is in. The first
    /// motion after a change takes longer. The first one with a shape also reads it: for the balls of a link or an attached object,
    /// whose triangles are in memory meanwhile, or for bounds of an obstacle. Nothing of it affects an answer.
    ///
    /// ```
    /// use bvh_query::Pose;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// # let ball = bvh_bake::to_bytes(&bvh_bake::shapes::point([0.0; 3]), &bvh_bake::Options::default().radius(0.1))?.0;
    /// # let ball = bvh_query::Bvh::from_bytes(ball)?;
    /// let (start, goal) = ([0.0; 4], [0.0, 1.0, 0.0, 0.0]);
    /// assert!(robot.is_free(&start, &goal)?);
    /// robot.add_obstacle("ball", ball, &Pose::new(*Pose::IDENTITY.rotation(), [0.5, 0.0, 0.7])?)?;
    /// assert!(!robot.is_free(&start, &goal)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`].
    pub fn is_free(&mut self, from: &[f64], to: &[f64]) -> Result<bool, RobotError> {
        self.is_edge_free(&Edge::straight(from, to)?, &MotionOptions::default())
    }

    /// Returns whether a motion is certainly free, as [`Robot::is_free`] does.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    /// use cbvh_robot::Edge;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let smooth = Edge::polynomials(vec![vec![0.0], vec![0.0, 0.0, 1.2, -0.8], vec![0.0], vec![0.0]]);
    /// assert!(robot.is_edge_free(&smooth, &MotionOptions::new())?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`].
    pub fn is_edge_free(&mut self, edge: &Edge, options: &MotionOptions) -> Result<bool, RobotError> {
        self.refresh();
        self.asker.is_free((&self.setting, &self.screens), edge, options)
    }

    /// Returns whether each of many motions is certainly free. Uses all threads of the rayon pool in which it is called.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    /// use cbvh_robot::Edge;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let bend = |angle: f64| Edge::straight(&[0.0; 4], &[0.0, angle, angle, 0.0]);
    /// assert_eq!(robot.are_free(&[bend(0.5)?, bend(2.8)?], &MotionOptions::new())?, [true, false]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`], of the first motion that has one, with [`RobotError::Row`] around those of its numbers.
    pub fn are_free(&mut self, edges: &[Edge], options: &MotionOptions) -> Result<Vec<bool>, RobotError> {
        self.many_edges(edges, |asker, known, edge| asker.is_free(known, edge, options))
    }

    /// Asks about many motions.
    fn many_edges<R: Send>(
        &mut self,
        edges: &[Edge],
        ask: impl Fn(&mut Asker, (&Setting, &Screens), &Edge) -> Result<R, RobotError> + Sync,
    ) -> Result<Vec<R>, RobotError> {
        self.refresh();
        let known = (&*self.setting, &*self.screens);
        let ask = |asker: &mut Asker, edge: &Edge| ask(asker, known, edge);
        let named = |(row, answer): (usize, Result<R, RobotError>)| answer.map_err(|error| error.in_row(row));
        if rayon::current_num_threads() == 1 {
            let asker = &mut self.asker;
            return edges.iter().map(|edge| ask(asker, edge)).enumerate().map(named).collect();
        }
        let asker = &self.asker;
        let answers: Vec<_> = edges.par_iter().map_init(|| asker.clone(), ask).collect();
        answers.into_iter().enumerate().map(named).collect()
    }

    /// Returns an error unless a motion is one of this robot: with a polynomial for each joint value, valid ends, and turns at no more
    /// than 16,384 radians per motion. A quaternion's polynomials are straight.
    ///
    /// # Errors
    /// [`RobotError::Count`] and [`RobotError::Value`].
    pub fn check_edge(&self, edge: &Edge) -> Result<(), RobotError> {
        check(&self.setting, edge).map(drop)
    }

    /// Returns whether a motion is free, and otherwise what touches first, and when. What [`Robot::is_free`] says of the way
    /// round and of bodies inside others holds here as well.
    ///
    /// Cost: that of [`Robot::is_edge_free`], and of [`Querier::motion`](bvh_query::Querier::motion) for each pair that is not free, up
    /// to the first hit that is known. Links that turn against each other until then, much less than the tolerance apart, take long:
    /// allow their contact, or give a larger tolerance.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    /// use cbvh_robot::{Edge, RobotMotion};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let bend = Edge::straight(&[0.0; 4], &[0.0, 2.8, 2.8, 0.0])?;
    /// let found = robot.motion(&bend, &MotionOptions::new())?;
    /// let RobotMotion::Hit { free_until, touching_at, joints, bodies, .. } = found else { panic!("{found:?}") };
    /// assert!(free_until < touching_at && touching_at < 1.0);
    /// assert!(robot.collide(&joints)?);
    /// println!("{} touches {} at {touching_at}", bodies[0], bodies[1]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`].
    pub fn motion(&mut self, edge: &Edge, options: &MotionOptions) -> Result<RobotMotion, RobotError> {
        self.refresh();
        self.asker.motion((&self.setting, &self.screens), edge, options)
    }

    /// Returns for each of many motions what [`Robot::motion`] does. Uses all threads of the rayon pool in which it is called.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    /// use cbvh_robot::{Edge, RobotMotion};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let bend = |angle: f64| Edge::straight(&[0.0; 4], &[0.0, angle, angle, 0.0]);
    /// let found = robot.motions(&[bend(0.5)?, bend(2.8)?], &MotionOptions::new())?;
    /// assert!(matches!(found[..], [RobotMotion::Free, RobotMotion::Hit { .. }]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::is_free`], of the first motion that has one, with [`RobotError::Row`] around those of its numbers.
    pub fn motions(
        &mut self,
        edges: &[Edge],
        options: &MotionOptions,
    ) -> Result<Vec<RobotMotion>, RobotError> {
        self.many_edges(edges, |asker, known, edge| asker.motion(known, edge, options))
    }

    /// Returns what touches first on a path of straight motions through many configurations, with the number of the motion; `None`
    /// if the whole path is free.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let path = [[0.0; 4], [1.0, 0.0, 0.0, 0.0], [1.0, 2.8, 2.8, 0.0]];
    /// let found = robot.first_hit(path.iter().map(|joints| &joints[..]), &MotionOptions::new())?;
    /// assert!(matches!(found, Some((1, _)))); // on the second motion
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
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

/// On an interval, paths that bend by no more than this part of their length are left to [`Querier`](bvh_query::Querier).
const LITTLE_BENT: f64 = 0.25;
/// The fastest turn of a joint, in radians per motion. What a motion costs is proportional to it.
const MAX_TURN: f64 = 16384.0;
/// The number of intervals at whose ends a first hit is looked for, to end the search for earlier ones there.
const SAMPLES: u32 = 8;
/// The most intervals that are halved before all of the motion is left to the querier, which keeps fewer intervals in memory.
const MOST_HALVED: u32 = 1 << 12;

impl Asker {
    fn is_free(
        &mut self,
        (setting, screens): (&Setting, &Screens),
        edge: &Edge,
        options: &MotionOptions,
    ) -> Result<bool, RobotError> {
        self.go_on()?;
        let bounds = check(setting, edge)?;
        // Pairs that stay apart would not refuse them.
        options.check()?;
        self.with_screening(|asker, screening| {
            let screen = screens.of(setting, &mut asker.querier)?;
            let steps = screening.moments.start(screen.0, setting, edge, &bounds);
            let is_tested = options.clearance == 0.0;
            let test = &mut Touches { asker, setting, edge, bounds: &bounds, steps, is_tested, placed: None };
            if Search::new(screen, setting, screening, test).motion(options)? {
                return Ok(false);
            }
            if screening.found.is_empty() {
                return Ok(true);
            }
            let joints = JointPaths::new(&setting.model, edge, &bounds);
            for &(number, near) in &screening.found {
                let pair = &setting.pairs[number];
                let path = PairPath::new(setting, pair, &joints)?;
                let free = asker.is_pair_free(&path, 1.0, Steps { count: steps, near }, options);
                if !free.map_err(|source| failed(setting, pair, source))? {
                    return Ok(false);
                }
            }
            Ok(true)
        })
    }

    /// Asks something with the memory for screening.
    fn with_screening<T>(
        &mut self,
        ask: impl FnOnce(&mut Self, &mut Screening) -> Result<T, RobotError>,
    ) -> Result<T, RobotError> {
        let mut screening = std::mem::take(&mut self.screening);
        let answer = ask(self, &mut screening);
        self.screening = screening;
        answer
    }

    /// Returns whether B stays farther from A than the clearance, until a time, given the steps in which it may come near. An interval
    /// is free if what separates both in its middle is more than B moves on the way there: seen from the balls around both, or else
    /// from the shapes. Others are halved, until the bound of the sagitta decides, which is the better one for short intervals.
    fn is_pair_free(
        &mut self,
        path: &PairPath<'_>,
        until: f64,
        steps: Steps,
        options: &MotionOptions,
    ) -> Result<bool, QueryError> {
        let (a, b) = (path.a, path.b);
        let size = a.radius.min(b.radius);
        let limit = options.clearance + options.tolerance_between(&a.shape, &b.shape);
        let mut todo = VecDeque::from([[0.0, until]]);
        let mut halved = 0;
        while let Some([t0, t1]) = todo.pop_front() {
            match steps.of([t0, t1]) {
                Some(false) => continue,
                None if (t1 - t0) * steps.count as f64 > 1.0 => {
                    let at = (t0 + t1) / 2.0;
                    todo.extend([[t0, at], [at, t1]]);
                    continue;
                }
                _ => {}
            }
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
                        let whole = Interval { path, ends: [0.0, until] };
                        return self.querier.is_free(&a.shape, &b.shape, &whole, options);
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

    /// Returns a time at which one of some pairs is within the clearance, and the pair: the earliest of some times.
    fn sampled_hit(
        &mut self,
        setting: &Setting,
        joints: &JointPaths<'_>,
        (found, steps): (&[(usize, u64)], usize),
        options: &MotionOptions,
    ) -> Result<Option<(f64, usize)>, RobotError> {
        let path = |&(number, near): &(usize, u64)| {
            let path = PairPath::new(setting, &setting.pairs[number], joints)?;
            Ok((path, Steps { count: steps, near }, number))
        };
        let paths = found.iter().map(path).collect::<Result<Vec<_>, RobotError>>()?;
        for sample in 0..=SAMPLES {
            let time = f64::from(sample) / f64::from(SAMPLES);
            let may_be_near = |steps: &Steps| steps.of([time, time]) != Some(false);
            for (path, _, number) in paths.iter().filter(|(_, steps, _)| may_be_near(steps)) {
                let near =
                    self.querier.within(&path.a.shape, &path.b.shape, &path.pose(time), options.clearance);
                if near.map_err(|source| failed(setting, &setting.pairs[*number], source))? {
                    return Ok(Some((time, *number)));
                }
            }
        }
        Ok(None)
    }

    fn motion(
        &mut self,
        (setting, screens): (&Setting, &Screens),
        edge: &Edge,
        options: &MotionOptions,
    ) -> Result<RobotMotion, RobotError> {
        self.go_on()?;
        let bounds = check(setting, edge)?;
        // Pairs that stay apart would not refuse them.
        options.check()?;
        self.with_screening(|asker, screening| {
            let screen = screens.of(setting, &mut asker.querier)?;
            let steps = screening.moments.start(screen.0, setting, edge, &bounds);
            let is_tested = false;
            let test = &mut Touches { asker, setting, edge, bounds: &bounds, steps, is_tested, placed: None };
            Search::new(screen, setting, screening, test).motion(options)?;
            let found = &mut screening.found;
            found.sort_unstable();
            asker.first_hit(setting, (edge, &bounds), (found, steps), options)
        })
    }

    /// Returns which of the pairs that may come near is the first one that does, and when.
    fn first_hit(
        &mut self,
        setting: &Setting,
        (edge, bounds): (&Edge, &[[Bounds; 2]]),
        (found, steps): (&[(usize, u64)], usize),
        options: &MotionOptions,
    ) -> Result<RobotMotion, RobotError> {
        // Once a hit is known, nothing later matters.
        let (mut free_until, mut hit, mut near) = (1.0f64, None, None);
        let mut until = 1.0;
        let joints = JointPaths::new(&setting.model, edge, bounds);
        for &(number, when) in found {
            let pair = &setting.pairs[number];
            let path = PairPath::new(setting, pair, &joints)?;
            let failed = |source| failed(setting, pair, source);
            if self.is_pair_free(&path, until, Steps { count: steps, near: when }, options).map_err(failed)? {
                continue;
            }
            if hit.is_none() && near.is_none() {
                hit = self.sampled_hit(setting, &joints, (found, steps), options)?;
                until = hit.map_or(until, |(time, _)| time);
            }
            if until == 0.0 {
                free_until = 0.0;
                break;
            }
            let part = Interval { path: &path, ends: [0.0, until] };
            // Rounded, a time may be a little later than what the search has found.
            let earlier = |t| part.time(t).next_down().max(0.0);
            match self.querier.motion(&path.a.shape, &path.b.shape, &part, options).map_err(failed)? {
                MotionAnswer::Free => {}
                MotionAnswer::Hit { free_until: free, touching_at, .. } => {
                    free_until = free_until.min(earlier(free));
                    if part.time(touching_at) < until || hit.is_none() {
                        until = part.time(touching_at);
                        hit = Some((until, number));
                    }
                }
                MotionAnswer::Near { free_until: free, at, .. } => {
                    free_until = free_until.min(earlier(free));
                    let at = part.time(at);
                    if near.is_none_or(|(held, _)| at < held) {
                        near = Some((at, number));
                    }
                }
            }
        }
        // A hit counts before what is only near, however early that is, because it is certain.
        let is_hit = hit.is_some();
        let Some((time, number)) = hit.or(near) else { return Ok(RobotMotion::Free) };
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

/// Whether pairs touch in the middle of a step of a motion.
struct Touches<'a> {
    asker: &'a mut Asker,
    setting: &'a Setting,
    edge: &'a Edge,
    bounds: &'a [[Bounds; 2]],
    steps: usize,
    /// Whether any pair is tested.
    is_tested: bool,
    /// The step where the asker is.
    placed: Option<usize>,
}

impl Test for Touches<'_> {
    fn go_on(&self) -> Result<(), QueryError> {
        self.asker.go_on()
    }

    fn querier(&mut self) -> &mut Querier {
        &mut self.asker.querier
    }

    fn is_hit(&mut self, pair: usize, step: usize) -> Result<bool, RobotError> {
        if !self.is_tested {
            return Ok(false);
        }
        let Self { setting, edge, .. } = *self;
        let time = (step as f64 + 0.5) / self.steps as f64;
        if self.placed != Some(step) {
            self.asker.place(setting, &at(&setting.model, edge, time))?;
            self.placed = Some(step);
        }
        if !self.asker.touches(setting, pair)? {
            return Ok(false);
        }
        let of = &setting.pairs[pair];
        // What rods say is certain. What touches by a rounding may not do so in the frame of the exact questions.
        if self.asker.rods_are_within(setting, of, 0.0) == Some(true) {
            return Ok(true);
        }
        let joints = JointPaths::new(&setting.model, edge, self.bounds);
        let path = PairPath::new(setting, of, &joints)?;
        let touches = self.asker.querier.collide(&path.a.shape, &path.b.shape, &path.pose(time));
        touches.map_err(|source| failed(setting, of, source))
    }
}

/// Equal steps of time, and in which of them a pair may come near, a bit each.
#[derive(Clone, Copy)]
struct Steps {
    count: usize,
    near: u64,
}

impl Steps {
    /// Returns whether the pair may come near in an interval of time; none if it may in a part of the steps there.
    fn of(self, [t0, t1]: [f64; 2]) -> Option<bool> {
        let count = self.count as f64;
        // A time between two steps is in both.
        let [from, to] = if t0 == t1 {
            [((t0 * count).ceil() as usize).saturating_sub(1), (t0 * count).floor() as usize + 1]
        } else {
            [(t0 * count).floor() as usize, (t1 * count).ceil() as usize]
        };
        let from = from.min(self.count - 1);
        let of = mask(from, to.clamp(from + 1, self.count));
        match self.near & of {
            0 => Some(false),
            near if near == of => Some(true),
            _ => None,
        }
    }
}

/// Returns bounds of how each joint turns and slides; an error unless the edge is of all joint values, and both ends are valid.
/// Quaternions only turn at a constant rate.
fn check(setting: &Setting, edge: &Edge) -> Result<Vec<[Bounds; 2]>, RobotError> {
    let model = &setting.model;
    for t in [0.0, 1.0] {
        let numbers: Vec<f64> = edge.coefficients.iter().map(|of| value(of, t)).collect();
        model.check(&numbers)?;
    }
    let bounds = bounds(model, edge);
    for (joint, [turn, _]) in model.joints.iter().zip(&bounds) {
        // NaN is not within anything.
        if !(0.0..=MAX_TURN).contains(&turn.rate) {
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
    Ok(bounds)
}
