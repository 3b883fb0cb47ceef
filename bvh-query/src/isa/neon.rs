//! The NEON backend: registers of four lanes, which every CPU of AArch64 has.
//!
//! Each use of an intrinsic names its [`Proof`]. Here that is a matter of the target: if it has NEON, no CPU that runs this
//! lacks it.

use super::Lanes;
use super::quads::{Four, Quad};
use bvh_format::treelet::SHORT_CODES;
use std::arch::aarch64::*;
use std::arch::asm;

/// Four lanes.
#[derive(Clone, Copy)]
pub(crate) struct Neon(float32x4_t);

/// A value of this type shows that the CPU has NEON.
///
/// # Safety
/// The target must have NEON.
unsafe trait Proof: Copy {}

/// Stands for the target.
#[derive(Clone, Copy)]
struct Target;

const _: () = assert!(cfg!(target_feature = "neon"), "expected a target with NEON");

// SAFETY: the assertion above.
unsafe impl Proof for Target {}
// SAFETY: the assertion above.
unsafe impl Proof for Neon {}

loads! {
    load_four([f32; 4]) -> float32x4_t = vld1q_f32;
    load_bytes([u8; 16]) -> uint8x16_t = vld1q_u8;
    load_eight_bytes([u8; 8]) -> uint8x8_t = vld1_u8;
    load_integers([i32; 4]) -> int32x4_t = vld1q_s32;
    load_words([u32; 4]) -> uint32x4_t = vld1q_u32;
}

stores! {
    store_four(float32x4_t) -> [f32; 4] = vst1q_f32;
    store_bytes(uint8x16_t) -> [u8; 16] = vst1q_u8;
}

impl Lanes for Neon {
    type Mask = uint32x4_t;

