//! The structures and numbers that the header declares, and what they are made from.
//!
//! Structures have no bytes that are not part of a field, so that answers can be compared as bytes.
//! `tests/header.py` compares sizes, offsets and numbers with those that a C compiler sees.

use crate::input::{Options, Plain};
use crate::status::Failure;
use bvh_query::{
    Backend, ClosestPoint, Contact, Distance, DistanceOptions, InstanceId, MotionAnswer, MotionOptions, Pose,
    QueryStats, Ray, RayHit, Relation, SceneClosestPoint, SceneContact, SceneDistance, SceneMotionAnswer,
    ScenePair, SceneRayHit, Side, SignedDistance,
};
use std::ffi::c_char;

macro_rules! handles {
    ($($name:ident),*) => { $(
        /// A handle: see the header.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[repr(C)]
        pub struct $name {
            pub(crate) id: u64,
        }
        // SAFETY: a number.
        unsafe impl Plain for $name {}
    )* };
}
handles!(MeshHandle, QuerierHandle, TrackerHandle, PathHandle, SceneHandle, Instance);

/// Makes the row of an answer, which has the fields of the first list, and `NONE`, the row where there is no answer. A
/// field of the second list has a value of its own, and another one after `=>` where there is an answer.
macro_rules! row {
    ($row:ident from $answer:ident { $($field:ident: $none:expr),* }
        and { $($other:ident: $without:expr $(=> $with:expr)?),* }) => {
        impl $row {
            const NONE: Self = Self { $($field: $none,)* $($other: $without),* };
        }

        impl From<$answer> for $row {
            fn from(of: $answer) -> Self {
                Self { $($field: of.$field,)* $($other: row!($without $(=> $with)?)),* }
            }
        }
    };
    ($without:expr => $with:expr) => { $with };
    ($without:expr) => { $without };
}

/// `cbvh_pose`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct PoseRows {
    pub(crate) rows: [f64; 12],
}
// SAFETY: numbers.
unsafe impl Plain for PoseRows {}

impl From<&Pose> for PoseRows {
    fn from(pose: &Pose) -> Self {
        let ([x, y, z], [tx, ty, tz]) = (*pose.rotation(), pose.translation());
        Self { rows: [x[0], x[1], x[2], tx, y[0], y[1], y[2], ty, z[0], z[1], z[2], tz] }
    }
}

/// `cbvh_contact`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct ContactRow {
    pub(crate) object_a: u32,
    pub(crate) triangle_a: u32,
    pub(crate) object_b: u32,
    pub(crate) triangle_b: u32,
}

impl From<Contact> for ContactRow {
    fn from(of: Contact) -> Self {
        let Contact { object_a, triangle_a, object_b, triangle_b } = of;
        Self { object_a, triangle_a, object_b, triangle_b }
    }
}

/// `cbvh_distance_answer`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DistanceRow {
    pub(crate) distance: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) point_a: [f64; 3],
    pub(crate) point_b: [f64; 3],
    pub(crate) object_a: u32,
    pub(crate) triangle_a: u32,
    pub(crate) object_b: u32,
    pub(crate) triangle_b: u32,
}

row!(DistanceRow from Distance {
    distance: f64::NAN,
    lower: f64::NAN,
    upper: f64::NAN,
    point_a: [f64::NAN; 3],
    point_b: [f64::NAN; 3],
    object_a: 0,
    triangle_a: 0,
    object_b: 0,
    triangle_b: 0
} and {});

/// `cbvh_distance_options`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct DistanceChoices {
    pub(crate) size: usize,
    pub(crate) rel_err: f64,
    pub(crate) abs_err: f64,
}
// SAFETY: numbers.
unsafe impl Plain for DistanceChoices {}
// SAFETY: it starts with a size.
unsafe impl Options for DistanceChoices {
    const DEFAULT: Self = Self { size: size_of::<Self>(), rel_err: 0.0, abs_err: 0.0 };
}

impl DistanceChoices {
    pub(crate) fn read(&self) -> DistanceOptions {
        DistanceOptions::new().rel_err(self.rel_err).abs_err(self.abs_err)
    }

