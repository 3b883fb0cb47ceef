//! Asks about many poses of one pair of meshes, on all cores.
//!
//! Poses are cut into runs, each with a fresh tracker. The cut depends only on the number of poses. A query therefore reads
//! the same pages, and meets the same errors, on any number of threads. Answers do not depend on the cut.
//!
//! A batch ends at the first pose, in their order, that ends it: by an error, or by the contact that was looked for.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::isa::{Backend, BackendError};
use crate::motion::RigidPath;
use crate::pose::Pose;
use crate::query::contacts::Contact;
use crate::query::depth::clash::{Clash, ClashOptions};
use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::penetration::{Penetration, Separation, unit};
use crate::query::depth::signed_distance::SignedDistance;
use crate::query::distance::Distance;
use crate::query::intersection::{Intersection, IntersectionSurface};
use crate::query::motion::{MotionAnswer, MotionOptions};
use crate::query::options::check_distance;
use crate::query::patches::{PatchOptions, Patches};
use crate::query::pool::Pool;
use crate::query::probe::relation::Relation;
use crate::query::querier::Querier;
use crate::query::regions::ContactRegions;
use crate::query::tracker::Tracker;
use bvh_format::Stop;
use std::sync::Arc;

/// Asks about many poses or motions of one pair of meshes, on all threads of the rayon pool it is called in.
///
/// The answers are those of [`Querier`], bit for bit and in the order of the poses, on any number of threads.
/// Neighbouring poses share a [`Tracker`], so give the poses of a path in the order of the path. Other poses cost as
/// much as one by one. A batch needs the memory of one querier per thread, which it keeps for the next call, and of the
/// answers.
///
/// # Errors
/// Each method returns the error of the first pose, in their order, that has no answer: because a page that its query
/// touches is damaged, or because the budget per pose does not suffice. It may skip later poses.
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
/// assert_eq!(batch.distances(&path)?[32].distance, 0.5);
/// assert_eq!(batch.first_collision(&path)?, Some(64));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Batch<'a> {
    a: Shape<'a>,
    b: Shape<'a>,
    pool: Pool,
}

/// The most poses in a run. Longer runs gain nothing that can be measured.
const MAX_POSES_PER_RUN: usize = 16;
/// The fewest runs that a batch is cut into, if it has as many poses, so that threads end at about the same time.
const MIN_RUNS_PER_BATCH: usize = 32;

