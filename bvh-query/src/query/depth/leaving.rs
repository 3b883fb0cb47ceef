//! What stays in contact the longest when B moves along a direction.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::Isa;
use crate::leaf::queue::TrianglePair;
use crate::narrow::{Point, Triangle, Way, leaves_before, stretch};
use crate::numerics::round_up;
use crate::query::bounding_volumes::surely_apart;
use crate::query::collide::{Candidates, ContactVisitor};
use crate::query::depth::translation::Translation;
use crate::query::placed_pair::{PlacedPair, Walk, each_pair};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::node_filter::Measure;
use crate::traverse::walk::{Finish, Order, VisitLeaves, Visitor};
use std::cell::Cell;
use std::ops::ControlFlow;

/// How far B moves from a place on a line until the last of the triangles that touch there has left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaving {
    /// Some pair of triangles certainly crosses from the place on until this far; 0 if none does.
    pub(super) crosses_until: f64,
    /// All pairs that are in contact at the place have left after this; none if nothing touches there.
    pub(super) touches_until: Option<f64>,
    /// The unit normal through which the last pair leaves.
    pub(super) normal: Point,
    /// The last pair, where it is at the place.
    pub(super) last: [Triangle; 2],
}

impl Leaving {
    /// Counts a pair of triangles in contact. The result does not depend on the order of pairs.
    fn count(&mut self, (until, crosses_until): (f64, f64), normal: Point, pair: [Triangle; 2]) {
        self.crosses_until = self.crosses_until.max(crosses_until);
        let is_later = match self.touches_until {
            Some(latest) => until > latest || until == latest && (normal, pair) < (self.normal, self.last),
            None => true,
        };
        if is_later {
            (self.touches_until, self.normal, self.last) = (Some(until), normal, pair);
        }
    }
}

impl Querier {
    /// Returns what stays in contact the longest, from a place of B on a line on.
    pub(super) fn leaving(&mut self, line: &Translation<'_>, at: f64) -> Result<Leaving, QueryError> {
        let found = Cell::new(Leaving {
            crosses_until: 0.0,
            touches_until: None,
            normal: line.direction,
            last: [[[0.0; 3]; 3]; 2],
        });
        let pose = line.pose_at(at);
        each_pair(line.a, line.b, &pose, |placed| {
            self.leaving_of(placed, line, &found).map(|()| None::<()>)
        })?;
        Ok(found.get())
    }

    fn leaving_of(
        &mut self,
        placed: &PlacedPair<'_>,
        line: &Translation<'_>,
        found: &Cell<Leaving>,
    ) -> Result<(), QueryError> {
        self.memory.budget.visit()?;
        if surely_apart(&placed.pair) {
            return Ok(());
        }
        self.queue.clear();
        self.start_placed();
        let way = Way { direction: line.direction, length: line.length, error: line.placing };
        let visit = &mut |pair: TrianglePair| {
            let a = placed.triangle_a(pair.a, pair.lane_a)?;
            let b = placed.triangle_b(pair.b, pair.lane_b)?;
            let mut leaving = found.get();
            if leaves_before(&a, &b, &way, leaving.crosses_until) {
                return Ok(ControlFlow::Continue(()));
            }
            let stretch = stretch(&a, &b, &way);
            let crosses = stretch.inner[0] < 0.0 && stretch.inner[1] > 0.0;
            let crosses_until = if crosses { stretch.inner[1] } else { 0.0 };
            leaving.count((stretch.outer[1].max(0.0), crosses_until), stretch.normal, [a, b]);
            found.set(leaving);
            Ok(ControlFlow::Continue(()))
        };
        let candidates = Candidates {
            placed,
            queue: &mut self.queue,
            drain_at: FIRST_DRAIN,
            stats: QueryStats::default(),
            recent: &mut self.recent,
            visit,
            found: None,
        };
        let contacts = ContactVisitor { packets: &mut self.packets, order: Order::Nearest, candidates };
        let mut visitor = LeavingVisitor { contacts, direction: line.direction, found };
        let task = &mut Walk { pair: &placed.pair, memory: &mut self.memory, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let stats = visitor.contacts.candidates.stats;
        self.stats.add(tests, stats);
        Ok(())
    }
}

/// The number of candidates that are decided first, so that a limit is known soon.
const FIRST_DRAIN: usize = 4;

/// Visits pairs of triangles in contact that may stay longer than those that were found.
struct LeavingVisitor<'a> {
    contacts: ContactVisitor<'a>,
    direction: Point,
    found: &'a Cell<Leaving>,
}

