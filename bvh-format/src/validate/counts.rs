//! Sums up how many treelets, packets and so on the pages of an object have, and compares the sums with its record.

use crate::error::{FormatError, ensure, require};
use crate::layout::Layout;
use crate::object::Object;
use crate::rule::Rule;

/// How many parts a page has, or the pages of an object together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub(super) first_packet: u64,
    pub(super) treelets: u64,
    pub(super) packets: u64,
    pub(super) triangles: u64,
    pub(super) roots: u64,
    pub(super) remotes: u64,
}

/// Sums up the pages of an object from the first to the last. A breach is reported at the end, since the rules for links
/// come before it.
#[derive(Debug, Default)]
pub(super) struct CountsFromStart {
    sum: Counts,
    breach: Option<FormatError>,
}

impl CountsFromStart {
    /// Adds the page that follows the one added last.
    pub(super) fn add(&mut self, layout: &Layout, number: u32, counts: &Counts) {
        if self.breach.is_none() {
            self.breach = check_first(layout, number, self.sum.packets, counts.first_packet).err();
        }
        self.sum.add(counts);
    }

    /// Compares the sums with the record, after the last page of the object.
    ///
    /// # Errors
    /// Rule 34.
    pub(super) fn finish(self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        self.breach.map_or(Ok(()), Err)?;
        self.sum.check(layout, object)
    }
}

/// Sums up the pages of an object from the last to the first.
#[derive(Debug, Default)]
pub struct CountsFromEnd {
    sum: Counts,
    /// The number of the page added last, and its `first_packet`.
    next: Option<(u32, u64)>,
}

impl CountsFromEnd {
    /// Adds the page that precedes the one added last.
    ///
    /// # Errors
    /// Rule 34.
    pub fn add(&mut self, layout: &Layout, number: u32, counts: &Counts) -> Result<(), FormatError> {
        if let Some((page, first)) = self.next {
            check_first(layout, page, counts.first_packet + counts.packets, first)?;
        }
        self.next = Some((number, counts.first_packet));
        self.sum.add(counts);
        Ok(())
    }

    /// Compares the sums with the record, after the first page of the object.
    ///
    /// # Errors
    /// Rule 34.
    pub fn finish(self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        if let Some((page, first)) = self.next {
            check_first(layout, page, 0, first)?;
        }
        self.sum.check(layout, object)
    }
}

/// Compares the number of a page's first packet with the packets before it.
fn check_first(layout: &Layout, page: u32, expected: u64, found: u64) -> Result<(), FormatError> {
    require(Rule::Counts, layout.page_offset(page) + 40, expected, found)
}

impl Counts {
    fn add(&mut self, page: &Counts) {
        self.treelets += page.treelets;
        self.packets += page.packets;
        self.triangles += page.triangles;
        self.roots += page.roots;
        self.remotes += page.remotes;
    }

    /// Compares the sums over the pages of an object with its record.
    fn check(&self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        let record = &object.record;
        let at = layout.page_offset(record.first_page.get());
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