impl<'a> Batch<'a> {
    /// Creates a batch with the fastest backend of this CPU, or with the one that the environment variable `CBVH_ISA`
    /// names.
    ///
    /// # Errors
    /// [`BackendError`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn new(a: impl Into<Shape<'a>>, b: impl Into<Shape<'a>>) -> Result<Self, BackendError> {
        Ok(Self::with_backend(a, b, Backend::detect()?))
    }

    /// Creates a batch with a backend. The portable backend replaces one that the CPU lacks.
    pub fn with_backend(a: impl Into<Shape<'a>>, b: impl Into<Shape<'a>>, backend: Backend) -> Self {
        Self { a: a.into(), b: b.into(), pool: Pool::new(backend) }
    }

    /// Bounds the work per pose, as [`Querier::set_budget`] does.
    pub fn set_budget(&mut self, visits: u64) {
        self.pool.budget = visits;
    }

    /// Stops each query when the flag is set, as [`Querier::set_stop`] does. The query then ends with
    /// [`QueryError::Stopped`], and has no answer for any pose.
    pub fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.pool.stop = stop;
    }

    /// Answers [`Querier::collide`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn collide(&self, poses: &[Pose]) -> Result<Vec<bool>, QueryError> {
        self.each(poses, |querier, tracker, pose| tracker.collide(querier, self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::contacts`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn contacts(&self, poses: &[Pose]) -> Result<Vec<Vec<Contact>>, QueryError> {
        self.each(poses, |querier, _, pose| querier.contacts(self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::distance`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn distances(&self, poses: &[Pose]) -> Result<Vec<Distance>, QueryError> {
        self.each(poses, |querier, tracker, pose| tracker.distance(querier, self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::within`] for each pose; `d` is in mesh units.
    ///
    /// # Errors
    /// [`QueryError::Number`] if `d` is negative, NaN or infinite; else the error of the first pose that fails.
    pub fn within(&self, poses: &[Pose], d: f64) -> Result<Vec<bool>, QueryError> {
        check_distance(d)?;
        self.each(poses, |querier, tracker, pose| tracker.within(querier, self.a, self.b, pose, d))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::relation`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn relations(&self, poses: &[Pose]) -> Result<Vec<Relation>, QueryError> {
        self.each(poses, |querier, _, pose| querier.relation(self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::separation`] for each pose, along one direction in A's frame.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the direction is zero or not finite; else the error of the first pose that fails.
    pub fn separations(&self, poses: &[Pose], direction: [f64; 3]) -> Result<Vec<Separation>, QueryError> {
        unit(direction)?;
        self.each(poses, |querier, _, pose| querier.separation(self.a, self.b, pose, direction))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::penetration`] for each pose. Where the budget per pose ends a search, the bounds so far are the answer.
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; else the error of the first pose that fails.
    pub fn penetrations(
        &self,
        poses: &[Pose],
        options: &PenetrationOptions,
    ) -> Result<Vec<Penetration>, QueryError> {
        options.check()?;
        self.each(poses, |querier, _, pose| querier.penetration(self.a, self.b, pose, options))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::signed_distance`] for each pose.
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; else the error of the first pose that fails.
    pub fn signed_distances(
        &self,
        poses: &[Pose],
        options: &PenetrationOptions,
    ) -> Result<Vec<SignedDistance>, QueryError> {
        options.check()?;
        self.each(poses, |querier, tracker, pose| {
            tracker.signed_distance(querier, self.a, self.b, pose, options)
        })
        .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::clash`] for each pose.
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; else the error of the first pose that fails.
    pub fn clashes(&self, poses: &[Pose], options: &ClashOptions) -> Result<Vec<Clash>, QueryError> {
        options.check()?;
        self.each(poses, |querier, _, pose| querier.clash(self.a, self.b, pose, options))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::intersection`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn intersections(&self, poses: &[Pose]) -> Result<Vec<Intersection>, QueryError> {
        self.each(poses, |querier, _, pose| querier.intersection(self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::intersection_surface`] for each pose.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn intersection_surfaces(&self, poses: &[Pose]) -> Result<Vec<IntersectionSurface>, QueryError> {
        self.each(poses, |querier, _, pose| querier.intersection_surface(self.a, self.b, pose))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::contact_regions`] for each pose, with at most `limit` regions for each.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails.
    pub fn contact_regions(&self, poses: &[Pose], limit: usize) -> Result<Vec<ContactRegions>, QueryError> {
        self.each(poses, |querier, _, pose| querier.contact_regions(self.a, self.b, pose, limit))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::patches`] for each pose.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the tolerance is negative, NaN or infinite; else the error of the first pose that fails.
    pub fn patches(&self, poses: &[Pose], options: &PatchOptions) -> Result<Vec<Patches>, QueryError> {
        options.check()?;
        self.each(poses, |querier, _, pose| querier.patches(self.a, self.b, pose, options))
            .map_err(|(_, error)| error)
    }

    /// Returns the number of the first pose, in their order, in which the meshes touch. This tells whether a sampled
    /// motion is free.
    ///
    /// Poses after that one cost next to nothing: each thread tests at most those of its current run.
    ///
    /// # Errors
    /// Returns the error of the first pose that fails, if the meshes touch in no earlier pose.
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

    /// Answers [`Querier::motion`] for each path.
    ///
    /// # Errors
    /// Returns the error of the first path that fails.
    pub fn motions<P: RigidPath + Sync>(
        &self,
        paths: &[P],
        options: &MotionOptions,
    ) -> Result<Vec<MotionAnswer>, QueryError> {
        self.each(paths, |querier, _, path| querier.motion(self.a, self.b, path, options))
            .map_err(|(_, error)| error)
    }

    /// Answers [`Querier::is_free`] for each path, such as the edges of a planner.
    ///
    /// # Errors
    /// Returns the error of the first path that fails.
    pub fn are_free<P: RigidPath + Sync>(
        &self,
        paths: &[P],
        options: &MotionOptions,
    ) -> Result<Vec<bool>, QueryError> {
        self.each(paths, |querier, _, path| querier.is_free(self.a, self.b, path, options))
            .map_err(|(_, error)| error)
    }

    /// Returns what `ask` answers for every pose, or the first pose that ends the batch and what it ended with.
    fn each<P: Sync, T: Send, E: Send>(
        &self,
        poses: &[P],
        ask: impl Fn(&mut Querier, &mut Tracker, &P) -> Result<T, E> + Sync,
    ) -> Result<Vec<T>, (usize, E)> {
        let length = (poses.len() / MIN_RUNS_PER_BATCH).clamp(1, MAX_POSES_PER_RUN);
        let mut answers = Vec::with_capacity(poses.len());
        self.pool.runs(
            rayon::current_num_threads(),
            poses.len(),
            length,
            |querier, numbers| {
                let mut tracker = Tracker::new();
                let answers = numbers
                    .map(|number| ask(querier, &mut tracker, &poses[number]).map_err(|end| (number, end)));
                answers.collect::<Result<Vec<T>, _>>()
            },
            |of_run| answers.extend(of_run),
        )?;
        Ok(answers)
    }
}
