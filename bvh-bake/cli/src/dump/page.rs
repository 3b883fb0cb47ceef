//! One decoded page, with its anchors, links and treelets; and one decoded treelet, with its links and slabs.

use super::Contents;
use crate::console::hex;
use bvh_bake::FileError;
use bvh_format::decode::decode_child;
use bvh_format::kdop::Kdop;
use bvh_format::object::Object;
use bvh_format::page::{NO_PARENT, Page};
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::Child;
use bvh_format::turning::decode_turning;
use bvh_format::{FormatError, Layout, Rule};
use serde::Serialize;

/// The object that `dump FILE --page N --json` prints.
#[derive(Serialize)]
pub(super) struct PageDump {
    page: u32,
    offset: u64,
    object: usize,
    profile: &'static str,
    checksum: String,
    leaf_checksum: String,
    id_checksum: String,
    leaf_line: u64,
    leaf_lines: u32,
    id_word: u64,
    id_words: u32,
    first_packet: u32,
    packets: u16,
    short_treelets: u8,
    treelet_line: u8,
    /// The 64-byte lines in use, of 64.
    lines: usize,
    anchors: Vec<AnchorDump>,
    remotes: Vec<RootDump>,
    treelets: Vec<SlotDump>,
}

/// A subtree root.
#[derive(Serialize)]
struct AnchorDump {
    slot: u8,
    /// The page and the remote link that lead here; `None` for the root of the object.
    parent_page: Option<u32>,
    parent_link: Option<u8>,
    slabs: Vec<[f32; 2]>,
}

/// A remote link and its target.
#[derive(Serialize)]
struct RootDump {
    link: u8,
    page: u32,
    root: u8,
}

#[derive(Serialize)]
struct SlotDump {
    slot: u8,
    children: Vec<ChildDump>,
}

/// A child of a treelet.
#[derive(Serialize)]
struct ChildDump {
    /// `treelet`, `remote` or `leaf`.
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    slot: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    page: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    root: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    packet: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<u8>,
    /// Empty unless slabs are asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    slabs: Vec<[f32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turning: Option<TurningDump>,
}

/// The turning slab of a child.
#[derive(Serialize)]
struct TurningDump {
    direction: [f32; 3],
    slab: [f32; 2],
}

impl ChildDump {
    fn new(page: &Page, child: Child) -> Option<Self> {
        let none = |kind| Self {
            kind,
            slot: None,
            page: None,
            root: None,
            packet: None,
            triangles: None,
            slabs: Vec::new(),
            turning: None,
        };
        match child {
            Child::Empty => None,
            Child::Treelet(slot) => Some(Self { slot: Some(slot), ..none("treelet") }),
            Child::Remote(link) => {
                let to = page.remote(link);
                Some(Self { page: Some(to.page()), root: Some(to.root()), ..none("remote") })
            }
            Child::Leaf { packet, triangles } => {
                Some(Self { packet: Some(packet), triangles: Some(triangles), ..none("leaf") })
            }
        }
    }

    fn to_text(&self) -> String {
        match *self {
            Self { slot: Some(slot), .. } => format!("slot {slot}"),
            Self { page: Some(page), root: Some(root), .. } => format!("page {page} root {root}"),
            Self { packet: Some(packet), triangles: Some(triangles), .. } => {
                format!("packet {packet} of {triangles}")
            }
            _ => "nothing".to_owned(),
        }
    }
}

fn children(page: &Page, slot: u8) -> Vec<ChildDump> {
    let links = page.links(slot);
    (0..links.children()).filter_map(|child| ChildDump::new(page, links.child(child))).collect()
}

fn slabs_of(kdop: &Kdop, slabs: usize) -> Vec<[f32; 2]> {
    (0..slabs).map(|slab| [kdop.lo[slab], kdop.hi[slab]]).collect()
}

fn slabs_text(slabs: &[[f32; 2]]) -> String {
    let texts: Vec<_> = slabs.iter().map(|[lo, hi]| format!("[{lo:?}, {hi:?}]")).collect();
    texts.join(" ")
}

impl PageDump {
    pub(super) fn new(contents: &Contents, number: u32) -> Result<Self, FileError> {
        let at = contents.layout.page_offset(number);
        let (index, object) = contents
            .object_of(number)
            .ok_or_else(|| FormatError::new(Rule::ObjectPages, at, "an object's page", "none"))?;
        let bytes = contents.checked(object, number)?;
        let page = bytes.page(object);
        let header = page.header();
        let slabs = object.profile().directions().slabs();
        let anchor = |slot| {
            let anchor = page.anchor(slot);
            let top = anchor.parent_page == NO_PARENT;
            AnchorDump {
                slot,
                parent_page: (!top).then_some(anchor.parent_page),
                parent_link: (!top).then_some(anchor.parent_link),
                slabs: slabs_of(&anchor.slabs.to_kdop(slabs), slabs),
            }
        };
        let remote = |link| {
            let to = page.remote(link);
            RootDump { link, page: to.page(), root: to.root() }
        };
        Ok(Self {
            page: number,
            offset: at,
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
            treelet_line: header.treelet_line,
            lines: header.shape().lines(object.profile()),
            short_treelets: header.short,
            anchors: (0..header.roots).map(anchor).collect(),
            remotes: (0..header.remotes).map(remote).collect(),
            treelets: (0..header.treelets)
                .map(|slot| SlotDump { slot, children: children(&page, slot) })
                .collect(),
        })
    }

