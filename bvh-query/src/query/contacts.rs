//! All pairs of triangles in contact.

use super::collide::Contacts;
use super::{Contact, Querier, QueryStats, Scene, Traversal, each_pair, surely_apart};
use crate::bvh::{Bvh, Shape, TrianglePlace};
use crate::error::QueryError;
use crate::leaf::decoded::Decoded;
use crate::leaf::queue::Candidate;
use crate::pose::Pose;
use crate::traverse::pair::Order;
use bvh_format::header::SectionKind;
use bvh_format::leaf::PACKET;
use bvh_format::object::Object;
use bvh_format::{FormatError, Rule};
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
        self.start();
        let (a, b) = (a.into(), b.into());
        let most = most_triangles(a).saturating_mul(most_triangles(b));
        let (mut calls, mut too_many) = (0, false);
        each_pair(a, b, pose, |scene| {
            let found = self.contacts_of(scene, &mut |contact| {
                too_many = calls == most;
                if too_many {
                    return ControlFlow::Break(());
                }
                calls += 1;
                visit(contact)
            })?;
            Ok(found.map(|_| ()))
        })?;
        if too_many { Err(ids_repeat(a, b)) } else { Ok(calls) }
    }

    fn contacts_of(
        &mut self,
        scene: &Scene<'_>,
        visit: &mut dyn FnMut(Contact) -> ControlFlow<()>,
    ) -> Result<Option<Candidate>, QueryError> {
        self.stack.visit()?;
        if surely_apart(&scene.pair) {
            return Ok(None);
        }
        self.queue.clear();
        self.decoded.iter_mut().for_each(Decoded::start);
        let mut visitor = Contacts {
            scene,
            queue: &mut self.queue,
            decoded: &mut self.decoded,
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

/// No fewer than the triangles of a side, duplicates included, whatever its file states: what its pages have
/// room for. In a forged file any number of triangles may have the id that all duplicates belong to, and pairs
/// of them would be without number.
fn most_triangles(side: Shape<'_>) -> u64 {
    let pages: u64 = side.objects().iter().map(|object| u64::from(object.record.pages.get())).sum();
    let (layout, bytes) = (side.bvh().layout(), side.bvh().bytes());
    pages * MOST_TRIANGLES_A_PAGE + layout.duplicate_ids(bytes).len() as u64
}

/// 62 treelets of 8 children, each a packet.
const MOST_TRIANGLES_A_PAGE: u64 = 62 * 8 * PACKET as u64;

/// The breach behind more contacts than there are pairs of triangles.
#[cold]
fn ids_repeat(a: Shape<'_>, b: Shape<'_>) -> QueryError {
    let sections = [a, b].map(|side| &side.bvh().layout().sections);
    let duplicates = sections.into_iter().flatten().find(|section| section.kind == SectionKind::Duplicates);
    let at = duplicates.map_or(0, |section| section.range.start as u64);
    FormatError::new(Rule::DuplicateIds, at, "each id on one triangle", "contacts without number").into()
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
