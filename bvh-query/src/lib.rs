//! Exact collision and distance queries between `.cbvh` meshes.
//!
//! [`Bvh`] opens a file (mapped, read, in memory, or embedded with [`include_cbvh!`]), [`Pose`] places one mesh in the
//! frame of another, and a [`Querier`] computes:
//!
//! | task | method | result |
//! |---|---|---|
//! | do they touch? | [`Querier::collide`] | `bool`, exact |
//! | which triangles touch? | [`Querier::contacts`], [`Querier::visit_contacts`] | pairs of triangle ids, exact |
//! | where do they meet? | [`Querier::contact_regions`] | points, segments, polygons and normals, with certified errors |
//! | how do they push each other? | [`Querier::patches`] | connected contacts: centre, normal, length, area, depth (estimated), contact points |
//! | which triangles of one mesh meet where they should not? | [`Querier::self_contacts`], [`Querier::visit_self_contacts`] | pairs of triangle ids, exact |
//! | how far apart are they? | [`Querier::distance`] | distance, both closest points, both triangle ids |
//! | are they at most d apart? | [`Querier::within`] | `bool`, exact |
//! | where is the closest surface to a point? | [`Querier::closest_point`] | distance, point, triangle id |
//! | is a point inside, and how deep? | [`Querier::side`], [`Querier::signed_point_distance`] | inside, on, outside; exact |
//! | what does a ray hit? | [`Querier::first_hit`], [`Querier::any_hit`], [`Querier::all_hits`] | parameter, point, triangle id; exact order |
//! | is the line between two points free? | [`Querier::segment_hit`], [`Querier::visible`] | `bool`, exact |
//! | how far apart are they or, below zero, how deep do they overlap? | [`Querier::signed_distance`] | certified bounds, points, the way out |
//! | which are near, and how far apart? | [`Querier::signed_distance_within`], [`Scene::near_pairs`] | signed distances of what is within a margin |
//! | how much do they have in common? | [`Querier::intersection`] | volume with a certified error, areas, box, thickness of what is pierced |
//! | how deep do they overlap? | [`Querier::penetration`], [`Querier::separation`] | certified bounds, and a translation that ends it |
//! | are they near, touching, overlapping? | [`Querier::clash`], [`Scene::clashes`] | class, distance, depth |
//! | do they touch, or is one inside the other? | [`Querier::relation`] | touching, apart, inside, mixed; exact |
//! | is a motion free, and where does it end? | [`Querier::motion`], [`Querier::is_free`] | free, hit or near, certain at every moment |
//!
//! [`Scene`] runs these queries on many placed shapes, over all pairs that matter, except for contact regions,
//! patches, self contacts, penetrations and separations, which a [`Querier`] computes pair by pair. [`Tracker`] computes
//! whether two meshes touch, how far apart they are and whether they are within a distance in less time, for poses that
//! follow a path. [`Batch`] uses all cores for many poses, and [`ProbeBatch`] for many points, rays and segments.
//! Batches, and scenes on all cores, need the feature `parallel`, which is on by default and adds the dependency on
//! rayon. The feature `mint` converts matrices and quaternions of other crates to a [`Pose`], and the feature `serde`
//! serialises poses and answers, and reads them again, except for those about scenes, which name instances of one
//! scene. Features whose names begin with `__` are not part of the public interface. Points, rays and segments are
//! given in the frame of a mesh or, for a mesh that [`Shape::at`] places in the world, in the world. Each kind of
//! operation has an error of its own, and all of them convert into [`Error`].
//!
//! A query about two meshes walks both trees together, and one about a point or a line walks one tree. Nodes and triangles
//! are filtered in `f32`, 16 at a time, by AVX-512, AVX2, NEON, SIMD128 or portable code. What the filters cannot decide
//! goes to `f64` and exact predicates. So the answers have the same bits on every backend and in every order of queries.
//!
//! # Debug builds
//! Without optimisation, queries are about a hundred times slower: a program that takes 0.18 seconds with these lines in the
//! `Cargo.toml` of its workspace takes 22 seconds without them. Do likewise for `bvh-bake` and `bvh-format`, or use `"*"`.
//!
//! ```toml
//! [profile.dev.package.bvh-query]
//! opt-level = 3
//! ```
//!
//! # Examples
//! The folder `examples` of this crate has programs to start from. Each runs without arguments from the root of the
//! workspace:
//!
//! - `cargo run --release --example collide`: whether two meshes touch in one pose, and how far apart they are.
//! - `cargo run --release --example path`: a path of poses, with a [`Tracker`] and with a [`Batch`].
//! - `cargo run --release --example planner`: a path through an environment, each edge of which is certified to be
//!   free.
//! - `cargo run --release --example shared`: a mesh in memory, shared between threads.
//!
//! In short:
//!
//! ```
//! use bvh_query::{Bvh, Pose, Querier};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
//! let (bytes, _) = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?;
//! let triangle = Bvh::from_bytes(bytes)?;
//!
//! let mut querier = Querier::new()?;
//! let above = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 0.5])?;
//! assert!(!querier.collide(&triangle, &triangle, &above)?);
//! assert_eq!(querier.distance(&triangle, &triangle, &above)?.distance, 0.5);
//! assert!(querier.collide(&triangle, &triangle, &Pose::IDENTITY)?);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

