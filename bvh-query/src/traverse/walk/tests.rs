//! Compares the walk with the plain one, which it refines.

use super::*;
use crate::file::bvh::Bvh;
use crate::isa::Backend;
use crate::isa::scalar::Scalar;
use crate::narrow::triangle_distance;
use crate::pose::Pose;
use crate::traverse::placement::Placement;
use bvh_format::object::Object;
use cbvh_testkit::Random;
use std::collections::BTreeSet;

/// A recursive walk of two objects, which only compares boxes.
pub(super) struct PlainWalk<'a> {
    pub(super) pair: &'a ObjectPair<'a>,
    pub(super) nodes: NodeCache,
    pub(super) limit: f64,
    pub(super) leaf_pairs: Vec<(LeafPacket, LeafPacket)>,
}

impl PlainWalk<'_> {
    pub(super) fn children_of_a(&mut self, a: ChildRef) -> Result<Vec<ChildRef>, QueryError> {
        self.children((self.pair.bvh_a, self.pair.object_a), a)
    }

    pub(super) fn children_of_b(&mut self, b: ChildRef) -> Result<Vec<ChildRef>, QueryError> {
        self.children((self.pair.bvh_b, self.pair.object_b), b)
    }

    fn children(
        &mut self,
        (bvh, object): (&Bvh, &Object),
        of: ChildRef,
    ) -> Result<Vec<ChildRef>, QueryError> {
        let mut number = self.nodes.open(Scalar, bvh, object, of, &mut max_nodes(object))?;
        let mut children = Vec::new();
        loop {
            let node = self.nodes.get(number);
            let lanes = node.lanes.all[1];
            children.extend(
                (0..4).filter(|child| lanes >> child & 1 == 1).map(|child| ChildRef::new(number, child)),
            );
            if !node.continues {
                return Ok(children);
            }
            number += 1;
        }
    }

    /// Returns a lower bound of the distance along the axes of A's frame. The placement's error is 32 roundings of the magnitudes
    /// of a placed point. Two points and two half sides are computed here, so that 16 times as much covers them all.
    pub(super) fn gap(&self, a: ChildRef, b: ChildRef) -> f64 {
        let placement = self.pair.placement;
        let ([lo_a, hi_a], [lo_b, hi_b]) = (self.box_of(a), self.box_of(b));
        let centre = placement.place([0, 1, 2].map(|i| (lo_b[i] + hi_b[i]) / 2.0));
        let gaps = [0, 1, 2].map(|axis| {
            let row = placement.rotation[axis];
            let half: f64 = (0..3).map(|i| row[i].abs() * (hi_b[i] - lo_b[i]) / 2.0).sum();
            (centre[axis] - half - hi_a[axis]).max(lo_a[axis] - centre[axis] - half)
        });
        gaps.into_iter().fold(f64::NEG_INFINITY, f64::max) - 16.0 * placement.error
    }

    fn box_of(&self, at: ChildRef) -> [[f64; 3]; 2] {
        let rows = self.nodes.get(at.node()).group.rows();
        [0, 16].map(|first| [0, 1, 2].map(|axis| f64::from(rows[first + axis][at.child()])))
    }
}

/// Keeps the pairs of leaf packets that a walk visits.
struct Kept {
    order: Order,
    limit: f32,
    leaf_pairs: Vec<(LeafPacket, LeafPacket)>,
}

impl Visitor for Kept {
    const MEASURE: Measure = Measure::Distance;
    const MAY_BE_BEST_FIRST: bool = true;

    fn order(&self) -> Order {
        self.order
    }

    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        _: I,
        leaves: (LeafPacket, LeafPacket),
        _at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.leaf_pairs.push(leaves);
        Ok(ControlFlow::Continue(()))
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, _: I) -> Result<(), QueryError> {
        Ok(())
    }
}

struct WalkPair<'a>(&'a ObjectPair<'a>, &'a mut PairMemory, &'a mut Kept);

impl Task for WalkPair<'_> {
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        traverse(isa, self.0, self.1, &mut Budget::new(u64::MAX), self.2)
    }
}

/// A triangle by its page, its packet and its lane.
type At = (u32, u16, u8);

