//! Scenes: many placed shapes, and questions over all pairs of them that may meet.
//!
//! ```text
//! set_pose ──> box in the world ──> tree of boxes (broad phase)
//! question ──> pairs whose boxes are near, groups meet, contact is not allowed
//!          ──> Pose::relative, Querier: one pair at a time, on one thread or on all ──> answers in the order of the pairs
//! ```

mod broad_phase;
mod error;
mod groups;
mod instance;
mod motion;
mod probe;
mod question;
mod trackers;
mod workers;
mod world_box;

pub use error::{InstanceError, InstanceLabel, SceneError, SceneFileError, WorldPoseError};
pub use groups::Groups;
pub use instance::InstanceId;
pub use motion::SceneMotionAnswer;
pub use probe::{SceneClosestPoint, SceneRayHit};
pub use question::{SceneContact, SceneDistance, ScenePair};

use crate::file::bvh::Bvh;
use crate::file::files::SceneShape;
use crate::file::owned_shape::OwnedShape;
use crate::file::shape::check_radius;
use crate::isa::{Backend, BackendError};
use crate::pose::Pose;
use crate::query::answers::QueryStats;
use crate::query::motion::size_of;
use broad_phase::BroadPhase;
use bvh_format::instances::{MAX_RIGID_ERROR, MAX_WORLD, departure};
use instance::Instance;
use std::collections::HashMap;
use trackers::Trackers;
use workers::Workers;
use world_box::WorldBox;

