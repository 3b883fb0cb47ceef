//! What can go wrong when a file is opened and when a question is asked.

use bvh_format::open_edges::OpenEdges;
use bvh_format::{FormatError, Rule};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

/// Why a file cannot be opened.
///
/// ```
/// use bvh_query::{Bvh, OpenError};
///
/// match Bvh::read("nowhere.cbvh") {
///     Err(OpenError::Io { path, source }) => println!("{}: {source}", path.display()),
///     Err(OpenError::Format { source, .. }) => panic!("rule {} is broken", source.rule),
///     opened => panic!("{opened:?}"),
/// }
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system refused the file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file is not a valid `.cbvh` file.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The rule that is broken, and where.
        source: FormatError,
    },
}

/// Why a query has no answer. Geometry is never the reason: it is a damaged file, a budget, a stop or an invalid number.
///
/// ```
/// use bvh_query::{Pose, Querier, QueryError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut querier = Querier::new()?;
/// querier.set_budget(1);
/// let found = querier.distance(&block, &block, &Pose::IDENTITY);
/// assert_eq!(found, Err(QueryError::Budget { visits: 1 }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QueryError {
    /// A page that the query touched breaks a rule of the format.
    #[error(transparent)]
    Damaged(#[from] FormatError),
    /// The query needs more visits than [`crate::Querier::set_budget`] allows. Nothing is known of its answer.
    #[error("expected an answer within {visits} visits, found more to visit; raise the budget")]
    Budget {
        /// The budget.
        visits: u64,
    },
    /// The flag of [`crate::Querier::set_stop`] was set before there was an answer. Nothing is known of it.
    #[error("expected time for an answer, found the query stopped: its flag is set, or its time is over")]
    Stopped,
    /// A number given with the query is invalid, such as a distance of NaN.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// A file that [`crate::Files`] opens at first need is no longer what it was when its header was read.
    #[error("{}: expected the file as it was when it was added, found {found}; bring it back, or add what is there now", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What became of it.
        found: FileChange,
    },
    /// The file does not state which of its objects are closed.
    #[error("this file does not say which objects are closed; bake it again with topology")]
    NoTopology,
    /// The query is about the inside of a shape, and this object of its file is not closed.
    #[error(
        "expected closed objects, found object {object} open: {}; repair the mesh, or query its surface",
        explained(edges)
    )]
    NotClosed {
        /// The object.
        object: usize,
        /// Its open edges. `None` if it is damaged, or if it has more than 2^20 triangles or so many open edges that counting them takes more
        /// than 16 MiB: then [`Bvh::open_edges`](crate::Bvh::open_edges) counts them.
        edges: Option<Arc<OpenEdges>>,
    },
}

/// Returns why an object is open.
fn explained(edges: &Option<Arc<OpenEdges>>) -> String {
    edges.as_ref().map_or_else(|| "cbvh validate counts its open edges".to_owned(), |edges| edges.to_string())
}

/// An invalid number, by the parameter that it was given for.
///
/// ```
/// use bvh_query::{NumberError, Pose, Querier, QueryError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let found = Querier::new()?.within(&block, &block, &Pose::IDENTITY, -1.0);
/// assert_eq!(found, Err(QueryError::Number(NumberError::Distance(-1.0))));
/// assert!(found.unwrap_err().to_string().starts_with("d: expected a finite distance of at least 0, found -1"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NumberError {
    /// There is no object of this number.
    #[error("object: expected the number of an object of the file, found {0}")]
    Object(usize),
    /// A coordinate of a point.
    #[error("point: expected finite coordinates of at most 2^120, found {0}")]
    Point(f64),
    /// The largest component of a direction.
    #[error(
        "direction: expected numbers the largest of which is from 2^-500 to 2^500 in magnitude, found {0}"
    )]
    Direction(f64),
    /// The parameter at which a ray ends.
    #[error("until: expected a number of at least 0, or infinity, found {0}")]
    Until(f64),
    /// The limit of a search for a closest point.
    #[error("within: expected a distance of at least 0, or infinity, found {0}")]
    Within(f64),
    /// The radius of a shape, or a margin.
    #[error("radius: expected a length from 0 to 2^118, found {0}")]
    Radius(f64),
    /// The distance to compare with.
    #[error("d: expected a finite distance of at least 0, found {0}")]
    Distance(f64),
    /// The distance up to which two shapes are near.
    #[error("margin: expected a finite distance of at least 0, found {0}")]
    Margin(f64),
    /// The relative error of a distance.
    #[error("rel_err: expected a finite fraction of at least 0, found {0}")]
    RelErr(f64),
    /// The absolute error of a distance.
    #[error("abs_err: expected a finite length of at least 0, found {0}")]
    AbsErr(f64),
    /// The clearance of a motion or of a clash.
    #[error("clearance: expected a finite length of at least 0, found {0}")]
    Clearance(f64),
    /// The tolerance of a motion.
    #[error("tolerance: expected a finite length above 0, found {0}")]
    Tolerance(f64),
    /// The tolerance of a depth.
    #[error("tolerance: expected a finite depth of at least 0, found {0}")]
    DepthTolerance(f64),
    /// The gap between the bounds of a depth at which a search ends.
    #[error("relative_gap: expected a finite part above 0, found {0}")]
    RelativeGap(f64),
    /// The tolerance with which contacts are joined into patches.
    #[error("tolerance: expected a finite length of at least 0, found {0}")]
    PatchTolerance(f64),
    /// A tolerance, given or by default, that the poses of a path do not resolve.
    #[error(
        "tolerance: expected more than B moves in 2^-45 of the time, and than its poses are rounded by, found {0}"
    )]
    Unresolved(f64),
}

/// What became of a file after its header was read.
///
/// ```
/// use bvh_query::{FileChange, Files, Pose, QueryError, Scene, SceneError};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// # let path = std::env::temp_dir().join(format!("cbvh-file-change-{}.cbvh", std::process::id()));
/// # std::fs::write(&path, block.bytes())?;
/// let shape = Files::new(8).shape(&path)?; // reads the header and closes the file
/// std::fs::remove_file(&path)?;
/// let mut scene = Scene::new()?;
/// scene.add(shape.clone(), Pose::IDENTITY)?;
/// scene.add(shape, Pose::IDENTITY)?;
/// let Err(SceneError::Pair { source: QueryError::File { found, .. }, .. }) = scene.collide() else { panic!() };
/// assert_eq!(found, FileChange::Unreadable(std::io::ErrorKind::NotFound));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FileChange {
    /// The system refuses it.
    #[error("a file that cannot be read ({0})")]
    Unreadable(io::ErrorKind),
    /// It breaks a rule of the format.
    #[error("a breach of {0}")]
    Damaged(Rule),
    /// It is another file.
    #[error("other contents")]
    Replaced,
}
