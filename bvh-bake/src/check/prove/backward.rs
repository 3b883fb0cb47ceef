//! Checks the pages of a file from the last to the first, a run of pages at a time.
//!
//! Links lead to later pages. After a page has been checked, only its subtree roots are kept, until the walk reaches
//! the links that they name. A root is kept with its tight k-DOP, its link and, if there are few, its triangles. Since
//! bricks follow one after the other, only few roots wait at any time, and the memory for them hardly grows with the
//! file.

use super::InParallel;
use crate::progress::{Progress, Stage, Step};
use crate::threads;
use bvh_format::bounds::{Inflation, Subtree, check_bounds, check_box, has_turning_slabs};
use bvh_format::object::Object;
use bvh_format::page::{NO_PARENT, Page, RootRef, check_named_link};
use bvh_format::source::{Block, PageBytes, Source};
use bvh_format::topology::ObjectTopology;
use bvh_format::validate::check_in_pages;
use bvh_format::validate::{Counts, Workers, check_sections, validate_page};
use bvh_format::{FormatError, Layout, Rule};
use std::collections::HashMap;
use std::ops::Range;

/// Pages that are read, checked and then walked through together.
const PAGES_PER_WINDOW: u32 = 128;

/// Validates a whole file and checks its bounds. Returns how much wider the bounds are than the tight ones.
pub(crate) fn prove<S: Source>(source: &S, progress: &Progress) -> Result<(Layout, Inflation), S::Error> {
    let layout = Layout::read_from(source)?;
    let pages = || {
        // Records that break a rule break it in `check_sections` as well, whose error comes first.
        let topology = layout.read_topology(source)?;
        let mut inflation = Inflation::default();
        progress.expect(Step::Bake(Stage::Prove), layout.page_count().into());
        for (number, object) in layout.objects.iter().enumerate() {
            let structure = Structure { topology: topology.get(number) };
            inflation.join(&prove_object(&layout, source, object, Some(structure), progress)?);
        }
        Ok::<_, S::Error>(inflation)
    };
    let pays = layout.page_count() > 1;
    let (sections, inflation) = threads::join_if(pays, || check_sections(&layout, source), pages);
    sections?;
    let inflation = inflation?;
    Ok((layout, inflation))
}

/// A subtree root whose link the walk has not reached yet.
struct Root {
    subtree: Subtree,
    parent: (u32, u8),
}

/// Pages that follow each other, with their leaf blocks.
struct Window<'a> {
    first: u32,
    pages: Vec<(PageBytes<'a>, Block<'a>)>,
}

impl Window<'_> {
    fn page(&self, number: u32, object: &Object) -> (Page<'_>, &[u8]) {
        let (bytes, leaves) = &self.pages[(number - self.first) as usize];
        (bytes.page(object), leaves.bytes())
    }
}

/// The checks of everything but bounds.
pub(super) struct Structure<'a> {
    /// What the file states about the topology of the object.
    topology: Option<&'a ObjectTopology>,
}

/// Checks the bounds of an object and, unless the caller has done so, everything else about its pages.
pub(super) fn prove_object<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    structure: Option<Structure>,
    progress: &Progress,
) -> Result<Inflation, S::Error> {
    // A turning slab is compared with all triangles below. They are kept from page to page only if the last page, which is at the
    // bottom of the tree, has such slabs. Where others than the last have them, the pages are checked once more.
    let last = layout.read_page(source, object.pages().end.saturating_sub(1))?;
    let may_turn = has_turning_slabs(&last.page(object));
    if let Some(inflation) = prove_pages(layout, source, object, &structure, may_turn, progress)? {
        return Ok(inflation);
    }
    let inflation = prove_pages(layout, source, object, &structure, true, progress)?;
    Ok(inflation.expect("all triangles are kept"))
}

