//! Questions about the ways of one mesh in the frame of another.

use crate::entry::entry;
use crate::input::{array, options, reserve};
use crate::output::Room;
use crate::paths::AskedPath;
use crate::poses::poses;
use crate::queriers::{Asker, Probes, QUERIERS};
use crate::status::Failure;
use crate::types::{MeshHandle, MotionChoices, MotionRow, PathHandle, PoseRows, QuerierHandle};
use bvh_query::{Batch, Motion, MotionOptions, Querier, QueryError, RigidPath, Shape};

/// A querier, two meshes and what counts as a hit.
struct Question {
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    choices: *const MotionChoices,
}

/// How many paths are asked about, on one core or on all.
trait Ask<R> {
    fn all<P: RigidPath + Sync>(
        batch: &Batch<'_>,
        paths: &[P],
        options: &MotionOptions,
    ) -> Result<Vec<R>, QueryError>;
    fn one(
        querier: &mut Querier,
        meshes: [Shape<'_>; 2],
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<R, QueryError>;
}

/// Where a way ends.
struct WhereItEnds;

impl Ask<MotionRow> for WhereItEnds {
    fn all<P: RigidPath + Sync>(
        batch: &Batch<'_>,
        paths: &[P],
        options: &MotionOptions,
    ) -> Result<Vec<MotionRow>, QueryError> {
        Ok(batch.motions(paths, options)?.into_iter().map(MotionRow::from).collect())
    }

    fn one(
        querier: &mut Querier,
        [a, b]: [Shape<'_>; 2],
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<MotionRow, QueryError> {
        querier.motion(a, b, path, options).map(MotionRow::from)
    }
}

/// Whether a way is free.
struct WhetherFree;

impl Ask<bool> for WhetherFree {
    fn all<P: RigidPath + Sync>(
        batch: &Batch<'_>,
        paths: &[P],
        options: &MotionOptions,
    ) -> Result<Vec<bool>, QueryError> {
        batch.are_free(paths, options)
    }

    fn one(
        querier: &mut Querier,
        [a, b]: [Shape<'_>; 2],
        path: &dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<bool, QueryError> {
        querier.is_free(a, b, path, options)
    }
}

impl Question {
    /// Asks about paths that `read` reads, and lets `check` refuse the answers.
    ///
    /// # Safety
    /// As for `options` and `Room::new`.
    unsafe fn ask<A: Ask<R>, R: Copy, P: RigidPath + Sync>(
        &self,
        (answers, count): (*mut R, usize),
        read: impl FnOnce(&mut Probes) -> Result<Vec<P>, Failure>,
        check: impl Fn(&P) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut held = QUERIERS.hold("querier", self.querier.id)?;
        let asker = &mut **held.value()?;
        let parallel = asker.uses_all_cores();
        let Asker { querier, budget, at_hand, probes, .. } = asker;
        let (a, b) = at_hand.pair(self.a, self.b)?;
        let paths = read(probes)?;
        // SAFETY: the caller vouches for it.
        let (options, mut room) =
            unsafe { (options("options", self.choices)?.read(), Room::new("answers", answers, count)?) };
        if parallel {
            let mut batch = Batch::with_backend(a, b, querier.backend());
            batch.set_budget(*budget);
            let found = A::all(&batch, &paths, &options);
            paths.iter().try_for_each(&check)?;
            found?.into_iter().enumerate().for_each(|(number, answer)| room.set(number, answer));
            return Ok(());
        }
        for (number, path) in paths.iter().enumerate() {
            let found = A::one(querier, [a, b], path, &options);
            check(path)?;
            room.set(number, found?);
        }
        Ok(())
    }

    /// Asks about paths of handles.
    ///
    /// # Safety
    /// As for `array`, `options` and `Room::new`.
    unsafe fn paths<A: Ask<R>, R: Copy>(
        &self,
        paths: *const PathHandle,
        count: usize,
        answers: *mut R,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        let read = |_: &mut Probes| AskedPath::many("paths", unsafe { array("paths", paths, count) }?);
        // SAFETY: as above.
        entry(|| unsafe { self.ask::<A, R, _>((answers, count), read, AskedPath::failure) })
    }

    /// Asks about motions between poses.
    ///
    /// # Safety
    /// As for `poses`, `options` and `Room::new`.
    unsafe fn edges<A: Ask<R>, R: Copy>(
        &self,
        starts: *const PoseRows,
        ends: *const PoseRows,
        count: usize,
        answers: *mut R,
    ) -> i32 {
        let read = |probes: &mut Probes| {
            // SAFETY: the caller vouches for it.
            unsafe {
                poses("starts", starts, count, &mut probes.poses)?;
                poses("ends", ends, count, &mut probes.ends)?;
            }
            let mut motions = Vec::new();
            reserve("starts", count, &mut motions)?;
            for (number, (start, end)) in probes.poses.iter().zip(&probes.ends).enumerate() {
                let place = format_args!("starts[{number}] and ends[{number}]");
                motions.push(Motion::between(start, end).map_err(|error| Failure::from(error).at(place))?);
            }
            Ok(motions)
        };
        // SAFETY: as above.
        entry(|| unsafe { self.ask::<A, R, Motion>((answers, count), read, |_| Ok(())) })
    }
}

/// `cbvh_motions`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_motions(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    paths: *const PathHandle,
    count: usize,
    choices: *const MotionChoices,
    answers: *mut MotionRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { Question { querier, a, b, choices }.paths::<WhereItEnds, _>(paths, count, answers) }
}

/// `cbvh_are_free`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_are_free(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    paths: *const PathHandle,
    count: usize,
    choices: *const MotionChoices,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { Question { querier, a, b, choices }.paths::<WhetherFree, _>(paths, count, answers) }
}

/// `cbvh_edge_motions`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_edge_motions(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    starts: *const PoseRows,
    ends: *const PoseRows,
    count: usize,
    choices: *const MotionChoices,
    answers: *mut MotionRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { Question { querier, a, b, choices }.edges::<WhereItEnds, _>(starts, ends, count, answers) }
}

/// `cbvh_edges_are_free`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_edges_are_free(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    starts: *const PoseRows,
    ends: *const PoseRows,
    count: usize,
    choices: *const MotionChoices,
    answers: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { Question { querier, a, b, choices }.edges::<WhetherFree, _>(starts, ends, count, answers) }
}
