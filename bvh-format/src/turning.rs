//! The turning slab of a child: one more slab, along a direction of the child's own that follows its surface.
//!
//! The width of a slab along a fixed direction shrinks only with the length of a curved patch. The width of a slab
//! along the patch's own normal shrinks with the square of the length. Such a slab takes four bytes in the rows that
//! fixed slabs of [`Profile::Dop26U8Wide`] leave empty: two for the direction, and one for each end. The ends are
//! counted inward from the reach of the child's own decoded box along the direction. Four zero bytes mean that there is
//! none.
//!
//! The direction is a hemi-octahedral code (Cigolle et al., "A Survey of Efficient Representations for Independent Unit
//! Vectors", JCGT 2014): two integers that name a point of the unfolded half octahedron. It is an integer vector divided by
//! 256, so that decoding rounds nothing, and it is not normalised. Its coordinates' magnitudes add up to less than 1, so that
//! projections are no larger than coordinates.

use crate::kdop::{round_down, sum_of_three, two_sum};
use crate::leaf::{PACKET, Packet};
use crate::profile::{Encoding, Profile};
use crate::quantize::{decode_max, decode_min, encode_max_outward, encode_min_outward, residual_unit};
use crate::slabs::NodeSlabs;
use crate::vertex::margin_along;

/// The most triangles below a child with a turning slab (R39).
///
/// Slabs along different directions cannot be joined on the way up, so each is proved from all triangles below. Larger
/// patches are hardly ever flat.
pub const MAX_TRIANGLES: usize = 1024;

/// The row of the codes of both ends.
pub const END_ROW: usize = 7;
/// The row of the two codes of the direction.
pub const DIRECTION_ROW: usize = 14;

/// The direction of a turning slab, as two codes.
///
/// [`TurningSlab`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TurningDirection {
    /// 127 more than the first integer, `a`.
    pub a: u8,
    /// 127 more than the second integer, `b`.
    pub b: u8,
}

/// The difference between a code and its integer of a direction, and the largest magnitude of an integer that writers
/// use.
pub const BIAS: u8 = 127;

impl TurningDirection {
    /// The direction, `(a + b, a - b, 254 - 2 max(|a|, |b|)) / 256`. It is never zero.
    pub fn vector(self) -> [f32; 3] {
        let [a, b] = [self.a, self.b].map(|code| i16::from(code) - i16::from(BIAS));
        [a + b, a - b, 2 * i16::from(BIAS) - 2 * a.abs().max(b.abs())].map(|c| f32::from(c) / 256.0)
    }

    /// The code of a direction within a degree of that of a vector, or of its opposite. The vector may have any length;
    /// a zero vector or NaN gives the z axis.
    pub fn near([x, y, z]: [f64; 3]) -> Self {
        let most = f64::from(BIAS);
        let scale = if z < 0.0 { -most } else { most } / (x.abs() + y.abs() + z.abs());
        // A conversion to an integer saturates, and turns NaN into 0.
        let code = |value: f64| {
            let integer = (value * scale).round().clamp(-most, most);
            (if integer.is_nan() { most } else { integer + most }) as u8
        };
        Self { a: code(x + y), b: code(x - y) }
    }
}

/// A slab along a direction of its own: `lo <= direction . v <= hi`, in mesh units times the direction's length.
///
/// ```
/// use bvh_format::leaf::Packet;
/// use bvh_format::turning::{TurningDirection, TurningSlab};
///
/// // A triangle in the plane x + 2 z = 1.
/// let packet = Packet::new(&[[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.5]]]);
/// let direction = TurningDirection::near([1.0, 0.0, 2.0]);
/// let slab = TurningSlab::around(direction, [&packet], [0.0; 3]);
/// assert!(slab.contains([&packet], [0.0; 3]));
/// assert!(slab.hi - slab.lo < 0.02); // its box is 1 wide
/// let beside = Packet::new(&[[[1.0, 0.0, 0.1]; 3]]);
/// assert!(!slab.contains([&beside], [0.0; 3]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningSlab {
    /// The direction.
    pub direction: TurningDirection,
    /// The lower end.
    pub lo: f32,
    /// The upper end.
    pub hi: f32,
}

