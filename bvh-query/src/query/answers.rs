//! The types of answers.

pub use crate::narrow::SelfContactKind;

/// A pair of triangles in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Contact {
    /// The number that the object of A has in its file.
    pub object_a: u32,
    /// The triangle of A: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle_a: u32,
    /// The number that the object of B has in its file.
    pub object_b: u32,
    /// The triangle of B.
    pub triangle_b: u32,
}

/// Two triangles of one mesh that meet where they should not: see [`Querier::self_contacts`](crate::Querier::self_contacts).
/// The object and the triangle of A are before those of B.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SelfContact {
    /// The number that the object of the first triangle has in the file.
    pub object_a: u32,
    /// The first triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle_a: u32,
    /// The number that the object of the second triangle has in the file.
    pub object_b: u32,
    /// The second triangle.
    pub triangle_b: u32,
    /// How they meet.
    pub kind: SelfContactKind,
}

/// The least distance of two shapes. For shapes with radii, `triangle_a` and `triangle_b` are those of the cores, and the points
/// are on the rounded surfaces; where the shapes touch, both are one common point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Distance {
    /// The distance in mesh units; 0 if and only if the meshes touch.
    pub distance: f64,
    /// A certified lower bound: the two triangles named here are at least this far apart. If the query allowed an
    /// error, no two triangles of the meshes are nearer. Exact arithmetic, not this bound, decides whether the meshes
    /// touch.
    pub lower: f64,
    /// A certified upper bound: the two triangles, and so the meshes, are at most this far apart.
    pub upper: f64,
    /// The closest point on A, in A's frame.
    pub point_a: [f64; 3],
    /// The closest point on B, in A's frame.
    pub point_b: [f64; 3],
    /// The number that the object of A has in its file.
    pub object_a: u32,
    /// The triangle of A with the closest point: its number in the input.
    pub triangle_a: u32,
    /// The number that the object of B has in its file.
    pub object_b: u32,
    /// The triangle of B with the closest point.
    pub triangle_b: u32,
}

/// The closest point of a mesh to a given one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ClosestPoint {
    /// The distance in mesh units; 0 if and only if the given point is on the mesh.
    pub distance: f64,
    /// The mesh is certainly at least this far away.
    pub lower: f64,
    /// The mesh is certainly at most this far away.
    pub upper: f64,
    /// The closest point, in the mesh's frame.
    pub point: [f64; 3],
    /// The number that its object has in the file.
    pub object: u32,
    /// Its triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle: u32,
}

/// Where a ray hits a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RayHit {
    /// The parameter, in units of the ray's direction; 0 if and only if the ray's origin is on the mesh. Its relative
    /// error is at most 2^-43.
    pub t: f64,
    /// The exact parameter is at least this.
    pub lower: f64,
    /// The exact parameter is at most this.
    pub upper: f64,
    /// The point, in the frame of the ray.
    pub point: [f64; 3],
    /// The number that its object has in the file.
    pub object: u32,
    /// Its triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle: u32,
}

/// How two meshes lie. The command and the bindings of other languages use its numbers: `relation as u8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Relation {
    /// Their surfaces have a point in common: [`Querier::collide`](crate::Querier::collide) is true.
    Touching = 0,
    /// They have nothing in common, insides included.
    Apart = 1,
    /// All of A is inside B.
    AInB = 2,
    /// All of B is inside A.
    BInA = 3,
    /// Some connected components are inside the other mesh and some are not, or some of each mesh are.
    Mixed = 4,
    /// The answer depends on the inside of a mesh that is not closed.
    Undefined = 5,
}

/// On which side of a mesh a point is. The command and the bindings of other languages use its numbers: `side as i8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(i8)]
pub enum Side {
    /// The point is neither on the surface nor inside.
    Outside = -1,
    /// The point is on the surface.
    On = 0,
    /// The surface winds around the point.
    Inside = 1,
    /// The point is not on the surface, and the mesh has no inside, because it is not closed and consistently oriented.
    Undefined = 2,
}

/// The distance of a point from the surface of a mesh, and the side that it is on. Inside overlapping parts of one mesh, the
/// closest surface may be a face between them: see [`Querier::signed_distance`](crate::Querier::signed_distance).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SignedDistance {
    /// The side of the point.
    pub side: Side,
    /// The closest point of the surface.
    pub closest: ClosestPoint,
}

impl SignedDistance {
    /// Returns the distance in mesh units, negative inside, or `None` if the mesh has no inside.
    pub fn value(&self) -> Option<f64> {
        match self.side {
            Side::Inside => Some(-self.closest.distance),
            Side::On | Side::Outside => Some(self.closest.distance),
            Side::Undefined => None,
        }
    }
}

/// The work of the last query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct QueryStats {
    /// Tests of up to 16 pairs of nodes each.
    pub node_tests: u64,
    /// Pairs of leaf packets tested, with up to 16 pairs of triangles each.
    pub packet_tests: u64,
    /// Pairs of triangles that went to exact arithmetic.
    pub exact_tests: u64,
}

impl QueryStats {
    /// Adds what a traversal did.
    pub(crate) fn add(&mut self, node_tests: u64, other: Self) {
        self.node_tests += node_tests;
        self.packet_tests += other.packet_tests;
        self.exact_tests += other.exact_tests;
    }
}
