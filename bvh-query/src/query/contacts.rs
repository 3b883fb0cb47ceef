//! Finds all pairs of triangles in contact.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::numerics::round_up;
use crate::pose::Pose;
use crate::query::bounding_volumes::{sphere_gap, surely_apart};
use crate::query::options::DistanceOptions;
use crate::query::pair_search::{PairSearch, ids};
use crate::query::placed_pair::{PlacedPair, each_pair};
use crate::query::querier::Querier;
use crate::query::rounded::sum_of_radii;
use crate::traverse::placement::ObjectPair;
use crate::traverse::walk::Order;
use bvh_format::header::SectionKind;
use bvh_format::leaf::PACKET;
use bvh_format::page::MAX_PACKETS_PER_PAGE;
use bvh_format::{FormatError, Rule};
use std::ops::ControlFlow;

/// What is done with a contact and the pair of stored triangles that it is about.
pub(super) type Report<'a> = &'a mut dyn FnMut(Contact, TrianglePair) -> ControlFlow<()>;

/// A pair of triangles in contact.
///
/// [`Querier::contacts`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// The number that the object of A has in its file.
    pub object_a: u32,
    /// The triangle of A: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle_a: u32,
    /// The number that the object of B has in its file.
    pub object_b: u32,
    /// The triangle of B.
    pub triangle_b: u32,
}

impl Querier {
    /// Returns all pairs of triangles in contact, in ascending order.
    ///
    /// The answer is that of exact predicates on all pairs of the input's triangles. For shapes with radii, these are the pairs
    /// of triangles of their cores that are within the sum of the radii. If the file has ids, an exact
    /// duplicate that the baker left out is in contact wherever the triangle that replaces it is. Each contact counts
    /// as a visit ([`Querier::set_budget`]).
    ///
    /// ```
    /// use bvh_query::{Contact, Pose, Querier};
    ///
    /// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
    /// # let triangle = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &Default::default())?.0)?;
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let contacts = querier.contacts(&triangle, &triangle, &Pose::IDENTITY)?;
    /// assert_eq!(contacts, [Contact { object_a: 0, triangle_a: 0, object_b: 0, triangle_b: 0 }]);
    /// // An edge of the triangle lies on the face of the block that is at x = 0.
    /// let contacts = querier.contacts(&triangle, &block, &Pose::new(*Pose::IDENTITY.rotation(), [-1.0, 0.0, 0.0])?)?;
    /// assert!(!contacts.is_empty() && contacts.iter().all(|contact| contact.triangle_a == 0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, [`QueryError::Budget`] if the budget does not
    /// suffice.
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

    /// Calls `visit` once for each pair of triangles in contact, in no particular order, until it breaks. Returns the
    /// number of calls.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier};
    /// use std::ops::ControlFlow;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut some = Vec::new();
    /// let calls = Querier::new()?.visit_contacts(&block, &block, &Pose::IDENTITY, |contact| {
    ///     some.push(contact);
    ///     if some.len() == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    /// })?;
    /// assert_eq!(calls, 5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::contacts`].
    pub fn visit_contacts<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        mut visit: impl FnMut(Contact) -> ControlFlow<()>,
    ) -> Result<u64, QueryError> {
        self.start();
        self.visit_places(a.into(), b.into(), pose, &mut |contact, _| visit(contact))
    }

    /// Calls `visit` for each contact, with the places of its triangles; duplicates have those of the triangles that replace
    /// them.
    pub(super) fn visit_places(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        visit: Report<'_>,
    ) -> Result<u64, QueryError> {
        let most = max_triangles(a).saturating_mul(max_triangles(b));
        let (within, mut calls, mut too_many) = (sum_of_radii(a, b), 0, false);
        each_pair(a, b, pose, |placed| {
            let found = self.contacts_of(placed, within, &mut |contact, pair| {
                too_many = calls == most;
                if too_many {
                    return ControlFlow::Break(());
                }
                calls += 1;
                visit(contact, pair)
            })?;
            Ok(found.map(|_| ()))
        })?;
        if too_many { Err(ids_repeat(a, b)) } else { Ok(calls) }
    }

    fn contacts_of(
        &mut self,
        placed: &PlacedPair<'_>,
        within: f64,
        visit: Report<'_>,
    ) -> Result<Option<TrianglePair>, QueryError> {
        self.memory.budget.visit()?;
        let apart = if within == 0.0 {
            surely_apart(&placed.pair)
        } else {
            let ObjectPair { placement, object_a, object_b, .. } = placed.pair;
            sphere_gap(placement, object_a, object_b) > f64::from(round_up(within))
        };
        if apart {
            return Ok(None);
        }
        // The walk has the budget meanwhile. So contacts are charged behind it, and it may report no more than are left now.
        let budget = self.memory.budget.clone();
        let mut contacts = 0;
        let mut count = |contact, pair| {
            if contacts == budget.left() {
                return Err(budget.error());
            }
            contacts += 1;
            Ok(visit(contact, pair))
        };
        let visit = &mut |candidate| report(placed, candidate, &mut count);
        let found = if within == 0.0 {
            self.walk_contacts(placed, Order::Any, TriangleQueue::FULL, visit)?
        } else {
            let search = &mut PairSearch::new(DistanceOptions::default(), within);
            self.walk_nearest(placed, search, Some((within, visit)))?
        };
        self.memory.budget.charge(contacts)?;
        Ok(found)
    }
}

