//! Questions about many points, rays or segments, and one mesh or all instances of a scene.

use crate::entry::{entry, questions};
use crate::input::{each, optional};
use crate::output::{Lists, Room};
use crate::poses;
use crate::queriers::{self, Asker, Probes};
use crate::scene;
use crate::status::Failure;
use crate::types::{
    ClosestRow, HitRow, MeshHandle, PoseRows, QuerierHandle, RayRow, SceneHandle, SegmentRow,
};
use bvh_query::{PlacedShape, Pose, ProbeBatch, Querier, QueryError, Ray, Scene, SceneError};

/// A querier, a mesh, and where it stands in the frame of the probes.
struct Question {
    querier: QuerierHandle,
    mesh: MeshHandle,
    pose: *const PoseRows,
}

impl Question {
    /// Checks what is given, reads the probes, and calls `ask`, with a batch if all cores may be used.
    ///
    /// # Safety
    /// As for `poses::read`.
    unsafe fn ask<P>(
        &self,
        read: impl FnOnce(&mut Probes) -> Result<&[P], Failure>,
        ask: impl FnOnce(&mut Querier, Option<ProbeBatch<'_>>, PlacedShape<'_>, &[P]) -> Result<(), Failure>,
    ) -> i32 {
        let ask = |asker: &mut Asker| {
            let parallel = asker.uses_all_cores();
            let Asker { querier, limits, at_hand, probes, .. } = asker;
            let shape = at_hand.one("mesh", self.mesh)?;
            // SAFETY: the caller vouches for it.
            let pose = optional(self.pose, |pose| unsafe { poses::read("pose", pose) })?;
            let placed = shape.at(&pose.unwrap_or(Pose::IDENTITY));
            let probes = read(probes)?;
            let batch = parallel.then(|| {
                let mut batch = ProbeBatch::with_backend(placed, querier.backend());
                batch.set_budget(limits.budget);
                batch.set_stop(limits.stop.clone());
                batch
            });
            ask(querier, batch, placed, probes)
        };
        entry(|| queriers::with(self.querier, ask))
    }

    /// Asks about each probe, and writes an answer for each.
    ///
    /// # Safety
    /// As for `poses::read` and `Room::new`.
    unsafe fn each<P: Copy, T, R: Copy>(
        &self,
        answers: *mut R,
        read: impl FnOnce(&mut Probes) -> Result<&[P], Failure>,
        all: impl FnOnce(&ProbeBatch<'_>, &[P]) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, PlacedShape<'_>, P) -> Result<T, QueryError>,
        row: impl Fn(T) -> R,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        unsafe {
            self.ask(read, |querier, batch, placed, probes| {
                let mut room = Room::new("answers", answers, probes.len())?;
                match batch {
                    Some(batch) => room.fill(all(&batch, probes)?.into_iter().map(Ok::<_, QueryError>), row),
                    None => room.fill(probes.iter().map(|&probe| one(querier, placed, probe)), row),
                }
            })
        }
    }
}

/// A question about all instances of a scene.
struct SceneQuestion(SceneHandle);

impl SceneQuestion {
    /// Asks about all probes, and writes an answer for each.
    ///
    /// # Safety
    /// As for `Room::new`.
    unsafe fn each<P: Copy, T, R: Copy>(
        self,
        answers: *mut R,
        read: impl FnOnce(&mut Probes) -> Result<&[P], Failure>,
        all: impl FnOnce(&mut Scene, &[P]) -> Result<Vec<T>, SceneError>,
        row: impl Fn(T) -> R,
    ) -> i32 {
        scene::ask(self.0, |scene| {
            let mut probes = Probes::default();
            let probes = read(&mut probes)?;
            // SAFETY: the caller vouches for it.
            let mut room = unsafe { Room::new("answers", answers, probes.len()) }?;
            room.fill(all(scene, probes)?.into_iter().map(Ok::<_, SceneError>), row)
        })
    }
}

/// Reads points, of which something is asked within a distance.
///
/// # Safety
/// As for `array`, of three numbers per point.
unsafe fn read_points(
    (points, count, within): (*const f64, usize, f64),
    into: &mut Probes,
) -> Result<&[[f64; 3]], Failure> {
    // SAFETY: the caller vouches for it; three numbers in an array are aligned as one is.
    let read =
        unsafe { each("points", points.cast(), count, &mut into.points, |point: &[f64; 3]| Ok(*point)) }?;
    // Up to infinity.
    if within >= 0.0 {
        Ok(read)
    } else {
        Err(Failure::argument("within", "a distance of at least 0", within))
    }
}

