//! Why a scene cannot be made or refuses an instance, or a question over it has no answer.

use crate::error::QueryError;
use crate::scene::instance::InstanceId;
use std::fmt;

/// The instance that an error is about. It is shown by its name or, without one, by its identifier.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InstanceLabel {
    /// The identifier; for an instance that was refused, the one that it would have had.
    pub id: InstanceId,
    /// The name, if the instance has one.
    pub name: Option<Box<str>>,
}

impl fmt::Display for InstanceLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => f.write_str(name),
            None => self.id.fmt(f),
        }
    }
}

/// Why a scene refuses an instance, or a question has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The scene never had this instance, or it has been removed.
    #[error("instance {0}: expected an instance of the scene, found none; was it removed?")]
    NoInstance(InstanceId),
    /// Another instance has this name.
    #[error("instance {0:?}: expected a name of its own, found it taken")]
    NameTaken(String),
    /// A pose with which a pair of instances may have no relative pose. [`Pose::nearest`](crate::Pose::nearest)
    /// orthonormalises a rounded rotation.
    #[error("instance {instance}: expected {what}, found {found:e}")]
    Pose {
        /// The instance.
        instance: InstanceLabel,
        /// What was expected.
        what: &'static str,
        /// The entry of `R R^T - I`, or the translation.
        found: f64,
    },
    /// A file without instances: it says nothing of a world.
    #[error(
        "expected a scene, a file with instances, found none; bake it with --scene, or add its objects to a scene"
    )]
    NoInstances,
    /// The question about a pair has no answer.
    #[error("instances {a} and {b}: {source}")]
    Pair {
        /// The instance A.
        a: InstanceLabel,
        /// The instance B.
        b: InstanceLabel,
        /// Why.
        source: QueryError,
    },
    /// The question about an instance has no answer.
    #[error("instance {instance}: {source}")]
    Instance {
        /// The instance.
        instance: InstanceLabel,
        /// Why.
        source: QueryError,
    },
    /// The question as a whole has no answer.
    #[error(transparent)]
    Query(#[from] QueryError),
}
