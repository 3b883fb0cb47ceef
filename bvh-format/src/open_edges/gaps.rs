//! Finds for each edge of one triangle the nearest other open edge.
//!
//! An edge is a point with six coordinates, those of its ends, and the distance of two edges is the greater one of the distances
//! between their first and between their second ends. A k-d tree holds each edge once, and is searched for each edge and for the
//! same edge in the other direction. Edges with a common end are no special case, however many there are.

use super::{Ends, Gaps, OpenEdge};

/// The most open edges of an object that are measured.
pub const MAX_MEASURED: usize = 1 << 16;
/// The most nodes that a search for the nearest edge enters before it ends, for each direction of an edge. Fewer lead to the nearest
/// one, unless very many edges are about equally near, which those across a crack are not.
pub const MAX_NODES_PER_EDGE: usize = 1 << 7;

/// The most edges of a leaf.
const LEAF: usize = 8;
/// The most levels of the tree whose nodes have halves of boxes. Below, nodes have halves of their edges.
const MAX_HALVINGS: usize = 40;
/// The share of its length that the gap of a crack does not reach. Cracks by rounding, also those of `f32` numbers and of tolerances
/// of CAD systems, are far below; the sides of a slot, which a weld must not join, are above.
const CRACK_PER_LENGTH: f64 = 0.01;

type Six = [f64; 6];

/// The edges that are measured.
#[derive(Default)]
pub(super) struct Measured {
    edges: Vec<Six>,
    /// The places of the edges of one triangle.
    boundary: Vec<u32>,
}

impl Measured {
    /// Adds an open edge, unless there are too many.
    pub(super) fn add(&mut self, ends: &Ends, is_boundary: bool) {
        if self.edges.len() < MAX_MEASURED {
            if is_boundary {
                self.boundary.push(self.edges.len() as u32);
            }
            self.edges.push(ends.map(f64::from_bits));
        }
    }

    /// Measures all of them, and notes the gaps of those that are listed.
    pub(super) fn gaps(self, listed: &mut [OpenEdge]) -> Gaps {
        let mut gaps = Gaps::default();
        if self.edges.is_empty() {
            return gaps;
        }
        let tree = Tree::new(&self.edges);
        for place in self.boundary {
            let edge = &self.edges[place as usize];
            let Some(gap) = tree.nearest(edge, place) else { continue };
            gaps.nearest = Some(gaps.nearest.map_or(gap, |nearest| nearest.min(gap)));
            let length = length(edge);
            if gap < CRACK_PER_LENGTH * length {
                gaps.cracks += 1;
                gaps.widest_crack = Some(gaps.widest_crack.map_or(gap, |widest| widest.max(gap)));
                gaps.shortest_crack =
                    Some(gaps.shortest_crack.map_or(length, |shortest| shortest.min(length)));
            }
            let (a, b) = halves(edge);
            let is_same = |other: &&mut OpenEdge| other.ends == [a, b] || other.ends == [b, a];
            if let Some(listed) = listed.iter_mut().find(is_same) {
                listed.gap = Some(gap);
            }
        }
        gaps
    }
}

fn halves([x, y, z, u, v, w]: &Six) -> ([f64; 3], [f64; 3]) {
    ([*x, *y, *z], [*u, *v, *w])
}

fn length(edge: &Six) -> f64 {
    let (a, b) = halves(edge);
    norm([0, 1, 2].map(|axis| a[axis] - b[axis]))
}

/// Returns the length of a vector, also where squares would vanish.
fn norm([x, y, z]: [f64; 3]) -> f64 {
    let squared = x * x + y * y + z * z;
    if squared > 1e-280 {
        return squared.sqrt();
    }
    let largest = x.abs().max(y.abs()).max(z.abs());
    if largest == 0.0 {
        return 0.0;
    }
    largest * [x, y, z].iter().map(|c| (c / largest) * (c / largest)).sum::<f64>().sqrt()
}

/// Returns the greater length of the two halves.
fn distance(difference: Six) -> f64 {
    let (a, b) = halves(&difference);
    norm(a).max(norm(b))
}

/// Edges in a k-d tree.
struct Tree<'a> {
    edges: &'a [Six],
    /// The places of the edges, those of each node next to each other.
    order: Vec<u32>,
    /// Each node comes before its first child, and all nodes below that come before its second child.
    nodes: Vec<Node>,
}

struct Node {
    lo: Six,
    hi: Six,
    /// The second child, or 0 for a leaf.
    second: u32,
    start: u32,
    end: u32,
}

/// A search.
struct Search {
    edge: Six,
    /// The place of the edge itself.
    own: u32,
    nearest: f64,
    nodes: usize,
}

impl<'a> Tree<'a> {
    /// Makes the tree of at least one edge.
    fn new(edges: &'a [Six]) -> Self {
        let mut tree = Self {
            edges,
            order: (0..edges.len() as u32).collect(),
            nodes: Vec::with_capacity(edges.len() / 2),
        };
        tree.add(0, edges.len(), 0);
        tree
    }

