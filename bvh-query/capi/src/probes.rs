//! Questions about one mesh and many points, rays or segments.

use crate::entry::entry;
use crate::input::{array, points_within, reserve};
use crate::output::{Lists, Room};
use crate::poses::pose_or_identity;
use crate::queriers::{Asker, Probes, QUERIERS};
use crate::status::Failure;
use crate::types::{ClosestRow, HitRow, MeshHandle, PoseRows, QuerierHandle, RayRow, SegmentRow, side};
use bvh_query::{PlacedShape, ProbeBatch, Querier, QueryError, Ray};

/// A querier, a mesh, and where it stands in the frame of the probes.
struct Question {
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
}

impl Question {
    /// Checks what is given, reads the probes, and calls `ask`.
    ///
    /// # Safety
    /// As for `pose_or_identity`.
    unsafe fn ask(
        &self,
        read: impl FnOnce(&mut Probes) -> Result<(), Failure>,
        ask: impl FnOnce(&mut Querier, Option<ProbeBatch<'_>>, PlacedShape<'_>, &Probes) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut held = QUERIERS.hold("querier", self.querier.id)?;
        let asker = &mut **held.value()?;
        let parallel = asker.uses_all_cores();
        let Asker { querier, budget, at_hand, probes, .. } = asker;
        let shape = at_hand.one("mesh", self.mesh)?;
        // SAFETY: the caller vouches for it.
        let placed = shape.at(&unsafe { pose_or_identity("pose", self.pose) }?);
        read(probes)?;
        let batch = parallel.then(|| {
            let mut batch = ProbeBatch::with_backend(placed, querier.backend());
            batch.set_budget(*budget);
            batch
        });
        ask(querier, batch, placed, probes)
    }

    /// Asks about each probe, and writes an answer for each.
    ///
    /// # Safety
    /// As for `pose_or_identity`, and for `Room::new`.
    unsafe fn each<P: Copy, T, R: Copy>(
        &self,
        (answers, read, probes): (
            *mut R,
            impl FnOnce(&mut Probes) -> Result<(), Failure>,
            impl Fn(&Probes) -> &Vec<P>,
        ),
        all: impl FnOnce(&ProbeBatch<'_>, &[P]) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, PlacedShape<'_>, P) -> Result<T, QueryError>,
        row: impl Fn(T) -> R,
    ) -> i32 {
        let ask =
            |querier: &mut Querier, batch: Option<ProbeBatch<'_>>, placed: PlacedShape<'_>, of: &Probes| {
                let probes = probes(of);
                // SAFETY: the caller vouches for it.
                let mut room = unsafe { Room::new("answers", answers, probes.len()) }?;
                if let Some(batch) = batch {
                    let answers = all(&batch, probes)?.into_iter().enumerate();
                    answers.for_each(|(number, answer)| room.set(number, row(answer)));
                    return Ok(());
                }
                for (number, probe) in probes.iter().enumerate() {
                    room.set(number, row(one(querier, placed, *probe)?));
                }
                Ok(())
            };
        // SAFETY: as above.
        entry(|| unsafe { self.ask(read, ask) })
    }
}

/// Reads points.
///
/// # Safety
/// As for `array`, of three numbers per point.
unsafe fn read_points(
    points: *const f64,
    count: usize,
    within: f64,
) -> impl FnOnce(&mut Probes) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    move |probes| unsafe { points_within(points, count, within, &mut probes.points) }
}

/// Reads rays.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn rays(rays: *const RayRow, count: usize, into: &mut Vec<Ray>) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let rows = unsafe { array("rays", rays, count) }?;
    into.clear();
    reserve("rays", count, into)?;
    into.extend(rows.iter().map(Ray::from));
    Ok(())
}

/// Reads rays of a question about one mesh.
///
/// # Safety
/// As for `array`.
unsafe fn read_rays(given: *const RayRow, count: usize) -> impl FnOnce(&mut Probes) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    move |probes| unsafe { rays(given, count, &mut probes.rays) }
}

