//! Writes the planned pages of an object: anchors, remote links, treelets, leaf and id blocks.

use crate::arena::Arena;
use crate::pages::{PagePlan, Place, Plan};
use crate::prepare::{Corners, Prepared};
use crate::treelets::ChildKind;
use bvh_format::checksum::checksum;
use bvh_format::decode::decode_child;
use bvh_format::ids::{WORD, encode_ids};
use bvh_format::kdop::Kdop;
use bvh_format::leaf::{LINE, Packet, TriangleEncoding, encode_block};
use bvh_format::page::{PAGE, PageHeader, RootRef, page_checksum, treelet_line, write_anchor};
use bvh_format::profile::Profile;
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::{Links, encode_slabs};
use rayon::prelude::*;
use zerocopy::IntoBytes;

/// What all pages of an object share.
pub(crate) struct Encoder<'a> {
    pub(crate) arena: &'a Arena,
    pub(crate) plan: &'a Plan,
    pub(crate) prepared: &'a Prepared,
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) f16_scale: f32,
    pub(crate) ids: bool,
    /// Number of the object's first page in the file.
    pub(crate) first_page: u32,
}

/// A page with its blocks.
pub(crate) struct PageParts {
    pub(crate) page: Vec<u8>,
    header: PageHeader,
    pub(crate) leaf_block: Vec<u8>,
    pub(crate) id_block: Vec<u8>,
}

/// Where the blocks of the next page go, as pages follow each other through all objects of a file.
#[derive(Default)]
pub(crate) struct Ends {
    pub(crate) pages: usize,
    pub(crate) leaf_lines: usize,
    pub(crate) id_words: usize,
}

/// What the object's record says of its pages.
pub(crate) struct Totals {
    pub(crate) packets: u64,
    pub(crate) treelets: u64,
}

impl Encoder<'_> {
    /// Encodes all pages, the first at `ends`, which is moved on behind the last.
    pub(crate) fn encode(&self, ends: &mut Ends) -> (Vec<PageParts>, Totals) {
        let parents = self.parents();
        let mut parts: Vec<PageParts> = (0..self.plan.pages.len())
            .into_par_iter()
            .map(|page| self.page(&self.plan.pages[page], page, &parents[page]))
            .collect();
        let mut totals = Totals { packets: 0, treelets: 0 };
        for part in &mut parts {
            let header = &mut part.header;
            header.leaf_line = (ends.leaf_lines as u64).into();
            header.id_word = (if part.id_block.is_empty() { 0 } else { ends.id_words } as u64).into();
            header.first_packet = (totals.packets as u32).into();
            ends.leaf_lines += part.leaf_block.len() / LINE;
            ends.id_words += part.id_block.len() / WORD;
            totals.packets += u64::from(header.packets.get());
            totals.treelets += u64::from(header.treelets);
        }
        ends.pages += parts.len();
        parts.par_iter_mut().for_each(seal);
        (parts, totals)
    }

    /// For each page, the page and remote link that lead to each of its roots.
    fn parents(&self) -> Vec<Vec<Option<(u32, u8)>>> {
        let mut parents: Vec<_> = self.plan.pages.iter().map(|page| vec![None; page.roots]).collect();
        for (number, page) in self.plan.pages.iter().enumerate() {
            for (link, &target) in page.remotes.iter().enumerate() {
                let Place { page, slot } = self.plan.places[target as usize];
                parents[page as usize][usize::from(slot)] =
                    Some((self.first_page + number as u32, link as u8));
            }
        }
        parents
    }

    fn page(&self, plan: &PagePlan, number: usize, parents: &[Option<(u32, u8)>]) -> PageParts {
        let profile = self.profile;
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
            let place = self.plan.places[target as usize];
            let root = RootRef::new(self.first_page + place.page, place.slot);
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
            encode_slabs(profile, self.f16_scale, &decoded[slot], &kdops, treelet);
            for (child, slot_of_child) in children.iter().enumerate() {
                let kind = match &slot_of_child.kind {
                    ChildKind::Leaf(packet) => {
                        let triangles = packet.numbers();
                        packets.push(self.packet(triangles));
                        ids.push(triangles.iter().map(|&t| self.prepared.ids[t as usize]).collect());
                        3 + triangles.len() as u32
                    }
                    ChildKind::Treelet(_) | ChildKind::Brick(_) => {
                        let target = self.arena.child(index, child);
                        let here = |t| self.plan.places[t as usize].page as usize == number;
                        if target.is_some_and(here) {
                            let parent = &decoded[slot];
                            decoded[next_slot] =
                                decode_child(profile, self.f16_scale, treelet, child, parent);
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
            triangles.iter().map(|&triangle| self.prepared.triangles[triangle as usize]).collect();
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
        let leaf_block = if none { Vec::new() } else { encode_block(self.encoding, packets) };
        let id_block = if none || !self.ids { Vec::new() } else { encode_ids(ids) };
        let header = PageHeader {
            checksum: 0.into(),
            leaf_checksum: checksum(&leaf_block).into(),
            id_checksum: if id_block.is_empty() { 0 } else { checksum(&id_block) }.into(),
            leaf_line: 0.into(),
            id_word: 0.into(),
            first_packet: 0.into(),
            page_number: (self.first_page + number as u32).into(),
            leaf_lines: ((leaf_block.len() / LINE) as u32).into(),
            id_words: ((id_block.len() / WORD) as u32).into(),
            packets: (packets.len() as u16).into(),
            roots: plan.roots as u8,
            treelets: plan.slots.len() as u8,
            remotes: plan.remotes.len() as u8,
            treelet_line: treelet_line(self.profile, plan.roots, plan.remotes.len()) as u8,
            profile: self.profile.number(),
            reserved: 0,
        };
        PageParts { page, header, leaf_block, id_block }
    }
}

/// Puts the header and the checksum into a page.
fn seal(part: &mut PageParts) {
    part.page[..64].copy_from_slice(part.header.as_bytes());
    if let Some(page) = part.page.first_chunk::<PAGE>() {
        let sum = page_checksum(page);
        part.page[..8].copy_from_slice(&sum.to_le_bytes());
    }
}
