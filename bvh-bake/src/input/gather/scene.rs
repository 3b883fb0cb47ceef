//! Gathers what a glTF file holds: its objects, and the instances if it is read as a scene.

use super::Gatherer;
use crate::error::{Halt, InputError, ReadError, excerpt};
use crate::input::gltf::Sink;
use crate::input::indexed::IndexedFaces;
use crate::input::mesh::{Instance, check_instances, tell_apart};
use crate::input::names::Names;
use crate::input::{Checksums, InputFile};
use crate::limits::coordinate_fits;
use crate::progress::{Step, WHOLE};
use crate::storage::resources::Resources;

/// The share of reading a file in the work on it, in parts of [`WHOLE`]. The rest is spent on its corners.
const FILE_BYTES: u64 = 10;
/// Bytes of memory per instance, besides its name.
const BYTES_PER_INSTANCE: u64 = 320;
/// Bytes of memory per object until its triangles are gathered, besides its name.
const BYTES_PER_OBJECT: u64 = 64;

/// What has been found so far.
struct Found<'a> {
    resources: &'a Resources,
    faces: IndexedFaces,
    names: Vec<String>,
    /// The first vertex of each object.
    vertices: Vec<u64>,
    instances: Vec<Instance>,
}

impl Sink for Found<'_> {
    fn begin(&mut self, name: &str) -> Result<(), Halt> {
        self.resources.keep(BYTES_PER_OBJECT + name.len() as u64)?;
        self.names.push(name.to_owned());
        self.vertices.push(self.faces.vertex_count());
        Ok(())
    }

    fn next_vertex(&self) -> u64 {
        self.faces.vertex_count()
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Halt> {
        Ok(self.faces.add_vertices(positions)?)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<(), Halt> {
        let object = self.names.len() as u32 - 1;
        Ok(self.faces.add_run(3, triangles.len() as u32, object, object, triangles.as_flattened())?)
    }

    fn instance(&mut self, instance: Instance) -> Result<(), Halt> {
        self.resources.keep(BYTES_PER_INSTANCE + instance.name.len() as u64)?;
        self.instances.push(instance);
        Ok(())
    }
}

impl Gatherer<'_> {
    /// Reads a glTF file.
    pub(super) fn read_gltf(&mut self, input: &InputFile) -> Result<Checksums, Halt> {
        let resources = self.resources;
        let mut found = Found {
            resources,
            faces: IndexedFaces::new(resources),
            names: Vec::new(),
            vertices: Vec::new(),
            instances: Vec::new(),
        };
        let progress = &resources.progress;
        let checksums = Checksums::of_gltf(input, &mut found, resources.document, progress, FILE_BYTES)?;
        found.faces.finish()?;
        let wrong = |source| Halt::from(ReadError::Mesh { path: input.path().to_owned(), source });
        found.check().map_err(|fault| fault.map_or_else(|halt| halt, wrong))?;
        let Found { faces, names, mut instances, .. } = found;
        let first = self.names.len();
        let tally = progress.tally(Step::Read, WHOLE - FILE_BYTES, input.length(), faces.corner_count());
        self.add_faces(&faces, &Names::of_objects(names), &tally)?;
        instances.iter_mut().for_each(|instance| instance.object += first as u32);
        instances.retain(|instance| self.names[instance.object as usize].1);
        tell_apart(&mut instances);
        check_instances(&instances, self.names.len()).map_err(wrong)?;
        self.instances.append(&mut instances);
        Ok(checksums)
    }
}

impl Found<'_> {
    /// Checks what the reader does not: the coordinates that triangles use.
    fn check(&self) -> Result<(), Result<InputError, Halt>> {
        let failed = |error: crate::error::BakeError| Err(error.into());
        let Some((corner, vertex)) = self.faces.first_misfit(None).map_err(failed)? else { return Ok(()) };
        let object = self.vertices.partition_point(|&first| first <= u64::from(vertex)) - 1;
        let position = self.faces.sorted_look_up(&[vertex]).map_err(failed)?;
        let found = position.as_flattened().iter().copied().find(|&value| !coordinate_fits(value));
        Err(Ok(InputError::Coordinate {
            object: excerpt(self.names[object].as_bytes()),
            triangle: (corner / 3) as u32,
            vertex: (u64::from(vertex) - self.vertices[object]) as u32,
            found: found.unwrap_or_default(),
        }))
    }
}
