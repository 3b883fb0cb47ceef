//! The bounds of all nodes of a tree, as a treelet would hold them in frames of its own: coded with the functions of the
//! format, from the decoded slabs of the parent.
//!
//! Where a child's frame differs from its parent's, the parent's decoded slabs are bounded along the new directions first,
//! as a decoder would have to. An anchor starts anew with slabs in full, in the frame that holds from there on.

use super::forms::{Form, upper_form};
use super::frame;
use super::tree::{Node, Tree};
use super::vector::{IDENTITY, Matrix, Vector, dot, length, product, times, transposed, turned};
use bvh_format::kdop::{DirectionSet, FACTORS, Kdop};
use bvh_format::profile::Encoding;
use bvh_format::quantize::{
    decode_max, decode_min, encode_max_outward, encode_min_outward, residual_unit, round_step_up,
};
use bvh_format::slabs::row;
use bvh_format::turning::{MAX_TRIANGLES, TurningDirection};
use rayon::prelude::*;

/// Which treelets share a frame, in which the slabs of their children stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Frames {
    /// All of them share the axes of the object.
    Object,
    /// All treelets from an anchor down to the next anchors.
    Anchor,
    /// All treelets of this many levels below one another.
    Levels(u32),
    /// None: each has its own.
    Treelet,
    /// Each child has its own frame. No treelet has room for that: the ideal.
    Child,
}

/// Which frame is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    /// The axes of covariance.
    Covariance,
    /// The mean normal as one axis.
    Normal,
    /// That of both and the axes of the object for which the squared sums of widths of the children add up to the least. The
    /// axes of the object are kept unless another one makes the sum less by a twentieth.
    Least,
}

/// How ends of slabs are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// In `f32`, with frames in `f64`.
    Full,
    /// Codes of 8 bits, by the functions of the format.
    Eight,
    /// Codes of 12 bits, in the same way.
    Twelve,
}

/// What the nodes of a tree are bounded by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Making {
    pub(super) set: DirectionSet,
    pub(super) frames: Frames,
    pub(super) choice: Choice,
    pub(super) ends: Ends,
    /// Bits of each of three components of a stored rotation.
    pub(super) frame_bits: u32,
    /// Whether children have turning slabs.
    pub(super) turning: bool,
}

impl Making {
    /// An oriented box around each node, without rounding.
    pub(super) const IDEAL_BOXES: Self = Self {
        set: DirectionSet::Dop6,
        frames: Frames::Child,
        choice: Choice::Least,
        ends: Ends::Full,
        frame_bits: 0,
        turning: false,
    };
}

/// A slab along a direction of the child's own, in the axes of the object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turning {
    pub(super) n: Vector,
    pub(super) length: f64,
    pub(super) ends: [f64; 2],
}

/// The bounds of all nodes.
pub(super) struct Bounds {
    pub(super) set: DirectionSet,
    pub(super) frames: Vec<Matrix>,
    /// For each node the number of the frame in which its slabs stand.
    pub(super) frame_of: Vec<u32>,
    pub(super) dops: Vec<Kdop>,
    pub(super) turning: Vec<Option<Turning>>,
    /// How many frames are not the axes of the object.
    pub(super) turned_frames: usize,
}

impl Bounds {
    pub(super) fn new(tree: &Tree, making: Making) -> Self {
        let slabs = making.set.slabs();
        let (frames, frame_of, held) = frames(tree, making);
        let tight: Vec<Kdop> = (tree.nodes.par_iter().zip(&frame_of))
            .map(|(node, &frame)| tight(tree, node, &frames[frame as usize], slabs))
            .collect();
        let mut dops = tight.clone();
        if making.ends != Ends::Full {
            for (number, node) in tree.nodes.iter().enumerate() {
                let (own, of_children) = (frame_of[number], held[number]);
                let parent = if node.is_anchor {
                    self::tight(tree, node, &frames[of_children as usize], slabs)
                } else if own == of_children {
                    dops[number]
                } else {
                    let [from, to] = [own, of_children].map(|frame| &frames[frame as usize]);
                    turned_bound(&dops[number], from, to, making.set)
                };
                for &child in &node.children {
                    dops[child as usize] = coded(&tight[child as usize], &parent, making.ends, slabs);
                }
            }
        }
        let turning = (0..tree.nodes.len()).into_par_iter().map(|number| {
            let node = &tree.nodes[number];
            let frame = &frames[frame_of[number] as usize];
            let has = making.turning && number > 0 && node.below as usize <= MAX_TRIANGLES;
            has.then(|| turning(tree, node, frame, &dops[number]))
        });
        let turning = turning.collect();
        let turned_frames = frames.iter().filter(|&frame| *frame != IDENTITY).count();
        Self { set: making.set, frames, frame_of, dops, turning, turned_frames }
    }
}

