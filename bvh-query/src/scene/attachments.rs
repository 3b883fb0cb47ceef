//! Attached instances: with which parent each one moves, and where they come to be when some are moved.
//!
//! The pose of an attached instance in the world is always that which is kept, then that of its parent. A pose is
//! therefore rounded once for each parent above it, however often they move.

use crate::pose::Pose;
use crate::scene::contents::Contents;
use crate::scene::instance::{Attached, Instance, InstanceId};
use crate::scene::{Scene, SceneError};

/// Where an instance comes to be, and the pose that is kept if it is attached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    place: u32,
    world: Pose,
    kept: Option<Pose>,
}

/// Stands for no number in a `Table`.
const NONE: u32 = u32::MAX;

/// Numbers of places, such as that of the pose that each is given.
pub(super) struct Table(Vec<u32>);

impl Table {
    pub(super) fn new(places: usize) -> Self {
        Self(vec![NONE; places])
    }

    pub(super) fn set(&mut self, place: u32, number: usize) {
        if let Some(held) = self.0.get_mut(place as usize) {
            *held = number as u32;
        }
    }

    pub(super) fn get(&self, place: u32) -> Option<usize> {
        self.0.get(place as usize).filter(|&&number| number != NONE).map(|&number| number as usize)
    }
}

impl Scene {
    /// Attaches an instance to a parent, with which it moves from then on: a part to the gripper that holds it. If it was
    /// attached to another parent, it no longer is. What is attached to it moves with it.
    ///
    /// The scene keeps the pose of the child in the parent's frame. From then on, the pose of the child in the world is
    /// always `kept.then(&parent)`, computed once from these two, so that nothing adds up over many moves, and equal
    /// poses of the parent give equal poses of the child, to the bit. This holds from the start: attaching moves the
    /// child by the rounding of this formula. The kept rotation is orthonormal to within 2^-40, if need be by
    /// [`Pose::nearest`]. So if rotations were rounded to `f32`, the child also turns by about as much as they are off, at
    /// most some 2^-21 radians.
    ///
    /// [`Scene::set_pose`] for the child changes the pose that is kept, and its pose in the world is that given, but for
    /// rounding. In a motion ([`Scene::motion`]), the child follows the path of its parent, unless it is given a path of
    /// its own. Permissions to touch do not change. A gripper usually touches what it holds, so allow this pair with
    /// [`Scene::set_allowed`], and forbid it again after [`Scene::detach`].
    ///
    /// Cost: some 0.12 us for each instance that moves.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`]; [`SceneError::Cycle`] if the parent is the child itself or moves with it; and
    /// [`SceneError::Pose`] if the child, within rounding, or one that follows it has no valid pose. Then nothing has
    /// changed.
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
    /// let gripper = scene.add(bvh.clone(), at(2.0)?)?;
    /// let part = scene.add(bvh, at(1.5)?)?;
    /// scene.attach(part, gripper)?;
    /// scene.set_allowed(part, gripper, true)?;
    /// scene.set_pose(gripper, at(7.0)?)?;
    /// assert_eq!(scene.pose(part)?.translation(), [0.0, 0.0, 6.5]);
    /// scene.detach(part)?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn attach(&mut self, child: InstanceId, parent: InstanceId) -> Result<(), SceneError> {
        let kept = self.instance(parent)?.world.kept_of_attached(&self.instance(child)?.world);
        self.attach_at(child, parent, kept)
    }

    /// Attaches an instance to a parent, as [`Scene::attach`] does, at a pose in the parent's frame: the child moves there. A
    /// rotation that is farther than 2^-40 from orthonormal is orthonormalised.
    ///
    /// # Errors
    /// The errors of [`Scene::attach`].
    pub fn attach_at(&mut self, child: InstanceId, parent: InstanceId, kept: Pose) -> Result<(), SceneError> {
        let (own, above) = (self.place(child)? as u32, self.place(parent)? as u32);
        if self.contents.moves_with(above, own) {
            let (child, parent) = (self.contents.label(child), self.contents.label(parent));
            return Err(SceneError::Cycle { child, parent });
        }
        let to = Attached { parent: above, kept: kept.to_keep() };
        let before = self.contents_mut().attach(own, Some(to));
        match self.contents.moves_of(own) {
            Ok(moves) => self.contents_mut().carry_out(&moves),
            Err(refused) => {
                self.contents_mut().attach(own, before);
                return Err(refused);
            }
        }
        Ok(())
    }

    /// Detaches an instance from its parent, if it has one. It stays where it is.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn detach(&mut self, child: InstanceId) -> Result<(), SceneError> {
        self.place(child)?;
        if self.contents.attached(child.place).is_some() {
            self.contents_mut().attach(child.place, None);
        }
        Ok(())
    }

    /// Returns the instance that an instance is attached to, if it is, and its pose in the frame of that one.
    ///
    /// # Errors
    /// [`SceneError::NoInstance`].
    pub fn parent(&self, child: InstanceId) -> Result<Option<(InstanceId, &Pose)>, SceneError> {
        self.place(child)?;
        let attached = self.contents.attached(child.place);
        Ok(attached.and_then(|attached| Some((self.contents.id_at(attached.parent)?, &attached.kept))))
    }
}

