//! The walk of a line along the boxes that an open file keeps for rays: the same question, sooner.

use crate::error::QueryError;
use crate::file::ray_tree::RayTree;
use crate::isa::{Isa, Task};
use crate::leaf::line_shear::LineShear;
use crate::narrow::Triangle;
use crate::query::probe::line::{Asked, Clipped, LineQuestions, farthest};
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::stats::QueryStats;
use crate::traverse::line_filter::Segment;
use crate::traverse::ray_walk::{BoxFilter, RayVisitor};
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::leaf::Packet;

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
            let Clipped { segment: Segment { start, error, .. }, direction, inverse, inverse_length, .. } =
                &of.clipped;
            let shear = LineShear::new(start, (direction, inverse), *error, farthest(start, &into.bounds));
            let along = inverse.map(|v| v * inverse_length);
            // Entries may exceed the end of a segment by rounding.
            let end = if of.clipped.whole == 2.0 { 1.0 + 1.0 / (1 << 20) as f32 } else { f32::INFINITY };
            let filter = BoxFilter::new(start, &along, *error, end);
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
                let offsets = packet.triangle(lane.into());
                offsets.map(|v| [0, 1, 2].map(|axis| vertices.origin[axis] + f64::from(v[axis])))
            } else {
                of.bvh.vertices(of.object, leaf, lane)?
            };
            of.decide_about(triangle, leaf, lane)?;
        }
        Ok(())
    }
}
