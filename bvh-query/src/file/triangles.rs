//! The triangles of a shape, as its file stores them.

use crate::error::QueryError;
use crate::file::shape::Shape;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::validate::packets;

impl Shape<'_> {
    /// Calls `visit` with the number and the corners of each triangle, in the order of the file and in its frame. A duplicate
    /// that was left out has a number of its own, and the corners of the triangle that is stored for it. In a file
    /// without ids, triangles are numbered in the order of each object.
    ///
    /// Cost: reading the shape once, and checking the pages that no question has touched.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] with the first rule that does not hold. Triangles of earlier pages have been visited.
    pub fn visit_triangles(self, mut visit: impl FnMut(u32, [[f64; 3]; 3])) -> Result<(), QueryError> {
        let bvh = self.bvh();
        let has_ids = bvh.layout().has_ids();
        for object in self.objects() {
            let origin = object.origin();
            for number in object.pages() {
                let page = bvh.page(object, number)?;
                let (block, ids) = (bvh.leaf_block(object, &page)?, bvh.id_block(&page)?);
                let first_packet = page.header().first_packet.get();
                for (packet, count) in packets(&page) {
                    let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                    for lane in 0..count {
                        let place = first_packet.wrapping_add(u32::from(packet)).wrapping_mul(4);
                        let id = if has_ids {
                            decode_id(ids, usize::from(packet), lane)
                        } else {
                            place.wrapping_add(lane as u32)
                        };
                        let corner = |v: [f32; 3]| [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]));
                        let corners = values.triangle(lane).map(corner);
                        visit(id, corners);
                        bvh.duplicates_of(id)?.for_each(|duplicate| visit(duplicate, corners));
                    }
                }
            }
        }
        Ok(())
    }
}
