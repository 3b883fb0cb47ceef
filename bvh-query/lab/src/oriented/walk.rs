//! Walks two trees completely, and counts what a query with such bounds would have to test.
//!
//! A walk visits what a query must visit in whatever order: all pairs of nodes that are not certainly more than `limit`
//! apart. Nodes are opened in the order of the boxes along the axes of their objects, whatever bounds they have, so that
//! walks differ by their tests alone.

use super::bounds::{Bounds, Turning, centre, end, half, reach, upper};
use super::boxes::RoundBox;
use super::forms::{Form, upper_form};
use super::tree::Tree;
use super::vector::{
    Matrix, Vector, cross, dot, length, minus, plus, product, times, transposed, turned, unit,
};
use bvh_format::kdop::{DirectionSet, FACTORS, Kdop};
use bvh_query::Pose;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// Nodes this many times larger than their partner are opened alone, as in a query.
const MUCH_LARGER: f64 = 2.0;
/// The number of node tests after which a walk is given up.
const MAX_NODE_TESTS: u64 = 1 << 17;
/// Node tests at the start of a walk without tests of turning slabs, as in a query.
const WITHOUT_TURNING: u64 = 24;

/// How pairs of nodes are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Test {
    /// Along the directions of both frames, then along those of turning slabs and the line between centres.
    Slabs,
    /// Also along the nine products of the axes of both frames.
    Products,
    /// By the distance of the oriented boxes.
    Boxes,
    /// As `Slabs`, and then by the distance of oriented boxes that stand beside these slabs: the most that can be gained.
    Beside,
    /// As `Slabs`, and then along the direction that a search of so many levels of steps finds: what these bounds can tell.
    Search(u8),
    /// By the distance of rectangles with a radius around these boxes.
    Spheres,
}

/// What a walk counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    /// Tests of up to 16 pairs of nodes each.
    pub(super) node_tests: u64,
    /// Tests of up to 16 pairs of triangles each.
    pub(super) packet_tests: u64,
    /// Pairs of nodes that take the test of turning slabs.
    pub(super) turning_pairs: u64,
    /// Pairs of nodes for which a direction is searched, and all directions that these searches try.
    pub(super) searched_pairs: u64,
    pub(super) directions: u64,
    /// Different pairs of frames.
    pub(super) frame_pairs: u64,
    /// Treelets that are aligned with a frame of the other side: once for each such frame.
    pub(super) alignments: u64,
    /// Whether the walk was given up.
    pub(super) given_up: bool,
}

/// One side: a tree with bounds, and the radius-grown boxes of its nodes if they are tested.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) tree: &'a Tree,
    pub(super) bounds: &'a Bounds,
    pub(super) round: &'a [RoundBox],
}

/// Returns the box of each node, or the rectangle with a radius around its triangles.
pub(super) fn round_boxes(tree: &Tree, bounds: &Bounds, test: Test) -> Vec<RoundBox> {
    let of = |number: usize| {
        let (frame, dop) = (&bounds.frames[bounds.frame_of[number] as usize], &bounds.dops[number]);
        let whole = RoundBox { centre: centre(frame, dop), axes: *frame, half: half(dop), radius: 0.0 };
        if test == Test::Spheres { rounded(tree, number, whole) } else { whole }
    };
    match test {
        Test::Boxes | Test::Beside | Test::Spheres => (0..tree.nodes.len()).map(of).collect(),
        Test::Slabs | Test::Products | Test::Search(_) => Vec::new(),
    }
}

