//! The SIMD128 backend: registers of four lanes, in WebAssembly that is compiled for an engine which has them.
//!
//! Loads and stores are `unsafe`, because they take pointers. They need no alignment. The target has all instructions, so that
//! the others are safe.

use super::Lanes;
use super::quads::{Four, Quad};
use bvh_format::treelet::SHORT_CODES;
use std::arch::wasm32::*;

/// Four lanes.
#[derive(Clone, Copy)]
pub(crate) struct Simd128(v128);

impl Lanes for Simd128 {
    type Mask = v128;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(f32x4_add(self.0, other.0))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(f32x4_sub(self.0, other.0))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(f32x4_mul(self.0, other.0))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(f32x4_div(self.0, other.0))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        term.sub(self.mul(factor))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(f32x4_sqrt(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(f32x4_abs(self.0))
    }
    // These return their first operand for NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(f32x4_pmin(other.0, self.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(f32x4_pmax(other.0, self.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> v128 {
        f32x4_le(self.0, other.0)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> v128 {
        f32x4_lt(self.0, other.0)
    }
    #[inline(always)]
    fn select(mask: v128, yes: Self, no: Self) -> Self {
        Self(v128_bitselect(yes.0, no.0, mask))
    }
    #[inline(always)]
    fn bits(mask: v128) -> u16 {
        u16::from(i32x4_bitmask(mask))
    }
}

impl Quad for Simd128 {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(f32x4_splat(value))
    }
    #[inline(always)]
    fn load(from: &[f32; 4]) -> Self {
        // SAFETY: it reads 16 bytes, those of the array.
        Self(unsafe { v128_load(from.as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 4]) {
        // SAFETY: it writes 16 bytes, those of the array.
        unsafe { v128_store(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn splat_lane(self, lane: usize) -> Self {
        Self(match lane % 4 {
            0 => i32x4_shuffle::<0, 0, 0, 0>(self.0, self.0),
            1 => i32x4_shuffle::<1, 1, 1, 1>(self.0, self.0),
            2 => i32x4_shuffle::<2, 2, 2, 2>(self.0, self.0),
            _ => i32x4_shuffle::<3, 3, 3, 3>(self.0, self.0),
        })
    }
    #[inline(always)]
    fn round_step_up(self) -> Self {
        Self(v128_and(i32x4_add(self.0, i32x4_splat(0xff)), i32x4_splat(!0xff)))
    }
    #[inline(always)]
    fn codes_u8(from: &[u8; 16]) -> Four<Self> {
        let bytes = bytes(from);
        let (low, high) = (u16x8_extend_low_u8x16(bytes), u16x8_extend_high_u8x16(bytes));
        Four(
            Self(f32x4_convert_u32x4(u32x4_extend_low_u16x8(low))),
            Self(f32x4_convert_u32x4(u32x4_extend_high_u16x8(low))),
            Self(f32x4_convert_u32x4(u32x4_extend_low_u16x8(high))),
            Self(f32x4_convert_u32x4(u32x4_extend_high_u16x8(high))),
        )
    }
    // Codes are finite and not negative (R38). Those below 2^-14 are multiples of 2^-24. The bias of the others' exponent is 112
    // less than that of an f32. Shifting the former would make subnormal f32, which are slow.
    #[inline(always)]
    fn codes_f16(from: &[u8; 8]) -> Self {
        // SAFETY: it reads 8 bytes, those of the array.
        let codes = unsafe { u32x4_load_extend_u16x4(from.as_ptr().cast()) };
        let tiny = f32x4_mul(f32x4_convert_i32x4(codes), f32x4_splat(1.0 / (1 << 24) as f32));
        let usual = i32x4_add(i32x4_shl(codes, 13), i32x4_splat(112 << 23));
        Self(v128_bitselect(tiny, usual, i32x4_lt(codes, i32x4_splat(1 << 10))))
    }
    #[inline(always)]
    fn codes_f32(from: &[u8; 16]) -> Self {
        Self(bytes(from))
    }
    // The compiler shifts byte by byte in the portable code.
    #[inline(always)]
    fn high_nibbles(from: &[u8; 16]) -> [u8; 16] {
        array(u8x16_shr(bytes(from), 4))
    }
    #[inline(always)]
    fn short_codes(from: &[u8; 16]) -> [u8; 16] {
        array(u8x16_swizzle(bytes(&SHORT_CODES), v128_and(bytes(from), u8x16_splat(15))))
    }
    #[inline(always)]
    fn ordered(from: &[i32; 4]) -> Self {
        let integers = integers(from);
        Self(v128_xor(integers, u32x4_shr(i32x4_shr(integers, 31), 1)))
    }
    #[inline(always)]
    fn divided(from: &[i32; 4], divisor: f64) -> Self {
        let (integers, divisor) = (integers(from), f64x2_splat(divisor));
        let low = f64x2_convert_low_i32x4(integers);
        let high = f64x2_convert_low_i32x4(i64x2_shuffle::<1, 1>(integers, integers));
        let rounded = |doubles| f32x4_demote_f64x2_zero(f64x2_div(doubles, divisor));
        Self(i64x2_shuffle::<0, 2>(rounded(low), rounded(high)))
    }
    #[inline(always)]
    fn mask(bits: u16) -> v128 {
        i32x4_ne(v128_and(i32x4_splat(i32::from(bits)), i32x4(1, 2, 4, 8)), i32x4_splat(0))
    }
    #[inline(always)]
    fn bits_of_four([a, b, c, d]: [v128; 4]) -> u16 {
        i8x16_bitmask(i8x16_narrow_i16x8(i16x8_narrow_i32x4(a, b), i16x8_narrow_i32x4(c, d)))
    }
    #[inline(always)]
    fn prefetch_line(_byte: &u8) {
        // WebAssembly has no prefetch instruction.
    }
}

#[inline(always)]
fn bytes(from: &[u8; 16]) -> v128 {
    // SAFETY: it reads 16 bytes, those of the array.
    unsafe { v128_load(from.as_ptr().cast()) }
}

#[inline(always)]
fn array(bytes: v128) -> [u8; 16] {
    let mut to = [0; 16];
    // SAFETY: it writes 16 bytes, those of the array.
    unsafe { v128_store(to.as_mut_ptr().cast(), bytes) };
    to
}

#[inline(always)]
fn integers(from: &[i32; 4]) -> v128 {
    // SAFETY: it reads 16 bytes, those of the array.
    unsafe { v128_load(from.as_ptr().cast()) }
}