impl Contents {
    /// Returns what an instance is attached to.
    pub(super) fn attached(&self, child: u32) -> Option<&Attached> {
        self.at(child)?.attached.as_deref()
    }

    /// Returns the parent of an instance, the parent of that, and so on.
    fn above(&self, child: u32) -> impl Iterator<Item = u32> {
        let attached = self.attached(child);
        std::iter::successors(attached, |attached| self.attached(attached.parent))
            .map(|attached| attached.parent)
    }

    /// Returns whether an instance is another one, or moves with it.
    pub(super) fn moves_with(&self, place: u32, other: u32) -> bool {
        place == other || self.above(place).any(|above| above == other)
    }

    /// Attaches an instance to one that does not move with it, or to none. Returns what it was attached to.
    pub(super) fn attach(&mut self, child: u32, to: Option<Attached>) -> Option<Attached> {
        let before = self.attached(child).copied();
        if let Some(parent) = before.and_then(|before| self.at_mut(before.parent)) {
            parent.children.retain(|&place| place != child);
        }
        if let Some(parent) = to.and_then(|to| self.at_mut(to.parent)) {
            parent.children.push(child);
        }
        if let Some(instance) = self.at_mut(child) {
            instance.attached = to.map(Box::new);
        }
        before
    }

    /// Returns whether instances can be moved one by one: none is attached to any of them or is attached itself.
    pub(super) fn move_alone(&self, mut places: impl Iterator<Item = u32>) -> bool {
        let alone = |instance: &Instance| instance.attached.is_none() && instance.children.is_empty();
        places.all(|place| self.at(place).is_none_or(alone))
    }

    /// Returns where instances come to be that are moved to poses in the world, and all that are attached to them. Of two poses
    /// for one, the last counts.
    pub(super) fn moves(&self, given: &[(u32, Pose)]) -> Result<Vec<Move>, SceneError> {
        let mut numbers = Table::new(self.instances.len());
        for (number, (place, _)) in given.iter().enumerate() {
            numbers.set(*place, number);
        }
        let mut moves = Vec::new();
        for (number, &(first, _)) in given.iter().enumerate() {
            // What is attached to another one that is given a pose is reached from there.
            let is_reached = self.above(first).any(|place| numbers.get(place).is_some());
            if numbers.get(first) == Some(number) && !is_reached {
                self.follow(first, given, &numbers, &mut moves)?;
            }
        }
        Ok(moves)
    }

    /// Returns where an instance comes to be that was attached, and all that are attached to it.
    pub(super) fn moves_of(&self, child: u32) -> Result<Vec<Move>, SceneError> {
        let mut moves = Vec::new();
        self.follow(child, &[], &Table::new(0), &mut moves)?;
        Ok(moves)
    }

    /// Adds where an instance comes to be and all that are attached to it.
    fn follow(
        &self,
        first: u32,
        given: &[(u32, Pose)],
        numbers: &Table,
        moves: &mut Vec<Move>,
    ) -> Result<(), SceneError> {
        let above = self.attached(first).and_then(|attached| self.at(attached.parent));
        let mut open = vec![(first, above.map_or(Pose::IDENTITY, |parent| parent.world))];
        while let Some((place, parent)) = open.pop() {
            let Some(instance) = self.at(place) else { continue };
            let given = numbers.get(place).map(|number| given[number].1);
            let (world, kept) = match &instance.attached {
                None => (given.unwrap_or(instance.world), None),
                Some(attached) => {
                    let kept = given.map_or(attached.kept, |world| parent.kept_of_attached(&world));
                    (kept.then_of_attached(&parent), Some(kept))
                }
            };
            self.check_pose(instance.id(place), &world)?;
            moves.push(Move { place, world, kept });
            open.extend(instance.children.iter().map(|&child| (child, world)));
        }
        Ok(())
    }

    /// Moves instances.
    pub(super) fn carry_out(&mut self, moves: &[Move]) {
        let poses: Vec<(u32, Pose)> = moves.iter().map(|of| (of.place, of.world)).collect();
        self.place_each(&poses);
        for Move { place, kept, .. } in moves {
            let attached = self.at_mut(*place).and_then(|instance| instance.attached.as_mut());
            if let Some((attached, kept)) = attached.zip(*kept) {
                attached.kept = kept;
            }
        }
    }
}
