//! Scenes: many placed shapes, and questions over all pairs of them that may meet.
//!
//! ```text
//! set_pose ──> box in the world ──> tree of boxes (broad phase)
//! question ──> pairs whose boxes are near, groups meet, contact is not allowed
//!          ──> Pose::relative, Querier: one pair at a time, on one thread or on all ──> answers in the order of the pairs
//! ```

mod attachments;
mod broad_phase;
mod candidates;
mod contents;
mod error;
mod groups;
mod instance;
mod motions;
mod pair_questions;
mod probes;
mod signed_distance;
mod trackers;
mod workers;
mod world_box;

pub use candidates::ScenePair;
pub use error::{InstanceLabel, SceneError};
pub use groups::Groups;
pub use instance::InstanceId;
pub use motions::SceneMotionAnswer;
pub use pair_questions::{SceneClash, SceneContact, SceneDistance};
pub use probes::{SceneClosestPoint, SceneRayHit};
pub use signed_distance::SceneSignedDistance;

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::files::SceneShape;
use crate::file::owned_shape::OwnedShape;
use crate::file::shape::check_radius;
use crate::isa::{Backend, BackendError};
use crate::pose::Pose;
use crate::query::stats::QueryStats;
use bvh_format::Stop;
use contents::{Contents, check_world};
use instance::Instance;
use std::sync::Arc;
use trackers::Trackers;
use workers::Workers;

/// Many placed shapes, and queries over all pairs that may meet.
///
/// An instance is a shape with a pose in the world. A query is about all pairs of instances whose [`Groups`] meet
/// and whose contact is not allowed ([`Scene::set_allowed`]). The lower [`InstanceId`] of a pair is A. The answer about
/// a pair is that of [`Querier`](crate::Querier) for `Pose::relative(world_a, world_b)`, and for the radii that margins
/// make, to the bit. Answers are in
/// ascending order of the pairs. They depend neither on the broad phase, nor on the backend, nor on the number of
/// threads, nor on earlier queries.
///
/// Errors may depend on the number of threads and on earlier queries in two cases. If a page is damaged, this holds
/// for [`Scene::collide`], [`Scene::within`] and [`Scene::distance`], whose answers may not need all pairs. If a budget
/// runs out, it holds for every query: see [`Scene::set_budget`].
///
/// A query first finds near pairs and then tests them, at most 65,536 at a time plus those of one more instance.
/// Memory therefore grows with the number of instances and not with the number of pairs.
///
/// Cost: moving an instance takes some 0.2 us. A query with nothing near takes some 1.7 us if 8 of 100 instances move
/// (AMD EPYC, family 25). A query reads the object table of each file, and pages only of instances that are near
/// another one.
///
/// # Threads
/// A clone takes 0.03 us, however many instances there are: clones share what the scene holds until one of them changes.
/// The first change while another clone lives copies the tables, but no shape: see [`Scene::snapshot`]. So some threads
/// may query a scene while others change it. Each query is about a snapshot, and nobody waits for a query:
///
/// ```
/// use bvh_query::{Pose, Scene};
/// use std::sync::Mutex;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let cloud = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// # let next_cloud = cloud.clone();
/// let mut scene = Scene::new()?;
/// let seen = scene.add(cloud, Pose::IDENTITY)?;
/// let shared = Mutex::new(scene);
/// std::thread::scope(|threads| {
///     threads.spawn(|| {
///         let mut own = shared.lock().unwrap().snapshot();
///         for _ in 0..10 {
///             assert!(!own.collide().unwrap());
///             let now = shared.lock().unwrap().snapshot();
///             own.clone_from(&now); // It keeps what it remembers of its queries.
///         }
///     });
///     shared.lock().unwrap().set_shape(seen, next_cloud)
/// })?;
/// # Ok(())
/// # }
/// ```
///
/// # Examples
/// ```
/// use bvh_query::{Bvh, Pose, Scene};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let bvh = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// let at = |height: f64| Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, height]);
/// let mut scene = Scene::new()?;
/// let floor = scene.add(bvh.clone(), at(0.0)?)?;
/// let part = scene.add(bvh, at(2.0)?)?;
/// assert!(!scene.collide()?);
/// assert_eq!(scene.distance()?.map(|found| found.nearest.distance), Some(2.0));
/// scene.set_pose(part, at(0.0)?)?;
/// assert_eq!(scene.pairs_in_contact()?.len(), 1);
/// scene.set_allowed(floor, part, true)?;
/// assert!(!scene.collide()?);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Scene {
    /// Shared by clones until one of them changes.
    contents: Arc<Contents>,
    workers: Workers,
    /// The pair that was nearest, or in contact, in the last question: a likely answer of the next.
    likely: Option<(u32, u32)>,
    trackers: Trackers,
    stats: QueryStats,
    pairs_asked: u64,
    /// The poses of the last move of many instances, whose memory the next one uses.
    moved: Vec<(u32, Pose)>,
}

