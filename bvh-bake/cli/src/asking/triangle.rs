//! Triangles and points of answers: how they are named for a person, and where they are.

use super::mesh::LoadedMesh;
use crate::console::Failure;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::validate::packets;

/// Returns a point as its three coordinates.
pub(crate) fn point(point: [f64; 3]) -> String {
    let [x, y, z] = point;
    format!("{x:?} {y:?} {z:?}")
}

/// Names a triangle for people. The object is named only if there are several.
pub(crate) fn name(mesh: &LoadedMesh, object: u32, triangle: u32) -> String {
    match mesh.bvh.objects() {
        [_] => format!("triangle {triangle}"),
        objects => {
            let name = objects.get(object as usize).map_or("", |object| object.name());
            format!("object {object} {name:?} triangle {triangle}")
        }
    }
}

/// Finds the corners of a triangle by its number, in the frame of its file. Searches all pages of the object, which is
/// fast enough for one answer.
pub(crate) fn corners(mesh: &LoadedMesh, object: u32, triangle: u32) -> Result<[[f64; 3]; 3], Failure> {
    let (layout, bytes) = (mesh.bvh.layout(), mesh.bvh.bytes());
    let lost =
        || Failure::Invalid(format!("{}: expected triangle {triangle}, found none", mesh.path.display()));
    let object = mesh.bvh.objects().get(object as usize).ok_or_else(lost)?;
    let first = object.record().first_page.get();
    for number in first..first + object.record().pages.get() {
        let Some(page) = layout.page_bytes(bytes, number) else { continue };
        let page = Page::new(page, object.profile());
        let header = page.header();
        let ids = layout.id_block(bytes, header);
        for (packet, count) in packets(&page) {
            for lane in 0..count {
                let id = if layout.has_ids() {
                    decode_id(ids, usize::from(packet), lane)
                } else {
                    let packet = header.first_packet.get().wrapping_add(u32::from(packet));
                    packet.wrapping_mul(4).wrapping_add(lane as u32)
                };
                if id == triangle {
                    let block = layout.leaf_block(bytes, header);
                    let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                    let place = |axis: usize, v: f32| object.origin()[axis] + f64::from(v);
                    let corners = values.triangle(lane);
                    return Ok(corners.map(|v| [0, 1, 2].map(|axis| place(axis, v[axis]))));
                }
            }
        }
    }
    Err(lost())
}
