//! Why there is no page.

use crate::MAX_FILE_BYTES;
use bvh_query::{PoseError, QueryError, SceneError};
use cbvh_robot::RobotError;

/// Why a page cannot be made.
///
/// ```
/// use bvh_query::Pose;
/// use cbvh_view::{Named, Page, PageError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let named = Named { name: "block".into(), path: "block.cbvh".into(), shape: block.into() };
/// let page = Page::pair(named.clone(), None, &Pose::IDENTITY, Some(-1.0));
/// assert!(matches!(page, Err(PageError::Number { name: "within", found: -1.0, .. })));
/// assert!(matches!(Page::file(named)?.limited_to(100), Err(PageError::TooLarge { limit: 100, .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// The files of the page are larger than the caller allows.
    #[error(
        "expected at most {limit} bytes of files in a page, found {found}, of which a browser needs several times the memory"
    )]
    TooLarge {
        /// The bytes of all files, and of the numbers of all frames.
        found: u64,
        /// What the caller allows.
        limit: u64,
    },
    /// A file is larger than any page can hold.
    #[error(
        "{name}: expected at most {MAX_FILE_BYTES} bytes, found {found}; browsers have no longer strings"
    )]
    FileTooLarge {
        /// The name of the file.
        name: String,
        /// Its bytes.
        found: u64,
    },
    /// A number is not finite, or is a length below 0.
    #[error("{name}: expected {expected}, found {found}")]
    Number {
        /// What the number is.
        name: &'static str,
        /// What it should be.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A pair or a clash names an instance that is not there.
    #[error("expected the number of an instance below {count}, found {found}")]
    Instance {
        /// The number of instances.
        count: usize,
        /// The number.
        found: usize,
    },
    /// A frame has the poses of too few or too many instances.
    #[error("frame {frame}: expected the poses of {expected} moving instances, found {found}")]
    Frame {
        /// The number of the frame, from 1.
        frame: usize,
        /// The number of moving instances.
        expected: usize,
        /// The number of poses.
        found: usize,
    },
    /// No motion leads from one pose to the other.
    #[error("motion: {0}")]
    Motion(#[from] PoseError),
    /// The file of a shape is not there, or has changed.
    #[error(transparent)]
    Shape(#[from] QueryError),
    /// An instance is not in its scene.
    #[error(transparent)]
    NotInScene(#[from] SceneError),
    /// A configuration is not one of the robot, or puts a link too far away.
    #[error(transparent)]
    Robot(#[from] RobotError),
}
