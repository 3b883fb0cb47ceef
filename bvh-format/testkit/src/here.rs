//! What tests need of the system, folders and threads, and what replaces it on WebAssembly.

use tempfile::TempDir;

/// Makes a folder that is removed with its guard.
///
/// # Panics
/// Panics if the system refuses.
pub fn folder() -> TempDir {
    // WASI has no directory for temporary files; what runs the tests there must offer this one.
    let made = if cfg!(target_family = "wasm") { tempfile::tempdir_in("/tmp") } else { tempfile::tempdir() };
    made.expect("a folder for temporary files")
}

/// A pool of threads, or none on WebAssembly.
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
