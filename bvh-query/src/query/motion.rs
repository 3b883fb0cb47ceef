//! Is the way free, and where does it end? A search over time, certain at every moment.
//!
//! An answer has a definition that knows nothing of how it is found. Time is halved again and again into *cells*, until B
//! moves by at most an eighth of the tolerance within a cell: [`motion_reach`]. A cell is *clear* if, in the pose of its
//! middle, the meshes are farther apart than the clearance and that reach. The cells are met in the order of time:
//!
//! - In a clear cell nothing comes within the clearance.
//! - In one that is not clear, the pose of the middle decides exactly: within the clearance is a hit.
//! - Else the cell is undecided, and so is the answer, unless a later cell is a hit.
//!
//! The search leaves out cells that are certainly clear, many at a time: during an interval, everything that stays farther
//! apart than the clearance and a quarter of the tolerance ([`crate::query::sweep`]). Where few pairs of triangles are left,
//! they are kept from interval to interval; all others are apart during the whole interval, so that these pairs alone decide.
//! So what a filter sees does not show in an answer, which has the same bits on every backend.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::motion::Path;
use crate::narrow::{triangle_distance, triangles_within};
use crate::pose::Pose;
use crate::query::answers::Distance;
use crate::query::displacement::displacement;
use crate::query::exact::placed;
use crate::query::options::{DistanceOptions, check_distance};
use crate::query::placed_pair::each_pair;
use crate::query::querier::Querier;
use crate::query::search::Search;
use crate::query::sweep::{Room, Sweep, SweptPair};
use bvh_format::object::Object;
use std::collections::VecDeque;
use std::rc::Rc;

/// The most pairs of triangles that are kept from interval to interval.
const MOST_PAIRS: usize = 16;
/// The most pairs of packets that the first interval's walk looks at; each halving allows four times as many. A long interval
/// in which much is near is given up early, and a short one has to be looked through in the end.
const FIRST_PACKET_TESTS: f64 = 24.0;
/// How many intervals may wait while any hit is looked for by long intervals first.
const MOST_SPREAD: usize = 64;
/// How often time may be halved: the middle of a cell is an `f64`, and far from rounding.
const MAX_DEPTH: u32 = 45;
/// The default tolerance, as a fraction of the diagonal of the larger object's box.
const DEFAULT_TOLERANCE: f64 = 1e-6;
/// More than the relative error of all `f64` arithmetic on coordinates here.
const ROUNDING: f64 = 1.0 / (1u64 << 44) as f64;

/// What counts as a hit, and how exactly time is searched.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct MotionOptions {
    /// Meshes that come as near as this hit, in mesh units; 0 for contact.
    pub clearance: f64,
    /// How near B may come to a hit, beyond the clearance, without an answer that says free or hit, in mesh units; `None` for a
    /// millionth of the diagonal of the larger object's box. A smaller one costs more.
    pub tolerance: Option<f64>,
}

impl MotionOptions {
    /// Asks for contact, with the default tolerance.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the distance that counts as a hit, in mesh units. A query refuses one that is negative or not finite.
    #[must_use]
    pub fn clearance(self, clearance: f64) -> Self {
        Self { clearance, ..self }
    }

    /// Sets the tolerance in mesh units. A query refuses one that is not above 0 and finite.
    #[must_use]
    pub fn tolerance(self, tolerance: impl Into<Option<f64>>) -> Self {
        Self { tolerance: tolerance.into(), ..self }
    }
}

/// Whether a way is free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotionAnswer {
    /// At no time from 0 to 1 are the meshes within the clearance.
    Free,
    /// They are within the clearance in the pose at `touching_at`.
    Hit {
        /// Before this time they certainly are not. It equals `touching_at` only where both are 0.
        free_until: f64,
        /// A time at which they are: the earliest one found.
        touching_at: f64,
        /// The answer of [`Querier::distance`] for that pose.
        contact: Distance,
    },
    /// They come so near that neither can be told: the distance is at most the clearance and the tolerance, and in no pose
    /// that was looked at are they within the clearance.
    Near {
        /// Before this time they certainly are not within the clearance.
        free_until: f64,
        /// The time of the first undecided pose.
        at: f64,
        /// The answer of [`Querier::distance`] for that pose.
        distance: Distance,
    },
}

/// A part of time that has to be looked at.
struct Interval {
    times: [f64; 2],
    poses: [Pose; 2],
    depth: u32,
    /// Among which all pairs of triangles are that are not apart all the time, if they are few.
    pairs: Option<Rc<[SweptPair]>>,
}

