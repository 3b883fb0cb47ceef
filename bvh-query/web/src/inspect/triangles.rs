//! All triangles of a mesh in the order of the file, as the page draws them, and where each one is stored.

use crate::answers::ids;
use crate::arguments::{Answer, refused, room};
use crate::inspect::tree::page;
use crate::mesh::Mesh;
use bvh_format::ids::decode_id;
use bvh_format::leaf::VertexBlock;
use bvh_format::page::Page;
use bvh_format::treelet::Child;
use js_sys::{Array, Float32Array, Uint8Array, Uint16Array};
use wasm_bindgen::prelude::*;

/// The leaf packets of a checked page in the order of slots: the slot, the packet, and the number of its triangles.
fn packets<'a>(page: &'a Page<'a>) -> impl Iterator<Item = (u8, u16, usize)> + 'a {
    (0..page.header().treelets).flat_map(|slot| {
        let links = page.links(slot);
        (0..links.children()).filter_map(move |place| match links.child(place) {
            Child::Leaf { packet, triangles } => Some((slot, packet, usize::from(triangles))),
            _ => None,
        })
    })
}

/// The corners of all stored triangles in the order of the file, nine coordinates for each, less a point; the id of each; its
/// packet in its page; the slot of the treelet that has the packet; for each page of the mesh, the number of the triangles before
/// it, and all at the end; and pairs of a stored id and the id of a duplicate.
#[wasm_bindgen(js_name = storedTriangles)]
pub fn stored_triangles(mesh: &Mesh, x: f64, y: f64, z: f64) -> Answer<Array> {
    let (shape, bvh, point) = (mesh.shape.shape(), mesh.shape.bvh(), [x, y, z]);
    let layout = bvh.layout();
    let count = shape.triangles();
    // A forged file may state any number, so what it holds decides.
    let count = usize::try_from(count).unwrap_or(usize::MAX).min(bvh.bytes().len());
    let mut corners: Vec<[[f32; 3]; 3]> = room("triangles", [[0.0; 3]; 3], count)?;
    corners.clear();
    let (mut numbers, mut in_page, mut slots, mut before) = (vec![], vec![], vec![], vec![]);
    for object in shape.objects() {
        for number in object.pages() {
            before.push(corners.len() as u32);
            let page = page(bvh, object, number).map_err(refused)?;
            layout.check_leaf_block(bvh.bytes(), &page, object).map_err(refused)?;
            layout.check_id_block(bvh.bytes(), &page).map_err(refused)?;
            let header = page.header();
            let (block, id_block) =
                (layout.leaf_block(bvh.bytes(), header), layout.id_block(bvh.bytes(), header));
            let in_block = header.packets.get().into();
            let vertices = VertexBlock::new(object.triangle_encoding(), object.vertices(), block, in_block);
            for (slot, packet, lanes) in packets(&page) {
                for lane in 0..lanes {
                    let place = header.first_packet.get().wrapping_add(packet.into()).wrapping_mul(4);
                    numbers.push(if layout.has_ids() {
                        decode_id(id_block, packet.into(), lane)
                    } else {
                        place.wrapping_add(lane as u32)
                    });
                    in_page.push(packet);
                    slots.push(slot);
                    let near = |v: [f64; 3]| [0, 1, 2].map(|k| (v[k] - point[k]) as f32);
                    corners.push(vertices.triangle(packet.into(), lane).map(near));
                }
            }
        }
    }
    before.push(corners.len() as u32);
    layout.check_duplicates(bvh.bytes()).map_err(refused)?;
    let duplicates = layout.duplicate_ids(bvh.bytes()).iter().flatten().map(|id| id.get());
    Ok([
        Float32Array::from(corners.as_flattened().as_flattened()).into(),
        ids(numbers.into_iter()),
        Uint16Array::from(&in_page[..]).into(),
        Uint8Array::from(&slots[..]).into(),
        ids(before.into_iter()),
        ids(duplicates),
    ]
    .into_iter()
    .collect())
}
