//! Proves a file: its structure follows the rules, and every decoded bound contains its triangles.
//!
//! The proof is part of every bake, also in release builds. It works on the finished bytes with the reference decoder,
//! and does not rely on the baker. The bytes are those in memory that the writing thread gets or, within a memory
//! budget, those that the system reads back (`storage/output.rs`). The proof therefore covers everything up to the call
//! that passes the bytes to the system. It does not cover errors of the disk; `cbvh verify` can read a file again at
//! any time, and queries check the checksum of each page when they first touch it.

mod backward;

use crate::progress::Progress;
use crate::threads;
use bvh_format::Layout;
use bvh_format::bounds::Inflation;
use bvh_format::source::Source;
use bvh_format::validate::{Workers, validate_with};
use std::ops::Range;

pub(crate) use backward::prove;

/// The blocks are checked by the threads of rayon's current pool.
struct InParallel;

impl Workers for InParallel {
    fn both<A: Send, B: Send, E: Send>(
        &self,
        a: impl FnOnce() -> Result<A, E> + Send,
        b: impl FnOnce() -> Result<B, E> + Send,
    ) -> Result<(A, B), E> {
        let (a, b) = threads::join(a, b);
        Ok((a?, b?))
    }

    fn each<T: Send, E: Send>(
        &self,
        pages: Range<u32>,
        check: impl Fn(u32) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        threads::map(pages, check).into_iter().collect()
    }
}

/// Validates a whole file like `bvh_format::validate::validate_with`, on the threads of rayon's current pool. The
/// source is bytes in memory or a [`StoredFile`](crate::StoredFile) of any size.
///
/// # Errors
/// Returns the broken rule that a single thread would find first, or the error of the source.
pub fn validate_in_parallel<S: Source + ?Sized>(source: &S) -> Result<Layout, S::Error> {
    validate_with(source, &InParallel)
}

/// Checks the bounds of a validated file, and returns how much wider they are than the tight ones.
///
/// Cost: one pass over the pages and leaf blocks, from the last page to the first. Memory: 128 pages with their leaf
/// blocks, which is at most 10 MiB for files of this baker, and about 130 bytes per subtree root that was read before
/// the link to it. Files of this baker have a few hundred such roots, whatever their size. In files with another order
/// of pages, all roots may be such.
///
/// # Errors
/// Returns rule 35 with the page and the slot, or the error of the source.
pub fn prove_bounds<S: Source + ?Sized>(layout: &Layout, source: &S) -> Result<Inflation, S::Error> {
    let mut inflation = Inflation::default();
    let progress = Progress::default();
    for object in &layout.objects {
        inflation.join(&backward::prove_object(layout, source, object, None, &progress)?);
    }
    Ok(inflation)
}