    pub(crate) fn is_exact(&self) -> bool {
        self.rel_err == 0.0 && self.abs_err == 0.0
    }
}

/// `cbvh_motion_options`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct MotionChoices {
    pub(crate) size: usize,
    pub(crate) clearance: f64,
    pub(crate) tolerance: f64,
}
// SAFETY: numbers.
unsafe impl Plain for MotionChoices {}
// SAFETY: it starts with a size.
unsafe impl Options for MotionChoices {
    const DEFAULT: Self = Self { size: size_of::<Self>(), clearance: 0.0, tolerance: 0.0 };
}

impl MotionChoices {
    pub(crate) fn read(&self) -> MotionOptions {
        let tolerance = if self.tolerance == 0.0 { None } else { Some(self.tolerance) };
        MotionOptions::new().clearance(self.clearance).tolerance(tolerance)
    }
}

/// `cbvh_bake_options`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct BakeChoices {
    pub(crate) size: usize,
    pub(crate) profile: *const c_char,
    pub(crate) triangles: *const c_char,
    pub(crate) effort: *const c_char,
    pub(crate) scratch: *const c_char,
    pub(crate) max_error: f64,
    pub(crate) max_memory: u64,
    pub(crate) split_objects: i32,
    pub(crate) scene: i32,
    pub(crate) no_ids: i32,
    pub(crate) no_turning_slabs: i32,
    pub(crate) no_topology: i32,
    pub(crate) force: i32,
}
// SAFETY: numbers, and pointers, which are numbers until they are followed.
unsafe impl Plain for BakeChoices {}
// SAFETY: it starts with a size.
unsafe impl Options for BakeChoices {
    const DEFAULT: Self = Self {
        size: size_of::<Self>(),
        profile: std::ptr::null(),
        triangles: std::ptr::null(),
        effort: std::ptr::null(),
        scratch: std::ptr::null(),
        max_error: 0.0,
        max_memory: 0,
        split_objects: 0,
        scene: 0,
        no_ids: 0,
        no_turning_slabs: 0,
        no_topology: 0,
        force: 0,
    };
}

/// `cbvh_closest_point`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct ClosestRow {
    pub(crate) distance: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) point: [f64; 3],
    pub(crate) instance: Instance,
    pub(crate) object: u32,
    pub(crate) triangle: u32,
    pub(crate) found: i32,
    pub(crate) side: i32,
}

/// No instance: the answer is about one mesh, or there is none.
const NO_INSTANCE: Instance = Instance { id: 0 };
/// `CBVH_SIDE_NOT_ASKED`.
pub(crate) const SIDE_NOT_ASKED: i32 = 3;

row!(ClosestRow from ClosestPoint {
    distance: f64::NAN,
    lower: f64::NAN,
    upper: f64::NAN,
    point: [f64::NAN; 3],
    object: 0,
    triangle: 0
} and { instance: NO_INSTANCE, found: 0 => 1, side: SIDE_NOT_ASKED });

impl From<Option<ClosestPoint>> for ClosestRow {
    fn from(of: Option<ClosestPoint>) -> Self {
        of.map_or(Self::NONE, Self::from)
    }
}

impl From<Option<SignedDistance>> for ClosestRow {
    fn from(of: Option<SignedDistance>) -> Self {
        of.map_or(Self::NONE, |of| Self { side: side(of.side), ..of.closest.into() })
    }
}

impl From<Option<SceneClosestPoint>> for ClosestRow {
    fn from(of: Option<SceneClosestPoint>) -> Self {
        of.map_or(Self::NONE, |of| Self { instance: of.instance.into(), ..of.closest.into() })
    }
}

impl From<Option<(InstanceId, SignedDistance)>> for ClosestRow {
    fn from(of: Option<(InstanceId, SignedDistance)>) -> Self {
        of.map_or(Self::NONE, |(instance, of)| Self { instance: instance.into(), ..Some(of).into() })
    }
}

