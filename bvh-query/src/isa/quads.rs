//! Sixteen lanes in four registers of four, for CPUs whose registers have 128 bits. A backend states what is done to one
//! register; the rest follows.

use super::corners::Three;
use super::doubles::FourDoubles;
use super::{Isa, Lanes, Part, Task, in_order, rows_at};
use bvh_format::slabs::Group;
use std::marker::PhantomData;

/// A register of four lanes, and what the sixteen are made of.
pub(crate) trait Quad: Lanes {
    fn splat(value: f32) -> Self;
    fn load(from: &[f32; 4]) -> Self;
    fn store(self, to: &mut [f32; 4]);
    /// Every lane is this one; `lane` is taken modulo 4.
    fn splat_lane(self, lane: usize) -> Self;
    /// Applies `bvh_format::quantize::round_step_up` to each lane.
    fn round_step_up(self) -> Self;
    /// Reads sixteen codes of one byte each.
    fn codes_u8(from: &[u8; 16]) -> Four<Self>;
    /// Reads four little-endian `f16`.
    fn codes_f16(from: &[u8; 8]) -> Self;
    /// Reads four little-endian `f32`.
    fn codes_f32(from: &[u8; 16]) -> Self;
    /// The high halves of bytes.
    #[inline(always)]
    fn high_nibbles(from: &[u8; 16]) -> [u8; 16] {
        from.map(|byte| byte >> 4)
    }
    /// The codes of a short treelet for which the low nibbles of sixteen bytes stand.
    fn short_codes(from: &[u8; 16]) -> [u8; 16];
    /// The `f32` for which ordered integers stand.
    fn ordered(from: &[i32; 4]) -> Self;
    /// Integers times a unit, each rounded once.
    fn divided(from: &[i32; 4], divisor: f64) -> Self;
    /// The mask of four lanes whose bits are set.
    fn mask(bits: u16) -> Self::Mask;
    /// The masks of sixteen lanes as bits.
    #[inline(always)]
    fn bits_of_four(masks: [Self::Mask; 4]) -> u16 {
        let [a, b, c, d] = masks;
        Self::bits(a) | Self::bits(b) << 4 | Self::bits(c) << 8 | Self::bits(d) << 12
    }
    /// Lane i is lane `places[i]`, modulo 16, of `value`.
    #[inline(always)]
    fn permute(value: Four<Self>, places: &[u8; 16]) -> Four<Self> {
        let isa = Quads::<Self>::NEW;
        let mut lanes = [0.0; 16];
        isa.store(value, &mut lanes);
        isa.load(&places.map(|place| lanes[usize::from(place & 15)]))
    }
    /// Prefetches the cache line of a byte that will soon be read.
    fn prefetch_line(byte: &u8);
}

/// Sixteen lanes, four in each register.
#[derive(Clone, Copy)]
pub(crate) struct Four<Q>(pub(crate) Q, pub(crate) Q, pub(crate) Q, pub(crate) Q);

/// Defines methods of `Lanes` register by register.
macro_rules! by_registers {
    ($($name:ident($($other:ident),*);)+) => {
        $(#[inline(always)]
        fn $name(self, $($other: Self),*) -> Self {
            Self(
                self.0.$name($($other.0),*),
                self.1.$name($($other.1),*),
                self.2.$name($($other.2),*),
                self.3.$name($($other.3),*),
            )
        })+
    };
}

impl<Q: Quad> Lanes for Four<Q> {
    type Mask = [Q::Mask; 4];

    by_registers! {
        add(other);
        sub(other);
        mul(other);
        div(other);
        mul_add(factor, term);
        neg_mul_add(factor, term);
        sqrt();
        abs();
        min(other);
        max(other);
        max_of_numbers(other);
    }
    #[inline(always)]
    fn le(self, other: Self) -> [Q::Mask; 4] {
        [self.0.le(other.0), self.1.le(other.1), self.2.le(other.2), self.3.le(other.3)]
    }
    #[inline(always)]
    fn lt(self, other: Self) -> [Q::Mask; 4] {
        [self.0.lt(other.0), self.1.lt(other.1), self.2.lt(other.2), self.3.lt(other.3)]
    }
    #[inline(always)]
    fn select([a, b, c, d]: [Q::Mask; 4], yes: Self, no: Self) -> Self {
        Self(
            Q::select(a, yes.0, no.0),
            Q::select(b, yes.1, no.1),
            Q::select(c, yes.2, no.2),
            Q::select(d, yes.3, no.3),
        )
    }
    #[inline(always)]
    fn bits(masks: [Q::Mask; 4]) -> u16 {
        Q::bits_of_four(masks)
    }
}

