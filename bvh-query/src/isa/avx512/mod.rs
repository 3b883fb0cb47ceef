//! The AVX-512 backend: one register holds 16 lanes, and an SSE register holds 4.
//!
//! Each use of an intrinsic names its [`Proof`]: a value that exists only where the CPU has been found to have the features.

use super::avx2::{self, D, short_codes};
use super::{Isa, Lanes, Part, Task};
use bvh_format::slabs::Group;
use std::arch::x86_64::*;

/// The token of the AVX-512 backend.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(());

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub(crate) struct Z(__m512);

/// Four lanes.
#[derive(Clone, Copy)]
pub(crate) struct X(__m128);

/// A value of this type shows that the CPU has all features of this backend.
///
/// # Safety
/// A value must be made only where there is another proof, or by `detect`, which has found the features.
unsafe trait Proof: Copy {}

// SAFETY: only `detect` makes it.
unsafe impl Proof for Avx512 {}
// SAFETY: its register is private to this file, where each function that makes one has a proof.
unsafe impl Proof for Z {}
// SAFETY: as for `Z`.
unsafe impl Proof for X {}
// SAFETY: only `detect` makes it, which has found all features of the other backend, too.
unsafe impl avx2::Proof for Avx512 {}

loads! {
    load_four([f32; 4]) -> __m128 = _mm_loadu_ps;
    load_eight([f32; 8]) -> __m256 = _mm256_loadu_ps;
    load_sixteen([f32; 16]) -> __m512 = _mm512_loadu_ps;
    load_sixteen_of_bytes([u8; 64]) -> __m512 = _mm512_loadu_ps;
    load_bytes([u8; 16]) -> __m128i = _mm_loadu_si128;
    load_halves([u8; 32]) -> __m256i = _mm256_loadu_si256;
    load_integers([i32; 16]) -> __m512i = _mm512_loadu_si512;
    load_words([u32; 16]) -> __m512i = _mm512_loadu_si512;
    load_bits([f32; 16]) -> __m512i = _mm512_loadu_si512;
}

stores! {
    store_four(__m128) -> [f32; 4] = _mm_storeu_ps;
    store_sixteen(__m512) -> [f32; 16] = _mm512_storeu_ps;
    store_words(__m512i) -> [u32; 16] = _mm512_storeu_si512;
}

impl Avx512 {
    /// Returns the token if the CPU has AVX-512 F, VL, DQ and BW, AVX2, FMA, F16C, BMI1, BMI2, LZCNT and
    /// POPCNT.
    #[inline]
    pub(crate) fn detect() -> Option<Self> {
        let all = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("f16c")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        all.then_some(Self(()))
    }
}

/// Runs the task with the features enabled, as a function of its own.
#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt")]
fn run_with_features<T: Task>(isa: Avx512, task: T) -> T::Output {
    task.run(isa)
}

impl Lanes for Z {
    type Mask = __mmask16;