/// Turns a box into a rectangle with a radius: half of the least side, or more where a corner would be left out.
fn rounded(tree: &Tree, number: usize, whole: RoundBox) -> RoundBox {
    let thin = (0..3).min_by(|&i, &j| whole.half[i].total_cmp(&whole.half[j])).unwrap_or(2);
    let radius = whole.half[thin];
    let corners = || tree.corners_below(&tree.nodes[number]).as_flattened().iter();
    let local = |p: &Vector| turned(&whole.axes, minus(*p, whole.centre));
    // Each side of the rectangle reaches as far as the corners need, which the radius covers in part.
    let mut ends = [[0.0; 2]; 3];
    for side in (0..3).filter(|&side| side != thin) {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in corners().map(local) {
            let cover = (radius * radius - p[thin] * p[thin]).max(0.0).sqrt();
            (lo, hi) = (lo.min(p[side] + cover), hi.max(p[side] - cover));
        }
        ends[side] = if lo <= hi { [lo, hi] } else { [f64::midpoint(lo, hi); 2] };
    }
    let middle = ends.map(|[lo, hi]| f64::midpoint(lo, hi));
    let centre = plus(whole.centre, turned(&transposed(&whole.axes), middle));
    let mut round = RoundBox { centre, half: ends.map(|[lo, hi]| (hi - lo) / 2.0), radius: 0.0, ..whole };
    round.radius = corners().map(|p| round.away(*p)).fold(0.0, f64::max);
    round
}

/// Two frames beside each other.
struct Placed {
    /// For each direction of A's frame, the form of B's upper end along it and what the pose adds; and the same for B.
    axes: [Vec<(Form, f64)>; 2],
    /// Products of the axes of both frames, in A's frame and in B's, with what the pose adds.
    products: Vec<(Vector, Vector, f64)>,
}

impl Placed {
    fn new(r: &Matrix, t: Vector, sets: [DirectionSet; 2], test: Test) -> Self {
        let inverse = transposed(r);
        let back = times(turned(&inverse, t), -1.0);
        let axes = |rotation: &Matrix, translation: Vector, own: DirectionSet, other: DirectionSet| {
            let columns = transposed(rotation);
            let axis = |&d: &Vector| (upper_form(turned(&columns, d), other), dot(d, translation));
            FACTORS[..own.slabs()].iter().map(axis).collect()
        };
        let mut products = Vec::new();
        if test == Test::Products {
            for a in 0..3 {
                for b in 0..3 {
                    let of_a: Vector = [0, 1, 2].map(|i| f64::from(u8::from(i == a)));
                    let x = cross(of_a, inverse[b]);
                    if length(x) > 1e-6 {
                        products.push((unit(x), turned(&inverse, unit(x)), dot(unit(x), t)));
                    }
                }
            }
        }
        Self { axes: [axes(r, t, sets[0], sets[1]), axes(&inverse, back, sets[1], sets[0])], products }
    }

    /// Returns true if the nodes are more than `limit` apart along the directions of one frame, `own`, or by their boxes.
    fn apart_in(&self, frame: usize, own: &Kdop, other: &Kdop, limit: f64) -> bool {
        let mut square = 0.0;
        for (slab, (form, offset)) in self.axes[frame].iter().enumerate() {
            let (lo, hi) = (end(&form.mirrored(), other) + offset, end(form, other) + offset);
            let gap = (lo - f64::from(own.hi[slab])).max(f64::from(own.lo[slab]) - hi);
            if gap > limit * length(FACTORS[slab]) {
                return true;
            }
            if slab < 3 {
                square += gap.max(0.0).powi(2);
            }
        }
        limit > 0.0 && square > limit * limit
    }

    fn apart_by_products(&self, a: &Kdop, b: &Kdop, limit: f64) -> bool {
        self.products.iter().any(|&(of_a, of_b, offset)| {
            let minus_b = times(of_b, -1.0);
            offset - reach(b, minus_b) - reach(a, of_a) > limit
                || -offset - reach(b, of_b) - reach(a, times(of_a, -1.0)) > limit
        })
    }
}

