//! Finds all pairs of triangles of one mesh that meet where they should not.

use crate::error::QueryError;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::file::shape::Shape;
use crate::isa::{Isa, Task};
use crate::leaf::self_packet::{SelfFrame, SelfPacket};
use crate::narrow::{SelfContactKind, Triangle, self_contact};
use crate::query::contacts::{ids_repeat, max_triangles};
use crate::query::exact::{RecentTriangles, stored};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::budget::Budget;
use crate::traverse::packet_tree::{PacketTree, PacketVisitor};
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use bvh_format::validate::packets;
use std::ops::ControlFlow;

/// Two triangles of one mesh that meet where they should not: see [`Querier::self_contacts`](crate::Querier::self_contacts),
/// which has an example. The object and the triangle of A are before those of B.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SelfContact {
    /// The number that the object of the first triangle has in the file.
    pub object_a: u32,
    /// The first triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle_a: u32,
    /// The number that the object of the second triangle has in the file.
    pub object_b: u32,
    /// The second triangle.
    pub triangle_b: u32,
    /// How they meet.
    pub kind: SelfContactKind,
}

impl Querier {
    /// Returns all pairs of triangles of a shape that meet where they should not, in ascending order.
    ///
    /// Two triangles may meet in the corners and the edge that they have in common, and nowhere else. They are in contact if
    /// they share a point that is not in the hull of their common corners, or if they are duplicates, with the same corners
    /// in any order. [`SelfContactKind`] tells the cases apart. Corners are the same if their coordinates are equal, whatever
    /// the input called them. A triangle without area is the segment or point that it is: one that lies between its
    /// neighbours' common corners is not in contact with them. Each pair comes once; no triangle meets itself.
    ///
    /// If the file has ids, an exact duplicate that the baker left out counts as the triangle that it is. In a file without
    /// ids, nothing is known of it. The triangles of all objects of the shape are asked, and the radius of a shape does not
    /// matter: the answer is about its core. In a cloud of points, only equal points are in contact.
    ///
    /// The answer is exact, and the same on every backend. In meshes without triangles without area, these are the pairs that
    /// CGAL's `self_intersections` finds after equal points have been merged. CGAL reports a triangle without area as a pair
    /// with itself, and nothing else about it.
    ///
    /// Cost: reading the shape once, and 0.1 to 0.3 us per triangle of ordinary meshes. Memory, for the time of the call: up
    /// to 25 bytes per triangle, and 20 per contact. Each leaf packet, each pair of nodes or of leaf packets whose boxes
    /// overlap and each contact counts as a visit ([`Querier::set_budget`]).
    ///
    /// ```
    /// use bvh_query::{Querier, SelfContact, SelfContactKind};
    ///
    /// # let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 0.0]];
    /// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners.to_vec(), vec![[0, 1, 2], [3, 4, 5]]);
    /// # let mesh = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &Default::default())?.0)?;
    /// // A mesh of two triangles, the second of which crosses the first.
    /// let found = Querier::new()?.self_contacts(&mesh)?;
    /// let [SelfContact { triangle_a: 0, triangle_b: 1, kind, .. }] = found[..] else { panic!("{found:?}") };
    /// assert_eq!(kind, SelfContactKind::Crossing);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page of the shape is damaged, [`QueryError::Budget`] if the budget does not suffice.
    pub fn self_contacts<'a>(&mut self, shape: impl Into<Shape<'a>>) -> Result<Vec<SelfContact>, QueryError> {
        let mut contacts = Vec::new();
        self.visit_self_contacts(shape, |contact| {
            contacts.push(contact);
            ControlFlow::Continue(())
        })?;
        contacts.sort_unstable();
        Ok(contacts)
    }

    /// Calls `visit` once for each pair of triangles of a shape that meet where they should not, in no particular order, until
    /// it breaks. Returns the number of calls.
    ///
    /// ```
    /// use bvh_query::Querier;
    /// use std::ops::ControlFlow;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let calls = Querier::new()?.visit_self_contacts(&block, |_| ControlFlow::Break(()))?;
    /// assert_eq!(calls, 0); // neighbours meet in their common edges alone
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::self_contacts`].
    pub fn visit_self_contacts<'a>(
        &mut self,
        shape: impl Into<Shape<'a>>,
        mut visit: impl FnMut(SelfContact) -> ControlFlow<()>,
    ) -> Result<u64, QueryError> {
        self.start();
        self.each_self_contact(shape.into(), &mut visit)
    }

    /// Does the work of `visit_self_contacts`, and is compiled with this crate, not again with each that calls it.
    fn each_self_contact(
        &mut self,
        shape: Shape<'_>,
        visit: &mut dyn FnMut(SelfContact) -> ControlFlow<()>,
    ) -> Result<u64, QueryError> {
        let triangles = max_triangles(shape);
        let mut reports = Reports { shape, visit, calls: 0, most: triangles.saturating_mul(triangles) / 2 };
        let (budget, frames) = (&mut self.memory.budget, &frames(shape));
        let tree = &self.backend.run(Gather { shape, frames, budget })?;
        if reports.duplicates(tree, budget)?.is_break() {
            return Ok(reports.calls);
        }
        let visit: VisitSelfContact<'_> =
            &mut |places, kind, budget| reports.pair(tree, places, kind, budget);
        let (recent, stats) = (Default::default(), QueryStats::default());
        let exact = ExactPairs { shape, tree, recent, stats, visit };
        let mut visitor =
            SelfVisitor { frames, kept: [KeptPackets::new(tree), KeptPackets::new(tree)], exact };
        self.backend.run(VisitPairs { tree, budget, visitor: &mut visitor })?;
        self.stats = visitor.exact.stats;
        Ok(reports.calls)
    }
}

/// Returns the frame of each object of a shape.
fn frames(shape: Shape<'_>) -> Vec<SelfFrame> {
    let origin = shape.objects().first().map_or([0.0; 3], Object::origin);
    let objects = shape.objects().iter().enumerate();
    objects.map(|(place, object)| SelfFrame::new(place as u32, object, origin)).collect()
}

/// Reads the packets of a shape. Each counts as a visit.
struct Gather<'a> {
    shape: Shape<'a>,
    frames: &'a [SelfFrame],
    budget: &'a mut Budget,
}

impl Task for Gather<'_> {
    type Output = Result<PacketTree, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let (bvh, mut tree, mut placed) = (self.shape.bvh(), PacketTree::default(), SelfPacket::NONE);
        for (place, object) in self.shape.objects().iter().enumerate() {
            for number in object.pages() {
                let page = bvh.page(object, number)?;
                for (packet, triangles) in packets(&page) {
                    self.budget.visit()?;
                    let leaf = LeafPacket { page: number, packet, triangles: triangles as u8 };
                    let mut room = Packet::NONE;
                    let stored = bvh.packet(isa, object, leaf, &mut room)?;
                    placed.enclose(isa, &self.frames[place], stored, leaf.triangles);
                    tree.push(place as u32, leaf, &placed.boxes);
                }
            }
        }
        tree.build();
        Ok(tree)
    }
}

/// Visits all pairs of packets whose boxes overlap.
struct VisitPairs<'a, 'b> {
    tree: &'a PacketTree,
    budget: &'a mut Budget,
    visitor: &'a mut SelfVisitor<'b>,
}

impl Task for VisitPairs<'_, '_> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.tree.visit_pairs(isa, self.budget, self.visitor)
    }
}

/// What is done with two stored triangles in contact: each by the number of its packet and its place there.
type VisitSelfContact<'a> =
    &'a mut dyn FnMut([(u32, u8); 2], SelfContactKind, &mut Budget) -> Result<ControlFlow<()>, QueryError>;

/// Decides which triangles of two packets are in contact.
struct SelfVisitor<'a> {
    frames: &'a [SelfFrame],
    /// Of both sides of a pair.
    kept: [KeptPackets; 2],
    exact: ExactPairs<'a>,
}

/// The most packets kept for each side of a pair, a power of two: 96 KiB for both, so that they stay in the second-level cache.
const PACKETS_PER_SIDE: usize = 128;

/// The packets of one side that were fetched last. A packet has one place, which follows from its number.
struct KeptPackets {
    /// As many as `packets`, a power of two.
    numbers: Vec<u32>,
    packets: Vec<SelfPacket>,
}

impl KeptPackets {
    /// Makes room for packets of a tree.
    fn new(tree: &PacketTree) -> Self {
        let room = tree.packets().len().next_power_of_two().min(PACKETS_PER_SIDE);
        Self { numbers: vec![u32::MAX; room], packets: vec![SelfPacket::NONE; room] }
    }

    /// Returns a packet, which `task` makes if it is not here.
    #[inline(always)]
    fn get<I: Isa>(&mut self, isa: I, task: PlacePacket<'_>) -> Result<&SelfPacket, QueryError> {
        let place = task.number as usize & (self.packets.len() - 1);
        if self.numbers[place] != task.number {
            self.numbers[place] = u32::MAX;
            isa.run(PlaceIn(task, &mut self.packets[place]))?;
            self.numbers[place] = task.number;
        }
        Ok(&self.packets[place])
    }
}

/// A packet to fetch.
#[derive(Clone, Copy)]
struct PlacePacket<'a> {
    shape: Shape<'a>,
    frames: &'a [SelfFrame],
    tree: &'a PacketTree,
    number: u32,
}

/// Fetches a packet.
struct PlaceIn<'a, 'b>(PlacePacket<'a>, &'b mut SelfPacket);

impl Task for PlaceIn<'_, '_> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self(PlacePacket { shape, frames, tree, number }, to) = self;
        let (object, leaf) = tree.packets()[number as usize];
        let mut room = Packet::NONE;
        let stored = shape.bvh().packet(isa, &shape.objects()[object as usize], leaf, &mut room)?;
        to.place(isa, &frames[object as usize], stored, leaf.triangles);
        Ok(())
    }
}

impl PacketVisitor for SelfVisitor<'_> {
    #[inline(always)]
    fn packets<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (u32, u32),
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError> {
        let Self { frames, kept: [kept_a, kept_b], exact } = self;
        exact.stats.packet_tests += 1;
        let of = |number| PlacePacket { shape: exact.shape, frames, tree: exact.tree, number };
        let (packet_a, packet_b) = (kept_a.get(isa, of(a))?, kept_b.get(isa, of(b))?);
        let mut mask = packet_a.undecided(isa, packet_b, a == b);
        let are_exact = packet_a.are_exact(packet_b);
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            let places = [(a, lane / 4), (b, lane % 4)];
            let flow = if are_exact {
                exact.decide(places, &packet_a.triangle(lane / 4), &packet_b.triangle(lane % 4), budget)?
            } else {
                exact.decide_stored(places, budget)?
            };
            if flow.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Decides pairs of triangles exactly.
struct ExactPairs<'a> {
    shape: Shape<'a>,
    tree: &'a PacketTree,
    /// Of both sides of a pair.
    recent: [RecentTriangles; 2],
    stats: QueryStats,
    visit: VisitSelfContact<'a>,
}

impl ExactPairs<'_> {
    /// Decides a pair of triangles in one frame.
    #[inline(never)]
    fn decide(
        &mut self,
        places: [(u32, u8); 2],
        a: &Triangle,
        b: &Triangle,
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        match self_contact(a, b) {
            Some(kind) => (self.visit)(places, kind, budget),
            None => Ok(ControlFlow::Continue(())),
        }
    }

    /// Decides a pair of triangles in the frame of the file, such as those of two objects.
    #[inline(never)]
    fn decide_stored(
        &mut self,
        places: [(u32, u8); 2],
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError> {
        let (shape, tree) = (self.shape, self.tree);
        let place = |recent: &mut RecentTriangles, (packet, lane): (u32, u8)| {
            let (object, leaf) = tree.packets()[packet as usize];
            let object = &shape.objects()[object as usize];
            recent.get_or_place(leaf, lane, || stored(shape.bvh(), object, leaf, lane)).copied()
        };
        let [recent_a, recent_b] = &mut self.recent;
        let (a, b) = (place(recent_a, places[0])?, place(recent_b, places[1])?);
        self.decide(places, &a, &b, budget)
    }
}

/// What has been reported.
struct Reports<'a> {
    shape: Shape<'a>,
    visit: &'a mut dyn FnMut(SelfContact) -> ControlFlow<()>,
    calls: u64,
    /// There are no more pairs of triangles than this. In a forged file, any number of triangles may have the same id.
    most: u64,
}

impl Reports<'_> {
    /// Reports a pair of triangles, each with the number of its object and its id.
    fn report(
        &mut self,
        first: (u32, u32),
        second: (u32, u32),
        kind: SelfContactKind,
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError> {
        budget.visit()?;
        if self.calls == self.most {
            return Err(ids_repeat(self.shape, self.shape));
        }
        self.calls += 1;
        let ((object_a, triangle_a), (object_b, triangle_b)) = (first.min(second), first.max(second));
        Ok((self.visit)(SelfContact { object_a, triangle_a, object_b, triangle_b, kind }))
    }

    /// Reports a pair of stored triangles and all pairs of duplicates that they stand for.
    fn pair(
        &mut self,
        tree: &PacketTree,
        places: [(u32, u8); 2],
        kind: SelfContactKind,
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError> {
        let [(object_a, id_a), (object_b, id_b)] = [self.id(tree, places[0])?, self.id(tree, places[1])?];
        let bvh = self.shape.bvh();
        for a in std::iter::once(id_a).chain(bvh.duplicates_of(id_a)?) {
            for b in std::iter::once(id_b).chain(bvh.duplicates_of(id_b)?) {
                if self.report((object_a, a), (object_b, b), kind, budget)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Reports all pairs of a stored triangle and its duplicates that were left out.
    fn duplicates(&mut self, tree: &PacketTree, budget: &mut Budget) -> Result<ControlFlow<()>, QueryError> {
        let bvh = self.shape.bvh();
        if bvh.layout().duplicate_ids(bvh.bytes()).is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        for (number, (_, leaf)) in tree.packets().iter().enumerate() {
            for lane in 0..leaf.triangles {
                let (object, id) = self.id(tree, (number as u32, lane))?;
                let equal: Vec<u32> = std::iter::once(id).chain(bvh.duplicates_of(id)?).collect();
                for (at, &a) in equal.iter().enumerate() {
                    for &b in &equal[at + 1..] {
                        let kind = SelfContactKind::Duplicate;
                        if self.report((object, a), (object, b), kind, budget)?.is_break() {
                            return Ok(ControlFlow::Break(()));
                        }
                    }
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Returns the number of the object of a stored triangle, and its id.
    fn id(&self, tree: &PacketTree, (packet, lane): (u32, u8)) -> Result<(u32, u32), QueryError> {
        let (bvh, (object, leaf)) = (self.shape.bvh(), tree.packets()[packet as usize]);
        let place = TrianglePlace { page: leaf.page, packet: leaf.packet, lane };
        let id = bvh.triangle_id(&self.shape.objects()[object as usize], place)?;
        Ok((self.shape.first() as u32 + object, id))
    }
}