/// What a search is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    /// The first hit.
    First,
    /// Whether there is any, or anything undecided.
    Any,
}

/// What a search has found.
enum Outcome {
    Free,
    Hit { free_until: f64, touching_at: f64 },
    Undecided { free_until: f64, at: f64 },
}

/// What stays the same during a search.
struct Question<'a> {
    a: Shape<'a>,
    b: Shape<'a>,
    path: &'a dyn Path,
    clearance: f64,
    tolerance: f64,
    /// How far vertices of B are at most from the origin of its frame.
    radius: f64,
    /// The same of A.
    magnitude_a: f64,
}

impl Querier {
    /// Returns whether B's way is free, with B moving in A's frame along `path`, and where it ends if it is not.
    ///
    /// The answer is certain: [`MotionAnswer::Free`] holds at every moment, not at samples, and a [`MotionAnswer::Hit`] names a
    /// pose in which the meshes are within the clearance. Contact at time 0 counts. Answers have the same bits on every
    /// backend and in any order of questions. As for [`Querier::collide`], meshes are surfaces.
    ///
    /// Cost: about one query of contact for each interval that has to be looked at: few where B stays apart by more than it
    /// turns aside, some fifty for a hit.
    ///
    /// # Errors
    /// [`QueryError::Number`] for a clearance or a tolerance that means nothing, or a tolerance so small that time cannot be
    /// halved as often as it needs; and the errors of [`Querier::within`]. A budget is for all intervals together.
    pub fn motion<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        path: &dyn Path,
        options: &MotionOptions,
    ) -> Result<MotionAnswer, QueryError> {
        let question = Question::new(a.into(), b.into(), path, options)?;
        self.start();
        match self.search_time(&question, Wanted::First)? {
            Outcome::Free => Ok(MotionAnswer::Free),
            Outcome::Hit { free_until, touching_at } => {
                let contact = self.distance_at(&question, &path.pose(touching_at))?;
                Ok(MotionAnswer::Hit { free_until, touching_at, contact })
            }
            Outcome::Undecided { free_until, at } => {
                let distance = self.distance_at(&question, &path.pose(at))?;
                Ok(MotionAnswer::Near { free_until, at, distance })
            }
        }
    }

    /// Returns whether B's way is certainly free: whether [`Querier::motion`] answers [`MotionAnswer::Free`]. It does not look
    /// for the first hit but for any, in poses spread over the way, and so says no in less time. This is what planners ask.
    ///
    /// # Errors
    /// The errors of [`Querier::motion`].
    pub fn is_free<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        path: &dyn Path,
        options: &MotionOptions,
    ) -> Result<bool, QueryError> {
        let question = Question::new(a.into(), b.into(), path, options)?;
        self.start();
        Ok(matches!(self.search_time(&question, Wanted::Any)?, Outcome::Free))
    }

    /// Searches time for what is wanted.
    fn search_time(&mut self, question: &Question<'_>, wanted: Wanted) -> Result<Outcome, QueryError> {
        let path = question.path;
        let ends = [path.pose(0.0), path.pose(1.0)];
        if self.is_within(question, &ends[0], question.clearance)? {
            return Ok(Outcome::Hit { free_until: 0.0, touching_at: 0.0 });
        }
        let mut undecided: Option<(f64, f64)> = None;
        let mut todo = VecDeque::from([Interval { times: [0.0, 1.0], poses: ends, depth: 0, pairs: None }]);
        loop {
            // The first hit is met in the order of time; any hit sooner by long intervals first, as long as they are few.
            let spread = wanted == Wanted::Any && todo.len() < MOST_SPREAD;
            let Some(interval) = (if spread { todo.pop_front() } else { todo.pop_back() }) else { break };
            self.memory.visit()?;
            let [t0, t1] = interval.times;
            let at = t0 + (t1 - t0) / 2.0;
            let middle = path.pose(at);
            let reach = question.reach(&interval, at, &middle);
            let is_cell = reach <= question.tolerance / 8.0;
            let pairs = self.not_apart(question, &interval, &middle)?;
            if pairs.as_ref().is_some_and(|pairs| pairs.is_empty()) {
                continue;
            }
            let is_within = |querier: &mut Self, d: f64| match &pairs {
                Some(pairs) => Ok(any_within(pairs, &middle, d)),
                None => querier.is_within(question, &middle, d),
            };
            if !is_cell {
                // Of a few pairs, the first one is the likeliest.
                let likely = |querier: &mut Self| match &pairs {
                    Some(pairs) => Ok(any_within(&pairs[..1], &middle, question.clearance)),
                    None => querier.is_within(question, &middle, question.clearance),
                };
                if wanted == Wanted::Any && likely(self)? {
                    return Ok(Outcome::Hit { free_until: 0.0, touching_at: at });
                }
                if interval.depth == MAX_DEPTH {
                    return Err(QueryError::Number {
                        name: "tolerance",
                        expected: "more than B moves in 2^-45 of the time",
                        found: question.tolerance,
                    });
                }
                let depth = interval.depth + 1;
                let [start, end] = interval.poses;
                let halves = [
                    Interval { times: [t0, at], poses: [start, middle], depth, pairs: pairs.clone() },
                    Interval { times: [at, t1], poses: [middle, end], depth, pairs },
                ];
                if spread {
                    todo.extend(halves)
                } else {
                    todo.extend(halves.into_iter().rev())
                }
                continue;
            }
            if !is_within(self, question.clearance + reach)? {
                continue;
            }
            if is_within(self, question.clearance)? {
                let free_until = undecided.map_or(t0, |(free_until, _)| free_until);
                return Ok(Outcome::Hit { free_until, touching_at: at });
            }
            undecided.get_or_insert((t0, at));
            if wanted == Wanted::Any {
                break;
            }
        }
        let Some((free_until, at)) = undecided else { return Ok(Outcome::Free) };
        if self.is_within(question, &ends[1], question.clearance)? {
            return Ok(Outcome::Hit { free_until, touching_at: 1.0 });
        }
        Ok(Outcome::Undecided { free_until, at })
    }

    /// Returns pairs of triangles, among which are all that may come within the clearance during an interval, unless there are
    /// many. If there are any, the first one may.
    fn not_apart(
        &mut self,
        question: &Question<'_>,
        interval: &Interval,
        middle: &Pose,
    ) -> Result<Option<Rc<[SweptPair]>>, QueryError> {
        let [start, end] = interval.poses;
        let sweep = Sweep { start, middle: *middle, end, limit: question.limit(interval) };
        if let Some(pairs) = &interval.pairs {
            self.memory.visit()?;
            // One pair that is not apart suffices to halve the interval. It is the first one to look at in both halves; those
            // before it are apart all the time, and those behind it are not looked at yet.
            let first = pairs.iter().position(|pair| !sweep.sets_apart(pair)).unwrap_or(pairs.len());
            return Ok(Some(if first == 0 { pairs.clone() } else { pairs[first..].into() }));
        }
        let mut found = Vec::new();
        let is_crowded = each_pair(question.a, question.b, middle, |placed| {
            let packet_tests = (FIRST_PACKET_TESTS * 4f64.powi(interval.depth as i32)) as u64;
            let room = Room { pairs: MOST_PAIRS, packet_tests };
            let is_whole = self.sweep((&placed.pair, &sweep), &mut found, room)?;
            Ok((!is_whole).then_some(()))
        })?;
        Ok(if is_crowded.is_some() { None } else { Some(found.into()) })
    }

    /// Returns whether the meshes are at most `d` apart in a pose.
    fn is_within(&mut self, question: &Question<'_>, pose: &Pose, d: f64) -> Result<bool, QueryError> {
        if d == 0.0 {
            return Ok(self.any_contact(question.a, question.b, pose)?.is_some());
        }
        let mut search = Search::new(DistanceOptions::default(), d);
        self.search(question.a, question.b, pose, &mut search)?;
        Ok(search.done)
    }

    /// Returns the answer of [`Querier::distance`].
    fn distance_at(&mut self, question: &Question<'_>, pose: &Pose) -> Result<Distance, QueryError> {
        // Where there is contact, the answer is the first one, and a search would only find out that there is.
        if question.clearance == 0.0
            && let Some(first) = self.first_contact(question.a, question.b, pose)?
        {
            return Ok(first.distance(0.0));
        }
        let mut search = Search::new(DistanceOptions::default(), f64::INFINITY);
        let best = self.nearest(question.a, question.b, pose, &mut search)?;
        let best = best.ok_or_else(|| crate::query::distance::no_answer(question.a))?;
        Ok(best.distance(search.proved()))
    }
}

