//! The structures and numbers that the header declares, and what they are made from.
//!
//! `tests/header.py` compares them with the header, whose names for them `cbindgen.toml` lists.

use crate::input::Plain;
use crate::status::Failure;
use bvh_query::{
    Backend, Clash, ClashClass, ClashOptions, ClosestPoint, Contact, ContactRegion, Distance,
    DistanceOptions, InstanceId, Intersection, MotionAnswer, MotionOptions, Patch, PatchOptions, PatchPoint,
    Penetration, PenetrationOptions, Pose, QueryStats, Ray, RayHit, RegionKind, Relation, SceneClash,
    SceneClosestPoint, SceneContact, SceneDistance, SceneMotionAnswer, ScenePair, SceneRayHit,
    SceneSignedDistance, SelfContact, SelfContactKind, Separation, Side, SignedDistance, SignedPointDistance,
};
use std::ffi::c_char;

/// Defines structures that have no bytes outside their fields, so that answers can be compared as bytes.
macro_rules! structures {
    ($($name:ident { $($field:ident: $type:ty),* $(,)? })*) => { $(
        #[derive(Clone, Copy, Debug)]
        #[repr(C)]
        pub struct $name {
            $(pub(crate) $field: $type,)*
        }
        #[cfg(target_pointer_width = "64")]
        const _: () = assert!(size_of::<$name>() == $(size_of::<$type>() +)* 0);
        // SAFETY: all fields may have any bytes, as their types are plain.
        unsafe impl Plain for $name {
            const NONE: Self = Self { $($field: <$type as Plain>::NONE),* };
        }
    )* };
}

macro_rules! handles {
    ($($name:ident),*) => {
        structures! { $($name { id: u64 })* }
        $(
            impl From<u64> for $name {
                fn from(id: u64) -> Self {
                    Self { id }
                }
            }
        )*
    };
}
handles!(
    MeshHandle,
    QuerierHandle,
    TrackerHandle,
    PathHandle,
    SceneHandle,
    Instance,
    RobotHandle,
    Body,
    StopHandle
);

