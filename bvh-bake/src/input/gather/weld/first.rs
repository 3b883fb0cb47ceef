//! Finds the first of some vertices within a distance of a point: the one with the smallest number.
//!
//! A k-d tree has the box and the smallest number of the vertices below each node. A search leaves out nodes whose numbers are
//! all larger than the best one so far and nodes that are out of reach, and takes the smallest number of a node that is within
//! reach as a whole. The half with the smaller number comes first. Only nodes across the end of the reach are entered, and of these
//! only those with smaller numbers than the best one, so that a search among n vertices that are all within reach of each other
//! takes about log n steps.

use super::Bits;

/// The most vertices of a leaf.
const LEAF: usize = 8;
/// The most levels of the tree whose nodes have halves of boxes. Below, nodes have halves of their vertices.
const MAX_HALVINGS: usize = 40;

/// What is within a distance D of a point. With the power of two u for which 1 <= D u < 2 (2^1022 if D is below 2^-1022), two points
/// are within D of each other if (x x + y y) + z z <= (D u) (D u), where x, y and z are the differences of their coordinates, each
/// times u. Each operation is rounded to nearest, as IEEE 754 defines it for 64 bits, so the result is the same everywhere.
///
/// Operations that are rounded to nearest are monotone: what lies between two points on each axis is never farther from a third
/// one, in these operations, than the farther one of them. The bounds of boxes below therefore need no margin.
pub(super) struct Reach {
    unit: f64,
    squared: f64,
}

impl Reach {
    /// Makes the reach of a finite distance above 0 that is at most 2^1000.
    pub(super) fn new(distance: f64) -> Self {
        // The exponent field of a subnormal number is 0.
        let exponent = (distance.to_bits() >> 52).max(1);
        let unit = f64::from_bits((2046 - exponent) << 52);
        Self { unit, squared: (distance * unit) * (distance * unit) }
    }

    #[inline]
    fn within(&self, difference: [f64; 3]) -> bool {
        let [x, y, z] = difference.map(|value| value * self.unit);
        (x * x + y * y) + z * z <= self.squared
    }
}

/// A vertex: its number and its position.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub(super) number: u64,
    pub(super) position: [f64; 3],
}

impl Vertex {
    pub(super) fn new(number: u64, position: Bits) -> Self {
        Self { number, position: position.map(f64::from_bits) }
    }
}

/// Vertices in a k-d tree.
pub(super) struct Tree {
    /// The vertices of each node are next to each other.
    vertices: Vec<Vertex>,
    /// Each node comes before its first child, and all nodes below that come before its second child.
    nodes: Vec<Node>,
}

struct Node {
    lo: [f64; 3],
    hi: [f64; 3],
    /// The vertex with the smallest number.
    least: Vertex,
    /// The second child, or 0 for a leaf.
    second: u32,
    /// The vertices.
    start: u32,
    end: u32,
}

impl Tree {
    /// Makes the tree of at least one vertex.
    pub(super) fn new(mut vertices: Vec<Vertex>) -> Self {
        let mut nodes = Vec::with_capacity(vertices.len() / 2 + 1);
        add(&mut nodes, &mut vertices, 0, 0);
        Self { vertices, nodes }
    }

    /// Returns the vertex with the smallest number among `best` and those that are within reach of a point.
    pub(super) fn first(&self, point: &[f64; 3], reach: &Reach, best: Vertex) -> Vertex {
        self.search(0, point, reach, best)
    }

    fn search(&self, number: usize, point: &[f64; 3], reach: &Reach, best: Vertex) -> Vertex {
        let node = &self.nodes[number];
        if node.least.number >= best.number || !reach.within(node.nearest(point)) {
            return best;
        }
        if reach.within(node.farthest(point)) {
            return node.least;
        }
        if node.second == 0 {
            let own = &self.vertices[node.start as usize..node.end as usize];
            return own.iter().fold(best, |best, vertex| {
                let difference = [0, 1, 2].map(|axis| vertex.position[axis] - point[axis]);
                if vertex.number < best.number && reach.within(difference) { *vertex } else { best }
            });
        }
        let (first, second) = (number + 1, node.second as usize);
        let is_ordered = self.nodes[first].least.number < self.nodes[second].least.number;
        let order = if is_ordered { [first, second] } else { [second, first] };
        order.into_iter().fold(best, |best, child| self.search(child, point, reach, best))
    }
}

