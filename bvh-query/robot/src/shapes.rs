//! Makes the shapes of links: meshes from files, each read and baked once, and primitives.

use crate::error::RobotError;
use crate::frame::Point;
use crate::options::RobotOptions;
use crate::packages::{find, folders_of};
use crate::urdf::{Described, Element};
use crate::xml::shown;
use bvh_bake::input::mesh::{Mesh, Object};
use bvh_bake::input::read_with;
use bvh_bake::{BakeError, Options, generator, shapes, to_bytes, write_atomically};
use bvh_query::{Bvh, OwnedShape, QueryError};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// Makes shapes, and keeps those of meshes.
pub(crate) struct Shapes<'a> {
    urdf: &'a Path,
    options: &'a RobotOptions,
    /// The shapes of meshes, by what was read.
    baked: HashMap<u128, OwnedShape>,
    /// The same shapes by where they were read, and with which scale.
    placed: HashMap<(PathBuf, [u64; 3]), OwnedShape>,
    /// What the readers of meshes warn of, once for each file.
    warnings: Vec<String>,
    /// The files that have warnings there.
    warned: HashSet<PathBuf>,
}

impl<'a> Shapes<'a> {
    pub(crate) fn new(urdf: &'a Path, options: &'a RobotOptions) -> Self {
        let (baked, placed) = (HashMap::new(), HashMap::new());
        Self { urdf, options, baked, placed, warnings: Vec::new(), warned: HashSet::new() }
    }

    /// Takes out what the readers of meshes warn of. Each line names the URDF, the first link that has the mesh, and the mesh.
    pub(crate) fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Returns a shape of a link.
    pub(crate) fn make(&mut self, element: &Element, link: &str) -> Result<OwnedShape, RobotError> {
        let shape = |error: bvh_bake::ShapeError| RobotError::Description {
            path: self.urdf.to_owned(),
            place: format!("link {link}"),
            expected: "a shape of finite size".into(),
            found: error.to_string(),
        };
        let baked = |mesh: Mesh| -> Result<OwnedShape, RobotError> {
            let (bytes, _) =
                to_bytes(&mesh, &Options::default()).map_err(|source| self.refused(link, source))?;
            Ok(Bvh::from_bytes(bytes).map_err(QueryError::from)?.into())
        };
        match element.shape {
            Described::Block(size) => Ok(baked(shapes::block(size).map_err(shape)?)?.solid()?),
            Described::Ball(radius) => Ok(baked(shapes::point([0.0; 3]))?.rounded(radius)?),
            Described::Capsule { radius, length } => {
                let half = [0.0, 0.0, length / 2.0];
                Ok(baked(shapes::segment(half.map(|x| -x), half))?.rounded(radius)?)
            }
            Described::Cylinder { radius, length } => {
                let max_error = radius * self.options.cylinder_error;
                Ok(baked(shapes::cylinder(radius, length, max_error).map_err(shape)?.mesh)?.solid()?)
            }
            Described::Mesh { ref uri, scale } => self.mesh(link, uri, scale),
        }
    }

    fn mesh(&mut self, link: &str, uri: &str, scale: Point) -> Result<OwnedShape, RobotError> {
        let named = find(uri, self.urdf, &self.options.packages).map_err(|tried| RobotError::NoMesh {
            path: self.urdf.to_owned(),
            link: link.to_owned(),
            uri: uri.to_owned(),
            tried,
        })?;
        if !named.is_inside && !self.options.allow_outside {
            return Err(RobotError::Outside {
                path: self.urdf.to_owned(),
                link: link.to_owned(),
                uri: uri.to_owned(),
                folders: folders_of(self.urdf, &self.options.packages),
                found: named.path,
            });
        }
        // Links often share a mesh, which is read once.
        let place = (named.path.clone(), scale.map(f64::to_bits));
        if let Some(shape) = self.placed.get(&place) {
            return Ok(shape.clone());
        }
        let mut mesh = self.read(link, &named.path)?;
        if !mesh.warnings.is_empty() && self.warned.insert(named.path) {
            let line = |warning: String| shown(&format!("{}: link {link}: {warning}", self.urdf.display()));
            self.warnings.extend(std::mem::take(&mut mesh.warnings).into_iter().map(line));
        }
        rescale(&mut mesh, scale);
        let key = key(&mesh);
        let shape = match self.baked.get(&key) {
            Some(shape) => shape.clone(),
            None => self.baked(link, &mesh, key)?,
        };
        self.baked.insert(key, shape.clone());
        self.placed.insert(place, shape.clone());
        Ok(shape)
    }

    /// Reads a mesh.
    fn read(&self, link: &str, path: &Path) -> Result<Mesh, RobotError> {
        let read = read_with(path, self.options.up_axis, self.options.allow_outside);
        Ok(read.map_err(|error| self.refused(link, error.into()))?.merged())
    }

    /// Takes a mesh from the folder of baked meshes, or bakes it and puts it there.
    fn baked(&self, link: &str, mesh: &Mesh, key: u128) -> Result<OwnedShape, RobotError> {
        let cached = self.options.cache.as_ref().map(|folder| folder.join(format!("{key:032x}.cbvh")));
        if let Some(cached) = cached.as_ref().filter(|cached| cached.is_file()) {
            return Ok(Bvh::read(cached).map_err(|source| RobotError::Cache { source })?.into());
        }
        let (bytes, _) = to_bytes(mesh, &Options::default()).map_err(|source| self.refused(link, source))?;
        if let (Some(folder), Some(cached)) = (&self.options.cache, cached) {
            std::fs::create_dir_all(folder)
                .map_err(|source| RobotError::Io { path: folder.clone(), source })?;
            write_atomically(&cached, &bytes).map_err(|source| self.refused(link, source))?;
        }
        Ok(Bvh::from_bytes(bytes).map_err(QueryError::from)?.into())
    }

    fn refused(&self, link: &str, source: BakeError) -> RobotError {
        RobotError::Mesh { path: self.urdf.to_owned(), link: link.to_owned(), source: Box::new(source) }
    }
}

/// Returns the key of a mesh: a hash of all that its baked bytes depend on. The files that it was read from do not count: two of
/// them may be equal and name others that are not.
fn key(mesh: &Mesh) -> u128 {
    let mut hash = Xxh3::new();
    hash.update(generator().as_bytes());
    hash.update(Options::default().stamp().as_bytes());
    for Object { name, positions, triangles, triangle_ids } in &mesh.objects {
        let counts = [name.len(), positions.len(), triangles.len(), triangle_ids.len()];
        let mut bytes: Vec<u8> = counts.iter().flat_map(|&count| (count as u64).to_le_bytes()).collect();
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend(positions.iter().flatten().flat_map(|coordinate| coordinate.to_le_bytes()));
        bytes.extend(triangles.iter().flatten().chain(triangle_ids).flat_map(|number| number.to_le_bytes()));
        hash.update(&bytes);
    }
    hash.digest128()
}

/// Scales a mesh. If that mirrors it, the triangles are turned around, so that they still look outwards.
fn rescale(mesh: &mut Mesh, scale: Point) {
    let is_mirrored = scale.iter().product::<f64>() < 0.0;
    for object in &mut mesh.objects {
        for position in &mut object.positions {
            *position = [0, 1, 2].map(|axis| position[axis] * scale[axis]);
        }
        if is_mirrored {
            object.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
}
