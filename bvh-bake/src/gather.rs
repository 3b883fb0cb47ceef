//! Reads mesh files of any size into soups: what readers find goes to pieces, in memory or in files.
//!
//! The readers of STL and PLY are those of meshes in memory; OBJ has one of its own (`io::obj`). Triangles, ids, counts
//! and errors are the same as of a mesh in memory.

mod counter;
mod faces;
mod sequence;
mod solids;

pub(crate) use sequence::Sequence;

use crate::error::BakeError;
use crate::io::{self, Fault, Feed, Halt, MeshFormat, Place, ReadError};
use crate::means::Means;
use crate::mesh::{InputError, MAX_TRIANGLES, Mesh};
use crate::placement::{Extent, Moved, Placement};
use crate::prepare::Prepared;
use crate::scratch::{Piece, Spill};
use crate::soup::{PART, Part, Soup, Triangle, WideTriangle};
use faces::{Indexed, Misfit};
use sequence::Runs;
use solids::Solids;
use std::fs::File;
use std::path::Path;

/// The objects found so far.
pub(crate) struct Gatherer<'a> {
    means: &'a Means,
    /// Whether objects stay apart.
    split: bool,
    spill: Spill,
    /// The names of the objects of all files, and whether they have triangles.
    names: Vec<(String, bool)>,
    /// What is baked: each object, or all as one.
    bodies: Vec<Gathering>,
    /// The body of the triangle before, whose last triangles are in memory.
    current: usize,
    next_id: u64,
    /// Which object each triangle belongs to, where that is asked for.
    runs: Option<Runs>,
}

/// A body that grows.
struct Gathering {
    parts: Vec<Part>,
    /// Triangles that do not fill a part yet.
    open: Vec<WideTriangle>,
    /// They, while the body is not the current one.
    parked: Option<Piece<WideTriangle>>,
    extent: Extent,
    count: u64,
    vertices: u64,
}

impl Gathering {
    fn new() -> Self {
        let (parts, open) = (Vec::new(), Vec::new());
        Self { parts, open, parked: None, extent: Extent::EMPTY, count: 0, vertices: 0 }
    }

    /// Makes a part of what is in memory.
    fn close_part(&mut self, spill: &Spill) -> Result<(), BakeError> {
        let open = std::mem::take(&mut self.open);
        let fits = |triangle: &WideTriangle| {
            triangle.corners.as_flattened().iter().all(|&value| f64::from(value as f32) == value)
        };
        self.parts.push(if open.iter().all(fits) {
            let narrow = |triangle: &WideTriangle| Triangle {
                corners: triangle.corners.map(|corner| corner.map(|value| value as f32)),
                id: triangle.id,
            };
            Part::Narrow(spill.put(open.iter().map(narrow).collect())?)
        } else {
            Part::Wide(spill.put(open)?)
        });
        Ok(())
    }
}

impl<'a> Gatherer<'a> {
    pub(crate) fn new(means: &'a Means, split: bool) -> Self {
        let spill = means.scratch.spill();
        Self {
            means,
            split,
            spill,
            names: Vec::new(),
            bodies: Vec::new(),
            current: 0,
            next_id: 0,
            runs: None,
        }
    }

    /// Gathers all objects as one that knows which triangles are whose.
    pub(crate) fn in_sequence(means: &'a Means) -> Self {
        Self { runs: Some(Runs::new()), ..Self::new(means, false) }
    }

    /// Triangles of all files so far.
    pub(crate) fn triangles(&self) -> u64 {
        self.next_id
    }

    /// Reads a file of a format other than glTF.
    pub(crate) fn read(&mut self, path: &Path, format: MeshFormat) -> Result<(), BakeError> {
        let before = self.next_id;
        self.read_as(path, format).map_err(|halt| halt.in_file(path))?;
        if self.next_id == before {
            return Err(ReadError::Mesh { path: path.to_owned(), source: InputError::Empty }.into());
        }
        Ok(())
    }

    /// Adds a mesh that has been checked.
    pub(crate) fn add_mesh(&mut self, mesh: &Mesh) -> Result<(), BakeError> {
        for object in &mesh.objects {
            let number = self.object(object.name.clone());
            let mut used = vec![false; object.positions.len()];
            for &triangle in &object.triangles {
                triangle.iter().for_each(|&vertex| used[vertex as usize] = true);
                let corners = triangle.map(|vertex| object.positions[vertex as usize]);
                self.add(number, corners).map_err(|halt| halt.in_file(Path::new("glTF")))?;
            }
            self.add_vertices(number, used.iter().filter(|&&used| used).count() as u64);
        }
        Ok(())
    }

    fn read_as(&mut self, path: &Path, format: MeshFormat) -> Result<(), Halt> {
        match format {
            MeshFormat::Stl => io::stl::stream(feed(path)?, &mut Solids::new(self)),
            MeshFormat::Ply => {
                let mut faces = Indexed::new(self.means);
                io::ply::stream(feed(path)?, &mut faces)?;
                faces.finish()?;
                let first = faces.first_out_of_range()?;
                if let Some(corner) = first {
                    return Err(io::ply::out_of_range(faces.vertex_count(), corner).into());
                }
                let object = self.object(String::new());
                faces.resolve(|_| object, Some(self))?.map_or(Ok(()), |misfit| {
                    // What is wrong is met again where it stands.
                    io::ply::stream(feed(path)?, &mut faces::Probe::new(misfit))
                })
            }
            MeshFormat::Obj => self.read_obj(path),
            MeshFormat::Gltf => Ok(()),
        }
    }