/// Reads segments.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn segments(
    segments: *const SegmentRow,
    count: usize,
    into: &mut Vec<[[f64; 3]; 2]>,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let rows = unsafe { array("segments", segments, count) }?;
    into.clear();
    reserve("segments", count, into)?;
    into.extend(rows.iter().map(|row| [row.from, row.to]));
    Ok(())
}

/// `cbvh_closest_points`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_closest_points(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    points: *const f64,
    count: usize,
    within: f64,
    answers: *mut ClosestRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read_points(points, count, within), |probes: &Probes| &probes.points),
            |batch, points| batch.closest_points(points, within),
            |querier, shape, point| querier.closest_point(shape, point, within),
            ClosestRow::from,
        )
    }
}

/// `cbvh_sides`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_sides(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    points: *const f64,
    count: usize,
    answers: *mut i32,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read_points(points, count, f64::INFINITY), |probes: &Probes| &probes.points),
            |batch, points| batch.sides(points),
            |querier, shape, point| querier.side(shape, point),
            side,
        )
    }
}

/// `cbvh_signed_distances`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_signed_distances(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    points: *const f64,
    count: usize,
    within: f64,
    answers: *mut ClosestRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read_points(points, count, within), |probes: &Probes| &probes.points),
            |batch, points| batch.signed_distances(points, within),
            |querier, shape, point| querier.signed_distance(shape, point, within),
            ClosestRow::from,
        )
    }
}

/// `cbvh_first_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_first_hits(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    rays: *const RayRow,
    count: usize,
    answers: *mut HitRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read_rays(rays, count), |probes: &Probes| &probes.rays),
            |batch, rays| batch.first_hits(rays),
            |querier, shape, ray| querier.first_hit(shape, &ray),
            HitRow::from,
        )
    }
}

/// `cbvh_any_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_any_hits(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    rays: *const RayRow,
    count: usize,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read_rays(rays, count), |probes: &Probes| &probes.rays),
            |batch, rays| batch.any_hits(rays),
            |querier, shape, ray| querier.any_hit(shape, &ray),
            |answer| answer,
        )
    }
}

/// `cbvh_all_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_all_hits(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    rays: *const RayRow,
    ray_count: usize,
    counts: *mut usize,
    hits: *mut HitRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let ask = |querier: &mut Querier, batch: Option<ProbeBatch<'_>>, placed: PlacedShape<'_>, of: &Probes| {
        // SAFETY: the header asks for it.
        let mut lists = unsafe { Lists::new(("hits", hits, capacity, count), counts, of.rays.len()) }?;
        let mut add = |number, found: Vec<bvh_query::RayHit>| {
            let count = found.len();
            lists.add(number, found.into_iter().map(HitRow::from), count);
        };
        if let Some(batch) = batch {
            let found = batch.all_hits(&of.rays)?.into_iter().enumerate();
            found.for_each(|(number, found)| add(number, found));
        } else {
            for (number, ray) in of.rays.iter().enumerate() {
                add(number, querier.all_hits(placed, ray)?);
            }
        }
        lists.finish()
    };
    // SAFETY: the header asks for it.
    entry(|| unsafe { Question { querier, mesh, pose }.ask(read_rays(rays, ray_count), ask) })
}

/// `cbvh_segment_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_segment_hits(
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
    given: *const SegmentRow,
    count: usize,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    let read = |probes: &mut Probes| unsafe { segments(given, count, &mut probes.segments) };
    // SAFETY: the header asks for it.
    unsafe {
        Question { querier, mesh, pose }.each(
            (answers, read, |probes: &Probes| &probes.segments),
            |batch, segments| batch.segment_hits(segments),
            |querier, shape, [from, to]| querier.segment_hit(shape, from, to),
            |answer| answer,
        )
    }
}
