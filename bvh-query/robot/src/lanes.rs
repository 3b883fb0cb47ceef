//! Runs a task with the vector registers that the CPU has.

/// Runs a task that has been compiled for them, as far as it is inlined here. Its numbers have the same bits everywhere: nothing is
/// fused.
#[inline(always)]
pub(crate) fn in_lanes<R>(task: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        #[target_feature(enable = "avx2")]
        fn run<R>(task: impl FnOnce() -> R) -> R {
            task()
        }
        // SAFETY: the CPU has AVX2.
        #[allow(unsafe_code, reason = "the feature that the function needs has been detected")]
        return unsafe { run(task) };
    }
    task()
}
