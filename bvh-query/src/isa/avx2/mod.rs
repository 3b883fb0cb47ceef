//! The AVX2 backend: two registers of 8 lanes hold 16 lanes, and an SSE register holds 4.
//!
//! Each use of an intrinsic names its [`Proof`]: a value that exists only where the CPU has been found to have the features.

use super::corners::Corners;
use super::doubles::Doubles;
use super::{Isa, Lanes, Part, Task, halves, rows_at};
use bvh_format::slabs::Group;
use bvh_format::treelet::SHORT_CODES;
use std::arch::x86_64::*;
use std::sync::OnceLock;

/// The token of the AVX2 backend.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

/// Sixteen lanes: 0 to 7 in the first register, 8 to 15 in the second.
#[derive(Clone, Copy)]
pub(crate) struct Y(__m256, __m256);

/// Four lanes.
#[derive(Clone, Copy)]
pub(crate) struct X(__m128);

/// Four lanes of `f64`, for three corners.
#[derive(Clone, Copy)]
pub(crate) struct D(__m256d);

/// A value of this type shows that the CPU has all features of this backend.
///
/// # Safety
/// A value must be made only where there is another proof, or by `detect`, which has found the features.
pub(super) unsafe trait Proof: Copy {}

// SAFETY: only `detect` makes it.
unsafe impl Proof for Avx2 {}
// SAFETY: its registers are private to this file, where each function that makes one has a proof.
unsafe impl Proof for Y {}
// SAFETY: as for `Y`.
unsafe impl Proof for X {}
// SAFETY: as for `Y`. An `Avx512`, with which some are made, is a proof as well.
unsafe impl Proof for D {}

loads! {
    load_four([f32; 4]) -> __m128 = _mm_loadu_ps;
    load_eight([f32; 8]) -> __m256 = _mm256_loadu_ps;
    load_eight_of_bytes([u8; 32]) -> __m256 = _mm256_loadu_ps;
    load_bytes([u8; 16]) -> __m128i = _mm_loadu_si128;
    load_integers([i32; 8]) -> __m256i = _mm256_loadu_si256;
    load_bits([f32; 8]) -> __m256i = _mm256_loadu_si256;
}

stores! {
    store_four(__m128) -> [f32; 4] = _mm_storeu_ps;
    store_eight(__m256) -> [f32; 8] = _mm256_storeu_ps;
    store_doubles(__m256d) -> [f64; 4] = _mm256_storeu_pd;
}

impl Avx2 {
    /// Returns the token if the CPU has AVX2, FMA, F16C, BMI1, BMI2, LZCNT and POPCNT.
    #[inline]
    pub(crate) fn detect() -> Option<Self> {
        static FOUND: OnceLock<Option<Avx2>> = OnceLock::new();
        // One look at what was found before takes less time than seven.
        *FOUND.get_or_init(|| {
            let all = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("f16c")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            all.then_some(Self(()))
        })
    }
}

/// Runs the task with the features enabled, as a function of its own.
#[inline(never)]
#[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt")]
fn run_with_features<T: Task>(isa: Avx2, task: T) -> T::Output {
    task.run(isa)
}

impl Lanes for Y {
    type Mask = Y;

    by_intrinsics! {
        (0, 1)
        add(other) _mm256_add_ps;
        sub(other) _mm256_sub_ps;
        mul(other) _mm256_mul_ps;
        div(other) _mm256_div_ps;
        mul_add(factor, term) _mm256_fmadd_ps;
        neg_mul_add(factor, term) _mm256_fnmadd_ps;
        sqrt() _mm256_sqrt_ps;
        min(other) _mm256_min_ps;
        max(other) _mm256_max_ps;
    }
    #[inline(always)]
    fn abs(self) -> Self {
        with_features!(self, {
            let sign = _mm256_set1_ps(-0.0);
            Self(_mm256_andnot_ps(sign, self.0), _mm256_andnot_ps(sign, self.1))
        })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Y {
        with_features!(
            self,
            Y(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0), _mm256_cmp_ps::<_CMP_LE_OQ>(self.1, other.1))
        )
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Y {
        with_features!(
            self,
            Y(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0), _mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1))
        )
    }
    #[inline(always)]
    fn select(mask: Y, yes: Self, no: Self) -> Self {
        with_features!(yes, Y(_mm256_blendv_ps(no.0, yes.0, mask.0), _mm256_blendv_ps(no.1, yes.1, mask.1)))
    }
    #[inline(always)]
    fn bits(mask: Y) -> u16 {
        with_features!(mask, (_mm256_movemask_ps(mask.0) | _mm256_movemask_ps(mask.1) << 8) as u16)
    }
}