/// Visits all pairs of nodes that are not certainly more than `limit` apart (mesh units; 0 for overlap).
pub(super) fn walk(a: Side<'_>, b: Side<'_>, pose: &Pose, limit: f64, test: Test) -> Counts {
    let rotation = *pose.rotation();
    let t = minus(pose.place(b.tree.origin), a.tree.origin);
    let mut placed: HashMap<(u32, u32), Rc<Placed>> = HashMap::new();
    let (mut seen_a, mut seen_b) = (HashSet::new(), HashSet::new());
    let mut counts = Counts::default();
    let mut stack = vec![(0u32, 0u32)];
    while let Some((at_a, at_b)) = stack.pop() {
        if counts.node_tests > MAX_NODE_TESTS {
            counts.given_up = true;
            break;
        }
        let (node_a, node_b) = (&a.tree.nodes[at_a as usize], &b.tree.nodes[at_b as usize]);
        let (leaf_a, leaf_b) = (node_a.triangles > 0, node_b.triangles > 0);
        if leaf_a && leaf_b {
            counts.packet_tests += 1;
            continue;
        }
        // The root counts as larger than anything, as in a query.
        let extent = |at: u32, extent: f64| if at == 0 { f64::INFINITY } else { extent };
        let (extent_a, extent_b) = (extent(at_a, node_a.extent), extent(at_b, node_b.extent));
        let a_is_small = extent_b > MUCH_LARGER * extent_a;
        let b_is_small = extent_a > MUCH_LARGER * extent_b && !a_is_small;
        let (own_a, own_b) = ([at_a], [at_b]);
        let opens_a = !leaf_a && (leaf_b || !a_is_small);
        let opens_b = !leaf_b && (leaf_a || !b_is_small);
        let side_a = if opens_a { &node_a.children[..] } else { &own_a };
        let side_b = if opens_b { &node_b.children[..] } else { &own_b };
        counts.node_tests += 1;
        let boxes = matches!(test, Test::Boxes | Test::Spheres);
        let mut frames = None;
        if !boxes {
            let [of_a, of_b] = [a.bounds.frame_of[side_a[0] as usize], b.bounds.frame_of[side_b[0] as usize]];
            // A lone node was aligned with its treelet.
            seen_b.insert((if opens_b { at_b } else { node_b.parent }, of_a));
            seen_a.insert((if opens_a { at_a } else { node_a.parent }, of_b));
            let make = || {
                let [frame_a, frame_b] = [&a.bounds.frames[of_a as usize], &b.bounds.frames[of_b as usize]];
                let r = product(&product(frame_a, &rotation), &transposed(frame_b));
                Rc::new(Placed::new(&r, turned(frame_a, t), [a.bounds.set, b.bounds.set], test))
            };
            frames = Some(placed.entry((of_a, of_b)).or_insert_with(make).clone());
        }
        for &child_b in side_b {
            for &child_a in side_a {
                let (dop_a, dop_b) = (&a.bounds.dops[child_a as usize], &b.bounds.dops[child_b as usize]);
                let mut apart = frames.as_ref().is_some_and(|placed| {
                    placed.apart_in(0, dop_a, dop_b, limit)
                        || placed.apart_in(1, dop_b, dop_a, limit)
                        || placed.apart_by_products(dop_a, dop_b, limit)
                });
                if !apart && !b.round.is_empty() {
                    let of_b = &b.round[child_b as usize];
                    let of_b = RoundBox {
                        centre: plus(turned(&rotation, of_b.centre), t),
                        axes: of_b.axes.map(|axis| turned(&rotation, axis)),
                        ..*of_b
                    };
                    apart = a.round[child_a as usize].apart(&of_b, limit);
                }
                if apart {
                    continue;
                }
                let of_a = Seen::new(a.bounds, child_a);
                let of_b = Seen::new(b.bounds, child_b);
                if counts.node_tests > WITHOUT_TURNING && (of_a.turning.is_some() || of_b.turning.is_some()) {
                    counts.turning_pairs += 1;
                    if apart_by_turning(&of_a, &of_b, &rotation, t, limit) {
                        continue;
                    }
                }
                if let Test::Search(levels) = test {
                    let (is_apart, tried) = apart_by_search([&of_a, &of_b], &rotation, t, limit, levels);
                    counts.searched_pairs += 1;
                    counts.directions += tried;
                    if is_apart {
                        continue;
                    }
                }
                stack.push((child_a, child_b));
            }
        }
    }
    counts.frame_pairs = placed.len() as u64;
    counts.alignments = (seen_a.len() + seen_b.len()) as u64;
    counts
}

/// A node as the test of turning slabs sees it.
struct Seen<'a> {
    turning: Option<&'a Turning>,
    frame: &'a Matrix,
    dop: &'a Kdop,
    set: DirectionSet,
}

