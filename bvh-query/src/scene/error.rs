//! Why a scene cannot be made or refuses an instance, or a question over it has no answer.

use crate::error::QueryError;
use crate::isa::BackendError;
use crate::scene::instance::InstanceId;
use bvh_format::FormatError;
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

/// Why a file makes no scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneFileError {
    /// A file without instances: it says nothing of a world.
    #[error(
        "expected a scene, a file with instances, found none; add its objects to a scene, or bake it as one"
    )]
    NoInstances,
    /// What the file says of its instances breaks a rule of the format.
    #[error(transparent)]
    Damaged(#[from] FormatError),
    /// `CBVH_ISA` names no backend, or one that the CPU lacks.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// Why a scene refuses an instance or a change of it, or has nothing to tell of it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InstanceError {
    /// The scene never had this instance, or it has been removed.
    #[error("instance {0}: expected an instance of the scene, found none; was it removed?")]
    NoInstance(InstanceId),
    /// Another instance has this name.
    #[error("instance {0:?}: expected a name of its own, found it taken")]
    NameTaken(String),
    /// A margin that is no length.
    #[error("margin: expected a length from 0 to 2^118, found {0}")]
    Margin(f64),
    /// A parent that is the child itself or moves with it.
    #[error("instance {child}: expected a parent that does not move with it, found {parent}")]
    Cycle {
        /// The instance to attach.
        child: InstanceLabel,
        /// What it was to be attached to.
        parent: InstanceLabel,
    },
    /// A pose with which a pair of instances may have no relative pose.
    #[error("instance {instance}: {source}")]
    Pose {
        /// The instance.
        instance: InstanceLabel,
        /// What is wrong with the pose.
        source: WorldPoseError,
    },
}

/// Why a pose is none that an instance of a scene may have.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldPoseError {
    /// The translation along an axis.
    #[error("expected a translation of at most 2^118 along each axis, nearer to the origin, found {0:e}")]
    TooFar(f64),
    /// The largest entry of `R R^T - I`. [`Pose::nearest`](crate::Pose::nearest) orthonormalises a rounded rotation.
    #[error(
        "expected a rotation within 2^-23 of orthonormal, with more digits or orthonormalised, found {0:e}"
    )]
    NotRigid(f64),
}

/// Why a question about a scene has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
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
    /// The scene does not have the instance of a path, or refuses where the path starts or ends.
    #[error(transparent)]
    Refused(#[from] InstanceError),
}