impl TurningSlab {
    /// The slab of the triangles in packets along a direction, whose vertices are as near to their offsets as stated. Each end
    /// is outside the tightest one, by less than 2^-22 of the largest coordinate. Lanes beyond a packet's triangles count as
    /// well, so they must repeat some of these.
    pub fn around<'a>(
        direction: TurningDirection,
        packets: impl IntoIterator<Item = &'a Packet>,
        left_out: [f32; 3],
    ) -> Self {
        let (lo, hi) = reach_of_packets(direction, packets);
        // A sum that is rounded to nearest is no more than half of this beyond the exact one.
        let margin = margin(direction, left_out) * (1.0 + 2f64.powi(-50));
        let (lo, hi) = (lo - margin, hi + margin);
        let (lo, hi) = if margin > 0.0 { (lo.next_down(), hi.next_up()) } else { (lo, hi) };
        Self { direction, lo: round_down(lo), hi: -round_down(-hi) }
    }

    /// Returns true if the slab contains the triangles of packets, whose vertices are as near to their offsets as stated, in
    /// exact arithmetic.
    pub fn contains<'a>(
        &self,
        packets: impl IntoIterator<Item = &'a Packet> + Clone,
        left_out: [f32; 3],
    ) -> bool {
        let margin = margin(self.direction, left_out);
        // Both ends without the margin, rounded inward.
        let inward = |end: f64| {
            let (sum, rest) = two_sum(end, margin);
            if rest > 0.0 { sum.next_up() } else { sum }
        };
        let (lo, hi) = (inward(self.lo.into()), -inward(-f64::from(self.hi)));
        let reach = reach_of_packets(self.direction, packets.clone());
        if lo <= reach.0 && reach.1 <= hi {
            return true;
        }
        let n = self.direction.vector().map(f64::from);
        packets.into_iter().flat_map(|packet| &packet.corners).all(|[x, y, z]| {
            (0..PACKET).all(|lane| {
                let [x, y, z] = [x[lane], y[lane], z[lane]].map(f64::from);
                let (below, above) = sum_of_three(n[0] * x, n[1] * y, n[2] * z);
                lo <= below && above <= hi
            })
        })
    }
}

/// How much farther vertices may reach along a direction than their offsets do, rounded up.
fn margin(direction: TurningDirection, left_out: [f32; 3]) -> f64 {
    margin_along(direction.vector().map(f64::from), left_out)
}

/// What the triangles in packets reach along a direction, below and above, or somewhat more.
fn reach_of_packets<'a>(
    direction: TurningDirection,
    packets: impl IntoIterator<Item = &'a Packet>,
) -> (f64, f64) {
    let n = direction.vector().map(f64::from);
    let (mut lo, mut hi) = ([f64::INFINITY; PACKET], [f64::NEG_INFINITY; PACKET]);
    let mut largest = [0.0f32; PACKET];
    // Compilers turn the lanes into vector code.
    for [x, y, z] in packets.into_iter().flat_map(|packet| &packet.corners) {
        for lane in 0..PACKET {
            let along = n[0] * f64::from(x[lane]) + n[1] * f64::from(y[lane]) + n[2] * f64::from(z[lane]);
            lo[lane] = if along < lo[lane] { along } else { lo[lane] };
            hi[lane] = if along > hi[lane] { along } else { hi[lane] };
            for coordinate in [x[lane], y[lane], z[lane]] {
                let magnitude = coordinate.abs();
                largest[lane] = if magnitude > largest[lane] { magnitude } else { largest[lane] };
            }
        }
    }
    // Products of 8 and 24 bits are exact. The two sums and the one below round by less than 2^-53 of the largest
    // coordinate each, or by a hundredth more for a direction that no writer uses.
    let error = f64::from(largest.into_iter().fold(0.0, f32::max)) * 2f64.powi(-51);
    let (lo, hi) =
        (lo.into_iter().fold(f64::INFINITY, f64::min), hi.into_iter().fold(f64::NEG_INFINITY, f64::max));
    (lo - error, hi + error)
}

