//! The levels of an object's subtree roots: found from the first page to the last, and wanted again the other way.
//!
//! Links lead to later pages, so that the level of a root is known when its page comes. What has come is kept as one
//! byte a root, some ten thousandth of the file.

use bvh_format::page::RootRef;
use std::collections::BTreeMap;

#[derive(Default)]
pub(super) struct RootLevels {
    /// Those of roots in pages that have not come yet.
    ahead: BTreeMap<RootRef, usize>,
    /// Those of roots in pages that have come, in their order; `DEEP` for those in `deep`.
    come: Vec<u8>,
    deep: Vec<usize>,
}

const DEEP: u8 = u8::MAX;

impl RootLevels {
    /// A link that leads to this root. Of several the last counts: there are several in damaged files only.
    pub(super) fn set(&mut self, to: RootRef, level: usize) {
        self.ahead.insert(to, level);
    }

    /// The levels of the roots of the next page. A root that no link has led to counts as the tree's.
    pub(super) fn come(&mut self, page: u32, roots: u8) -> Vec<usize> {
        let mut levels = vec![0; usize::from(roots)];
        while let Some(first) = self.ahead.first_entry().filter(|first| first.key().page() <= page) {
            let (to, level) = first.remove_entry();
            if let Some(of_root) = levels.get_mut(usize::from(to.root())) {
                *of_root = level;
            }
        }
        for &level in &levels {
            let small = u8::try_from(level).unwrap_or(DEEP);
            self.come.push(small);
            if small == DEEP {
                self.deep.push(level);
            }
        }
        levels
    }

    /// The levels of the roots of the last page that has come and has not gone.
    pub(super) fn go(&mut self, roots: u8) -> Vec<usize> {
        let mut levels = self.come.split_off(self.come.len().saturating_sub(roots.into()));
        let of_root = |small: u8| match small {
            DEEP => self.deep.pop().unwrap_or(0),
            level => level.into(),
        };
        levels.reverse();
        let mut levels: Vec<usize> = levels.into_iter().map(of_root).collect();
        levels.reverse();
        levels
    }

    /// Bytes of memory of the pages that have come.
    pub(super) fn bytes(&self) -> usize {
        self.come.len() + self.deep.len() * size_of::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_go_as_they_came() {
        let mut levels = RootLevels::default();
        let mut all = Vec::new();
        for page in 0..100 {
            for root in 0..page as u8 % 5 {
                levels.set(RootRef::new(page + 1 + u32::from(root) % 3, root), (page * page) as usize);
            }
            let roots = 1 + page as u8 % 4;
            let come = levels.come(page, roots);
            assert_eq!(come.len(), usize::from(roots));
            all.push(come);
        }
        assert_eq!(all[0], [0]);
        // Page 2 led to roots 0 and 1 of pages 3 and 4.
        assert_eq!((all[3][0], all[4][0]), (4, 9));
        assert!(all.iter().flatten().any(|&level| level > 255));
        for come in all.into_iter().rev() {
            assert_eq!(levels.go(come.len() as u8), come);
        }
        assert_eq!(levels.bytes(), 0);
    }
}