    pub(super) fn to_text(&self) -> String {
        let mut text = format!(
            "page {} at byte {}, object {}, {}, checksum {}\n",
            self.page, self.offset, self.object, self.profile, self.checksum
        );
        text += &format!(
            "  {} of 64 lines in use: {} anchors, {} remote links, {} treelets, {} of them short, from line {}\n",
            self.lines,
            self.anchors.len(),
            self.remotes.len(),
            self.treelets.len(),
            self.short_treelets,
            self.treelet_line
        );
        text += &format!(
            "  {} packets from {}; leaf lines {} from {}; id words {} from {}\n",
            self.packets, self.first_packet, self.leaf_lines, self.leaf_line, self.id_words, self.id_word
        );
        for anchor in &self.anchors {
            let parent = match (anchor.parent_page, anchor.parent_link) {
                (Some(page), Some(link)) => format!("page {page} link {link}"),
                _ => "none".to_owned(),
            };
            text += &format!("  root {} parent {parent}: {}\n", anchor.slot, slabs_text(&anchor.slabs));
        }
        for RootDump { link, page, root } in &self.remotes {
            text += &format!("  link {link} to page {page} root {root}\n");
        }
        for treelet in &self.treelets {
            let children: Vec<_> = treelet.children.iter().map(ChildDump::to_text).collect();
            text += &format!("  slot {}: {}\n", treelet.slot, children.join(", "));
        }
        text
    }
}

/// The object that `dump FILE --treelet N --json` prints.
#[derive(Serialize)]
pub(super) struct TreeletDump {
    treelet: u64,
    object: usize,
    profile: &'static str,
    page: u32,
    slot: u8,
    offset: u64,
    /// The slabs of the treelet itself, decoded from its anchor down.
    slabs: Vec<[f32; 2]>,
    children: Vec<ChildDump>,
}

impl TreeletDump {
    /// Returns the treelet with this number in the file, or `None` after the last one.
    pub(super) fn find(contents: &Contents, number: u64) -> Result<Option<Self>, FileError> {
        let mut before = 0;
        for (index, object) in contents.layout.objects.iter().enumerate() {
            for page_number in object.pages() {
                let bytes = contents.checked(object, page_number)?;
                let page = bytes.page(object);
                let treelets = u64::from(page.header().treelets);
                if number < before + treelets {
                    let slot = (number - before) as u8;
                    return Ok(Some(Self::new(&contents.layout, index, object, &page, number, slot)));
                }
                before += treelets;
            }
        }
        Ok(None)
    }

    fn new(layout: &Layout, index: usize, object: &Object, page: &Page, number: u64, slot: u8) -> Self {
        let slabs = object.profile().directions().slabs();
        let own = decoded_slots(object, page)[usize::from(slot)];
        let mut children = children(page, slot);
        for (child, dump) in children.iter_mut().enumerate() {
            let node = decode_child(object.profile(), object.f16_scale(), page.treelet(slot), child, &own);
            dump.slabs = slabs_of(&node.to_kdop(slabs), slabs);
            let turning = decode_turning(object.profile(), page.treelet(slot), child, &node);
            dump.turning = turning
                .map(|slab| TurningDump { direction: slab.direction.vector(), slab: [slab.lo, slab.hi] });
        }
        let page_number = page.header().page_number.get();
        Self {
            treelet: number,
            object: index,
            profile: object.profile().name(),
            page: page_number,
            slot,
            offset: layout.page_offset(page_number) + page.treelet_at(slot) as u64,
            slabs: slabs_of(&own.to_kdop(slabs), slabs),
            children,
        }
    }

    pub(super) fn to_text(&self) -> String {
        let mut text = format!(
            "treelet {}: page {}, slot {}, at byte {}, object {}, {}\n  own    {}\n",
            self.treelet,
            self.page,
            self.slot,
            self.offset,
            self.object,
            self.profile,
            slabs_text(&self.slabs)
        );
        for (number, child) in self.children.iter().enumerate() {
            text +=
                &format!("  child {number}: {}\n         {}\n", child.to_text(), slabs_text(&child.slabs));
            if let Some(TurningDump { direction, slab }) = &child.turning {
                text += &format!("         turning {} along {direction:?}\n", slabs_text(&[*slab]));
            }
        }
        text
    }
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
