//! Writes planned pages: anchors, remote links, treelets, leaf and id blocks.
//!
//! Pages are numbered from the first of those encoded together, and so are lines, words and packets: where they go in
//! the file is known when all have been planned.

use crate::arena::Arena;
use crate::pages::{PagePlan, Place};
use crate::soup::{Corners, Triangle};
use crate::treelets::ChildKind;
use bvh_format::checksum::checksum;
use bvh_format::decode::decode_child;
use bvh_format::ids::{WORD, encode_ids};
use bvh_format::kdop::Kdop;
use bvh_format::leaf::{LINE, Packet, TriangleEncoding, encode_block};
use bvh_format::page::{PAGE, PageHeader, RootRef, treelet_line, write_anchor};
use bvh_format::profile::Profile;
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::{Links, encode_slabs};
use rayon::prelude::*;
use zerocopy::IntoBytes;

/// How the pages of an object are written.
#[derive(Clone, Copy)]
pub(crate) struct Style {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) f16_scale: f32,
    pub(crate) ids: bool,
}

/// Pages that are encoded together.
pub(crate) struct Encoder<'a> {
    pub(crate) arena: &'a Arena,
    pub(crate) pages: &'a [PagePlan],
    /// Where each treelet is; some may be in pages behind these.
    pub(crate) places: &'a [Place],
    /// What packets number.
    pub(crate) triangles: &'a [Triangle],
    pub(crate) style: Style,
}

/// A page with its blocks.
struct PageParts {
    page: Vec<u8>,
    header: PageHeader,
    leaf_block: Vec<u8>,
    id_block: Vec<u8>,
}

/// Pages and their blocks, one behind the other.
#[derive(Default)]
pub(crate) struct Encoded {
    pub(crate) pages: Vec<u8>,
    pub(crate) leaves: Vec<u8>,
    pub(crate) ids: Vec<u8>,
    pub(crate) packets: u64,
    pub(crate) treelets: u64,
}

