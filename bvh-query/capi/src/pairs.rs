//! Questions about two meshes in many poses.

use crate::at_hand::MESHES;
use crate::entry::{entry, questions, write};
use crate::input::{self, reserve};
use crate::output::{Lists, Room};
use crate::poses;
use crate::queriers::{self, Asker, Limits};
use crate::status::Failure;
use crate::types::{ContactRow, DistanceChoices, DistanceRow, MeshHandle, PoseRows, QuerierHandle};
use bvh_query::{Batch, Pose, Querier, QueryError, Shape, displacement};
use std::ops::ControlFlow;

/// A querier, two meshes, and poses of the second in the frame of the first.
pub(crate) struct Question {
    pub(crate) querier: QuerierHandle,
    pub(crate) a: MeshHandle,
    pub(crate) b: MeshHandle,
    pub(crate) poses: *const PoseRows,
    pub(crate) count: usize,
}

impl Question {
    /// Checks what is given, and calls `ask`, with a batch if all cores may be used.
    ///
    /// # Safety
    /// As for `poses::read_many`.
    pub(crate) unsafe fn ask(
        &self,
        ask: impl FnOnce(&mut Querier, Option<Batch<'_>>, [Shape<'_>; 2], &[Pose]) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        queriers::with(self.querier, |asker| {
            let parallel = asker.uses_all_cores();
            let Asker { querier, limits, at_hand, probes, .. } = asker;
            let (a, b) = at_hand.pair(self.a, self.b)?;
            // SAFETY: the caller vouches for it.
            let poses = unsafe { poses::read_many("poses", self.poses, self.count, &mut probes.poses) }?;
            let batch = parallel.then(|| batch(a, b, querier, limits));
            ask(querier, batch, [a, b], poses)
        })
    }

    /// Asks about each pose, and writes an answer for each. Only exact questions are for all cores.
    ///
    /// # Safety
    /// As for `poses::read_many` and `Room::new`.
    unsafe fn answer<T, R: Copy>(
        &self,
        (answers, is_exact): (*mut R, bool),
        all: impl FnOnce(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
        row: impl Fn(T) -> R,
    ) -> Result<(), Failure> {
        // SAFETY: the caller vouches for it.
        unsafe {
            self.ask(|querier, batch, meshes, poses| {
                let mut room = Room::new("answers", answers, poses.len())?;
                match batch.filter(|_| is_exact) {
                    Some(batch) => room.fill(all(&batch, poses)?.into_iter().map(Ok::<_, QueryError>), row),
                    None => room.fill(poses.iter().map(|pose| one(querier, meshes, pose)), row),
                }
            })
        }
    }

    /// Asks an exact question, as `answer` does.
    ///
    /// # Safety
    /// As for `answer`.
    unsafe fn each<T, R: Copy>(
        &self,
        answers: *mut R,
        all: impl FnOnce(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
        row: impl Fn(T) -> R,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        entry(|| unsafe { self.answer((answers, true), all, one, row) })
    }
}

/// Makes what asks about two meshes on all cores.
pub(crate) fn batch<'a>(a: Shape<'a>, b: Shape<'a>, querier: &Querier, limits: &Limits) -> Batch<'a> {
    let mut batch = Batch::with_backend(a, b, querier.backend());
    batch.set_budget(limits.budget);
    batch.set_stop(limits.stop.clone());
    batch
}

questions! {
    (querier: QuerierHandle, a: MeshHandle, b: MeshHandle, poses: *const PoseRows, count: usize,)
        => Question { querier, a, b, poses, count };
    cbvh_collide() -> bool:
        |batch, poses| batch.collide(poses), |querier, [a, b], pose| querier.collide(a, b, pose), bool::from;
    cbvh_within(d: f64,) -> bool:
        |batch, poses| batch.within(poses, d), |querier, [a, b], pose| querier.within(a, b, pose, d), bool::from;
    cbvh_relations() -> i32:
        |batch, poses| batch.relations(poses), |querier, [a, b], pose| querier.relation(a, b, pose), |of| of as i32;
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_distances(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const DistanceChoices,
    answers: *mut DistanceRow,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let choices = input::options("options", options)?;
        let exactness = choices.read();
        Question { querier, a, b, poses, count }.answer(
            (answers, choices.is_exact()),
            |batch, poses| batch.distances(poses),
            |querier, [a, b], pose| querier.distance_with(a, b, pose, &exactness),
            DistanceRow::from,
        )
    })
}