structures! {
    PoseRows { rows: [f64; 12] }
    DistanceChoices { size: usize, rel_err: f64, abs_err: f64 }
    MotionChoices { size: usize, clearance: f64, tolerance: f64 }
    PenetrationChoices { size: usize, relative_gap: f64, tolerance: f64 }
    ClashChoices { size: usize, clearance: f64, tolerance: f64, relative_gap: f64, visits: u64 }
    PatchChoices { size: usize, tolerance: f64, max_contacts: usize, max_points: usize }
    BakeChoices {
        size: usize,
        profile: *const c_char,
        triangles: *const c_char,
        effort: *const c_char,
        scratch: *const c_char,
        max_error: f64,
        radius: f64,
        max_memory: u64,
        split_objects: i32,
        scene: i32,
        no_ids: i32,
        no_topology: i32,
        force: i32,
        solid: i32,
        allow_outside: i32,
        drop_nan: i32,
        round: *const c_char,
        weld: f64,
        stop: StopHandle,
    }
    RobotChoices {
        size: usize,
        packages: *const *const c_char,
        package_count: usize,
        srdf: *const c_char,
        cache: *const c_char,
        cylinder_error: f64,
        visual: i32,
        base: i32,
        allow_outside: i32,
        apply_up_axis: i32,
    }
    RayRow { origin: [f64; 3], direction: [f64; 3], until: f64 }
    SegmentRow { from: [f64; 3], to: [f64; 3] }
    StatsRow { node_tests: u64, packet_tests: u64, exact_tests: u64, pairs: u64 }
    ContactRow { object_a: u32, triangle_a: u32, object_b: u32, triangle_b: u32 }
    DistanceRow {
        distance: f64,
        lower: f64,
        upper: f64,
        point_a: [f64; 3],
        point_b: [f64; 3],
        object_a: u32,
        triangle_a: u32,
        object_b: u32,
        triangle_b: u32,
    }
    SeparationRow { lower: f64, upper: f64, translation: [f64; 3] }
    PenetrationRow {
        lower: f64,
        upper: f64,
        translation: [f64; 3],
        point: [f64; 3],
        radii: [f64; 2],
        is_spent: i32,
        reserved: i32,
    }
    SignedDistanceRow {
        lower: f64,
        upper: f64,
        normal: [f64; 3],
        point_a: [f64; 3],
        point_b: [f64; 3],
        translation: [f64; 3],
        is_signed: i32,
        is_spent: i32,
    }
    ClashRow { kind: i32, relation: i32, distance: f64, point: [f64; 3], depth: PenetrationRow }
    IntersectionRow {
        volume: f64,
        volume_error: f64,
        area_a: f64,
        area_b: f64,
        bounds: [[f64; 3]; 2],
        pierced_a: f64,
        pierced_b: f64,
    }
    MeasuredClashRow { clash: ClashRow, shared: IntersectionRow }
    RegionRow {
        contact: ContactRow,
        kind: i32,
        count: u32,
        points: [[f64; 3]; 6],
        normal_a: [f64; 3],
        normal_b: [f64; 3],
        error: f64,
        overlap: f64,
    }
    PatchRow { first: usize, count: usize, center: [f64; 3], normal: [f64; 3], length: f64, area: f64, depth: f64 }
    PatchCounts { patches: usize, contacts: usize, total: usize }
    PointRow { patch: usize, point: [f64; 3], normal: [f64; 3], depth: f64 }
    OpenEdgesRow {
        boundary: u64,
        flipped: u64,
        crowded: u64,
        cracks: u64,
        nearest_gap: f64,
        widest_crack: f64,
        proposed_weld: f64,
    }
    OpenEdgeRow {
        ends: [[f64; 3]; 2],
        gap: f64,
        object: u32,
        kind: i32,
        triangle_count: u32,
        triangles: [u32; 4],
        reserved: u32,
    }
    SelfContactRow { object_a: u32, triangle_a: u32, object_b: u32, triangle_b: u32, kind: i32 }
    MotionRow {
        outcome: i32,
        reserved: i32,
        free_until: f64,
        at: f64,
        instance_a: Instance,
        instance_b: Instance,
        nearest: DistanceRow,
    }
    ClosestRow {
        distance: f64,
        lower: f64,
        upper: f64,
        point: [f64; 3],
        instance: Instance,
        object: u32,
        triangle: u32,
        found: i32,
        side: i32,
    }
    HitRow {
        t: f64,
        lower: f64,
        upper: f64,
        point: [f64; 3],
        instance: Instance,
        object: u32,
        triangle: u32,
        found: i32,
        reserved: i32,
    }
    PairRow { a: Instance, b: Instance }
    SceneDistanceRow { pair: PairRow, nearest: DistanceRow, found: i32, reserved: i32 }
    SceneSignedDistanceRow { pair: PairRow, nearest: SignedDistanceRow, found: i32, reserved: i32 }
    SceneNearPairRow { pair: PairRow, distance: f64, nearest: SignedDistanceRow }
    SceneRelationRow { pair: PairRow, relation: i32, reserved: i32 }
    SceneContactRow { pair: PairRow, contact: ContactRow }
    SceneClashRow { pair: PairRow, clash: ClashRow }
    SceneMeasuredClashRow { pair: PairRow, clash: ClashRow, shared: IntersectionRow }
    RobotCounts { joints: usize, links: usize, groups: usize, states: usize }
    LimitsRow { lower: f64, upper: f64 }
    JointValueRow { joint: usize, value: f64 }
    BodyPairRow { a: Body, b: Body }
    FrequentPairRow { pair: BodyPairRow, share: f64 }
    RobotDistanceRow { pair: BodyPairRow, nearest: DistanceRow, found: i32, reserved: i32 }
    RobotSignedDistanceRow { pair: BodyPairRow, nearest: SignedDistanceRow, found: i32, reserved: i32 }
    RobotNearPairRow { pair: BodyPairRow, distance: f64, nearest: SignedDistanceRow }
    RobotMotionRow {
        outcome: i32,
        reserved: i32,
        free_until: f64,
        at: f64,
        pair: BodyPairRow,
        nearest: DistanceRow,
    }
}

