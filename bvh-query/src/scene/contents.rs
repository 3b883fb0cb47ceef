//! What a scene holds: its instances, what is said of pairs of them, and the trees of their boxes. Clones of a scene share
//! it until one of them changes. Places given here are those of instances, unless it says otherwise.

use crate::file::files::SceneShape;
use crate::pose::{Pose, PoseError};
use crate::scene::broad_phase::BroadPhase;
use crate::scene::groups::Groups;
use crate::scene::instance::{Instance, InstanceId};
use crate::scene::{InstanceLabel, SceneError};
use bvh_format::instances::{MAX_RIGID_ERROR, MAX_WORLD, departure};
use std::collections::HashMap;
use std::sync::Arc;

#[derive(Clone, Debug, Default)]
pub(super) struct Contents {
    /// By place; `None` where an instance was removed.
    pub(super) instances: Vec<Option<Instance>>,
    /// Places of removed instances with the generation of the next one.
    free: Vec<(u32, u32)>,
    /// Names seldom change, so that copies share them.
    pub(super) names: Arc<HashMap<Arc<str>, u32>>,
    /// The margins of pairs that have their own, by the places of both, the lower one first.
    pub(super) pair_margins: HashMap<(u32, u32), f64>,
    /// The largest of them.
    widest_pair_margin: f64,
    pub(super) broad: BroadPhase,
}

impl Contents {
    /// Returns all instances with their places.
    pub(super) fn each(&self) -> impl Iterator<Item = (u32, &Instance)> {
        (0..).zip(&self.instances).filter_map(|(place, instance)| Some((place, instance.as_ref()?)))
    }

    /// Returns the instance in a place, if there is one.
    pub(super) fn at(&self, place: u32) -> Option<&Instance> {
        self.instances.get(place as usize)?.as_ref()
    }

    /// Returns the instance in a place that was found in these contents.
    pub(super) fn known(&self, place: u32) -> &Instance {
        self.at(place).expect("a place of an instance")
    }

    /// Returns the instance in a place, if there is one, to change it.
    pub(super) fn at_mut(&mut self, place: u32) -> Option<&mut Instance> {
        self.instances.get_mut(place as usize)?.as_mut()
    }

    /// Returns the identifier of the instance in a place, if there is one.
    pub(super) fn id_at(&self, place: u32) -> Option<InstanceId> {
        Some(self.at(place)?.id(place))
    }

    pub(super) fn instance(&self, id: InstanceId) -> Result<&Instance, SceneError> {
        let instance = self.at(id.place).filter(|instance| instance.generation == id.generation);
        instance.ok_or(SceneError::NoInstance(id))
    }

    /// Names an instance for an error.
    pub(super) fn label(&self, id: InstanceId) -> InstanceLabel {
        let name = self.instance(id).ok().and_then(|instance| instance.name.as_deref());
        InstanceLabel { id, name: name.map(Box::from) }
    }

    /// Refuses a pose of an instance with which a pair may have no relative pose.
    pub(super) fn check_pose(&self, id: InstanceId, world: &Pose) -> Result<(), SceneError> {
        self.instance(id)?;
        check_world(world).map_err(|source| SceneError::Pose { instance: self.label(id), source })
    }

    /// Returns the identifier that the next instance gets.
    pub(super) fn next_id(&self) -> InstanceId {
        let (place, generation) = self.free.last().copied().unwrap_or((self.instances.len() as u32, 0));
        InstanceId { place, generation }
    }

    /// Adds an instance that the scene does not refuse.
    pub(super) fn insert(
        &mut self,
        name: Option<String>,
        shape: SceneShape,
        world: Pose,
        groups: Groups,
    ) -> InstanceId {
        let id @ InstanceId { place, generation } = self.next_id();
        let name: Option<Arc<str>> = name.map(Arc::from);
        if let Some(name) = &name {
            Arc::make_mut(&mut self.names).insert(Arc::clone(name), place);
        }
        let instance = Instance::new(generation, name, shape, world, groups);
        if self.free.pop().is_some() {
            self.instances[place as usize] = Some(instance);
        } else {
            self.instances.push(Some(instance));
        }
        self.broad.replace(place);
        id
    }

