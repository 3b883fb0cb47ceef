//! One decoded page, with its anchors, links and treelets; and one decoded treelet, with its links and slabs.

use super::{Contents, children};
use crate::console::{Record, hex, record};
use bvh_bake::FileError;
use bvh_format::kdop::Kdop;
use bvh_format::object::Object;
use bvh_format::page::decode::decode_child;
use bvh_format::page::{NO_PARENT, Page};
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::Child;
use bvh_format::turning::decode_turning;
use bvh_format::{FormatError, Rule};

/// Returns what a link leads to: `treelet`, `remote` or `leaf`.
fn child_json(page: &Page, child: Child) -> Record {
    match child {
        Child::Empty => record! {},
        Child::Treelet(slot) => record! { kind: "treelet", slot: slot },
        Child::Remote(link) => {
            let to = page.remote(link);
            record! { kind: "remote", page: to.page(), root: to.root() }
        }
        Child::Leaf { packet, triangles } => record! { kind: "leaf", packet: packet, triangles: triangles },
    }
}

fn slabs_of(kdop: &Kdop, slabs: usize) -> Vec<[f32; 2]> {
    (0..slabs).map(|slab| [kdop.lo[slab], kdop.hi[slab]]).collect()
}

/// Shows the page of this number.
pub(super) fn page(contents: &Contents, number: u32) -> Result<Record, FileError> {
    let offset = contents.layout.page_offset(number);
    let (index, object) = contents
        .object_of(number)
        .ok_or_else(|| FormatError::new(Rule::ObjectPages, offset, "an object's page", "none"))?;
    let bytes = contents.checked(object, number)?;
    let page = bytes.page(object);
    let header = page.header();
    let slabs = object.profile().directions().slabs();
    // Each subtree root, with the page and the remote link that lead to it; none to the root of the object.
    let anchors = (0..header.roots).map(|slot| {
        let anchor = page.anchor(slot);
        let parent = (anchor.parent_page != NO_PARENT).then_some((anchor.parent_page, anchor.parent_link));
        let (page, link) = parent.unzip();
        let slabs = slabs_of(&anchor.slabs.to_kdop(slabs), slabs);
        record! { slot: slot, parent_page: page, parent_link: link, slabs: slabs }
    });
    let remotes = (0..header.remotes).map(|link| {
        let to = page.remote(link);
        record! { link: link, page: to.page(), root: to.root() }
    });
    let treelets = (0..header.treelets).map(|slot| {
        let children = children(&page, slot).map(|(_, child)| child_json(&page, child));
        record! { slot: slot, children: children.collect::<Vec<_>>() }
    });
    Ok(record! {
        page: number,
        offset: offset,
        object: index,
        profile: object.profile().name(),
        checksum: hex(header.checksum.get()),
        leaf_checksum: hex(header.leaf_checksum.get()),
        id_checksum: hex(header.id_checksum.get()),
        leaf_line: header.leaf_line.get(),
        leaf_lines: header.leaf_lines.get(),
        id_word: header.id_word.get(),
        id_words: header.id_words.get(),
        first_packet: header.first_packet.get(),
        packets: header.packets.get(),
        short_treelets: header.short,
        treelet_line: header.treelet_line,
        // The 64-byte lines in use, of 64.
        lines: header.shape().lines(object.profile()),
        anchors: anchors.collect::<Vec<_>>(),
        remotes: remotes.collect::<Vec<_>>(),
        treelets: treelets.collect::<Vec<_>>(),
    })
}

/// Shows the treelet with this number in the file. Returns `None` after the last one.
pub(super) fn treelet(contents: &Contents, number: u64) -> Result<Option<Record>, FileError> {
    let mut before = 0;
    for (index, object) in contents.layout.objects.iter().enumerate() {
        for page_number in object.pages() {
            let bytes = contents.checked(object, page_number)?;
            let page = bytes.page(object);
            let treelets = u64::from(page.header().treelets);
            if number < before + treelets {
                let slot = (number - before) as u8;
                let offset = contents.layout.page_offset(page_number) + page.treelet_at(slot) as u64;
                let profile = object.profile();
                let slabs = profile.directions().slabs();
                // Decoded from its anchor down.
                let own = decoded_slots(object, &page)[usize::from(slot)];
                let children = children(&page, slot).map(|(place, child)| {
                    let node = decode_child(profile, object.f16_scale(), page.treelet(slot), place, &own);
                    let turning = decode_turning(profile, page.treelet(slot), place, &node).map(|of| {
                        let turning = record! { direction: of.direction.vector(), slab: [of.lo, of.hi] };
                        record! { turning: turning }
                    });
                    let slabs = slabs_of(&node.to_kdop(slabs), slabs);
                    child_json(&page, child).with(record! { slabs: slabs }).with(turning)
                });
                return Ok(Some(record! {
                    treelet: number,
                    object: index,
                    profile: profile.name(),
                    page: page_number,
                    slot: slot,
                    offset: offset,
                    slabs: slabs_of(&own.to_kdop(slabs), slabs),
                    children: children.collect::<Vec<_>>(),
                }));
            }
            before += treelets;
        }
    }
    Ok(None)
}

/// Decodes the slabs of every slot of a page.
fn decoded_slots(object: &Object, page: &Page) -> Vec<NodeSlabs> {
    let header = page.header();
    let mut decoded = vec![NodeSlabs::default(); usize::from(header.treelets)];
    for root in 0..header.roots {
        decoded[usize::from(root)] = page.anchor_slabs(root);
    }
    for slot in 0..header.treelets {
        let (treelet, parent) = (page.treelet(slot), decoded[usize::from(slot)]);
        for (place, child) in children(page, slot) {
            if let Child::Treelet(inner) = child {
                decoded[usize::from(inner)] =
                    decode_child(object.profile(), object.f16_scale(), treelet, place, &parent);
            }
        }
    }
    decoded
}