impl Lanes for X {
    type Mask = X;

    by_intrinsics! {
        (0)
        add(other) _mm_add_ps;
        sub(other) _mm_sub_ps;
        mul(other) _mm_mul_ps;
        div(other) _mm_div_ps;
        mul_add(factor, term) _mm_fmadd_ps;
        neg_mul_add(factor, term) _mm_fnmadd_ps;
        sqrt() _mm_sqrt_ps;
        min(other) _mm_min_ps;
        max(other) _mm_max_ps;
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(with_features!(self, _mm_andnot_ps(_mm_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> X {
        X(with_features!(self, _mm_cmple_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> X {
        X(with_features!(self, _mm_cmplt_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn select(mask: X, yes: Self, no: Self) -> Self {
        Self(with_features!(yes, _mm_blendv_ps(no.0, yes.0, mask.0)))
    }
    #[inline(always)]
    fn bits(mask: X) -> u16 {
        with_features!(mask, _mm_movemask_ps(mask.0) as u16)
    }
}

impl D {
    /// Makes a register of three numbers.
    #[inline(always)]
    pub(super) fn new(proof: impl Proof, [x, y, z]: [f64; 3]) -> Self {
        Self(with_features!(proof, _mm256_setr_pd(x, y, z, z)))
    }

    /// Makes a register of four numbers.
    #[inline(always)]
    pub(super) fn widen(proof: impl Proof, from: &[f32; 4]) -> Self {
        let four = load_four(proof, from);
        Self(with_features!(proof, _mm256_cvtps_pd(four)))
    }

    /// Makes a register of one number.
    #[inline(always)]
    pub(super) fn splat(proof: impl Proof, value: f64) -> Self {
        Self(with_features!(proof, _mm256_set1_pd(value)))
    }
}

impl Doubles for D {
    by_intrinsics! {
        (0)
        sub(other) _mm256_sub_pd;
        mul(other) _mm256_mul_pd;
        min(other) _mm256_min_pd;
        max(other) _mm256_max_pd;
    }
    #[inline(always)]
    fn bits_below(self, other: Self) -> u16 {
        with_features!(self, _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)) as u16)
    }
}

impl Corners for D {
    type Mask = D;

    by_intrinsics! {
        (0)
        add(other) _mm256_add_pd;
        sub(other) _mm256_sub_pd;
        mul(other) _mm256_mul_pd;
        div(other) _mm256_div_pd;
        min(other) _mm256_min_pd;
        max(other) _mm256_max_pd;
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(with_features!(self, _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> D {
        Self(with_features!(self, _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn and(mask: D, other: D) -> D {
        Self(with_features!(mask, _mm256_and_pd(mask.0, other.0)))
    }
    #[inline(always)]
    fn select(mask: D, yes: Self, no: Self) -> Self {
        Self(with_features!(yes, _mm256_blendv_pd(no.0, yes.0, mask.0)))
    }
    #[inline(always)]
    fn of(&self, corner: usize) -> f64 {
        const { assert!(size_of::<__m256d>() == size_of::<[f64; 4]>()) };
        let lanes = std::ptr::from_ref(&self.0).cast::<[f64; 4]>();
        // SAFETY: a register in memory is its lanes, one after another, and aligned to more than they are.
        unsafe { (*lanes)[corner & 3] }
    }
    #[inline(always)]
    fn all(self) -> [f64; 3] {
        let mut lanes = [0.0; 4];
        store_doubles(self, self.0, &mut lanes);
        let [x, y, z, _] = lanes;
        [x, y, z]
    }
}

impl Isa for Avx2 {
    type F32x16 = Y;
    type F32x4 = X;
    type F64x3 = D;
    type F64x4 = D;
    type Rows<'a> = &'a Group;

    #[inline(always)]
    fn corners(self, from: [f64; 3]) -> D {
        D::new(self, from)
    }
    #[inline(always)]
    fn widen(self, from: &[f32; 4]) -> D {
        D::widen(self, from)
    }
    #[inline(always)]
    fn splat_wide(self, value: f64) -> D {
        D::splat(self, value)
    }
    #[inline(always)]
    fn halves(self, low: &[f32; 8], high: &[f32; 8]) -> Y {
        Y(load_eight(self, low), load_eight(self, high))
    }
    #[inline(always)]
    fn swap_halves(self, value: Y) -> Y {
        Y(value.1, value.0)
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Y {
        with_features!(self, Y(_mm256_set1_ps(value), _mm256_set1_ps(value)))
    }
    #[inline(always)]
    fn load(self, from: &[f32; 16]) -> Y {
        let [low, high] = halves(from);
        Y(load_eight(self, low), load_eight(self, high))
    }
    #[inline(always)]
    fn store(self, value: Y, to: &mut [f32; 16]) {
        let ([low, high], []) = to.as_chunks_mut() else { unreachable!("two halves") };
        store_eight(self, value.0, low);
        store_eight(self, value.1, high);
    }
    #[inline(always)]
    fn repeat(self, from: &[f32; 4]) -> Y {
        let four = load_four(self, from);
        with_features!(self, {
            let both = _mm256_broadcast_ps(&four);
            let low = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
            let high = _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3);
            Y(permute_in_halves(both, low), permute_in_halves(both, high))
        })
    }
    #[inline(always)]
    fn tile(self, from: &[f32; 4]) -> Y {
        let four = load_four(self, from);
        let both = with_features!(self, _mm256_broadcast_ps(&four));
        Y(both, both)
    }
    #[inline(always)]
    fn quads(self, from: [&[f32; 4]; 4]) -> Y {
        let [a, b, c, d] =
            [self.load4(from[0]), self.load4(from[1]), self.load4(from[2]), self.load4(from[3])];
        with_features!(self, Y(_mm256_set_m128(b.0, a.0), _mm256_set_m128(d.0, c.0)))
    }
    #[inline(always)]
    fn quad_splat(self, value: Y, column: usize) -> Y {
        with_features!(self, {
            let places = _mm256_set1_epi32(column as i32);
            Y(_mm256_permutevar_ps(value.0, places), _mm256_permutevar_ps(value.1, places))
        })
    }
    #[inline(always)]
    fn rows(self, group: &Group) -> &Group {
        group
    }
    #[inline(always)]
    fn pick(self, group: &&Group, _part: Part, places: &[u32; 16]) -> (Y, Y) {
        let [ends, others] = rows_at(group, places);
        (self.quads(ends), self.quads(others))
    }
    #[inline(always)]
    fn round_step_up(self, step: Y) -> Y {
        with_features!(self, Y(round_up_half_register(step.0), round_up_half_register(step.1)))
    }
    #[inline(always)]
    fn codes_u8(self, from: &[u8; 16]) -> Y {
        let bytes = load_bytes(self, from);
        with_features!(self, bytes_to_lanes(bytes))
    }
    #[inline(always)]
    fn codes_low(self, from: &[u8; 16]) -> Y {
        let bytes = load_bytes(self, from);
        with_features!(self, bytes_to_lanes(_mm_and_si128(bytes, _mm_set1_epi8(15))))
    }
    #[inline(always)]
    fn codes_high(self, from: &[u8; 16]) -> Y {
        let bytes = load_bytes(self, from);
        with_features!(self, {
            let bytes = _mm_srli_epi16::<4>(bytes);
            bytes_to_lanes(_mm_and_si128(bytes, _mm_set1_epi8(15)))
        })
    }
    #[inline(always)]
    fn short_codes_low(self, from: &[u8; 16]) -> Y {
        let bytes = load_bytes(self, from);
        with_features!(self, bytes_to_lanes(short_codes(bytes)))
    }
    #[inline(always)]
    fn short_codes_high(self, from: &[u8; 16]) -> Y {
        let bytes = load_bytes(self, from);
        with_features!(self, bytes_to_lanes(short_codes(_mm_srli_epi16::<4>(bytes))))
    }
    #[inline(always)]
    fn codes_f16(self, from: &[u8; 32]) -> Y {
        let [low, high] = halves(from);
        let (low, high) = (load_bytes(self, low), load_bytes(self, high));
        with_features!(self, Y(_mm256_cvtph_ps(low), _mm256_cvtph_ps(high)))
    }
    #[inline(always)]
    fn codes_f32(self, from: &[u8; 64]) -> Y {
        let [low, high] = halves(from);
        Y(load_eight_of_bytes(self, low), load_eight_of_bytes(self, high))
    }
    #[inline(always)]
    fn coordinates(self, integers: &[i32; 16], divisor: Option<f64>) -> Y {
        let [low, high] = halves(integers);
        Y(coordinates_of_eight(self, low, divisor), coordinates_of_eight(self, high, divisor))
    }
    #[inline(always)]
    fn permute(self, value: Y, places: &[u8; 16]) -> Y {
        let places = load_bytes(self, places);
        with_features!(self, {
            Y(pick_eight(value, places), pick_eight(value, _mm_unpackhi_epi64(places, places)))
        })
    }
    #[inline(always)]
    fn splat4(self, value: f32) -> X {
        X(with_features!(self, _mm_set1_ps(value)))
    }
    #[inline(always)]
    fn load4(self, from: &[f32; 4]) -> X {
        X(load_four(self, from))
    }
    #[inline(always)]
    fn store4(self, value: X, to: &mut [f32; 4]) {
        store_four(self, value.0, to);
    }
    #[inline(always)]
    fn least(self, of: &[f32; 16], mask: u16) -> u32 {
        let [low_of, high_of] = halves(of);
        let (first, last) = (load_eight(self, low_of), load_eight(self, high_of));
        with_features!(self, {
            // All ones in the lanes whose bits are set.
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let lanes = |mask: u16| {
                let mask = _mm256_and_si256(_mm256_set1_epi32(i32::from(mask)), bits);
                _mm256_castsi256_ps(_mm256_cmpeq_epi32(mask, bits))
            };
            let (low, high) = (lanes(mask & 0xff), lanes(mask >> 8));
            let infinity = _mm256_set1_ps(f32::INFINITY);
            let first = _mm256_blendv_ps(infinity, first, low);
            let last = _mm256_blendv_ps(infinity, last, high);
            let least = _mm256_min_ps(first, last);
            let least = _mm256_min_ps(least, _mm256_permute2f128_ps::<1>(least, least));
            let least = _mm256_min_ps(least, _mm256_shuffle_ps::<0b01_00_11_10>(least, least));
            let least = _mm256_min_ps(least, _mm256_shuffle_ps::<0b10_11_00_01>(least, least));
            let equal_low = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(first, least)) as u32;
            let equal_high = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(last, least)) as u32;
            (u32::from(mask) & (equal_low | equal_high << 8)).trailing_zeros()
        })
    }
    #[inline(always)]
    fn nearest(self, of: &[f32; 16], mask: u16) -> i32 {
        let [first, last] = halves(of);
        let (first, last) = (load_bits(self, first), load_bits(self, last));
        with_features!(self, {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let first = keys(self, first, lanes, mask & 0xff);
            let lanes = _mm256_setr_epi32(8, 9, 10, 11, 12, 13, 14, 15);
            let last = keys(self, last, lanes, mask >> 8);
            let half = _mm256_min_epi32(first, last);
            let four = _mm_min_epi32(_mm256_castsi256_si128(half), _mm256_extracti128_si256::<1>(half));
            let two = _mm_min_epi32(four, _mm_shuffle_epi32::<0b01_00_11_10>(four));
            let one = _mm_min_epi32(two, _mm_shuffle_epi32::<0b10_11_00_01>(two));
            _mm_cvtsi128_si32(one)
        })
    }
    #[inline(always)]
    fn prefetch_line(self, byte: &u8) {
        // SAFETY: the hint changes nothing, wherever it points, and every CPU of this kind has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(byte).cast()) };
    }
    fn run<T: Task>(self, task: T) -> T::Output {
        // SAFETY: `self` shows that the CPU has the features that the function enables.
        unsafe { run_with_features(self, task) }
    }
}

/// Permutes the lanes of each half, as `_mm256_permutevar_ps` does. Compilers replace that one by slower shuffles across the
/// halves if they know the places.
#[inline]
#[target_feature(enable = "avx2")]
fn permute_in_halves(value: __m256, places: __m256i) -> __m256 {
    let permuted;
    // SAFETY: The instruction needs AVX, which the function enables. It reads and writes registers only.
    unsafe {
        std::arch::asm!(
            "vpermilps {}, {}, {}",
            out(ymm_reg) permuted, in(ymm_reg) value, in(ymm_reg) places,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    permuted
}

/// Rounds each step up to 16 significant bits.
#[inline]
#[target_feature(enable = "avx2")]
fn round_up_half_register(step: __m256) -> __m256 {
    let bits = _mm256_add_epi32(_mm256_castps_si256(step), _mm256_set1_epi32(0xff));
    _mm256_castsi256_ps(_mm256_and_si256(bits, _mm256_set1_epi32(!0xff)))
}

/// The codes for which the low nibbles of sixteen bytes of a short treelet stand.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn short_codes(bytes: __m128i) -> __m128i {
    let table = _mm_set_epi64x(
        i64::from_le_bytes(*SHORT_CODES.last_chunk().expect("16 codes")),
        i64::from_le_bytes(*SHORT_CODES.first_chunk().expect("16 codes")),
    );
    _mm_shuffle_epi8(table, _mm_and_si128(bytes, _mm_set1_epi8(15)))
}

/// Converts sixteen bytes to lanes.
#[inline]
#[target_feature(enable = "avx2")]
fn bytes_to_lanes(bytes: __m128i) -> Y {
    let low = _mm256_cvtepu8_epi32(bytes);
    let high = _mm256_cvtepu8_epi32(_mm_srli_si128::<8>(bytes));
    Y(_mm256_cvtepi32_ps(low), _mm256_cvtepi32_ps(high))
}

/// The lanes of a value at the places in the first eight bytes of `places`.
#[inline(always)]
fn pick_eight(value: Y, places: __m128i) -> __m256 {
    with_features!(value, {
        let places = _mm256_cvtepu8_epi32(places);
        let low = _mm256_permutevar8x32_ps(value.0, places);
        let high = _mm256_permutevar8x32_ps(value.1, places);
        // Bit 3 of a place chooses the register. The blend looks at signs.
        _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32::<28>(places)))
    })
}

/// What `coordinates` returns for eight integers.
#[inline(always)]
fn coordinates_of_eight(isa: Avx2, integers: &[i32; 8], divisor: Option<f64>) -> __m256 {
    let integers = load_integers(isa, integers);
    with_features!(isa, {
        match divisor {
            None => {
                let inverted = _mm256_srli_epi32::<1>(_mm256_srai_epi32::<31>(integers));
                _mm256_castsi256_ps(_mm256_xor_si256(integers, inverted))
            }
            Some(divisor) => {
                let divisor = _mm256_set1_pd(divisor);
                let low = _mm256_cvtepi32_pd(_mm256_castsi256_si128(integers));
                let high = _mm256_cvtepi32_pd(_mm256_extracti128_si256::<1>(integers));
                let low = _mm256_cvtpd_ps(_mm256_div_pd(low, divisor));
                _mm256_set_m128(_mm256_cvtpd_ps(_mm256_div_pd(high, divisor)), low)
            }
        }
    })
}

/// The keys of `nearest` for eight numbers, the largest integer where bits are not set.
#[inline(always)]
fn keys(isa: Avx2, bits: __m256i, lanes: __m256i, mask: u16) -> __m256i {
    with_features!(isa, {
        let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let sign = _mm256_srli_epi32::<1>(_mm256_srai_epi32::<31>(bits));
        let keys = _mm256_and_si256(_mm256_xor_si256(bits, sign), _mm256_set1_epi32(!15));
        let keys = _mm256_or_si256(keys, lanes);
        let chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(i32::from(mask)), bit), bit);
        _mm256_blendv_epi8(_mm256_set1_epi32(i32::MAX), keys, chosen)
    })
}
