//! The levels of an object's subtree roots: found from the first page to the last, and read again from last to first.
//!
//! Links lead to later pages, so that the level of a root is known when its page is reached. Levels of pages behind are
//! kept as one byte per root, which is about a ten thousandth of the file.

use bvh_format::page::RootRef;
use std::collections::BTreeMap;

/// The levels of the roots of all pages up to the current one, and of known roots after it.
#[derive(Default)]
pub(super) struct RootLevels {
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
    pub(super) fn set(&mut self, to: RootRef, level: usize) {
        self.ahead.insert(to, level);
    }

    /// Advances to the next page and returns the levels of its roots. A root without a link counts as the root of the
    /// tree.
    pub(super) fn advance(&mut self, page: u32, roots: u8) -> Vec<usize> {
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
    pub(super) fn retreat(&mut self, roots: u8) -> Vec<usize> {
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
    pub(super) fn bytes(&self) -> usize {
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
