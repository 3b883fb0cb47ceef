//! Takes what the reader of glTF finds, object by object.

use crate::error::Halt;
use crate::input::mesh::{Mesh, Object};
use crate::input::next_ids;
use bvh_format::instances::Instance;

/// Takes the objects of a file, and its instances.
pub(crate) trait Sink {
    /// Begins an object. What follows belongs to it.
    fn begin(&mut self, name: &str) -> Result<(), Halt>;
    /// Returns the number of the next vertex.
    fn next_vertex(&self) -> u64;
    /// Takes vertices of the object.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Halt>;
    /// Takes triangles of the object, by the numbers of their vertices.
    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<(), Halt>;
    /// Takes an instance of an object, which is counted from 0.
    fn instance(&mut self, instance: Instance) -> Result<(), Halt>;
}

/// Takes nothing: the file is read for its checksum.
impl Sink for () {
    fn begin(&mut self, _: &str) -> Result<(), Halt> {
        Ok(())
    }

    fn next_vertex(&self) -> u64 {
        0
    }

    fn vertices(&mut self, _: &[[f64; 3]]) -> Result<(), Halt> {
        Ok(())
    }

    fn triangles(&mut self, _: &[[u32; 3]]) -> Result<(), Halt> {
        Ok(())
    }

    fn instance(&mut self, _: Instance) -> Result<(), Halt> {
        Ok(())
    }
}

/// Collects a mesh in memory. The vertices of each object count from 0.
#[derive(Default)]
pub(crate) struct InMemory {
    /// The mesh, unchecked.
    pub(crate) mesh: Mesh,
    next_id: u32,
}

impl Sink for InMemory {
    fn begin(&mut self, name: &str) -> Result<(), Halt> {
        self.mesh.objects.push(Object { name: name.to_owned(), ..Object::default() });
        Ok(())
    }

    fn next_vertex(&self) -> u64 {
        self.mesh.objects.last().map_or(0, |object| object.positions.len() as u64)
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Halt> {
        if let Some(object) = self.mesh.objects.last_mut() {
            object.positions.extend_from_slice(positions);
        }
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<(), Halt> {
        let ids = next_ids(&mut self.next_id, triangles.len())?;
        if let Some(object) = self.mesh.objects.last_mut() {
            object.triangles.extend_from_slice(triangles);
            object.triangle_ids.extend(ids);
        }
        Ok(())
    }

    fn instance(&mut self, instance: Instance) -> Result<(), Halt> {
        self.mesh.instances.push(instance);
        Ok(())
    }
}