impl<'a> Question<'a> {
    fn new(
        a: Shape<'a>,
        b: Shape<'a>,
        path: &'a dyn Path,
        options: &MotionOptions,
    ) -> Result<Self, QueryError> {
        check_distance(options.clearance)?;
        let diagonal = |shape: Shape<'_>| shape.objects().iter().map(diagonal).fold(0.0, f64::max);
        let largest = diagonal(a).max(diagonal(b));
        // Two points have no diagonal.
        let default = if largest > 0.0 { DEFAULT_TOLERANCE * largest } else { DEFAULT_TOLERANCE };
        let tolerance = options.tolerance.unwrap_or(default);
        if !(tolerance.is_finite() && tolerance > 0.0) {
            let (name, expected) = ("tolerance", "a finite length above 0");
            return Err(QueryError::Number { name, expected, found: tolerance });
        }
        let clearance = options.clearance;
        Ok(Self { a, b, path, clearance, tolerance, radius: radius(b), magnitude_a: radius(a) })
    }

    /// Returns the sagitta of the path. A number of a user's path that is none leaves nothing certain.
    fn sagitta(&self, t0: f64, t1: f64) -> f64 {
        let sagitta = self.path.sagitta(self.radius, t0, t1);
        if sagitta >= 0.0 { sagitta } else { f64::INFINITY }
    }

