//! The state of a thread's floating-point arithmetic, and a way to run code in the default state.
//!
//! All code of this crate needs the default state: rounding to nearest, ties to even; subnormal numbers; no traps. Rust
//! promises that its threads have it. Programs in C and C++ may change it for a thread: by `fesetround` and
//! `feenableexcept`, or by linking with `-ffast-math`, which flushes subnormal numbers to zero.
//!
//! The state is a register. On x86-64 it is MXCSR, whose bits 6 to 15 control arithmetic and whose bits 0 to 5 record
//! exceptions. On AArch64 it is FPCR, which has control bits only. Elsewhere the state is taken to be the default. The
//! x87 has a state of its own, which is left alone, because Rust does not compute with it on x86-64.

use std::hint::black_box;

/// The state in which a thread computes with floating-point numbers: how it rounds, what it does with subnormal numbers,
/// and which exceptions trap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FloatState(register::Bits);

impl FloatState {
    /// To nearest, ties to even; with subnormal numbers; without traps.
    pub const DEFAULT: Self = Self(register::DEFAULT);

    /// Returns the state of this thread.
    #[inline]
    pub fn of_thread() -> Self {
        Self(register::read())
    }

    /// Returns whether computations give the same results as in the default state, and none traps. Exceptions that
    /// happened before do not matter.
    #[inline]
    pub fn is_default(self) -> bool {
        self.0 & register::CONTROL == register::DEFAULT & register::CONTROL
    }

    /// Runs a function in this state, and restores the state of this thread afterwards, also if the function panics.
    ///
    /// # Safety
    /// Rust code may compute only in the default state. Unless this is the default state, `body` must do nothing but
    /// call a function of another language.
    #[inline]
    pub unsafe fn run<R>(self, body: impl FnOnce() -> R) -> R {
        let before = Self::of_thread();
        let is_same = before.0 & register::CONTROL == self.0 & register::CONTROL;
        if is_same { body() } else { changed(before, self, body) }
    }
}

/// Runs a function in the default state of floating-point arithmetic, and restores the state of this thread afterwards,
/// also if the function panics. The function gets the previous state, which it needs for callbacks.
///
/// Answers of this crate are exact in the default state only. With another rounding mode, bounds do not hold. Without
/// subnormal numbers, small meshes seem to touch. Traps end the process. Threads of Rust are in the default state, but
/// threads of C or C++ may not be: use this where they call Rust code. Threads that are started in the function start
/// in the default state. That includes those of rayon's pool, which start at the first query that uses them.
///
/// Cost: a few nanoseconds in the default state, some ten more in any other.
#[inline]
pub fn with_default_floats<R>(body: impl FnOnce(FloatState) -> R) -> R {
    let before = FloatState::of_thread();
    if before.is_default() { body(before) } else { changed(before, FloatState::DEFAULT, || body(before)) }
}

/// Runs a function in another state than the present one.
#[cold]
#[inline(never)]
fn changed<R>(before: FloatState, during: FloatState, body: impl FnOnce() -> R) -> R {
    struct TakeBack(FloatState);
    impl Drop for TakeBack {
        fn drop(&mut self) {
            register::write(self.0.0);
        }
    }

    let take_back = TakeBack(before);
    register::write(during.0);
    // Arithmetic may not move from in here to out there or back, for want of an order between it and the register.
    let result = black_box(black_box(body)());
    drop(take_back);
    result
}

/// The register of the state.
#[cfg(target_arch = "x86_64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u32;
    /// All exceptions masked.
    pub(super) const DEFAULT: Bits = 0x1F80;
    /// Subnormal numbers as operands and results, masks of exceptions, rounding.
    pub(super) const CONTROL: Bits = 0xFFC0;

    #[inline]
    pub(super) fn read() -> Bits {
        let mut bits: Bits = 0;
        // SAFETY: the instruction writes the register to the four bytes of `bits`, and changes nothing else. Every CPU of
        // this kind has it.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut bits, options(nostack, preserves_flags)) };
        bits
    }

    #[inline]
    pub(super) fn write(bits: Bits) {
        // SAFETY: the instruction reads the register from the four bytes of `bits`. The bits are those of a state that a
        // thread was in, or the default ones, so that none is reserved.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const bits, options(nostack, preserves_flags)) };
    }
}

