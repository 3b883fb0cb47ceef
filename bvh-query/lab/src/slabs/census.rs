//! Where the bytes of a file are.

use crate::Failure;
use bvh_bake::Profile;
use bvh_format::decode::decode_child;
use bvh_format::leaf::{LINE, PACKED_HEAD_BYTES, PackedHead, TriangleEncoding, decode_packet};
use bvh_format::page::{PAGE, PAGE_HEADER_BYTES, Page};
use bvh_format::profile::Encoding;
use bvh_format::slabs::row;
use bvh_format::treelet::{Child, SHORT_CODES, SHORT_TREELET_BYTES};
use bvh_query::Bvh;
use cbvh_measure::table::{Cell, Cells};
use std::collections::HashSet;

/// Bytes of the links in a treelet.
const TREELET_LINKS: u64 = 8;
/// Bytes of a remote link.
const REMOTE_LINK: u64 = 4;

/// The bytes and counts of a file of one object.
#[derive(Debug, Clone, Default)]
pub(super) struct Census {
    pub(super) mesh: String,
    /// How the layout was chosen.
    pub(super) layout: String,
    pub(super) triangles: u64,
    /// Bytes by kind, in the order of [`Census::KINDS`].
    pub(super) bytes: [u64; 15],
    pub(super) treelets: u64,
    pub(super) children: u64,
    pub(super) packets: u64,
    /// Distinct vertices, summed over packets.
    pub(super) packet_vertices: u64,
    /// Child planes, and how many of them are their parent's.
    pub(super) planes: u64,
    pub(super) parent_planes: u64,
    /// How often each code of 8 or 4 bits occurs; empty for other encodings.
    codes: Vec<u64>,
}

impl Census {
    /// The kinds of bytes. The last one is all of them.
    pub(super) const KINDS: [&'static str; 15] = [
        "file header, tables, padding",
        "page headers",
        "anchors",
        "remote links",
        "codes of children",
        "codes of absent children",
        "treelet links",
        "rows without use",
        "empty lines of pages",
        "leaf heads",
        "vertices",
        "records",
        "ends of leaf blocks",
        "ids, duplicates",
        "all",
    ];

    /// Counts a file.
    pub(super) fn of_file(mesh: &str, layout: &str, bvh: &Bvh) -> Result<Self, Failure> {
        let object = bvh.objects().first().ok_or("a file without objects")?;
        let (profile, encoding) = (object.profile(), object.triangle_encoding());
        let mut census = Self {
            mesh: mesh.to_owned(),
            layout: format!("{layout}: {} {}", profile.name(), encoding.name()),
            triangles: object.triangles(),
            ..Self::default()
        };
        for number in object.pages() {
            let bytes = bvh.layout().page_bytes(bvh.bytes(), number).ok_or("a page is missing")?;
            let page = Page::new(bytes, profile);
            census.page(&page);
            let block = bvh.layout().leaf_block(bvh.bytes(), page.header());
            census.leaf_block(encoding, block, page.header().packets.get().into());
            census.bytes[13] += page.header().id_bytes().len() as u64;
        }
        census.trees(bvh)?;
        census.bytes[13] += 8 * bvh.layout().duplicate_ids(bvh.bytes()).len() as u64;
        census.bytes[14] = bvh.bytes().len() as u64;
        census.bytes[0] = census.bytes[14] - census.bytes[1..14].iter().sum::<u64>();
        Ok(census)
    }

