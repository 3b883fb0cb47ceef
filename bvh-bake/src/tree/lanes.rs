//! Four lanes of f32, for which the compiler takes one register.

use std::ops::{Add, Mul, Neg, Sub};

#[derive(Clone, Copy)]
#[repr(align(16))]
pub(crate) struct Lanes([f32; 4]);

impl Lanes {
    pub(crate) const INFINITY: Self = Self([f32::INFINITY; 4]);

    #[inline(always)]
    pub(crate) const fn new(lanes: [f32; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    pub(crate) const fn splat(value: f32) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    pub(crate) fn to_array(self) -> [f32; 4] {
        self.0
    }

    #[inline(always)]
    pub(crate) fn as_array(&self) -> &[f32; 4] {
        &self.0
    }

    /// Returns the lesser of both in each lane, and its own where neither is less.
    #[inline(always)]
    pub(crate) fn lesser(self, other: Self) -> Self {
        self.with(other, |own, other| if other < own { other } else { own })
    }

    /// Returns the greater of both in each lane, and its own where neither is greater.
    #[inline(always)]
    pub(crate) fn greater(self, other: Self) -> Self {
        self.with(other, |own, other| if other > own { other } else { own })
    }

    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|lane| of(self.0[lane], other.0[lane])))
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|lane| -lane))
    }
}
