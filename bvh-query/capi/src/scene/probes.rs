//! Questions about points, rays and segments in the world, over all instances of a scene.

use super::with;
use crate::input::{points_within, rows_of_three};
use crate::output::{Lists, Room};
use crate::probes::{rays, segments};
use crate::status::Failure;
use crate::types::{ClosestRow, HitRow, RayRow, SceneHandle, SegmentRow, side};
use bvh_query::{Scene, SceneError};

/// Reads probes, asks about all of them, and writes an answer for each.
///
/// # Safety
/// As for `Room::new`; `read` may read.
unsafe fn each<P, T, R: Copy>(
    scene: SceneHandle,
    (answers, read): (*mut R, impl FnOnce(&mut Vec<P>) -> Result<(), Failure>),
    ask: impl FnOnce(&mut Scene, &[P]) -> Result<Vec<T>, SceneError>,
    row: impl Fn(T) -> R,
) -> i32 {
    with(scene, |scene| {
        let mut probes = Vec::new();
        read(&mut probes)?;
        // SAFETY: the caller vouches for it.
        let mut room = unsafe { Room::new("answers", answers, probes.len()) }?;
        let found = ask(scene, &probes)?.into_iter().enumerate();
        found.for_each(|(number, answer)| room.set(number, row(answer)));
        Ok(())
    })
}

/// `cbvh_scene_closest_points`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_closest_points(
    scene: SceneHandle,
    points: *const f64,
    count: usize,
    within: f64,
    answers: *mut ClosestRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = |into: &mut Vec<_>| points_within(points, count, within, into);
        each(scene, (answers, read), |scene, points| scene.closest_points(points, within), ClosestRow::from)
    }
}

/// `cbvh_scene_sides`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_sides(
    scene: SceneHandle,
    points: *const f64,
    count: usize,
    answers: *mut i32,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = |into: &mut Vec<_>| rows_of_three("points", points, count, into);
        each(scene, (answers, read), Scene::sides, side)
    }
}

/// `cbvh_scene_signed_distances`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_signed_distances(
    scene: SceneHandle,
    points: *const f64,
    count: usize,
    within: f64,
    answers: *mut ClosestRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = |into: &mut Vec<_>| points_within(points, count, within, into);
        each(scene, (answers, read), |scene, points| scene.signed_distances(points, within), ClosestRow::from)
    }
}

/// `cbvh_scene_first_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_first_hits(
    scene: SceneHandle,
    given: *const RayRow,
    count: usize,
    answers: *mut HitRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        each(scene, (answers, |into: &mut _| rays(given, count, into)), Scene::first_hits, HitRow::from)
    }
}

/// `cbvh_scene_any_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_any_hits(
    scene: SceneHandle,
    given: *const RayRow,
    count: usize,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        each(scene, (answers, |into: &mut _| rays(given, count, into)), Scene::any_hits, |answer| answer)
    }
}

/// `cbvh_scene_all_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_all_hits(
    scene: SceneHandle,
    given: *const RayRow,
    ray_count: usize,
    counts: *mut usize,
    hits: *mut HitRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    with(scene, |scene| {
        let mut probes = Vec::new();
        // SAFETY: the header asks for it.
        let mut lists = unsafe {
            rays(given, ray_count, &mut probes)?;
            Lists::new(("hits", hits, capacity, count), counts, ray_count)?
        };
        for (number, found) in scene.all_hits(&probes)?.into_iter().enumerate() {
            let count = found.len();
            lists.add(number, found.into_iter().map(HitRow::from), count);
        }
        lists.finish()
    })
}

/// `cbvh_scene_segment_hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_segment_hits(
    scene: SceneHandle,
    given: *const SegmentRow,
    count: usize,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = |into: &mut _| segments(given, count, into);
        each(scene, (answers, read), |scene, segments| scene.segment_hits(segments), |answer| answer)
    }
}
