//! Reads mesh files of any size into soups: what readers find goes to pieces, in memory or in files.
//!
//! The readers of STL and PLY are those of meshes in memory; OBJ has one of its own (`io::obj`). Triangles, ids, counts
//! and errors are the same as of a mesh in memory.

mod away;
mod counter;
mod faces;
mod sequence;
mod solids;

pub(crate) use sequence::Sequence;

use crate::error::BakeError;
use crate::files::Checksums;
use crate::io::{self, Fault, Feed, Halt, Input, MeshFormat, Place, ReadError, Relay};
use crate::means::Means;
use crate::mesh::{InputError, MAX_TRIANGLES};
use crate::placement::{Extent, Moved, Placement};
use crate::prepare::Prepared;
use crate::progress::{Progress, Step, WHOLE};
use crate::scratch::{Piece, Spill};
use crate::soup::{PART, Part, Soup, WideTriangle};
use away::Away;
use faces::{Indexed, Misfit};
use sequence::Runs;
use solids::Solids;
use std::cell::Cell;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::thread::{self, Scope};

/// What passes over a file's bytes are worth: reading STL; reading PLY, and looking up the corners of its faces; reading
/// OBJ for vertices and for faces, which is one weight, and looking up.
const STL: u64 = WHOLE;
const PLY: [u64; 2] = [7, 9];
const OBJ: [u64; 2] = [5, 6];

/// The objects found so far.
pub(crate) struct Gatherer<'a> {
    means: &'a Means,
    /// Whether objects stay apart.
    split: bool,
    spill: Arc<Spill>,
    /// Where parts go while a file is read.
    away: Option<Away>,
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
}

