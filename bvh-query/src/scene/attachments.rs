//! Attached instances: with which parent each one moves, and where it is in the parent's frame.
//!
//! The pose of an attached instance in the world is always that which is kept, then that of its parent. A pose is
//! therefore rounded once for each parent above it, however often they move.

use crate::pose::Pose;
use std::collections::{BTreeMap, BTreeSet};

/// What an instance is attached to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attached {
    /// The place of the parent.
    pub(super) parent: u32,
    /// The pose in the frame of the parent.
    pub(super) kept: Pose,
}

/// All attachments, by the places of instances. They have no cycle.
#[derive(Clone, Default, Debug)]
pub(super) struct Attachments {
    of: BTreeMap<u32, Attached>,
    /// Each parent with each of its children.
    children: BTreeSet<(u32, u32)>,
}

impl Attachments {
    pub(super) fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Returns what an instance is attached to.
    pub(super) fn get(&self, child: u32) -> Option<&Attached> {
        self.of.get(&child)
    }

    /// Returns what is attached to an instance.
    pub(super) fn children(&self, parent: u32) -> impl Iterator<Item = u32> {
        self.children.range((parent, 0)..=(parent, u32::MAX)).map(|&(_, child)| child)
    }

    /// Returns the parent of an instance, the parent of that, and so on.
    pub(super) fn above(&self, child: u32) -> impl Iterator<Item = u32> {
        std::iter::successors(self.get(child), |attached| self.get(attached.parent))
            .map(|attached| attached.parent)
    }

    /// Returns whether an instance is another one, or moves with it.
    pub(super) fn moves_with(&self, place: u32, other: u32) -> bool {
        place == other || self.above(place).any(|above| above == other)
    }

    /// Attaches an instance to one that does not move with it. Returns what it was attached to.
    pub(super) fn attach(&mut self, child: u32, parent: u32, kept: Pose) -> Option<Attached> {
        let before = self.detach(child);
        self.children.insert((parent, child));
        self.of.insert(child, Attached { parent, kept });
        before
    }

    /// Detaches an instance. Returns what it was attached to.
    pub(super) fn detach(&mut self, child: u32) -> Option<Attached> {
        let before = self.of.remove(&child)?;
        self.children.remove(&(before.parent, child));
        Some(before)
    }

    /// Undoes an attachment, given what the instance was attached to before.
    pub(super) fn put_back(&mut self, child: u32, before: Option<Attached>) {
        self.detach(child);
        if let Some(Attached { parent, kept }) = before {
            self.attach(child, parent, kept);
        }
    }

    /// Replaces the pose that is kept of an attached instance.
    pub(super) fn keep(&mut self, child: u32, kept: Pose) {
        if let Some(attached) = self.of.get_mut(&child) {
            attached.kept = kept;
        }
    }

    /// Forgets an instance. Its children are no longer attached.
    pub(super) fn remove(&mut self, place: u32) {
        self.detach(place);
        let children: Vec<u32> = self.children(place).collect();
        for child in children {
            self.detach(child);
        }
    }
}