/// Defines numbers of the header. Those of answers are the library's own.
macro_rules! numbers {
    ($($name:ident = $number:literal $(($answer:expr))?),*) => { $(
        pub const $name: i32 = $number;
        $(const _: () = assert!($answer as i32 == $name);)?
    )* };
}
numbers!(MAP = 0, MAP_SPARSE = 1, MAP_WHOLE = 2, READ = 3);
numbers!(BACKEND_BEST = 0, BACKEND_SCALAR = 1, BACKEND_AVX2 = 2, BACKEND_AVX512 = 3, BACKEND_NEON = 4);
numbers!(TOUCHING = 0(Relation::Touching), APART = 1(Relation::Apart), A_IN_B = 2(Relation::AInB));
numbers!(B_IN_A = 3(Relation::BInA), MIXED = 4(Relation::Mixed), RELATION_UNDEFINED = 5(Relation::Undefined));
numbers!(CLASH_APART = 0(ClashClass::Apart), CLASH_NEAR = 1(ClashClass::Near));
numbers!(CLASH_TOUCHING = 2(ClashClass::Touching), CLASH_OVERLAPPING = 3(ClashClass::Overlapping));
numbers!(CLASH_CONTAINED = 4(ClashClass::Contained), CLASH_DUPLICATED = 5(ClashClass::Duplicated));
numbers!(CLASH_UNDECIDED = 6(ClashClass::Undecided), CLASH_INTERSECTING = 7(ClashClass::Intersecting));
numbers!(CLASH_PIERCING = 8(ClashClass::Piercing), CLASH_PROTRUDING = 9(ClashClass::Protruding));
numbers!(REGION_POINT = 0(RegionKind::Point), REGION_SEGMENT = 1(RegionKind::Segment));
numbers!(REGION_POLYGON = 2(RegionKind::Polygon));
numbers!(SELF_CROSSING = 0(SelfContactKind::Crossing), SELF_AT_CORNER = 1(SelfContactKind::AtCorner));
numbers!(SELF_FOLDED = 2(SelfContactKind::Folded), SELF_DUPLICATE = 3(SelfContactKind::Duplicate));
numbers!(OPEN_BOUNDARY = 0, OPEN_FLIPPED = 1, OPEN_CROWDED = 2);
numbers!(BASE_FIXED = 0, BASE_PLANAR = 1, BASE_FLOATING = 2);
numbers!(FREE = 0, HIT = 1, NEAR = 2);
numbers!(OUTSIDE = -1(Side::Outside), ON = 0(Side::On), INSIDE = 1(Side::Inside));
numbers!(SIDE_UNDEFINED = 2(Side::Undefined), SIDE_NOT_ASKED = 3);

/// Reads `cbvh_backend`.
pub(crate) fn backend(name: &str, number: i32) -> Result<Backend, Failure> {
    let backend = match number {
        BACKEND_BEST => return Ok(Backend::detect()?),
        BACKEND_SCALAR => Backend::Scalar,
        BACKEND_AVX2 => Backend::Avx2,
        BACKEND_AVX512 => Backend::Avx512,
        BACKEND_NEON => Backend::Neon,
        _ => return Err(Failure::argument(name, "a number of cbvh_backend, 0 to 4", number)),
    };
    Ok(Backend::from_name(backend.name())?)
}

impl From<&Pose> for PoseRows {
    fn from(pose: &Pose) -> Self {
        let ([x, y, z], [tx, ty, tz]) = (*pose.rotation(), pose.translation());
        Self { rows: [x[0], x[1], x[2], tx, y[0], y[1], y[2], ty, z[0], z[1], z[2], tz] }
    }
}

impl From<&RayRow> for Ray {
    fn from(row: &RayRow) -> Self {
        Self::new(row.origin, row.direction).until(row.until)
    }
}

impl DistanceChoices {
    pub(crate) fn read(&self) -> DistanceOptions {
        DistanceOptions::new().rel_err(self.rel_err).abs_err(self.abs_err)
    }

    pub(crate) fn is_exact(&self) -> bool {
        self.rel_err == 0.0 && self.abs_err == 0.0
    }
}

