//! Collects the faces that a reader has found into a [`Mesh`].

use super::indexed::IndexedFaces;
use super::mesh::{Mesh, Object};
use super::names::Names;
use super::polygon::Cutter;
use crate::error::{Fault, Halt, Place};
use crate::limits::MAX_TRIANGLES;

/// Makes a mesh of faces that have been read and checked. Its vertices are those that faces use, in the order of their
/// first use in each group of faces. A vertex that several groups use is stored once per group.
pub(super) fn mesh_of_faces(faces: &IndexedFaces, names: &Names) -> Result<Mesh, Halt> {
    let named = |name: &String| Object { name: name.clone(), ..Object::default() };
    let mut objects: Vec<Object> = names.all().iter().map(named).collect();
    // For each vertex of the file, the group for which it was numbered last, from 1, and its number in the object.
    let mut numbers = vec![(0u64, 0u32); faces.vertex_count() as usize];
    let mut cutter = Cutter::default();
    let mut next_id = 0u64;
    let mut polygon = Vec::new();
    faces.each_window(|runs, corners| {
        let positions = faces.look_up(corners)?;
        let mut start = 0;
        for run in runs {
            let (object, group) = names.of(run);
            let (object, group) = (&mut objects[object], u64::from(group) + 1);
            for _ in 0..run.faces {
                let face = start..start + run.corners as usize;
                start = face.end;
                let vertices = &corners[face.clone()];
                polygon.clear();
                polygon.extend(face.map(|place| positions.at(place)));
                for (&vertex, &position) in vertices.iter().zip(&polygon) {
                    let number = &mut numbers[vertex as usize];
                    if number.0 != group {
                        // Only a checked mesh has all its vertices in 32 bits. Before the check, a number may be out of
                        // range.
                        *number = (group, u32::try_from(object.positions.len()).unwrap_or(u32::MAX));
                        object.positions.push(position);
                    }
                }
                cutter.cut_polygon(&polygon, |triangle| {
                    if next_id == MAX_TRIANGLES {
                        let (place, most) = (Place::File, MAX_TRIANGLES);
                        return Err(Halt::Fault(Fault::Limit { place, most, what: "triangles" }));
                    }
                    object.triangles.push(triangle.map(|place| numbers[vertices[place] as usize].1));
                    object.triangle_ids.push(next_id as u32);
                    next_id += 1;
                    Ok(())
                })?;
            }
        }
        Ok::<_, Halt>(())
    })?;
    Ok(Mesh { objects, ..Mesh::default() })
}
