//! Why a scene cannot be made or refuses an instance, or a question over it has no answer.

use crate::error::QueryError;
use crate::isa::BackendError;
use crate::pose::PoseError;
use crate::scene::instance::InstanceId;
use std::fmt;

/// The instance that an error is about. It is shown by its name or, without one, by its identifier.
///
/// ```
/// use bvh_query::{Pose, Scene, SceneError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut scene = Scene::new()?;
/// let too_far = Pose::new(*Pose::IDENTITY.rotation(), [1e36, 0.0, 0.0])?;
/// let Err(SceneError::Pose { instance, .. }) = scene.add_named("crate", block, too_far) else { panic!() };
/// assert_eq!((instance.name.as_deref(), instance.to_string()), (Some("crate"), "crate".to_owned()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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

/// Why a file makes no scene, why a scene refuses an instance or a change of it, or why a query about it has no answer.
///
/// ```
/// use bvh_query::{Pose, Scene, SceneError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut scene = Scene::new()?;
/// let id = scene.add_named("crate", block.clone(), Pose::IDENTITY)?;
/// let again = scene.add_named("crate", block, Pose::IDENTITY);
/// assert_eq!(again, Err(SceneError::NameTaken("crate".to_owned())));
/// scene.remove(id)?;
/// assert_eq!(scene.pose(id), Err(SceneError::NoInstance(id)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The query about a pair has no answer.
    #[error("instances {a} and {b}: {source}")]
    Pair {
        /// The instance A.
        a: InstanceLabel,
        /// The instance B.
        b: InstanceLabel,
        /// Why.
        source: QueryError,
    },
    /// The query about an instance has no answer.
    #[error("instance {instance}: {source}")]
    Instance {
        /// The instance.
        instance: InstanceLabel,
        /// Why.
        source: QueryError,
    },
    /// The query as a whole has no answer, or what a file says of its instances breaks a rule of the format.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// A file without instances: it says nothing of a world.
    #[error(
        "expected a scene, a file with instances, found none; add its objects to a scene, or bake it as one"
    )]
    NoInstances,
    /// `CBVH_ISA` names no backend, or one that the CPU lacks.
    #[error(transparent)]
    Backend(#[from] BackendError),
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
        source: PoseError,
    },
}
