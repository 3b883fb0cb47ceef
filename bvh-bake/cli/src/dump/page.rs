//! One decoded page, with its anchors, links and treelets; and one decoded treelet, with its links and slabs.

use super::{Contents, Shown};
use crate::console::{Record, hex, record};
use bvh_bake::FileError;
use bvh_format::decode::decode_child;
use bvh_format::kdop::Kdop;
use bvh_format::object::Object;
use bvh_format::page::{NO_PARENT, Page};
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::Child;
use bvh_format::turning::decode_turning;
use bvh_format::{FormatError, Rule};

/// Returns the children of a treelet, without empty places.
fn children(page: &Page, slot: u8) -> Vec<Child> {
    let links = page.links(slot);
    let children = (0..links.children()).map(|child| links.child(child));
    children.filter(|child| !matches!(child, Child::Empty)).collect()
}

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

fn child_text(page: &Page, child: Child) -> String {
    match child {
        Child::Empty => "nothing".to_owned(),
        Child::Treelet(slot) => format!("slot {slot}"),
        Child::Remote(link) => {
            let to = page.remote(link);
            format!("page {} root {}", to.page(), to.root())
        }
        Child::Leaf { packet, triangles } => format!("packet {packet} of {triangles}"),
    }
}

fn slabs_of(kdop: &Kdop, slabs: usize) -> Vec<[f32; 2]> {
    (0..slabs).map(|slab| [kdop.lo[slab], kdop.hi[slab]]).collect()
}

fn slabs_text(slabs: &[[f32; 2]]) -> String {
    let texts: Vec<_> = slabs.iter().map(|[lo, hi]| format!("[{lo:?}, {hi:?}]")).collect();
    texts.join(" ")
}

/// Shows the page of this number.
pub(super) fn page(contents: &Contents, number: u32, as_json: bool) -> Result<Shown, FileError> {
    let offset = contents.layout.page_offset(number);
    let (index, object) = contents
        .object_of(number)
        .ok_or_else(|| FormatError::new(Rule::ObjectPages, offset, "an object's page", "none"))?;
    let bytes = contents.checked(object, number)?;
    let page = bytes.page(object);
    let (header, profile) = (page.header(), object.profile().name());
    // The 64-byte lines in use, of 64.
    let lines = header.shape().lines(object.profile());
    let (checksum, packets, first_packet) =
        (hex(header.checksum.get()), header.packets.get(), header.first_packet.get());
    let (leaf_line, leaf_lines) = (header.leaf_line.get(), header.leaf_lines.get());
    let (id_word, id_words) = (header.id_word.get(), header.id_words.get());
    let slabs = object.profile().directions().slabs();
    // Each subtree root, with the page and the remote link that lead to it; none to the root of the object.
    let anchors = (0..header.roots).map(|slot| {
        let anchor = page.anchor(slot);
        let parent = (anchor.parent_page != NO_PARENT).then_some((anchor.parent_page, anchor.parent_link));
        (slot, parent, slabs_of(&anchor.slabs.to_kdop(slabs), slabs))
    });
    let remotes = (0..header.remotes).map(|link| (link, page.remote(link)));
    let treelets = (0..header.treelets).map(|slot| (slot, children(&page, slot)));
    if as_json {
        let anchors = anchors.map(|(slot, parent, slabs)| {
            let (page, link) = parent.unzip();
            record! { slot: slot, parent_page: page, parent_link: link, slabs: slabs }
        });
        let remotes = remotes.map(|(link, to)| record! { link: link, page: to.page(), root: to.root() });
        let treelets = treelets.map(|(slot, children)| {
            let children = children.into_iter().map(|child| child_json(&page, child));
            record! { slot: slot, children: children.collect::<Vec<_>>() }
        });
        return Ok(Shown::Json(record! {
            page: number,
            offset: offset,
            object: index,
            profile: profile,
            checksum: checksum,
            leaf_checksum: hex(header.leaf_checksum.get()),
            id_checksum: hex(header.id_checksum.get()),
            leaf_line: leaf_line,
            leaf_lines: leaf_lines,
            id_word: id_word,
            id_words: id_words,
            first_packet: first_packet,
            packets: packets,
            short_treelets: header.short,
            treelet_line: header.treelet_line,
            lines: lines,
            anchors: anchors.collect::<Vec<_>>(),
            remotes: remotes.collect::<Vec<_>>(),
            treelets: treelets.collect::<Vec<_>>(),
        }));
    }
    let mut text =
        format!("page {number} at byte {offset}, object {index}, {profile}, checksum {checksum}\n");
    text += &format!(
        "  {lines} of 64 lines in use: {} anchors, {} remote links, {} treelets, {} of them short, from line {}\n",
        header.roots, header.remotes, header.treelets, header.short, header.treelet_line
    );
    text += &format!(
        "  {packets} packets from {first_packet}; leaf lines {leaf_lines} from {leaf_line}; id words {id_words} from \
         {id_word}\n"
    );
    for (slot, parent, slabs) in anchors {
        let parent = parent.map_or("none".to_owned(), |(page, link)| format!("page {page} link {link}"));
        text += &format!("  root {slot} parent {parent}: {}\n", slabs_text(&slabs));
    }
    for (link, to) in remotes {
        text += &format!("  link {link} to page {} root {}\n", to.page(), to.root());
    }
    for (slot, children) in treelets {
        let children: Vec<_> = children.into_iter().map(|child| child_text(&page, child)).collect();
        text += &format!("  slot {slot}: {}\n", children.join(", "));
    }
    Ok(Shown::Text(text))
}