/// What the box of a node reaches along a direction, below and above, rounded to nearest five times.
fn reach_of_box(n: [f32; 3], node: &NodeSlabs) -> (f32, f32) {
    let ends = [0, 1, 2].map(|axis| {
        let (at_lo, at_hi) = (n[axis] * node.lo[axis], n[axis] * node.hi[axis]);
        if n[axis] < 0.0 { (at_hi, at_lo) } else { (at_lo, at_hi) }
    });
    let [x, y, z] = ends;
    ((x.0 + y.0) + z.0, (x.1 + y.1) + z.1)
}

/// Where the four bytes of a child's turning slab stand in a treelet: the codes of the lower and the upper end, and `a`
/// and `b`.
fn places(profile: Profile, child: usize) -> [usize; 4] {
    let half = profile.treelet_bytes() / 2;
    let at = |row: usize| row * profile.width() + child;
    [at(END_ROW), half + at(END_ROW), at(DIRECTION_ROW), half + at(DIRECTION_ROW)]
}

/// The bytes of the turning slabs of four children, in rows of four: the codes of the lower ends, of the upper ends, and
/// both codes of the directions.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::page::{Page, check_page};
/// use bvh_format::turning::TurningCodes;
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-turning.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let object = &layout.objects[0];
/// let page = layout.page_bytes(&bytes, 0).expect("a page");
/// check_page(page, 0, object, layout.page_offset(0))?;
/// let page = Page::new(page, object.profile());
/// let codes = |slot| TurningCodes::read(page.treelet(slot).first_chunk().expect("128 bytes"));
/// assert!((0..page.header().treelets).any(|slot| codes(slot).any())); // a ball has flat parts
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TurningCodes(pub [u8; 16]);

impl TurningCodes {
    /// Four children without turning slabs.
    pub const NONE: Self = Self([0; 16]);

    /// Reads the codes of a treelet of four children.
    #[inline(always)]
    pub fn read(treelet: &[u8; 128]) -> Self {
        let mut codes = [0; 16];
        let rows = [END_ROW, 16 + END_ROW, DIRECTION_ROW, 16 + DIRECTION_ROW];
        for (to, row) in codes.as_chunks_mut::<4>().0.iter_mut().zip(rows) {
            to.copy_from_slice(&treelet[4 * row..4 * row + 4]);
        }
        Self(codes)
    }

    /// Returns whether any child has a turning slab.
    #[inline(always)]
    pub fn any(&self) -> bool {
        u128::from_le_bytes(self.0) != 0
    }
}

/// Decodes the turning slab of a child, given the child's decoded slabs. Without one, or in a profile without them, it
/// returns `None`.
pub fn decode_turning(
    profile: Profile,
    treelet: &[u8],
    child: usize,
    node: &NodeSlabs,
) -> Option<TurningSlab> {
    if !profile.has_turning_slabs() {
        return None;
    }
    let bytes = places(profile, child).map(|at| treelet[at]);
    if bytes == [0; 4] {
        return None;
    }
    let [code_lo, code_hi, a, b] = bytes;
    let direction = TurningDirection { a, b };
    let (low, high) = reach_of_box(direction.vector(), node);
    let unit = residual_unit(Encoding::U8, low, high, 0.0);
    Some(TurningSlab {
        direction,
        lo: decode_min(Encoding::U8, code_lo.into(), low, unit),
        hi: decode_max(Encoding::U8, code_hi.into(), high, unit),
    })
}

