//! Proves a file: structure by the rules, and that every decoded bound contains its triangles.
//!
//! Works on the finished bytes with the reference decoder, so that it trusts nothing of the baker.
//! Part of every bake, in release builds too.

use bvh_format::bounds::{Inflation, check_bounds};
use bvh_format::kdop::Kdop;
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef};
use bvh_format::validate::{validate_counts, validate_links, validate_page, validate_sections};
use bvh_format::{FormatError, Layout, Rule};
use rayon::prelude::*;

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
    for object in &layout.objects {
        inflation.join(&prove_object(layout, bytes, object)?);
    }
    Ok(inflation)
}

fn prove_object(layout: &Layout, bytes: &[u8], object: &Object) -> Result<Inflation, FormatError> {
    let first = object.record.first_page.get();
    let end = first + object.record.pages.get();
    let page = |number: u32| {
        let at = layout.page_offset(number);
        let bytes = layout.page_bytes(bytes, number);
        let missing = || FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section");
        Ok::<_, FormatError>(Page::new(bytes.ok_or_else(missing)?, object.profile))
    };
    // Runs of pages from the end whose remote links all lead behind the run are independent.
    let mut inflation = Inflation::default();
    let mut done: Vec<Vec<Kdop>> = vec![Vec::new(); (end - first) as usize];
    let mut stop = end;
    while stop > first {
        let mut start = stop;
        while start > first {
            let page = page(start - 1)?;
            let mut targets = (0..page.header().remotes).map(|link| page.remote(link).page());
            if targets.any(|target| target < stop) {
                break;
            }
            start -= 1;
        }
        // A link to an earlier page is refused by the structural checks; a hostile one ends here.
        if start == stop {
            let at = layout.page_offset(stop - 1);
            return Err(FormatError::new(Rule::RemoteLinks, at, "links to later pages", "another"));
        }
        let below = |root: RootRef| {
            let roots = done.get((root.page() - first) as usize);
            roots.and_then(|roots| roots.get(usize::from(root.root()))).copied().unwrap_or(Kdop::EMPTY)
        };
        let results = (start..stop).into_par_iter();
        let results =
            first_error(results.map(|number| check_bounds(layout, bytes, object, &page(number)?, below)))?;
        for (number, (roots, sums)) in (start..stop).zip(results) {
            done[(number - first) as usize] = roots;
            inflation.join(&sums);
        }
        stop = start;
    }
    let record = &object.record;
    let root = done.first().and_then(|roots| roots.first()).copied().unwrap_or(Kdop::EMPTY);
    let inside = (0..3).all(|a| record.box_lo[a].get() <= root.lo[a] && root.hi[a] <= record.box_hi[a].get());
    if !inside {
        let at = layout.page_offset(first);
        let expected = "the object's box to contain its triangles";
        return Err(FormatError::new(Rule::BoundContains, at, expected, format!("{record:?}")));
    }
    Ok(inflation)
}