    fn page(&mut self, page: &Page<'_>) {
        let (header, profile) = (page.header(), page.profile());
        let anchors = u64::from(header.roots) * profile.anchor_bytes() as u64;
        let treelets = u64::from(header.treelets);
        let before = u64::from(header.treelet_line) * LINE as u64;
        self.treelets += treelets;
        self.bytes[1] += PAGE_HEADER_BYTES as u64;
        self.bytes[2] += anchors;
        self.bytes[3] += u64::from(header.remotes) * REMOTE_LINK;
        let used = (0..header.treelets).fold(before, |used, slot| used + page.treelet(slot).len() as u64);
        // What fills up the lines of remote links is empty, too.
        let links = u64::from(header.remotes) * REMOTE_LINK;
        self.bytes[8] += PAGE as u64 - used + before - PAGE_HEADER_BYTES as u64 - anchors - links;
        let [code, ends] = match profile.encoding() {
            Encoding::U4 => [1, 1],
            Encoding::U8 => [1, 2],
            Encoding::F16 => [2, 2],
            Encoding::F32 => [4, 2],
        };
        for slot in 0..header.treelets {
            let treelet = page.treelet(slot);
            let is_short = treelet.len() == SHORT_TREELET_BYTES;
            let codes = if is_short { 1 } else { code * ends };
            let child_bytes = codes * profile.directions().slabs() as u64;
            let link_bytes = if is_short && profile.width() == 4 { 4 } else { TREELET_LINKS };
            let children = page.links(slot).children() as u64;
            let absent = profile.width() as u64 - children;
            self.children += children;
            self.bytes[4] += children * child_bytes;
            self.bytes[5] += absent * child_bytes;
            self.bytes[6] += link_bytes;
            self.bytes[7] += treelet.len() as u64 - link_bytes - (children + absent) * child_bytes;
        }
    }

    fn leaf_block(&mut self, encoding: TriangleEncoding, block: &[u8], packets: usize) {
        self.packets += packets as u64;
        for packet in 0..packets {
            let corners = decode_packet(encoding, block, packet);
            let all = (0..4).flat_map(|lane| corners.triangle(lane));
            let distinct: HashSet<[u32; 3]> = all.map(|corner| corner.map(f32::to_bits)).collect();
            self.packet_vertices += distinct.len() as u64;
        }
        let parts = match (encoding, PackedHead::read(block)) {
            (TriangleEncoding::F32, _) | (_, None) => [0, 144 * packets, 0],
            (_, Some(head)) => {
                let bits: usize = head.bits.iter().map(|&bits| usize::from(bits)).sum();
                let records = head.pool_at as usize - PACKED_HEAD_BYTES;
                [PACKED_HEAD_BYTES, (usize::from(head.vertices) * bits).div_ceil(8), records]
            }
        };
        for (kind, bytes) in (9..12).zip(parts) {
            self.bytes[kind] += bytes as u64;
        }
        self.bytes[12] += (block.len() - parts.iter().sum::<usize>()) as u64;
    }

    /// Counts planes and codes, from the root on.
    fn trees(&mut self, bvh: &Bvh) -> Result<(), Failure> {
        let object = bvh.objects().first().ok_or("a file without objects")?;
        let profile = object.profile();
        let page =
            |number| bvh.layout().page_bytes(bvh.bytes(), number).map(|bytes| Page::new(bytes, profile));
        let missing = "a page is missing";
        let bits = match profile.encoding() {
            Encoding::U4 => 4,
            Encoding::U8 => 8,
            Encoding::F16 | Encoding::F32 => 0,
        };
        self.codes = vec![0; if bits > 0 { 1 << bits } else { 0 }];
        let first = object.record().first_page.get();
        let mut stack = vec![(first, 0, page(first).ok_or(missing)?.anchor_slabs(0))];
        while let Some((number, slot, parent)) = stack.pop() {
            let here = page(number).ok_or(missing)?;
            let treelet = here.treelet(slot);
            let links = here.links(slot);
            for child in 0..links.children() {
                let decoded = decode_child(profile, object.f16_scale(), treelet, child, &parent);
                for slab in 0..profile.directions().slabs() {
                    let at = row(slab);
                    let same = [decoded.lo[at] == parent.lo[at], decoded.hi[at] == parent.hi[at]];
                    self.planes += 2;
                    self.parent_planes += same.into_iter().filter(|&same| same).count() as u64;
                    if bits > 0 {
                        for code in codes(profile, treelet, child, slab) {
                            self.codes[usize::from(code)] += 1;
                        }
                    }
                }
                match links.child(child) {
                    Child::Treelet(slot) => stack.push((number, slot, decoded)),
                    Child::Remote(link) => {
                        let to = here.remote(link);
                        let anchor = page(to.page()).ok_or(missing)?.anchor_slabs(to.root());
                        stack.push((to.page(), to.root(), anchor));
                    }
                    Child::Leaf { .. } | Child::Empty => {}
                }
            }
        }
        Ok(())
    }

