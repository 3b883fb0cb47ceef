//! Statistics of an object's tree by level: counts, and the width of decoded slabs relative to tight ones.
//!
//! Links lead to later pages only, so that two passes are enough: forwards for the levels, and backwards for the tight
//! bounds below each subtree root. Memory holds one page with its leaf block, the levels of the roots, and the bounds of
//! the roots whose link has not been reached: few, as in the proof of a bake.

use super::Contents;
use bvh_bake::FileError;
use bvh_format::bounds::{Inflation, Subtree, visit_bounds};
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef};
use bvh_format::treelet::{Child, Links};
use bvh_format::{FormatError, Rule};
use std::collections::{BTreeMap, HashMap};

/// The treelets of one level. The root has level 0.
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

    /// Returns the mean of decoded width over tight width, or 1 if there is nothing to measure.
    pub(super) fn mean_width(&self) -> f64 {
        self.inflation.mean_width()
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
        let mut root_levels = RootLevels::default();
        for number in object.pages() {
            let bytes = contents.checked(object, number)?;
            let page = bytes.page(object);
            let header = page.header();
            layout.check_leaf_block_of(&layout.read_leaf_block(file, header)?, &page, object)?;
            statistics.lines += header.shape().lines(object.profile()) as u64;
            statistics.roots += u64::from(header.roots);
            let levels = slot_levels(&page, &root_levels.advance(number, header.roots));
            for slot in 0..header.treelets {
                let level = levels[usize::from(slot)];
                let links = page.links(slot);
                statistics.count(level, &links);
                for child in 0..links.children() {
                    if let Child::Remote(link) = links.child(child) {
                        root_levels.set(page.remote(link), level + 1);
                    }
                }
            }
            file.require_memory(root_levels.bytes())?;
        }
        let slabs = object.profile().directions().slabs();
        // The bounds of roots whose link has not been reached.
        let mut below: HashMap<RootRef, Subtree> = HashMap::new();
        for number in object.pages().rev() {
            let bytes = contents.checked(object, number)?;
            let page = bytes.page(object);
            let levels = slot_levels(&page, &root_levels.retreat(page.header().roots));
            let leaves = layout.read_leaf_block(file, page.header())?;
            let known = |to: RootRef| below.get(&to).unwrap_or(Subtree::unknown());
            let subtrees = visit_bounds(object, &page, leaves.bytes(), known, |bound| {
                if bound.child.is_some() {
                    let level = statistics.level(levels[usize::from(bound.slot)]);
                    level.inflation.add(&bound.decoded, &bound.tight, slabs);
                }
                Ok(())
            })?;
            for link in 0..page.header().remotes {
                below.remove(&page.remote(link));
            }
            below.extend((0..).map(|root| RootRef::new(number, root)).zip(subtrees));
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

/// Returns the level of each slot of a page, given the levels of its roots.
fn slot_levels(page: &Page, roots: &[usize]) -> Vec<usize> {
    let header = page.header();
    let mut levels = vec![0; usize::from(header.treelets)];
    for root in 0..usize::from(header.roots) {
        levels[root] = roots.get(root).copied().unwrap_or(0);
    }
    for slot in 0..header.treelets {
        let links = page.links(slot);
        for child in 0..links.children() {
            if let Child::Treelet(inner) = links.child(child) {
                levels[usize::from(inner)] = levels[usize::from(slot)] + 1;
            }
        }
    }
    levels
}

/// The levels of the roots of all pages up to the current one, and of known roots after it.
#[derive(Default)]
struct RootLevels {
    /// The levels of roots in later pages.
    ahead: BTreeMap<RootRef, usize>,
    /// The levels of roots in earlier pages, in order; `DEEP` stands for the next level in `deep`.
    passed: Vec<u8>,
    deep: Vec<usize>,
}

/// Marks a level that is too large for a byte.
const DEEP: u8 = u8::MAX;

impl RootLevels {
    /// Notes the level of a root that a link leads to. The last link counts; only damaged files have several.
    fn set(&mut self, to: RootRef, level: usize) {
        self.ahead.insert(to, level);
    }

    /// Advances to the next page and returns the levels of its roots. A root without a link counts as the root of the
    /// tree.
    fn advance(&mut self, page: u32, roots: u8) -> Vec<usize> {
        let mut levels = vec![0; usize::from(roots)];
        while let Some(first) = self.ahead.first_entry().filter(|first| first.key().page() <= page) {
            let (to, level) = first.remove_entry();
            if let Some(of_root) = levels.get_mut(usize::from(to.root())) {
                *of_root = level;
            }
        }
        for &level in &levels {
            let small = u8::try_from(level).unwrap_or(DEEP);
            self.passed.push(small);
            if small == DEEP {
                self.deep.push(level);
            }
        }
        levels
    }

    /// Goes back by one page and returns the levels of its roots.
    fn retreat(&mut self, roots: u8) -> Vec<usize> {
        let mut levels = self.passed.split_off(self.passed.len().saturating_sub(roots.into()));
        let of_root = |small: u8| match small {
            DEEP => self.deep.pop().unwrap_or(0),
            level => level.into(),
        };
        levels.reverse();
        let mut levels: Vec<usize> = levels.into_iter().map(of_root).collect();
        levels.reverse();
        levels
    }

    /// Returns the bytes of memory that the levels of earlier pages take.
    fn bytes(&self) -> usize {
        self.passed.len() + self.deep.len() * size_of::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_the_same_in_both_directions() {
        let mut levels = RootLevels::default();
        let mut all = Vec::new();
        for page in 0..100 {
            for root in 0..page as u8 % 5 {
                levels.set(RootRef::new(page + 1 + u32::from(root) % 3, root), (page * page) as usize);
            }
            let roots = 1 + page as u8 % 4;
            let passed = levels.advance(page, roots);
            assert_eq!(passed.len(), usize::from(roots));
            all.push(passed);
        }
        assert_eq!(all[0], [0]);
        // Page 2 led to roots 0 and 1 of pages 3 and 4.
        assert_eq!((all[3][0], all[4][0]), (4, 9));
        assert!(all.iter().flatten().any(|&level| level > 255));
        for passed in all.into_iter().rev() {
            assert_eq!(levels.retreat(passed.len() as u8), passed);
        }
        assert_eq!(levels.bytes(), 0);
    }
}
