//! Pages that have been encoded but not yet numbered, and how they get their numbers.
//!
//! A brick's pages are written before anyone knows how many pages come before them. They are kept as a draft, in which
//! pages, lines, words and packets count from the draft's first. When all drafts of an object are there, each page
//! is read once more, its numbers are put in, and its checksum.

use crate::encode::Encoded;
use crate::error::BakeError;
use crate::scratch::{Piece, Spill};
use bvh_format::ids::WORD;
use bvh_format::leaf::LINE;
use bvh_format::page::{NO_PARENT, PAGE, Page, PageHeader, RootRef, page_checksum};
use bvh_format::profile::Profile;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use zerocopy::IntoBytes;

/// Pages and their blocks.
pub(crate) struct Draft {
    pages: Piece<u8>,
    leaves: Piece<u8>,
    ids: Piece<u8>,
    pub(crate) packets: u64,
    pub(crate) treelets: u64,
}

impl Draft {
    pub(crate) fn new(encoded: Encoded, spill: &Spill) -> Result<Self, BakeError> {
        Ok(Self {
            pages: spill.put(encoded.pages)?,
            leaves: spill.put(encoded.leaves)?,
            ids: spill.put(encoded.ids)?,
            packets: encoded.packets,
            treelets: encoded.treelets,
        })
    }

    pub(crate) fn page_count(&self) -> usize {
        self.pages.len() / PAGE
    }

    /// Some pages as they are.
    fn pages(&self, range: Range<usize>) -> Result<Vec<u8>, BakeError> {
        Ok(self.pages.range(range.start * PAGE..range.end * PAGE)?.into_owned())
    }
}

/// The link that leads to the root of a page: the page it is in, and its number there.
pub(crate) type Parent = (u32, u8);

/// The drafts of an object in order, the tree above the bricks first, and the order of their pages in the file.
pub(crate) struct Drafts {
    pub(crate) profile: Profile,
    pub(crate) drafts: Vec<Draft>,
    /// What leads from the first draft to roots in others, by page (counted over all drafts) and root.
    pub(crate) parents: HashMap<(u32, u8), Parent>,
    /// The pages of all drafts, counted through, in the order of the file; `None` for that order itself.
    pub(crate) order: Option<Vec<usize>>,
}

/// Pages of one draft that follow each other in it and in the file.
#[derive(Clone)]
pub(crate) struct Run {
    draft: usize,
    pages: Range<usize>,
}

impl Run {
    pub(crate) fn page_count(&self) -> usize {
        self.pages.len()
    }
}

/// Where the blocks and packets of the next page go.
#[derive(Default, Clone, Copy)]
pub(crate) struct Ends {
    pub(crate) pages: u64,
    pub(crate) leaf_lines: u64,
    pub(crate) id_words: u64,
    packets: u64,
}

impl Ends {
    /// Packets are counted by object.
    pub(crate) fn of_next_object(self) -> Self {
        Self { packets: 0, ..self }
    }
}

impl Drafts {
    /// For each draft the pages in all before it.
    fn bases(&self) -> Vec<usize> {
        let mut next = 0;
        let base = |draft: &Draft| {
            let base = next;
            next += draft.page_count();
            base
        };
        self.drafts.iter().map(base).collect()
    }

    pub(crate) fn page_count(&self) -> usize {
        self.drafts.iter().map(Draft::page_count).sum()
    }

    pub(crate) fn leaf_bytes(&self) -> usize {
        self.drafts.iter().map(|draft| draft.leaves.len()).sum()
    }

    pub(crate) fn id_bytes(&self) -> usize {
        self.drafts.iter().map(|draft| draft.ids.len()).sum()
    }

    /// For each page, counted through, the pages and roots that its links lead to.
    pub(crate) fn links(&self) -> Result<Vec<Vec<(usize, u8)>>, BakeError> {
        let mut links = Vec::new();
        for (draft, base) in self.drafts.iter().zip(self.bases()) {
            for bytes in draft.pages(0..draft.page_count())?.as_chunks::<PAGE>().0 {
                let page = Page::new(bytes, self.profile);
                let to = (0..page.header().remotes).map(|link| page.remote(link));
                links.push(to.map(|to| (base + to.page() as usize, to.root())).collect());
            }
        }
        Ok(links)
    }

    /// All pages in the order of the file.
    pub(crate) fn runs(&self) -> Vec<Run> {
        let whole = |(draft, pages): (usize, &Draft)| Run { draft, pages: 0..pages.page_count() };
        let Some(order) = &self.order else {
            return self.drafts.iter().enumerate().map(whole).filter(|run| !run.pages.is_empty()).collect();
        };
        let bases = self.bases();
        let single = |&page: &usize| {
            let draft = bases.partition_point(|&base| base <= page) - 1;
            // Drafts without pages start where the next one does.
            Run { draft, pages: page - bases[draft]..page - bases[draft] + 1 }
        };
        order.iter().map(single).collect()
    }

