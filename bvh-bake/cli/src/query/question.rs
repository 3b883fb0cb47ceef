//! What a query asks about each pose, and what it answers.

use super::{Mode, QueryArguments};
use crate::asking;
use crate::asking::mesh::LoadedMesh;
use crate::asking::witness;
use crate::console::{Failure, plural};
use bvh_format::checksum::Hasher;
use bvh_query::{Contact, Distance, DistanceOptions, Pose, Querier, QueryError, Relation};
use serde_json::{Value, json};
use std::ops::ControlFlow;

/// The most contacts that are listed for a person; the others are only counted.
const MAX_LISTED: usize = 10;

/// A question with its parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    pub(super) mode: Mode,
    /// The distance of `Mode::Within`, in mesh units.
    within: f64,
    errors: DistanceOptions,
    /// Whether contacts are listed, not only counted.
    list: bool,
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// Whether the meshes touch.
    Collide(bool),
    /// Whether they are near enough.
    Within(bool),
    /// The number of pairs of triangles in contact, and the pairs if they are to be listed.
    Contacts(u64, Vec<Contact>),
    /// How far apart they are.
    Distance(Distance),
    /// How they lie.
    Relation(Relation),
}

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
        if arguments.witness.is_some() && (arguments.poses.is_some() || mode != Mode::Distance) {
            return wrong("--witness requires --mode distance and one pose, --pose instead of files");
        }
        let errors = DistanceOptions::new()
            .rel_err(arguments.rel_err.unwrap_or(0.0))
            .abs_err(arguments.abs_err.unwrap_or(0.0));
        let list = arguments.asking.json || arguments.poses.is_none();
        Ok(Self { mode, within: arguments.within.unwrap_or(0.0), errors, list })
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
            Mode::Collide => Answer::Collide(querier.collide(a, b, pose)?),
            Mode::Contacts if self.list => {
                let contacts = querier.contacts(a, b, pose)?;
                Answer::Contacts(contacts.len() as u64, contacts)
            }
            Mode::Contacts => {
                let count = querier.visit_contacts(a, b, pose, |_| ControlFlow::Continue(()))?;
                Answer::Contacts(count, Vec::new())
            }
            Mode::Distance => Answer::Distance(querier.distance_with(a, b, pose, &self.errors)?),
            Mode::Within => Answer::Within(querier.within(a, b, pose, self.within)?),
            Mode::Relation => Answer::Relation(querier.relation(a, b, pose)?),
        })
    }

    /// Returns an answer for a person, with the closest points and triangles or with the first contacts.
    pub(super) fn describe(&self, [mesh_a, mesh_b]: [&LoadedMesh; 2], answer: &Answer) -> String {
        match answer {
            Answer::Collide(true) => "the meshes touch\n".to_owned(),
            Answer::Collide(false) => "the meshes do not touch\n".to_owned(),
            Answer::Within(within) => {
                let how = if *within { "at most" } else { "more than" };
                format!("the meshes are {how} {:?} apart\n", self.within)
            }
            Answer::Contacts(count, contacts) => {
                let mut text = format!("{count} {} of triangles in contact\n", plural(*count, "pair"));
                for contact in contacts.iter().take(MAX_LISTED) {
                    let a = witness::name(mesh_a, contact.object_a, contact.triangle_a);
                    let b = witness::name(mesh_b, contact.object_b, contact.triangle_b);
                    text.push_str(&format!("  A: {a}  B: {b}\n"));
                }
                if contacts.len() > MAX_LISTED {
                    text.push_str(&format!("  and {} more\n", contacts.len() - MAX_LISTED));
                }
                text
            }
            Answer::Distance(distance) => witness::describe([mesh_a, mesh_b], distance),
            Answer::Relation(relation) => format!("{}\n", in_words(*relation)),
        }
    }
}

impl asking::Answer for Answer {
    /// Returns true for contact, for a yes to `within`, and if any part of a mesh is inside the other.
    fn is_positive(&self) -> bool {
        match self {
            Self::Distance(of) => of.distance <= 0.0,
            Self::Relation(relation) => !matches!(relation, Relation::Apart | Relation::Undefined),
            _ => self.value() > 0.0,
        }
    }

    fn value(&self) -> f64 {
        match self {
            Self::Collide(flag) | Self::Within(flag) => f64::from(u8::from(*flag)),
            Self::Contacts(count, _) => *count as f64,
            Self::Distance(of) => of.distance,
            Self::Relation(relation) => f64::from(*relation as u8),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Collide(flag) => json!({ "collide": flag }),
            Self::Within(flag) => json!({ "within": flag }),
            Self::Contacts(count, contacts) => {
                let pair = |of: &Contact| {
                    json!({
                        "object_a": of.object_a, "triangle_a": of.triangle_a, "object_b": of.object_b,
                        "triangle_b": of.triangle_b,
                    })
                };
                json!({ "contacts": count, "pairs": contacts.iter().map(pair).collect::<Vec<_>>() })
            }
            Self::Distance(distance) => asking::distance_json(distance),
            Self::Relation(relation) => json!({ "relation": *relation as u8 }),
        }
    }

    /// Hashes a byte for yes or no and for a relation, a `u64` for a count, the bits of a distance.
    fn hash(&self, hasher: &mut Hasher) {
        match self {
            Self::Collide(flag) | Self::Within(flag) => hasher.update(&[u8::from(*flag)]),
            Self::Contacts(count, _) => hasher.update(&count.to_le_bytes()),
            Self::Distance(of) => hasher.update(&of.distance.to_bits().to_le_bytes()),
            Self::Relation(relation) => hasher.update(&[*relation as u8]),
        }
    }
}

/// Returns a relation in words.
fn in_words(relation: Relation) -> &'static str {
    match relation {
        Relation::Touching => "touching",
        Relation::Apart => "apart",
        Relation::AInB => "A inside B",
        Relation::BInA => "B inside A",
        Relation::Mixed => "not touching, some parts inside the other mesh and some not",
        Relation::Undefined => "not touching, undefined because a mesh is not closed",
    }
}
