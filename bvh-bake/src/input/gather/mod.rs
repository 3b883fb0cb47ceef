//! Gathers the triangles of meshes for a bake: from files of any size, piece by piece, and from meshes in memory.
//!
//! Triangles are stored in parts, in memory or in scratch files. Parts are filled in parallel, because a reader passes
//! on many triangles at a time, as a count and a function that returns the corners of each.

mod faces;
mod input_order;
mod mesh;
mod scene;
mod solids;
pub(crate) mod weld;

pub(crate) use input_order::InputOrder;
pub(crate) use scene::SceneFaces;

use super::indexed::IndexedFaces;
use super::input_file::Opener;
use super::names::Names;
use super::{Checksums, InputFile, MeshFormat, obj, pcd, ply, stl, xyz};
use crate::error::{BakeError, Fault, Halt, InputError, Place, ReadError};
use crate::input::mesh::{Instance, renumber, tell_apart};
use crate::limits::MAX_TRIANGLES;
use crate::options::Rounding;
use crate::storage::resources::Resources;
use crate::storage::{Piece, Spill};
use crate::threads;
use crate::triangles::placement::{Extent, Moved, Placement};
use crate::triangles::prediction::predict;
use crate::triangles::{Gathered, Part, TRIANGLES_PER_PART, Triangle, TriangleStream, WideTriangle};
use input_order::ObjectRuns;
use solids::SolidsForBake;
use std::ops::Range;
use std::sync::OnceLock;
use std::thread;

/// Bytes of memory per object, besides its name.
const BYTES_PER_OBJECT: u64 = 64;
/// Bytes of memory per object that gets a tree of its own, besides its name and its triangles.
const BYTES_PER_BODY: u64 = 2048;

/// Bytes of memory to fill a part.
const BYTES_PER_OPEN_PART: usize = TRIANGLES_PER_PART * (size_of::<WideTriangle>() + size_of::<Triangle>());

/// Gathers triangles.
pub(crate) struct Gatherer<'a> {
    resources: &'a Resources,
    /// Whether objects stay separate.
    split: bool,
    rounding: Rounding,
    spill: Spill,
    /// The instances of all inputs, by the numbers of their objects.
    instances: Vec<Instance>,
    /// The names of the objects of all inputs, and whether each object counts as having triangles.
    names: Vec<(String, bool)>,
    /// The bodies to bake: one per object, or one for all objects.
    bodies: Vec<Body>,
    /// The body of the last triangle. Its open triangles are in memory; those of other bodies are stored.
    current: usize,
    triangles: u64,
    /// One more than the largest id.
    id_end: u64,
    /// The object that each triangle belongs to, if the caller needs it.
    runs: Option<ObjectRuns>,
    /// The warnings of the readers.
    warnings: Vec<String>,
    /// Whether nothing follows a mesh that is added.
    is_only_mesh: bool,
}

/// The triangles of one future tree.
struct Body {
    parts: Vec<Part>,
    /// The triangles that do not fill a part yet.
    open: Vec<WideTriangle>,
    /// The same triangles, stored while the body is not the current one.
    parked: Option<Piece<WideTriangle>>,
    /// The range of the rounded coordinates.
    extent: Extent,
    /// The largest distance by which rounding on request moved a vertex.
    moved: Moved,
    count: u64,
    /// Whether all triangles are points.
    is_cloud: bool,
}

impl Body {
    fn new() -> Self {
        let (parts, open) = (Vec::new(), Vec::new());
        let (extent, moved) = (Extent::EMPTY, Moved::default());
        Self { parts, open, parked: None, extent, moved, count: 0, is_cloud: true }
    }
}

impl<'a> Gatherer<'a> {
    pub(crate) fn new(resources: &'a Resources, split: bool) -> Self {
        Self {
            resources,
            split,
            rounding: Rounding::None,
            spill: resources.scratch.spill(),
            instances: Vec::new(),
            names: Vec::new(),
            bodies: Vec::new(),
            current: 0,
            triangles: 0,
            id_end: 0,
            runs: None,
            warnings: Vec::new(),
            is_only_mesh: false,
        }
    }

    /// Makes a gatherer that joins all objects into one and records which triangles belong to which object.
    pub(crate) fn in_input_order(resources: &'a Resources) -> Self {
        Self { runs: Some(ObjectRuns::new()), ..Self::new(resources, false) }
    }