    fn add(&mut self, start: usize, end: usize, depth: usize) {
        let (mut lo, mut hi) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
        for &place in &self.order[start..end] {
            for axis in 0..6 {
                lo[axis] = lo[axis].min(self.edges[place as usize][axis]);
                hi[axis] = hi[axis].max(self.edges[place as usize][axis]);
            }
        }
        let number = self.nodes.len();
        self.nodes.push(Node { lo, hi, second: 0, start: start as u32, end: end as u32 });
        if end - start <= LEAF {
            return;
        }
        let extent = |axis: usize| hi[axis] - lo[axis];
        let longest =
            (1..6).fold(0, |longest, axis| if extent(axis) > extent(longest) { axis } else { longest });
        let half = lo[longest] + extent(longest) / 2.0;
        let mut middle = start;
        for place in start..end {
            if self.edges[self.order[place] as usize][longest] < half {
                self.order.swap(middle, place);
                middle += 1;
            }
        }
        // Halving boxes many times over does not divide edges that are packed into ever smaller ones.
        if depth == MAX_HALVINGS || middle == start || middle == end {
            middle = start + (end - start) / 2;
        }
        let depth = (depth + 1).min(MAX_HALVINGS);
        self.add(start, middle, depth);
        self.nodes[number].second = self.nodes.len() as u32;
        self.add(middle, end, depth);
    }

    /// Returns the distance to the nearest other edge.
    fn nearest(&self, edge: &Six, own: u32) -> Option<f64> {
        let [x, y, z, u, v, w] = *edge;
        let mut nearest = f64::INFINITY;
        for edge in [*edge, [u, v, w, x, y, z]] {
            let mut search = Search { edge, own, nearest, nodes: 0 };
            self.search(0, &mut search);
            nearest = search.nearest;
        }
        (nearest < f64::INFINITY).then_some(nearest)
    }

    fn search(&self, number: usize, search: &mut Search) {
        let node = &self.nodes[number];
        search.nodes += 1;
        if node.second == 0 {
            for &place in &self.order[node.start as usize..node.end as usize] {
                if place != search.own {
                    let other = &self.edges[place as usize];
                    let difference = std::array::from_fn(|axis| other[axis] - search.edge[axis]);
                    search.nearest = search.nearest.min(distance(difference));
                }
            }
            return;
        }
        let mut children =
            [number + 1, node.second as usize].map(|child| (self.bound(child, &search.edge), child));
        if children[1].0 < children[0].0 {
            children.reverse();
        }
        for (bound, child) in children {
            if bound < search.nearest && search.nodes < MAX_NODES_PER_EDGE {
                self.search(child, search);
            }
        }
    }

    /// Returns a distance that no edge below a node is nearer than, up to rounding.
    fn bound(&self, number: usize, edge: &Six) -> f64 {
        let node = &self.nodes[number];
        distance(std::array::from_fn(|axis| {
            (node.lo[axis] - edge[axis]).max(edge[axis] - node.hi[axis]).max(0.0)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    fn measured(edges: &[Six]) -> Measured {
        let mut measured = Measured::default();
        edges.iter().for_each(|edge| measured.add(&edge.map(f64::to_bits), true));
        measured
    }

    #[test]
    fn the_nearest_edge_is_that_of_brute_force() {
        let mut random = Random::new(3);
        for case in 0..40 {
            let scale = [1.0, 1e-200, 1e30][case % 3];
            let edges: Vec<Six> = (0..1 + 7 * case)
                .map(|_| {
                    [(); 6].map(|()| {
                        scale * if case % 2 == 0 { random.signed() } else { random.below(4) as f64 }
                    })
                })
                .collect();
            let tree = Tree::new(&edges);
            for (place, edge) in (0..).zip(&edges) {
                let (a, b) = halves(edge);
                let far = |p: [f64; 3], q: [f64; 3]| norm([0, 1, 2].map(|axis| p[axis] - q[axis]));
                let gap = |other: &Six| {
                    let (c, d) = halves(other);
                    far(a, c).max(far(b, d)).min(far(a, d).max(far(b, c)))
                };
                let others = edges.iter().zip(0..).filter(|(_, other)| *other != place);
                let expected = others.map(|(other, _)| gap(other)).reduce(f64::min);
                assert_eq!(tree.nearest(edge, place), expected, "case {case}, edge {place}");
            }
        }
    }

    /// Edges that are all equally near to each other, and as many as are measured.
    #[test]
    fn many_edges_take_no_quadratic_time() {
        let mut random = Random::new(9);
        let fan: Vec<Six> = (0..MAX_MEASURED)
            .map(|_| {
                let [x, y, z] = random.point();
                let length = norm([x, y, z]);
                [0.0, 0.0, 0.0, x / length, y / length, z / length]
            })
            .collect();
        let scattered: Vec<Six> = (0..MAX_MEASURED + 5).map(|_| [(); 6].map(|()| random.signed())).collect();
        for edges in [fan, scattered] {
            let gaps = measured(&edges).gaps(&mut []);
            assert!(gaps.nearest.is_some_and(|nearest| nearest > 0.0));
        }
    }
}
