//! Makes a file out of any few bytes: the shape of its tree and the checksums are right, so that readers get far, but
//! slabs, vertices and ids have any value, and some bytes are changed before the file is sealed.
//!
//! A fuzzer needs such a compact description. If it changed the bytes of a file directly, nearly all changes would
//! hit zeros between structures or break the first rule.

use crate::Random;
use crate::seal::{put, put_together};
use bvh_format::ids::encode_ids;
use bvh_format::instances::{Instance, write_instances};
use bvh_format::leaf::{LINE, Packet, TriangleEncoding, encode_block};
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::{PAGE, PageHeader, PageShape};
use bvh_format::profile::{Encoding, Profile};
use bvh_format::topology::{TopologyRecord, write_topology_head};
use bvh_format::treelet::{Links, SHORT_TREELET_BYTES};
use bvh_format::vertex::Vertices;
use zerocopy::{FromZeros, IntoBytes};

/// Reads a description. After its end, it returns zeros.
pub struct Input<'a>(pub &'a [u8]);

impl Input<'_> {
    /// Returns the next byte.
    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// Returns an integer from 0 to `count` - 1.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    /// Returns a small multiple of 1/8, or one of the values that are often a limit.
    pub fn value(&mut self) -> f32 {
        const LIMITS: [f32; 8] =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-45, -0.0, 1.3e36, -1.3e36];
        match self.byte() {
            byte @ 248.. => LIMITS[usize::from(byte - 248)],
            byte => f32::from(byte as i8) / 8.0,
        }
    }
}

/// A page under construction: its roots, each with the page and the link that lead to it, its links and its packets.
#[derive(Default)]
struct Draft {
    parents: Vec<(u32, u8)>,
    /// Treelets that are not short, and short ones.
    treelets: Vec<Links>,
    short: Vec<Links>,
    remotes: Vec<u32>,
    packets: Vec<Packet>,
    triangles: u64,
}

impl Draft {
    fn shape(&self) -> PageShape {
        let (roots, remotes, short) = (self.parents.len(), self.remotes.len(), self.short.len());
        PageShape { roots, remotes, treelets: self.treelets.len() + short, short }
    }
}

const MAX_TREELETS_PER_PAGE: usize = 12;
const MAX_SHORT_TREELETS_PER_PAGE: u8 = 12;
const MAX_ROOTS_PER_PAGE: usize = 4;
const MAX_REMOTES_PER_PAGE: usize = 16;

/// Returns a file of a random description. Most of its numbers are small, so that they exceed limits rarely enough for some
/// files to be valid.
pub fn forge_any(random: &mut Random) -> Vec<u8> {
    let mut byte = || if random.below(40) == 0 { random.bits() as u8 } else { random.below(64) as u8 };
    forge(&mut Input(&[(); 1200].map(|()| byte())))
}

