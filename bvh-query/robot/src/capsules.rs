//! Reads a cylinder and the balls at both of its ends as the capsule that they are.
//!
//! URDF has no capsules in its specification, so files spell one as a cylinder and two spheres of its radius, three elements of one
//! link. As one body of its own it is asked about once instead of three times, and as what it is: the cylinder alone would be a prism.
//!
//! # Tolerance
//! Origins, angles and lengths in a file are rounded, angles often to three digits: 1.57 is 0.0008 from a right angle, by which the ends
//! of an axis are off as a part of how far they are from its middle. A ball is at an end if its centre is that near to it: no more than
//! a thousandth of the way from the middle of the cylinder to the tip of the ball. Its radius may differ by a thousandth from the
//! cylinder's. The capsule has the cylinder's axis and the least radius with which it contains both balls. So it contains all that the
//! three elements do, and is wider than they are by no more than these tolerances.

use crate::frame::{Frame, Point, each, length};
use crate::urdf::{Described, Element};

/// How far a ball may be from the end of a cylinder, as a part of the way from the cylinder's middle to the tip of the ball, and how far
/// its radius from the cylinder's, as a part of that.
const TOLERANCE: f64 = 1e-3;
/// The most pairs of cylinders and balls of one link that are compared. Links of robots have a few; a link that has more stays as it is.
const MAX_COMPARED: usize = 1 << 16;

/// Replaces each cylinder that has balls at both ends by a capsule, and leaves out these balls. The elements of a link follow each other.
pub(crate) fn join(elements: &mut Vec<Element>) {
    let mut contained = vec![false; elements.len()];
    let mut start = 0;
    for of_link in elements.chunk_by_mut(|one, other| one.link == other.link) {
        let end = start + of_link.len();
        join_of_link(of_link, &mut contained[start..end]);
        start = end;
    }
    let mut contained = contained.into_iter();
    elements.retain(|_| !contained.next().unwrap_or_default());
}

/// Replaces the cylinders of one link, and marks the balls that are in capsules.
fn join_of_link(elements: &mut [Element], contained: &mut [bool]) {
    let count = |is: fn(&Described) -> bool| elements.iter().filter(|element| is(&element.shape)).count();
    let cylinders = count(|shape| matches!(shape, Described::Cylinder { .. }));
    let balls = count(|shape| matches!(shape, Described::Ball(_)));
    if cylinders == 0 || balls < 2 || cylinders * balls > MAX_COMPARED {
        return;
    }
    for number in 0..elements.len() {
        let Element { link, origin, shape: Described::Cylinder { radius, length } } = elements[number] else {
            continue;
        };
        let ends = [-length / 2.0, length / 2.0].map(|height| ball_at(elements, &origin, radius, height));
        let [Some((lower, around_lower)), Some((upper, around_upper))] = ends else { continue };
        // A cylinder without length is refused later.
        if lower == upper || length <= 0.0 {
            continue;
        }
        (contained[lower], contained[upper]) = (true, true);
        let radius = radius.max(around_lower).max(around_upper);
        elements[number] = Element { link, origin, shape: Described::Capsule { radius, length } };
    }
}

/// Returns the ball at an end of a cylinder, and the radius that a ball around that end needs to contain it.
fn ball_at(elements: &[Element], cylinder: &Frame, radius: f64, height: f64) -> Option<(usize, f64)> {
    let end = cylinder.place([0.0, 0.0, height]);
    elements.iter().enumerate().find_map(|(number, element)| {
        let Described::Ball(own) = element.shape else { return None };
        let off = distance(&element.origin.translation, &end);
        let rounding = ROUNDING * (length(end) + height.abs());
        // Where only roundings are between them, the ball is at the end.
        let around = if off <= rounding { own } else { own + off };
        let is_near = off <= TOLERANCE * (radius + height.abs());
        (is_near && (own - radius).abs() <= TOLERANCE * radius).then_some((number, around))
    })
}

fn distance(a: &Point, b: &Point) -> f64 {
    length(each(|k| a[k] - b[k]))
}

/// More than what the place of an end rounds, as a part of how far it is from the origin.
const ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;