/// Reads rays.
///
/// # Safety
/// As for `array`.
unsafe fn read_rays(rays: *const RayRow, count: usize, into: &mut Probes) -> Result<&[Ray], Failure> {
    // SAFETY: the caller vouches for it.
    unsafe { each("rays", rays, count, &mut into.rays, |ray| Ok(Ray::from(ray))) }
}

/// Reads segments.
///
/// # Safety
/// As for `array`.
unsafe fn read_segments(
    segments: *const SegmentRow,
    count: usize,
    into: &mut Probes,
) -> Result<&[[[f64; 3]; 2]], Failure> {
    // SAFETY: the caller vouches for it.
    unsafe { each("segments", segments, count, &mut into.segments, |row| Ok([row.from, row.to])) }
}

/// Defines each question twice: about one mesh, and about a scene.
macro_rules! probes {
    ($($name:ident, $of_scene:ident $own:tt -> $row:ty: $read:expr, $all:expr, $one:expr, $make:expr;)*) => {
        questions! {
            (querier: QuerierHandle, mesh: MeshHandle, pose: *const PoseRows,) => Question { querier, mesh, pose };
            $($name $own -> $row: $read, $all, $one, $make;)*
        }
        questions! {
            (scene: SceneHandle,) => SceneQuestion(scene);
            $($of_scene $own -> $row: $read, $all, $make;)*
        }
    };
}

probes! {
    cbvh_closest_points, cbvh_scene_closest_points(points: *const f64, count: usize, within: f64,) -> ClosestRow:
        |into| read_points((points, count, within), into), |of, points| of.closest_points(points, within),
        |querier, mesh, point| querier.closest_point(mesh, point, within), ClosestRow::from;
    cbvh_sides, cbvh_scene_sides(points: *const f64, count: usize,) -> i32:
        |into| read_points((points, count, f64::INFINITY), into), |of, points| of.sides(points),
        |querier, mesh, point| querier.side(mesh, point), |of| of as i32;
    cbvh_signed_point_distances, cbvh_scene_signed_point_distances(points: *const f64, count: usize, within: f64,) -> ClosestRow:
        |into| read_points((points, count, within), into), |of, points| of.signed_point_distances(points, within),
        |querier, mesh, point| querier.signed_point_distance(mesh, point, within), ClosestRow::from;
    cbvh_first_hits, cbvh_scene_first_hits(rays: *const RayRow, count: usize,) -> HitRow:
        |into| read_rays(rays, count, into), |of, rays| of.first_hits(rays),
        |querier, mesh, ray| querier.first_hit(mesh, &ray), HitRow::from;
    cbvh_any_hits, cbvh_scene_any_hits(rays: *const RayRow, count: usize,) -> bool:
        |into| read_rays(rays, count, into), |of, rays| of.any_hits(rays),
        |querier, mesh, ray| querier.any_hit(mesh, &ray), bool::from;
    cbvh_segment_hits, cbvh_scene_segment_hits(segments: *const SegmentRow, count: usize,) -> bool:
        |into| read_segments(segments, count, into), |of, segments| of.segment_hits(segments),
        |querier, mesh, [from, to]| querier.segment_hit(mesh, from, to), bool::from;
    cbvh_visible, cbvh_scene_visible(segments: *const SegmentRow, count: usize, margin: f64,) -> bool:
        |into| read_segments(segments, count, into), |of, segments| of.visible(segments, margin),
        |querier, mesh, [from, to]| querier.visible(mesh, from, to, margin), bool::from;
}

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
    // SAFETY: the header asks for it.
    unsafe {
        let question = Question { querier, mesh, pose };
        question.ask(
            |into| read_rays(rays, ray_count, into),
            |querier, batch, placed, rays| {
                let lists = Lists::new(("hits", hits, capacity, count), counts, rays.len())?;
                match batch {
                    Some(batch) => {
                        lists.finish_with(batch.all_hits(rays)?.into_iter().map(Ok::<_, QueryError>))
                    }
                    None => lists.finish_with(rays.iter().map(|ray| querier.all_hits(placed, ray))),
                }
            },
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_all_hits(
    scene: SceneHandle,
    rays: *const RayRow,
    ray_count: usize,
    counts: *mut usize,
    hits: *mut HitRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    scene::ask(scene, |scene| {
        let mut probes = Probes::default();
        // SAFETY: the header asks for it.
        let (rays, lists) = unsafe {
            let rays = read_rays(rays, ray_count, &mut probes)?;
            (rays, Lists::new(("hits", hits, capacity, count), counts, ray_count)?)
        };
        lists.finish_with(scene.all_hits(rays)?.into_iter().map(Ok::<_, SceneError>))
    })
}
