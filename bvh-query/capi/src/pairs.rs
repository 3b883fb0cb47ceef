//! Questions about two meshes in many poses.

use crate::at_hand::MESHES;
use crate::entry::entry;
use crate::input::options;
use crate::output::{List, One, Room};
use crate::poses::{pose, poses};
use crate::queriers::{Asker, QUERIERS};
use crate::status::Failure;
use crate::types::{ContactRow, DistanceChoices, DistanceRow, MeshHandle, PoseRows, QuerierHandle, relation};
use bvh_query::{Batch, Pose, Querier, QueryError, Shape, displacement};

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
        let Asker { querier, parallel, budget, at_hand, probes } = &mut **held.value()?;
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

/// `cbvh_relate`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_relate(
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
    unsafe { question.each(answers, |batch, poses| batch.relation(poses), one, relation) }
}

/// `cbvh_distance`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_distance(
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
                    let answers = batch.distance(poses)?.into_iter().enumerate();
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
                let mut list = List::new("contacts", contacts, capacity, count)?;
                let mut counts = Room::new("counts", counts, if counts.is_null() { 0 } else { poses.len() })?;
                let mut add = |number, found: Vec<bvh_query::Contact>| {
                    counts.set(number, found.len());
                    found.into_iter().for_each(|contact| list.push(contact.into()));
                };
                if let Some(batch) = batch {
                    let found = batch.contacts(poses)?.into_iter().enumerate();
                    found.for_each(|(number, found)| add(number, found));
                } else {
                    for (number, pose) in poses.iter().enumerate() {
                        add(number, querier.contacts(a, b, pose)?);
                    }
                }
                list.finish()
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
