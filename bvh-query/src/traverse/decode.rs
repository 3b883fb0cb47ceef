//! Decodes treelets in vector registers, to the bits of `bvh_format::decode`.

use crate::isa::{Isa, Lanes};
use bvh_format::decode::Group;
use bvh_format::profile::Profile;
use bvh_format::quantize::{STEP_U4, STEP_U8};

/// Decodes children `4 * part ..` of a treelet into `out`. Column `column` of `parent` holds the
/// parent's decoded slabs. Elements beyond the profile's rows and children hold nothing of meaning.
#[inline(always)]
pub(crate) fn decode_group<I: Isa>(
    isa: I,
    profile: Profile,
    object_scale: f32,
    treelet: &[u8],
    part: usize,
    parent: &Group,
    column: usize,
    out: &mut Group,
) {
    let scale = isa.splat(object_scale);
    let integer = |step: f32| Unit::Step(isa.splat(step));
    match profile {
        Profile::Dop14U8 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            let codes = |q: usize| (isa.codes_u8(fixed(t, 16 * q)), isa.codes_u8(fixed(t, 32 + 16 * q)));
            quads::<I, 2>(isa, integer(STEP_U8), parent, column, out, codes);
        }
        Profile::Dop6U8 => {
            let t: &[u8; 32] = fixed(treelet, 32 * part);
            let codes = |_| (isa.codes_u8(fixed(t, 0)), isa.codes_u8(fixed(t, 16)));
            quads::<I, 1>(isa, integer(STEP_U8), parent, column, out, codes);
        }
        Profile::Dop6F16 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            let codes = |_| (isa.codes_f16(fixed(t, 0)), isa.codes_f16(fixed(t, 32)));
            quads::<I, 1>(isa, Unit::Fixed(scale), parent, column, out, codes);
        }
        Profile::Dop14F16 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            let pairs = |at| isa.codes_f16_pairs(fixed(t, at));
            let codes = |q: usize| (pairs(16 * q), pairs(32 + 16 * q));
            quads::<I, 2>(isa, Unit::Fixed(scale), parent, column, out, codes);
        }
        Profile::Dop14U4 => {
            let t: &[u8; 32] = fixed(treelet, 32 * part);
            let codes = |q: usize| (isa.codes_low(fixed(t, 16 * q)), isa.codes_high(fixed(t, 16 * q)));
            quads::<I, 2>(isa, integer(STEP_U4), parent, column, out, codes);
        }
        Profile::Dop26U4 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            let codes = |q: usize| (isa.codes_low(fixed(t, 16 * q)), isa.codes_high(fixed(t, 16 * q)));
            quads::<I, 4>(isa, integer(STEP_U4), parent, column, out, codes);
        }
        Profile::Dop26U8 => {
            let t: &[u8; 64] = fixed(treelet, 0);
            let pairs = |at| isa.codes_u8_pairs(fixed(t, at));
            let codes = |q: usize| (pairs(8 * q), pairs(32 + 8 * q));
            quads::<I, 4>(isa, integer(STEP_U8), parent, column, out, codes);
        }
        Profile::Dop14F16Wide => {
            let t: &[u8; 128] = fixed(treelet, 0);
            let codes = |q: usize| (isa.codes_f16(fixed(t, 32 * q)), isa.codes_f16(fixed(t, 64 + 32 * q)));
            quads::<I, 2>(isa, Unit::Fixed(scale), parent, column, out, codes);
        }
        Profile::Dop26U8Wide => {
            let t: &[u8; 128] = fixed(treelet, 0);
            let codes = |q: usize| (isa.codes_u8(fixed(t, 16 * q)), isa.codes_u8(fixed(t, 64 + 16 * q)));
            quads::<I, 4>(isa, integer(STEP_U8), parent, column, out, codes);
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

/// What a code counts.
#[derive(Clone, Copy)]
enum Unit<V> {
    /// This fraction of the parent's slab, rounded up.
    Step(V),
    /// The object's power of two.
    Fixed(V),
}

/// The predictor-corrector over `Q` registers of lower and of upper ends.
#[inline(always)]
fn quads<I: Isa, const Q: usize>(
    isa: I,
    unit: Unit<I::V>,
    parent: &Group,
    column: usize,
    out: &mut Group,
    codes: impl Fn(usize) -> (I::V, I::V),
) {
    for q in 0..Q {
        let parent_lo = isa.quad_splat(isa.load(&parent.lo[q]), column);
        let parent_hi = isa.quad_splat(isa.load(&parent.hi[q]), column);
        let unit = match unit {
            Unit::Step(step) => isa.round_step_up(parent_hi.sub(parent_lo).mul(step)),
            Unit::Fixed(scale) => scale,
        };
        // The products are exact, so that fusing them or not gives the same bits.
        let (code_lo, code_hi) = codes(q);
        isa.store(code_lo.mul_add(unit, parent_lo), &mut out.lo[q]);
        isa.store(code_hi.neg_mul_add(unit, parent_hi), &mut out.hi[q]);
    }
}

/// `N` bytes from `at`; zeros where there are fewer, which a checked page never shows.
#[inline(always)]
fn fixed<const N: usize>(bytes: &[u8], at: usize) -> &[u8; N] {
    bytes.get(at..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; N])
}