/// Shows the treelet with this number in the file. Returns `None` after the last one.
pub(super) fn treelet(contents: &Contents, number: u64, as_json: bool) -> Result<Option<Shown>, FileError> {
    let mut before = 0;
    for (index, object) in contents.layout.objects.iter().enumerate() {
        for page_number in object.pages() {
            let bytes = contents.checked(object, page_number)?;
            let page = bytes.page(object);
            let treelets = u64::from(page.header().treelets);
            if number < before + treelets {
                let slot = (number - before) as u8;
                let offset = contents.layout.page_offset(page_number) + page.treelet_at(slot) as u64;
                return Ok(Some(treelet_of(object, &page, slot, (number, index, offset), as_json)));
            }
            before += treelets;
        }
    }
    Ok(None)
}

/// Shows the treelet in a slot of a page, of which the number, the number of its object and the place are given.
fn treelet_of(
    object: &Object,
    page: &Page,
    slot: u8,
    (number, index, offset): (u64, usize, u64),
    as_json: bool,
) -> Shown {
    let (profile, page_number) = (object.profile(), page.header().page_number.get());
    let slabs = profile.directions().slabs();
    // Decoded from its anchor down.
    let own = decoded_slots(object, page)[usize::from(slot)];
    let children = children(page, slot).into_iter().enumerate().map(|(place, child)| {
        let node = decode_child(profile, object.f16_scale(), page.treelet(slot), place, &own);
        let turning = decode_turning(profile, page.treelet(slot), place, &node);
        let turning = turning.map(|slab| (slab.direction.vector(), [slab.lo, slab.hi]));
        (child, slabs_of(&node.to_kdop(slabs), slabs), turning)
    });
    let own_slabs = slabs_of(&own.to_kdop(slabs), slabs);
    if as_json {
        let children = children.map(|(child, slabs, turning)| {
            let turning = turning.map(|(direction, slab)| record! { direction: direction, slab: slab });
            let turning = turning.map(|turning| record! { turning: turning });
            child_json(page, child).with(record! { slabs: slabs }).with(turning)
        });
        return Shown::Json(record! {
            treelet: number,
            object: index,
            profile: profile.name(),
            page: page_number,
            slot: slot,
            offset: offset,
            slabs: own_slabs,
            children: children.collect::<Vec<_>>(),
        });
    }
    let mut text = format!(
        "treelet {number}: page {page_number}, slot {slot}, at byte {offset}, object {index}, {}\n  own    {}\n",
        profile.name(),
        slabs_text(&own_slabs)
    );
    for (place, (child, slabs, turning)) in children.enumerate() {
        text += &format!("  child {place}: {}\n         {}\n", child_text(page, child), slabs_text(&slabs));
        if let Some((direction, slab)) = turning {
            text += &format!("         turning {} along {direction:?}\n", slabs_text(&[slab]));
        }
    }
    Shown::Text(text)
}

/// Decodes the slabs of every slot of a page.
fn decoded_slots(object: &Object, page: &Page) -> Vec<NodeSlabs> {
    let header = page.header();
    let mut decoded = vec![NodeSlabs::default(); usize::from(header.treelets)];
    for root in 0..header.roots {
        decoded[usize::from(root)] = page.anchor_slabs(root);
    }
    for slot in 0..header.treelets {
        let treelet = page.treelet(slot);
        let links = page.links(slot);
        for child in 0..links.children() {
            if let Child::Treelet(inner) = links.child(child) {
                let parent = decoded[usize::from(slot)];
                decoded[usize::from(inner)] =
                    decode_child(object.profile(), object.f16_scale(), treelet, child, &parent);
            }
        }
    }
    decoded
}
