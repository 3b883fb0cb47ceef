//! Goes through the pages of a file from the last to the first, some at a time, and checks all about them.
//!
//! Links lead to later pages. Of a page that has been seen only the subtree roots are kept, each with its tight k-DOP
//! and the link that it names, until that link comes by. There are few of them at any time, since bricks follow
//! one after the other: the memory this takes hardly grows with the file.

use super::first_error;
use crate::bake::Stage;
use crate::error::BakeError;
use crate::progress::{Progress, Step, WHOLE};
use crate::target::Source;
use bvh_format::bounds::{Inflation, check_bounds_of};
use bvh_format::checksum::Hasher;
use bvh_format::header::{Section, SectionKind};
use bvh_format::ids::WORD;
use bvh_format::kdop::Kdop;
use bvh_format::layout::ContentHasher;
use bvh_format::leaf::LINE;
use bvh_format::object::Object;
use bvh_format::page::{NO_PARENT, PAGE, Page, PageHeader, RootRef};
use bvh_format::profile::Profile;
use bvh_format::validate::{Counts, CountsFromEnd, validate_page_of};
use bvh_format::{FormatError, Layout, Rule};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

/// Pages that are in memory at a time.
const PAGES: u32 = 256;
/// No page has larger blocks: 435 packets of 144 bytes.
const MOST_BLOCK_BYTES: usize = 1 << 16;
/// Bytes of a section that are in memory at a time.
const SECTION_BYTES: usize = 4 << 20;

/// Validates a whole file and checks its bounds; returns how loose they are.
pub(crate) fn prove(source: Source, progress: &Progress) -> Result<(Layout, Inflation), BakeError> {
    let layout = Layout::read_with(source.length(), |range| source.read(range))?;
    let pages = || {
        let mut inflation = Inflation::default();
        for object in &layout.objects {
            inflation.join(&prove_object(&layout, source, object, true, progress)?);
        }
        Ok::<_, BakeError>(inflation)
    };
    let (sections, pages) = rayon::join(|| check_sections(&layout, source), pages);
    sections?;
    let inflation = pages?;
    Ok((layout, inflation))
}

/// Checks the checksums of all sections and of the content, and the order of duplicates.
fn check_sections(layout: &Layout, source: Source) -> Result<(), BakeError> {
    let mut content = ContentHasher::default();
    for Section { kind, range, checksum } in &layout.sections {
        let mut hasher = Hasher::default();
        let mut last = None;
        if kind.is_content() {
            content.begin(*kind, range.len() as u64);
        }
        for start in range.clone().step_by(SECTION_BYTES) {
            let bytes = source.read(start..(start + SECTION_BYTES).min(range.end))?;
            let hash_content = || {
                if kind.is_content() {
                    content.update(&bytes);
                }
            };
            rayon::join(|| hasher.update(&bytes), hash_content);
            if *kind == SectionKind::Duplicates {
                for pair in bytes.as_chunks::<8>().0 {
                    let (kept, dropped) = pair.split_at(4);
                    let id = |bytes: &[u8]| bytes.iter().rev().fold(0, |id, &byte| id << 8 | u32::from(byte));
                    let pair = Some([id(kept), id(dropped)]);
                    if last >= pair || kept == dropped {
                        let at = start as u64;
                        return Err(
                            FormatError::new(Rule::DuplicateIds, at, "ascending pairs", "others").into()
                        );
                    }
                    last = pair;
                }
            }
        }
        require_checksum(range.start as u64, *checksum, hasher.finish())?;
    }
    require_checksum(24, layout.content_checksum, content.finish())
}

fn require_checksum(at: u64, stated: u64, found: u64) -> Result<(), BakeError> {
    let hex = |sum: u64| format!("{sum:016x}");
    if stated == found {
        return Ok(());
    }
    Err(FormatError::new(Rule::SectionChecksum, at, hex(stated), hex(found)).into())
}

/// A subtree root whose link has not come by yet.
struct Root {
    kdop: Kdop,
    parent: (u32, u8),
}

