//! Instances: shapes placed in the world.

use crate::file::files::SceneShape;
use crate::pose::Pose;
use crate::query::motion::{Measures, radius, size_of};
use crate::scene::broad_phase::Item;
use crate::scene::groups::Groups;
use crate::scene::world_box::{Extent, WorldBox};
use std::fmt;
use std::sync::Arc;

/// Identifies an instance of a scene. A scene never gives an identifier twice, so a removed instance cannot be mistaken
/// for a later one. Identifiers are ordered by the places of their instances. In a pair of instances, the lower one is
/// A.
///
/// ```
/// use bvh_query::{InstanceId, Pose, Scene};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut scene = Scene::new()?;
/// let id = scene.add_named("crate", block, Pose::IDENTITY)?;
/// assert_eq!(scene.find("crate"), Some(id));
/// assert_eq!(InstanceId::from_bits(id.to_bits()), id); // as a number, for other languages
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// With the feature `serde`, answers about scenes are written with these numbers. They are not read again, because a number stands for
/// an instance of one scene alone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(into = "u64"))]
pub struct InstanceId {
    pub(super) place: u32,
    /// How often the place was taken before.
    pub(super) generation: u32,
}

impl InstanceId {
    /// Returns the identifier as a number, for bindings of other languages or for messages.
    pub fn to_bits(self) -> u64 {
        u64::from(self.generation) << 32 | u64::from(self.place)
    }

    /// Returns the identifier with this number. Every number is an identifier, and a scene refuses those of no
    /// instance.
    pub fn from_bits(bits: u64) -> Self {
        Self { place: bits as u32, generation: (bits >> 32) as u32 }
    }
}

#[cfg(feature = "serde")]
impl From<InstanceId> for u64 {
    /// Returns the number of [`InstanceId::to_bits`].
    fn from(id: InstanceId) -> Self {
        id.to_bits()
    }
}

impl fmt::Display for InstanceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.generation == 0 {
            write!(f, "{}", self.place)
        } else {
            write!(f, "{}.{}", self.place, self.generation)
        }
    }
}

/// What an instance is attached to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attached {
    /// The place of the parent.
    pub(super) parent: u32,
    /// The pose in the frame of the parent.
    pub(super) kept: Pose,
}

/// A placed shape.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    pub(super) generation: u32,
    pub(super) name: Option<Arc<str>>,
    pub(super) shape: SceneShape,
    /// What is added to the radius of the shape, in mesh units.
    pub(super) margin: f64,
    /// The boxes and spheres of its objects.
    extents: Arc<[Extent]>,
    /// Of its core.
    pub(super) measures: Measures,
    pub(super) world: Pose,
    pub(super) bounds: WorldBox,
    pub(super) groups: Groups,
    /// The places of the instances that it may touch, in ascending order.
    pub(super) allowed: Vec<u32>,
    pub(super) attached: Option<Box<Attached>>,
    /// The places of the instances that are attached to it.
    pub(super) children: Vec<u32>,
}

impl Instance {
    pub(super) fn new(
        generation: u32,
        name: Option<Arc<str>>,
        shape: SceneShape,
        world: Pose,
        groups: Groups,
    ) -> Self {
        let (extents, measures) = measures(&shape);
        let (bounds, allowed, children) = (WorldBox::EMPTY, Vec::new(), Vec::new());
        let (margin, attached) = (0.0, None);
        let mut instance = Self {
            generation,
            name,
            shape,
            margin,
            extents,
            measures,
            world,
            bounds,
            groups,
            allowed,
            attached,
            children,
        };
        instance.update_bounds();
        instance
    }

    /// Replaces its shape. Its box is then out of date.
    pub(super) fn set_shape(&mut self, shape: SceneShape) {
        (self.extents, self.measures) = measures(&shape);
        self.shape = shape;
    }

    /// Returns its identifier, given its place.
    pub(super) fn id(&self, place: u32) -> InstanceId {
        InstanceId { place, generation: self.generation }
    }

    /// Returns how far from its core it reaches, in mesh units.
    pub(super) fn radius(&self) -> f64 {
        self.shape.radius() + self.margin
    }

    /// Returns its measures with a further margin, as questions know them.
    pub(super) fn measures_with(&self, margin: f64) -> Measures {
        let size = self.measures.size + 2.0 * (self.shape.radius() + (self.margin + margin));
        Measures { size, ..self.measures }
    }

    /// Returns its box in the world at a pose.
    pub(super) fn bounds_at(&self, world: &Pose) -> WorldBox {
        let core = WorldBox::of(&self.extents, world);
        let radius = self.radius();
        // A's frame may be stretched against the world: see the module of boxes.
        if radius == 0.0 { core } else { core.grown(radius * (1.0 + 1.0 / (1 << 18) as f64)) }
    }

    /// Computes its box after a change.
    pub(super) fn update_bounds(&mut self) {
        self.bounds = self.bounds_at(&self.world);
    }

    /// Returns what the broad phase knows of it, given its place.
    pub(super) fn item(&self, place: u32) -> Item {
        Item { place, bounds: self.bounds, groups: self.groups }
    }

    /// Returns whether it may touch the instance in another place.
    pub(super) fn allows(&self, place: u32) -> bool {
        !self.allowed.is_empty() && self.allowed.binary_search(&place).is_ok()
    }
}

/// Returns the boxes and spheres of a shape's objects, and the measures of its core.
fn measures(shape: &SceneShape) -> (Arc<[Extent]>, Measures) {
    let objects = shape.objects();
    let measures = Measures { size: size_of(objects, 0.0), radius: radius(objects) };
    (objects.iter().map(Extent::of).collect(), measures)
}
