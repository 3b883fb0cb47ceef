//! The walks of a line: they find the triangles of objects that a line may meet, nearest first, and hand them to its question.
//!
//! A line walks the treelets of a file, or the boxes that an open file keeps for rays, once there are some. Nodes are tested in f32, and
//! packets in f32 or f64. The remaining triangles go to the question, which decides exactly, so that both walks have the same answers.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::file::ray_tree::RayTree;
use crate::isa::{Isa, Task};
use crate::leaf::frame::scale_of;
use crate::leaf::line_shear::LineShear;
use crate::leaf::line_sides::{crossed, direction};
use crate::leaf::point_bounds::LocalPoint;
use crate::narrow::Triangle;
use crate::query::probe::line::{Asked, Clipped, LineQuestion, LineQuestions, Posed, farthest};
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::line_filter::{LineFilter, Segment};
use crate::traverse::probe_walk::ProbeVisitor;
use crate::traverse::ray_build::MakeRayTree;
use crate::traverse::ray_walk::{BoxFilter, RayVisitor};
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::leaf::Packet;
use bvh_format::slabs::Group;

/// Modules for browsers do without the tree of boxes, whose code would be a twentieth of what a page has to load.
const HAS_TREES: bool = !cfg!(all(target_arch = "wasm32", target_os = "unknown"));

impl Querier {
    /// Asks a question about a line and all objects of a shape.
    pub(crate) fn ask_line(
        &mut self,
        placed: &PlacedShape<'_>,
        question: &mut impl LineQuestion,
    ) -> Result<(), QueryError> {
        for index in 0..placed.shape.objects().len() {
            self.memory.budget.visit()?;
            self.ask_line_of_object(placed, index, question)?;
        }
        Ok(())
    }

    /// Asks a question about a line and one object of a shape, which the caller has charged.
    pub(super) fn ask_line_of_object(
        &mut self,
        placed: &PlacedShape<'_>,
        index: usize,
        question: &mut impl LineQuestion,
    ) -> Result<(), QueryError> {
        self.ask_lines_of_object(placed, index, &mut std::slice::from_mut(question).iter_mut())
    }

    /// Starts a query, and asks questions about lines of which each has the whole budget. If one fails, so do all.
    #[cfg(feature = "parallel")]
    pub(super) fn ask_lines<Q: LineQuestion>(
        &mut self,
        placed: &PlacedShape<'_>,
        questions: &mut [Q],
    ) -> Result<(), QueryError> {
        self.start();
        if !self.memory.budget.is_unlimited() {
            return Err(self.memory.budget.error());
        }
        // Lines along boxes make no visits.
        self.memory.budget.go_on()?;
        for index in 0..placed.shape.objects().len() {
            self.ask_lines_of_object(placed, index, &mut questions.iter_mut())?;
        }
        Ok(())
    }

    /// Asks questions about lines and one object of a shape.
    fn ask_lines_of_object(
        &mut self,
        placed: &PlacedShape<'_>,
        index: usize,
        questions: &mut dyn LineQuestions,
    ) -> Result<(), QueryError> {
        let (bvh, object) = (placed.shape.bvh(), &placed.shape.objects()[index]);
        let slot = bvh.ray_slot(placed.shape.first() + index);
        let (memory, stats) = (&mut self.memory, &mut self.stats);
        // A budget limits the visits of a walk, which must not depend on what was asked before.
        let may_have_tree = HAS_TREES && memory.budget.is_unlimited();
        let make = || self.backend.run(MakeRayTree { bvh, object }).ok().flatten();
        let tree = if may_have_tree { slot.tree(object.record().treelets.get(), make) } else { None };
        if let Some(tree) = tree {
            let posed_into;
            let into = if placed.pose.is_none() {
                let of = (bvh.identity(), placed.shape.first() + index);
                match &mut self.own_frame {
                    Some((known, into)) if *known == of => into,
                    other => &mut other.insert((of, IntoObject::new(None, object))).1,
                }
            } else {
                posed_into = IntoObject::new(placed.pose.as_ref(), object);
                &posed_into
            };
            return self.backend.run(AskTree { tree, placed, index, into, questions, memory, stats });
        }
        while let Some(posed) = questions.next() {
            slot.spend(self.backend.run(AskObject { placed, index, posed, memory, stats })?);
        }
        Ok(())
    }
}

/// Asks about an object, with the features of a backend.
struct AskObject<'a> {
    placed: &'a PlacedShape<'a>,
    index: usize,
    posed: Posed<'a>,
    memory: &'a mut WalkMemory,
    stats: &'a mut QueryStats,
}

impl Task for AskObject<'_> {
    /// The number of node tests.
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { placed, index, posed, memory, stats } = self;
        let (bvh, object) = (placed.shape.bvh(), &placed.shape.objects()[index]);
        let into = IntoObject::new(placed.pose.as_ref(), object);
        let Some(of) = Asked::new(placed, index, (&into, false), posed, stats) else { return Ok(0) };
        let mut visitor = Walked {
            test: LineFilter::new(isa, &of.clipped.segment, object.profile().directions()),
            direction: direction(&of.clipped.direction),
            scale: scale_of(into.size) as f32,
            rooms: [Packet::NONE; 4],
            of,
        };
        let tests = isa.run(memory.probe_walk(bvh, object, &mut visitor))?;
        visitor.of.stats.node_tests += tests;
        Ok(tests)
    }
}

