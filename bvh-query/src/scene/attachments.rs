//! Attached instances: with which parent each one moves, and where they come to be when some are moved.
//!
//! The pose of an attached instance in the world is always that which is kept, then that of its parent. A pose is
//! therefore rounded once for each parent above it, however often they move.

use crate::pose::Pose;
use crate::scene::InstanceError;
use crate::scene::contents::Contents;
use crate::scene::instance::Instance;

/// What an instance is attached to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attached {
    /// The place of the parent.
    pub(super) parent: u32,
    /// The pose in the frame of the parent.
    pub(super) kept: Pose,
}

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
    pub(super) fn moves(&self, given: &[(u32, Pose)]) -> Result<Vec<Move>, InstanceError> {
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
    pub(super) fn moves_of(&self, child: u32) -> Result<Vec<Move>, InstanceError> {
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
    ) -> Result<(), InstanceError> {
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
    pub(super) fn carry_out(&mut self, moves: Vec<Move>) {
        for Move { place, world, kept } in moves {
            self.change(place, |instance| {
                instance.world = world;
                if let Some((attached, kept)) = instance.attached.as_mut().zip(kept) {
                    attached.kept = kept;
                }
            });
        }
    }
}
