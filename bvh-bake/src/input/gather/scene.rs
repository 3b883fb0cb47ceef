//! Gathers what a glTF or a COLLADA file holds: its objects, and the instances if it is read as a scene.

use super::Gatherer;
use crate::error::{Fault, Halt, InputError, Place, ReadError, excerpt};
use crate::input::collect::mesh_of_faces;
use crate::input::gltf::Sink;
use crate::input::indexed::IndexedFaces;
use crate::input::mesh::{Instance, Mesh, check_instances, tell_apart};
use crate::input::names::Names;
use crate::input::warnings::counted;
use crate::input::{COORDINATE, Checksums, InputFile, MeshFormat, collada};
use crate::limits::coordinate_fits;
use crate::storage::resources::Resources;
use std::collections::BTreeMap;

/// Bytes of memory per instance, besides its name.
const BYTES_PER_INSTANCE: u64 = 320;
/// Bytes of memory per object until its triangles are gathered, besides its name. Lists that grow have room for twice as many.
const BYTES_PER_OBJECT: u64 = 160;

/// The objects of a file that have been read so far, and its instances.
pub(crate) struct SceneFaces<'a> {
    resources: &'a Resources,
    faces: IndexedFaces,
    names: Vec<String>,
    /// The first vertex of each object.
    vertices: Vec<u64>,
    instances: Vec<Instance>,
    /// What was read without its faces, and how often.
    left_out: BTreeMap<[&'static str; 2], u64>,
}

impl<'a> SceneFaces<'a> {
    pub(crate) fn new(resources: &'a Resources) -> Self {
        let (names, vertices, instances) = (Vec::new(), Vec::new(), Vec::new());
        let left_out = BTreeMap::new();
        Self { resources, faces: IndexedFaces::new(resources), names, vertices, instances, left_out }
    }

    /// Counts what has no triangles, given the words for one and for several.
    pub(crate) fn leave_out(&mut self, words: [&'static str; 2]) {
        *self.left_out.entry(words).or_default() += 1;
    }

    /// Adds faces to the last object, each with so many corners.
    pub(crate) fn faces(&mut self, corners_per_face: usize, corners: &[u32]) -> Result<(), Halt> {
        let (object, faces) = (self.names.len() as u32 - 1, corners.len() / corners_per_face);
        Ok(self.faces.add_run(corners_per_face as u32, faces as u32, object, object, corners)?)
    }

    /// Ends the file, and checks what the reader does not: the coordinates that faces use.
    pub(crate) fn finish(&mut self, input: &InputFile) -> Result<(), Halt> {
        self.faces.finish()?;
        for (&words, &count) in &self.left_out {
            input.warnings().add(Place::File, format!("left out {}", counted(count, words)));
        }
        let Some((corner, vertex)) = self.faces.first_misfit(None)? else { return Ok(()) };
        let object = self.vertices.partition_point(|&first| first <= u64::from(vertex)) - 1;
        let position = self.faces.sorted_look_up(&[vertex])?;
        let misfit = position.as_flattened().iter().copied().find(|&value| !coordinate_fits(value));
        let (name, found) = (excerpt(self.names[object].as_bytes()), misfit.unwrap_or_default());
        let vertex = (u64::from(vertex) - self.vertices[object]) as u32;
        if input.format() == MeshFormat::Collada {
            let found = format!("{found:e} in vertex {vertex} of object \"{name}\"");
            return Err(Fault::new(Place::File, COORDINATE, found).into());
        }
        let source = InputError::Coordinate { object: name, triangle: (corner / 3) as u32, vertex, found };
        Err(ReadError::Mesh { path: input.path().to_owned(), source }.into())
    }

    /// Collects a mesh in memory.
    pub(crate) fn into_mesh(self) -> Result<Mesh, Halt> {
        let mesh = mesh_of_faces(&self.faces, &Names::of_objects(self.names))?;
        Ok(Mesh { instances: self.instances, ..mesh })
    }
}

impl Sink for SceneFaces<'_> {
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
        self.faces(3, triangles.as_flattened())
    }

    fn instance(&mut self, instance: Instance) -> Result<(), Halt> {
        self.resources.keep(BYTES_PER_INSTANCE + instance.name.len() as u64)?;
        self.instances.push(instance);
        Ok(())
    }
}

impl Gatherer<'_> {
    /// Reads a glTF or a COLLADA file.
    pub(super) fn read_scene(&mut self, input: &InputFile) -> Result<Checksums, Halt> {
        let resources = self.resources;
        let mut found = SceneFaces::new(resources);
        let progress = &resources.progress;
        let checksums = if input.format() == MeshFormat::Gltf {
            Checksums::of_gltf(input, &mut found, resources.document, progress)?
        } else {
            collada::read(input, &mut found, resources.document, progress)?;
            Checksums { file: input.checksum(progress)?, mesh: None }
        };
        found.finish(input)?;
        let SceneFaces { faces, names, mut instances, .. } = found;
        let first = self.names.len();
        self.add_faces(&faces, &Names::of_objects(names))?;
        instances.iter_mut().for_each(|instance| instance.object += first as u32);
        instances.retain(|instance| self.names[instance.object as usize].1);
        tell_apart(&mut instances);
        let wrong = |source| Halt::from(ReadError::Mesh { path: input.path().to_owned(), source });
        check_instances(&instances, self.names.len()).map_err(wrong)?;
        self.instances.append(&mut instances);
        Ok(checksums)
    }
}