/// Writes the turning slab of a child, rounding outward, given the child's decoded slabs. It leaves the bytes zero if the
/// slab is not within what the box reaches, which is rounded.
pub(crate) fn encode_turning(
    profile: Profile,
    treelet: &mut [u8],
    child: usize,
    node: &NodeSlabs,
    tight: &TurningSlab,
) {
    let (low, high) = reach_of_box(tight.direction.vector(), node);
    if !(low <= tight.lo && tight.hi <= high) {
        return;
    }
    let unit = residual_unit(Encoding::U8, low, high, 0.0);
    let code_lo = encode_min_outward(Encoding::U8, tight.lo, low, unit) as u8;
    let code_hi = encode_max_outward(Encoding::U8, tight.hi, high, unit) as u8;
    let TurningDirection { a, b } = tight.direction;
    for (at, byte) in places(profile, child).into_iter().zip([code_lo, code_hi, a, b]) {
        treelet[at] = byte;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdop::Kdop;
    use crate::treelet::SlabEncoder;

    fn random(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 40) as f32 / (1 << 24) as f32 * 2.0 - 1.0
    }

    /// `256 direction . v` in units of 2^-60, for coordinates that are multiples of 2^-60 of at most 2^40.
    fn exact(direction: TurningDirection, [x, y, z]: [f32; 3]) -> i128 {
        let units = |value: f32| (f64::from(value) * 2f64.powi(60)) as i128;
        let n = direction.vector().map(|c| (c * 256.0) as i128);
        n[0] * units(x) + n[1] * units(y) + n[2] * units(z)
    }

    fn contains_exactly(slab: &TurningSlab, points: &[[f32; 3]]) -> bool {
        let end = |value: f32| (f64::from(value) * 2f64.powi(60)) as i128 * 256;
        points
            .iter()
            .map(|&point| exact(slab.direction, point))
            .all(|p| end(slab.lo) <= p && p <= end(slab.hi))
    }

    #[test]
    fn every_code_is_that_of_its_direction() {
        for a in 0..=2 * BIAS {
            for b in 0..=2 * BIAS {
                let n = TurningDirection { a, b }.vector();
                assert_eq!(n.iter().map(|c| c.abs()).sum::<f32>(), 254.0 / 256.0);
                let again = TurningDirection::near(n.map(f64::from)).vector();
                assert!(again == n || again == n.map(|c| -c), "{a} {b}: {n:?}, {again:?}");
            }
        }
        for (a, b) in [(255, 127), (127, 255), (255, 255), (0, 0), (255, 0)] {
            assert!(TurningDirection { a, b }.vector() != [0.0; 3]);
        }
    }

    #[test]
    fn directions_are_kept_to_a_degree() {
        let mut state = 3;
        for _ in 0..20_000 {
            let d = [(); 3].map(|()| f64::from(random(&mut state)));
            let n = TurningDirection::near(d).vector().map(f64::from);
            let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
            let cosine = dot(d, n).abs() / (dot(d, d) * dot(n, n)).sqrt();
            assert!(cosine > 1f64.to_radians().cos(), "{d:?} {n:?}");
        }
        let up = TurningDirection { a: BIAS, b: BIAS };
        for d in [[0.0; 3], [f64::NAN; 3], [0.0, 0.0, -7.0], [0.0, 0.0, 1e300]] {
            assert_eq!(TurningDirection::near(d), up, "{d:?}");
        }
    }

    #[test]
    fn slabs_contain_their_triangles_whatever_the_scale_and_the_place() {
        let (mut state, mut narrow, mut left_out) = (11, 0, 0);
        let profile = Profile::Dop26U8Wide;
        for round in 0..20_000 {
            // A flat patch of four triangles, at the origin or far from it.
            let scale = 2f32.powi(-(round % 20));
            let offset = [(); 3].map(|()| random(&mut state) * 2f32.powi(round % 23 - 20));
            let normal = [(); 3].map(|()| f64::from(random(&mut state)));
            let direction = TurningDirection::near(normal);
            let n = direction.vector();
            let square: f32 = n.iter().map(|c| c * c).sum();
            let triangles: Vec<[[f32; 3]; 3]> = (0..4)
                .map(|_| {
                    [(); 3].map(|()| {
                        let p = [(); 3].map(|()| random(&mut state));
                        let along = (0..3).map(|i| p[i] * n[i]).sum::<f32>() / square * 0.98;
                        [0, 1, 2].map(|i| offset[i] + scale * (p[i] - along * n[i]))
                    })
                })
                .collect();
            let points = triangles.as_flattened();
            let packet = Packet::new(&triangles);
            let tight = TurningSlab::around(direction, [&packet], [0.0; 3]);
            assert!(contains_exactly(&tight, points) && tight.contains([&packet], [0.0; 3]));
            let largest = points.as_flattened().iter().fold(0.0f32, |m, c| m.max(c.abs()));
            let shrunk = |by: f32| TurningSlab { lo: tight.lo + by, hi: tight.hi - by, ..tight };
            assert!(!contains_exactly(&shrunk(largest * 2f32.powi(-21)), points), "{tight:?}");
            // Ends as near as f32 numbers are: `contains` is exact.
            for slab in [
                TurningSlab { lo: tight.lo.next_up(), ..tight },
                TurningSlab { hi: tight.hi.next_down(), ..tight },
                TurningSlab { lo: tight.lo.next_up().next_up(), ..tight },
                TurningSlab { hi: f32::NAN, ..tight },
            ] {
                let expected = !slab.hi.is_nan() && contains_exactly(&slab, points);
                assert_eq!(slab.contains([&packet], [0.0; 3]), expected, "{slab:?}");
            }
            // Through the codes of a treelet, under a parent somewhat larger.
            let kdop = Kdop::of_points(points.iter().copied());
            let mut parent = kdop;
            parent.join(&Kdop::of_points([offset.map(|c| c + 2.0 * scale), offset]), 13);
            let parent = NodeSlabs::from_kdop(&parent, 13);
            let mut treelet = vec![0; profile.treelet_bytes()];
            SlabEncoder::new(profile, 1.0, &parent).encode(1, &kdop, &mut treelet);
            let node = crate::page::decode::decode_child(profile, 1.0, &treelet, 1, &parent);
            assert_eq!(decode_turning(profile, &treelet, 1, &node), None);
            encode_turning(profile, &mut treelet, 1, &node, &tight);
            let Some(decoded) = decode_turning(profile, &treelet, 1, &node) else {
                left_out += 1;
                continue;
            };
            assert!(decoded.lo <= tight.lo && tight.hi <= decoded.hi && decoded.direction == direction);
            assert!(contains_exactly(&decoded, points));
            let (low, high) = reach_of_box(n, &node);
            narrow += u32::from(decoded.hi - decoded.lo < 0.25 * (high - low));
        }
        // Most patches are thin along their normal, and hardly any slab does without room for its rounding.
        assert!(narrow > 10_000 && left_out < 2_000, "{narrow}, {left_out}");
    }

    #[test]
    fn a_slab_that_the_box_does_not_hold_is_left_out() {
        let profile = Profile::Dop26U8Wide;
        let node = NodeSlabs { lo: [0.0; 16], hi: [1.0; 16] };
        let direction = TurningDirection::near([1.0, 2.0, 3.0]);
        let (low, high) = reach_of_box(direction.vector(), &node);
        for (lo, hi, is_there) in [
            (low, high, true),
            (low.next_down(), high, false),
            (low, high.next_up(), false),
            (f32::NAN, high, false),
        ] {
            let mut treelet = [0; 128];
            encode_turning(profile, &mut treelet, 3, &node, &TurningSlab { direction, lo, hi });
            assert_eq!(decode_turning(profile, &treelet, 3, &node).is_some(), is_there, "{lo} {hi}");
            assert_eq!(treelet == [0; 128], !is_there);
            assert_eq!(TurningCodes::read(&treelet).any(), is_there);
        }
        for profile in Profile::ALL.into_iter().filter(|profile| !profile.has_turning_slabs()) {
            assert_eq!(decode_turning(profile, &[0xff; 256], 0, &node), None);
        }
    }
}
