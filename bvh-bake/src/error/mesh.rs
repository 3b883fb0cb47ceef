//! The ways in which a mesh breaks the input contract, whether it comes from a file or from memory.

use crate::limits::{MAX_TRIANGLES, MAX_VERTICES};

/// The way in which a mesh breaks the input contract.
///
/// ```
/// use bvh_bake::mesh::{InputError, Mesh};
///
/// let two_corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
/// let found = Mesh::from_triangles(two_corners, vec![[0, 1, 2]]).check();
/// assert!(matches!(found, Err(InputError::Index { triangle: 0, vertices: 2, found: 2, .. })));
/// assert_eq!(Mesh::default().check(), Err(InputError::Empty));
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// There is nothing to bake.
    #[error("expected at least one triangle, found none")]
    Empty,
    /// The mesh has more triangles than there are ids.
    #[error("expected at most {MAX_TRIANGLES} triangles, found {0}")]
    TooManyTriangles(u64),
    /// The mesh has more vertices than there are vertex numbers.
    #[error("expected at most {MAX_VERTICES} vertices, found {0}")]
    TooManyVertices(u64),
    /// The mesh has more instances than there are numbers for them.
    #[error("expected at most 2^32 - 1 instances, found {0}")]
    TooManyInstances(u64),
    /// An instance that a scene cannot have.
    #[error("instance {number} \"{name}\": expected {expected}, found {found}")]
    Instance {
        /// The instance's place in the list.
        number: usize,
        /// Its name, shortened.
        name: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The ids of an object do not match its triangles.
    #[error(
        "object \"{object}\": expected an id for each of {triangles} triangles, ascending, found {found}"
    )]
    Ids {
        /// The object's name, shortened.
        object: String,
        /// Its triangles.
        triangles: usize,
        /// The defect of the ids.
        found: String,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error(
        "object \"{object}\", triangle {triangle}: expected vertex numbers below {vertices}, found {found}"
    )]
    Index {
        /// The object's name, shortened.
        object: String,
        /// The triangle's id.
        triangle: u32,
        /// The number of vertices in the object.
        vertices: usize,
        /// The number found.
        found: u32,
    },
    /// A vertex that a triangle uses has a coordinate outside what the format stores.
    #[error(
        "object \"{object}\", triangle {triangle}, vertex {vertex}: expected finite coordinates of at most \
         2^120 in magnitude, found {found:e}"
    )]
    Coordinate {
        /// The object's name, shortened.
        object: String,
        /// The triangle's id.
        triangle: u32,
        /// The vertex's place in the object.
        vertex: u32,
        /// The coordinate.
        found: f64,
    },
}

impl InputError {
    /// Returns whether the mesh is too large, rather than malformed.
    pub fn is_limit(&self) -> bool {
        matches!(
            self,
            InputError::TooManyTriangles(_)
                | InputError::TooManyVertices(_)
                | InputError::TooManyInstances(_)
        )
    }
}
