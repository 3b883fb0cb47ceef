//! What a query asks about each pose, and what it answers.

use super::arguments::{Mode, QueryArguments};
use super::runner;
use super::side::Sides;
use crate::console::Failure;
use bvh_query::{DistanceOptions, Pose, Querier, QueryError};
use std::ops::ControlFlow;

/// A question with its parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    pub(super) mode: Mode,
    /// The distance of `Mode::Within`, in mesh units.
    pub(super) within: f64,
    pub(super) errors: DistanceOptions,
}

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Answer {
    /// Yes or no.
    Flag(bool),
    /// A number of pairs of triangles.
    Count(u64),
    /// A distance in mesh units.
    Length(f64),
}

/// An answer and its nanoseconds.
pub(super) type Timed = (Answer, u64);

/// The results of a file of poses.
pub(super) type Run = runner::Run<Answer>;

impl Question {
    /// Takes the question from the command line, and refuses options that do not belong to its mode.
    pub(super) fn new(arguments: &QueryArguments) -> Result<Self, Failure> {
        let mode = arguments.mode;
        let wrong = |text: &str| Err(Failure::Usage(format!("{text} (see --help)")));
        if mode == Mode::Within && arguments.within.is_none() {
            return wrong("--mode within requires --within D");
        }
        if mode != Mode::Within && arguments.within.is_some() {
            return wrong("--within requires --mode within");
        }
        if (arguments.rel_err.is_some() || arguments.abs_err.is_some()) && mode != Mode::Distance {
            return wrong("--rel-err and --abs-err require --mode distance");
        }
        // Clap cannot check this: where pose files exclude --pose, it also waives what requires --pose.
        if arguments.witness.is_some() && (arguments.pose.is_none() || mode != Mode::Distance) {
            return wrong("--witness requires --pose and --mode distance");
        }
        let errors = DistanceOptions::new()
            .rel_err(arguments.rel_err.unwrap_or(0.0))
            .abs_err(arguments.abs_err.unwrap_or(0.0));
        Ok(Self { mode, within: arguments.within.unwrap_or(0.0), errors })
    }

    /// Returns whether the answer is the same on every backend and with every number of threads.
    pub(super) fn is_exact(&self) -> bool {
        self.errors == DistanceOptions::default()
    }

    /// Asks the question about one pose.
    #[inline]
    pub(super) fn ask(
        &self,
        querier: &mut Querier,
        sides: &Sides<'_>,
        pose: &Pose,
    ) -> Result<Answer, QueryError> {
        let (a, b) = sides.shapes();
        Ok(match self.mode {
            Mode::Collide => Answer::Flag(querier.collide(a, b, pose)?),
            Mode::Contacts => {
                Answer::Count(querier.visit_contacts(a, b, pose, |_| ControlFlow::Continue(()))?)
            }
            Mode::Distance => Answer::Length(querier.distance_with(a, b, pose, &self.errors)?.distance),
            Mode::Within => Answer::Flag(querier.within(a, b, pose, self.within)?),
        })
    }
}

impl Answer {
    /// Returns true for contact, and for a yes to `within`.
    pub(super) fn is_positive(&self) -> bool {
        match *self {
            Self::Flag(flag) => flag,
            Self::Count(count) => count > 0,
            Self::Length(length) => length <= 0.0,
        }
    }

    /// Returns the answer as a number.
    pub(super) fn value(&self) -> f64 {
        match *self {
            Self::Flag(flag) => f64::from(u8::from(flag)),
            Self::Count(count) => count as f64,
            Self::Length(length) => length,
        }
    }
}