/// Checks the bounds of an object, and, unless that has been done, everything else about its pages.
pub(super) fn prove_object(
    layout: &Layout,
    source: Source,
    object: &Object,
    structure: bool,
    progress: &Progress,
) -> Result<Inflation, BakeError> {
    let pages = object.pages();
    let mut walk = Walk { layout, object, roots: HashMap::new(), inflation: Inflation::default() };
    let (triangles, count) = (object.record.triangles.get(), (pages.end - pages.start).into());
    let tally = progress.tally(Step::Bake(Stage::Prove), WHOLE, triangles, count);
    let mut counts = CountsFromEnd::default();
    let mut end = pages.end;
    while end > pages.start {
        let start = end.saturating_sub(PAGES).max(pages.start);
        let window = Window::read(layout, source, start..end)?;
        if structure {
            let checked = (start..end).into_par_iter().map(|number| {
                let page = window.page(number, object);
                validate_page_of(layout, object, number, &page, window.blocks(page.header()))
            });
            let checked: Vec<Counts> = first_error(checked)?;
            for (number, page) in (start..end).zip(&checked).rev() {
                counts.add(layout, number, page)?;
            }
        }
        walk.go_through(&window, start..end)?;
        tally.add((end - start).into());
        end = start;
    }
    if structure {
        counts.finish(layout, object)?;
    }
    walk.finish()
}

struct Walk<'a> {
    layout: &'a Layout,
    object: &'a Object,
    /// Those of the pages seen.
    roots: HashMap<RootRef, Root>,
    inflation: Inflation,
}

impl Walk<'_> {
    fn go_through(&mut self, window: &Window, pages: Range<u32>) -> Result<(), FormatError> {
        // Runs of pages from the end whose remote links all lead behind the run are independent.
        let mut stop = pages.end;
        while stop > pages.start {
            let mut start = stop;
            while start > pages.start {
                let page = window.page(start - 1, self.object);
                if (0..page.header().remotes).any(|link| page.remote(link).page() < stop) {
                    break;
                }
                start -= 1;
            }
            // A link to an earlier page is refused by the structural checks; a hostile one ends here.
            if start == stop {
                let at = self.layout.page_offset(stop - 1);
                return Err(FormatError::new(Rule::RemoteLinks, at, "links to later pages", "another"));
            }
            let below = |root: RootRef| self.roots.get(&root).map_or(Kdop::EMPTY, |root| root.kdop);
            let check = |number: u32| {
                let page = window.page(number, self.object);
                let [leaves, _] = window.blocks(page.header());
                check_bounds_of(self.layout, self.object, &page, leaves, below)
            };
            let results = first_error((start..stop).into_par_iter().map(check))?;
            for (number, (tight, sums)) in (start..stop).zip(results).rev() {
                self.inflation.join(&sums);
                let page = window.page(number, self.object);
                self.follow_links(&page, number)?;
                for (root, kdop) in (0..).zip(tight) {
                    let parent = page.anchor_parent(root);
                    self.roots.insert(RootRef::new(number, root), Root { kdop, parent });
                }
            }
            stop = start;
        }
        Ok(())
    }

    /// Each root that the links lead to names the link; its part is over.
    fn follow_links(&mut self, page: &Page, number: u32) -> Result<(), FormatError> {
        for link in 0..page.header().remotes {
            let to = page.remote(link);
            let found = self.roots.remove(&to).map(|root| root.parent);
            if found != Some((number, link)) {
                let at = self.layout.page_offset(to.page());
                let expected = format!("root {} with parent {number}, link {link}", to.root());
                return Err(FormatError::new(Rule::AnchorParent, at, expected, format!("{found:?}")));
            }
        }
        Ok(())
    }

    /// What is left is the object's root.
    fn finish(self) -> Result<Inflation, BakeError> {
        let record = &self.object.record;
        let first = record.first_page.get();
        let at = self.layout.page_offset(first);
        let root = self.roots.get(&RootRef::new(first, 0)).filter(|root| root.parent == (NO_PARENT, 0));
        let Some(root) = root.filter(|_| self.roots.len() == 1) else {
            let found = format!("{} roots without a link", self.roots.len());
            return Err(
                FormatError::new(Rule::AnchorParent, at, "the object's root and no other", found).into()
            );
        };
        let kdop = &root.kdop;
        let inside =
            (0..3).all(|a| record.box_lo[a].get() <= kdop.lo[a] && kdop.hi[a] <= record.box_hi[a].get());
        if !inside {
            let expected = "the object's box to contain its triangles";
            return Err(FormatError::new(Rule::BoundContains, at, expected, format!("{record:?}")).into());
        }
        Ok(self.inflation)
    }
}