    /// Returns the entropy of the codes in bits per code, each taken by itself.
    pub(super) fn entropy(&self) -> Option<f64> {
        let all = self.codes.iter().sum::<u64>() as f64;
        let term = |&count: &u64| -(count as f64 / all) * (count as f64 / all).log2();
        (all > 0.0).then(|| self.codes.iter().filter(|&&count| count > 0).map(term).sum())
    }

    /// Returns the bytes of a kind per triangle.
    pub(super) fn per_triangle(&self, kind: usize) -> f64 {
        self.bytes[kind] as f64 / self.triangles.max(1) as f64
    }
}

/// Returns both codes of a child's slab in a treelet of codes of 4 or 8 bits, as section 7 of `spec/format.md` places them.
fn codes(profile: Profile, treelet: &[u8], child: usize, slab: usize) -> [u8; 2] {
    let half = treelet.len() / 2;
    let is_short = treelet.len() == SHORT_TREELET_BYTES;
    let at = if profile.width() == 8 {
        child / 4 * half + row(slab) * 4 + child % 4
    } else {
        row(slab) * profile.width() + child
    };
    match (profile.encoding(), profile.width()) {
        _ if is_short => [treelet[at] & 15, treelet[at] >> 4].map(|nibble| SHORT_CODES[usize::from(nibble)]),
        (Encoding::U4, _) => [treelet[at] & 15, treelet[at] >> 4],
        (_, 8) => [treelet[at], treelet[at + half / 2]],
        _ => [treelet[at], treelet[at + half]],
    }
}

impl Cells for Census {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let share = |part: u64, of: u64| Cell::number(Some(part as f64 / of as f64));
        let mut cells = vec![
            ("mesh", Cell::text(&self.mesh)),
            ("layout", Cell::text(&self.layout)),
            ("triangles", Cell::Count(self.triangles)),
        ];
        let bytes = Self::KINDS.into_iter().enumerate();
        cells.extend(bytes.map(|(kind, name)| (name, Cell::number(Some(self.per_triangle(kind))))));
        cells.extend([
            ("children_per_treelet", share(self.children, self.treelets)),
            ("triangles_per_packet", share(self.triangles, self.packets)),
            ("vertices_per_packet", share(self.packet_vertices, self.packets)),
            ("parent_planes", share(self.parent_planes, self.planes)),
            ("bits_per_code", Cell::number(self.entropy())),
        ]);
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_format::quantize::{decode_max, decode_min, residual_unit};

    #[test]
    fn codes_are_those_that_decode_to_the_child() {
        let mut random = cbvh_measure::poses::Random::default();
        let of_codes = Profile::ALL
            .into_iter()
            .filter(|profile| matches!(profile.encoding(), Encoding::U4 | Encoding::U8));
        for profile in of_codes {
            let treelet: Vec<u8> =
                (0..profile.treelet_bytes()).map(|_| (random.direction()[0] * 127.0) as i8 as u8).collect();
            let (encoding, mut parent) = (profile.encoding(), bvh_format::slabs::NodeSlabs::default());
            (parent.lo, parent.hi) = ([-3.0; 16], [4.0; 16]);
            let unit = residual_unit(encoding, -3.0, 4.0, 1.0);
            for child in 0..profile.width() {
                let decoded = decode_child(profile, 1.0, &treelet, child, &parent);
                for slab in 0..profile.directions().slabs() {
                    let [lo, hi] = codes(profile, &treelet, child, slab).map(u16::from);
                    let expected =
                        (decode_min(encoding, lo, -3.0, unit), decode_max(encoding, hi, 4.0, unit));
                    assert_eq!(
                        (decoded.lo[row(slab)], decoded.hi[row(slab)]),
                        expected,
                        "{}",
                        profile.name()
                    );
                }
            }
        }
    }
}