/// Returns an upper bound of the triangles of a side, duplicates included, whatever its file states: what its pages have
/// room for. In a forged file any number of triangles may have the id that all duplicates belong to, so that the
/// number of their pairs would have no bound.
pub(super) fn max_triangles(side: Shape<'_>) -> u64 {
    let (layout, bytes) = (side.bvh().layout(), side.bvh().bytes());
    let pages = match side.objects() {
        [object] => object.record().pages.get(),
        // A shape of several objects is a whole file.
        _ => layout.page_count(),
    };
    u64::from(pages) * MAX_TRIANGLES_PER_PAGE + layout.duplicate_ids(bytes).len() as u64
}

/// More triangles than a page has.
const MAX_TRIANGLES_PER_PAGE: u64 = (MAX_PACKETS_PER_PAGE * PACKET) as u64;

/// Returns the rule that is broken where there are more contacts than pairs of triangles.
#[cold]
pub(super) fn ids_repeat(a: Shape<'_>, b: Shape<'_>) -> QueryError {
    let sections = [a, b].map(|side| &side.bvh().layout().sections);
    let duplicates = sections.into_iter().flatten().find(|section| section.kind == SectionKind::Duplicates);
    let at = duplicates.map_or(0, |section| section.range.start as u64);
    FormatError::new(Rule::DuplicateIds, at, "each id on one triangle", "contacts without number").into()
}

/// Reports a pair of stored triangles and all pairs of duplicates that they stand for.
fn report(
    placed: &PlacedPair<'_>,
    candidate: TrianglePair,
    visit: &mut dyn FnMut(Contact, TrianglePair) -> Result<ControlFlow<()>, QueryError>,
) -> Result<ControlFlow<TrianglePair>, QueryError> {
    let pair = &placed.pair;
    let (id_a, id_b) = ids(placed, &candidate)?;
    for triangle_a in std::iter::once(id_a).chain(pair.bvh_a.duplicates_of(id_a)?) {
        for triangle_b in std::iter::once(id_b).chain(pair.bvh_b.duplicates_of(id_b)?) {
            let (object_a, object_b) = placed.numbers;
            if visit(Contact { object_a, triangle_a, object_b, triangle_b }, candidate)?.is_break() {
                return Ok(ControlFlow::Break(candidate));
            }
        }
    }
    Ok(ControlFlow::Continue(()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bvh;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, Profile, TriangleEncoding, to_bytes};

    /// Short treelets let a page have more packets than 62 treelets of whole lines have room for.
    #[test]
    fn no_page_has_more_triangles_than_contacts_count_on() {
        let positions: Vec<[f64; 3]> =
            (0..2202u32).map(|n| [f64::from(n % 47), f64::from(n / 47), f64::from(n * n % 7)]).collect();
        let mesh = Mesh::from_triangles(positions, (0..2200).map(|n| [n, n + 1, n + 2]).collect());
        let options = Options::default().profile(Profile::Dop6U8).triangles(TriangleEncoding::Packed);
        let bvh = Bvh::from_bytes(to_bytes(&mesh, &options).unwrap().0).unwrap();
        assert_eq!(bvh.objects()[0].record().pages.get(), 1);
        assert!(bvh.objects()[0].record().packets.get() > 62 * 8);
        assert!(max_triangles(bvh.all()) >= 2200);
    }
}
