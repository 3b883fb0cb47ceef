//! Many poses of one pair of meshes, on all cores.
//!
//! Poses are cut into runs; each thread takes the next run, has one querier for all of its runs and a fresh tracker
//! for each. How poses are cut depends on their number alone, so that what a query reads, and hence which errors
//! there are, is the same on any number of threads. Answers are, whatever is read.
//!
//! A batch ends at the first pose, in order, that ends it: an error, or the contact that was looked for. Runs are taken
//! in order, and one is left out only if it lies behind an end that is known. So every pose before the first end has
//! been asked about, and threads work on what is needed for all but the last few runs.

use super::tracker::Tracker;
use super::{Contact, Distance, Querier};
use crate::bvh::Shape;
use crate::error::QueryError;
use crate::isa::Backend;
use crate::pose::Pose;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Asks about many poses of one pair of meshes, on all threads of the rayon pool it is called in.
///
/// Answers are those of [`Querier`], bit for bit and in the order of the poses, on any number of threads. Poses that
/// follow a path are best given in its order, since neighbours share a [`Tracker`]; others cost what they do one by
/// one. Memory is that of a querier a thread, and of the answers.
///
/// # Errors
/// A method fails as the first pose does, in their order, that cannot be answered: if a page that its query touches
/// is damaged, or the budget of a pose does not suffice. Poses behind it may not be looked at.
///
/// ```
/// use bvh_query::{Batch, Bvh, Pose};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let triangle = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// let down = |step: i32| Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 1.0 - f64::from(step) / 64.0]);
/// let path: Vec<Pose> = (0..100).map(down).collect::<Result<_, _>>()?;
/// let batch = Batch::new(&triangle, &triangle)?;
/// assert_eq!(batch.distance(&path)?[32].distance, 0.5);
/// assert_eq!(batch.first_collision(&path)?, Some(64));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    a: Shape<'a>,
    b: Shape<'a>,
    backend: Backend,
    budget: u64,
}

/// The most poses in a run: longer ones gain nothing that shows.
const LONGEST_RUN: usize = 16;
/// Short batches are cut into this many runs, so that threads end at about the same time.
const RUNS: usize = 32;

impl<'a> Batch<'a> {
    /// With the fastest backend of this CPU, or the one that `CBVH_ISA` names.
    ///
    /// # Errors
    /// If `CBVH_ISA` names no backend or one that the CPU lacks.
    pub fn new(a: impl Into<Shape<'a>>, b: impl Into<Shape<'a>>) -> Result<Self, QueryError> {
        Ok(Self::with_backend(a, b, Backend::detect()?))
    }

    /// With a backend; one that the CPU lacks is replaced by the scalar one.
    pub fn with_backend(a: impl Into<Shape<'a>>, b: impl Into<Shape<'a>>, backend: Backend) -> Self {
        Self { a: a.into(), b: b.into(), backend, budget: u64::MAX }
    }

    /// Bounds the work for each pose, as [`Querier::set_budget`].
    pub fn set_budget(&mut self, visits: u64) {
        self.budget = visits;
    }