mod error;
mod file;
mod isa;
mod leaf;
mod motion;
mod narrow;
mod numerics;
mod pose;
mod query;
mod scene;
mod traverse;

pub use error::{FileChange, NumberError, OpenError, QueryError};
pub use file::bvh::Bvh;
pub use file::files::{Files, SceneShape};
pub use file::mapped::ReadAhead;
pub use file::owned_shape::OwnedShape;
pub use file::shape::Shape;
/// For the bindings alone: programs in other languages may compute in another state than Rust does.
#[doc(hidden)]
pub use isa::floats;
pub use isa::{Backend, BackendError};
pub use motion::{Motion, Polyline, RelativePath, RigidPath};
pub use narrow::SelfContactKind;
pub use pose::{Pose, PoseError};
#[cfg(feature = "parallel")]
pub use query::batch::Batch;
pub use query::contacts::Contact;
pub use query::depth::clash::{Clash, ClashClass, ClashOptions};
pub use query::depth::options::PenetrationOptions;
pub use query::depth::penetration::{Penetration, Separation};
pub use query::depth::signed_distance::SignedDistance;
pub use query::displacement::displacement;
pub use query::distance::Distance;
pub use query::intersection::{Intersection, IntersectionSurface};
pub use query::motion::{MotionAnswer, MotionOptions, path_reach};
pub use query::options::DistanceOptions;
pub use query::patches::choice::PatchPoint;
pub use query::patches::{Patch, PatchOptions, Patches};
pub use query::probe::closest::ClosestPoint;
pub use query::probe::placed::PlacedShape;
#[cfg(feature = "parallel")]
pub use query::probe::probe_batch::ProbeBatch;
pub use query::probe::ray::{Ray, RayHit};
pub use query::probe::relation::Relation;
pub use query::probe::side::{Side, SignedPointDistance};
pub use query::querier::Querier;
pub use query::regions::{ContactRegion, ContactRegions, RegionKind};
pub use query::self_contacts::SelfContact;
pub use query::stats::QueryStats;
pub use query::tracker::Tracker;
pub use scene::{
    Groups, InstanceId, InstanceLabel, Scene, SceneClash, SceneClosestPoint, SceneContact, SceneDistance,
    SceneError, SceneMotionAnswer, ScenePair, SceneRayHit, SceneSignedDistance,
};

/// Embeds a `.cbvh` file into the program and opens it: `Result<Bvh, FormatError>`.
///
/// The path is written as for `include_bytes!`. For a file that a build script baked, it is
/// `concat!(env!("OUT_DIR"), "/name.cbvh")`. The file starts at a cache line, so that queries read plain triangles in
/// place.
///
/// ```
/// use bvh_query::{Bvh, include_cbvh};
///
/// let bvh: Bvh = include_cbvh!(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-scene.cbvh"))?;
/// assert!(!bvh.objects().is_empty());
/// # Ok::<(), bvh_query::FormatError>(())
/// ```
#[macro_export]
macro_rules! include_cbvh {
    ($path:expr $(,)?) => {
        $crate::Bvh::from_static({
            static FILE: &$crate::Embedded<[u8]> = &$crate::Embedded(*::core::include_bytes!($path));
            &FILE.0
        })
    };
}

/// The bytes of [`include_cbvh!`], at the start of a cache line: those of `include_bytes!` may start anywhere.
#[doc(hidden)]
#[repr(C, align(64))]
#[derive(Debug)]
pub struct Embedded<B: ?Sized>(pub B);

/// The nodes and packets that a query visits, for the page of `cbvh view` alone.
#[doc(hidden)]
#[cfg(feature = "__trace")]
pub mod trace {
    pub use crate::traverse::trace::{Step, record};
}

pub use bvh_format::leaf::TriangleEncoding;
pub use bvh_format::object::Object;
pub use bvh_format::open_edges::{EdgesOfKind, Gaps, OpenEdge, OpenEdges};
pub use bvh_format::profile::Profile;
pub use bvh_format::{FormatError, Layout, Rule, Stop};

/// Any error of this crate: each operation has an error of its own, and `?` turns all of them into this one.
///
/// ```
/// use bvh_query::{Bvh, Error, Pose, Querier};
///
/// fn touch(room: &str, robot: &str, robot_in_room: &[f64; 12]) -> Result<bool, Error> {
///     let (room, robot) = (Bvh::read(room)?, Bvh::read(robot)?);
///     Ok(Querier::new()?.collide(&room, &robot, &Pose::from_rows(robot_in_room)?)?)
/// }
/// assert!(matches!(touch("nowhere.cbvh", "nowhere.cbvh", &[0.0; 12]), Err(Error::Open(_))));
/// ```
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be opened.
    Open(#[from] OpenError),
    /// Bytes in memory are no valid `.cbvh` file.
    Format(#[from] FormatError),
    /// A backend is not available.
    Backend(#[from] BackendError),
    /// Numbers make no pose, or poses or numbers make no path.
    Pose(#[from] PoseError),
    /// A query about meshes has no result.
    Query(#[from] QueryError),
    /// A file makes no scene, a scene refuses an instance or does not have it, or a query about it has no result.
    Scene(#[from] SceneError),
}

/// Compiles the examples of the crate's README, some of which use all cores.
#[cfg(all(doctest, feature = "parallel"))]
#[doc = include_str!("../README.md")]
struct Readme;
