//! Questions about the ways of one mesh in the frame of another.

use crate::entry::{entry, questions};
use crate::input::{array, options, reserve};
use crate::output::Room;
use crate::pairs::batch;
use crate::paths::AskedPath;
use crate::poses;
use crate::queriers::{self, Asker, Probes};
use crate::status::Failure;
use crate::types::{MeshHandle, MotionChoices, MotionRow, PathHandle, PoseRows, QuerierHandle};
use bvh_query::{Batch, Motion, MotionOptions, Querier, QueryError, Shape};

/// A querier, two meshes and what counts as a hit.
struct Question {
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    options: *const MotionChoices,
}

impl Question {
    /// Asks about paths that `read` reads, lets `check` refuse the answers, and writes them.
    ///
    /// # Safety
    /// As for `options` and `Room::new`.
    unsafe fn ask<P, T, R: Copy + From<T>>(
        &self,
        (answers, count): (*mut R, usize),
        read: impl FnOnce(&mut Probes) -> Result<Vec<P>, Failure>,
        check: impl Fn(&P) -> Result<(), Failure>,
        all: impl FnOnce(&Batch<'_>, &[P], &MotionOptions) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &P, &MotionOptions) -> Result<T, QueryError>,
    ) -> i32 {
        let ask = |asker: &mut Asker| {
            let parallel = asker.uses_all_cores();
            let Asker { querier, limits, at_hand, probes, .. } = asker;
            let (a, b) = at_hand.pair(self.a, self.b)?;
            let paths = read(probes)?;
            // SAFETY: the caller vouches for it.
            let (options, mut room) =
                unsafe { (options("options", self.options)?.read(), Room::new("answers", answers, count)?) };
            if parallel {
                let found = all(&batch(a, b, querier, limits), &paths, &options);
                paths.iter().try_for_each(check)?;
                return room.fill(found?.into_iter().map(Ok::<_, QueryError>), R::from);
            }
            let mut one = |path| {
                let found = one(querier, [a, b], path, &options);
                check(path)?;
                Ok::<_, Failure>(found?)
            };
            room.fill(paths.iter().map(&mut one), R::from)
        };
        entry(|| queriers::with(self.querier, ask))
    }
}

/// A question about paths of handles.
struct Paths(Question, *const PathHandle, usize);

impl Paths {
    /// Asks about each path.
    ///
    /// # Safety
    /// As for `array`, `options` and `Room::new`.
    unsafe fn each<T, R: Copy + From<T>>(
        self,
        answers: *mut R,
        all: impl FnOnce(&Batch<'_>, &[AskedPath], &MotionOptions) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &AskedPath, &MotionOptions) -> Result<T, QueryError>,
    ) -> i32 {
        let Self(question, paths, count) = self;
        // SAFETY: the caller vouches for it.
        unsafe {
            let read = |_: &mut Probes| AskedPath::many("paths", array("paths", paths, count)?);
            question.ask((answers, count), read, AskedPath::failure, all, one)
        }
    }
}

/// A question about motions between poses.
struct Edges(Question, [*const PoseRows; 2], usize);

impl Edges {
    /// Asks about each motion.
    ///
    /// # Safety
    /// As for `poses::read_many`, `options` and `Room::new`.
    unsafe fn each<T, R: Copy + From<T>>(
        self,
        answers: *mut R,
        all: impl FnOnce(&Batch<'_>, &[Motion], &MotionOptions) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Motion, &MotionOptions) -> Result<T, QueryError>,
    ) -> i32 {
        let Self(question, [starts, ends], count) = self;
        let read = |Probes { poses: start_poses, ends: end_poses, .. }: &mut Probes| {
            // SAFETY: the caller vouches for it.
            let (starts, ends) = unsafe {
                let starts = poses::read_many("starts", starts, count, start_poses)?;
                (starts, poses::read_many("ends", ends, count, end_poses)?)
            };
            let mut motions = Vec::new();
            reserve("starts", count, &mut motions)?;
            for (number, (start, end)) in starts.iter().zip(ends).enumerate() {
                let place = format_args!("starts[{number}] and ends[{number}]");
                motions.push(Motion::between(start, end).map_err(|error| Failure::from(error).at(place))?);
            }
            Ok(motions)
        };
        // SAFETY: as above.
        unsafe { question.ask((answers, count), read, |_| Ok(()), all, one) }
    }
}

questions! {
    (querier: QuerierHandle, a: MeshHandle, b: MeshHandle, paths: *const PathHandle, count: usize,
        options: *const MotionChoices,)
        => Paths(Question { querier, a, b, options }, paths, count);
    cbvh_motions() -> MotionRow:
        |batch, paths, options| batch.motions(paths, options),
        |querier, [a, b], path, options| querier.motion(a, b, path, options);
    cbvh_are_free() -> bool:
        |batch, paths, options| batch.are_free(paths, options),
        |querier, [a, b], path, options| querier.is_free(a, b, path, options);
}

questions! {
    (querier: QuerierHandle, a: MeshHandle, b: MeshHandle, starts: *const PoseRows, ends: *const PoseRows,
        count: usize, options: *const MotionChoices,)
        => Edges(Question { querier, a, b, options }, [starts, ends], count);
    cbvh_edge_motions() -> MotionRow:
        |batch, paths, options| batch.motions(paths, options),
        |querier, [a, b], path, options| querier.motion(a, b, path, options);
    cbvh_edges_are_free() -> bool:
        |batch, paths, options| batch.are_free(paths, options),
        |querier, [a, b], path, options| querier.is_free(a, b, path, options);
}