/// Many placed shapes, and questions over all pairs that may meet.
///
/// An instance is a shape with a pose in the world. A question is about all pairs of instances whose [`Groups`] meet
/// and whose contact is not allowed ([`Scene::set_allowed`]). The lower [`InstanceId`] of a pair is A. The answer about
/// a pair is that of [`Querier`](crate::Querier) for `Pose::relative(world_a, world_b)`, and for the radii that margins
/// make, to the bit. Answers are in
/// ascending order of the pairs. They depend neither on the broad phase, nor on the backend, nor on the number of
/// threads, nor on earlier questions.
///
/// Errors may depend on the number of threads and on earlier questions in two cases. If a page is damaged, this holds
/// for [`Scene::collide`], [`Scene::within`] and [`Scene::distance`], whose answers may not need all pairs. If a budget
/// runs out, it holds for every question: see [`Scene::set_budget`].
///
/// A question first finds near pairs and then tests them, at most 65,536 at a time plus those of one more instance.
/// Memory therefore grows with the number of instances and not with the number of pairs.
///
/// Cost: moving an instance takes some 0.2 us. A question with nothing near takes some 2 us if 8 of 100 instances move
/// (AMD EPYC, family 26). A question reads the object table of each file, and pages only of instances that are near
/// another one. Clone a scene to use it on several threads: the clones share the shapes.
///
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
#[derive(Debug, Clone)]
pub struct Scene {
    /// By place; `None` where an instance was removed.
    instances: Vec<Option<Instance>>,
    /// Places of removed instances with the generation of the next one.
    free: Vec<(u32, u32)>,
    names: HashMap<String, u32>,
    /// The margins of pairs that have their own, by the places of both, the lower one first.
    pair_margins: HashMap<(u32, u32), f64>,
    /// The largest of them.
    widest_pair_margin: f64,
    broad: BroadPhase,
    workers: Workers,
    /// The pair that was nearest, or in contact, in the last question: a likely answer of the next.
    likely: Option<(u32, u32)>,
    trackers: Trackers,
    stats: QueryStats,
    pairs_asked: u64,
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
            instances: Vec::new(),
            free: Vec::new(),
            names: HashMap::new(),
            pair_margins: HashMap::new(),
            widest_pair_margin: 0.0,
            broad: BroadPhase::default(),
            workers: Workers::new(backend),
            likely: None,
            trackers: Trackers::default(),
            stats: QueryStats::default(),
            pairs_asked: 0,
        }
    }

    /// Creates a scene from the instances of a file, in their order. A bake with the option `scene` makes such files.
    ///
    /// Cost: reading the instances, and some 0.5 to 1.5 us per instance. The rest of the file is read when a question
    /// needs it.
    ///
    /// # Errors
    /// [`SceneFileError::NoInstances`] if the file has no instances; [`SceneFileError::Damaged`] if its instances break
    /// a rule of the format; [`SceneFileError::Backend`] as for [`Scene::new`].
    pub fn of_file(bvh: Bvh) -> Result<Self, SceneFileError> {
        Self::of_file_with_backend(bvh, Backend::detect()?)
    }

    /// Creates a scene from the instances of a file, as [`Scene::of_file`] does, with a backend. The portable backend
    /// replaces one that the CPU lacks.
    ///
    /// # Errors
    /// The errors of [`Scene::of_file`], except those of the backend.
    pub fn of_file_with_backend(bvh: Bvh, backend: Backend) -> Result<Self, SceneFileError> {
        let instances = bvh.layout().read_instances(bvh.bytes())?;
        if instances.is_empty() {
            return Err(SceneFileError::NoInstances);
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
            scene.insert(name, shape.into(), world, groups, instance.margin);
        }
        Ok(scene)
    }

    /// Lets questions use all threads of the rayon pool in which they are called. By default they use one thread.
    #[cfg(feature = "parallel")]
    pub fn set_parallel(&mut self, parallel: bool) {
        self.workers.parallel = parallel;
    }

    /// Lets the scene keep a [`Tracker`](crate::Tracker) for each pair, for questions about contact and about a
    /// distance to compare with. It affects no answer, and saves time if instances move little from question to
    /// question.
    ///
    /// On the project's test scenes, where instances move by some 3 degrees per frame, a frame takes 0.95 to 1.17 times
    /// as long. With a twentieth of these steps it takes 0.84 to 1.12 times as long, and with a two-hundredth 0.61 to
    /// 0.83 times. A tracker holds some 300 bytes. A scene has one for each of the first 16,384 pairs of the last
    /// question, at most as many more for those of the question before, and up to 1,024 others.
    ///
    /// With a tracker, a question makes fewer visits. It may therefore have an answer where it would otherwise meet a
    /// damaged page or exceed the budget.
    pub fn set_tracking(&mut self, tracking: bool) {
        self.trackers.on = tracking;
    }

    /// Limits each question to this many visits over all its pairs, and each point, ray or segment to this many over
    /// all instances. Without a budget, only the number of instances and the sizes of the files limit a question.
    ///
    /// Two kinds of visits count: those of [`Querier::set_budget`](crate::Querier::set_budget) for each pair tested,
    /// and those of the broad phase. The latter are the pairs of boxes, or for a probe the boxes, that the search for
    /// near ones tests. So both time and memory are limited, however many instances a file puts in one place.
    ///
    /// If the visits run out, the error is [`SceneError::Pair`] or [`SceneError::Instance`] with
    /// [`QueryError::Budget`](crate::QueryError::Budget), or [`SceneError::Query`] with it in the broad phase. If the
    /// answer needs all pairs, the number of threads does not affect whether the visits suffice. It does affect which
    /// pair the error names, and t threads may make t times as many visits before they stop.
    pub fn set_budget(&mut self, visits: u64) {
        self.workers.budget = visits;
    }

    /// Adds an instance. It is in all groups, and no other instance is allowed to touch it.
    ///
    /// # Errors
    /// [`InstanceError::Pose`] if the rotation is not rigid to within 2^-23 or the translation exceeds 2^118 along an
    /// axis: within these limits every pair of instances has a relative pose. [`Pose::nearest`] orthonormalises a
    /// rotation.
    pub fn add(&mut self, shape: impl Into<SceneShape>, world: Pose) -> Result<InstanceId, InstanceError> {
        self.add_checked(None, shape.into(), world)
    }

    /// Adds an instance with a name of its own.
    ///
    /// # Errors
    /// [`InstanceError::NameTaken`] if another instance has the name, and the errors of [`Scene::add`].
    pub fn add_named(
        &mut self,
        name: impl Into<String>,
        shape: impl Into<SceneShape>,
        world: Pose,
    ) -> Result<InstanceId, InstanceError> {
        self.add_checked(Some(name.into()), shape.into(), world)
    }

    fn add_checked(
        &mut self,
        name: Option<String>,
        shape: SceneShape,
        world: Pose,
    ) -> Result<InstanceId, InstanceError> {
        if let Err(source) = check_world(&world) {
            let instance = InstanceLabel { id: self.next_id(), name: name.map(Box::from) };
            return Err(InstanceError::Pose { instance, source });
        }
        match name {
            Some(name) if self.names.contains_key(&name) => Err(InstanceError::NameTaken(name)),
            name => Ok(self.insert(name, shape, world, Groups::ALL, 0.0)),
        }
    }

    /// Returns the identifier that the next instance gets.
    fn next_id(&self) -> InstanceId {
        let (place, generation) = self.free.last().copied().unwrap_or((self.instances.len() as u32, 0));
        InstanceId { place, generation }
    }

    /// Adds an instance that the scene does not refuse.
    fn insert(
        &mut self,
        name: Option<String>,
        shape: SceneShape,
        world: Pose,
        groups: Groups,
        margin: f64,
    ) -> InstanceId {
        let id @ InstanceId { place, generation } = self.next_id();
        if let Some(name) = &name {
            self.names.insert(name.clone(), place);
        }
        let size = size_of(shape.objects(), 0.0);
        let mut instance = Instance {
            generation,
            name,
            shape,
            margin,
            size,
            world,
            bounds: WorldBox::EMPTY,
            groups,
            allowed: Vec::new(),
        };
        instance.update_bounds();
        if self.free.pop().is_some() {
            self.instances[place as usize] = Some(instance);
        } else {
            self.instances.push(Some(instance));
        }
        self.broad.replace(place);
        id
    }

    /// Removes an instance, and its permissions to touch others.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`] if the scene never had such an instance, or no longer has it.
    pub fn remove(&mut self, id: InstanceId) -> Result<(), InstanceError> {
        let place = self.place(id)?;
        if let Some(instance) = self.instances[place].take() {
            for other in instance.allowed {
                if let Some(other) = &mut self.instances[other as usize] {
                    other.allowed.retain(|&place| place != id.place);
                }
            }
            if let Some(name) = instance.name {
                self.names.remove(&name);
            }
            self.pair_margins.retain(|&(a, b), _| a != id.place && b != id.place);
            // After 2^32 instances in one place, the place is given up.
            if let Some(next) = instance.generation.checked_add(1) {
                self.free.push((id.place, next));
            }
        }
        self.likely = self.likely.filter(|&(a, b)| a != id.place && b != id.place);
        self.broad.replace(id.place);
        Ok(())
    }

    /// Moves an instance.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`], or [`InstanceError::Pose`] as for [`Scene::add`]. Then nothing has moved.
    pub fn set_pose(&mut self, id: InstanceId, world: Pose) -> Result<(), InstanceError> {
        self.set_poses([(id, world)])
    }

    /// Moves many instances. If an instance is named twice, the last pose counts.
    ///
    /// # Errors
    /// The errors of [`Scene::set_pose`]. Then none has moved.
    pub fn set_poses(
        &mut self,
        poses: impl IntoIterator<Item = (InstanceId, Pose)>,
    ) -> Result<(), InstanceError> {
        let poses: Vec<(InstanceId, Pose)> = poses.into_iter().collect();
        for &(id, ref world) in &poses {
            self.check_pose(id, world)?;
        }
        for (id, world) in poses {
            if let Some(instance) = &mut self.instances[id.place as usize] {
                instance.world = world;
                instance.update_bounds();
                self.broad.set_box(instance.item(id.place));
            }
        }
        Ok(())
    }

    /// Gives an instance a margin in mesh units, which is added to the radius of its shape in every question. It is 0 at
    /// first.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`], or [`InstanceError::Margin`] for a margin that is negative, NaN or above 2^118.
    pub fn set_margin(&mut self, id: InstanceId, margin: f64) -> Result<(), InstanceError> {
        let place = self.place(id)?;
        check_margin(margin)?;
        if let Some(instance) = &mut self.instances[place] {
            instance.margin = margin;
            instance.update_bounds();
            self.broad.set_box(instance.item(id.place));
        }
        Ok(())
    }

    /// Gives a pair of instances a margin in mesh units, besides those that each of both has. Questions about the pair add it to
    /// the margin of the lower instance, which is A. It is 0 at first.
    ///
    /// # Errors
    /// The errors of [`Scene::set_margin`].
    pub fn set_pair_margin(
        &mut self,
        a: InstanceId,
        b: InstanceId,
        margin: f64,
    ) -> Result<(), InstanceError> {
        let (a, b) = (self.place(a)? as u32, self.place(b)? as u32);
        check_margin(margin)?;
        let pair = (a.min(b), a.max(b));
        if margin > 0.0 {
            self.pair_margins.insert(pair, margin);
        } else {
            self.pair_margins.remove(&pair);
        }
        self.widest_pair_margin = self.pair_margins.values().fold(0.0, |widest, &margin| widest.max(margin));
        Ok(())
    }

    /// Returns the margin of an instance.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn margin(&self, id: InstanceId) -> Result<f64, InstanceError> {
        Ok(self.instance(id)?.margin)
    }

    /// Returns the margin that a pair has of its own.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn pair_margin(&self, a: InstanceId, b: InstanceId) -> Result<f64, InstanceError> {
        Ok(self.margin_of_pair(self.place(a)? as u32, self.place(b)? as u32))
    }

    /// Returns the pairs that have margins of their own, in ascending order.
    pub fn pair_margins(&self) -> impl Iterator<Item = (ScenePair, f64)> {
        let id = |place: u32| Some(self.instances.get(place as usize)?.as_ref()?.id(place));
        let mut pairs: Vec<_> = self.pair_margins.iter().collect();
        pairs.sort_unstable_by_key(|(places, _)| **places);
        let pair =
            move |(&(a, b), &margin): (&(u32, u32), &f64)| Some((ScenePair { a: id(a)?, b: id(b)? }, margin));
        pairs.into_iter().filter_map(pair)
    }

    /// Returns how much farther apart than a limit the boxes of a pair may be, at most, because it has a margin of its own.
    fn reach_of_pairs(&self) -> f64 {
        reach_of(self.widest_pair_margin)
    }

    /// Returns the margin that the pair in two places has of its own.
    fn margin_of_pair(&self, a: u32, b: u32) -> f64 {
        self.pair_margins.get(&(a.min(b), a.max(b))).copied().unwrap_or(0.0)
    }

    /// Puts an instance into groups.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn set_groups(&mut self, id: InstanceId, groups: Groups) -> Result<(), InstanceError> {
        let place = self.place(id)?;
        if let Some(instance) = &mut self.instances[place] {
            instance.groups = groups;
            self.broad.set_groups(instance.item(id.place));
        }
        Ok(())
    }

    /// Allows two instances to touch, or forbids it again. An allowed pair takes part in no question: neighbours on a robot,
    /// or a part and its gripper.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn set_allowed(&mut self, a: InstanceId, b: InstanceId, allowed: bool) -> Result<(), InstanceError> {
        let places = [(self.place(a)?, b.place), (self.place(b)?, a.place)];
        for (own, other) in places {
            let Some(instance) = &mut self.instances[own] else { continue };
            match (instance.allowed.binary_search(&other), allowed) {
                (Err(at), true) => instance.allowed.insert(at, other),
                (Ok(at), false) => {
                    instance.allowed.remove(at);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the instance with a name.
    pub fn find(&self, name: &str) -> Option<InstanceId> {
        let &place = self.names.get(name)?;
        let generation = self.instances[place as usize].as_ref()?.generation;
        Some(InstanceId { place, generation })
    }

    /// Returns the name of an instance, if it has one.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn name(&self, id: InstanceId) -> Result<Option<&str>, InstanceError> {
        Ok(self.instance(id)?.name.as_deref())
    }

    /// Returns the shape of an instance.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn shape(&self, id: InstanceId) -> Result<&SceneShape, InstanceError> {
        Ok(&self.instance(id)?.shape)
    }

    /// Returns the pose of an instance in the world.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn pose(&self, id: InstanceId) -> Result<&Pose, InstanceError> {
        Ok(&self.instance(id)?.world)
    }

    /// Returns the groups of an instance.
    ///
    /// # Errors
    /// [`InstanceError::NoInstance`].
    pub fn groups(&self, id: InstanceId) -> Result<Groups, InstanceError> {
        Ok(self.instance(id)?.groups)
    }

    /// Returns the pairs that [`Scene::set_allowed`] lets touch, in ascending order.
    pub fn allowed(&self) -> impl Iterator<Item = ScenePair> {
        self.instances().flat_map(move |a| {
            let allowed = self.instances[a.place as usize].iter().flat_map(|instance| &instance.allowed);
            allowed.filter(move |&&place| place > a.place).filter_map(move |&place| {
                let generation = self.instances[place as usize].as_ref()?.generation;
                Some(ScenePair { a, b: InstanceId { place, generation } })
            })
        })
    }

    /// Returns all instances in ascending order.
    pub fn instances(&self) -> impl Iterator<Item = InstanceId> {
        let id = |(place, instance): (u32, &Option<Instance>)| {
            Some(InstanceId { place, generation: instance.as_ref()?.generation })
        };
        (0..).zip(&self.instances).filter_map(id)
    }

    /// Returns the number of instances.
    pub fn len(&self) -> usize {
        self.instances.iter().flatten().count()
    }

    /// Returns whether there are no instances.
    pub fn is_empty(&self) -> bool {
        self.instances.iter().all(Option::is_none)
    }

    /// Returns how much work the last question took, over all its pairs.
    pub fn stats(&self) -> QueryStats {
        self.stats
    }

    /// Returns how many times the last question asked about a pair of instances.
    pub fn pairs_asked(&self) -> u64 {
        self.pairs_asked
    }

    fn instance(&self, id: InstanceId) -> Result<&Instance, InstanceError> {
        let instance = self.instances.get(id.place as usize).and_then(Option::as_ref);
        instance.filter(|instance| instance.generation == id.generation).ok_or(InstanceError::NoInstance(id))
    }

    fn place(&self, id: InstanceId) -> Result<usize, InstanceError> {
        self.instance(id).map(|_| id.place as usize)
    }

    /// Refuses a pose of an instance with which a pair may have no relative pose.
    fn check_pose(&self, id: InstanceId, world: &Pose) -> Result<(), InstanceError> {
        self.place(id)?;
        check_world(world).map_err(|source| InstanceError::Pose { instance: self.label(id), source })
    }

    /// Names an instance for an error.
    fn label(&self, id: InstanceId) -> InstanceLabel {
        InstanceLabel {
            id,
            name: self.instance(id).ok().and_then(|instance| instance.name.as_deref().map(Box::from)),
        }
    }

    /// Starts a question: updates the broad phase if instances have changed.
    fn start(&mut self) {
        (self.stats, self.pairs_asked) = (QueryStats::default(), 0);
        self.workers.start();
        self.trackers.start();
        let item = |(place, instance): (u32, &Option<Instance>)| Some(instance.as_ref()?.item(place));
        self.broad.refresh((0..).zip(&self.instances).filter_map(item), self.instances.len());
    }
}

/// Returns how much farther apart the boxes of a pair with a margin of its own may be. The default tolerance of a motion grows
/// by two millionths of the margin, and A's frame may be stretched against the world by 2^-22.
fn reach_of(pair_margin: f64) -> f64 {
    pair_margin * (1.0 + 1e-5)
}

/// Refuses an invalid margin.
fn check_margin(margin: f64) -> Result<(), InstanceError> {
    check_radius(margin).map_err(|_| InstanceError::Margin(margin))
}

/// Refuses a pose with which a pair may have no relative pose.
fn check_world(world: &Pose) -> Result<(), WorldPoseError> {
    let far = world.translation().into_iter().find(|t| t.abs() > MAX_WORLD);
    let error = departure(world.rotation(), 1.0);
    match far {
        Some(far) => Err(WorldPoseError::TooFar(far)),
        None if error > MAX_RIGID_ERROR => Err(WorldPoseError::NotRigid(error)),
        None => Ok(()),
    }
}
