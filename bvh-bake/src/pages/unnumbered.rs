//! Holds pages that have been encoded but not yet numbered, and numbers them.
//!
//! The pages of a brick are written before the number of pages in front of them is known. Such unnumbered pages count
//! pages, lines, words and packets from the first of them. When all pages of an object exist, each of them gets its
//! numbers and its checksum.

use crate::error::BakeError;
use crate::pages::encode::Encoded;
use crate::storage::{Piece, Spill};
use crate::threads;
use bvh_format::page::{NO_PARENT, PAGE, Page, PagePatcher, PagePlace, RootRef};
use bvh_format::profile::Profile;
use std::collections::HashMap;

/// The pages of a brick, or those above all bricks, with their blocks.
pub(crate) struct UnnumberedPages {
    pub(crate) pages: Piece<u8>,
    pub(crate) leaves: Piece<u8>,
    pub(crate) ids: Piece<u8>,
}

impl UnnumberedPages {
    pub(crate) fn new(encoded: Encoded, spill: &Spill) -> Result<Self, BakeError> {
        Ok(Self {
            pages: spill.put(encoded.pages)?,
            leaves: spill.put(encoded.leaves)?,
            ids: spill.put(encoded.ids)?,
        })
    }

    pub(crate) fn page_count(&self) -> usize {
        self.pages.len() / PAGE
    }
}

/// The link that leads to the root of a page: the number of the page with the link, and the link's number in that page.
pub(crate) type Parent = (u32, u8);

/// The pages of an object: those above the bricks first, then those of each brick.
pub(crate) struct ObjectPages {
    pub(crate) profile: Profile,
    pub(crate) parts: Vec<UnnumberedPages>,
    /// The links that lead from the pages above the bricks to roots in the pages of bricks, by page (counted from the
    /// first of the object) and root.
    pub(crate) parents: HashMap<(u32, u8), Parent>,
}

impl ObjectPages {
    pub(crate) fn page_count(&self) -> usize {
        self.parts.iter().map(UnnumberedPages::page_count).sum()
    }

    pub(crate) fn leaf_bytes(&self) -> usize {
        self.parts.iter().map(|part| part.leaves.len()).sum()
    }

    pub(crate) fn id_bytes(&self) -> usize {
        self.parts.iter().map(|part| part.ids.len()).sum()
    }
}

/// Numbers the pages of an object.
pub(crate) struct Numbering {
    pub(crate) profile: Profile,
    pub(crate) parents: HashMap<(u32, u8), Parent>,
    /// The number of the object's first page in the file.
    pub(crate) first: u32,
}

impl Numbering {
    /// Numbers the pages of several consecutive parts of the object. `next` is the place of the first of these pages,
    /// and becomes that of the page after the last.
    pub(crate) fn number(&self, parts: &mut [Vec<u8>], next: &mut PagePlace) {
        let mut places = Vec::new();
        for pages in &*parts {
            // The pages of a part count from its first page.
            let base = next.page;
            for page in pages.as_chunks::<PAGE>().0 {
                places.push((base, *next));
                *next = next.behind(Page::new(page, self.profile).header());
            }
        }
        let pages = parts.iter_mut().flat_map(|pages| pages.as_chunks_mut::<PAGE>().0);
        threads::map(pages.zip(places), |(page, (base, place))| self.put_numbers(page, base, &place));
    }

    /// Numbers one page. `base` is the number in the file of the first page of the page's part.
    fn put_numbers(&self, bytes: &mut [u8; PAGE], base: u32, place: &PagePlace) {
        let mut patcher = PagePatcher::new(bytes, self.profile);
        let header = *patcher.page().header();
        debug_assert_eq!(place.page, base + header.page_number.get());
        for root in 0..header.roots {
            let parent = match patcher.page().anchor_parent(root) {
                (NO_PARENT, _) => {
                    let parent = self.parents.get(&(place.page - self.first, root));
                    parent.map(|(page, link)| (self.first + page, *link))
                }
                (parent, link) => Some((base + parent, link)),
            };
            if let Some((page, link)) = parent {
                patcher.set_parent(root, page, link);
            }
        }
        for link in 0..header.remotes {
            let to = patcher.page().remote(link);
            patcher.set_remote(link, RootRef::new(base + to.page(), to.root()));
        }
        patcher.set_place(place);
        patcher.seal();
    }
}
