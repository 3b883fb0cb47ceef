//! Statistics of an object's tree by level: counts of treelets, children, packets and triangles.
//!
//! Links lead only to later pages, so one pass is enough. Memory holds one page with its leaf block, and the levels of
//! roots in pages that have not been reached.

use super::{Contents, children};
use bvh_bake::FileError;
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef};
use bvh_format::treelet::Child;
use bvh_format::{FormatError, Rule};
use std::collections::BTreeMap;

/// The bytes of memory that the level of a root takes until its page is reached.
const BYTES_PER_ROOT: usize = 64;

/// The treelets of one level. The root has level 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Level {
    pub(super) treelets: u64,
    children: u64,
    pub(super) packets: u64,
    triangles: u64,
}

impl Level {
    pub(super) fn joined(self, other: &Self) -> Self {
        Self {
            treelets: self.treelets + other.treelets,
            children: self.children + other.children,
            packets: self.packets + other.packets,
            triangles: self.triangles + other.triangles,
        }
    }

    pub(super) fn mean_children(&self) -> f64 {
        mean(self.children as f64, self.treelets)
    }

    pub(super) fn mean_triangles(&self) -> f64 {
        mean(self.triangles as f64, self.packets)
    }
}

fn mean(sum: f64, count: u64) -> f64 {
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// The statistics of one object.
pub(super) struct Statistics {
    pub(super) levels: Vec<Level>,
    /// The 64-byte lines in use in all pages.
    pub(super) lines: u64,
    pub(super) roots: u64,
}

impl Statistics {
    pub(super) fn gather(contents: &Contents, object: &Object) -> Result<Self, FileError> {
        let Contents { file, layout } = contents;
        let mut statistics = Self { levels: Vec::new(), lines: 0, roots: 0 };
        // The levels of roots in later pages. The last link to a root counts; only damaged files have several.
        let mut ahead: BTreeMap<RootRef, usize> = BTreeMap::new();
        for number in object.pages() {
            let bytes = contents.checked(object, number)?;
            let page = bytes.page(object);
            let header = page.header();
            layout.check_leaf_block_of(&layout.read_leaf_block(file, header)?, &page, object)?;
            statistics.lines += header.shape().lines(object.profile()) as u64;
            statistics.roots += u64::from(header.roots);
            let roots = levels_of_roots(&mut ahead, number, header.roots);
            let levels = slot_levels(&page, &roots);
            for slot in 0..header.treelets {
                let level = levels[usize::from(slot)];
                let counted = statistics.level(level);
                counted.treelets += 1;
                for (_, child) in children(&page, slot) {
                    counted.children += 1;
                    if let Child::Leaf { triangles, .. } = child {
                        counted.packets += 1;
                        counted.triangles += u64::from(triangles);
                    } else if let Child::Remote(link) = child {
                        ahead.insert(page.remote(link), level + 1);
                    }
                }
            }
            file.require_memory(ahead.len() * BYTES_PER_ROOT)?;
        }
        if statistics.levels.is_empty() {
            let at = layout.page_offset(object.record().first_page.get());
            return Err(FormatError::new(Rule::Counts, at, "a treelet", "none").into());
        }
        Ok(statistics)
    }

    fn level(&mut self, level: usize) -> &mut Level {
        if self.levels.len() <= level {
            self.levels.resize(level + 1, Level::default());
        }
        &mut self.levels[level]
    }
}

/// Returns the level of each slot of a page, given the levels of its roots.
fn slot_levels(page: &Page, roots: &[usize]) -> Vec<usize> {
    let header = page.header();
    let mut levels = roots.to_vec();
    levels.resize(usize::from(header.treelets), 0);
    for slot in 0..header.treelets {
        for (_, child) in children(page, slot) {
            if let Child::Treelet(inner) = child {
                levels[usize::from(inner)] = levels[usize::from(slot)] + 1;
            }
        }
    }
    levels
}

/// Takes out the levels of the roots of a page. A root without a link counts as the root of the tree.
fn levels_of_roots(ahead: &mut BTreeMap<RootRef, usize>, page: u32, roots: u8) -> Vec<usize> {
    let mut levels = vec![0; usize::from(roots)];
    while let Some(first) = ahead.first_entry().filter(|first| first.key().page() <= page) {
        let (to, level) = first.remove_entry();
        if let Some(of_root) = levels.get_mut(usize::from(to.root())) {
            *of_root = level;
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_have_the_level_of_their_link() {
        let at = RootRef::new;
        let mut ahead = BTreeMap::from([(at(1, 0), 3), (at(2, 1), 300), (at(2, 9), 7), (at(3, 0), 5)]);
        assert_eq!(levels_of_roots(&mut ahead, 0, 1), [0]);
        assert_eq!(levels_of_roots(&mut ahead, 1, 2), [3, 0]);
        // A root that the page does not have is dropped.
        assert_eq!(levels_of_roots(&mut ahead, 2, 2), [0, 300]);
        assert_eq!(ahead.len(), 1);
    }
}