/// Checks an object as [`prove_object`] does. Returns `None` if it comes upon a turning slab that it may not.
fn prove_pages<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    structure: &Option<Structure>,
    may_turn: bool,
    progress: &Progress,
) -> Result<Option<Inflation>, S::Error> {
    let pages = object.pages();
    let mut walk = Walk { layout, object, may_turn, roots: HashMap::new(), inflation: Inflation::default() };
    let mut counts = Counts::default();
    let (topology, mut boundary) = (structure.as_ref().and_then(|structure| structure.topology), 0u64);
    let closed = topology.is_some_and(|topology| topology.closed);
    let mut end = pages.end;
    while end > pages.start {
        let start = end.saturating_sub(PAGES_PER_WINDOW).max(pages.start);
        let window: Vec<_> = if structure.is_some() {
            let validate = |number| validate_page(layout, source, object, closed, number);
            let checked = InParallel.each(start..end, validate)?;
            for page in checked.iter().rev() {
                counts = page.counts.followed_by(&counts, layout)?;
                boundary = boundary.wrapping_add(page.boundary);
            }
            checked.into_iter().map(|page| (page.bytes, page.leaves)).collect()
        } else {
            InParallel.each(start..end, |number| {
                let bytes = layout.read_page(source, number)?;
                let leaves = layout.read_leaf_block(source, bytes.page(object).header())?;
                Ok::<_, S::Error>((bytes, leaves))
            })?
        };
        if !may_turn && window.iter().any(|(bytes, _)| has_turning_slabs(&bytes.page(object))) {
            return Ok(None);
        }
        walk.go_through(&Window { first: start, pages: window }, start..end)?;
        progress.add(Step::Bake(Stage::Prove), (end - start).into());
        end = start;
    }
    if structure.is_some() {
        counts.check(layout, object)?;
    }
    if let Some(topology) = topology {
        check_in_pages(layout, source, object, topology, boundary)?;
    }
    Ok(Some(walk.finish()?))
}

struct Walk<'a> {
    layout: &'a Layout,
    object: &'a Object,
    /// Whether children may have turning slabs.
    may_turn: bool,
    /// Roots of the pages that have been checked, until their links are reached.
    roots: HashMap<RootRef, Root>,
    inflation: Inflation,
}

impl Walk<'_> {
    fn go_through(&mut self, window: &Window, pages: Range<u32>) -> Result<(), FormatError> {
        // Runs of pages from the end are independent if all their remote links lead to pages after the run.
        let mut stop = pages.end;
        while stop > pages.start {
            let mut start = stop;
            while start > pages.start {
                let (page, _) = window.page(start - 1, self.object);
                if (0..page.header().remotes).any(|link| page.remote(link).page() < stop) {
                    break;
                }
                start -= 1;
            }
            // The structural checks refuse a link to an earlier page. Where they were skipped, a forged one is refused
            // here.
            if start == stop {
                let at = self.layout.page_offset(stop - 1);
                return Err(FormatError::new(Rule::RemoteLinks, at, "links to later pages", "another"));
            }
            let below =
                |root: RootRef| self.roots.get(&root).map_or(Subtree::unknown(), |root| &root.subtree);
            let check = |number: u32| {
                let (page, leaves) = window.page(number, self.object);
                check_bounds(self.layout, self.object, &page, leaves, self.may_turn, below)
            };
            let results = InParallel.each(start..stop, check)?;
            for (number, (subtrees, sums)) in (start..stop).zip(results).rev() {
                self.inflation.join(&sums);
                let (page, _) = window.page(number, self.object);
                self.follow_links(&page, number)?;
                for (root, subtree) in (0..).zip(subtrees) {
                    let parent = page.anchor_parent(root);
                    self.roots.insert(RootRef::new(number, root), Root { subtree, parent });
                }
            }
            stop = start;
        }
        Ok(())
    }

    /// Checks that each root to which a link of the page leads names that link, and forgets the root.
    fn follow_links(&mut self, page: &Page, number: u32) -> Result<(), FormatError> {
        for link in 0..page.header().remotes {
            let to = page.remote(link);
            let found = self.roots.remove(&to).map_or((NO_PARENT, 0), |root| root.parent);
            check_named_link(found, to, (number, link), self.layout.page_offset(to.page()))?;
        }
        Ok(())
    }

    /// Checks that one root is left, the object's, and that the object's box contains it.
    fn finish(self) -> Result<Inflation, FormatError> {
        let record = self.object.record();
        let first = record.first_page.get();
        let at = self.layout.page_offset(first);
        let root = self.roots.get(&RootRef::new(first, 0)).filter(|root| root.parent == (NO_PARENT, 0));
        let Some(root) = root.filter(|_| self.roots.len() == 1) else {
            let found = format!("{} roots without a link", self.roots.len());
            return Err(FormatError::new(Rule::AnchorParent, at, "the object's root and no other", found));
        };
        check_box(self.layout, self.object, &root.subtree)?;
        Ok(self.inflation)
    }
}
