//! Counts the open edges of an object.

use super::gaps::Measured;
use super::{EdgesOfKind, Ends, MAX_LISTED, MAX_LISTED_TRIANGLES, OpenEdge, OpenEdges};
use crate::ids::decode_id;
use crate::leaf::{PACKET, VertexBlock};
use crate::object::Object;
use crate::page::Page;
use crate::validate::packets;
use std::collections::BinaryHeap;
use std::hash::{BuildHasher as _, RandomState};
use std::ops::Range;

/// An edge that a triangle traverses: the bits of both ends, the lesser one first; the number of the triangle; and how often it
/// traverses the edge from the lesser end to the greater one, negative for the other direction, as an `i64`.
pub type Traversal = [u64; 8];

const TRIANGLE: usize = 6;
const COUNT: usize = 7;

/// Returns the edges of the triangles of a page, given its leaf block and, in a file with ids, its id block. `net` returns the net of the
/// triangle at a place. Without ids, triangles are named by their places.
pub fn edges_of_page(
    object: &Object,
    page: &Page<'_>,
    leaves: &[u8],
    ids: Option<&[u8]>,
    net: &dyn Fn(u32) -> i32,
) -> Vec<Traversal> {
    let first_packet = page.header().first_packet.get();
    let packets_of_page = page.header().packets.get().into();
    let vertices = VertexBlock::new(object.triangle_encoding(), object.vertices(), leaves, packets_of_page);
    let mut edges = Vec::new();
    for (packet, count) in packets(page) {
        let first = first_packet.wrapping_add(u32::from(packet)).wrapping_mul(PACKET as u32);
        for lane in 0..count {
            let place = first.wrapping_add(lane as u32);
            let triangle = ids.map_or(place, |ids| decode_id(ids, usize::from(packet), lane));
            add_edges(&mut edges, &vertices.triangle(packet.into(), lane), net(place), triangle);
        }
    }
    edges
}

fn ends(edge: &Traversal) -> Ends {
    std::array::from_fn(|word| edge[word])
}

/// Adds the edges of a triangle whose net is given. Corners are in mesh units.
#[inline]
fn add_edges(edges: &mut Vec<Traversal>, corners: &[[f64; 3]; 3], net: i32, triangle: u32) {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    let [a, b, c] = corners.map(|corner| corner.map(|value| (value + 0.0).to_bits()));
    if a == b || b == c || c == a || net == 0 {
        return;
    }
    let net = i64::from(net);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let (lesser, greater, count) = if from < to { (from, to, net) } else { (to, from, -net) };
        let ([x, y, z], [u, v, w]) = (lesser, greater);
        edges.push([x, y, z, u, v, w, u64::from(triangle), count as u64]);
    }
}

/// Joins equal edges and leaves out those that cancel, in the order in which they first occur.
pub fn uncancelled(edges: Vec<Traversal>) -> Vec<Traversal> {
    // Nobody can forge edges that meet in this table, because its hashes depend on a random number.
    let seed = RandomState::new().hash_one(0u8);
    let mut table = vec![usize::MAX; (2 * edges.len()).next_power_of_two()];
    let mut kept: Vec<Traversal> = Vec::with_capacity(edges.len());
    for edge in edges {
        let own = ends(&edge);
        let mut place = hash(seed, &own) as usize & (table.len() - 1);
        loop {
            match kept.get_mut(table[place]) {
                None => {
                    table[place] = kept.len();
                    kept.push(edge);
                    break;
                }
                Some(found) if ends(found) == own => {
                    found[COUNT] = found[COUNT].wrapping_add(edge[COUNT]);
                    break;
                }
                Some(_) => place = (place + 1) & (table.len() - 1),
            }
        }
    }
    kept.retain(|edge| edge[COUNT] != 0);
    kept
}

#[inline]
fn hash(seed: u64, ends: &Ends) -> u64 {
    let mixed = ends.iter().fold(seed, |hash: u64, word| {
        let product = u128::from(hash ^ word) * 0xd1b5_4a32_d192_ed03_u128;
        (product >> 64) as u64 ^ product as u64
    });
    mixed ^ mixed >> 32
}