    by_intrinsics! {
        (0)
        add(other) _mm512_add_ps;
        sub(other) _mm512_sub_ps;
        mul(other) _mm512_mul_ps;
        div(other) _mm512_div_ps;
        mul_add(factor, term) _mm512_fmadd_ps;
        neg_mul_add(factor, term) _mm512_fnmadd_ps;
        sqrt() _mm512_sqrt_ps;
        min(other) _mm512_min_ps;
        max(other) _mm512_max_ps;
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(with_features!(self, _mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> __mmask16 {
        with_features!(self, _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> __mmask16 {
        with_features!(self, _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: __mmask16, yes: Self, no: Self) -> Self {
        Self(with_features!(yes, _mm512_mask_blend_ps(mask, no.0, yes.0)))
    }
    #[inline(always)]
    fn bits(mask: __mmask16) -> u16 {
        mask
    }
}

impl Lanes for X {
    type Mask = __mmask8;

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
    fn le(self, other: Self) -> __mmask8 {
        with_features!(self, _mm_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> __mmask8 {
        with_features!(self, _mm_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: __mmask8, yes: Self, no: Self) -> Self {
        Self(with_features!(yes, _mm_mask_blend_ps(mask, no.0, yes.0)))
    }
    #[inline(always)]
    fn bits(mask: __mmask8) -> u16 {
        u16::from(mask)
    }
}

impl Isa for Avx512 {
    type F32x16 = Z;
    type F32x4 = X;
    type F64x3 = D;
    type F64x4 = D;
    /// The lower and upper ends of four sets of slabs: the axes, the cube's diagonals, and two halves of its faces'
    /// diagonals.
    type Rows<'a> = [[Z; 2]; 4];

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
    fn halves(self, low: &[f32; 8], high: &[f32; 8]) -> Z {
        let (low, high) = (load_eight(self, low), load_eight(self, high));
        Z(with_features!(self, _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)))
    }
    #[inline(always)]
    fn swap_halves(self, value: Z) -> Z {
        Z(with_features!(self, _mm512_shuffle_f32x4::<0b01_00_11_10>(value.0, value.0)))
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Z {
        Z(with_features!(self, _mm512_set1_ps(value)))
    }
    #[inline(always)]
    fn load(self, from: &[f32; 16]) -> Z {
        Z(load_sixteen(self, from))
    }
    #[inline(always)]
    fn store(self, value: Z, to: &mut [f32; 16]) {
        store_sixteen(self, value.0, to)
    }
    #[inline(always)]
    fn repeat(self, from: &[f32; 4]) -> Z {
        let four = load_four(self, from);
        Z(with_features!(self, {
            let each = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            _mm512_permutexvar_ps(each, _mm512_castps128_ps512(four))
        }))
    }
    #[inline(always)]
    fn tile(self, from: &[f32; 4]) -> Z {
        let four = load_four(self, from);
        Z(with_features!(self, _mm512_broadcast_f32x4(four)))
    }
    #[inline(always)]
    fn quads(self, from: [&[f32; 4]; 4]) -> Z {
        let [a, b, c, d] = [
            load_four(self, from[0]),
            load_four(self, from[1]),
            load_four(self, from[2]),
            load_four(self, from[3]),
        ];
        Z(with_features!(self, {
            let (low, high) = (_mm256_set_m128(b, a), _mm256_set_m128(d, c));
            _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)
        }))
    }
    #[inline(always)]
    fn quad_splat(self, value: Z, column: usize) -> Z {
        Z(with_features!(self, _mm512_permutevar_ps(value.0, _mm512_set1_epi32(column as i32))))
    }
    #[inline(always)]
    fn rows(self, group: &Group) -> [[Z; 2]; 4] {
        let (lo, hi) = (&group.lo, &group.hi);
        let axes = [self.load(&lo[0]), self.load(&hi[0])];
        let cube = [straddle(axes[0], self.load(&lo[1])), straddle(axes[1], self.load(&hi[1]))];
        let faces = [self.load(&lo[2]), self.load(&hi[2])];
        [axes, cube, faces, [self.load(&lo[3]), self.load(&hi[3])]]
    }
    /// Element `4 * i + j` is four times the place of row i in its part, plus j.
    #[inline(always)]
    fn places(self, rows: &[u32; 16], to: &mut [[u32; 16]; 4]) {
        let rows = load_words(self, rows);
        // (rows >> 3) & 60
        let firsts =
            with_features!(self, _mm512_and_si512(_mm512_srli_epi32::<3>(rows), _mm512_set1_epi32(60)));
        for (four, to) in to.iter_mut().enumerate() {
            let places = with_features!(self, {
                let of = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
                let of = _mm512_or_si512(of, _mm512_set1_epi32(4 * four as i32));
                let lanes = _mm512_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3);
                _mm512_or_si512(_mm512_permutexvar_epi32(of, firsts), lanes)
            });
            store_words(self, places, to);
        }
    }
    #[inline(always)]
    fn pick(self, [axes, cube, faces, more]: &[[Z; 2]; 4], part: Part, at: &[u32; 16]) -> (Z, Z) {
        match part {
            Part::Axes => self.pick_of(axes, at),
            Part::Cube => self.pick_of(cube, at),
            Part::Faces => {
                let words = load_words(self, at);
                let is_more = with_features!(self, _mm512_test_epi32_mask(words, _mm512_set1_epi32(32)));
                let ((end, other), (end_2, other_2)) = (self.pick_of(faces, at), self.pick_of(more, at));
                (Z::select(is_more, end_2, end), Z::select(is_more, other_2, other))
            }
        }
    }
    #[inline(always)]
    fn round_step_up(self, step: Z) -> Z {
        Z(with_features!(self, {
            let bits = _mm512_add_epi32(_mm512_castps_si512(step.0), _mm512_set1_epi32(0xff));
            _mm512_castsi512_ps(_mm512_and_si512(bits, _mm512_set1_epi32(!0xff)))
        }))
    }
    #[inline(always)]
    fn codes_u8(self, from: &[u8; 16]) -> Z {
        let bytes = load_bytes(self, from);
        Z(with_features!(self, _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(bytes))))
    }
    #[inline(always)]
    fn codes_low(self, from: &[u8; 16]) -> Z {
        let bytes = load_bytes(self, from);
        Z(with_features!(
            self,
            _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_and_si128(bytes, _mm_set1_epi8(15))))
        ))
    }
    #[inline(always)]
    fn codes_high(self, from: &[u8; 16]) -> Z {
        let bytes = load_bytes(self, from);
        Z(with_features!(self, {
            let bytes = _mm_srli_epi16::<4>(bytes);
            _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_and_si128(bytes, _mm_set1_epi8(15))))
        }))
    }
    #[inline(always)]
    fn short_codes_low(self, from: &[u8; 16]) -> Z {
        let bytes = load_bytes(self, from);
        Z(with_features!(self, _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(short_codes(bytes)))))
    }
    #[inline(always)]
    fn short_codes_high(self, from: &[u8; 16]) -> Z {
        let bytes = load_bytes(self, from);
        Z(with_features!(self, {
            let bytes = _mm_srli_epi16::<4>(bytes);
            _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(short_codes(bytes)))
        }))
    }
    #[inline(always)]
    fn codes_f16(self, from: &[u8; 32]) -> Z {
        let halves = load_halves(self, from);
        Z(with_features!(self, _mm512_cvtph_ps(halves)))
    }
    #[inline(always)]
    fn codes_f32(self, from: &[u8; 64]) -> Z {
        Z(load_sixteen_of_bytes(self, from))
    }
    #[inline(always)]
    fn coordinates(self, integers: &[i32; 16], divisor: Option<f64>) -> Z {
        let integers = load_integers(self, integers);
        with_features!(self, {
            let low = coordinates_of_eight(self, _mm512_castsi512_si256(integers), divisor);
            let high = coordinates_of_eight(self, _mm512_extracti64x4_epi64::<1>(integers), divisor);
            Z(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
        })
    }
    #[inline(always)]
    fn permute(self, value: Z, places: &[u8; 16]) -> Z {
        let places = load_bytes(self, places);
        Z(with_features!(self, _mm512_permutexvar_ps(_mm512_cvtepu8_epi32(places), value.0)))
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
        let of = load_sixteen(self, of);
        with_features!(self, {
            let least = _mm512_mask_reduce_min_ps(mask, of);
            _mm512_mask_cmp_ps_mask::<_CMP_EQ_OQ>(mask, of, _mm512_set1_ps(least)).trailing_zeros()
        })
    }
    #[inline(always)]
    fn nearest(self, of: &[f32; 16], mask: u16) -> i32 {
        let bits = load_bits(self, of);
        with_features!(self, {
            let sign = _mm512_srli_epi32::<1>(_mm512_srai_epi32::<31>(bits));
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            // (bits ^ sign) & !15 | lanes
            let keys = _mm512_xor_si512(bits, sign);
            let keys = _mm512_ternarylogic_epi32::<0xec>(keys, lanes, _mm512_set1_epi32(!15));
            let keys = _mm512_mask_blend_epi32(mask, _mm512_set1_epi32(i32::MAX), keys);
            let half = _mm256_min_epi32(_mm512_castsi512_si256(keys), _mm512_extracti64x4_epi64::<1>(keys));
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

/// Returns the last four lanes of the first register, followed by the first twelve of the second.
#[inline(always)]
fn straddle(first: Z, second: Z) -> Z {
    Z(with_features!(first, {
        let (first, second) = (_mm512_castps_si512(first.0), _mm512_castps_si512(second.0));
        _mm512_castsi512_ps(_mm512_alignr_epi32::<12>(second, first))
    }))
}

impl Avx512 {
    /// Returns the elements of two registers at the places `at`, and those at the same places with the registers
    /// exchanged.
    #[inline(always)]
    fn pick_of(self, [lo, hi]: &[Z; 2], at: &[u32; 16]) -> (Z, Z) {
        let at = load_words(self, at);
        with_features!(self, {
            (Z(_mm512_permutex2var_ps(lo.0, at, hi.0)), Z(_mm512_permutex2var_ps(hi.0, at, lo.0)))
        })
    }
}

/// What `coordinates` returns for eight integers.
#[inline(always)]
fn coordinates_of_eight(isa: Avx512, integers: __m256i, divisor: Option<f64>) -> __m256 {
    with_features!(
        isa,
        match divisor {
            None => {
                let inverted = _mm256_srli_epi32::<1>(_mm256_srai_epi32::<31>(integers));
                _mm256_castsi256_ps(_mm256_xor_si256(integers, inverted))
            }
            Some(divisor) => {
                let divisor = _mm512_set1_pd(divisor);
                _mm512_cvtpd_ps(_mm512_div_pd(_mm512_cvtepi32_pd(integers), divisor))
            }
        }
    )
}