impl<'a> Seen<'a> {
    fn new(bounds: &'a Bounds, node: u32) -> Self {
        let node = node as usize;
        Self {
            turning: bounds.turning[node].as_ref(),
            frame: &bounds.frames[bounds.frame_of[node] as usize],
            dop: &bounds.dops[node],
            set: bounds.set,
        }
    }

    /// Returns an upper bound along a direction of length 1 in the axes of the object: that of the box, or a multiple of the
    /// slab and the box along the rest, as in a query.
    fn upper(&self, x: Vector) -> f64 {
        self.upper_by(x, |x| reach(self.dop, turned(self.frame, x)))
    }

    /// As `upper`, with the reach of all slabs in place of the box.
    fn upper_by_all(&self, x: Vector) -> f64 {
        self.upper_by(x, |x| upper(self.dop, turned(self.frame, x), self.set))
    }

    fn upper_by(&self, x: Vector, box_reach: impl Fn(Vector) -> f64) -> f64 {
        let whole = box_reach(x);
        let Some(slab) = self.turning else { return whole };
        let alpha = dot(x, slab.n) / (slab.length * slab.length);
        let end = if alpha < 0.0 { slab.ends[0] } else { slab.ends[1] };
        whole.min(alpha * end + box_reach(minus(x, times(slab.n, alpha))))
    }
}

/// Tests the directions of both slabs and the line between the centres, each on the side on which B is.
fn apart_by_turning(a: &Seen<'_>, b: &Seen<'_>, rotation: &Matrix, t: Vector, limit: f64) -> bool {
    let back = transposed(rotation);
    let towards_b = minus(plus(turned(rotation, centre(b.frame, b.dop)), t), centre(a.frame, a.dop));
    let n_a = a.turning.map(|slab| unit(slab.n));
    let n_b = b.turning.map(|slab| turned(rotation, unit(slab.n)));
    [n_a, n_b, Some(unit(towards_b))].into_iter().flatten().any(|x| {
        let x = if dot(x, towards_b) < 0.0 { times(x, -1.0) } else { x };
        dot(x, t) - b.upper(times(turned(&back, x), -1.0)) - a.upper(x) > limit
    })
}

/// Climbs from the directions of `apart_by_turning` to the one along which the nodes are farthest apart, in ever smaller
/// steps. Also returns how many directions were tried.
fn apart_by_search(
    [a, b]: [&Seen<'_>; 2],
    rotation: &Matrix,
    t: Vector,
    limit: f64,
    levels: u8,
) -> (bool, u64) {
    let back = transposed(rotation);
    let towards_b = minus(plus(turned(rotation, centre(b.frame, b.dop)), t), centre(a.frame, a.dop));
    let gap = |x: Vector| dot(x, t) - b.upper_by_all(times(turned(&back, x), -1.0)) - a.upper_by_all(x);
    let n_a = a.turning.map(|slab| unit(slab.n));
    let n_b = b.turning.map(|slab| turned(rotation, unit(slab.n)));
    let (mut most, mut best, mut tried) = (f64::NEG_INFINITY, towards_b, 0);
    for x in [n_a, n_b, Some(unit(towards_b))].into_iter().flatten() {
        let x = if dot(x, towards_b) < 0.0 { times(x, -1.0) } else { x };
        tried += 1;
        if gap(x) > most {
            (most, best) = (gap(x), x);
        }
        if most > limit {
            return (true, tried);
        }
    }
    for level in 1..=levels {
        let step = 0.5f64.powi(level.into());
        for _ in 0..4 {
            let other = if best[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let u = unit(cross(best, other));
            let v = cross(best, u);
            let centre = best;
            let before = most;
            for (side, by) in [(u, step), (u, -step), (v, step), (v, -step)] {
                let x = unit(plus(centre, times(side, by)));
                tried += 1;
                if gap(x) > most {
                    (most, best) = (gap(x), x);
                }
                if most > limit {
                    return (true, tried);
                }
            }
            if most <= before {
                break;
            }
        }
    }
    (false, tried)
}
