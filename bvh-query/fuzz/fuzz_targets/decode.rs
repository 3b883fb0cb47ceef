//! Decodes a whole file page by page, even if the file is not valid.

use bvh_format::Layout;
use bvh_format::bounds::{Subtree, check_bounds};
use bvh_format::ids::decode_id;
use bvh_format::leaf::{VertexBlock, decode_packet};
use bvh_format::page::decode::decode_child;
use bvh_format::page::{Page, check_crossing, check_page};
use bvh_format::turning::decode_turning;
use bvh_format::validate::{packets, validate};

pub fn decode(bytes: &[u8]) {
    let valid = validate(bytes).is_ok();
    let Ok(layout) = Layout::read(bytes) else {
        assert!(!valid);
        return;
    };
    let _ = layout.check_duplicates(bytes);
    for object in &layout.objects {
        for number in object.pages() {
            let page_bytes = layout.page_bytes(bytes, number).expect("the pages of objects are there");
            let checked = check_page(page_bytes, number, object, layout.page_offset(number));
            assert!(checked.is_ok() || !valid);
            // Code that follows a check relies on it, but bytes that were not checked may be read, too.
            let page = Page::new(page_bytes, object.profile());
            let header = page.header();
            let blocks = layout.check_leaf_block(bytes, &page, object).is_ok()
                && layout.check_id_block(bytes, &page).is_ok();
            let (leaves, ids) = (layout.leaf_block(bytes, header), layout.id_block(bytes, header));
            let encoding = object.triangle_encoding();
            let vertices = VertexBlock::new(encoding, object.vertices(), leaves, header.packets.get().into());
            for (packet, triangles) in packets(&page) {
                let _ = vertices.triangle(usize::from(packet), triangles - 1);
                let _ = decode_packet(encoding, leaves, usize::from(packet));
                let _ = decode_id(ids, usize::from(packet), triangles - 1);
            }
            for slot in 0..header.treelets {
                let treelet = page.treelet(slot);
                let node = page.anchor(slot % header.roots.max(1)).slabs;
                for child in 0..page.links(slot).children().min(object.profile().width()) {
                    let slabs = decode_child(object.profile(), object.f16_scale(), treelet, child, &node);
                    let _ = decode_turning(object.profile(), treelet, child, &slabs);
                }
            }
            for link in 0..header.remotes {
                let to = page.remote(link);
                if let Some(target) = layout.page_bytes(bytes, to.page()) {
                    let target = Page::new(target, object.profile());
                    let _ = check_crossing(&target, to, (number, link), &page.anchor_slabs(0), 0);
                }
            }
            if checked.is_ok() && blocks {
                let _ = check_bounds(&layout, object, &page, leaves, true, |_| Subtree::unknown());
            }
        }
    }
}
