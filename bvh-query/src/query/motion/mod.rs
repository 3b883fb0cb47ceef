//! Is a motion free, and where does it end? A search over time, certain at every moment.
//!
//! The definition of an answer does not depend on how it is found. Time is halved again and again into *cells*, until B
//! moves by at most an eighth of the tolerance within a cell: [`path_reach`]. A cell is *clear* if, in the pose at its
//! middle, the meshes are farther apart than the sum of the clearance and that reach, rounded up. The cells are decided
//! in the order of time:
//!
//! - In a clear cell nothing comes within the clearance.
//! - In any other cell, the pose at the middle is tested exactly. It is a hit if the meshes are within the clearance
//!   there.
//! - Otherwise the cell is undecided, and so is the answer, unless a later cell is a hit.
//!
//! If a shape is solid, a cell is a hit as well if a part of the other shape is inside it in the pose at the middle. A part gets
//! inside only through the surface, so only the start of the path and cells after an undecided one need this test.
//!
//! The search skips cells that are certainly clear, many at a time: those of an interval during which everything stays
//! farther apart than the clearance and an eighth of the tolerance, which is as far as any cell reaches ([`sweep`]), or as far as these do
//! where B slides. After
//! the first undecided cell it skips those that are certainly no hits, because everything stays farther apart than the
//! clearance. If a sweep leaves few pairs of
//! triangles, they are kept for the parts of the interval. All other pairs are apart during the whole interval, so
//! these pairs alone decide. Filters therefore do not affect answers, which have the same bits on every backend.

mod cells;
mod limits;
mod sweep;
mod swept_pairs;

pub(crate) use cells::Earliest;
pub(crate) use limits::{Measures, default_tolerance, radius, size_of};

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::motion::RigidPath;
use crate::pose::Pose;
use crate::query::distance::Distance;
use crate::query::options::{DistanceOptions, check, options};
use crate::query::pair_search::PairSearch;
use crate::query::querier::Querier;
use cells::{Outcome, TimeSearch};
use limits::Question;

options! {
    /// What counts as a hit, and how exactly time is searched. By default contact does.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    ///
    /// let options = MotionOptions::new().clearance(0.01).tolerance(1e-4);
    /// assert_eq!((options.clearance, options.tolerance), (0.01, Some(1e-4)));
    /// assert!(MotionOptions::new().clearance(-1.0).check().is_err());
    /// ```
    pub struct MotionOptions {
        /// Meshes that are at most this far apart count as a hit, in mesh units; 0 for contact. A query refuses a length that is
        /// negative or not finite.
        clearance(f64): f64 = 0.0,
        /// The width of the undecided range beyond the clearance, in mesh units. If B comes that near and is no hit, the
        /// answer may be [`MotionAnswer::Near`]. `None` stands for the default, which
        /// [`MotionOptions::tolerance_between`] gives: a millionth of the diagonal of the smaller object's box. A smaller
        /// tolerance costs more. A query refuses one that is not above 0 and finite.
        tolerance(impl Into<Option<f64>>): Option<f64> = None,
    }
}

impl MotionOptions {
    /// Returns the tolerance of a query about two shapes, in mesh units: the one that is set, or else the default. That
    /// is a millionth of the smaller of both sizes, where the size of a shape is the largest diagonal of the boxes of its
    /// objects and twice its radius. If one of them is a point without a radius, the other's size counts; for two such
    /// points, the default is 1e-6.
    ///
    /// Poses are rounded. The default is therefore never below 2^-38 of how far the vertices of both are from the origins
    /// of their frames. That counts where one size is less than a few millionths of the other, or of such a distance.
    pub fn tolerance_between<'a>(&self, a: impl Into<Shape<'a>>, b: impl Into<Shape<'a>>) -> f64 {
        let default = || default_tolerance(Measures::of(a.into()), Measures::of(b.into()));
        self.tolerance.unwrap_or_else(default)
    }

    /// Returns an error for the numbers that every query refuses.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the clearance or the tolerance is not a valid number.
    pub fn check(&self) -> Result<(), QueryError> {
        check(NumberError::Clearance, self.clearance)?;
        match self.tolerance {
            Some(found) if !found.is_finite() || found <= 0.0 => Err(NumberError::Tolerance(found).into()),
            _ => Ok(()),
        }
    }
}