/// Returns the pairs of triangles of leaf packets that are within a limit.
fn within(
    pair: &ObjectPair<'_>,
    pose: &Pose,
    leaf_pairs: &[(LeafPacket, LeafPacket)],
    limit: f64,
) -> BTreeSet<(At, At)> {
    let mut found = BTreeSet::new();
    for &(a, b) in leaf_pairs {
        for (lane_a, lane_b) in (0..a.triangles).flat_map(|a| (0..b.triangles).map(move |b| (a, b))) {
            let triangle_a = pair.bvh_a.vertices(pair.object_a, a, lane_a).unwrap();
            let triangle_b = pair.bvh_b.vertices(pair.object_b, b, lane_b).unwrap();
            let placed = triangle_b.map(|corner| pose.place(corner));
            if triangle_distance(&triangle_a, &placed).distance <= limit {
                let is_new = found.insert(((a.page, a.packet, lane_a), (b.page, b.packet, lane_b)));
                assert!(is_new, "{a:?} {b:?}");
            }
        }
    }
    found
}

/// Returns the centre of an object in the frame of its file, and the largest side of its box.
fn centre_and_size(object: &Object) -> ([f64; 3], f64) {
    let (record, origin) = (object.record(), object.origin());
    let ends = [0, 1, 2].map(|i| [record.box_lo[i], record.box_hi[i]].map(|end| f64::from(end.get())));
    let sides = ends.map(|[lo, hi]| hi - lo);
    let centre = [0, 1, 2].map(|i| origin[i] + (ends[i][0] + ends[i][1]) / 2.0);
    (centre, sides.into_iter().fold(0.0, f64::max))
}

#[test]
fn the_walk_finds_the_pairs_that_the_plain_one_finds() {
    let files: [&[u8]; 4] = [
        include_bytes!("../../../../testdata/ok-plain.cbvh"),
        include_bytes!("../../../../testdata/ok-profiles.cbvh"),
        include_bytes!("../../../../testdata/ok-topology.cbvh"),
        include_bytes!("../../../../testdata/ok-turning.cbvh"),
    ];
    let files = files.map(|bytes| Bvh::from_bytes(bytes.to_vec()).unwrap());
    let objects: Vec<_> = files.iter().flat_map(|bvh| bvh.objects().iter().map(move |o| (bvh, o))).collect();
    let (random, mut memory, mut total) = (&mut Random::new(77), PairMemory::default(), 0);
    for round in 0..200 {
        let [(bvh_a, object_a), (bvh_b, object_b)] = [(); 2].map(|()| objects[random.below(objects.len())]);
        let ((centre_a, size_a), (centre_b, size_b)) = (centre_and_size(object_a), centre_and_size(object_b));
        let turn = Pose::from_quaternion(random.quaternion(), [0.0; 3]).unwrap();
        let (turned, away) = (turn.place(centre_b), random.point());
        let translation = [0, 1, 2].map(|i| centre_a[i] - turned[i] + 0.4 * (size_a + size_b) * away[i]);
        let pose = Pose::new(*turn.rotation(), translation).unwrap();
        let placement = &Placement::new(&pose, object_a, object_b);
        let pair = &ObjectPair { bvh_a, object_a, bvh_b, object_b, placement, end: placement };
        let limit = [0.0, 0.05, 0.3][round % 3] as f32 * size_a.min(size_b) as f32;

        let limit64 = f64::from(limit);
        let (nodes, leaf_pairs) = (NodeCache::default(), Vec::new());
        let mut plain = PlainWalk { pair, nodes, limit: limit64, leaf_pairs };
        plain.nodes.start();
        let roots = [(bvh_a, object_a), (bvh_b, object_b)]
            .map(|(bvh, object)| plain.nodes.root(Scalar, bvh, object).unwrap().child());
        plain.visit(roots[0], roots[1]).unwrap();
        let expected = within(pair, &pose, &plain.leaf_pairs, limit64);
        total += expected.len();

        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            for order in [Order::Any, Order::Nearest, Order::Best { leaves: 8 }] {
                let mut kept = Kept { order, limit, leaf_pairs: Vec::new() };
                backend.run(WalkPair(pair, &mut memory, &mut kept)).unwrap();
                if order == (Order::Best { leaves: 8 }) {
                    // The first dive may visit a pair that comes again.
                    let mut seen = BTreeSet::new();
                    kept.leaf_pairs.retain(|(a, b)| seen.insert((a.page, a.packet, b.page, b.packet)));
                }
                assert_eq!(within(pair, &pose, &kept.leaf_pairs, limit64), expected, "{round} {backend:?}");
            }
        }
    }
    assert!(total > 1_000, "{total}");
}
