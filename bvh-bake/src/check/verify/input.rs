//! Provides the triangles of the mesh that a file is compared with, in the order of their ids. They come from a mesh
//! in memory, or were gathered from files of any size.

use super::VerifyError;
use crate::input::gather::InputOrder;
use crate::input::mesh::{Instance, Mesh, renumber};
use std::borrow::Cow;

/// Three corners as the input states them, in mesh units.
pub(super) type InputCorners = [[f64; 3]; 3];

/// Triangles that can be visited any number of times.
pub(super) trait Input {
    /// Returns the number of triangles of each object that has any.
    fn counts(&self) -> &[u64];

    /// Returns the instances, by the numbers of objects in `counts`.
    fn instances(&self) -> Cow<'_, [Instance]>;

    /// Calls `visit` for every triangle, by ascending ids from 0, with the object's number in `counts`, the id and
    /// the corners.
    fn visit(
        &self,
        visit: &mut dyn FnMut(u32, u32, &InputCorners) -> Result<(), VerifyError>,
    ) -> Result<(), VerifyError>;
}

/// A mesh in memory.
pub(super) struct InMemory<'m> {
    mesh: &'m Mesh,
    counts: Vec<u64>,
    /// For each id, the number of the object in the mesh and the triangle's place in that object.
    places: Vec<(u32, u32)>,
    /// For each object of the mesh, its number among the objects that have triangles.
    numbers: Vec<u32>,
}

impl<'m> InMemory<'m> {
    pub(super) fn new(mesh: &'m Mesh) -> Result<Self, VerifyError> {
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
        // The ids are distinct, below the count and as many as the count, so none is missing.
        let places = places.into_iter().map(Option::unwrap_or_default).collect();
        let (mut counts, mut numbers) = (Vec::new(), Vec::new());
        for object in &mesh.objects {
            numbers.push(counts.len() as u32);
            counts.extend(Some(object.triangles.len() as u64).filter(|&count| count > 0));
        }
        Ok(Self { mesh, counts, places, numbers })
    }
}

impl Input for InMemory<'_> {
    fn counts(&self) -> &[u64] {
        &self.counts
    }

    fn instances(&self) -> Cow<'_, [Instance]> {
        let mut instances = self.mesh.instances.clone();
        let is_full = self.mesh.objects.iter().map(|object| !object.triangles.is_empty());
        renumber(&mut instances, &is_full.collect::<Vec<_>>());
        instances.into()
    }

    fn visit(
        &self,
        visit: &mut dyn FnMut(u32, u32, &InputCorners) -> Result<(), VerifyError>,
    ) -> Result<(), VerifyError> {
        for (id, &(number, index)) in (0..).zip(&self.places) {
            let object = &self.mesh.objects[number as usize];
            let corners = object.triangles[index as usize].map(|vertex| object.positions[vertex as usize]);
            visit(self.numbers[number as usize], id, &corners)?;
        }
        Ok(())
    }
}

impl Input for InputOrder {
    fn counts(&self) -> &[u64] {
        InputOrder::counts(self)
    }

    fn instances(&self) -> Cow<'_, [Instance]> {
        InputOrder::instances(self).into()
    }

    fn visit(
        &self,
        visit: &mut dyn FnMut(u32, u32, &InputCorners) -> Result<(), VerifyError>,
    ) -> Result<(), VerifyError> {
        self.each_triangle(visit)
    }
}