/// `cbvh_ray`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RayRow {
    pub(crate) origin: [f64; 3],
    pub(crate) direction: [f64; 3],
    pub(crate) until: f64,
}
// SAFETY: numbers.
unsafe impl Plain for RayRow {}

impl From<&RayRow> for Ray {
    fn from(row: &RayRow) -> Self {
        Self::new(row.origin, row.direction).until(row.until)
    }
}

/// `cbvh_segment`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct SegmentRow {
    pub(crate) from: [f64; 3],
    pub(crate) to: [f64; 3],
}
// SAFETY: numbers.
unsafe impl Plain for SegmentRow {}

/// `cbvh_ray_hit`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct HitRow {
    pub(crate) t: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) point: [f64; 3],
    pub(crate) instance: Instance,
    pub(crate) object: u32,
    pub(crate) triangle: u32,
    pub(crate) found: i32,
    pub(crate) reserved: i32,
}

row!(HitRow from RayHit {
    t: f64::NAN,
    lower: f64::NAN,
    upper: f64::NAN,
    point: [f64::NAN; 3],
    object: 0,
    triangle: 0
} and { instance: NO_INSTANCE, found: 0 => 1, reserved: 0 });

impl From<SceneRayHit> for HitRow {
    fn from(of: SceneRayHit) -> Self {
        Self { instance: of.instance.into(), ..of.hit.into() }
    }
}

impl<T: Into<Self>> From<Option<T>> for HitRow {
    fn from(of: Option<T>) -> Self {
        of.map_or(Self::NONE, Into::into)
    }
}

/// `cbvh_motion_answer`, and what its numbers mean.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct MotionRow {
    pub(crate) outcome: i32,
    pub(crate) reserved: i32,
    pub(crate) free_until: f64,
    pub(crate) at: f64,
    pub(crate) instance_a: Instance,
    pub(crate) instance_b: Instance,
    pub(crate) nearest: DistanceRow,
}

/// `CBVH_FREE`, `CBVH_HIT` and `CBVH_NEAR`.
pub(crate) const FREE: i32 = 0;
pub(crate) const HIT: i32 = 1;
pub(crate) const NEAR: i32 = 2;

impl MotionRow {
    const FREE: Self = Self {
        outcome: FREE,
        reserved: 0,
        free_until: 1.0,
        at: f64::NAN,
        instance_a: NO_INSTANCE,
        instance_b: NO_INSTANCE,
        nearest: DistanceRow::NONE,
    };
}

impl MotionRow {
    fn ended(outcome: i32, free_until: f64, at: f64, nearest: Distance) -> Self {
        Self { outcome, free_until, at, nearest: nearest.into(), ..Self::FREE }
    }

    fn of(self, pair: ScenePair) -> Self {
        Self { instance_a: pair.a.into(), instance_b: pair.b.into(), ..self }
    }
}

impl From<MotionAnswer> for MotionRow {
    fn from(of: MotionAnswer) -> Self {
        match of {
            MotionAnswer::Free => Self::FREE,
            MotionAnswer::Hit { free_until, touching_at, nearest } => {
                Self::ended(HIT, free_until, touching_at, nearest)
            }
            MotionAnswer::Near { free_until, at, nearest } => Self::ended(NEAR, free_until, at, nearest),
        }
    }
}

impl From<SceneMotionAnswer> for MotionRow {
    fn from(of: SceneMotionAnswer) -> Self {
        match of {
            SceneMotionAnswer::Free => Self::FREE,
            SceneMotionAnswer::Hit { free_until, touching_at, nearest } => {
                Self::ended(HIT, free_until, touching_at, nearest.nearest).of(nearest.pair)
            }
            SceneMotionAnswer::Near { free_until, at, nearest } => {
                Self::ended(NEAR, free_until, at, nearest.nearest).of(nearest.pair)
            }
        }
    }
}

/// The number of a relation.
pub(crate) fn relation(of: Relation) -> i32 {
    match of {
        Relation::Touching => 0,
        Relation::Apart => 1,
        Relation::AInB => 2,
        Relation::BInA => 3,
        Relation::Mixed => 4,
        Relation::Undefined => 5,
    }
}