/// The token of a backend whose registers have four lanes. Its instructions are part of the target.
pub(crate) struct Quads<Q>(PhantomData<Q>);

impl<Q> Quads<Q> {
    pub(crate) const NEW: Self = Self(PhantomData);
}

impl<Q> Clone for Quads<Q> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<Q> Copy for Quads<Q> {}

impl<Q: Quad> Isa for Quads<Q> {
    type F32x16 = Four<Q>;
    type F32x4 = Q;
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
    fn halves(self, low: &[f32; 8], high: &[f32; 8]) -> Four<Q> {
        let ([a, b], [c, d]) = (pair(low), pair(high));
        Four(Q::load(a), Q::load(b), Q::load(c), Q::load(d))
    }
    #[inline(always)]
    fn swap_halves(self, value: Four<Q>) -> Four<Q> {
        Four(value.2, value.3, value.0, value.1)
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Four<Q> {
        let each = Q::splat(value);
        Four(each, each, each, each)
    }
    #[inline(always)]
    fn load(self, from: &[f32; 16]) -> Four<Q> {
        let [a, b, c, d] = quarters(from);
        self.quads([a, b, c, d])
    }
    #[inline(always)]
    fn store(self, value: Four<Q>, to: &mut [f32; 16]) {
        if let [a, b, c, d] = to.as_chunks_mut::<4>().0 {
            value.0.store(a);
            value.1.store(b);
            value.2.store(c);
            value.3.store(d);
        }
    }
    #[inline(always)]
    fn repeat(self, from: &[f32; 4]) -> Four<Q> {
        let all = Q::load(from);
        Four(all.splat_lane(0), all.splat_lane(1), all.splat_lane(2), all.splat_lane(3))
    }
    #[inline(always)]
    fn tile(self, from: &[f32; 4]) -> Four<Q> {
        let each = Q::load(from);
        Four(each, each, each, each)
    }
    #[inline(always)]
    fn quads(self, [a, b, c, d]: [&[f32; 4]; 4]) -> Four<Q> {
        Four(Q::load(a), Q::load(b), Q::load(c), Q::load(d))
    }
    #[inline(always)]
    fn quad_splat(self, value: Four<Q>, column: usize) -> Four<Q> {
        Four(
            value.0.splat_lane(column),
            value.1.splat_lane(column),
            value.2.splat_lane(column),
            value.3.splat_lane(column),
        )
    }
    #[inline(always)]
    fn rows(self, group: &Group) -> &Group {
        group
    }
    #[inline(always)]
    fn pick(self, group: &&Group, _part: Part, places: &[u32; 16]) -> (Four<Q>, Four<Q>) {
        let [ends, others] = rows_at(group, places);
        (self.quads(ends), self.quads(others))
    }
    #[inline(always)]
    fn round_step_up(self, step: Four<Q>) -> Four<Q> {
        Four(step.0.round_step_up(), step.1.round_step_up(), step.2.round_step_up(), step.3.round_step_up())
    }
    #[inline(always)]
    fn codes_u8(self, from: &[u8; 16]) -> Four<Q> {
        Q::codes_u8(from)
    }
    #[inline(always)]
    fn codes_low(self, from: &[u8; 16]) -> Four<Q> {
        Q::codes_u8(&from.map(|byte| byte & 15))
    }
    #[inline(always)]
    fn codes_high(self, from: &[u8; 16]) -> Four<Q> {
        Q::codes_u8(&Q::high_nibbles(from))
    }
    #[inline(always)]
    fn short_codes_low(self, from: &[u8; 16]) -> Four<Q> {
        Q::codes_u8(&Q::short_codes(from))
    }
    #[inline(always)]
    fn short_codes_high(self, from: &[u8; 16]) -> Four<Q> {
        Q::codes_u8(&Q::short_codes(&Q::high_nibbles(from)))
    }
    #[inline(always)]
    fn codes_f16(self, from: &[u8; 32]) -> Four<Q> {
        let [a, b, c, d] = quarters(from);
        Four(Q::codes_f16(a), Q::codes_f16(b), Q::codes_f16(c), Q::codes_f16(d))
    }
    #[inline(always)]
    fn codes_f32(self, from: &[u8; 64]) -> Four<Q> {
        let [a, b, c, d] = quarters(from);
        Four(Q::codes_f32(a), Q::codes_f32(b), Q::codes_f32(c), Q::codes_f32(d))
    }
    #[inline(always)]
    fn coordinates(self, integers: &[i32; 16], divisor: Option<f64>) -> Four<Q> {
        let [a, b, c, d] = quarters(integers);
        match divisor {
            None => Four(Q::ordered(a), Q::ordered(b), Q::ordered(c), Q::ordered(d)),
            Some(divisor) => Four(
                Q::divided(a, divisor),
                Q::divided(b, divisor),
                Q::divided(c, divisor),
                Q::divided(d, divisor),
            ),
        }
    }
    #[inline(always)]
    fn permute(self, value: Four<Q>, places: &[u8; 16]) -> Four<Q> {
        Q::permute(value, places)
    }
    #[inline(always)]
    fn splat4(self, value: f32) -> Q {
        Q::splat(value)
    }
    #[inline(always)]
    fn load4(self, from: &[f32; 4]) -> Q {
        Q::load(from)
    }
    #[inline(always)]
    fn store4(self, value: Q, to: &mut [f32; 4]) {
        value.store(to);
    }
    #[inline(always)]
    fn least(self, of: &[f32; 16], mask: u16) -> u32 {
        let masks = [Q::mask(mask), Q::mask(mask >> 4), Q::mask(mask >> 8), Q::mask(mask >> 12)];
        let chosen = Four::select(masks, self.load(of), self.splat(f32::INFINITY));
        let mut least = [0.0; 4];
        chosen.0.min(chosen.1).min(chosen.2.min(chosen.3)).store(&mut least);
        let [a, b, c, d] = least;
        let least = self.splat(smaller(smaller(a, b), smaller(c, d)));
        (mask & Four::<Q>::bits(chosen.le(least))).trailing_zeros()
    }
    #[inline(always)]
    fn nearest(self, of: &[f32; 16], mask: u16) -> i32 {
        // In lanes, because the instructions for them are part of the target.
        let mut keys = [i32::MAX; 16];
        for lane in 0..16 {
            let key = in_order(of[lane]) & !15 | lane as i32;
            keys[lane] = if mask >> lane & 1 == 1 { key } else { i32::MAX };
        }
        keys.into_iter().fold(i32::MAX, i32::min)
    }
    #[inline(always)]
    fn prefetch_line(self, byte: &u8) {
        Q::prefetch_line(byte);
    }
    fn run<T: Task>(self, task: T) -> T::Output {
        run_apart(self, task)
    }
}

/// Runs a task as a function of its own.
#[inline(never)]
fn run_apart<Q: Quad, T: Task>(isa: Quads<Q>, task: T) -> T::Output {
    task.run(isa)
}

/// The smaller of two numbers that are not NaN.
#[inline(always)]
fn smaller(x: f32, y: f32) -> f32 {
    if x < y { x } else { y }
}

/// Returns the halves of eight numbers.
#[inline(always)]
fn pair(from: &[f32; 8]) -> [&[f32; 4]; 2] {
    let all = from.as_chunks::<4>().0;
    [&all[0], &all[1]]
}

/// Parts an array into four of a quarter of its length.
#[inline(always)]
fn quarters<T, const N: usize, const M: usize>(from: &[T; N]) -> [&[T; M]; 4] {
    const { assert!(N == 4 * M, "four quarters are the whole") };
    let all = from.as_chunks::<M>().0;
    [&all[0], &all[1], &all[2], &all[3]]
}