    /// [`Querier::collide`] of each pose.
    ///
    /// # Errors
    /// That of the first pose that has one.
    pub fn collide(&self, poses: &[Pose]) -> Result<Vec<bool>, QueryError> {
        self.each(poses, |querier, tracker, pose| tracker.collide(querier, self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// [`Querier::contacts`] of each pose.
    ///
    /// # Errors
    /// That of the first pose that has one.
    pub fn contacts(&self, poses: &[Pose]) -> Result<Vec<Vec<Contact>>, QueryError> {
        self.each(poses, |querier, _, pose| querier.contacts(self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// [`Querier::distance`] of each pose.
    ///
    /// # Errors
    /// That of the first pose that has one.
    pub fn distance(&self, poses: &[Pose]) -> Result<Vec<Distance>, QueryError> {
        self.each(poses, |querier, tracker, pose| tracker.distance(querier, self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// [`Querier::within`] of each pose; `d` in mesh units.
    ///
    /// # Errors
    /// That of the first pose that has one.
    pub fn within(&self, poses: &[Pose], d: f64) -> Result<Vec<bool>, QueryError> {
        self.each(poses, |querier, tracker, pose| tracker.within(querier, self.a, self.b, pose, d))
            .map_err(|(_, error)| error)
    }

    /// The first pose, in their order, in which the meshes touch: whether a motion sampled by poses is free.
    ///
    /// Poses behind it cost next to nothing: each thread looks at no more than those of the run it is in.
    ///
    /// # Errors
    /// That of the first pose that has one, if none before it touches.
    pub fn first_collision(&self, poses: &[Pose]) -> Result<Option<usize>, QueryError> {
        let ended =
            self.each(poses, |querier, tracker, pose| match tracker.collide(querier, self.a, self.b, pose) {
                Ok(false) => Ok(()),
                Ok(true) => Err(None),
                Err(error) => Err(Some(error)),
            });
        match ended {
            Ok(_) => Ok(None),
            Err((index, None)) => Ok(Some(index)),
            Err((_, Some(error))) => Err(error),
        }
    }

    /// What `ask` says of every pose, or the first pose that ends the batch and what it ended with.
    fn each<T: Send, E: Send>(
        &self,
        poses: &[Pose],
        ask: impl Fn(&mut Querier, &mut Tracker, &Pose) -> Result<T, E> + Sync,
    ) -> Result<Vec<T>, (usize, E)> {
        let length = (poses.len() / RUNS).clamp(1, LONGEST_RUN);
        let runs = poses.len().div_ceil(length);
        let shared = Shared { next: AtomicUsize::new(0), end: AtomicUsize::new(usize::MAX) };
        let threads = rayon::current_num_threads().min(runs);
        let share = |_| {
            let mut querier = Querier::with_backend(self.backend);
            querier.set_budget(self.budget);
            let mut share = Share { answers: Vec::new(), end: None };
            while let Some(start) = shared.take(length, poses.len()) {
                let mut tracker = Tracker::new();
                for (index, pose) in poses.iter().enumerate().skip(start).take(length) {
                    if !shared.is_needed(index) {
                        break;
                    }
                    match ask(&mut querier, &mut tracker, pose) {
                        Ok(answer) => share.answers.push((index, answer)),
                        Err(end) => {
                            shared.end_at(index);
                            share.end = Some((index, end));
                            // What it would take next is behind this.
                            return share;
                        }
                    }
                }
            }
            share
        };
        let shares: Vec<_> = (0..threads).into_par_iter().with_max_len(1).map(share).collect();
        let mut answers: Vec<Option<T>> = poses.iter().map(|_| None).collect();
        let mut ends = Vec::new();
        for share in shares {
            share.answers.into_iter().for_each(|(index, answer)| answers[index] = Some(answer));
            ends.extend(share.end);
        }
        match ends.into_iter().min_by_key(|(index, _)| *index) {
            Some(end) => Err(end),
            None => Ok(answers.into_iter().flatten().collect()),
        }
    }
}

/// What a thread has done.
struct Share<T, E> {
    answers: Vec<(usize, T)>,
    end: Option<(usize, E)>,
}

/// What threads know of each other. Each number stands for itself, so relaxed accesses will do.
struct Shared {
    /// The next run to take.
    next: AtomicUsize,
    /// The first pose known to end the batch.
    end: AtomicUsize,
}

impl Shared {
    /// The first pose of the next run of `length`, if there is one that is needed.
    fn take(&self, length: usize, poses: usize) -> Option<usize> {
        let start = self.next.fetch_add(1, Ordering::Relaxed).checked_mul(length)?;
        (start < poses && self.is_needed(start)).then_some(start)
    }

    /// False for poses behind an end.
    fn is_needed(&self, index: usize) -> bool {
        index < self.end.load(Ordering::Relaxed)
    }

    fn end_at(&self, index: usize) {
        self.end.fetch_min(index, Ordering::Relaxed);
    }
}
