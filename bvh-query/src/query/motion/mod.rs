//! Is the way free, and where does it end? A search over time, certain at every moment.
//!
//! An answer has a definition that knows nothing of how it is found. Time is halved again and again into *cells*, until B
//! moves by at most an eighth of the tolerance within a cell: [`path_reach`]. A cell is *clear* if, in the pose of its
//! middle, the meshes are farther apart than the clearance and that reach, added and rounded up. The cells are met in the
//! order of time:
//!
//! - In a clear cell nothing comes within the clearance.
//! - In one that is not clear, the pose of the middle decides exactly: within the clearance is a hit.
//! - Else the cell is undecided, and so is the answer, unless a later cell is a hit.
//!
//! The search leaves out cells that are certainly clear, many at a time: during an interval, everything that stays farther
//! apart than the clearance and an eighth of the tolerance ([`sweep`]). Where few pairs of triangles are left, they are kept
//! from interval to interval; all others are apart during the whole interval, so that these pairs alone decide.
//! So what a filter sees does not show in an answer, which has the same bits on every backend.

mod pairs;
mod question;
mod search;
mod sweep;

pub(crate) use question::{radius, size, tolerance};
pub(crate) use search::Earliest;

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::motion::RigidPath;
use crate::pose::Pose;
use crate::query::answers::Distance;
use crate::query::options::{DistanceOptions, check};
use crate::query::querier::Querier;
use crate::query::search::Search;
use question::Question;
use search::{Outcome, TimeSearch};

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

impl MotionOptions {
    /// Refuses numbers that mean nothing.
    pub(crate) fn check(&self) -> Result<(), QueryError> {
        check("clearance", "a finite length of at least 0", self.clearance)?;
        match self.tolerance {
            Some(found) if !found.is_finite() || found <= 0.0 => {
                Err(QueryError::Number { name: "tolerance", expected: "a finite length above 0", found })
            }
            _ => Ok(()),
        }
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
        nearest: Distance,
    },
    /// They come so near that neither can be told: the distance is at most the clearance and the tolerance, and in no pose
    /// that was looked at are they within the clearance.
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
    /// Returns whether B's way is free, with B moving in A's frame along `path`, and where it ends if it is not.
    ///
    /// The answer is certain: [`MotionAnswer::Free`] holds at every moment, not at samples, and a [`MotionAnswer::Hit`] names a
    /// pose in which the meshes are within the clearance. Contact at time 0 counts. Answers have the same bits on every
    /// backend and in any order of questions. As for [`Querier::collide`], meshes are surfaces.
    ///
    /// Cost: about one query of contact for each interval that has to be looked at: few where B stays apart by more than it
    /// turns aside, some thirty for a hit. Where B goes on and on at a gap below the tolerance, it takes a query for each eighth
    /// of the tolerance that it moves by, because a hit may follow: a budget ends that, or [`Querier::is_free`], which says no
    /// at once.
    ///
    /// # Errors
    /// [`QueryError::Number`] for a clearance or a tolerance that means nothing, or a tolerance that poses do not resolve:
    /// because B moves by more in 2^-45 of the time, or is rounded by more; and the errors of [`Querier::within`]. A budget is
    /// for all intervals together. Which error there is, and whether one is met before an answer, may depend on the backend.
    pub fn motion<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<MotionAnswer, QueryError> {
        self.motion_before(a.into(), b.into(), path, options, &Earliest::new()).map_err(|ended| ended.error)
    }

    /// Answers as `motion` does, but for what is later than the earliest hit of all searches side by side.
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

    /// Returns whether B's way is certainly free: whether [`Querier::motion`] answers [`MotionAnswer::Free`]. It does not look
    /// for the first hit but for any, in poses spread over the way, and so says no in less time. This is what planners ask.
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
        let mut search = Search::new(DistanceOptions::default(), f64::INFINITY);
        let best = self.nearest(question.a, question.b, pose, &mut search)?;
        let best = best.ok_or_else(|| crate::query::distance::no_answer(question.a))?;
        Ok(best.distance(search.proved()))
    }
}

/// Returns how far any vertex of B is at most, during `[t0, t1]`, from where it is in the middle of that time, in mesh units:
/// how far vertices are there from where they are at either end, and the sagitta of either half. [`Querier::motion`] halves
/// time until this is at most an eighth of the tolerance.
pub fn path_reach<'a>(b: impl Into<Shape<'a>>, path: &dyn RigidPath, t0: f64, t1: f64) -> f64 {
    let b = b.into();
    let question = Question::unchecked(b, b, path);
    question.middle(&question.stretch(t0, t1)).reach
}