impl Clone for Scene {
    /// Returns a scene of the same instances and settings, which remembers nothing of earlier questions.
    fn clone(&self) -> Self {
        Self {
            contents: Arc::clone(&self.contents),
            workers: self.workers.clone(),
            likely: self.likely,
            trackers: self.trackers.clone(),
            stats: self.stats,
            pairs_asked: self.pairs_asked,
            moved: Vec::new(),
        }
    }

    /// Makes this a scene of the same instances and settings, which keeps what it remembers of its own questions:
    /// decoded nodes, and trackers of pairs. None of it affects an answer.
    fn clone_from(&mut self, source: &Self) {
        self.contents = Arc::clone(&source.contents);
        self.workers.adopt(&source.workers);
        self.trackers.on = source.trackers.on;
        (self.stats, self.pairs_asked) = (source.stats, source.pairs_asked);
    }
}

impl Scene {
    /// Creates an empty scene with the fastest backend of this CPU, or with the one that the environment variable
    /// `CBVH_ISA` names.
    ///
    /// # Errors
    /// [`BackendError`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn new() -> Result<Self, BackendError> {
        Ok(Self::with_backend(Backend::detect()?))
    }

    /// Creates an empty scene with a backend. The portable backend replaces one that the CPU lacks.
    pub fn with_backend(backend: Backend) -> Self {
        Self {
            contents: Arc::default(),
            workers: Workers::new(backend),
            likely: None,
            trackers: Trackers::default(),
            stats: QueryStats::default(),
            pairs_asked: 0,
            moved: Vec::new(),
        }
    }

    /// Creates a scene from the instances of a file, in their order. A bake with the option `scene` makes such files.
    ///
    /// Cost: reading the instances, and some 0.5 to 1.5 us per instance. The rest of the file is read when a query
    /// needs it.
    ///
    /// # Errors
    /// [`SceneError::NoInstances`] if the file has no instances; [`SceneError::Query`] if its instances break
    /// a rule of the format; [`SceneError::Backend`] as for [`Scene::new`].
    pub fn of_file(bvh: Bvh) -> Result<Self, SceneError> {
        Self::of_file_with_backend(bvh, Backend::detect()?)
    }

    /// Creates a scene from the instances of a file, as [`Scene::of_file`] does, with a backend. The portable backend
    /// replaces one that the CPU lacks.
    ///
    /// # Errors
    /// The errors of [`Scene::of_file`], except those of the backend.
    pub fn of_file_with_backend(bvh: Bvh, backend: Backend) -> Result<Self, SceneError> {
        let instances = bvh.layout().read_instances(bvh.bytes()).map_err(QueryError::from)?;
        if instances.is_empty() {
            return Err(SceneError::NoInstances);
        }
        let mut scene = Self::with_backend(backend);
        for instance in instances {
            // The instance is of an object of the file (rule 41), rigid (rule 42), has a name of its own (rule 43), and its
            // margin is valid (rule 50).
            let shape = OwnedShape::object(bvh.clone(), instance.object as usize);
            let shape = shape.unwrap_or_else(|| bvh.clone().into()).solid_if(instance.solid);
            let world = Pose::of_valid(instance.rotation, instance.translation);
            let name = Some(instance.name).filter(|name| !name.is_empty());
            let groups = Groups { member: instance.member, meets: instance.meets };
            let id = scene.contents_mut().insert(name, shape.into(), world, groups);
            if instance.margin > 0.0 {
                scene.contents_mut().change(id.place, |of| of.margin = instance.margin);
            }
        }
        Ok(scene)
    }

    /// Lets queries use all threads of the rayon pool in which they are called. By default they use one thread.
    #[cfg(feature = "parallel")]
    pub fn set_parallel(&mut self, parallel: bool) {
        self.workers.parallel = parallel;
    }

    /// Lets the scene keep a [`Tracker`](crate::Tracker) for each pair, for queries about contact and about a
    /// distance to compare with. It affects no answer, and saves time if instances move little from query to
    /// query.
    ///
    /// On the project's test scenes, where instances move by some 3 degrees per frame, a frame takes 0.95 to 1.17 times
    /// as long. With a twentieth of these steps it takes 0.84 to 1.12 times as long, and with a two-hundredth 0.61 to
    /// 0.83 times. A tracker holds some 300 bytes. A scene has one for each of the first 16,384 pairs of the last
    /// query, at most as many more for those of the query before, and up to 1,024 others.
    ///
    /// With a tracker, a query makes fewer visits. It may therefore have an answer where it would otherwise meet a
    /// damaged page or exceed the budget.
    pub fn set_tracking(&mut self, tracking: bool) {
        self.trackers.on = tracking;
    }

    /// Limits each query to this many visits over all its pairs, and each point, ray or segment to this many over
    /// all instances. Without a budget, only the number of instances and the sizes of the files limit a query.
    ///
    /// Two kinds of visits count: those of [`Querier::set_budget`](crate::Querier::set_budget) for each pair tested,
    /// and those of the broad phase. The latter are the comparisons of a box with up to sixteen others at once, and the pairs
    /// of boxes that these leave; for a probe the boxes that the search for near ones tests. So both time and memory are
    /// limited, however many instances a file puts in one place.
    ///
    /// If the visits run out, the error is [`SceneError::Pair`] or [`SceneError::Instance`] with
    /// [`QueryError::Budget`](crate::QueryError::Budget), or [`SceneError::Query`] with it in the broad phase. If the
    /// answer needs all pairs, the number of threads does not affect whether the visits suffice. It does affect which
    /// pair the error names, and t threads may make t times as many visits before they stop.
    pub fn set_budget(&mut self, visits: u64) {
        self.workers.pool.budget = visits;
    }

    /// Stops each query when the flag is set, as [`Querier::set_stop`](crate::Querier::set_stop) does. The error is
    /// [`SceneError::Pair`] or [`SceneError::Instance`] with [`QueryError::Stopped`](crate::QueryError::Stopped), or
    /// [`SceneError::Query`] with it in the broad phase. Copies of the scene share the flag.
    pub fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.workers.pool.stop = stop;
    }

    /// Adds an instance. It is in all groups, and no other instance is allowed to touch it.
    ///
    /// # Errors
    /// [`SceneError::Pose`] if the rotation is not rigid to within 2^-23 or the translation exceeds 2^118 along an
    /// axis: within these limits every pair of instances has a relative pose. [`Pose::nearest`] orthonormalises a
    /// rotation.
    pub fn add(&mut self, shape: impl Into<SceneShape>, world: Pose) -> Result<InstanceId, SceneError> {
        self.add_checked(None, shape.into(), world)
    }

    /// Adds an instance with a name of its own.
    ///
    /// # Errors
    /// [`SceneError::NameTaken`] if another instance has the name, and the errors of [`Scene::add`].
    pub fn add_named(
        &mut self,
        name: impl Into<String>,
        shape: impl Into<SceneShape>,
        world: Pose,
    ) -> Result<InstanceId, SceneError> {
        self.add_checked(Some(name.into()), shape.into(), world)
    }

    fn add_checked(
        &mut self,
        name: Option<String>,
        shape: SceneShape,
        world: Pose,
    ) -> Result<InstanceId, SceneError> {
        if let Err(source) = check_world(&world) {
            let instance = InstanceLabel { id: self.contents.next_id(), name: name.map(Box::from) };
            return Err(SceneError::Pose { instance, source });
        }
        match name {
            Some(name) if self.find(&name).is_some() => Err(SceneError::NameTaken(name)),
            name => Ok(self.contents_mut().insert(name, shape, world, Groups::ALL)),
        }
    }

    /// Removes an instance, and its permissions to touch others. Instances that are attached to it stay where they are
    /// and are no longer attached.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`] if the scene never had such an instance, or no longer has it.
    pub fn remove(&mut self, id: InstanceId) -> Result<(), SceneError> {
        self.place(id)?;
        self.contents_mut().remove(id.place);
        self.likely = self.likely.filter(|&(a, b)| a != id.place && b != id.place);
        Ok(())
    }

    /// Replaces the shape of an instance. The instance keeps its identifier, name, pose, margins, groups, permissions and
    /// attachments. Use it for a cloud of points that a camera sees again and again.
    ///
    /// Cost: some 0.1 us. Baking the shape takes longer, and needs no scene.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn set_shape(&mut self, id: InstanceId, shape: impl Into<SceneShape>) -> Result<(), SceneError> {
        self.change(id, |instance| instance.set_shape(shape.into()))
    }

    /// Moves an instance, and those that are attached to it. If the instance is attached itself, it moves in the frame of
    /// its parent, and follows it from there: see [`Scene::attach`].
    ///
    /// # Errors
    /// [`SceneError::NoInstance`], or [`SceneError::Pose`] as for [`Scene::add`], also for a pose to which an
    /// attached instance would follow. Then nothing has moved.
    pub fn set_pose(&mut self, id: InstanceId, world: Pose) -> Result<(), SceneError> {
        self.contents.check_pose(id, &world)?;
        self.move_to(&[(id.place, world)])
    }

    /// Moves many instances. If an instance is named twice, the last pose counts. Otherwise their order does not matter:
    /// each instance is moved to the pose given, and those that are attached to it and not named follow.
    ///
    /// # Errors
    /// The errors of [`Scene::set_pose`]. Then none has moved.
    pub fn set_poses(
        &mut self,
        poses: impl IntoIterator<Item = (InstanceId, Pose)>,
    ) -> Result<(), SceneError> {
        let mut moved = std::mem::take(&mut self.moved);
        moved.clear();
        for (id, world) in poses {
            self.contents.check_pose(id, &world)?;
            moved.push((id.place, world));
        }
        let result = self.move_to(&moved);
        self.moved = moved;
        result
    }

    /// Moves the instances in some places to poses that are valid.
    fn move_to(&mut self, poses: &[(u32, Pose)]) -> Result<(), SceneError> {
        if self.contents.move_alone(poses.iter().map(|&(place, _)| place)) {
            self.contents_mut().place_each(poses);
        } else {
            let moves = self.contents.moves(poses)?;
            self.contents_mut().carry_out(&moves);
        }
        Ok(())
    }

    /// Updates what the next query would update first, and returns a clone: the scene as it is now. Queries about
    /// the clone then change nothing that both share. Take it under a lock, and query it without the lock; changes of this
    /// scene do not affect it.
    ///
    /// Cost: as for a clone, after the update. While a snapshot lives, the first change of either scene copies the
    /// tables, which takes 1.4 to 2.5 us for 60 instances and 0.22 to 0.34 ms for 10,000, the more with three permissions
    /// to touch each (AMD EPYC, family 26, 2026-11-25).
    pub fn snapshot(&mut self) -> Self {
        self.refresh();
        self.clone()
    }

    /// Gives an instance a margin in mesh units, which is added to the radius of its shape in every query. It is 0 at
    /// first. What is attached to the instance has a margin of its own.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`], or [`SceneError::Margin`] for a margin that is negative, NaN or above 2^118.
    pub fn set_margin(&mut self, id: InstanceId, margin: f64) -> Result<(), SceneError> {
        self.place(id)?;
        check_margin(margin)?;
        self.change(id, |instance| instance.margin = margin)
    }

    /// Gives a pair of instances a margin in mesh units, besides those that each of both has. Queries about the pair add it to
    /// the margin of the lower instance, which is A. It is 0 at first.
    ///
    /// # Errors
    /// The errors of [`Scene::set_margin`].
    pub fn set_pair_margin(&mut self, a: InstanceId, b: InstanceId, margin: f64) -> Result<(), SceneError> {
        let (a, b) = (self.place(a)? as u32, self.place(b)? as u32);
        check_margin(margin)?;
        self.contents_mut().set_pair_margin((a.min(b), a.max(b)), margin);
        Ok(())
    }

    /// Returns the margin of an instance.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn margin(&self, id: InstanceId) -> Result<f64, SceneError> {
        Ok(self.instance(id)?.margin)
    }

    /// Returns the margin that a pair has of its own.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn pair_margin(&self, a: InstanceId, b: InstanceId) -> Result<f64, SceneError> {
        Ok(self.contents.margin_of_pair(self.place(a)? as u32, self.place(b)? as u32))
    }

    /// Returns the pairs that have margins of their own, in ascending order.
    pub fn pair_margins(&self) -> impl Iterator<Item = (ScenePair, f64)> {
        let id = |place: u32| self.contents.id_at(place);
        let mut pairs: Vec<_> = self.contents.pair_margins.iter().collect();
        pairs.sort_unstable_by_key(|(places, _)| **places);
        let pair =
            move |(&(a, b), &margin): (&(u32, u32), &f64)| Some((ScenePair { a: id(a)?, b: id(b)? }, margin));
        pairs.into_iter().filter_map(pair)
    }

    /// Puts an instance into groups.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn set_groups(&mut self, id: InstanceId, groups: Groups) -> Result<(), SceneError> {
        self.place(id)?;
        self.contents_mut().set_groups(id.place, groups);
        Ok(())
    }

    /// Allows two instances to touch, or forbids it again. An allowed pair takes part in no query: neighbours on a robot,
    /// or a part and its gripper.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn set_allowed(&mut self, a: InstanceId, b: InstanceId, allowed: bool) -> Result<(), SceneError> {
        for id in [a, b] {
            self.place(id)?;
        }
        self.contents_mut().set_allowed(a.place, b.place, allowed);
        Ok(())
    }

    /// Returns the instance with a name.
    pub fn find(&self, name: &str) -> Option<InstanceId> {
        self.contents.id_at(*self.contents.names.get(name)?)
    }

    /// Returns the name of an instance, if it has one.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn name(&self, id: InstanceId) -> Result<Option<&str>, SceneError> {
        Ok(self.instance(id)?.name.as_deref())
    }

    /// Returns the shape of an instance.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn shape(&self, id: InstanceId) -> Result<&SceneShape, SceneError> {
        Ok(&self.instance(id)?.shape)
    }

    /// Returns the pose of an instance in the world.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn pose(&self, id: InstanceId) -> Result<&Pose, SceneError> {
        Ok(&self.instance(id)?.world)
    }

    /// Returns the groups of an instance.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn groups(&self, id: InstanceId) -> Result<Groups, SceneError> {
        Ok(self.instance(id)?.groups)
    }

    /// Returns the pairs that [`Scene::set_allowed`] lets touch, in ascending order.
    pub fn allowed(&self) -> impl Iterator<Item = ScenePair> {
        self.instances().flat_map(move |a| {
            let allowed = self.contents.at(a.place).into_iter().flat_map(|instance| &instance.allowed);
            let lower = allowed.filter(move |&&place| place > a.place);
            lower.filter_map(move |&place| Some(ScenePair { a, b: self.contents.id_at(place)? }))
        })
    }

    /// Returns all instances in ascending order.
    pub fn instances(&self) -> impl Iterator<Item = InstanceId> {
        self.contents.each().map(|(place, instance)| instance.id(place))
    }

    /// Returns the number of instances.
    pub fn len(&self) -> usize {
        self.contents.each().count()
    }

    /// Returns whether there are no instances.
    pub fn is_empty(&self) -> bool {
        self.contents.each().next().is_none()
    }

    /// Returns how much work the last query took, over all its pairs.
    pub fn stats(&self) -> QueryStats {
        self.stats
    }

    /// Returns how many times the last query tested a pair of instances.
    pub fn pairs_asked(&self) -> u64 {
        self.pairs_asked
    }

    fn instance(&self, id: InstanceId) -> Result<&Instance, SceneError> {
        self.contents.instance(id)
    }

    fn place(&self, id: InstanceId) -> Result<usize, SceneError> {
        self.instance(id).map(|_| id.place as usize)
    }

    /// Returns what the scene holds, to change it: a copy if clones share it. Inlined, each change would have the code that
    /// copies.
    #[inline(never)]
    fn contents_mut(&mut self) -> &mut Contents {
        Arc::make_mut(&mut self.contents)
    }

    /// Changes an instance that exists, and its box.
    fn change(&mut self, id: InstanceId, change: impl FnOnce(&mut Instance)) -> Result<(), SceneError> {
        self.place(id)?;
        self.contents_mut().change(id.place, change);
        Ok(())
    }

    /// Updates the broad phase if instances have changed.
    fn refresh(&mut self) {
        if self.contents.broad.is_out_of_date() {
            self.contents_mut().refresh();
        }
    }

    /// Starts a question.
    fn start(&mut self) {
        (self.stats, self.pairs_asked) = (QueryStats::default(), 0);
        self.workers.start();
        self.trackers.start();
        self.refresh();
    }
}

/// Refuses an invalid margin.
fn check_margin(margin: f64) -> Result<(), SceneError> {
    check_radius(margin).map_err(|_| SceneError::Margin(margin))
}
