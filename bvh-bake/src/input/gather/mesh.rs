//! Gathers a mesh in memory.

use super::Gatherer;
use crate::error::Halt;
use crate::input::mesh::{Instance, Mesh};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

impl Gatherer<'_> {
    /// Adds the objects of a mesh that has been checked. Their ids follow the present ones.
    pub(crate) fn add_mesh(&mut self, mesh: &Mesh) -> Result<(), Halt> {
        let (first, first_id) = (self.names.len(), self.id_end);
        self.warnings.extend_from_slice(&mesh.warnings);
        for object in &mesh.objects {
            let number = self.object(object.name.clone())?;
            // Objects that are joined lose their names, even if one of them has no triangles.
            self.names[number].1 |= !self.split;
        }
        let placed = mesh.instances.iter().map(|instance| Instance {
            object: instance.object.saturating_add(first as u32),
            ..instance.clone()
        });
        self.instances.extend(placed);
        let runs = self.runs_of(mesh);
        let (count, split) = (runs.len(), self.split);
        for (run, (number, places)) in runs.into_iter().enumerate() {
            let are_last = self.is_only_mesh && (split || run + 1 == count);
            let object = &mesh.objects[number];
            let (triangles, ids) = (&object.triangles[places.clone()], &object.triangle_ids[places]);
            let corners_of = |place: usize| triangles[place].map(|vertex| object.positions[vertex as usize]);
            let id_of = |place: usize| (first_id + u64::from(ids[place])) as u32;
            self.add_numbered(first + number, triangles.len(), are_last, corners_of, id_of)?;
            let end = ids.last().map_or(0, |&id| first_id + u64::from(id) + 1);
            self.id_end = self.id_end.max(end);
        }
        Ok(())
    }

    /// Returns the triangles of a mesh as ranges of objects, in an order in which ids ascend within each body.
    fn runs_of(&self, mesh: &Mesh) -> Vec<(usize, Range<usize>)> {
        let objects = || mesh.objects.iter().enumerate().filter(|(_, object)| !object.triangles.is_empty());
        let ends = objects()
            .filter_map(|(_, object)| Some((*object.triangle_ids.first()?, *object.triangle_ids.last()?)));
        let ends: Vec<(u32, u32)> = ends.collect();
        if self.split || ends.windows(2).all(|pair| pair[0].1 < pair[1].0) {
            return objects().map(|(number, object)| (number, 0..object.triangles.len())).collect();
        }
        // The object with the smallest next id continues until the next id of another object is smaller.
        let mut next: BinaryHeap<Reverse<(u32, usize, usize)>> =
            objects().map(|(number, object)| Reverse((object.triangle_ids[0], number, 0))).collect();
        let mut runs = Vec::new();
        while let Some(Reverse((_, number, start))) = next.pop() {
            let ids = &mesh.objects[number].triangle_ids;
            let limit = next.peek().map_or(u32::MAX, |Reverse((id, ..))| *id);
            let end = start + 1 + ids[start + 1..].partition_point(|&id| id < limit);
            runs.push((number, start..end));
            next.extend(ids.get(end).map(|&id| Reverse((id, number, end))));
        }
        runs
    }
}