/// Returns a file of one object with one to four pages.
pub fn forge(input: &mut Input) -> Vec<u8> {
    let profile = Profile::ALL[input.below(Profile::ALL.len())];
    let encoding = TriangleEncoding::ALL[input.below(3)];
    let has_ids = input.below(2) == 1;
    let pages = drafts(input, profile);
    let mut record = ObjectRecord::new_zeroed();
    let (mut nodes, mut leaves, mut ids) = (Vec::new(), Vec::new(), Vec::new());
    for (number, page) in pages.iter().enumerate() {
        let in_order: Vec<u16> = (0..page.packets.len() as u16).collect();
        let block = if page.packets.is_empty() {
            Vec::new()
        } else {
            encode_block(encoding, &page.packets, &in_order, &Vertices::around([0.0; 3]), &[])
        };
        let numbers: Vec<Vec<u32>> = page.packets.iter().map(|_| vec![u32::from(input.byte()); 4]).collect();
        let id_block = if has_ids && !numbers.is_empty() { encode_ids(&numbers) } else { Vec::new() };
        let mut header = PageHeader::new_zeroed();
        header.page_number = (number as u32).into();
        header.first_packet = (record.packets.get() as u32).into();
        header.leaf_line = ((leaves.len() / LINE) as u64).into();
        header.leaf_lines = ((block.len() / LINE) as u32).into();
        header.id_word = if id_block.is_empty() { 0 } else { ids.len() as u64 / 8 }.into();
        header.id_words = (id_block.len() as u32 / 8).into();
        header.packets = (page.packets.len() as u16).into();
        header.roots = page.parents.len() as u8;
        header.treelets = page.shape().treelets as u8;
        header.short = page.shape().short as u8;
        header.remotes = page.remotes.len() as u8;
        header.treelet_line = page.shape().treelet_line(profile) as u8;
        header.profile = profile.number();
        nodes.extend(page_bytes(input, profile, &header, page));
        leaves.extend(block);
        ids.extend(id_block);
        record.packets += page.packets.len() as u64;
        record.treelets += page.shape().treelets as u64;
        record.triangles += page.triangles;
    }
    record.pages = (pages.len() as u32).into();
    record.input_triangles = 256.into();
    record.profile = profile.number();
    record.triangle_encoding = encoding as u8;
    record.f16_exponent = i32::from(input.byte() as i8).clamp(-125, 112).into();
    record.box_lo = [(-16.0).into(); 3];
    record.box_hi = [16.0.into(); 3];
    record.sphere_radius = f32::from(input.byte()).into();
    let origin = input.value();
    record.origin = [f64::from(if origin.abs() < 1e36 { origin } else { 0.0 }).into(); 3];
    let name = String::from_utf8_lossy(&[input.byte()]).into_owned();
    let mut sections = vec![(1, 1, write_objects(&[(name, record)])), (2, 1, nodes), (3, 1, leaves)];
    if has_ids {
        let pairs = (0..input.below(4)).flat_map(|i| [i as u32, u32::from(input.byte())]);
        let pairs = pairs.flat_map(u32::to_le_bytes).collect();
        sections.extend([(4, 0, ids), (5, 0, pairs)]);
    }
    if input.below(2) == 1 {
        sections.push((7, 0, write_instances(&instances(input))));
    }
    if input.below(2) == 1 {
        sections.push((8, 0, topology(input)));
    }
    // Finally, a few bytes change anywhere in the sections.
    for _ in 0..input.below(4) {
        let (section, high) = (input.below(sections.len()), input.byte());
        let at = usize::from(high) << 8 | usize::from(input.byte());
        let bytes = &mut sections[section].2;
        if !bytes.is_empty() {
            let at = at % bytes.len();
            bytes[at] = input.byte();
        }
    }
    put_together(&sections)
}

/// Returns one to four instances, whose poses may be anything.
fn instances(input: &mut Input) -> Vec<Instance> {
    let instance = |input: &mut Input| {
        let mut instance = Instance::of_object(0);
        instance.name = String::from_utf8_lossy(&[input.byte()]).into_owned();
        instance.translation = [0; 3].map(|_| f64::from(input.value()));
        (instance.member, instance.meets) = (u32::from(input.byte()), u32::from(input.byte()));
        if input.below(8) == 1 {
            instance.rotation[input.below(3)][0] = f64::from(input.value());
        }
        instance
    };
    (0..1 + input.below(4)).map(|_| instance(input)).collect()
}

/// Returns a topology section of up to three components and nets, with places that ascend for the most part.
fn topology(input: &mut Input) -> Vec<u8> {
    let places = |input: &mut Input| {
        let mut place = 0;
        [0; 3].map(|_| {
            place += u32::from(input.byte() % 16);
            place
        })
    };
    let (closed, components, nets) = (input.below(2), input.below(4), input.below(4));
    let record = TopologyRecord {
        closed: (closed as u32).into(),
        components: (components as u32).into(),
        nets: (nets as u32).into(),
        reserved: 0.into(),
    };
    let mut section = write_topology_head(&[record]);
    places(input).iter().take(components).for_each(|place| section.extend(place.to_le_bytes()));
    for place in places(input).iter().take(nets) {
        section.extend(place.to_le_bytes());
        section.extend(i32::from(input.byte() as i8).to_le_bytes());
    }
    section
}

