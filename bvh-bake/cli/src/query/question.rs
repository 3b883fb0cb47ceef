//! What a query asks about each pose, and what it answers.

use super::arguments::{Mode, QueryArguments};
use crate::asking;
use crate::asking::mesh::LoadedMesh;
use crate::asking::runner;
use crate::console::{Failure, plural};
use bvh_format::checksum::Hasher;
use bvh_query::{DistanceOptions, Pose, Querier, QueryError, Relation};
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
    /// How the meshes lie.
    Relation(Relation),
}

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
        meshes: [&LoadedMesh; 2],
        pose: &Pose,
    ) -> Result<Answer, QueryError> {
        let [a, b] = meshes.map(LoadedMesh::shape);
        Ok(match self.mode {
            Mode::Collide => Answer::Flag(querier.collide(a, b, pose)?),
            Mode::Contacts => {
                Answer::Count(querier.visit_contacts(a, b, pose, |_| ControlFlow::Continue(()))?)
            }
            Mode::Distance => Answer::Length(querier.distance_with(a, b, pose, &self.errors)?.distance),
            Mode::Within => Answer::Flag(querier.within(a, b, pose, self.within)?),
            Mode::Relation => Answer::Relation(querier.relation(a, b, pose)?),
        })
    }

    /// Returns an answer in words, with its unit.
    pub(super) fn in_words(&self, answer: &Answer) -> String {
        match *answer {
            Answer::Flag(flag) => match (self.mode, flag) {
                (Mode::Within, true) => format!("at most {:?} mesh units apart", self.within),
                (Mode::Within, false) => format!("more than {:?} mesh units apart", self.within),
                (_, true) => "touching".to_owned(),
                (_, false) => "not touching".to_owned(),
            },
            Answer::Count(count) => format!("{count} {} of triangles in contact", plural(count, "pair")),
            Answer::Length(0.0) => "0 mesh units apart, touching".to_owned(),
            // With an allowed error, the least distance may be shorter.
            Answer::Length(length) if !self.is_exact() => format!("at most {length:?} mesh units apart"),
            Answer::Length(length) => format!("{length:?} mesh units apart"),
            Answer::Relation(relation) => relation_in_words(relation).to_owned(),
        }
    }
}

impl asking::Answer for Answer {
    /// Returns true for contact, for a yes to `within`, and if any part of a mesh is inside the other.
    fn is_positive(&self) -> bool {
        match *self {
            Self::Flag(flag) => flag,
            Self::Count(count) => count > 0,
            Self::Length(length) => length <= 0.0,
            Self::Relation(relation) => !matches!(relation, Relation::Apart | Relation::Undefined),
        }
    }

    fn value(&self) -> f64 {
        match *self {
            Self::Flag(flag) => f64::from(u8::from(flag)),
            Self::Count(count) => count as f64,
            Self::Length(length) => length,
            Self::Relation(relation) => f64::from(relation as u8),
        }
    }

    /// Hashes a byte for yes or no and for a relation, a `u64` for a count, the bits of a distance.
    fn hash(&self, hasher: &mut Hasher) {
        match *self {
            Self::Flag(flag) => hasher.update(&[u8::from(flag)]),
            Self::Count(count) => hasher.update(&count.to_le_bytes()),
            Self::Length(length) => hasher.update(&length.to_bits().to_le_bytes()),
            Self::Relation(relation) => hasher.update(&[relation as u8]),
        }
    }
}

/// Returns a relation in words.
pub(super) fn relation_in_words(relation: Relation) -> &'static str {
    match relation {
        Relation::Touching => "touching",
        Relation::Apart => "apart",
        Relation::AInB => "A inside B",
        Relation::BInA => "B inside A",
        Relation::Mixed => "not touching, some parts inside the other mesh and some not",
        Relation::Undefined => "not touching, undefined because a mesh is not closed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_have_units() {
        let question = |mode| Question { mode, within: 0.5, errors: DistanceOptions::new() };
        let rough = Question { errors: DistanceOptions::new().rel_err(0.1), ..question(Mode::Distance) };
        for (answer, question, words) in [
            (Answer::Flag(true), question(Mode::Collide), "touching"),
            (Answer::Flag(false), question(Mode::Collide), "not touching"),
            (Answer::Flag(true), question(Mode::Within), "at most 0.5 mesh units apart"),
            (Answer::Flag(false), question(Mode::Within), "more than 0.5 mesh units apart"),
            (Answer::Count(1), question(Mode::Contacts), "1 pair of triangles in contact"),
            (Answer::Count(0), question(Mode::Contacts), "0 pairs of triangles in contact"),
            (Answer::Length(0.0), question(Mode::Distance), "0 mesh units apart, touching"),
            (Answer::Length(0.25), question(Mode::Distance), "0.25 mesh units apart"),
            (Answer::Relation(Relation::AInB), question(Mode::Relation), "A inside B"),
            (Answer::Length(0.25), rough, "at most 0.25 mesh units apart"),
        ] {
            assert_eq!(question.in_words(&answer), words);
        }
    }
}