/// Returns the frames, for each node the frame of its slabs, and for each treelet the frame of its children.
fn frames(tree: &Tree, making: Making) -> (Vec<Matrix>, Vec<u32>, Vec<u32>) {
    let count = tree.nodes.len();
    let mut held = vec![0u32; count];
    // The treelets at which frames begin, and the nodes that stand in each.
    let (mut tops, mut members): (Vec<usize>, Vec<Vec<u32>>) = (Vec::new(), Vec::new());
    let mut depth = vec![0u32; count];
    for (number, node) in tree.nodes.iter().enumerate() {
        let parent = node.parent as usize;
        depth[number] = if number == 0 { 0 } else { depth[parent] + 1 };
        let begins = number == 0
            || match making.frames {
                Frames::Object => false,
                Frames::Anchor => node.is_anchor,
                Frames::Levels(levels) => depth[number].is_multiple_of(levels),
                Frames::Treelet => true,
                Frames::Child => true,
            };
        if begins && (node.triangles == 0 || making.frames == Frames::Child) {
            held[number] = tops.len() as u32;
            tops.push(number);
            members.push(Vec::new());
        } else {
            held[number] = held[parent];
        }
        members[held[number] as usize].extend(&node.children);
    }
    let chosen = tops.par_iter().zip(&members).map(|(&top, members)| {
        let members: Vec<usize> = match making.frames {
            Frames::Child => vec![top],
            _ => members.iter().map(|&child| child as usize).collect(),
        };
        chosen(tree, top, &members, making)
    });
    let frames: Vec<Matrix> = chosen.collect();
    // Treelets that keep the axes of the object share one frame.
    if let Some(first) = frames.iter().position(|frame| *frame == IDENTITY) {
        for frame in &mut held {
            if frames[*frame as usize] == IDENTITY {
                *frame = first as u32;
            }
        }
    }
    let frame_of = (0..count).map(|number| {
        let own = number == 0 || making.frames == Frames::Child;
        held[if own { number } else { tree.nodes[number].parent as usize }]
    });
    (frames, frame_of.collect(), held)
}

/// Chooses the frame of nodes below a node.
fn chosen(tree: &Tree, top: usize, nodes: &[usize], making: Making) -> Matrix {
    if making.frames == Frames::Object {
        return IDENTITY;
    }
    let below = tree.corners_below(&tree.nodes[top]);
    let kept = |frame: Matrix| match making.ends {
        Ends::Full => frame,
        _ => frame::stored(&frame, making.frame_bits),
    };
    let (covariance, normal) = (|| kept(frame::covariance(below)), || kept(frame::along_normal(below)));
    match making.choice {
        Choice::Covariance => covariance(),
        Choice::Normal => normal(),
        Choice::Least => {
            let slabs = making.set.slabs();
            let cost = |frame: &Matrix| -> f64 {
                let of = |&node: &usize| widths(&tight(tree, &tree.nodes[node], frame, slabs), slabs).powi(2);
                nodes.iter().map(of).sum()
            };
            let (mut best, mut least) = (IDENTITY, 0.95 * cost(&IDENTITY));
            for frame in [covariance(), normal()] {
                let cost = cost(&frame);
                if cost < least {
                    (best, least) = (frame, cost);
                }
            }
            best
        }
    }
}

fn widths(dop: &Kdop, slabs: usize) -> f64 {
    (0..slabs).map(|slab| f64::from(dop.hi[slab] - dop.lo[slab]) / length(FACTORS[slab])).sum()
}