/// Whether a motion is free.
///
/// [`Querier::motion`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MotionAnswer {
    /// At no time from 0 to 1 are the meshes within the clearance.
    Free,
    /// They are within the clearance in the pose at `touching_at`.
    Hit {
        /// Before this time they certainly are not within the clearance. It equals `touching_at` only if both are 0.
        free_until: f64,
        /// A time at which they are within the clearance: the earliest one found.
        touching_at: f64,
        /// The answer of [`Querier::distance`] for that pose.
        nearest: Distance,
    },
    /// The meshes come near, but it is undecided whether they come within the clearance. In some pose the distance is
    /// at most the sum of the clearance and the tolerance. In none of the poses tested are they within the clearance.
    Near {
        /// Before this time they certainly are not within the clearance.
        free_until: f64,
        /// The time of the first undecided pose.
        at: f64,
        /// The answer of [`Querier::distance`] for that pose.
        nearest: Distance,
    },
}

/// A search that has no answer, and until when it has decided that there is no hit.
#[derive(Debug)]
pub(crate) struct EndedByError {
    pub(crate) decided_until: f64,
    pub(crate) error: QueryError,
}

impl Querier {
    /// Returns whether the motion of B along `path`, in A's frame, is free, and where it ends if it is not.
    ///
    /// The answer is certain: [`MotionAnswer::Free`] holds at every moment, not only at samples, and a
    /// [`MotionAnswer::Hit`] names a pose in which the meshes are within the clearance. Contact at time 0 counts.
    /// Answers have the same bits on every backend and in any order of queries. As for [`Querier::collide`], meshes
    /// are surfaces, unless they are solid ([`Shape::solid`]): a pose in which a part of one shape is inside the other then is
    /// a hit.
    ///
    /// Cost: about one contact query for each interval that must be tested. There are few intervals if B keeps a
    /// distance that is larger than the bend of its path, and some thirty for a hit, or for a gap below the tolerance. There may
    /// be one query for each eighth of the tolerance that B moves by while it turns at a gap far below the tolerance, or moves
    /// straight at a slant to A's axes at a gap of some roundings, because a hit may still follow. A larger tolerance or a
    /// budget limits that, and [`Querier::is_free`] avoids it, because it can say no at once.
    ///
    /// ```
    /// use bvh_query::{Motion, MotionAnswer, MotionOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let path = Motion::between(&at(4.0)?, &at(0.0)?)?;
    /// match Querier::new()?.motion(&block, &block, &path, &MotionOptions::new())? {
    ///     MotionAnswer::Hit { free_until, touching_at, nearest } => {
    ///         assert!(free_until <= 0.5 && 0.5 <= touching_at && touching_at - free_until < 1e-5);
    ///         assert_eq!(nearest.distance, 0.0);
    ///     }
    ///     other => panic!("{other:?}"),
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if the clearance or the tolerance is not a valid number, or if the tolerance is too small
    /// for the path: B moves by more in 2^-45 of the time, or its poses are rounded by more. Also the errors of
    /// [`Querier::within`]. A budget is for all intervals together. The backend may affect which error is returned, and
    /// whether an error or an answer is found first.
    pub fn motion<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<MotionAnswer, QueryError> {
        self.motion_before(a.into(), b.into(), path, options, &Earliest::new()).map_err(|ended| ended.error)
    }