/// The least of any number of values, in ascending order, and how many there are.
pub(crate) struct Least<T> {
    most: usize,
    /// At most twice as many: then the greater half goes.
    kept: Vec<T>,
    count: usize,
    out_of_memory: Option<Failure>,
}

impl<T: Ord + Copy> Least<T> {
    pub(crate) fn new(most: usize) -> Self {
        Self { most, kept: Vec::new(), count: 0, out_of_memory: None }
    }

    /// Takes a value, and breaks where memory runs out.
    pub(crate) fn add(&mut self, value: T) -> ControlFlow<()> {
        self.count += 1;
        if self.most == 0 {
            return ControlFlow::Continue(());
        }
        if self.kept.len() == self.kept.capacity() {
            if self.kept.len() >= self.most.saturating_mul(2) {
                self.kept.select_nth_unstable(self.most);
                self.kept.truncate(self.most);
            } else if let Err(failure) = reserve("contacts", self.kept.len().max(16), &mut self.kept) {
                self.out_of_memory = Some(failure);
                return ControlFlow::Break(());
            }
        }
        self.kept.push(value);
        ControlFlow::Continue(())
    }

    pub(crate) fn check(&mut self) -> Result<(), Failure> {
        self.out_of_memory.take().map_or(Ok(()), Err)
    }

    pub(crate) fn finish(mut self) -> (Vec<T>, usize) {
        self.kept.sort_unstable();
        self.kept.truncate(self.most);
        (self.kept, self.count)
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_contacts(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    pose_count: usize,
    counts: *mut usize,
    contacts: *mut ContactRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let question = Question { querier, a, b, poses, count: pose_count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.ask(|querier, batch, [a, b], poses| {
            let mut lists = Lists::new(("contacts", contacts, capacity, count), counts, poses.len())?;
            if let Some(batch) = batch.filter(|_| poses.len() > 1) {
                return lists.finish_with(batch.contacts(poses)?.into_iter().map(Ok::<_, QueryError>));
            }
            for (number, pose) in poses.iter().enumerate() {
                let mut least = Least::new(lists.room());
                let visited = querier.visit_contacts(a, b, pose, |contact| least.add(contact));
                least.check()?;
                visited?;
                let (found, count) = least.finish();
                lists.add(number, found, count);
            }
            lists.finish()
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_first_collision(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    number: *mut usize,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.ask(|querier, batch, [a, b], poses| {
            let first = || {
                if let Some(batch) = batch {
                    return Ok(batch.first_collision(poses)?.unwrap_or(poses.len()));
                }
                for (number, pose) in poses.iter().enumerate() {
                    if querier.collide(a, b, pose)? {
                        return Ok(number);
                    }
                }
                Ok(poses.len())
            };
            write("number", number, first)
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_displacement(
    b: MeshHandle,
    from: *const PoseRows,
    to: *const PoseRows,
    bound: *mut f64,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let shape = MESHES.share("b", b.id)?;
        let (from, to) = (poses::read("from", from)?, poses::read("to", to)?);
        write("bound", bound, || Ok(displacement(&shape, &from, &to)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_values_are_kept() {
        // All numbers below 1009, in an order that jumps about.
        let values: Vec<u32> = (0..1009).map(|k| k * 503 % 1009).collect();
        for most in [0, 1, 2, 15, 16, 17, 100, 504, 505, 1008, 1009, 1010, usize::MAX] {
            let mut least = Least::new(most);
            assert!(values.iter().all(|&value| least.add(value).is_continue()));
            assert!(least.check().is_ok());
            assert!(least.kept.capacity() <= most.saturating_mul(4).max(64), "{most}");
            let (kept, count) = least.finish();
            assert!(kept.into_iter().eq(0..1009.min(most) as u32), "{most}");
            assert_eq!(count, 1009);
        }
    }
}
