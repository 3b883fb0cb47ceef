//! Proves a file: structure by the rules, and that every decoded bound contains its triangles.
//!
//! Works on the finished bytes with the reference decoder, so that it trusts nothing of the baker.
//! Part of every bake, in release builds too.

mod backward;

use crate::progress::Progress;
use bvh_format::Layout;
use bvh_format::bounds::Inflation;
use bvh_format::source::Source;
use bvh_format::validate::{Workers, validate_with};
use rayon::prelude::*;
use std::ops::Range;

pub(crate) use backward::prove;

/// The threads of rayon's current pool.
struct InParallel;

impl Workers for InParallel {
    fn both<A: Send, B: Send, E: Send>(
        &self,
        a: impl FnOnce() -> Result<A, E> + Send,
        b: impl FnOnce() -> Result<B, E> + Send,
    ) -> Result<(A, B), E> {
        let (a, b) = rayon::join(a, b);
        Ok((a?, b?))
    }

    fn each<T: Send, E: Send>(
        &self,
        pages: Range<u32>,
        check: impl Fn(u32) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        // Parallel `collect` into a result would give any of the errors.
        let results: Vec<_> = pages.into_par_iter().map(check).collect();
        results.into_iter().collect()
    }
}

/// `bvh_format::validate::validate_with` by the threads of rayon's current pool, of bytes in memory or of a
/// [`StoredFile`](crate::StoredFile) of any size.
///
/// # Errors
/// The rule that one thread finds broken, whatever the number of threads; and those of the source.
pub fn validate_in_parallel<S: Source + ?Sized>(source: &S) -> Result<Layout, S::Error> {
    validate_with(source, &InParallel)
}

/// Checks the bounds of a file whose structure has been validated; returns how loose they are.
///
/// Cost: one pass over the pages and leaf blocks, from the last page to the first. Memory: 128 pages with their leaf
/// blocks, at most 10 MiB as files are baked, and some 130 bytes for each subtree root that has been seen before the
/// link to it: some hundreds in files baked here, whatever their size, and at most all roots in files whose pages are
/// ordered otherwise.
///
/// # Errors
/// Rule 35, with the page and slot; and those of the source.
pub fn prove_bounds<S: Source + ?Sized>(layout: &Layout, source: &S) -> Result<Inflation, S::Error> {
    let mut inflation = Inflation::default();
    let progress = Progress::default();
    for object in &layout.objects {
        inflation.join(&backward::prove_object(layout, source, object, false, &progress)?);
    }
    Ok(inflation)
}