/// Adds up the traversals of each edge, which come sorted.
///
/// [`Classifier`] has an example.
#[derive(Default)]
pub struct Sums {
    last: Option<(Ends, i64)>,
    open: Vec<Ends>,
    /// The number of open edges so far, also of those that are not kept.
    count: u64,
}

impl Sums {
    /// Adds an edge that is not less than those before it. Keeps at most `most` open ones.
    pub fn add(&mut self, edge: &Traversal, most: usize) {
        let (own, count) = (ends(edge), edge[COUNT] as i64);
        match &mut self.last {
            Some((last, sum)) if *last == own => *sum += count,
            _ => {
                self.close(most);
                self.last = Some((own, count));
            }
        }
    }

    fn close(&mut self, most: usize) {
        if let Some((ends, sum)) = self.last.take()
            && sum != 0
        {
            self.count += 1;
            if self.open.len() < most {
                self.open.push(ends);
            }
        }
    }

    /// Returns the open edges after the last one has been added: of more than `most`, a set that has all edges.
    pub fn finish(mut self, most: usize) -> OpenSet {
        self.close(most);
        if self.count as usize > self.open.len() {
            return OpenSet { edges: None, marks: Vec::new() };
        }
        let mut marks = vec![0; MARKS / 64];
        for ends in &self.open {
            let mark = hash(0, ends) as usize % MARKS;
            marks[mark / 64] |= 1 << (mark % 64);
        }
        OpenSet { edges: Some(self.open), marks }
    }
}

/// The bits that tell most edges that are not open without a search.
const MARKS: usize = 1 << 18;

/// A set of edges that has all open ones.
///
/// [`Classifier`] has an example.
pub struct OpenSet {
    /// The open edges, ascending, or `None` for all edges.
    edges: Option<Vec<Ends>>,
    /// Has a bit set for each open edge, by its hash.
    marks: Vec<u64>,
}

impl OpenSet {
    /// Returns whether no edge is in the set, so that the object is closed.
    pub fn is_empty(&self) -> bool {
        self.edges.as_ref().is_some_and(Vec::is_empty)
    }

    /// Leaves out the edges that are not in the set.
    pub fn keep(&self, edges: &mut Vec<Traversal>) {
        let Some(open) = &self.edges else { return };
        edges.retain(|edge| {
            let ends = ends(edge);
            let mark = hash(0, &ends) as usize % MARKS;
            self.marks[mark / 64] >> (mark % 64) & 1 == 1 && open.binary_search(&ends).is_ok()
        });
    }
}

/// Classifies the edges of an object, all traversals of which come sorted.
///
/// ```
/// use bvh_format::open_edges::{Classifier, OpenSet, Sums, Traversal};
///
/// // Two triangles that share an edge but for a crack, as the edges of pages are.
/// let edge = |x0: f64, x1: f64, y: f64, triangle, times: i64| -> Traversal {
///     [x0.to_bits(), y.to_bits(), 0, x1.to_bits(), y.to_bits(), 0, triangle, times as u64]
/// };
/// let mut edges = vec![edge(0.0, 1.0, 0.0, 0, 1), edge(0.0, 1.0, 1e-9, 1, -1), edge(0.0, 1.0, 5.0, 2, 1), edge(0.0, 1.0, 5.0, 3, -1)];
/// edges.sort_unstable();
/// let mut sums = Sums::default();
/// edges.iter().for_each(|edge| sums.add(edge, usize::MAX));
/// let open: OpenSet = sums.finish(usize::MAX);
/// open.keep(&mut edges);
/// assert_eq!(edges.len(), 2); // the other two cancel
/// let mut classifier = Classifier::new(0);
/// edges.iter().for_each(|edge| classifier.add(edge));
/// let gaps = classifier.finish().gaps;
/// assert_eq!((gaps.cracks, gaps.nearest), (2, Some(1e-9)));
/// ```
pub struct Classifier {
    object: u32,
    edges: OpenEdges,
    measured: Measured,
    /// All traversals of the edge that is not complete yet, as far as they are needed.
    last: Option<Group>,
}