impl MotionChoices {
    pub(crate) fn read(&self) -> MotionOptions {
        let tolerance = if self.tolerance == 0.0 { None } else { Some(self.tolerance) };
        MotionOptions::new().clearance(self.clearance).tolerance(tolerance)
    }
}

impl PenetrationChoices {
    pub(crate) fn read(&self) -> PenetrationOptions {
        let mut options = PenetrationOptions::new();
        if self.relative_gap != 0.0 {
            options = options.relative_gap(self.relative_gap);
        }
        if self.tolerance != 0.0 {
            options = options.tolerance(self.tolerance);
        }
        options
    }
}

impl ClashChoices {
    pub(crate) fn read(&self) -> ClashOptions {
        let mut options = ClashOptions::new().clearance(self.clearance);
        if self.tolerance != 0.0 {
            options = options.tolerance(self.tolerance);
        }
        if self.relative_gap != 0.0 {
            options = options.relative_gap(self.relative_gap);
        }
        if self.visits != 0 {
            options = options.visits(self.visits);
        }
        options
    }
}

/// The largest number of contact points of each patch if a caller does not say it.
const DEFAULT_POINTS: usize = 4;

impl PatchChoices {
    /// Reads how contacts are joined. No points are wanted.
    pub(crate) fn read(&self) -> PatchOptions {
        let most = if self.max_contacts == 0 { usize::MAX } else { self.max_contacts };
        PatchOptions::new().tolerance(self.tolerance).max_contacts(most)
    }

    /// Reads how contacts are joined, and how many points are wanted.
    pub(crate) fn read_with_points(&self) -> PatchOptions {
        let most = if self.max_points == 0 { DEFAULT_POINTS } else { self.max_points };
        self.read().max_points(most)
    }
}

impl PointRow {
    /// A point of the patch with this number.
    pub(crate) fn new(patch: usize, of: &PatchPoint) -> Self {
        Self { patch, point: of.point, normal: of.normal, depth: of.depth }
    }
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

impl Body {
    /// Adds one to the number of a body, so that none has the number 0.
    pub(crate) fn of(number: usize) -> Self {
        Self { id: number as u64 + 1 }
    }