/// The number of a side.
pub(crate) fn side(of: Side) -> i32 {
    match of {
        Side::Outside => -1,
        Side::On => 0,
        Side::Inside => 1,
        Side::Undefined => 2,
    }
}

/// The numbers of `cbvh_open_mode`.
pub(crate) const MAP: i32 = 0;
pub(crate) const MAP_SPARSE: i32 = 1;
pub(crate) const MAP_WHOLE: i32 = 2;
pub(crate) const READ: i32 = 3;

/// The numbers of `cbvh_backend`.
pub(crate) const BACKEND_BEST: i32 = 0;
pub(crate) const BACKEND_SCALAR: i32 = 1;
pub(crate) const BACKEND_AVX2: i32 = 2;
pub(crate) const BACKEND_AVX512: i32 = 3;

/// Reads `cbvh_backend`.
pub(crate) fn backend(name: &str, number: i32) -> Result<Backend, Failure> {
    let backend = match number {
        BACKEND_BEST => return Ok(Backend::detect().map_err(bvh_query::QueryError::from)?),
        BACKEND_SCALAR => Backend::Scalar,
        BACKEND_AVX2 => Backend::Avx2,
        BACKEND_AVX512 => Backend::Avx512,
        _ => return Err(Failure::argument(name, "a number of cbvh_backend, 0 to 3", number)),
    };
    Ok(Backend::from_name(backend.name()).map_err(bvh_query::QueryError::from)?)
}

/// `cbvh_stats`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct StatsRow {
    pub(crate) node_tests: u64,
    pub(crate) packet_tests: u64,
    pub(crate) exact_tests: u64,
    pub(crate) pairs: u64,
}

impl StatsRow {
    pub(crate) fn new(of: QueryStats, pairs: u64) -> Self {
        Self { node_tests: of.node_tests, packet_tests: of.packet_tests, exact_tests: of.exact_tests, pairs }
    }
}

impl From<InstanceId> for Instance {
    /// Adds one, so that no instance has the number 0.
    fn from(id: InstanceId) -> Self {
        Self { id: id.to_bits().wrapping_add(1) }
    }
}

impl From<Instance> for InstanceId {
    fn from(instance: Instance) -> Self {
        Self::from_bits(instance.id.wrapping_sub(1))
    }
}

/// `cbvh_scene_pair`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct PairRow {
    pub(crate) a: Instance,
    pub(crate) b: Instance,
}

impl From<ScenePair> for PairRow {
    fn from(of: ScenePair) -> Self {
        Self { a: of.a.into(), b: of.b.into() }
    }
}

/// `cbvh_scene_relation`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SceneRelationRow {
    pub(crate) pair: PairRow,
    pub(crate) relation: i32,
    pub(crate) reserved: i32,
}

impl From<(ScenePair, Relation)> for SceneRelationRow {
    fn from((pair, of): (ScenePair, Relation)) -> Self {
        Self { pair: pair.into(), relation: relation(of), reserved: 0 }
    }
}

/// `cbvh_scene_contact`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SceneContactRow {
    pub(crate) pair: PairRow,
    pub(crate) contact: ContactRow,
}

impl From<SceneContact> for SceneContactRow {
    fn from(of: SceneContact) -> Self {
        Self { pair: of.pair.into(), contact: of.contact.into() }
    }
}

/// `cbvh_scene_distance_answer`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SceneDistanceRow {
    pub(crate) pair: PairRow,
    pub(crate) nearest: DistanceRow,
    pub(crate) found: i32,
    pub(crate) reserved: i32,
}

impl From<Option<SceneDistance>> for SceneDistanceRow {
    fn from(of: Option<SceneDistance>) -> Self {
        let none = PairRow { a: NO_INSTANCE, b: NO_INSTANCE };
        match of {
            Some(of) => Self { pair: of.pair.into(), nearest: of.nearest.into(), found: 1, reserved: 0 },
            None => Self { pair: none, nearest: DistanceRow::NONE, found: 0, reserved: 0 },
        }
    }
}
