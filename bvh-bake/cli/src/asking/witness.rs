//! Triangles, points and the witness of a distance: how they are named for a person, and as OBJ.

use super::mesh::LoadedMesh;
use crate::console::Failure;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::validate::packets;
use bvh_query::{Distance, Pose};

/// Returns a distance, its bounds and the closest points with their triangles.
pub(crate) fn describe([mesh_a, mesh_b]: [&LoadedMesh; 2], answer: &Distance) -> String {
    let Distance { distance, lower, upper, point_a, point_b, .. } = answer;
    let a = name(mesh_a, answer.object_a, answer.triangle_a);
    let b = name(mesh_b, answer.object_b, answer.triangle_b);
    let touch = if *distance == 0.0 { " (the meshes touch)" } else { "" };
    format!(
        "distance {distance:?}{touch}\n  certainly {lower:?} to {upper:?}\n  on A {}, {a}\n  on B {}, {b}\n",
        point(*point_a),
        point(*point_b)
    )
}

/// Returns both triangles as faces, and the segment between the closest points as a line, all in the frame of A.
pub(crate) fn obj(
    [mesh_a, mesh_b]: [&LoadedMesh; 2],
    pose: &Pose,
    answer: &Distance,
) -> Result<String, Failure> {
    let a = corners(mesh_a, answer.object_a, answer.triangle_a)?;
    let b = corners(mesh_b, answer.object_b, answer.triangle_b)?.map(|corner| pose.place(corner));
    let mut text = format!("# distance {:?}\n", answer.distance);
    let mut vertices = |points: &[[f64; 3]]| {
        points.iter().for_each(|&p| text.push_str(&format!("v {}\n", point(p))));
    };
    vertices(&a);
    vertices(&b);
    vertices(&[answer.point_a, answer.point_b]);
    text.push_str("o triangle_a\nf 1 2 3\no triangle_b\nf 4 5 6\no segment\nl 7 8\n");
    Ok(text)
}

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
fn corners(mesh: &LoadedMesh, object: u32, triangle: u32) -> Result<[[f64; 3]; 3], Failure> {
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