/// The traversals of an edge.
struct Group {
    ends: Ends,
    /// How often it is traversed in each direction.
    counts: [u64; 2],
    triangles: Vec<u32>,
}

impl Classifier {
    /// Starts the object with this number.
    pub fn new(object: u32) -> Self {
        Self { object, edges: OpenEdges::default(), measured: Measured::default(), last: None }
    }

    /// Adds a traversal that is not less than those before it. Equal ones count each time.
    pub fn add(&mut self, edge: &Traversal) {
        let (ends, count) = (ends(edge), edge[COUNT] as i64);
        if self.last.as_ref().is_none_or(|last| last.ends != ends) {
            self.close();
        }
        let group = self.last.get_or_insert(Group { ends, counts: [0; 2], triangles: Vec::new() });
        group.counts[usize::from(count < 0)] += count.unsigned_abs();
        // Traversals of an edge come by the numbers of their triangles.
        if group.triangles.len() < MAX_LISTED_TRIANGLES {
            group.triangles.push(edge[TRIANGLE] as u32);
        }
    }

    fn close(&mut self) {
        let Some(Group { ends, counts: [forward, backward], triangles }) = self.last.take() else { return };
        if forward == backward {
            return;
        }
        let count = forward + backward;
        self.measured.add(&ends, count == 1);
        let of_kind = match count {
            1 => &mut self.edges.boundary,
            2 => &mut self.edges.flipped,
            _ => &mut self.edges.crowded,
        };
        of_kind.count += 1;
        let [x, y, z, u, v, w] = ends.map(f64::from_bits);
        let mut ends = [[x, y, z], [u, v, w]];
        if backward > forward {
            ends.reverse();
        }
        of_kind.list(OpenEdge { object: self.object, ends, triangles, gap: None });
    }

    /// Returns the open edges after the last traversal.
    pub fn finish(mut self) -> OpenEdges {
        self.close();
        let Self { mut edges, measured, .. } = self;
        edges.gaps = measured.gaps(&mut edges.boundary.first);
        edges
    }
}

impl EdgesOfKind {
    /// Lists an edge if it is one of the first. Edges come in the order of their ends.
    fn list(&mut self, edge: OpenEdge) {
        let place = self.first.partition_point(|other| other.triangles[0] <= edge.triangles[0]);
        if place < MAX_LISTED {
            self.first.insert(place, edge);
            self.first.truncate(MAX_LISTED);
        }
    }
}

/// Counts the open edges of the object with this number, in memory. `edges_of` returns the edges of a page ([`edges_of_page`]), or `None`
/// to end the count. Returns `None` in that case, and if more than `most` edges would have to be in memory: those that do not cancel
/// within their pages, or those of all triangles at open edges.
///
/// Cost: `edges_of` twice for each page. Memory: 64 bytes for each edge that does not cancel within its page, and about 200 for
/// each open edge.
pub fn count(
    object: u32,
    pages: Range<u32>,
    most: usize,
    edges_of: &mut dyn FnMut(u32) -> Option<Vec<Traversal>>,
) -> Option<OpenEdges> {
    let mut left = Vec::new();
    for page in pages.clone() {
        left.append(&mut uncancelled(edges_of(page)?));
        if left.len() > most {
            return None;
        }
    }
    let mut left = sorted(left);
    let mut sums = Sums::default();
    left.iter().for_each(|edge| sums.add(edge, usize::MAX));
    let open = sums.finish(usize::MAX);
    left.clear();
    if !open.is_empty() {
        for page in pages {
            let mut edges = edges_of(page)?;
            open.keep(&mut edges);
            left.append(&mut edges);
            if left.len() > most {
                return None;
            }
        }
    }
    let mut classifier = Classifier::new(object);
    sorted(left).iter().for_each(|edge| classifier.add(edge));
    Some(classifier.finish())
}

/// Sorts edges by a heap, which takes longer than other ways but a tenth of their code: web pages load this.
fn sorted(edges: Vec<Traversal>) -> Vec<Traversal> {
    BinaryHeap::from(edges).into_sorted_vec()
}
