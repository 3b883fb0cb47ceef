//! Compares triangle by triangle, looked up by id.

use super::{Stored, VerifyError, distance, each_triangle, place, tolerance};
use crate::mesh::Mesh;
use bvh_format::Layout;
use bvh_format::object::Object;

/// Where the mesh has a triangle: the object's number and the place in it.
type Place = (u32, u32);

/// Checks that every triangle of the mesh is stored or a duplicate of a stored one, exactly once.
/// Returns the largest distance of a corner from where it is stored, and the number of duplicates.
pub(super) fn compare(layout: &Layout, bytes: &[u8], mesh: &Mesh) -> Result<(f64, u64), VerifyError> {
    let mut lookup = Lookup::new(mesh)?;
    let pairs = layout.duplicate_ids(bytes);
    let mut max_move = 0.0f64;
    let mut duplicates = 0;
    // One mesh object for each of the file's, or all for one.
    let numbers = mesh.objects.iter().enumerate().filter(|(_, object)| !object.triangles.is_empty());
    let numbers: Vec<usize> = numbers.map(|(number, _)| number).collect();
    for (number, object) in layout.objects.iter().enumerate() {
        let only = (layout.objects.len() > 1).then(|| numbers[number] as u32);
        each_triangle(layout, bytes, object, |triangle| {
            let Some(id) = triangle.id else { return Ok(()) };
            let corners = lookup.take(id, only, "stored")?;
            for corner in 0..3 {
                let moved =
                    check_corner(object, triangle, id, corner, corners[corner], triangle.corners[corner])?;
                max_move = max_move.max(moved);
            }
            let start = pairs.partition_point(|[kept, _]| kept.get() < id);
            for [_, dropped] in pairs[start..].iter().take_while(|[kept, _]| kept.get() == id) {
                let corners = lookup.take(dropped.get(), only, "a duplicate")?;
                max_move = max_move.max(check_duplicate(object, triangle, id, dropped.get(), corners)?);
                duplicates += 1;
            }
            Ok(())
        })?;
    }
    // The counts have been compared and none was taken twice, so none is missing but by a pair that no
    // stored triangle leads to.
    match lookup.taken.iter().position(|&taken| !taken) {
        Some(id) => Err(VerifyError::differs(format!("triangle {id}"), "stored or a duplicate", "neither")),
        None => Ok((max_move, duplicates)),
    }
}

/// The mesh's triangles by id.
struct Lookup<'m> {
    mesh: &'m Mesh,
    places: Vec<Place>,
    taken: Vec<bool>,
}

impl<'m> Lookup<'m> {
    fn new(mesh: &'m Mesh) -> Result<Self, VerifyError> {
        let count = mesh.triangle_count() as usize;
        let mut places = vec![None; count];
        for (number, object) in mesh.objects.iter().enumerate() {
            for (index, &id) in object.triangle_ids.iter().enumerate() {
                match places.get_mut(id as usize) {
                    Some(place @ None) => *place = Some((number as u32, index as u32)),
                    Some(_) => {
                        return Err(VerifyError::differs(format!("triangle {id}"), "one in the mesh", "two"));
                    }
                    None => {
                        let expected = format!("ids below {count} in the mesh");
                        return Err(VerifyError::differs(format!("triangle {id}"), expected, id));
                    }
                }
            }
        }
        // As many different ids below the count as the count: none is missing.
        let places = places.into_iter().map(Option::unwrap_or_default).collect();
        Ok(Self { mesh, places, taken: vec![false; count] })
    }

    /// The corners of a triangle that nobody has asked for yet.
    fn take(&mut self, id: u32, only: Option<u32>, role: &str) -> Result<[[f64; 3]; 3], VerifyError> {
        let what = || format!("triangle {id}");
        let Some(&(number, index)) = self.places.get(id as usize) else {
            let expected = format!("an id below {}", self.places.len());
            return Err(VerifyError::differs(what(), expected, format!("{id}, {role}")));
        };
        if std::mem::replace(&mut self.taken[id as usize], true) {
            return Err(VerifyError::differs(what(), "once", format!("again, {role}")));
        }
        if only.is_some_and(|only| only != number) {
            let expected = format!("in object {number} of the mesh");
            return Err(VerifyError::differs(what(), expected, format!("in that of {}", only.unwrap_or(0))));
        }
        let object = &self.mesh.objects[number as usize];
        Ok(object.triangles[index as usize].map(|vertex| object.positions[vertex as usize]))
    }
}

/// Checks where a corner is stored; returns how far from the mesh's.
fn check_corner(
    object: &Object,
    triangle: &Stored,
    id: u32,
    corner: usize,
    expected: [f64; 3],
    stored: [f32; 3],
) -> Result<f64, VerifyError> {
    let found = place(object, stored);
    let moved = distance(expected, found);
    let limit = tolerance(object);
    // Written such that a NaN fails.
    if moved <= limit {
        return Ok(moved);
    }
    let what = format!("triangle {id}, corner {corner} (page {}, packet {})", triangle.page, triangle.packet);
    Err(VerifyError::differs(
        what,
        format!("{expected:?} within {limit:e}"),
        format!("{found:?}, {moved:e} away"),
    ))
}

/// Checks that the corners of a triangle left out are those stored, in any order.
fn check_duplicate(
    object: &Object,
    kept: &Stored,
    kept_id: u32,
    id: u32,
    corners: [[f64; 3]; 3],
) -> Result<f64, VerifyError> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let stored = kept.corners.map(|corner| place(object, corner));
    let moved =
        |order: &[usize; 3]| (0..3).map(|i| distance(corners[i], stored[order[i]])).fold(0.0, f64::max);
    let least = ORDERS.iter().map(moved).fold(f64::INFINITY, f64::min);
    if least <= tolerance(object) {
        return Ok(least);
    }
    let what = format!("triangle {id}, left out as a duplicate of {kept_id}");
    Err(VerifyError::differs(what, format!("{corners:?}"), format!("{stored:?}")))
}
