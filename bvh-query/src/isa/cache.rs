//! The size of the second-level cache, which says how much is worth keeping there.

use std::sync::LazyLock;

/// Returns the size of a core's second-level cache in KiB, asked of the CPU once per process. Where it cannot be asked, it is
/// what most CPUs have at least: 512.
pub(crate) fn second_level_kib() -> usize {
    static SIZE: LazyLock<usize> = LazyLock::new(|| ask().filter(|size| *size > 0).unwrap_or(512));
    *SIZE
}

#[cfg(all(target_arch = "x86_64", not(miri)))]
fn ask() -> Option<usize> {
    use std::arch::x86_64::__cpuid;
    #[allow(unused_unsafe, reason = "newer compilers know that this is safe")]
    // SAFETY: every x86-64 CPU has this instruction, which writes nothing but its results.
    unsafe {
        // Both makers describe this cache in the same extended leaf.
        (__cpuid(0x8000_0000).eax >= 0x8000_0006).then(|| (__cpuid(0x8000_0006).ecx >> 16) as usize)
    }
}

#[cfg(not(all(target_arch = "x86_64", not(miri))))]
fn ask() -> Option<usize> {
    None
}