/// Returns the pages with the kinds and numbers of the children of all treelets, breadth-first as in the format.
fn drafts(input: &mut Input, profile: Profile) -> Vec<Draft> {
    let mut pages: Vec<Draft> = (0..1 + input.below(4)).map(|_| Draft::default()).collect();
    pages[0].parents.push((u32::MAX, 0));
    let count = pages.len();
    for number in 0..count {
        if pages[number].parents.is_empty() {
            // No link leads to this root.
            pages[number].parents.push((0, 0));
        }
        let roots = pages[number].parents.len();
        let (mut slots, mut slot, mut short) = (roots, 0, 0);
        while slot < slots {
            let (remotes, packets) = (pages[number].remotes.len(), pages[number].packets.len());
            let mut links = Links {
                kinds: 0,
                first_treelet: slots as u8,
                first_short: short,
                first_remote: remotes as u8,
                first_leaf: packets as u16,
            };
            for child in 0..1 + input.below(profile.width()) {
                let kind = match input.below(8) {
                    0 if slots < MAX_TREELETS_PER_PAGE => {
                        slots += 1;
                        1
                    }
                    1 if profile.has_short_treelets() && short < MAX_SHORT_TREELETS_PER_PAGE => {
                        short += 1;
                        3
                    }
                    2 | 3 if number + 1 < count && pages[number].remotes.len() < MAX_REMOTES_PER_PAGE => {
                        let to = number + 1 + input.below(count - number - 1);
                        if pages[to].parents.len() < MAX_ROOTS_PER_PAGE {
                            let link = pages[number].remotes.len() as u8;
                            let root = pages[to].parents.len() as u32;
                            pages[to].parents.push((number as u32, link));
                            pages[number].remotes.push((to as u32) << 6 | root);
                            2
                        } else {
                            leaf(input, &mut pages[number])
                        }
                    }
                    _ => leaf(input, &mut pages[number]),
                };
                links.kinds |= kind << (4 * child);
            }
            pages[number].treelets.push(links);
            slot += 1;
        }
        for _ in 0..short {
            let mut links = Links { first_leaf: pages[number].packets.len() as u16, ..Links::NONE };
            for child in 0..1 + input.below(profile.width()) {
                links.kinds |= leaf(input, &mut pages[number]) << (4 * child);
            }
            pages[number].short.push(links);
        }
        // Slots of short treelets follow those of all others.
        pages[number].treelets.iter_mut().for_each(|links| links.first_short += slots as u8);
        let page = &pages[number];
        assert!(page.shape().fits(profile));
    }
    pages
}

/// Adds a leaf packet and returns its kind.
fn leaf(input: &mut Input, page: &mut Draft) -> u32 {
    let triangles: Vec<_> =
        (0..1 + input.below(4)).map(|_| [(); 3].map(|()| [(); 3].map(|()| input.value()))).collect();
    page.packets.push(Packet::new(&triangles));
    page.triangles += triangles.len() as u64;
    3 + triangles.len() as u32
}

fn page_bytes(input: &mut Input, profile: Profile, header: &PageHeader, page: &Draft) -> Vec<u8> {
    let mut bytes = vec![0; PAGE];
    put(&mut bytes, 0, header.as_bytes());
    let (anchor, slabs) = (profile.anchor_bytes(), profile.directions().slabs());
    for (root, (parent, link)) in page.parents.iter().enumerate() {
        let at = 64 + root * anchor;
        for slab in 0..slabs {
            let finite = |value: f32| if value.abs() <= 5e36 { value } else { 5e36 };
            let (one, other) = (finite(input.value()), finite(input.value()));
            put(&mut bytes, at + 4 * slab, &one.min(other).to_le_bytes());
            put(&mut bytes, at + 4 * (slabs + slab), &one.max(other).to_le_bytes());
        }
        put(&mut bytes, at + anchor - 8, &parent.to_le_bytes());
        put(&mut bytes, at + anchor - 4, &[*link]);
    }
    for (link, remote) in page.remotes.iter().enumerate() {
        put(&mut bytes, 64 + page.parents.len() * anchor + 4 * link, &remote.to_le_bytes());
    }
    let mut start = usize::from(header.treelet_line) * 64;
    let full = page.treelets.iter().map(|links| (links, profile.treelet_bytes()));
    for (links, size) in full.chain(page.short.iter().map(|links| (links, SHORT_TREELET_BYTES))) {
        let treelet = &mut bytes[start..start + size];
        start += size;
        match profile.encoding() {
            Encoding::F32 => treelet.as_chunks_mut::<4>().0.iter_mut().for_each(|end| {
                *end = f32::from(input.byte() as i8).to_le_bytes();
            }),
            // The value is positive and finite.
            Encoding::F16 => treelet.as_chunks_mut::<2>().0.iter_mut().for_each(|code| {
                *code = [input.byte(), 0x30 | input.byte() & 0x0b];
            }),
            Encoding::U4 | Encoding::U8 => treelet.iter_mut().for_each(|code| *code = input.byte()),
        }
        links.write(profile, treelet);
    }
    bytes
}