    /// Returns how far apart parts have to be at both ends of an interval to be left out: farther than the clearance and a
    /// quarter of the tolerance all the time.
    fn limit(&self, interval: &Interval) -> f64 {
        let [t0, t1] = interval.times;
        let translations = interval.poses.iter().flat_map(|pose| pose.translation()).map(f64::abs);
        let magnitude = 3.0 * (self.radius + self.magnitude_a) + translations.sum::<f64>();
        let sagitta = self.sagitta(t0, t1);
        (self.clearance + self.tolerance / 4.0 + sagitta) * (1.0 + ROUNDING) + ROUNDING * magnitude
    }

    /// Returns how far any vertex of B is at most from where it is in the middle of an interval.
    fn reach(&self, interval: &Interval, at: f64, middle: &Pose) -> f64 {
        let [t0, t1] = interval.times;
        let half =
            |pose: &Pose, from: f64, to: f64| displacement(self.b, middle, pose) + self.sagitta(from, to);
        half(&interval.poses[0], t0, at).max(half(&interval.poses[1], at, t1))
    }
}

/// Returns how far any vertex of B is at most, during `[t0, t1]`, from where it is in the middle of that time, in mesh units:
/// how far vertices are there from where they are at either end, and the sagitta of either half. [`Querier::motion`] halves
/// time until this is at most an eighth of the tolerance.
pub fn motion_reach<'a>(b: impl Into<Shape<'a>>, path: &dyn Path, t0: f64, t1: f64) -> f64 {
    let b = b.into();
    let question =
        Question { a: b, b, path, clearance: 0.0, tolerance: 0.0, radius: radius(b), magnitude_a: 0.0 };
    let at = t0 + (t1 - t0) / 2.0;
    let poses = [path.pose(t0), path.pose(t1)];
    question.reach(&Interval { times: [t0, t1], poses, depth: 0, pairs: None }, at, &path.pose(at))
}

/// Returns whether any pair is at most `d` apart in a pose, exactly.
fn any_within(pairs: &[SweptPair], pose: &Pose, d: f64) -> bool {
    pairs.iter().any(|pair| {
        let b = placed(&pair.b, pose);
        let closest = triangle_distance(&pair.a, &b);
        if d == 0.0 { closest.distance == 0.0 } else { triangles_within(&pair.a, &b, &closest, d) }
    })
}

/// Returns how far vertices of a shape are at most from the origin of its frame, rounded up, in mesh units.
fn radius(shape: Shape<'_>) -> f64 {
    let of = |object: &Object| {
        let [lo, hi] = object.bounding_box();
        let far: f64 = (0..3).map(|axis| lo[axis].abs().max(hi[axis].abs()).powi(2)).sum();
        let (centre, radius) = object.bounding_sphere();
        let centre: f64 = centre.iter().map(|value| value * value).sum();
        far.sqrt().min(centre.sqrt() + radius)
    };
    // A rotation may stretch by 2^-19.
    shape.objects().iter().map(of).fold(0.0, f64::max) * (1.0 + 1.0 / (1 << 18) as f64)
}

/// Returns the diagonal of an object's box, in mesh units.
fn diagonal(object: &Object) -> f64 {
    let [lo, hi] = object.bounding_box();
    (0..3).map(|axis| (hi[axis] - lo[axis]).powi(2)).sum::<f64>().sqrt()
}