    by_intrinsics! {
        (0)
        add(other) vaddq_f32;
        sub(other) vsubq_f32;
        mul(other) vmulq_f32;
        div(other) vdivq_f32;
        sqrt() vsqrtq_f32;
        abs() vabsq_f32;
        max_of_numbers(other) vmaxnmq_f32;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(with_features!(self, vfmaq_f32(term.0, self.0, factor.0)))
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(with_features!(self, vfmsq_f32(term.0, self.0, factor.0)))
    }
    // The minimum and the maximum of the CPU are NaN if either operand is.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> uint32x4_t {
        with_features!(self, vcleq_f32(self.0, other.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> uint32x4_t {
        with_features!(self, vcltq_f32(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: uint32x4_t, yes: Self, no: Self) -> Self {
        Self(with_features!(yes, vbslq_f32(mask, yes.0, no.0)))
    }
    #[inline(always)]
    fn bits(mask: uint32x4_t) -> u16 {
        with_features!(Target, vaddvq_u32(vandq_u32(mask, lane_bits())) as u16)
    }
}

impl Quad for Neon {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(with_features!(Target, vdupq_n_f32(value)))
    }
    #[inline(always)]
    fn load(from: &[f32; 4]) -> Self {
        Self(load_four(Target, from))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 4]) {
        store_four(self, self.0, to);
    }
    #[inline(always)]
    fn splat_lane(self, lane: usize) -> Self {
        // A lookup takes any lane. Where the lane is a constant, this becomes a duplication of that lane.
        with_features!(self, {
            let places = vdupq_n_u32(0x0302_0100 + 0x0404_0404 * (lane % 4) as u32);
            let bytes = vqtbl1q_u8(vreinterpretq_u8_f32(self.0), vreinterpretq_u8_u32(places));
            Self(vreinterpretq_f32_u8(bytes))
        })
    }
    #[inline(always)]
    fn round_step_up(self) -> Self {
        with_features!(self, {
            let bits = vaddq_u32(vreinterpretq_u32_f32(self.0), vdupq_n_u32(0xff));
            Self(vreinterpretq_f32_u32(vandq_u32(bits, vdupq_n_u32(!0xff))))
        })
    }
    #[inline(always)]
    fn codes_u8(from: &[u8; 16]) -> Four<Self> {
        let bytes = load_bytes(Target, from);
        with_features!(Target, {
            let (low, high) = (vmovl_u8(vget_low_u8(bytes)), vmovl_high_u8(bytes));
            Four(
                Self(vcvtq_f32_u32(vmovl_u16(vget_low_u16(low)))),
                Self(vcvtq_f32_u32(vmovl_high_u16(low))),
                Self(vcvtq_f32_u32(vmovl_u16(vget_low_u16(high)))),
                Self(vcvtq_f32_u32(vmovl_high_u16(high))),
            )
        })
    }
    #[inline(always)]
    fn codes_f16(from: &[u8; 8]) -> Self {
        let codes = load_eight_bytes(Target, from);
        let converted: float32x4_t;
        // SAFETY: the instruction is part of NEON. It reads a register and writes another one.
        unsafe {
            asm!("fcvtl {0:v}.4s, {1:v}.4h", out(vreg) converted, in(vreg) codes, options(pure, nomem, nostack));
        }
        Self(converted)
    }
    #[inline(always)]
    fn codes_f32(from: &[u8; 16]) -> Self {
        let bytes = load_bytes(Target, from);
        Self(with_features!(Target, vreinterpretq_f32_u8(bytes)))
    }
    #[inline(always)]
    fn short_codes(from: &[u8; 16]) -> [u8; 16] {
        let (bytes, table) = (load_bytes(Target, from), load_bytes(Target, &SHORT_CODES));
        let found = with_features!(Target, vqtbl1q_u8(table, vandq_u8(bytes, vdupq_n_u8(15))));
        let mut codes = [0; 16];
        store_bytes(Target, found, &mut codes);
        codes
    }
    #[inline(always)]
    fn ordered(from: &[i32; 4]) -> Self {
        let integers = load_integers(Target, from);
        with_features!(Target, {
            let inverted = vshrq_n_u32::<1>(vreinterpretq_u32_s32(vshrq_n_s32::<31>(integers)));
            Self(vreinterpretq_f32_u32(veorq_u32(vreinterpretq_u32_s32(integers), inverted)))
        })
    }
    #[inline(always)]
    fn divided(from: &[i32; 4], divisor: f64) -> Self {
        let integers = load_integers(Target, from);
        with_features!(Target, {
            let low = vcvtq_f64_s64(vmovl_s32(vget_low_s32(integers)));
            let high = vcvtq_f64_s64(vmovl_high_s32(integers));
            let divisor = vdupq_n_f64(divisor);
            let low = vcvt_f32_f64(vdivq_f64(low, divisor));
            Self(vcvt_high_f32_f64(low, vdivq_f64(high, divisor)))
        })
    }
    #[inline(always)]
    fn mask(bits: u16) -> uint32x4_t {
        with_features!(Target, vtstq_u32(vdupq_n_u32(u32::from(bits)), lane_bits()))
    }
    #[inline(always)]
    fn bits_of_four([a, b, c, d]: [uint32x4_t; 4]) -> u16 {
        let bits = load_words(Target, &[0x1111, 0x2222, 0x4444, 0x8888]);
        with_features!(Target, {
            // Lane i has the bits of lane i of each register: a at the bottom, then four bits to the left for each.
            let all = vsliq_n_u32::<12>(vsliq_n_u32::<8>(vsliq_n_u32::<4>(a, b), c), d);
            vaddvq_u32(vandq_u32(all, bits)) as u16
        })
    }
    #[inline(always)]
    fn permute(value: Four<Self>, places: &[u8; 16]) -> Four<Self> {
        let places = load_bytes(Target, places);
        with_features!(Target, {
            let all = uint8x16x4_t(
                vreinterpretq_u8_f32(value.0.0),
                vreinterpretq_u8_f32(value.1.0),
                vreinterpretq_u8_f32(value.2.0),
                vreinterpretq_u8_f32(value.3.0),
            );
            // A lookup of bytes needs the places of the four bytes of each lane: 4 * place, and 1, 2 and 3 more.
            let first = vshlq_n_u8::<2>(vandq_u8(places, vdupq_n_u8(15)));
            let (low, high) = (vzip1q_u8(first, first), vzip2q_u8(first, first));
            let lanes = |twice| {
                let places = vorrq_u8(twice, vreinterpretq_u8_u32(vdupq_n_u32(0x0302_0100)));
                Self(vreinterpretq_f32_u8(vqtbl4q_u8(all, places)))
            };
            Four(
                lanes(vzip1q_u8(low, low)),
                lanes(vzip2q_u8(low, low)),
                lanes(vzip1q_u8(high, high)),
                lanes(vzip2q_u8(high, high)),
            )
        })
    }
    #[inline(always)]
    fn prefetch_line(byte: &u8) {
        // SAFETY: a hint that changes nothing, wherever it points.
        unsafe {
            asm!("prfm pldl1keep, [{0}]", in(reg) std::ptr::from_ref(byte), options(readonly, nostack, preserves_flags));
        }
    }
}

/// A bit for each lane.
#[inline(always)]
fn lane_bits() -> uint32x4_t {
    load_words(Target, &[1, 2, 4, 8])
}
