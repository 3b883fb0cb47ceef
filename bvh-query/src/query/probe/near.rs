//! Visits the stored triangles of an object that may be in a box, page by page.
//!
//! A page is decoded as a whole, and its links lead to later pages, so that a set of pages to come is all the walk keeps. It
//! serves questions that few shapes raise, for which a walk in vector registers would be too much code.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::TrianglePlace;
use crate::traverse::budget::Budget;
use bvh_format::object::Object;
use bvh_format::page::decode::decode_page;
use bvh_format::treelet::Child;
use std::collections::BTreeSet;

/// Returns the triangles of the leaf packets whose slabs meet a box around the object's origin.
pub(in crate::query) fn near(
    bvh: &Bvh,
    object: &Object,
    [lo, hi]: &[[f64; 3]; 2],
    budget: &mut Budget,
) -> Result<Vec<TrianglePlace>, QueryError> {
    let mut pages = BTreeSet::from([object.record().first_page.get()]);
    let mut places = Vec::new();
    while let Some(number) = pages.pop_first() {
        let page = bvh.page(object, number)?;
        decode_page(&page, object.f16_scale(), |slot, child, _, slabs| {
            budget.visit()?;
            // The first three slabs are those of a box, and have the first three rows.
            let meets = (0..3)
                .all(|axis| f64::from(slabs.lo[axis]) <= hi[axis] && lo[axis] <= f64::from(slabs.hi[axis]));
            match page.links(slot).child(child) {
                Child::Leaf { packet, triangles } if meets => {
                    places.extend((0..triangles).map(|lane| TrianglePlace { page: number, packet, lane }));
                }
                Child::Remote(link) if meets => {
                    pages.insert(page.remote(link).page());
                }
                _ => {}
            }
            Ok::<_, QueryError>(())
        })?;
    }
    Ok(places)
}
