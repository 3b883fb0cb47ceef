//! Counts of an object's tree by level, and how loose its slabs are there.
//!
//! Two passes over the pages, since links only lead to later pages: forwards for the levels, backwards for
//! the tight bounds of what is below each subtree root.

use super::checked;
use bvh_format::decode::decode_child;
use bvh_format::kdop::Kdop;
use bvh_format::leaf::decode_packet;
use bvh_format::object::Object;
use bvh_format::page::Page;
use bvh_format::slabs::NodeSlabs;
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
    /// Children that are not flat in every direction, and the sum of their mean width ratios.
    measured: u64,
    width: f64,
}

impl Level {
    pub(super) fn joined(self, other: &Self) -> Self {
        Self {
            treelets: self.treelets + other.treelets,
            children: self.children + other.children,
            packets: self.packets + other.packets,
            triangles: self.triangles + other.triangles,
            measured: self.measured + other.measured,
            width: self.width + other.width,
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
        if self.measured == 0 { 1.0 } else { self.width / self.measured as f64 }
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
        let mut below: Vec<Vec<Kdop>> = vec![Vec::new(); (end - first) as usize];
        for number in (first..end).rev() {
            let page = checked(bvh, object, number)?;
            let levels = slot_levels(&page, &root_levels[(number - first) as usize]);
            let tight = statistics.measure(bvh, object, &page, &levels, |link| {
                let to = page.remote(link);
                let roots = below.get((to.page() - first) as usize);
                roots.and_then(|roots| roots.get(usize::from(to.root()))).copied().unwrap_or(Kdop::EMPTY)
            });
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

    /// Compares decoded with tight slabs in a page; returns the tight ones of its roots.
    fn measure(
        &mut self,
        bvh: &Bvh,
        object: &Object,
        page: &Page,
        levels: &[usize],
        below: impl Fn(u8) -> Kdop,
    ) -> Vec<Kdop> {
        let header = page.header();
        let slabs = object.profile.directions().slabs();
        let block = bvh.layout().leaf_block(bvh.bytes(), header);
        let treelets = usize::from(header.treelets);
        let mut tight = vec![Kdop::EMPTY; treelets];
        let mut children = vec![[Kdop::EMPTY; 8]; treelets];
        for slot in (0..treelets).rev() {
            let links = Links::read(page.treelet(slot as u8));
            for child in 0..links.children() {
                let kdop = match links.child(child) {
                    Child::Treelet(slot) => tight[usize::from(slot)],
                    Child::Remote(link) => below(link),
                    Child::Leaf { packet, triangles } => {
                        let values = decode_packet(object.triangle_encoding, block, usize::from(packet));
                        Kdop::of_points((0..usize::from(triangles)).flat_map(|lane| values.triangle(lane)))
                    }
                    Child::Empty => continue,
                };
                children[slot][child] = kdop;
                tight[slot].join(&kdop, slabs);
            }
        }
        let mut decoded = vec![NodeSlabs::default(); treelets];
        for root in 0..header.roots {
            decoded[usize::from(root)] = page.anchor_slabs(root);
        }
        for slot in 0..treelets {
            let treelet = page.treelet(slot as u8);
            let links = Links::read(treelet);
            for child in 0..links.children() {
                let node = decode_child(object.profile, object.f16_scale, treelet, child, &decoded[slot]);
                if let Child::Treelet(slot) = links.child(child) {
                    decoded[usize::from(slot)] = node;
                }
                if let Some(ratio) = width_ratio(&node.to_kdop(slabs), &children[slot][child], slabs) {
                    let level = self.level(levels[slot]);
                    level.measured += 1;
                    level.width += ratio;
                }
            }
        }
        tight.truncate(usize::from(header.roots));
        tight
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

/// Mean over slabs of decoded by tight width, where the tight one is not 0.
fn width_ratio(decoded: &Kdop, tight: &Kdop, slabs: usize) -> Option<f64> {
    let width = |kdop: &Kdop, slab: usize| f64::from(kdop.hi[slab]) - f64::from(kdop.lo[slab]);
    let ratios = (0..slabs).filter(|&slab| width(tight, slab) > 0.0);
    let ratios: Vec<f64> = ratios.map(|slab| width(decoded, slab) / width(tight, slab)).collect();
    if ratios.is_empty() { None } else { Some(ratios.iter().sum::<f64>() / ratios.len() as f64) }
}
