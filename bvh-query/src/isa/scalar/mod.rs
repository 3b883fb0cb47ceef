//! The portable backend: arrays, one element at a time. It defines the results of the other backends.

use super::corners::Three;
use super::doubles::FourDoubles;
use super::{Isa, Lanes, Part, Task, rows_at};
use bvh_format::ordered::from_ordered;
use bvh_format::quantize::round_step_up;
use bvh_format::slabs::Group;
use bvh_format::treelet::SHORT_CODES;
use half::f16;

/// The token of the portable backend.
#[derive(Clone, Copy)]
pub(crate) struct Scalar;

/// A register of N lanes, as an array.
#[derive(Clone, Copy)]
pub(crate) struct Array<const N: usize>([f32; N]);

impl<const N: usize> Array<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u16 {
        (0..N).fold(0, |bits, i| bits | u16::from(f(self.0[i], other.0[i])) << i)
    }
}

impl<const N: usize> Lanes for Array<N> {
    type Mask = u16;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * factor.0[i] + term.0[i]))
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(std::array::from_fn(|i| term.0[i] - self.0[i] * factor.0[i]))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, other: Self) -> u16 {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u16 {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn select(mask: u16, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| if mask >> i & 1 == 1 { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    fn bits(mask: u16) -> u16 {
        mask
    }
}

impl Isa for Scalar {
    type F32x16 = Array<16>;
    type F32x4 = Array<4>;
    type F64x3 = Three;
    type F64x4 = FourDoubles;
    type Rows<'a> = &'a Group;

    #[inline(always)]
    fn corners(self, from: [f64; 3]) -> Three {
        Three::from(from)
    }
    #[inline(always)]
    fn widen(self, from: &[f32; 4]) -> FourDoubles {
        FourDoubles(from.map(f64::from))
    }
    #[inline(always)]
    fn splat_wide(self, value: f64) -> FourDoubles {
        FourDoubles([value; 4])
    }
    #[inline(always)]
    fn halves(self, low: &[f32; 8], high: &[f32; 8]) -> Array<16> {
        Array(std::array::from_fn(|i| if i < 8 { low[i] } else { high[i - 8] }))
    }
    #[inline(always)]
    fn swap_halves(self, value: Array<16>) -> Array<16> {
        Array(std::array::from_fn(|i| value.0[(i + 8) % 16]))
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Array<16> {
        Array([value; 16])
    }
    #[inline(always)]
    fn load(self, from: &[f32; 16]) -> Array<16> {
        Array(*from)
    }
    #[inline(always)]
    fn store(self, value: Array<16>, to: &mut [f32; 16]) {
        *to = value.0;
    }
    #[inline(always)]
    fn repeat(self, from: &[f32; 4]) -> Array<16> {
        Array(std::array::from_fn(|i| from[i / 4]))
    }
    #[inline(always)]
    fn tile(self, from: &[f32; 4]) -> Array<16> {
        Array(std::array::from_fn(|i| from[i % 4]))
    }
    #[inline(always)]
    fn quads(self, from: [&[f32; 4]; 4]) -> Array<16> {
        Array(std::array::from_fn(|i| from[i / 4][i % 4]))
    }
    #[inline(always)]
    fn quad_splat(self, value: Array<16>, column: usize) -> Array<16> {
        Array(std::array::from_fn(|i| value.0[i / 4 * 4 + column % 4]))
    }
    #[inline(always)]
    fn rows(self, group: &Group) -> &Group {
        group
    }
    #[inline(always)]
    fn pick(self, group: &&Group, _part: Part, places: &[u32; 16]) -> (Array<16>, Array<16>) {
        let [ends, others] = rows_at(group, places);
        (self.quads(ends), self.quads(others))
    }
    #[inline(always)]
    fn round_step_up(self, step: Array<16>) -> Array<16> {
        Array(step.0.map(round_step_up))
    }
    #[inline(always)]
    fn codes_u8(self, from: &[u8; 16]) -> Array<16> {
        Array(from.map(f32::from))
    }
    #[inline(always)]
    fn codes_low(self, from: &[u8; 16]) -> Array<16> {
        Array(from.map(|byte| f32::from(byte & 15)))
    }
    #[inline(always)]
    fn codes_high(self, from: &[u8; 16]) -> Array<16> {
        Array(from.map(|byte| f32::from(byte >> 4)))
    }
    #[inline(always)]
    fn short_codes_low(self, from: &[u8; 16]) -> Array<16> {
        Array(from.map(|byte| f32::from(SHORT_CODES[usize::from(byte & 15)])))
    }
    #[inline(always)]
    fn short_codes_high(self, from: &[u8; 16]) -> Array<16> {
        Array(from.map(|byte| f32::from(SHORT_CODES[usize::from(byte >> 4)])))
    }
    #[inline(always)]
    fn codes_f16(self, from: &[u8; 32]) -> Array<16> {
        Array(std::array::from_fn(|i| f16::from_le_bytes([from[2 * i], from[2 * i + 1]]).to_f32()))
    }
    #[inline(always)]
    fn codes_f32(self, from: &[u8; 64]) -> Array<16> {
        let lane = |i: usize| [from[4 * i], from[4 * i + 1], from[4 * i + 2], from[4 * i + 3]];
        Array(std::array::from_fn(|i| f32::from_le_bytes(lane(i))))
    }
    #[inline(always)]
    fn coordinates(self, integers: &[i32; 16], divisor: Option<f64>) -> Array<16> {
        match divisor {
            None => Array(integers.map(from_ordered)),
            Some(divisor) => Array(integers.map(|integer| (f64::from(integer) / divisor) as f32)),
        }
    }
    #[inline(always)]
    fn permute(self, value: Array<16>, places: &[u8; 16]) -> Array<16> {
        Array(places.map(|place| value.0[usize::from(place & 15)]))
    }
    #[inline(always)]
    fn splat4(self, value: f32) -> Array<4> {
        Array([value; 4])
    }
    #[inline(always)]
    fn load4(self, from: &[f32; 4]) -> Array<4> {
        Array(*from)
    }
    #[inline(always)]
    fn store4(self, value: Array<4>, to: &mut [f32; 4]) {
        *to = value.0;
    }
    #[inline(always)]
    fn prefetch_line(self, _byte: &u8) {
        // Portable code has no prefetch instruction.
    }
    /// Not inlined, as on the other backends: a task that runs tasks would else be compiled with all of them.
    #[inline(never)]
    fn run<T: Task>(self, task: T) -> T::Output {
        task.run(self)
    }
}