    pub(crate) fn number(self) -> usize {
        usize::try_from(self.id.wrapping_sub(1)).unwrap_or(usize::MAX)
    }
}

/// Makes a row of an answer: its fields, and some that have other values.
macro_rules! row {
    ($of:ident: $answer:ident { $($field:ident),* } => $row:ident { $($other:ident: $value:expr),* }) => {
        impl From<$answer> for $row {
            fn from($of: $answer) -> Self {
                Self { $($other: $value,)* $($field: $of.$field.into()),* }
            }
        }
    };
}
row!(of: ScenePair { a, b } => PairRow {});
row!(of: Contact { object_a, triangle_a, object_b, triangle_b } => ContactRow {});
row!(of: SceneContact { pair, contact } => SceneContactRow {});
row!(of: SceneClash { pair, clash } => SceneClashRow {});
row!(of: SceneDistance { pair, nearest } => SceneDistanceRow { found: 1, reserved: 0 });
row!(of: SceneSignedDistance { pair, nearest } => SceneSignedDistanceRow { found: 1, reserved: 0 });
row!(of: SceneSignedDistance { pair, nearest } => SceneNearPairRow { distance: of.nearest.distance });
row!(of: Distance { distance, lower, upper, point_a, point_b, object_a, triangle_a, object_b, triangle_b }
    => DistanceRow {});
row!(of: Separation { lower, upper, translation } => SeparationRow {});
row!(of: Penetration { lower, upper, translation, point, radii, is_spent } => PenetrationRow { reserved: 0 });
row!(of: SignedDistance { lower, upper, normal, point_a, point_b, translation, is_signed, is_spent }
    => SignedDistanceRow {});
row!(of: Patch { first, count, center, normal, length, area, depth } => PatchRow {});
row!(of: ClosestPoint { distance, lower, upper, point, object, triangle }
    => ClosestRow { instance: Instance::NONE, found: 1, side: SIDE_NOT_ASKED });
row!(of: RayHit { t, lower, upper, point, object, triangle }
    => HitRow { instance: Instance::NONE, found: 1, reserved: 0 });
row!(of: Clash { distance, point, depth } => ClashRow { kind: of.class as i32, relation: of.relation as i32 });
row!(of: Intersection { volume, volume_error, area_a, area_b } => IntersectionRow {
    bounds: of.bounds.unwrap_or(Plain::NONE),
    pierced_a: of.pierced_a.unwrap_or(Plain::NONE),
    pierced_b: of.pierced_b.unwrap_or(Plain::NONE)
});
row!(of: ContactRegion { contact, count, normal_a, normal_b, error, overlap }
    => RegionRow { kind: of.kind as i32, points: of.all_points });
row!(of: SelfContact { object_a, triangle_a, object_b, triangle_b } => SelfContactRow { kind: of.kind as i32 });

/// Makes a row of what may be no answer.
macro_rules! found {
    ($($row:ident: $none:expr),*) => { $(
        impl<T: Into<$row>> From<Option<T>> for $row {
            fn from(of: Option<T>) -> Self {
                of.map_or($none, Into::into)
            }
        }
    )* };
}
found!(SceneDistanceRow: Self::NONE, SceneSignedDistanceRow: Self::NONE, HitRow: Self::NONE, PenetrationRow: Self::NONE);
found!(IntersectionRow: Self::NONE);
found!(ClosestRow: Self { side: SIDE_NOT_ASKED, ..Self::NONE });

impl From<Clash> for MeasuredClashRow {
    fn from(of: Clash) -> Self {
        Self { clash: of.into(), shared: of.magnitudes.into() }
    }
}

impl From<SceneClash> for SceneMeasuredClashRow {
    fn from(of: SceneClash) -> Self {
        Self { pair: of.pair.into(), clash: of.clash.into(), shared: of.clash.magnitudes.into() }
    }
}

impl From<SignedPointDistance> for ClosestRow {
    fn from(of: SignedPointDistance) -> Self {
        Self { side: of.side as i32, ..of.closest.into() }
    }
}

impl From<SceneClosestPoint> for ClosestRow {
    fn from(of: SceneClosestPoint) -> Self {
        Self { instance: of.instance.into(), ..of.closest.into() }
    }
}

impl From<(InstanceId, SignedPointDistance)> for ClosestRow {
    fn from((instance, of): (InstanceId, SignedPointDistance)) -> Self {
        Self { instance: instance.into(), ..of.into() }
    }
}

impl From<SceneRayHit> for HitRow {
    fn from(of: SceneRayHit) -> Self {
        Self { instance: of.instance.into(), ..of.hit.into() }
    }
}

impl From<(ScenePair, Relation)> for SceneRelationRow {
    fn from((pair, of): (ScenePair, Relation)) -> Self {
        Self { pair: pair.into(), relation: of as i32, reserved: 0 }
    }
}

impl From<MotionAnswer> for MotionRow {
    fn from(of: MotionAnswer) -> Self {
        let (outcome, free_until, at, nearest) = match of {
            MotionAnswer::Free => return Self { outcome: FREE, free_until: 1.0, ..Self::NONE },
            MotionAnswer::Hit { free_until, touching_at, nearest } => (HIT, free_until, touching_at, nearest),
            MotionAnswer::Near { free_until, at, nearest } => (NEAR, free_until, at, nearest),
        };
        Self { outcome, free_until, at, nearest: nearest.into(), ..Self::NONE }
    }
}

impl From<SceneMotionAnswer> for MotionRow {
    fn from(of: SceneMotionAnswer) -> Self {
        let (of, pair) = match of {
            SceneMotionAnswer::Free => return MotionAnswer::Free.into(),
            SceneMotionAnswer::Hit { free_until, touching_at, pair, nearest } => {
                (MotionAnswer::Hit { free_until, touching_at, nearest }, pair)
            }
            SceneMotionAnswer::Near { free_until, at, pair, nearest } => {
                (MotionAnswer::Near { free_until, at, nearest }, pair)
            }
        };
        Self { instance_a: pair.a.into(), instance_b: pair.b.into(), ..of.into() }
    }
}