    fn read_obj(&mut self, path: &Path) -> Result<(), Halt> {
        let mut faces = Indexed::new(self.means);
        let read = io::obj::stream(|| feed(path), &mut faces);
        faces.finish()?;
        // A vertex that the format cannot hold is wrong at the first face that uses it, before what is wrong further down.
        let names = match read {
            Ok(names) => names,
            Err(halt) => {
                let misfit = faces.resolve(|_| 0, None)?;
                return Err(misfit.map_or(Ok(halt), |Misfit(vertex)| io::obj::misfit(feed(path)?, vertex))?);
            }
        };
        let first = self.names.len();
        for name in names {
            self.object(name);
        }
        let misfit = faces.resolve(|run| first + run.object as usize, Some(self))?;
        misfit.map_or(Ok(()), |Misfit(vertex)| Err(io::obj::misfit(feed(path)?, vertex)?))
    }

    /// The number of a new object.
    fn object(&mut self, name: String) -> usize {
        self.names.push((name, false));
        if self.split || self.bodies.is_empty() {
            self.bodies.push(Gathering::new());
        }
        self.names.len() - 1
    }

    fn body(&self, object: usize) -> usize {
        if self.split { object } else { 0 }
    }

    /// Adds distinct vertices to those of an object.
    fn add_vertices(&mut self, object: usize, count: u64) {
        let body = self.body(object);
        self.bodies[body].vertices += count;
    }

    /// Adds a triangle to an object. -0.0 becomes 0.0.
    fn add(&mut self, object: usize, corners: [[f64; 3]; 3]) -> Result<(), Halt> {
        if self.next_id == MAX_TRIANGLES {
            return Err(Fault::Limit { place: Place::File, most: MAX_TRIANGLES, what: "triangles" }.into());
        }
        let body = self.body(object);
        if body != self.current {
            self.go_to(body)?;
        }
        self.names[object].1 = true;
        if let Some(runs) = &mut self.runs {
            runs.add(object, &self.spill)?;
        }
        let gathering = &mut self.bodies[body];
        let corners = corners.map(|corner| corner.map(|value| value + 0.0));
        corners.iter().for_each(|&corner| gathering.extent.add(corner));
        if gathering.open.capacity() == 0 {
            gathering.open.reserve_exact(PART.min(1 << 10));
        }
        gathering.open.push(WideTriangle { corners, id: self.next_id as u32, spare: 0 });
        gathering.count += 1;
        self.next_id += 1;
        if gathering.open.len() == PART {
            gathering.close_part(&self.spill)?;
        }
        Ok(())
    }

    fn go_to(&mut self, body: usize) -> Result<(), Halt> {
        if let Some(last) = self.bodies.get_mut(self.current).filter(|last| !last.open.is_empty()) {
            last.parked = Some(self.spill.put(std::mem::take(&mut last.open))?);
        }
        if let Some(parked) = self.bodies[body].parked.take() {
            self.bodies[body].open = parked.take()?;
        }
        self.current = body;
        Ok(())
    }

    /// All triangles as they were read, in the order of their ids, of a gatherer [`in_sequence`](Self::in_sequence).
    pub(crate) fn into_sequence(self) -> Result<Sequence, BakeError> {
        let Self { names, mut bodies, spill, runs, .. } = self;
        let mut parts = Vec::new();
        for body in &mut bodies {
            if !body.open.is_empty() {
                body.close_part(&spill)?;
            }
            parts.append(&mut body.parts);
        }
        Sequence::new(parts, runs.unwrap_or_else(Runs::new), names.len(), &spill)
    }

    /// All objects with triangles, ready to be baked.
    pub(crate) fn finish(self, grid_error: impl Fn(f64) -> Option<f64>) -> Result<Vec<Prepared>, BakeError> {
        let Self { names, bodies, spill, split, .. } = self;
        let mut names = names.into_iter().filter(|(_, found)| *found).map(|(name, _)| name);
        let mut prepared = Vec::new();
        for mut body in bodies.into_iter().filter(|body| body.count > 0) {
            if let Some(parked) = body.parked.take() {
                body.open = parked.take()?;
            }
            if !body.open.is_empty() {
                body.close_part(&spill)?;
            }
            let name = names.next().unwrap_or_default();
            // One object alone keeps its name; several that are joined have none.
            let name = if split || names.next().is_none() { name } else { String::new() };
            let placement = Placement::new(&body.extent, grid_error(body.extent.diagonal()));
            prepared.push(Prepared {
                name,
                origin: placement.origin(),
                soup: Soup {
                    parts: body.parts,
                    count: body.count,
                    placement: Some(placement).filter(|placement| !placement.keeps_f32()),
                },
                moved: Moved::default(),
                vertices: body.vertices,
            });
        }
        Ok(prepared)
    }
}

/// A file from its beginning.
fn feed(path: &Path) -> Result<Feed<File>, Halt> {
    let file = File::open(path).map_err(Halt::Io)?;
    let length = file.metadata().map_err(Halt::Io)?.len();
    Ok(Feed::new(file, length))
}
