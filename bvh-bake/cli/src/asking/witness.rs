//! The witness of a distance between two meshes: in words, and as OBJ.

use super::mesh::LoadedMesh;
use super::triangle::{corners, name, point};
use crate::console::Failure;
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