impl<'a> Gatherer<'a> {
    pub(crate) fn new(means: &'a Means, split: bool) -> Self {
        Self {
            means,
            split,
            spill: Arc::new(means.scratch.spill()),
            away: None,
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

    /// Whether anybody asks how many distinct vertices there are.
    fn counts_vertices(&self) -> bool {
        self.runs.is_none()
    }

    /// Triangles of all files so far.
    pub(crate) fn triangles(&self) -> u64 {
        self.next_id
    }

    /// Reads a file: glTF whole, others piece by piece.
    pub(crate) fn read(&mut self, path: &Path, format: MeshFormat) -> Result<Checksums, BakeError> {
        if format == MeshFormat::Gltf {
            return self.read_gltf(path);
        }
        let before = self.next_id;
        let checksum = OnceLock::new();
        let spill = self.spill.clone();
        let (read, parts) = thread::scope(|scope| {
            let (away, putting) = Away::start(scope, &spill);
            self.away = Some(away);
            let files = Files { path, progress: &self.means.progress, checksum: &checksum, scope };
            let read = self.read_as(&files, format);
            self.away = None;
            (read, putting.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
        // Reading ends early where parts cannot be put away.
        for (body, part) in parts? {
            self.bodies[body].parts.push(part);
        }
        read.map_err(|halt| halt.in_file(path))?;
        if self.next_id == before {
            return Err(ReadError::Mesh { path: path.to_owned(), source: InputError::Empty }.into());
        }
        // Readers that succeed go to the end of the file, where its checksum is known.
        let file = checksum.into_inner().ok_or_else(|| {
            let source = std::io::ErrorKind::UnexpectedEof.into();
            ReadError::Io { path: path.to_owned(), source }
        })?;
        Ok(Checksums { file, mesh: None })
    }

    fn read_gltf(&mut self, path: &Path) -> Result<Checksums, BakeError> {
        let (mesh, checksums) = io::read_gltf(path, &self.means.progress, WHOLE)?;
        for object in &mesh.objects {
            let number = self.object(object.name.clone());
            let mut used = vec![false; object.positions.len()];
            for &triangle in &object.triangles {
                triangle.iter().for_each(|&vertex| used[vertex as usize] = true);
                let corners = triangle.map(|vertex| object.positions[vertex as usize]);
                self.add(number, corners).map_err(|halt| halt.in_file(path))?;
            }
            self.add_vertices(number, used.iter().filter(|&&used| used).count() as u64);
        }
        Ok(checksums)
    }

    fn read_as(&mut self, files: &Files, format: MeshFormat) -> Result<(), Halt> {
        let means = self.means;
        match format {
            MeshFormat::Stl => io::stl::stream(files.feed(STL)?, &mut Solids::new(self)),
            MeshFormat::Ply => {
                let mut faces = Indexed::new(self.means);
                let file = files.feed(PLY[0])?;
                let length = file.length();
                io::ply::stream(file, &mut faces)?;
                faces.finish()?;
                let first = faces.first_out_of_range()?;
                if let Some(corner) = first {
                    return Err(io::ply::out_of_range(faces.vertex_count(), corner).into());
                }
                let object = self.object(String::new());
                let tally = means.progress.tally(Step::Read, PLY[1], length, faces.corner_count());
                faces.resolve(|_| object, Some(self), &tally)?.map_or(Ok(()), |misfit| {
                    // What is wrong is met again where it stands.
                    io::ply::stream(files.feed(0)?, &mut faces::Probe::new(misfit))
                })
            }
            MeshFormat::Obj => self.read_obj(files),
            MeshFormat::Gltf => Ok(()),
        }
    }

    fn read_obj(&mut self, files: &Files) -> Result<(), Halt> {
        let mut faces = Indexed::new(self.means);
        let progress = &self.means.progress;
        let length = Cell::new(0);
        let walk = || files.feed(OBJ[0]).inspect(|file| length.set(file.length()));
        let read = io::obj::stream(walk, &mut faces);
        faces.finish()?;
        let tally = progress.tally(Step::Read, OBJ[1], length.get(), faces.corner_count());
        // A vertex that the format cannot hold is wrong at the first face that uses it, before what is wrong further down.
        let names = match read {
            Ok(names) => names,
            Err(halt) => {
                let misfit = faces.resolve(|_| 0, None, &tally)?;
                return Err(
                    misfit.map_or(Ok(halt), |Misfit(vertex)| io::obj::misfit(files.feed(0)?, vertex))?
                );
            }
        };
        let first = self.names.len();
        for name in names {
            self.object(name);
        }
        let misfit = faces.resolve(|run| first + run.object as usize, Some(self), &tally)?;
        misfit.map_or(Ok(()), |Misfit(vertex)| Err(io::obj::misfit(files.feed(0)?, vertex)?))
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
        if gathering.open.len() == PART { self.close_part(body) } else { Ok(()) }
    }

    /// Ends the open part of a body.
    fn close_part(&mut self, body: usize) -> Result<(), Halt> {
        let gathering = &mut self.bodies[body];
        let part = std::mem::take(&mut gathering.open);
        self.means.progress.find(part.len() as u64);
        match &self.away {
            Some(away) => {
                // What has gone wrong is told when all have been put away.
                let stopped = || Halt::Io(std::io::ErrorKind::BrokenPipe.into());
                gathering.open = away.put(body, part).ok_or_else(stopped)?;
            }
            None => gathering.parts.push(away::part(&part, &self.spill)?),
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
                body.parts.push(away::part(&body.open, &spill)?);
            }
            parts.append(&mut body.parts);
        }
        Sequence::new(parts, runs.unwrap_or_else(Runs::new), names.len(), &spill)
    }

    /// All objects with triangles, ready to be baked.
    pub(crate) fn finish(self, grid_error: impl Fn(f64) -> Option<f64>) -> Result<Vec<Prepared>, BakeError> {
        let Self { means, names, bodies, spill, split, .. } = self;
        let spill = &*spill;
        let mut names = names.into_iter().filter(|(_, found)| *found).map(|(name, _)| name);
        let mut prepared = Vec::new();
        for mut body in bodies.into_iter().filter(|body| body.count > 0) {
            if let Some(parked) = body.parked.take() {
                body.open = parked.take()?;
            }
            if !body.open.is_empty() {
                means.progress.find(body.open.len() as u64);
                body.parts.push(away::part(&body.open, spill)?);
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

/// An input, which is read on threads of its own.
struct Files<'scope, 'env> {
    path: &'env Path,
    progress: &'env Progress,
    /// Of the bytes, when a reader has come to the end.
    checksum: &'env OnceLock<u64>,
    scope: &'scope Scope<'scope, 'env>,
}

impl Files<'_, '_> {
    /// The file from its beginning, reading which is a pass of so much weight.
    fn feed(&self, weight: u64) -> Result<Feed<Relay>, Halt> {
        let input = Input::open(self.path, self.progress, weight).map_err(Halt::Io)?;
        let length = input.length();
        Ok(Feed::new(Relay::start(self.scope, input.with_checksum(self.checksum)), length))
    }
}
