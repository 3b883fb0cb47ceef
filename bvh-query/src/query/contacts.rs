//! All pairs of triangles in contact.

use super::collide::Contacts;
use super::{Contact, Querier, QueryStats, Scene, Traversal, each_pair, sphere_gap};
use crate::bvh::{Bvh, Shape, TrianglePlace};
use crate::error::QueryError;
use crate::leaf::collide::Candidate;
use crate::pose::Pose;
use crate::traverse::pair::Order;
use bvh_format::object::Object;
use std::ops::ControlFlow;

impl Querier {
    /// All pairs of triangles in contact, in ascending order.
    ///
    /// Equals exact predicates on all pairs of the input's triangles: an exact duplicate that the
    /// baker left out is in contact wherever the triangle is that stands for it (if the file has
    /// ids).
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn contacts<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Vec<Contact>, QueryError> {
        let mut contacts = Vec::new();
        self.visit_contacts(a, b, pose, |contact| {
            contacts.push(contact);
            ControlFlow::Continue(())
        })?;
        contacts.sort_unstable();
        Ok(contacts)
    }

    /// Calls `visit` once for each pair of triangles in contact, in no particular order, until it
    /// breaks. Returns the number of calls.
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn visit_contacts<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        mut visit: impl FnMut(Contact) -> ControlFlow<()>,
    ) -> Result<u64, QueryError> {
        self.stats = QueryStats::default();
        let mut calls = 0;
        each_pair(a.into(), b.into(), pose, |scene| {
            let found = self.contacts_of(&scene, &mut |contact| {
                calls += 1;
                visit(contact)
            })?;
            Ok(found.map(|_| ()))
        })?;
        Ok(calls)
    }

    fn contacts_of(
        &mut self,
        scene: &Scene<'_>,
        visit: &mut dyn FnMut(Contact) -> ControlFlow<()>,
    ) -> Result<Option<Candidate>, QueryError> {
        if sphere_gap(scene.pair.placement, scene.pair.object_a, scene.pair.object_b) > 0.0 {
            return Ok(None);
        }
        self.queue.clear();
        let mut visitor = Contacts {
            scene,
            queue: &mut self.queue,
            order: Order::Tree,
            stats: QueryStats::default(),
            visit: |candidate| report(scene, candidate, visit),
            found: None,
        };
        let task = Traversal { pair: scene.pair, stack: &mut self.stack, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let (found, stats) = (visitor.found, visitor.stats);
        self.stats.add(tests, stats);
        Ok(found)
    }
}

/// Reports a pair of stored triangles and all pairs of duplicates that they stand for.
fn report(
    scene: &Scene<'_>,
    candidate: Candidate,
    visit: &mut dyn FnMut(Contact) -> ControlFlow<()>,
) -> Result<ControlFlow<Candidate>, QueryError> {
    let pair = &scene.pair;
    let id_a = triangle_id(pair.bvh_a, pair.object_a, candidate.place_a())?;
    let id_b = triangle_id(pair.bvh_b, pair.object_b, candidate.place_b())?;
    for triangle_a in std::iter::once(id_a).chain(pair.bvh_a.duplicates_of(id_a)?) {
        for triangle_b in std::iter::once(id_b).chain(pair.bvh_b.duplicates_of(id_b)?) {
            let (object_a, object_b) = scene.numbers;
            if visit(Contact { object_a, triangle_a, object_b, triangle_b }).is_break() {
                return Ok(ControlFlow::Break(candidate));
            }
        }
    }
    Ok(ControlFlow::Continue(()))
}

fn triangle_id(bvh: &Bvh, object: &Object, place: TrianglePlace) -> Result<u32, QueryError> {
    bvh.triangle_id(object, place)
}

impl Candidate {
    /// Where the triangle of A is stored.
    pub(super) fn place_a(&self) -> TrianglePlace {
        TrianglePlace { page: self.a.page, packet: self.a.packet, lane: self.lane_a }
    }

    /// Where the triangle of B is stored.
    pub(super) fn place_b(&self) -> TrianglePlace {
        TrianglePlace { page: self.b.page, packet: self.b.packet, lane: self.lane_b }
    }
}