impl Visitor for LeavingVisitor<'_> {
    const MEASURE: Measure = Measure::Leaving;

    fn order(&self) -> Order {
        self.contacts.order()
    }

    fn direction(&self) -> Point {
        self.direction
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        round_up(-self.found.get().crosses_until)
    }

    // These tasks are compiled once for both visitors.
    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        leaves: (LeafPacket, LeafPacket),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        isa.run(VisitLeaves { visitor: &mut self.contacts, leaves, at_once })
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        isa.run(Finish(&mut self.contacts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::bvh::Bvh;
    use crate::isa::Backend;
    use crate::narrow::triangles_intersect;
    use crate::pose::Pose;
    use crate::query::exact::placed as place;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, Profile, to_bytes};
    use cbvh_testkit::Random;

    fn soup(random: &mut Random, profile: Profile) -> (Vec<Triangle>, Bvh) {
        let mut triangles = Vec::new();
        for number in 0..300 {
            let (at, extent) = (random.point(), if number % 9 == 0 { 0.6 } else { 0.2 });
            let mut corner = || {
                let v = random.point();
                [0, 1, 2].map(|k| f64::from((at[k] + extent * v[k]) as f32))
            };
            triangles.push([corner(), corner(), corner()]);
        }
        let faces = (0..300).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh::from_triangles(triangles.as_flattened().to_vec(), faces);
        let bytes = to_bytes(&mesh, &Options::default().profile(profile)).unwrap().0;
        (triangles, Bvh::from_bytes(bytes).unwrap())
    }

    /// Nothing that is left out may stay longer, on any backend and along directions in which B hardly moves.
    #[test]
    fn the_longest_contact_is_that_of_all_pairs() {
        let random = &mut Random::new(5);
        for (round, profile) in [Profile::Dop6F16, Profile::Dop14U8, Profile::Dop26U8Wide]
            .into_iter()
            .cycle()
            .take(12)
            .enumerate()
        {
            let ((of_a, a), (of_b, b)) = (soup(random, profile), soup(random, profile));
            let turn = random.point().map(|x| 0.5 * x);
            let norm = (1.0 + turn.iter().map(|x| x * x).sum::<f64>()).sqrt();
            let [x, y, z] = turn.map(|x| x / norm);
            let pose = Pose::from_quaternion([x, y, z, 1.0 / norm], random.point()).unwrap();
            let direction = match round % 3 {
                0 => [0.0, -1.0, 0.0],
                1 => [0.6, 0.0, 0.8],
                _ => {
                    let d = random.point();
                    let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
                    d.map(|x| x / length)
                }
            };
            let line = Translation::new(a.all(), b.all(), &pose).along(direction);
            let at = 0.1 * random.unit();
            let way = Way { direction, length: line.length, error: line.placing };
            let mut expected = Leaving {
                crosses_until: 0.0,
                touches_until: None,
                normal: direction,
                last: [[[0.0; 3]; 3]; 2],
            };
            for triangle_b in of_b.iter().map(|triangle| place(triangle, &line.pose_at(at))) {
                for triangle_a in of_a.iter().filter(|a| triangles_intersect(a, &triangle_b)) {
                    let of = stretch(triangle_a, &triangle_b, &way);
                    let crosses = of.inner[0] < 0.0 && of.inner[1] > 0.0;
                    let until = if crosses { of.inner[1] } else { 0.0 };
                    expected.count((of.outer[1].max(0.0), until), of.normal, [*triangle_a, triangle_b]);
                }
            }
            assert!(expected.touches_until.is_some() && expected.crosses_until > 0.0);
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let mut querier = Querier::with_backend(backend);
                querier.start();
                let found = querier.leaving(&line, at).unwrap();
                let of = |leaving: &Leaving| (leaving.crosses_until, leaving.touches_until, leaving.normal);
                assert_eq!(of(&found), of(&expected), "{backend}, round {round}");
            }
        }
    }
}