    /// Answers as `motion` does, but ignores everything later than the earliest hit of all parallel searches.
    pub(crate) fn motion_before(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        path: &dyn RigidPath,
        options: &MotionOptions,
        earliest: &Earliest,
    ) -> Result<MotionAnswer, EndedByError> {
        let at_start = |error| EndedByError { decided_until: 0.0, error };
        self.start();
        self.look_at_objects(a).and_then(|()| self.look_at_objects(b)).map_err(at_start)?;
        let question = Question::new(a, b, path, options).map_err(at_start)?;
        let mut search = TimeSearch::new(self, &question);
        let outcome = search.first(earliest);
        let decided_until = search.decided_until;
        let answer = outcome.and_then(|outcome| self.answer(&question, &outcome));
        answer.map_err(|error| EndedByError { decided_until, error })
    }

    /// Adds to what a search has found how far apart the meshes are then.
    fn answer(&mut self, question: &Question<'_>, outcome: &Outcome) -> Result<MotionAnswer, QueryError> {
        match *outcome {
            Outcome::Free => Ok(MotionAnswer::Free),
            Outcome::Hit { free_until, touching_at } => {
                let nearest = self.distance_at(question, &question.path.pose(touching_at))?;
                Ok(MotionAnswer::Hit { free_until, touching_at, nearest })
            }
            Outcome::Undecided { free_until, at } => {
                let nearest = self.distance_at(question, &question.path.pose(at))?;
                Ok(MotionAnswer::Near { free_until, at, nearest })
            }
        }
    }

    /// Returns whether the motion of B is certainly free: whether [`Querier::motion`] answers [`MotionAnswer::Free`].
    /// It looks for any hit instead of the first, in poses spread over the path, so it needs less time to say no. Use
    /// it in planners.
    ///
    /// ```
    /// use bvh_query::{MotionOptions, Polyline, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let at = |x, y| Pose::new(*Pose::IDENTITY.rotation(), [x, y, 0.0]);
    /// let across = Polyline::new(&[at(-3.0, 0.0)?, at(3.0, 0.0)?])?;
    /// let around = Polyline::new(&[at(-3.0, 0.0)?, at(-3.0, 3.0)?, at(3.0, 3.0)?, at(3.0, 0.0)?])?;
    /// assert!(!querier.is_free(&block, &block, &across, &MotionOptions::new())?);
    /// assert!(querier.is_free(&block, &block, &around, &MotionOptions::new())?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::motion`].
    pub fn is_free<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<bool, QueryError> {
        let (a, b) = (a.into(), b.into());
        self.start();
        self.look_at_objects(a)?;
        self.look_at_objects(b)?;
        let question = Question::new(a, b, path, options)?;
        TimeSearch::new(self, &question).is_free()
    }

    /// Returns the answer of [`Querier::distance`].
    fn distance_at(&mut self, question: &Question<'_>, pose: &Pose) -> Result<Distance, QueryError> {
        // Where there is contact, the answer is the first one, and a search would only find out that there is.
        if question.clearance == 0.0
            && let Some(first) = self.first_contact(question.a, question.b, pose)?
        {
            return Ok(first.distance(0.0));
        }
        let mut search = PairSearch::new(DistanceOptions::default(), f64::INFINITY);
        let best = self.nearest(question.a, question.b, pose, &mut search)?;
        let best = best.ok_or_else(|| crate::query::distance::no_answer(question.a))?;
        self.distance_of_shapes(question.a, question.b, pose, best.distance(search.proved()))
    }
}

/// Returns an upper bound, in mesh units, of how far any vertex of B is, during `[t0, t1]`, from its place in the
/// middle of that time. It is the sum of two terms: how far vertices at either end are from their places in the middle,
/// and the sagitta of either half. [`Querier::motion`] halves time until this is at most an eighth of the tolerance.
///
/// ```
/// use bvh_query::{Motion, Pose, path_reach};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
/// let path = Motion::between(&at(0.0)?, &at(4.0)?)?;
/// let reach = path_reach(&block, &path, 0.25, 0.75); // from the middle, 1 to either side
/// assert!(1.0 <= reach && reach < 1.0 + 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn path_reach<'a>(b: impl Into<Shape<'a>>, path: &dyn RigidPath, t0: f64, t1: f64) -> f64 {
    let b = b.into();
    let question = Question::unchecked(b, b, path);
    question.middle(&question.span(t0, t1)).reach
}