/// Returns the least k-DOP in a frame around the triangles below a node, rounded outward.
fn tight(tree: &Tree, node: &Node, frame: &Matrix, slabs: usize) -> Kdop {
    let columns = transposed(frame);
    let directions: Vec<Vector> = FACTORS[..slabs].iter().map(|&d| turned(&columns, d)).collect();
    let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 13];
    for &corner in tree.corners_below(node).as_flattened() {
        for ([lo, hi], &d) in ends.iter_mut().zip(&directions) {
            let along = dot(corner, d);
            (*lo, *hi) = (lo.min(along), hi.max(along));
        }
    }
    let mut dop = Kdop::EMPTY;
    for (slab, &[lo, hi]) in ends[..slabs].iter().enumerate() {
        (dop.lo[slab], dop.hi[slab]) = (below(lo), -below(-hi));
    }
    dop
}

/// Returns an `f32` that is at most this number.
fn below(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value { near.next_down() } else { near }
}

/// Returns the slabs of a decoder for a child, given its tight slabs and the decoded ones of its parent, in one frame.
fn coded(child: &Kdop, parent: &Kdop, ends: Ends, slabs: usize) -> Kdop {
    let mut decoded = Kdop::EMPTY;
    for slab in 0..slabs {
        // Rounding of turned bounds may leave the parent's ends inside by a few units in the last place.
        let (lo, hi) = (child.lo[slab], child.hi[slab]);
        let (parent_lo, parent_hi) = (parent.lo[slab].min(lo), parent.hi[slab].max(hi));
        if ends == Ends::Eight {
            let unit = residual_unit(Encoding::U8, parent_lo, parent_hi, 1.0);
            let code = encode_min_outward(Encoding::U8, lo, parent_lo, unit);
            decoded.lo[slab] = decode_min(Encoding::U8, code, parent_lo, unit);
            let code = encode_max_outward(Encoding::U8, hi, parent_hi, unit);
            decoded.hi[slab] = decode_max(Encoding::U8, code, parent_hi, unit);
        } else {
            let unit = round_step_up((parent_hi - parent_lo) / 4095.0);
            let moved = |gap: f32, fits: &dyn Fn(f32) -> bool| {
                let mut code = if unit > 0.0 { (gap / unit).floor().min(4095.0) } else { 0.0 };
                while code > 0.0 && !fits(code * unit) {
                    code -= 1.0;
                }
                code * unit
            };
            decoded.lo[slab] = parent_lo + moved(lo - parent_lo, &|by| parent_lo + by <= lo);
            decoded.hi[slab] = parent_hi - moved(parent_hi - hi, &|by| parent_hi - by >= hi);
        }
    }
    decoded
}

/// Bounds a k-DOP of one frame along the directions of another.
fn turned_bound(dop: &Kdop, from: &Matrix, to: &Matrix, set: DirectionSet) -> Kdop {
    let to_from = product(from, &transposed(to));
    let mut turned_dop = Kdop::EMPTY;
    for (slab, &direction) in FACTORS[..set.slabs()].iter().enumerate() {
        let d = turned(&to_from, direction);
        turned_dop.hi[slab] = -below(-upper(dop, d, set));
        turned_dop.lo[slab] = below(-upper(dop, times(d, -1.0), set));
    }
    turned_dop
}

/// Returns how far a k-DOP reaches along a direction in its frame, by the closed form of queries.
pub(super) fn upper(dop: &Kdop, d: Vector, set: DirectionSet) -> f64 {
    end(&upper_form(d, set), dop)
}

/// Returns the value of a form.
pub(super) fn end(form: &Form, dop: &Kdop) -> f64 {
    let term = |j: usize| {
        let place = usize::from(form.rows[j]);
        let slab = usize::from(SLAB_OF_ROW[place % 16]);
        f64::from(form.coefficients[j]) * f64::from(if place < 16 { dop.lo[slab] } else { dop.hi[slab] })
    };
    term(0) + term(1) + term(2)
}

const SLAB_OF_ROW: [u8; 16] = {
    let mut slabs = [0; 16];
    let mut slab = 0;
    while slab < 13 {
        slabs[row(slab)] = slab as u8;
        slab += 1;
    }
    slabs
};

