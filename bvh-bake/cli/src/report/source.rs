//! The mesh to bake: read from a mesh file, or taken out of a `.cbvh` file.

use crate::asking::mesh::{is_baked, refuse_scene};
use crate::console::Failure;
use bvh_bake::input;
use bvh_bake::mesh::Mesh;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::validate::{packets, validate};
use bvh_query::Bvh;
use std::path::Path;

/// Returns the mesh of a file, all its objects as one.
pub(super) fn mesh(path: &Path) -> Result<Mesh, Failure> {
    if is_baked(path)? {
        return unbaked(path);
    }
    let read =
        input::read(path).map_err(|error| Failure::from_bake(&path.display().to_string(), &error.into()))?;
    Ok(read.merged())
}

/// Returns the triangles of a `.cbvh` file in the order of their ids, or in the order of the file if it has no ids. The
/// file stores only one of several exact duplicates, so the others are missing.
fn unbaked(path: &Path) -> Result<Mesh, Failure> {
    let bvh = Bvh::open(path)?;
    refuse_scene(path, &bvh)?;
    validate(bvh.bytes()).map_err(|error| Failure::invalid(path, error))?;
    let (layout, bytes) = (bvh.layout(), bvh.bytes());
    let mut triangles = Vec::new();
    for object in bvh.objects() {
        let origin = object.origin();
        for number in object.pages() {
            let Some(page) = layout.page_bytes(bytes, number) else { continue };
            let page = Page::new(page, object.profile());
            let header = page.header();
            let (block, ids) = (layout.leaf_block(bytes, header), layout.id_block(bytes, header));
            for (packet, count) in packets(&page) {
                let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                for lane in 0..count {
                    let place = triangles.len() as u32;
                    let id = if layout.has_ids() { decode_id(ids, usize::from(packet), lane) } else { place };
                    let corner = |corner: [f32; 3]| [0, 1, 2].map(|a| origin[a] + f64::from(corner[a]));
                    triangles.push((id, values.triangle(lane).map(corner)));
                }
            }
        }
    }
    triangles.sort_by_key(|&(id, _)| id);
    let positions: Vec<[f64; 3]> = triangles.iter().flat_map(|&(_, corners)| corners).collect();
    let numbers = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(Mesh::from_triangles(positions, numbers))
}