    /// Removes an instance, and what is said of it and others.
    pub(super) fn remove(&mut self, place: u32) {
        self.attach(place, None);
        let Some(instance) = self.instances[place as usize].take() else { return };
        for child in instance.children {
            if let Some(child) = self.at_mut(child) {
                child.attached = None;
            }
        }
        for other in instance.allowed {
            if let Some(other) = self.at_mut(other) {
                other.allowed.retain(|&allowed| allowed != place);
            }
        }
        if let Some(name) = instance.name {
            Arc::make_mut(&mut self.names).remove(&name);
        }
        self.pair_margins.retain(|&(a, b), _| a != place && b != place);
        // After 2^32 instances in one place, the place is given up.
        if let Some(next) = instance.generation.checked_add(1) {
            self.free.push((place, next));
        }
        self.broad.replace(place);
    }

    /// Changes an instance, and its box.
    pub(super) fn change(&mut self, place: u32, change: impl FnOnce(&mut Instance)) {
        if let Some(instance) = &mut self.instances[place as usize] {
            change(instance);
            instance.update_bounds();
            self.broad.set_box(instance.item(place));
        }
        self.broad.settle();
    }

    /// Moves some instances, and their boxes. The boxes above them are computed once.
    pub(super) fn place_each(&mut self, poses: &[(u32, Pose)]) {
        for (place, world) in poses {
            if let Some(instance) = &mut self.instances[*place as usize] {
                // From the pose that was given: a copy could not be read before it is written.
                instance.bounds = instance.bounds_at(world);
                instance.world = *world;
                self.broad.set_box(instance.item(*place));
            }
        }
        self.broad.settle();
    }

    pub(super) fn set_groups(&mut self, place: u32, groups: Groups) {
        if let Some(instance) = &mut self.instances[place as usize] {
            instance.groups = groups;
            self.broad.set_groups(instance.item(place));
        }
    }

    pub(super) fn set_allowed(&mut self, a: u32, b: u32, allowed: bool) {
        for (own, other) in [(a, b), (b, a)] {
            let Some(instance) = self.at_mut(own) else { continue };
            match (instance.allowed.binary_search(&other), allowed) {
                (Err(at), true) => instance.allowed.insert(at, other),
                (Ok(at), false) => {
                    instance.allowed.remove(at);
                }
                _ => {}
            }
        }
    }

    /// Sets the margin of a pair of places, the lower one first.
    pub(super) fn set_pair_margin(&mut self, pair: (u32, u32), margin: f64) {
        if margin > 0.0 {
            self.pair_margins.insert(pair, margin);
        } else {
            self.pair_margins.remove(&pair);
        }
        self.widest_pair_margin = self.pair_margins.values().fold(0.0, |widest, &margin| widest.max(margin));
    }

    /// Returns the margin that the pair in two places has of its own.
    pub(super) fn margin_of_pair(&self, a: u32, b: u32) -> f64 {
        self.pair_margins.get(&(a.min(b), a.max(b))).copied().unwrap_or(0.0)
    }

    /// Returns how much farther apart than a limit the boxes of a pair may be, at most, because it has a margin of its own.
    pub(super) fn reach_of_pairs(&self) -> f64 {
        reach_of(self.widest_pair_margin)
    }

    /// Updates the broad phase.
    pub(super) fn refresh(&mut self) {
        let Self { instances, broad, .. } = self;
        let items = (0..).zip(&*instances).filter_map(|(place, of)| Some(of.as_ref()?.item(place)));
        broad.refresh(items, instances.len());
    }
}

/// Returns how much farther apart the boxes of a pair with a margin of its own may be. The default tolerance of a motion grows
/// by two millionths of the margin, and A's frame may be stretched against the world by 2^-22.
pub(super) fn reach_of(pair_margin: f64) -> f64 {
    pair_margin * (1.0 + 1e-5)
}

/// Refuses a pose with which a pair may have no relative pose.
pub(super) fn check_world(world: &Pose) -> Result<(), PoseError> {
    let far = world.translation().into_iter().find(|t| t.abs() > MAX_WORLD);
    let error = departure(world.rotation(), 1.0);
    match far {
        Some(far) => Err(PoseError::TooFarInWorld(far)),
        None if error > MAX_RIGID_ERROR => Err(PoseError::NotRigidInWorld(error)),
        None => Ok(()),
    }
}