    /// Promises that nothing follows the mesh that is added first.
    pub(crate) fn of_one_mesh(self) -> Self {
        Self { is_only_mesh: true, ..self }
    }

    /// Sets how coordinates are rounded.
    pub(crate) fn rounding(self, rounding: Rounding) -> Self {
        Self { rounding, ..self }
    }

    pub(crate) fn resources(&self) -> &'a Resources {
        self.resources
    }

    /// Returns the number of triangles so far.
    pub(crate) fn triangles(&self) -> u64 {
        self.triangles
    }

    /// Returns one more than the largest id so far.
    pub(crate) fn id_end(&self) -> u64 {
        self.id_end
    }

    /// Reads a file piece by piece.
    pub(crate) fn read(&mut self, input: &InputFile) -> Result<Checksums, BakeError> {
        let (before, first_object) = (self.triangles, self.names.len());
        let checksums = if matches!(input.format(), MeshFormat::Gltf | MeshFormat::Collada) {
            self.read_scene(input).map_err(|halt| halt.in_file(input.path()))?
        } else {
            let (progress, checksum) = (&self.resources.progress, OnceLock::new());
            let read = thread::scope(|scope| {
                self.read_stream(&Opener { input, progress, checksum: &checksum, scope })
            });
            read.map_err(|halt| halt.in_file(input.path()))?;
            // A reader that succeeds goes to the end of the file, where the checksum is known.
            let file = checksum.into_inner();
            let file = file.ok_or_else(|| input.failed(std::io::ErrorKind::UnexpectedEof.into()))?;
            Checksums { file, mesh: None }
        };
        self.warnings.append(&mut input.warnings().take(input.path()));
        self.name_after(input, first_object);
        if input.is_scene() {
            self.place_from(first_object);
        }
        if self.triangles == before {
            return Err(ReadError::Mesh { path: input.path().to_owned(), source: InputError::Empty }.into());
        }
        Ok(checksums)
    }

    fn read_stream(&mut self, opener: &Opener) -> Result<(), Halt> {
        let (input, warnings) = (opener.input, opener.input.warnings());
        let mut faces = IndexedFaces::new(self.resources);
        let mut names = Names::unnamed();
        match input.format() {
            MeshFormat::Stl => {
                let mut solids = SolidsForBake { gatherer: self, object: 0 };
                return stl::read(opener.open()?, &mut solids, warnings);
            }
            MeshFormat::Ply => ply::read(|| opener.open(), &mut faces, input)?,
            MeshFormat::Obj => names = obj::read(|| opener.open(), &mut faces, warnings, self.resources)?,
            MeshFormat::Xyz => xyz::read(opener.open()?, &mut faces, input)?,
            MeshFormat::Pcd => pcd::read(opener.open()?, &mut faces, input, self.resources)?,
            MeshFormat::Gltf | MeshFormat::Collada => unreachable!("these are no streams"),
        }
        self.add_faces(&faces, &names)
    }

    /// Names the objects from the number `first` on after their file, if objects stay separate and have no name. A glTF
    /// or COLLADA file has named the instances of its meshes.
    fn name_after(&mut self, input: &InputFile, first: usize) {
        if self.split || input.is_scene() {
            let unnamed = self.names[first..].iter_mut().filter(|(name, _)| name.is_empty());
            unnamed.for_each(|(name, _)| *name = super::stem(input.path()));
        }
    }

    /// Gives each object from the number `first` on an instance where it stands, unless the file had instances.
    fn place_from(&mut self, first: usize) {
        if self.instances.last().is_some_and(|last| last.object as usize >= first) {
            return;
        }
        for (number, (name, _)) in self.names.iter().enumerate().skip(first) {
            let instance = Instance { name: name.clone(), ..Instance::of_object(number as u32) };
            self.instances.push(instance);
        }
    }

    /// Takes out the warnings of the readers, one line each.
    pub(crate) fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Takes the instances out. Their objects are numbered among those with triangles, and their names are told apart.
    pub(crate) fn take_instances(&mut self) -> Vec<Instance> {
        let mut instances = std::mem::take(&mut self.instances);
        let is_full: Vec<bool> = self.names.iter().map(|(_, counts)| *counts).collect();
        renumber(&mut instances, &is_full);
        tell_apart(&mut instances);
        instances
    }

    /// Begins an object and returns its number.
    fn object(&mut self, name: String) -> Result<usize, Halt> {
        let bytes = if self.split { BYTES_PER_BODY } else { BYTES_PER_OBJECT };
        self.resources.keep(bytes + name.len() as u64)?;
        self.names.push((name, false));
        if self.split || self.bodies.is_empty() {
            self.bodies.push(Body::new());
        }
        Ok(self.names.len() - 1)
    }

    /// Returns the number of the body of an object.
    fn body_of(&self, object: usize) -> usize {
        if self.split { object } else { 0 }
    }

    /// Adds triangles to an object. Their ids follow the present ones.
    fn add_triangles(
        &mut self,
        object: usize,
        count: usize,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
    ) -> Result<(), Halt> {
        let first = self.id_end;
        self.add_numbered(object, count, false, corners_of, |place| (first + place as u64) as u32)?;
        self.id_end += count as u64;
        Ok(())
    }

    /// Adds triangles to an object, and rounds their coordinates. -0.0 becomes 0.0. Ids must ascend within a body. `are_last` says that
    /// the body gets no others.
    fn add_numbered(
        &mut self,
        object: usize,
        count: usize,
        are_last: bool,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
        id_of: impl Fn(usize) -> u32 + Sync,
    ) -> Result<(), Halt> {
        if count == 0 {
            return Ok(());
        }
        if self.triangles + count as u64 > MAX_TRIANGLES {
            return Err(Fault::Limit { place: Place::File, most: MAX_TRIANGLES, what: "triangles" }.into());
        }
        let number = self.body_of(object);
        self.go_to(number)?;
        self.triangles += count as u64;
        self.names[object].1 = true;
        self.resources.progress.find(count as u64);
        if let Some(runs) = &mut self.runs {
            runs.add(object, count as u64, &self.spill)?;
        }
        let (body, spill, rounding) = (&mut self.bodies[number], &self.spill, self.rounding);
        body.count += count as u64;
        let triangle = |place: usize, moved: &mut Moved| WideTriangle {
            corners: corners_of(place).map(|corner| rounding.round(corner, moved)),
            id: id_of(place),
            spare: 0,
        };
        let fill_open = |body: &mut Body, places: Range<usize>| {
            body.open.reserve(places.len());
            for place in places {
                let mut triangle = triangle(place, &mut body.moved);
                body.is_cloud &= body.extent.add_triangle(&mut triangle.corners, &mut body.moved);
                body.open.push(triangle);
            }
        };
        let mut done = 0;
        // A last part that is not full need not wait for others.
        let least = if are_last && body.open.is_empty() { 1 } else { TRIANGLES_PER_PART };
        if !body.open.is_empty() || count < least {
            done = count.min(TRIANGLES_PER_PART - body.open.len());
            fill_open(body, 0..done);
            if body.open.len() == TRIANGLES_PER_PART {
                let open = std::mem::take(&mut body.open);
                body.parts.push(part(open, spill)?);
            }
        }
        let full = (done..count).step_by(TRIANGLES_PER_PART).take_while(|start| count - start >= least);
        let full: Vec<usize> = full.collect();
        for batch in full.chunks(self.resources.reading_tasks(BYTES_PER_OPEN_PART)) {
            let filled = threads::map(batch, |&start| {
                let places = start..count.min(start + TRIANGLES_PER_PART);
                let (mut extent, mut moved, mut is_cloud) = (Extent::EMPTY, Moved::default(), true);
                let mut measured = |place: usize| {
                    let mut triangle = triangle(place, &mut moved);
                    is_cloud &= extent.add_triangle(&mut triangle.corners, &mut moved);
                    triangle
                };
                let part = match all_narrow(places.len(), places.clone().map(&mut measured)) {
                    Some(triangles) => Part::Narrow(spill.put(triangles)?),
                    None => Part::Wide(spill.put(places.map(measured).collect())?),
                };
                Ok::<_, BakeError>((part, extent, moved, is_cloud))
            });
            for filled in filled {
                let (part, extent, moved, is_cloud) = filled?;
                body.parts.push(part);
                body.is_cloud &= is_cloud;
                body.extent = body.extent.joined(extent);
                body.moved = body.moved.joined(moved);
            }
        }
        done = count.min(done + full.len() * TRIANGLES_PER_PART);
        fill_open(body, done..count);
        Ok(())
    }

    /// Makes a body the current one.
    fn go_to(&mut self, body: usize) -> Result<(), Halt> {
        if body == self.current {
            return Ok(());
        }
        if let Some(last) = self.bodies.get_mut(self.current).filter(|last| !last.open.is_empty()) {
            last.parked = Some(self.spill.put(std::mem::take(&mut last.open))?);
        }
        if let Some(parked) = self.bodies[body].parked.take() {
            self.bodies[body].open = parked.take()?;
        }
        self.current = body;
        Ok(())
    }

    /// Returns all triangles as they were read, in the order of their ids. The gatherer must have been made by
    /// [`in_input_order`](Self::in_input_order).
    pub(crate) fn into_input_order(self) -> Result<InputOrder, BakeError> {
        let Self { names, mut bodies, spill, runs, instances, .. } = self;
        let mut parts = Vec::new();
        for body in &mut bodies {
            if !body.open.is_empty() {
                body.parts.push(part(std::mem::take(&mut body.open), &spill)?);
            }
            parts.append(&mut body.parts);
        }
        let runs = runs.unwrap_or_else(ObjectRuns::new);
        InputOrder::new(parts, runs, names.len(), instances, &spill)
    }

    /// Returns all objects with triangles, ready to be baked. `grid_error` returns the largest move that quantisation
    /// may make, given the name of the object and the diagonal of its box; `None` leaves vertices as they are. Vertices are welded
    /// within the distance `weld` first, unless it is 0.
    pub(crate) fn finish(
        self,
        weld: f64,
        grid_error: impl Fn(&str, f64) -> Result<Option<f64>, BakeError>,
    ) -> Result<Vec<Gathered>, BakeError> {
        let Self { resources, names, bodies, spill, split, .. } = self;
        let mut names = names.into_iter().filter(|(_, counts)| *counts).map(|(name, _)| name);
        let mut gathered = Vec::new();
        for mut body in bodies.into_iter().filter(|body| body.count > 0) {
            if let Some(parked) = body.parked.take() {
                body.open = parked.take()?;
            }
            if !body.open.is_empty() {
                body.parts.push(part(body.open, &spill)?);
            }
            let name = names.next().unwrap_or_default();
            // A single object keeps its name; several objects that are joined have no name.
            let name = if split || names.next().is_none() { name } else { String::new() };
            let mut welded = Moved::default();
            if weld::check(weld, &name, body.extent.diagonal())? {
                let made = weld::weld(body.parts, &body.extent, body.is_cloud, weld, resources, &spill)?;
                (body.parts, body.extent, body.is_cloud) = (made.parts, made.extent, made.is_cloud);
                welded = made.moved;
            }
            let placement = match grid_error(&name, body.extent.diagonal())? {
                Some(error) => Placement::quantized(&body.extent, error),
                None => Placement::of(predict(&body.parts, &body.extent)?),
            };
            let stream = TriangleStream {
                parts: body.parts,
                count: body.count,
                placement: Some(placement).filter(|placement| !placement.keeps_f32()),
            };
            let (stream, moved) = stream.placed_in_memory(&spill)?;
            gathered.push(Gathered {
                name,
                behind: placement.behind(),
                stream,
                moved: moved.joined(body.moved),
                welded,
                is_cloud: body.is_cloud,
            });
        }
        Ok(gathered)
    }
}

/// Stores triangles, as `f32` numbers if these represent them exactly.
fn part(triangles: Vec<WideTriangle>, spill: &Spill) -> Result<Part, BakeError> {
    Ok(match all_narrow(triangles.len(), triangles.iter().copied()) {
        Some(triangles) => Part::Narrow(spill.put(triangles)?),
        None => Part::Wide(spill.put(triangles)?),
    })
}

/// Returns `count` triangles in `f32` numbers, if these represent all of them exactly.
fn all_narrow(count: usize, triangles: impl Iterator<Item = WideTriangle>) -> Option<Vec<Triangle>> {
    let mut narrow = Vec::with_capacity(count);
    for WideTriangle { corners: wide, id, .. } in triangles {
        let corners = wide.map(|corner| corner.map(|value| value as f32));
        if corners.map(|corner| corner.map(f64::from)) != wide {
            return None;
        }
        narrow.push(Triangle { corners, id });
    }
    Some(narrow)
}