/// Returns how far the box of a node reaches along a direction in its frame.
pub(super) fn reach(dop: &Kdop, x: Vector) -> f64 {
    let end = |axis: usize| f64::from(if x[axis] < 0.0 { dop.lo[axis] } else { dop.hi[axis] });
    x[0] * end(0) + x[1] * end(1) + x[2] * end(2)
}

/// Makes the turning slab of a child, with its ends in 8 bits from the reach of its decoded box.
fn turning(tree: &Tree, node: &Node, frame: &Matrix, dop: &Kdop) -> Turning {
    let corners = tree.corners_below(node);
    let along = |direction: Vector| {
        let n = TurningDirection::near(direction).vector().map(f64::from);
        let ends = corners.as_flattened().iter().map(|&p| dot(n, p));
        let ends = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [v.min(lo), v.max(hi)]);
        Turning { n, length: length(n), ends }
    };
    let [by_normal, by_axis] = [frame::along_normal(corners)[2], frame::covariance(corners)[2]].map(along);
    let width = |slab: &Turning| (slab.ends[1] - slab.ends[0]) / slab.length;
    let mut slab = if width(&by_normal) <= width(&by_axis) { by_normal } else { by_axis };
    let seen = turned(frame, slab.n);
    let [least, most] = slab.ends;
    let (low, high) = ((-reach(dop, times(seen, -1.0))).min(least), reach(dop, seen).max(most));
    let step = (high - low) / 255.0;
    // One step less than the quotient where the product might be rounded inward.
    let moved =
        |gap: f64| if step > 0.0 { ((gap / step - 1e-9).floor()).clamp(0.0, 255.0) * step } else { 0.0 };
    slab.ends = [low + moved(least - low), high - moved(high - most)];
    slab
}

/// Returns the centre of a node's box, in the axes of the object.
pub(super) fn centre(frame: &Matrix, dop: &Kdop) -> Vector {
    turned(&transposed(frame), [0, 1, 2].map(|i| f64::midpoint(f64::from(dop.lo[i]), f64::from(dop.hi[i]))))
}

/// Returns half of the sides of a node's box.
pub(super) fn half(dop: &Kdop) -> Vector {
    [0, 1, 2].map(|i| (f64::from(dop.hi[i]) - f64::from(dop.lo[i])) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oriented::scene::baked;
    use crate::oriented::variant::VARIANTS;
    use bvh_bake::mesh::Mesh;
    use cbvh_testkit::ball::ball;

    #[test]
    fn all_bounds_hold_the_triangles_below() {
        let (positions, triangles) = ball(3000);
        let tree = Tree::of_file(&baked(&Mesh::from_triangles(positions, triangles)).unwrap()).unwrap();
        for variant in VARIANTS {
            let bounds = Bounds::new(&tree, variant.making);
            for (number, node) in tree.nodes.iter().enumerate() {
                let (frame, dop) = (&bounds.frames[bounds.frame_of[number] as usize], &bounds.dops[number]);
                for &corner in tree.corners_below(node).as_flattened() {
                    let seen = turned(frame, corner);
                    for (slab, &direction) in FACTORS[..bounds.set.slabs()].iter().enumerate() {
                        let along = dot(direction, seen);
                        let (lo, hi) = (f64::from(dop.lo[slab]), f64::from(dop.hi[slab]));
                        assert!(lo - 1e-14 <= along && along <= hi + 1e-14, "{} {number}", variant.name);
                    }
                    if let Some(slab) = &bounds.turning[number] {
                        let along = dot(slab.n, corner);
                        let [lo, hi] = slab.ends;
                        assert!(lo - 1e-14 <= along && along <= hi + 1e-14, "{} {number}", variant.name);
                    }
                }
            }
            // A ball may keep the axes of the object where the choice is free.
            match (variant.making.frames, variant.making.choice) {
                (Frames::Object, _) => assert_eq!(bounds.turned_frames, 0, "{}", variant.name),
                (_, Choice::Least) => {}
                _ => assert_eq!(bounds.turned_frames, bounds.frames.len(), "{}", variant.name),
            }
        }
    }
}
