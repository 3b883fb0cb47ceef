//! The triangles of a shape, as its file stores them.

use crate::error::QueryError;
use crate::file::shape::Shape;
use bvh_format::ids::decode_id;
use bvh_format::leaf::VertexBlock;
use bvh_format::validate::packets;

impl Shape<'_> {
    /// Calls `visit` with the number and the corners of each triangle, in the order of the file and in its frame. A duplicate
    /// that was left out has a number of its own, and the corners of the triangle that is stored for it. In a file
    /// without ids, triangles are numbered in the order of each object.
    ///
    /// Cost: reading the shape once, and checking the pages that no query has touched.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] with the first rule that does not hold. Triangles of earlier pages have been visited.
    pub fn visit_triangles(self, mut visit: impl FnMut(u32, [[f64; 3]; 3])) -> Result<(), QueryError> {
        let bvh = self.bvh();
        let has_ids = bvh.layout().has_ids();
        for object in self.objects() {
            for number in object.pages() {
                let page = bvh.page(object, number)?;
                let (block, ids) = (bvh.leaf_block(object, &page)?, bvh.id_block(&page)?);
                let first_packet = page.header().first_packet.get();
                let in_page = page.header().packets.get().into();
                let vertices =
                    VertexBlock::new(object.triangle_encoding(), object.vertices(), block, in_page);
                for (packet, count) in packets(&page) {
                    for lane in 0..count {
                        let place = first_packet.wrapping_add(u32::from(packet)).wrapping_mul(4);
                        let id = if has_ids {
                            decode_id(ids, usize::from(packet), lane)
                        } else {
                            place.wrapping_add(lane as u32)
                        };
                        let corners = vertices.triangle(packet.into(), lane);
                        visit(id, corners);
                        bvh.duplicates_of(id)?.for_each(|duplicate| visit(duplicate, corners));
                    }
                }
            }
        }
        Ok(())
    }

    /// Calls `visit` with the corners of each stored triangle until it returns true. Duplicates count once: a damaged file may state
    /// any number of them.
    pub(crate) fn visit_stored_until(
        self,
        mut visit: impl FnMut([[f64; 3]; 3]) -> bool,
    ) -> Result<(), QueryError> {
        let bvh = self.bvh();
        for object in self.objects() {
            for number in object.pages() {
                let page = bvh.page(object, number)?;
                let block = bvh.leaf_block(object, &page)?;
                let in_page = page.header().packets.get().into();
                let vertices =
                    VertexBlock::new(object.triangle_encoding(), object.vertices(), block, in_page);
                for (packet, count) in packets(&page) {
                    if (0..count).any(|lane| visit(vertices.triangle(packet.into(), lane))) {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }
}