impl Encoder<'_> {
    /// Encodes all pages. Checksums of pages are left to those who number them.
    pub(crate) fn encode(&self) -> Encoded {
        let parents = self.parents();
        let page = |number| self.page(&self.pages[number], number, &parents[number]);
        let parts: Vec<PageParts> = (0..self.pages.len()).into_par_iter().map(page).collect();
        let sum = |length: fn(&PageParts) -> usize| parts.iter().map(length).sum();
        let mut encoded = Encoded {
            pages: Vec::with_capacity(parts.len() * PAGE),
            leaves: Vec::with_capacity(sum(|part| part.leaf_block.len())),
            ids: Vec::with_capacity(sum(|part| part.id_block.len())),
            ..Encoded::default()
        };
        for mut part in parts {
            let header = &mut part.header;
            header.leaf_line = ((encoded.leaves.len() / LINE) as u64).into();
            let word = if part.id_block.is_empty() { 0 } else { encoded.ids.len() / WORD };
            header.id_word = (word as u64).into();
            header.first_packet = (encoded.packets as u32).into();
            encoded.packets += u64::from(header.packets.get());
            encoded.treelets += u64::from(header.treelets);
            part.page[..64].copy_from_slice(header.as_bytes());
            encoded.pages.extend_from_slice(&part.page);
            encoded.leaves.extend_from_slice(&part.leaf_block);
            encoded.ids.extend_from_slice(&part.id_block);
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

    fn page(&self, plan: &PagePlan, number: usize, parents: &[Option<(u32, u8)>]) -> PageParts {
        let Style { profile, f16_scale, .. } = self.style;
        let slabs = profile.directions().slabs();
        let mut page = vec![0; PAGE];
        let mut decoded = vec![NodeSlabs::default(); plan.slots.len()];
        for (root, parent) in parents.iter().enumerate() {
            let kdop = self.arena.treelets[plan.slots[root] as usize].kdop(slabs);
            decoded[root] = NodeSlabs::from_kdop(&kdop, slabs);
            let at = 64 + root * profile.anchor_bytes();
            write_anchor(profile, &kdop, *parent, &mut page[at..]);
        }
        let table = 64 + plan.roots * profile.anchor_bytes();
        for (link, &target) in plan.remotes.iter().enumerate() {
            let place = self.places[target as usize];
            let root = RootRef::new(place.page, place.slot);
            page[table + 4 * link..table + 4 * link + 4].copy_from_slice(&root.0.to_le_bytes());
        }
        let first_line = treelet_line(profile, plan.roots, plan.remotes.len());
        let (mut packets, mut ids) = (Vec::new(), Vec::new());
        let (mut next_slot, mut next_remote) = (plan.roots, 0);
        for (slot, &index) in plan.slots.iter().enumerate() {
            let size = profile.treelet_bytes();
            let at = first_line * 64 + slot * size;
            let treelet = &mut page[at..at + size];
            let children = &self.arena.treelets[index as usize].children;
            let mut links = Links {
                kinds: 0,
                first_treelet: next_slot as u8,
                first_remote: next_remote as u8,
                first_leaf: packets.len() as u16,
            };
            let kdops: Vec<Kdop> = children.iter().map(|child| child.kdop).collect();
            encode_slabs(profile, f16_scale, &decoded[slot], &kdops, treelet);
            for (child, slot_of_child) in children.iter().enumerate() {
                let kind = match &slot_of_child.kind {
                    ChildKind::Leaf(packet) => {
                        let triangles = packet.numbers();
                        packets.push(self.packet(triangles));
                        ids.push(triangles.iter().map(|&t| self.triangles[t as usize].id).collect());
                        3 + triangles.len() as u32
                    }
                    ChildKind::Treelet(_) | ChildKind::Brick(_) => {
                        let target = self.arena.child(index, child);
                        let here = |t| self.places[t as usize].page as usize == number;
                        if target.is_some_and(here) {
                            let parent = &decoded[slot];
                            decoded[next_slot] = decode_child(profile, f16_scale, treelet, child, parent);
                            next_slot += 1;
                            1
                        } else {
                            next_remote += 1;
                            2
                        }
                    }
                };
                links.kinds |= kind << (4 * child);
            }
            links.write(treelet);
        }
        self.parts(plan, number, page, &packets, &ids)
    }

    fn packet(&self, triangles: &[u32]) -> Packet {
        let corners: Vec<Corners> =
            triangles.iter().map(|&triangle| self.triangles[triangle as usize].corners).collect();
        Packet::new(&corners)
    }

    fn parts(
        &self,
        plan: &PagePlan,
        number: usize,
        page: Vec<u8>,
        packets: &[Packet],
        ids: &[Vec<u32>],
    ) -> PageParts {
        let none = packets.is_empty();
        let leaf_block = if none { Vec::new() } else { encode_block(self.style.encoding, packets) };
        let id_block = if none || !self.style.ids { Vec::new() } else { encode_ids(ids) };
        let header = PageHeader {
            checksum: 0.into(),
            leaf_checksum: checksum(&leaf_block).into(),
            id_checksum: if id_block.is_empty() { 0 } else { checksum(&id_block) }.into(),
            leaf_line: 0.into(),
            id_word: 0.into(),
            first_packet: 0.into(),
            page_number: (number as u32).into(),
            leaf_lines: ((leaf_block.len() / LINE) as u32).into(),
            id_words: ((id_block.len() / WORD) as u32).into(),
            packets: (packets.len() as u16).into(),
            roots: plan.roots as u8,
            treelets: plan.slots.len() as u8,
            remotes: plan.remotes.len() as u8,
            treelet_line: treelet_line(self.style.profile, plan.roots, plan.remotes.len()) as u8,
            profile: self.style.profile.number(),
            reserved: 0,
        };
        PageParts { page, header, leaf_block, id_block }
    }
}
