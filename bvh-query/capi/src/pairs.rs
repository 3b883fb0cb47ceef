//! Questions about two meshes in many poses.

use crate::at_hand::MESHES;
use crate::entry::entry;
use crate::input::{options, reserve};
use crate::output::{Lists, One, Room};
use crate::poses::{pose, poses};
use crate::queriers::{Asker, QUERIERS};
use crate::status::Failure;
use crate::types::{ContactRow, DistanceChoices, DistanceRow, MeshHandle, PoseRows, QuerierHandle, relation};
use bvh_query::{Batch, Pose, Querier, QueryError, Shape, displacement};
use std::ops::ControlFlow;

/// A querier, two meshes, and poses of the second in the frame of the first.
struct Question {
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
}

impl Question {
    /// Checks what is given, and calls `ask`.
    ///
    /// # Safety
    /// As for `poses`.
    unsafe fn ask(
        &self,
        ask: impl FnOnce(&mut Querier, Option<Batch<'_>>, [Shape<'_>; 2], &[Pose]) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut held = QUERIERS.hold("querier", self.querier.id)?;
        let asker = &mut **held.value()?;
        let parallel = asker.uses_all_cores();
        let Asker { querier, budget, at_hand, probes, .. } = asker;
        let (a, b) = at_hand.pair(self.a, self.b)?;
        // SAFETY: the caller vouches for it.
        unsafe { poses("poses", self.poses, self.count, &mut probes.poses) }?;
        let batch = parallel.then(|| {
            let mut batch = Batch::with_backend(a, b, querier.backend());
            batch.set_budget(*budget);
            batch
        });
        ask(querier, batch, [a, b], &probes.poses)
    }

    /// Asks about each pose, and writes an answer for each.
    ///
    /// # Safety
    /// As for `poses`, and for `Room::new`.
    unsafe fn each<T, R: Copy>(
        &self,
        answers: *mut R,
        all: impl FnOnce(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError>,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
        row: impl Fn(T) -> R,
    ) -> i32 {
        entry(|| {
            // SAFETY: the caller vouches for it.
            unsafe {
                self.ask(|querier, batch, meshes, poses| {
                    let mut room = Room::new("answers", answers, poses.len())?;
                    if let Some(batch) = batch {
                        let answers = all(&batch, poses)?.into_iter().enumerate();
                        answers.for_each(|(number, answer)| room.set(number, row(answer)));
                        return Ok(());
                    }
                    for (number, pose) in poses.iter().enumerate() {
                        room.set(number, row(one(querier, meshes, pose)?));
                    }
                    Ok(())
                })
            }
        })
    }
}

/// `cbvh_collide`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_collide(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    answers: *mut bool,
) -> i32 {
    let one = |querier: &mut Querier, [a, b]: [Shape<'_>; 2], pose: &Pose| querier.collide(a, b, pose);
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    unsafe { question.each(answers, |batch, poses| batch.collide(poses), one, |answer| answer) }
}

/// `cbvh_within`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_within(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    d: f64,
    answers: *mut bool,
) -> i32 {
    let one = |querier: &mut Querier, [a, b]: [Shape<'_>; 2], pose: &Pose| querier.within(a, b, pose, d);
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    unsafe { question.each(answers, |batch, poses| batch.within(poses, d), one, |answer| answer) }
}

/// `cbvh_relations`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_relations(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    answers: *mut i32,
) -> i32 {
    let one = |querier: &mut Querier, [a, b]: [Shape<'_>; 2], pose: &Pose| querier.relation(a, b, pose);
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    unsafe { question.each(answers, |batch, poses| batch.relations(poses), one, relation) }
}

/// `cbvh_distances`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_distances(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    choices: *const DistanceChoices,
    answers: *mut DistanceRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    entry(|| {
        // SAFETY: the header asks for it.
        let choices = unsafe { options("options", choices) }?;
        let exactness = choices.read();
        // SAFETY: the header asks for it.
        unsafe {
            question.ask(|querier, batch, [a, b], poses| {
                let mut room = Room::new("answers", answers, poses.len())?;
                // A batch knows exact distances only.
                if let Some(batch) = batch.filter(|_| choices.is_exact()) {
                    let answers = batch.distances(poses)?.into_iter().enumerate();
                    answers.for_each(|(number, answer)| room.set(number, answer.into()));
                    return Ok(());
                }
                for (number, pose) in poses.iter().enumerate() {
                    room.set(number, querier.distance_with(a, b, pose, &exactness)?.into());
                }
                Ok(())
            })
        }
    })
}

/// The least of any number of values, in ascending order, and how many there are.
struct Least<T> {
    most: usize,
    /// At most twice as many: then the greater half goes.
    kept: Vec<T>,
    count: usize,
    out_of_memory: Option<Failure>,
}

impl<T: Ord + Copy> Least<T> {
    fn new(most: usize) -> Self {
        Self { most, kept: Vec::new(), count: 0, out_of_memory: None }
    }

    /// Takes a value, and breaks where memory runs out.
    fn add(&mut self, value: T) -> ControlFlow<()> {
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

    fn check(&mut self) -> Result<(), Failure> {
        self.out_of_memory.take().map_or(Ok(()), Err)
    }

    fn finish(mut self) -> (Vec<T>, usize) {
        self.kept.sort_unstable();
        self.kept.truncate(self.most);
        (self.kept, self.count)
    }
}

/// `cbvh_contacts`.
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
    entry(|| {
        // SAFETY: the header asks for it.
        unsafe {
            question.ask(|querier, batch, [a, b], poses| {
                let mut lists = Lists::new(("contacts", contacts, capacity, count), counts, poses.len())?;
                if let Some(batch) = batch.filter(|_| poses.len() > 1) {
                    for (number, found) in batch.contacts(poses)?.into_iter().enumerate() {
                        let count = found.len();
                        lists.add(number, found.into_iter().map(ContactRow::from), count);
                    }
                    return lists.finish();
                }
                for (number, pose) in poses.iter().enumerate() {
                    let mut least = Least::new(lists.room());
                    let visited = querier.visit_contacts(a, b, pose, |contact| least.add(contact));
                    least.check()?;
                    visited?;
                    let (found, count) = least.finish();
                    lists.add(number, found.into_iter().map(ContactRow::from), count);
                }
                lists.finish()
            })
        }
    })
}

/// `cbvh_first_collision`.
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
    entry(|| {
        // SAFETY: the header asks for it.
        unsafe {
            question.ask(|querier, batch, [a, b], poses| {
                let mut out = One::new("number", number)?;
                let mut first = None;
                if let Some(batch) = batch {
                    first = batch.first_collision(poses)?;
                } else {
                    for (number, pose) in poses.iter().enumerate() {
                        if querier.collide(a, b, pose)? {
                            first = Some(number);
                            break;
                        }
                    }
                }
                out.set(first.unwrap_or(poses.len()));
                Ok(())
            })
        }
    })
}

/// `cbvh_displacement`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_displacement(
    b: MeshHandle,
    from: *const PoseRows,
    to: *const PoseRows,
    bound: *mut f64,
) -> i32 {
    entry(|| {
        let shape = MESHES.share("b", b.id)?;
        // SAFETY: the header asks for it.
        unsafe {
            let (from, to) = (pose("from", from)?, pose("to", to)?);
            One::new("bound", bound)?.set(displacement(&shape, &from, &to));
        }
        Ok(())
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