    /// The pages of the object's runs with their numbers in the file, the first page being `first`. `ends` is moved on.
    pub(crate) fn numbering(&self, first: u32) -> Numbering<'_> {
        let place = self.order.as_ref().map(|order| {
            let mut place = vec![0; order.len()];
            order.iter().enumerate().for_each(|(number, &page)| place[page] = number as u32);
            place
        });
        Numbering { drafts: self, bases: self.bases(), place, first }
    }

    /// The leaf blocks of a run.
    pub(crate) fn leaves(&self, run: &Run) -> Result<Cow<'_, [u8]>, BakeError> {
        let draft = &self.drafts[run.draft];
        let lines = |header: &PageHeader| (header.leaf_line.get(), header.leaf_lines.get());
        self.blocks(run, &draft.leaves, LINE, lines)
    }

    /// The id blocks of a run.
    pub(crate) fn ids(&self, run: &Run) -> Result<Cow<'_, [u8]>, BakeError> {
        let draft = &self.drafts[run.draft];
        let words = |header: &PageHeader| (header.id_word.get(), header.id_words.get());
        self.blocks(run, &draft.ids, WORD, words)
    }

    fn blocks<'a>(
        &self,
        run: &Run,
        blocks: &'a Piece<u8>,
        unit: usize,
        place: impl Fn(&PageHeader) -> (u64, u32),
    ) -> Result<Cow<'a, [u8]>, BakeError> {
        let draft = &self.drafts[run.draft];
        if run.pages.len() == draft.page_count() {
            return blocks.all();
        }
        let mut bytes = Vec::new();
        for page in draft.pages(run.pages.clone())?.as_chunks::<PAGE>().0 {
            let (start, count) = place(Page::new(page, self.profile).header());
            let start = start as usize * unit;
            bytes.extend_from_slice(&blocks.range(start..start + count as usize * unit)?);
        }
        Ok(Cow::Owned(bytes))
    }
}

/// Puts numbers into the pages of an object.
pub(crate) struct Numbering<'a> {
    drafts: &'a Drafts,
    bases: Vec<usize>,
    place: Option<Vec<u32>>,
    first: u32,
}

impl Numbering<'_> {
    /// The number in the file of a page that is counted over all drafts.
    fn number(&self, page: u32) -> u32 {
        self.first + self.place.as_ref().map_or(page, |place| place[page as usize])
    }

    /// The pages of some runs as they stand in the file. `ends` is where the first goes, and is moved behind the last.
    pub(crate) fn pages(&self, runs: &[Run], ends: &mut Ends) -> Result<Vec<Vec<u8>>, BakeError> {
        let read = |run: &Run| self.drafts.drafts[run.draft].pages(run.pages.clone());
        let mut all: Vec<Vec<u8>> = runs.par_iter().map(read).collect::<Result<_, _>>()?;
        let mut starts = Vec::new();
        for pages in &all {
            for page in pages.as_chunks::<PAGE>().0 {
                starts.push(*ends);
                let header = Page::new(page, self.drafts.profile).header();
                ends.pages += 1;
                ends.leaf_lines += u64::from(header.leaf_lines.get());
                ends.id_words += u64::from(header.id_words.get());
                ends.packets += u64::from(header.packets.get());
            }
        }
        let bases = runs.iter().map(|run| self.bases[run.draft] as u32);
        let pages = all.iter_mut().zip(bases).flat_map(|(pages, base)| {
            pages.as_chunks_mut::<PAGE>().0.iter_mut().map(move |page| (page, base))
        });
        let pages: Vec<_> = pages.zip(starts).collect();
        pages.into_par_iter().for_each(|((page, base), at)| self.put_numbers(page, base, at));
        Ok(all)
    }

    /// `base` is the number of the draft's first page over all drafts.
    fn put_numbers(&self, bytes: &mut [u8; PAGE], base: u32, at: Ends) {
        let profile = self.drafts.profile;
        let page = Page::new(bytes, profile);
        let mut header = *page.header();
        let own = base + header.page_number.get();
        let parent = |root: u8| match page.anchor_parent(root) {
            (NO_PARENT, _) => self.drafts.parents.get(&(own, root)).copied(),
            (parent, link) => Some((base + parent, link)),
        };
        let parents: Vec<Option<Parent>> = (0..header.roots).map(parent).collect();
        let remotes: Vec<RootRef> = (0..header.remotes).map(|link| page.remote(link)).collect();
        header.page_number = self.number(own).into();
        header.leaf_line = at.leaf_lines.into();
        header.id_word = if header.id_words.get() == 0 { 0 } else { at.id_words }.into();
        header.first_packet = (at.packets as u32).into();
        bytes[..64].copy_from_slice(header.as_bytes());
        let anchor = profile.anchor_bytes();
        for (root, parent) in parents.into_iter().enumerate() {
            let end = 64 + (root + 1) * anchor;
            if let Some((page, link)) = parent {
                bytes[end - 8..end - 4].copy_from_slice(&self.number(page).to_le_bytes());
                bytes[end - 4] = link;
            }
        }
        let table = 64 + usize::from(header.roots) * anchor;
        for (link, to) in remotes.into_iter().enumerate() {
            let to = RootRef::new(self.number(base + to.page()), to.root());
            bytes[table + 4 * link..][..4].copy_from_slice(&to.0.to_le_bytes());
        }
        let sum = page_checksum(bytes);
        bytes[..8].copy_from_slice(&sum.to_le_bytes());
    }
}
