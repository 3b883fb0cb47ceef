//! What tests need of the system, and what they do where it is missing: folders and threads.

use tempfile::TempDir;

/// Makes a folder that is removed with its guard.
///
/// # Panics
/// Panics if the system refuses.
pub fn folder() -> TempDir {
    // WASI has no directory for temporary files; whoever runs a test there offers this one.
    let made = if cfg!(target_family = "wasm") { tempfile::tempdir_in("/tmp") } else { tempfile::tempdir() };
    made.expect("a folder for temporary files")
}

/// Threads of their own, or none where there are none.
pub struct Pool(Option<rayon::ThreadPool>);

/// Makes a pool of `threads` threads. On WebAssembly, which has none, the pool works on the thread that asks.
///
/// # Panics
/// Panics if the system refuses.
pub fn pool(threads: usize) -> Pool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    Pool((!cfg!(target_family = "wasm")).then(|| builder.build().expect("a pool of threads")))
}

impl Pool {
    /// Does work on the threads of this pool.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}