/// Hands the triangles of an object that a line may meet to a question, along its treelets.
struct Walked<'a> {
    of: Asked<'a>,
    test: LineFilter,
    direction: [f32; 3],
    /// The inverse of the largest side of the box, a power of two.
    scale: f32,
    /// Room for packets that are encoded.
    rooms: [Packet; 4],
}

impl ProbeVisitor for Walked<'_> {
    #[inline(always)]
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::F32x4 {
        self.test.entries(isa, children)
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.of.limit
    }

    #[inline(always)]
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError> {
        let Self { of, direction, scale, rooms, .. } = self;
        of.stats.packet_tests += leaves.len() as u64;
        let (packets, valid) = of.bvh.packets(isa, of.object, leaves, rooms)?;
        let corner = &packets[0].corners[0];
        let near = of.clipped.nearest(&[corner[0][0], corner[1][0], corner[2][0]]);
        let point = LocalPoint::new(&near, of.clipped.segment.error, *scale);
        // A line may pass a rounded triangle on any side.
        let is_rounded = of.clipped.radius > 0.0;
        let mut left = if is_rounded { valid } else { valid & crossed(isa, packets, &point, direction) };
        while left != 0 && of.limit >= 0.0 {
            let at = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            of.decide(leaves[at / 4], (at & 3) as u8)?;
        }
        Ok(())
    }
}

/// Asks about an object along the tree that it has for rays.
pub(super) struct AskTree<'a> {
    pub(super) tree: &'a RayTree,
    pub(super) placed: &'a PlacedShape<'a>,
    pub(super) index: usize,
    pub(super) into: &'a IntoObject,
    pub(super) questions: &'a mut dyn LineQuestions,
    pub(super) memory: &'a mut WalkMemory,
    pub(super) stats: &'a mut QueryStats,
}

impl Task for AskTree<'_> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { tree, placed, index, into, questions, memory, stats } = self;
        let mut room = Packet::NONE;
        while let Some(posed) = questions.next() {
            let Some(of) = Asked::new(placed, index, (into, true), posed, stats) else { continue };
            let Clipped {
                segment: Segment { start, error, reach, .. },
                direction,
                inverse,
                inverse_length,
                ..
            } = &of.clipped;
            let shear = LineShear::new(start, (direction, inverse), *error, farthest(start, &into.bounds));
            let along = inverse.map(|v| v * inverse_length);
            // Entries may exceed the end of a segment by rounding.
            let end = if of.clipped.whole == 2.0 { 1.0 + 1.0 / (1 << 20) as f32 } else { f32::INFINITY };
            let filter = BoxFilter::new(start, &along, [*error, *reach], end);
            let mut visitor = AlongTree { of, tree, shear, room: &mut room };
            let tests = memory.ray_walk(tree, filter, &mut visitor).run(isa)?;
            visitor.of.stats.node_tests += tests;
        }
        Ok(())
    }
}

/// Hands the triangles that a line may meet to a question.
struct AlongTree<'a> {
    of: Asked<'a>,
    tree: &'a RayTree,
    shear: LineShear,
    /// Room for a packet that is encoded.
    room: &'a mut Packet,
}

impl RayVisitor for AlongTree<'_> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.of.limit
    }

    #[inline(always)]
    fn leaf<I: Isa>(&mut self, isa: I, (place, triangles): (u32, u8)) -> Result<(), QueryError> {
        let Self { of, tree, shear, room } = self;
        let places = &tree.places;
        of.stats.packet_tests += 1;
        let packet = match places.plain.and_then(|first| of.bvh.packet_at(first, place)) {
            Some(packet) => packet,
            None => of.bvh.packet(isa, of.object, places.packet(place, triangles), room)?,
        };
        let valid = (1u16 << triangles) - 1;
        // A line may pass a rounded triangle on any side.
        let is_rounded = of.clipped.radius > 0.0;
        let mut left = if is_rounded { valid } else { valid & shear.crossed(isa, packet) };
        while left != 0 && of.limit >= 0.0 {
            let lane = left.trailing_zeros() as u8 & 3;
            left &= left - 1;
            let leaf = places.packet(place, triangles);
            let vertices = of.object.vertices();
            let triangle: Triangle = if vertices.are_sums() {
                let (offsets, mut triangle) = (packet.triangle(lane.into()), [[0.0; 3]; 3]);
                for corner in 0..3 {
                    for axis in 0..3 {
                        triangle[corner][axis] = vertices.origin[axis] + f64::from(offsets[corner][axis]);
                    }
                }
                triangle
            } else {
                of.bvh.vertices(of.object, leaf, lane)?
            };
            of.decide_about(triangle, leaf, lane)?;
        }
        Ok(())
    }
}
