//! Lists the triangles of a file by the reference decoder.

use crate::Triangle;
use bvh_format::Layout;
use bvh_format::ids::decode_id;
use bvh_format::leaf::{VertexBlock, decode_packet};
use bvh_format::page::Page;
use bvh_format::validate::packets;

/// A stored triangle.
#[derive(Clone, Copy, Debug)]
pub struct Stored {
    /// The number of the object in the file.
    pub object: u32,
    /// The place in the object, in the order of the leaves.
    pub place: u32,
    /// The id or, in files without ids, the place.
    pub id: u32,
    /// The corners as they are stored, relative to the object's origin.
    pub values: [[f32; 3]; 3],
    /// The corners in mesh units: the origin plus the stored values.
    pub corners: Triangle,
}

/// Returns the triangles of a file in the order of the leaves, without the duplicates that were left out.
///
/// # Panics
/// Panics if the file is not valid.
pub fn stored(bytes: &[u8]) -> Vec<Stored> {
    let layout = Layout::read(bytes).expect("a valid file");
    let mut triangles = Vec::new();
    for (object, of_file) in (0..).zip(&layout.objects) {
        for page in of_file.pages() {
            let page = Page::new(layout.page_bytes(bytes, page).expect("a page"), of_file.profile());
            let header = page.header();
            let (block, ids) = (layout.leaf_block(bytes, header), layout.id_block(bytes, header));
            let (encoding, in_page) = (of_file.triangle_encoding(), header.packets.get().into());
            let vertices = VertexBlock::new(encoding, of_file.vertices(), block, in_page);
            for (packet, count) in packets(&page) {
                let decoded = decode_packet(of_file.triangle_encoding(), block, usize::from(packet));
                for lane in 0..count {
                    let place = 4 * (header.first_packet.get() + u32::from(packet)) + lane as u32;
                    let id = if layout.has_ids() { decode_id(ids, usize::from(packet), lane) } else { place };
                    let values = decoded.triangle(lane);
                    let corners = vertices.triangle(packet.into(), lane);
                    triangles.push(Stored { object, place, id, values, corners });
                }
            }
        }
    }
    triangles
}
