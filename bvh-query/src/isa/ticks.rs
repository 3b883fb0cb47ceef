//! The counter that the clock of stages reads: the time stamp counter of x86-64, and nanoseconds elsewhere.

/// Returns a count that grows at a constant rate. Reading it does not wait for instructions before it.
#[inline(always)]
pub fn ticks() -> u64 {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 CPU has this instruction, which reads a register and writes nothing else.
    return unsafe { std::arch::x86_64::_rdtsc() };
    #[cfg(not(target_arch = "x86_64"))]
    {
        use std::{sync::LazyLock, time::Instant};
        static START: LazyLock<Instant> = LazyLock::new(Instant::now);
        START.elapsed().as_nanos() as u64
    }
}