/// The register of the state.
#[cfg(target_arch = "aarch64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u64;
    /// Nothing traps, and NaN propagates.
    pub(super) const DEFAULT: Bits = 0;
    /// How subnormal numbers, NaN and halves are treated, rounding, and traps.
    pub(super) const CONTROL: Bits = 0x07C8_9F07;

    #[inline]
    pub(super) fn read() -> Bits {
        let bits: Bits;
        // SAFETY: the instruction reads the register, and changes nothing. Every CPU of this kind has it.
        unsafe { asm!("mrs {}, fpcr", out(reg) bits, options(nostack, preserves_flags)) };
        bits
    }

    #[inline]
    pub(super) fn write(bits: Bits) {
        // SAFETY: the bits are those of a state that a thread was in, or the default ones, so that none is reserved.
        unsafe { asm!("msr fpcr, {}", in(reg) bits, options(nostack, preserves_flags)) };
    }
}

/// No register: the state is taken to be the default.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod register {
    pub(super) type Bits = u32;
    pub(super) const DEFAULT: Bits = 0;
    pub(super) const CONTROL: Bits = 0;

    pub(super) fn read() -> Bits {
        DEFAULT
    }

    pub(super) fn write(_: Bits) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States with another rounding, without subnormal numbers, and with traps, each of which a test may set.
    #[cfg(target_arch = "x86_64")]
    fn other_states() -> Vec<FloatState> {
        [0x3F80, 0x5F80, 0x7F80, 0x9F80, 0x1FC0, 0x9FC0, 0x1F00, 0x1D80, 0x1780].map(FloatState).to_vec()
    }
    #[cfg(target_arch = "aarch64")]
    fn other_states() -> Vec<FloatState> {
        [1 << 22, 2 << 22, 3 << 22, 1 << 24, 1 << 25].map(FloatState).to_vec()
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn other_states() -> Vec<FloatState> {
        Vec::new()
    }

    #[test]
    fn the_state_is_the_default_inside_and_what_it_was_outside() {
        assert!(FloatState::of_thread().is_default() && FloatState::DEFAULT.is_default());
        for state in other_states() {
            assert!(!state.is_default(), "{state:?}");
            let before = FloatState::of_thread();
            register::write(state.0);
            let inside = with_default_floats(|found| (FloatState::of_thread(), 1.0 / black_box(3.0), found));
            let after = FloatState::of_thread();
            register::write(before.0);
            assert!(inside.0.is_default(), "{state:?}");
            assert_eq!(inside.1, 1.0 / 3.0, "{state:?}");
            assert_eq!((inside.2, after), (state, state));
        }
    }

    #[test]
    fn a_panic_takes_the_state_back() {
        for state in other_states() {
            let before = FloatState::of_thread();
            let unwind = || with_default_floats(|_| std::panic::resume_unwind(Box::new(())));
            register::write(state.0);
            let result = std::panic::catch_unwind(unwind);
            let after = FloatState::of_thread();
            register::write(before.0);
            assert!(result.is_err());
            assert_eq!(after, state);
        }
    }

    #[test]
    fn a_state_is_had_for_a_call() {
        for state in other_states() {
            // SAFETY: nothing is computed in that state.
            let inside = unsafe { state.run(FloatState::of_thread) };
            assert_eq!(inside, state);
            assert!(FloatState::of_thread().is_default());
        }
        // SAFETY: the state is the default.
        assert!(unsafe { FloatState::DEFAULT.run(|| FloatState::of_thread().is_default()) });
    }
}