/// Some pages with their blocks.
struct Window<'a> {
    first: u32,
    nodes: Cow<'a, [u8]>,
    leaves: Blocks<'a>,
    ids: Blocks<'a>,
}

impl<'a> Window<'a> {
    fn read(layout: &Layout, source: Source<'a>, pages: Range<u32>) -> Result<Self, BakeError> {
        let section = |kind| {
            let section = layout.sections.iter().find(|section| section.kind == kind);
            section.map_or(0..0, |section| section.range.clone())
        };
        let at = |page: u32| layout.page_offset(page) as usize;
        let nodes = source.read(at(pages.start)..at(pages.end))?;
        let leaf = |header: &PageHeader| (header.leaf_line.get(), header.leaf_lines.get());
        let id = |header: &PageHeader| (header.id_word.get(), header.id_words.get());
        let leaves = Blocks::read(source, &nodes, section(SectionKind::Leaves), LINE, leaf)?;
        let ids = Blocks::read(source, &nodes, section(SectionKind::Ids), WORD, id)?;
        Ok(Self { first: pages.start, nodes, leaves, ids })
    }

    fn page(&self, number: u32, object: &Object) -> Page<'_> {
        const NONE: &[u8; PAGE] = &[0; PAGE];
        let page = self.nodes.as_chunks::<PAGE>().0.get((number - self.first) as usize);
        Page::new(page.unwrap_or(NONE), object.profile)
    }

    /// The leaf block and the id block of a page; empty if they are not where they should be.
    fn blocks(&self, header: &PageHeader) -> [&[u8]; 2] {
        [
            self.leaves.block(header.leaf_line.get(), header.leaf_lines.get()),
            self.ids.block(header.id_word.get(), header.id_words.get()),
        ]
    }
}

/// The blocks of some pages, which follow each other in a section.
struct Blocks<'a> {
    bytes: Cow<'a, [u8]>,
    /// The first unit of the section that is here.
    first: u64,
    unit: usize,
}

impl<'a> Blocks<'a> {
    fn read(
        source: Source<'a>,
        nodes: &[u8],
        section: Range<usize>,
        unit: usize,
        place: impl Fn(&PageHeader) -> (u64, u32),
    ) -> Result<Self, BakeError> {
        let pages = nodes.as_chunks::<PAGE>().0;
        // The profile plays no part in the header.
        let headers = pages.iter().map(|page| *Page::new(page, Profile::Dop14U8).header());
        let places = headers.map(|header| place(&header)).filter(|(_, count)| *count > 0);
        let (mut first, mut end) = (u64::MAX, 0);
        for (start, count) in places {
            (first, end) = (first.min(start), end.max(start.saturating_add(count.into())));
        }
        let units = (section.len() / unit) as u64;
        let nowhere = Self { bytes: Cow::Borrowed(&[]), first: 0, unit };
        if first >= end || end > units || (end - first) as usize * unit > pages.len() * MOST_BLOCK_BYTES {
            return Ok(nowhere);
        }
        let at = |place: u64| section.start + place as usize * unit;
        Ok(Self { bytes: source.read(at(first)..at(end))?, first, unit })
    }

    fn block(&self, start: u64, count: u32) -> &[u8] {
        let start = start.checked_sub(self.first).and_then(|start| (start as usize).checked_mul(self.unit));
        let end = start.and_then(|start| start.checked_add(count as usize * self.unit));
        match (start, end) {
            (Some(start), Some(end)) => self.bytes.get(start..end).unwrap_or(&[]),
            _ => &[],
        }
    }
}
