//! Counts of an object's tree by level, and how loose its slabs are there.
//!
//! Two passes over the pages, since links only lead to later pages: forwards for the levels, backwards for
//! the tight bounds of what is below each subtree root.

use super::checked;
use bvh_format::bounds::{Inflation, visit_bounds};
use bvh_format::kdop::Kdop;
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef};
use bvh_format::treelet::{Child, Links};
use bvh_format::{FormatError, Rule};
use bvh_query::Bvh;

/// The treelets of one level; the root's is level 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Level {
    pub(super) treelets: u64,
    children: u64,
    pub(super) packets: u64,
    triangles: u64,
    inflation: Inflation,
}

impl Level {
    pub(super) fn joined(self, other: &Self) -> Self {
        let mut inflation = self.inflation;
        inflation.join(&other.inflation);
        Self {
            treelets: self.treelets + other.treelets,
            children: self.children + other.children,
            packets: self.packets + other.packets,
            triangles: self.triangles + other.triangles,
            inflation,
        }
    }

    pub(super) fn mean_children(&self) -> f64 {
        mean(self.children as f64, self.treelets)
    }

    pub(super) fn mean_triangles(&self) -> f64 {
        mean(self.triangles as f64, self.packets)
    }

    /// Decoded width by tight width; 1 where there is nothing to measure.
    pub(super) fn mean_width(&self) -> f64 {
        self.inflation.mean_width()
    }
}

fn mean(sum: f64, count: u64) -> f64 {
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// Counts of one object.
pub(super) struct Statistics {
    pub(super) levels: Vec<Level>,
    /// Lines of 64 bytes in use in all pages.
    pub(super) lines: u64,
    pub(super) roots: u64,
}

impl Statistics {
    pub(super) fn gather(bvh: &Bvh, object: &Object) -> Result<Self, FormatError> {
        let first = object.record.first_page.get();
        let end = first + object.record.pages.get();
        let mut statistics = Self { levels: Vec::new(), lines: 0, roots: 0 };
        // Levels of each page's roots; a root that no link leads to counts as the tree's.
        let mut root_levels: Vec<Vec<usize>> = vec![Vec::new(); (end - first) as usize];
        for number in first..end {
            let page = checked(bvh, object, number)?;
            let header = page.header();
            bvh.layout().check_leaf_block(bvh.bytes(), &page, object)?;
            let treelet_lines = usize::from(header.treelets) * object.profile.treelet_bytes() / 64;
            statistics.lines += u64::from(header.treelet_line) + treelet_lines as u64;
            statistics.roots += u64::from(header.roots);
            let levels = slot_levels(&page, &root_levels[(number - first) as usize]);
            for slot in 0..header.treelets {
                let level = levels[usize::from(slot)];
                let links = Links::read(page.treelet(slot));
                statistics.count(level, &links);
                for child in 0..links.children() {
                    if let Child::Remote(link) = links.child(child) {
                        let to = page.remote(link);
                        // The page check has made sure that it is a later one of the object.
                        let target = &mut root_levels[(to.page() - first) as usize];
                        let root = usize::from(to.root());
                        target.resize(target.len().max(root + 1), 0);
                        target[root] = level + 1;
                    }
                }
            }
        }
        let slabs = object.profile.directions().slabs();
        let mut below: Vec<Vec<Kdop>> = vec![Vec::new(); (end - first) as usize];
        for number in (first..end).rev() {
            let page = checked(bvh, object, number)?;
            let levels = slot_levels(&page, &root_levels[(number - first) as usize]);
            let known = |to: RootRef| {
                let roots = below.get((to.page() - first) as usize);
                roots.and_then(|roots| roots.get(usize::from(to.root()))).copied().unwrap_or(Kdop::EMPTY)
            };
            let tight = visit_bounds(bvh.layout(), bvh.bytes(), object, &page, known, |bound| {
                if bound.child.is_some() {
                    let level = statistics.level(levels[usize::from(bound.slot)]);
                    level.inflation.add(&bound.decoded, &bound.tight, slabs);
                }
                Ok(())
            })?;
            below[(number - first) as usize] = tight;
        }
        if statistics.levels.is_empty() {
            let at = bvh.layout().page_offset(first);
            return Err(FormatError::new(Rule::Counts, at, "a treelet", "none"));
        }
        Ok(statistics)
    }

    fn level(&mut self, level: usize) -> &mut Level {
        if self.levels.len() <= level {
            self.levels.resize(level + 1, Level::default());
        }
        &mut self.levels[level]
    }

    fn count(&mut self, level: usize, links: &Links) {
        let level = self.level(level);
        level.treelets += 1;
        for child in 0..links.children() {
            level.children += 1;
            if let Child::Leaf { triangles, .. } = links.child(child) {
                level.packets += 1;
                level.triangles += u64::from(triangles);
            }
        }
    }
}

/// The level of each slot of a page from those of its roots.
fn slot_levels(page: &Page, roots: &[usize]) -> Vec<usize> {
    let header = page.header();
    let mut levels = vec![0; usize::from(header.treelets)];
    for root in 0..usize::from(header.roots) {
        levels[root] = roots.get(root).copied().unwrap_or(0);
    }
    for slot in 0..header.treelets {
        let links = Links::read(page.treelet(slot));
        for child in 0..links.children() {
            if let Child::Treelet(inner) = links.child(child) {
                levels[usize::from(inner)] = levels[usize::from(slot)] + 1;
            }
        }
    }
    levels
}
