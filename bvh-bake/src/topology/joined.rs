//! Joins the parts of all bricks of an object, and keeps the lists of the topology section until it is written.

use super::brick::{BrickTopology, NO_PLACE, Sets, Survey};
use super::edge::Edge;
use super::nets::{NO_PART, run};
use crate::error::BakeError;
use crate::storage::external_sort::Sorter;
use crate::storage::resources::Resources;
use crate::storage::{Spill, Stream};
use crate::triangles::Batch;
use bvh_format::topology::TopologyRecord;
use zerocopy::FromZeros;

/// The topology of all objects, in the form of the section.
pub(crate) struct TopologyLists {
    pub(crate) records: Vec<TopologyRecord>,
    pub(crate) components: Stream<u32>,
    /// Pairs of a place and a net.
    pub(crate) nets: Stream<[u32; 2]>,
}

/// The number of entries of a piece of a list.
const ENTRIES_PER_PIECE: usize = 1 << 16;

impl TopologyLists {
    pub(crate) fn new() -> Self {
        let nets = Stream::of_pieces(ENTRIES_PER_PIECE);
        Self { records: Vec::new(), components: Stream::of_pieces(ENTRIES_PER_PIECE), nets }
    }

    /// Adds an object after all others.
    pub(crate) fn add(&mut self, object: ObjectTopology, spill: &Spill) -> Result<(), BakeError> {
        let ObjectTopology { closed, components, nets } = object;
        let net_count = nets.count();
        nets.visit(|net| self.nets.append(spill, &[*net]))?;
        self.components.append(spill, &components)?;
        self.records.push(TopologyRecord {
            closed: u32::from(closed).into(),
            components: (components.len() as u32).into(),
            nets: (net_count as u32).into(),
            reserved: 0.into(),
        });
        Ok(())
    }

    /// Adds an object of more points than are listed: it has no boundary, and each point is a component.
    pub(crate) fn add_cloud(&mut self) {
        self.records.push(TopologyRecord { closed: 1.into(), ..TopologyRecord::new_zeroed() });
    }

    /// Returns whether an object is known to be closed.
    pub(crate) fn is_closed(&self, object: usize) -> bool {
        self.records.get(object).is_some_and(|record| record.closed == 1)
    }

    /// Returns the number of bytes of the section.
    pub(crate) fn bytes(&self) -> usize {
        let lists = self.components.count() * 4 + self.nets.count() * 8;
        16 + self.records.len() * size_of::<TopologyRecord>() + lists as usize
    }
}

/// The topology of an object.
pub(crate) struct ObjectTopology {
    pub(crate) closed: bool,
    /// The least place of each component that is listed, ascending.
    components: Vec<u32>,
    /// Pairs of a place and a net.
    nets: Sorter<[u32; 2]>,
}

/// Triangles in the pages above the bricks.
pub(crate) struct Rest<'a> {
    /// The rests of all bricks, brick after brick.
    pub(crate) triangles: &'a Batch<'a>,
    /// The place of each of them.
    pub(crate) places: &'a [u32],
}

/// Joins the bricks of an object. `first_places` are the places of the first packets of the bricks.
pub(crate) fn join(
    survey: Survey,
    bricks: Vec<BrickTopology>,
    first_places: &[u32],
    rest: &Rest,
    resources: &Resources,
    spill: &Spill,
) -> Result<ObjectTopology, BakeError> {
    let open = bricks.iter().any(|brick| brick.open);
    let mut parts = survey.lists_components().then(|| Parts::new(&bricks, first_places, rest));
    let has_nets = survey.nets.any();
    let mut netted = Sorter::of_runs(run::<[u32; 2]>(resources));
    if has_nets {
        let of_rest = rest.triangles.iter().zip(rest.places).map(|(triangle, &place)| [triangle.id, place]);
        let of_rest = of_rest.filter(|[id, _]| survey.nets.may_have(*id));
        netted.extend(&of_rest.collect::<Vec<_>>(), spill)?;
    }
    let (of_ids, mut edges) = (survey.nets.of_ids, survey.nets.edges);
    let mut first_part = 0;
    for (brick, first_place) in bricks.into_iter().zip(first_places) {
        let own = brick.edges.take()?;
        let own = own.into_iter().map(|edge| Edge { of: first_part + edge.of, ..edge });
        edges.extend(&own.collect::<Vec<_>>(), spill)?;
        let own = brick.netted.take()?.into_iter().map(|[id, place]| [id, place.wrapping_add(*first_place)]);
        netted.extend(&own.collect::<Vec<_>>(), spill)?;
        first_part += brick.parts;
    }
    let mut closed = !open;
    // The last edge, and how often those equal to it are traversed.
    let mut last: Option<(Edge, i64)> = None;
    edges.visit(|edge| {
        let (mut part, mut count) = (edge.of, 0);
        if let Some((last, of_last)) = last.take() {
            if last.ends == edge.ends {
                count = of_last;
                part = parts.as_mut().map_or(NO_PART, |parts| parts.join(last.of, part));
            } else {
                closed &= of_last == 0;
            }
        }
        last = Some((Edge { of: part, ..*edge }, count + i64::from(edge.count)));
        Ok(())
    })?;
    closed &= last.is_none_or(|(_, count)| count == 0);
    let components = parts.map_or_else(Vec::new, Parts::components);
    let mut nets = Sorter::of_runs(run::<[u32; 2]>(resources));
    if has_nets {
        let (of_ids, netted) = (of_ids.finish(), netted.finish());
        let (mut of_ids, mut netted) = (of_ids.merge(), netted.merge());
        while let Some([id, net]) = of_ids.next()? {
            // The filter lets some triangles through that have no net. Each triangle with one is stored.
            while let Some([found, place]) = netted.next()? {
                if found == id {
                    nets.extend(&[[place, net]], spill)?;
                    break;
                }
            }
        }
    }
    Ok(ObjectTopology { closed, components, nets })
}

/// The parts of all bricks of an object, each with the least place of its triangles.
struct Parts {
    sets: Sets,
    least: Vec<u32>,
}

impl Parts {
    fn new(bricks: &[BrickTopology], first_places: &[u32], rest: &Rest) -> Self {
        let mut least = Vec::new();
        let mut places = rest.places.iter();
        for (brick, first_place) in bricks.iter().zip(first_places) {
            let first_part = least.len();
            let of_part =
                |&place: &u32| if place == NO_PLACE { place } else { place.wrapping_add(*first_place) };
            least.extend(brick.least.iter().map(of_part));
            for (part, place) in brick.rest.iter().zip(&mut places) {
                let least = &mut least[first_part + *part as usize];
                *least = (*least).min(*place);
            }
        }
        Self { sets: Sets::of(least.len() as u32), least }
    }

    /// Joins two parts and returns one of them. Either may be none.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        if a != NO_PART && b != NO_PART {
            self.sets.join(a, b);
        }
        a.min(b)
    }

    /// Returns the least place of each component, ascending.
    fn components(mut self) -> Vec<u32> {
        for part in (0..self.least.len()).rev() {
            let first = self.sets.first(part as u32) as usize;
            self.least[first] = self.least[first].min(self.least[part]);
        }
        let firsts = (0..self.least.len()).filter(|&part| self.sets.first(part as u32) as usize == part);
        let firsts: Vec<usize> = firsts.collect();
        let mut components: Vec<u32> = firsts.into_iter().map(|part| self.least[part]).collect();
        components.sort_unstable();
        components
    }
}
