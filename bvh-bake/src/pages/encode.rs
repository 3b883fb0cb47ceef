//! Encodes planned pages with their leaf and id blocks, in parallel.
//!
//! Pages, lines, words and packets are numbered from the first page of the same batch. Their places in the file are
//! known only when all pages have been planned.

use crate::pages::Style;
use crate::pages::plan::{PagePlan, Place};
use crate::threads;
use crate::tree::arena::Arena;
use crate::tree::arena::ChildKind;
use crate::triangles::Batch;
use bvh_format::leaf::PACKET;
use bvh_format::page::{PAGE, PagePatcher, PagePlace, PageShape, PageWriter, RootRef, WrittenPage};

/// Pages that are encoded together.
pub(crate) struct Encoder<'a> {
    pub(crate) arena: &'a Arena,
    pub(crate) pages: &'a [PagePlan],
    /// The place of each treelet. Some treelets may be in pages that follow these.
    pub(crate) places: &'a [Place],
    /// The triangles that packets number.
    pub(crate) triangles: &'a Batch<'a>,
    pub(crate) style: Style,
}

/// Pages and their blocks, one after the other.
#[derive(Default)]
pub(crate) struct Encoded {
    pub(crate) pages: Vec<u8>,
    pub(crate) leaves: Vec<u8>,
    pub(crate) ids: Vec<u8>,
    pub(crate) packets: u64,
    pub(crate) treelets: u64,
}

impl Encoder<'_> {
    /// Returns the number of each triangle and its place, counted from the first packet of these pages, by ascending
    /// places.
    pub(crate) fn triangle_places(&self) -> Vec<(u32, u32)> {
        let mut places = Vec::with_capacity(self.triangles.len());
        let mut first = 0;
        for &treelet in self.pages.iter().flat_map(|page| &page.slots) {
            for child in self.arena.children(treelet) {
                if let ChildKind::Leaf(packet) = &child.kind {
                    places.extend(packet.numbers().iter().copied().zip(first..));
                    first += PACKET as u32;
                }
            }
        }
        places
    }

    /// Encodes all pages. Their numbers count from the first of them, and their checksums are missing.
    pub(crate) fn encode(&self) -> Encoded {
        let parents = self.parents();
        let page = |number| self.page(&self.pages[number], number, &parents[number]);
        let written: Vec<WrittenPage> = threads::map(0..self.pages.len(), page);
        let sum = |length: fn(&WrittenPage) -> usize| written.iter().map(length).sum();
        let mut encoded = Encoded {
            pages: Vec::with_capacity(written.len() * PAGE),
            leaves: Vec::with_capacity(sum(|page| page.leaf_block.len())),
            ids: Vec::with_capacity(sum(|page| page.id_block.len())),
            ..Encoded::default()
        };
        let mut place = PagePlace::default();
        for mut page in written {
            let mut patcher = PagePatcher::new(&mut page.bytes, self.style.profile);
            patcher.set_place(&place);
            let header = *patcher.page().header();
            place = place.behind(&header);
            encoded.packets += u64::from(header.packets.get());
            encoded.treelets += u64::from(header.treelets);
            encoded.pages.extend_from_slice(&page.bytes[..]);
            encoded.leaves.extend_from_slice(&page.leaf_block);
            encoded.ids.extend_from_slice(&page.id_block);
        }
        encoded
    }

    /// For each page, the page and remote link that lead to each of its roots.
    fn parents(&self) -> Vec<Vec<Option<(u32, u8)>>> {
        let mut parents: Vec<_> = self.pages.iter().map(|page| vec![None; page.roots]).collect();
        for (number, page) in self.pages.iter().enumerate() {
            for (link, &target) in page.remotes.iter().enumerate() {
                let Place { page, slot } = self.places[target as usize];
                if let Some(roots) = parents.get_mut(page as usize) {
                    roots[usize::from(slot)] = Some((number as u32, link as u8));
                }
            }
        }
        parents
    }

    fn page(&self, plan: &PagePlan, number: usize, parents: &[Option<(u32, u8)>]) -> WrittenPage {
        let Style { profile, f16_scale, encoding, ids, behind, .. } = self.style;
        let slabs = profile.directions().slabs();
        let PagePlan { roots, short, .. } = *plan;
        let (remotes, treelets) = (plan.remotes.len(), plan.slots.len());
        let shape = PageShape { roots, remotes, treelets, short };
        let mut writer = PageWriter::new(profile, f16_scale, shape);
        for (&root, parent) in plan.slots.iter().zip(parents) {
            writer.root(&self.arena.kdop(root, slabs), *parent);
        }
        for &index in &plan.slots {
            writer.begin_treelet();
            for child in self.arena.children(index) {
                let place = match &child.kind {
                    ChildKind::Leaf(packet) => {
                        let numbers = packet.numbers().iter();
                        let triangles = numbers.map(|&number| &self.triangles[number as usize]);
                        writer.leaf(&child.bound, triangles.map(|triangle| (triangle.corners, triangle.id)));
                        if !self.triangles.exact.is_empty() {
                            let exact =
                                packet.numbers().iter().map(|&number| self.triangles.exact[number as usize]);
                            writer.wide_leaf(&exact.collect::<Vec<_>>());
                        }
                        continue;
                    }
                    ChildKind::Treelet(below) => self.places[*below as usize],
                    // Before pages are planned, bricks have joined the arena. A link to one would lead back to the
                    // first page, which the check of the file refuses.
                    ChildKind::Brick(_) => Place::default(),
                };
                let is_here = matches!(child.kind, ChildKind::Treelet(_)) && place.page as usize == number;
                match is_here {
                    true if usize::from(place.slot) < treelets - short => writer.treelet(&child.bound),
                    true => writer.short_treelet(&child.bound),
                    false => writer.remote(&child.bound, RootRef::new(place.page, place.slot)),
                }
            }
        }
        writer.finish(encoding, &behind, ids)
    }
}
