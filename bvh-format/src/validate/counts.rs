//! Adds up the treelets, packets and triangles of an object's pages, and compares the sums with its record.
//!
//! Counts of consecutive pages are joined in any order, so a check may walk through the pages forward or backward.

use crate::error::{FormatError, ensure, require};
use crate::layout::Layout;
use crate::object::Object;
use crate::rule::Rule;

/// The numbers of parts of one page, or of consecutive pages of an object together. The default stands for no page.
///
/// [`validate_page`](super::validate_page) has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub(super) first_page: u32,
    pub(super) first_packet: u64,
    pub(super) treelets: u64,
    pub(super) packets: u64,
    pub(super) triangles: u64,
    pub(super) roots: u64,
    pub(super) remotes: u64,
}

impl Counts {
    /// Joins the counts of pages with those of the pages that follow them.
    ///
    /// # Errors
    /// Rule 34, if the packets of the next pages do not begin where these end. No page has no packets.
    pub fn followed_by(self, next: &Self, layout: &Layout) -> Result<Self, FormatError> {
        // Each page has a treelet.
        if next.treelets > 0 {
            check_first(layout, next.first_page, self.first_packet + self.packets, next.first_packet)?;
        }
        Ok(Self {
            treelets: self.treelets + next.treelets,
            packets: self.packets + next.packets,
            triangles: self.triangles + next.triangles,
            roots: self.roots + next.roots,
            remotes: self.remotes + next.remotes,
            ..self
        })
    }

    /// Compares the counts of all pages of an object with its record.
    ///
    /// # Errors
    /// Rule 34.
    pub fn check(&self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        let record = &object.record;
        let first_page = record.first_page.get();
        check_first(layout, first_page, 0, self.first_packet)?;
        let at = layout.page_offset(first_page);
        // Each link leads to a root that names the link, so no two links share a root. If the numbers agree, each root
        // but the object's has its link.
        require(Rule::Counts, at, self.remotes + 1, self.roots)?;
        let found = [self.treelets, self.packets, self.triangles];
        let stated = [record.treelets.get(), record.packets.get(), record.triangles.get()];
        ensure(found == stated, Rule::Counts, at, || {
            (format!("treelets, packets, triangles {stated:?}"), format!("{found:?}"))
        })
    }
}

/// Compares the number of a page's first packet with the packets before it.
fn check_first(layout: &Layout, page: u32, expected: u64, found: u64) -> Result<(), FormatError> {
    require(Rule::Counts, layout.page_offset(page) + 40, expected, found)
}
