//! Proves a file: structure by the rules, and that every decoded bound contains its triangles.
//!
//! Works on the finished bytes with the reference decoder, so that it trusts nothing of the baker.
//! Part of every bake, in release builds too.

mod backward;

use crate::error::BakeError;
use crate::progress::Progress;
use crate::target::Source;
use bvh_format::bounds::Inflation;
use bvh_format::validate::{validate_counts, validate_links, validate_page, validate_sections};
use bvh_format::{FormatError, Layout};
use rayon::prelude::*;

pub(crate) use backward::prove;

/// `bvh_format::validate::validate` with the pages checked in parallel.
///
/// # Errors
/// The rule that `bvh_format::validate::validate` finds broken, whatever the number of threads.
pub fn validate_in_parallel(bytes: &[u8]) -> Result<Layout, FormatError> {
    let layout = Layout::read(bytes)?;
    let (sections, pages) = rayon::join(|| validate_sections(bytes), || validate_pages(&layout, bytes));
    sections?;
    pages?;
    Ok(layout)
}

fn validate_pages(layout: &Layout, bytes: &[u8]) -> Result<(), FormatError> {
    for object in &layout.objects {
        let pages = object.pages().into_par_iter();
        let counts = first_error(pages.clone().map(|number| validate_page(layout, bytes, object, number)))?;
        first_error(pages.map(|number| validate_links(layout, bytes, object, number)))?;
        validate_counts(layout, object, &counts)?;
    }
    Ok(())
}

/// All results, or the first of the errors: parallel `collect` would give any of them.
fn first_error<T: Send>(
    results: impl IndexedParallelIterator<Item = Result<T, FormatError>>,
) -> Result<Vec<T>, FormatError> {
    let results: Vec<_> = results.collect();
    results.into_iter().collect()
}

/// Checks the bounds of a file whose structure has been validated; returns how loose they are.
///
/// # Errors
/// Rule 35, with the page and slot.
pub fn prove_bounds(layout: &Layout, bytes: &[u8]) -> Result<Inflation, FormatError> {
    let mut inflation = Inflation::default();
    let progress = Progress::default();
    for object in &layout.objects {
        match backward::prove_object(layout, Source::Memory(bytes), object, false, &progress) {
            Ok(sums) => inflation.join(&sums),
            Err(BakeError::Unproved(error)) => return Err(error),
            // Memory is read without fail.
            Err(_) => {}
        }
    }
    Ok(inflation)
}
