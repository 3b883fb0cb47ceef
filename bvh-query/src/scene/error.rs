//! Why a scene cannot be opened or refuses an instance, or a question over it has no answer.

use crate::error::{OpenError, QueryError};
use crate::scene::instance::InstanceId;
use std::path::PathBuf;

/// Why a scene file cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenSceneError {
    /// The file cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The file is valid, but it is no scene that can be asked.
    #[error("{}: {source}", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<SceneError>,
    },
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
        /// The name or the identifier of the instance.
        instance: String,
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
        /// The name or the identifier of A.
        a: String,
        /// The name or the identifier of B.
        b: String,
        /// Why.
        source: QueryError,
    },
    /// The question about an instance has no answer.
    #[error("instance {instance}: {source}")]
    Instance {
        /// The name or the identifier of the instance.
        instance: String,
        /// Why.
        source: QueryError,
    },
    /// The question as a whole has no answer.
    #[error(transparent)]
    Query(#[from] QueryError),
}
