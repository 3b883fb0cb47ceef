//! What can go wrong when a robot is read and when a question is asked.

use bvh_bake::BakeError;
use bvh_query::{BackendError, OpenError, PoseError, QueryError};
use std::borrow::Cow;
use std::io;
use std::path::PathBuf;

/// Why there is no robot, or no answer about it.
///
/// ```
/// use cbvh_robot::RobotError;
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
/// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
/// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
/// #     robot.allow(a, b)?;
/// # }
/// assert!(matches!(robot.collide(&[0.0; 3]), Err(RobotError::Count { expected: 4, found: 3 })));
/// let unknown = robot.allow("hand", "foot").unwrap_err();
/// assert_eq!(
///     unknown.to_string(),
///     "expected the name of a body, found 'foot'; there are base, turret, upper_arm, forearm, hand"
/// );
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RobotError {
    /// The system refused a file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A description is too long.
    #[error("{}: expected at most {most} bytes, found more; leave out what is about neither links nor joints", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// The most bytes that it may have.
        most: u64,
    },
    /// A description is not what it should be.
    #[error("{}: {place}: expected {expected}, found {found}", path.display())]
    Description {
        /// The URDF or SRDF file.
        path: PathBuf,
        /// The element in question.
        place: String,
        /// What should be there.
        expected: Cow<'static, str>,
        /// What is there.
        found: String,
    },
    /// A mesh is in none of the places where it was looked for.
    #[error(
        "{}: link {link}: expected the mesh {uri}, found none at {}; give the folder that contains the package",
        path.display(), list(tried)
    )]
    NoMesh {
        /// The URDF file.
        path: PathBuf,
        /// The link.
        link: String,
        /// The mesh, as the file names it.
        uri: String,
        /// The places.
        tried: Vec<PathBuf>,
    },
    /// A mesh is in no folder in which the file may name meshes.
    #[error(
        "{}: link {link}: expected the mesh {uri} below {}, or in a package, found it at {}; give its folder as one of packages, \
         or set allow_outside",
        path.display(), list(folders), found.display()
    )]
    Outside {
        /// The URDF file.
        path: PathBuf,
        /// The link.
        link: String,
        /// The mesh, as the file names it.
        uri: String,
        /// The folders in which it may be.
        folders: Vec<PathBuf>,
        /// Where it is.
        found: PathBuf,
    },
    /// A mesh cannot be baked.
    #[error("{}: link {link}: {source}", path.display())]
    Mesh {
        /// The URDF file.
        path: PathBuf,
        /// The link.
        link: String,
        /// What is wrong with the mesh.
        source: Box<BakeError>,
    },
    /// A baked mesh in the cache is damaged.
    #[error("{source}; remove it, and it will be baked again")]
    Cache {
        /// What is wrong with the file.
        source: OpenError,
    },
    /// A name is of nothing that the robot has.
    #[error("expected the name of {what}, found '{name}'; there are {}", known.join(", "))]
    Unknown {
        /// What was looked for, with its article: a link or a body, for example.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// A name is taken.
    #[error(
        "expected a name of its own, found '{0}', which the robot has; remove that one first, or choose another name"
    )]
    Taken(String),
    /// Not as many numbers as the robot has joint values.
    #[error("expected {expected} joint values, in the order of `joints`, found {found}")]
    Count {
        /// The numbers of the robot.
        expected: usize,
        /// The numbers given.
        found: usize,
    },
    /// A joint value is not finite, or a quaternion is 0.
    #[error("joint {joint}: expected {expected}, found {found}")]
    Value {
        /// The joint.
        joint: String,
        /// What should be there.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A configuration or motion among many has invalid numbers.
    #[error("row {row}: {source}")]
    Row {
        /// Its number, from 0.
        row: usize,
        /// What is wrong with it.
        source: Box<Self>,
    },
    /// A pose is not rigid, or too far away.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// A number or a shape was refused.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// The query about two bodies has no answer.
    #[error("{a} and {b}: {source}")]
    Pair {
        /// The body that comes first.
        a: String,
        /// The other body.
        b: String,
        /// Why there is none.
        source: QueryError,
    },
    /// A body cannot be a solid.
    #[error("{body}: {source}")]
    NotSolid {
        /// The body.
        body: String,
        /// Why not.
        source: QueryError,
    },
    /// `CBVH_ISA` names no backend that there is.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

impl RobotError {
    /// Names the row, if its numbers are to blame.
    pub(crate) fn in_row(self, row: usize) -> Self {
        match self {
            Self::Count { .. } | Self::Value { .. } | Self::Pose(_) => {
                Self::Row { row, source: Box::new(self) }
            }
            other => other,
        }
    }
}

/// Joins paths with commas.
fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