impl Node {
    /// Returns the difference of a point and the nearest point of the box.
    fn nearest(&self, point: &[f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| (self.lo[axis] - point[axis]).max(point[axis] - self.hi[axis]).max(0.0))
    }

    /// Returns the difference of a point and the farthest point of the box.
    fn farthest(&self, point: &[f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| (point[axis] - self.lo[axis]).abs().max((self.hi[axis] - point[axis]).abs()))
    }
}

/// Adds the node of some vertices, the first of which has the place `start`, and all nodes below it.
fn add(nodes: &mut Vec<Node>, vertices: &mut [Vertex], start: u32, depth: usize) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut least = vertices[0];
    for vertex in vertices.iter() {
        for axis in 0..3 {
            lo[axis] = lo[axis].min(vertex.position[axis]);
            hi[axis] = hi[axis].max(vertex.position[axis]);
        }
        if vertex.number < least.number {
            least = *vertex;
        }
    }
    let (number, end) = (nodes.len(), start + vertices.len() as u32);
    nodes.push(Node { lo, hi, least, second: 0, start, end });
    if vertices.len() <= LEAF {
        return;
    }
    let longest = [1, 2].into_iter().fold(0, |longest: usize, axis| {
        if hi[axis] - lo[axis] > hi[longest] - lo[longest] { axis } else { longest }
    });
    let half = lo[longest] + (hi[longest] - lo[longest]) / 2.0;
    let mut middle = 0;
    for place in 0..vertices.len() {
        if vertices[place].position[longest] < half {
            vertices.swap(middle, place);
            middle += 1;
        }
    }
    // Halving boxes many times over does not divide vertices that are packed into ever smaller ones.
    if depth == MAX_HALVINGS || middle == 0 || middle == vertices.len() {
        middle = vertices.len() / 2;
    }
    let depth = (depth + 1).min(MAX_HALVINGS);
    let (below, above) = vertices.split_at_mut(middle);
    add(nodes, below, start, depth);
    nodes[number].second = nodes.len() as u32;
    add(nodes, above, start + middle as u32, depth);
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    #[test]
    fn the_first_vertex_in_reach_is_found() {
        let mut random = Random::new(7);
        for case in 0..200 {
            let count = 1 + case * 3;
            // A lattice has many vertices exactly at the distance.
            let coordinate = |random: &mut Random| match case % 3 {
                0 => random.below(9) as f64,
                1 => random.unit() * 8.0,
                _ => 1e-310 * random.below(9) as f64,
            };
            let mut vertices: Vec<Vertex> = (0..count)
                .map(|number| Vertex { number, position: [(); 3].map(|()| coordinate(&mut random)) })
                .collect();
            let unit = if case % 3 == 2 { 1e-310 } else { 1.0 };
            for distance in [1.0, 2.0, 5f64.sqrt(), 4.5, 100.0] {
                let reach = Reach::new(distance * unit);
                let expected: Vec<u64> = vertices.iter().map(|of| first(&vertices, of, &reach)).collect();
                // The tree gets the vertices in another order.
                vertices.reverse();
                let tree = Tree::new(vertices.clone());
                vertices.reverse();
                let found: Vec<u64> =
                    vertices.iter().map(|of| tree.first(&of.position, &reach, *of).number).collect();
                assert_eq!(found, expected, "case {case}, distance {distance}");
            }
        }
    }

    /// Compares a vertex with all others.
    fn first(vertices: &[Vertex], of: &Vertex, reach: &Reach) -> u64 {
        let near = |other: &&Vertex| reach.within([0, 1, 2].map(|a| other.position[a] - of.position[a]));
        vertices.iter().filter(near).map(|near| near.number).min().unwrap()
    }

    #[test]
    fn a_distance_is_reached_exactly() {
        for (distance, difference, is_within) in [
            (5.0, [3.0, 4.0, 0.0], true),
            (5f64.next_down(), [3.0, 4.0, 0.0], false),
            (5e-324, [5e-324, 0.0, 0.0], true),
            (5e-324, [5e-324, 5e-324, 0.0], false),
            (1e-300, [0.0, -1e-300, 0.0], true),
            (1e-300, [0.0, -1e-300f64.next_down(), 1e-320], true),
            (1e-300, [0.0, 1.0001e-300, 0.0], false),
            (1e36, [-1e36, 0.0, 0.0], true),
            (1e36, [2f64.powi(121); 3], false),
        ] {
            assert_eq!(Reach::new(distance).within(difference), is_within, "{distance:e} {difference:?}");
        }
    }
}
