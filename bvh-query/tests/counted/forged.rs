//! Forged files: they keep the rules that queries check, and cost the most that such files can.

use crate::common::shapes::{cube, outward, soup};
use crate::common::{mesh, options};
use bvh_bake::to_bytes;
use bvh_format::Layout as FileLayout;
use bvh_format::header::SectionKind;
use bvh_format::ids::encode_ids;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::ObjectRecord;
use bvh_format::page::Page;
use bvh_format::profile::Profile;
use cbvh_testkit::seal::{put, put_together, seal, take_apart};
use std::mem::offset_of;

/// Forges a file in which every inner node reaches from -1000 to 1000: with codes of 0, each node is as large as its
/// root. Leaf packets are flat at the upper end of y. Pairs of inner nodes therefore overlap more than pairs of
/// packets and are visited first, because nearer pairs are visited first. Works for profiles of `u8` codes in
/// 64 bytes.
pub(crate) fn blown_up(triangles: usize, seed: u64, profile: Profile) -> Vec<u8> {
    let mut bytes =
        to_bytes(&mesh(&soup(triangles, seed)), &options(profile, TriangleEncoding::Packed)).unwrap().0;
    let layout = FileLayout::read(&bytes).unwrap();
    let (slabs, anchor, size) =
        (profile.directions().slabs(), profile.anchor_bytes(), profile.treelet_bytes());
    for number in 0..layout.page_count() {
        let at = layout.page_offset(number) as usize;
        let page = layout.page_bytes(&bytes, number).unwrap().to_owned();
        let header = *Page::new(&page, profile).header();
        for root in 0..usize::from(header.roots) {
            for end in 0..2 * slabs {
                let value = if end < slabs { -1000.0f32 } else { 1000.0 };
                put(&mut bytes, at + 64 + root * anchor + 4 * end, &value.to_le_bytes());
            }
        }
        for slot in 0..header.treelets {
            let view = Page::new(&page, profile);
            let mut treelet = vec![0; view.treelet(slot).len()];
            let links = view.links(slot);
            let (part, last) = if treelet.len() < size { (16, 0x0f) } else { (32, 255) };
            for child in (0..links.children()).filter(|child| links.leaves() >> (4 * child) & 1 == 1) {
                treelet[(child / 4) * part + profile.width().min(4) + child % 4] = last;
            }
            links.write(profile, &mut treelet);
            put(&mut bytes, at + view.treelet_at(slot), &treelet);
        }
    }
    // The object's box and sphere are enlarged, too.
    let record = layout.sections[0].range.start + 16;
    for end in 0..6 {
        let value = if end < 3 { -1000.0f32 } else { 1000.0 };
        put(&mut bytes, record + 32 + 4 * end, &value.to_le_bytes());
    }
    put(&mut bytes, record + 148, &2000.0f32.to_le_bytes());
    seal(&mut bytes);
    bytes
}

/// Makes the first object of a file state that it has so many triangles.
pub(crate) fn understated(mut bytes: Vec<u8>, triangles: u64) -> Vec<u8> {
    let record = FileLayout::read(&bytes).unwrap().sections[0].range.start + 16;
    put(&mut bytes, record + offset_of!(ObjectRecord, triangles), &triangles.to_le_bytes());
    seal(&mut bytes);
    bytes
}

/// Gives all triangles of a cube the same id, to which all of so many duplicates belong. Each contact would stand for the
/// square of their number.
pub(crate) fn duplicated(count: u32) -> Vec<u8> {
    let plain =
        to_bytes(&mesh(&outward(cube())), &options(Profile::Dop14U8, TriangleEncoding::F32)).unwrap().0;
    let duplicates: Vec<u8> = (1..=count).flat_map(|id| [0, id]).flat_map(u32::to_le_bytes).collect();
    let mut sections = take_apart(&plain);
    sections.retain(|section| section.0 < 4 || section.0 == SectionKind::Topology as u32);
    let nodes = sections.iter_mut().find(|section| section.0 == 2).unwrap();
    // The file has one page. All its lanes get id 0.
    let packets = usize::from(u16::from_le_bytes([nodes.2[56], nodes.2[57]]));
    let ids = encode_ids(&vec![[0; 4]; packets]);
    put(&mut nodes.2, 32, &0u64.to_le_bytes());
    put(&mut nodes.2, 52, &(ids.len() as u32 / 8).to_le_bytes());
    sections.push((4, 0, ids));
    sections.push((5, 0, duplicates));
    sections.sort_by_key(|section| section.0);
    put_together(&sections)
}
