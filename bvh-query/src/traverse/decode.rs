//! Decodes treelets in vector registers, to the bits of `bvh_format::decode`.

use crate::isa::{Isa, Lanes};
use bvh_format::profile::Profile;
use bvh_format::quantize::{STEP_U4, STEP_U8};
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::treelet::SHORT_TREELET_BYTES;

/// The predictor-corrector over `$quads` registers of lower and of upper ends. `$unit` is the unit of
/// the codes, given the parent's ends; `$codes` the codes of register `$q`. A macro, because a
/// closure may not be inlined, and what is not inlined into a backend's function lacks its features.
macro_rules! quads {
    ($isa:ident, $parent:ident, $out:ident, $quads:literal, $unit:expr, |$q:ident| $codes:expr) => {
        for $q in 0..$quads {
            let (parent_lo, parent_hi) = $parent.ends($isa, $q);
            let unit = $unit.of($isa, parent_lo, parent_hi);
            // The products are exact, so that fusing them or not gives the same bits.
            let (code_lo, code_hi) = $codes;
            $isa.store(code_lo.mul_add(unit, parent_lo), &mut $out.lo[$q]);
            $isa.store(code_hi.neg_mul_add(unit, parent_hi), &mut $out.hi[$q]);
        }
    };
}

/// What a code counts.
#[derive(Clone, Copy)]
enum Unit<V> {
    /// This fraction of the parent's slab, rounded up.
    Step(V),
    /// The object's power of two.
    Fixed(V),
}

impl<V: Lanes> Unit<V> {
    #[inline(always)]
    fn of<I: Isa<F32x16 = V>>(self, isa: I, parent_lo: V, parent_hi: V) -> V {
        match self {
            Self::Step(step) => isa.round_step_up(parent_hi.sub(parent_lo).mul(step)),
            Self::Fixed(scale) => scale,
        }
    }
}

/// How the treelets of an object code slabs.
#[derive(Clone, Copy)]
pub(crate) struct Coding {
    pub(crate) profile: Profile,
    /// The unit of slabs in `f16`.
    pub(crate) f16_scale: f32,
}

/// Where the slabs of a treelet's parent are.
#[derive(Clone, Copy)]
pub(crate) enum Parent<'a> {
    /// A decoded node: this column of a group.
    Node(&'a Group, usize),
    /// A root of a page.
    Anchor(&'a NodeSlabs),
}

impl Parent<'_> {
    /// Returns four rows of lower ends and of upper ends, each repeated for four children.
    #[inline(always)]
    pub(super) fn ends<I: Isa>(self, isa: I, q: usize) -> (I::F32x16, I::F32x16) {
        match self {
            Self::Node(group, column) => {
                let (lo, hi) = (isa.load(&group.lo[q]), isa.load(&group.hi[q]));
                (isa.quad_splat(lo, column), isa.quad_splat(hi, column))
            }
            Self::Anchor(slabs) => {
                (isa.repeat(&slabs.lo.as_chunks().0[q]), isa.repeat(&slabs.hi.as_chunks().0[q]))
            }
        }
    }
}

/// Decodes children `4 * part ..` of a treelet into `out`. Elements beyond the profile's rows and children hold nothing
/// of meaning.
#[inline(always)]
pub(crate) fn decode_group<I: Isa>(
    isa: I,
    coding: Coding,
    (treelet, part): (&[u8], usize),
    parent: Parent<'_>,
    out: &mut Group,
) {
    let scale = Unit::Fixed(isa.splat(coding.f16_scale));
    let (u8_step, u4_step) = (Unit::Step(isa.splat(STEP_U8)), Unit::Step(isa.splat(STEP_U4)));
    let is_short = treelet.len() == SHORT_TREELET_BYTES;
    match coding.profile {
        Profile::Dop14U8 if is_short => {
            let t: &[u8; 32] = fixed(treelet, 0);
            quads!(isa, parent, out, 2, u8_step, |q| {
                (isa.short_codes_low(fixed(t, 16 * q)), isa.short_codes_high(fixed(t, 16 * q)))
            });
        }
        Profile::Dop6U8 if is_short => {
            let t: &[u8; 16] = fixed(treelet, 16 * part);
            quads!(isa, parent, out, 1, u8_step, |q| {
                (isa.short_codes_low(fixed(t, 16 * q)), isa.short_codes_high(fixed(t, 16 * q)))
            });
        }
        Profile::Dop14U8 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            quads!(isa, parent, out, 2, u8_step, |q| {
                (isa.codes_u8(fixed(t, 16 * q)), isa.codes_u8(fixed(t, 32 + 16 * q)))
            });
        }
        Profile::Dop6U8 => {
            let t: &[u8; 32] = fixed(treelet, 32 * part);
            quads!(isa, parent, out, 1, u8_step, |q| {
                (isa.codes_u8(fixed(t, 32 * q)), isa.codes_u8(fixed(t, 16 + 32 * q)))
            });
        }
        Profile::Dop6F16 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            quads!(isa, parent, out, 1, scale, |q| {
                (isa.codes_f16(fixed(t, 64 * q)), isa.codes_f16(fixed(t, 32 + 64 * q)))
            });
        }
        Profile::Dop26U4 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            quads!(isa, parent, out, 4, u4_step, |q| {
                (isa.codes_low(fixed(t, 16 * q)), isa.codes_high(fixed(t, 16 * q)))
            });
        }
        Profile::Dop26U8Wide => {
            let t: &[u8; 128] = fixed(treelet, 0);
            quads!(isa, parent, out, 4, u8_step, |q| {
                (isa.codes_u8(fixed(t, 16 * q)), isa.codes_u8(fixed(t, 64 + 16 * q)))
            });
        }
        Profile::Dop14F32 => {
            let t: &[u8; 256] = fixed(treelet, 0);
            for q in 0..2 {
                isa.store(isa.codes_f32(fixed(t, 64 * q)), &mut out.lo[q]);
                isa.store(isa.codes_f32(fixed(t, 128 + 64 * q)), &mut out.hi[q]);
            }
        }
    }
}

/// `N` bytes from `at`; zeros where there are fewer, which a checked page never shows.
#[inline(always)]
fn fixed<const N: usize>(bytes: &[u8], at: usize) -> &[u8; N] {
    bytes.get(at..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; N])
}
