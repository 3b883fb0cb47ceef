//! Makes the shapes of links: meshes from files, baked once for each content and scale, and primitives.

use crate::collada;
use crate::error::RobotError;
use crate::frame::Point;
use crate::options::RobotOptions;
use crate::packages::find;
use crate::urdf::{Described, Element};
use bvh_bake::input::mesh::Mesh;
use bvh_bake::{BakeError, Options, read_meshes, shapes, to_bytes, write_atomically};
use bvh_query::{Bvh, OwnedShape, QueryError};
use std::collections::HashMap;
use std::path::Path;
use xxhash_rust::xxh3::Xxh3;

/// Makes shapes, and keeps those of meshes.
pub(crate) struct Shapes<'a> {
    urdf: &'a Path,
    options: &'a RobotOptions,
    baked: HashMap<u128, OwnedShape>,
}

impl<'a> Shapes<'a> {
    pub(crate) fn new(urdf: &'a Path, options: &'a RobotOptions) -> Self {
        Self { urdf, options, baked: HashMap::new() }
    }

    /// Returns a shape of a link.
    pub(crate) fn make(&mut self, element: &Element, link: &str) -> Result<OwnedShape, RobotError> {
        let refused = |source: BakeError| RobotError::Mesh {
            path: self.urdf.to_owned(),
            link: link.to_owned(),
            source: Box::new(source),
        };
        let shape = |error: bvh_bake::ShapeError| RobotError::Description {
            path: self.urdf.to_owned(),
            place: format!("link {link}"),
            expected: "a shape of finite size",
            found: error.to_string(),
        };
        let baked = |mesh: Mesh| -> Result<OwnedShape, RobotError> {
            let (bytes, _) = to_bytes(&mesh, &Options::default()).map_err(refused)?;
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
        let path = find(uri, self.urdf, &self.options.packages).map_err(|tried| RobotError::NoMesh {
            path: self.urdf.to_owned(),
            link: link.to_owned(),
            uri: uri.to_owned(),
            tried,
        })?;
        let content = std::fs::read(&path).map_err(|source| RobotError::Io { path: path.clone(), source })?;
        let key = key(&content, &path, scale);
        if let Some(shape) = self.baked.get(&key) {
            return Ok(shape.clone());
        }
        let cached = self.options.cache.as_ref().map(|folder| folder.join(format!("{key:032x}.cbvh")));
        let shape = match cached.filter(|cached| cached.is_file()) {
            Some(cached) => Bvh::read(&cached).map_err(|source| RobotError::Cache { source })?.into(),
            None => self.bake(link, &path, &content, scale, key)?,
        };
        self.baked.insert(key, OwnedShape::clone(&shape));
        Ok(shape)
    }

    /// Bakes a mesh, and puts it into the cache.
    fn bake(
        &self,
        link: &str,
        path: &Path,
        content: &[u8],
        scale: Point,
        key: u128,
    ) -> Result<OwnedShape, RobotError> {
        let refused = |source: BakeError| RobotError::Mesh {
            path: self.urdf.to_owned(),
            link: link.to_owned(),
            source: Box::new(source),
        };
        let place = || format!("link {link}, {}", path.display());
        let description = |expected: &'static str, found: String| RobotError::Description {
            path: self.urdf.to_owned(),
            place: place(),
            expected,
            found,
        };
        let is_collada = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dae"));
        let mut mesh = if is_collada {
            let text = std::str::from_utf8(content).map_err(|error| error.to_string());
            text.and_then(collada::read).map_err(|found| description("a COLLADA file", found))?
        } else {
            read_meshes(&[path.to_owned()]).map_err(refused)?.merged()
        };
        rescale(&mut mesh, scale);
        let (bytes, _) = to_bytes(&mesh, &Options::default()).map_err(refused)?;
        if let Some(folder) = &self.options.cache {
            let file = folder.join(format!("{key:032x}.cbvh"));
            std::fs::create_dir_all(folder)
                .map_err(|source| RobotError::Io { path: folder.clone(), source })?;
            write_atomically(&file, &bytes).map_err(refused)?;
        }
        Ok(Bvh::from_bytes(bytes).map_err(QueryError::from)?.into())
    }
}

/// Returns the key of a mesh in the cache: a hash of what its baked bytes depend on.
fn key(content: &[u8], path: &Path, scale: Point) -> u128 {
    let mut hash = Xxh3::new();
    hash.update(env!("CARGO_PKG_VERSION").as_bytes());
    let extension = path.extension().unwrap_or_default();
    hash.update(extension.to_ascii_lowercase().as_encoded_bytes());
    scale.iter().for_each(|factor| hash.update(&factor.to_le_bytes()));
    hash.update(content);
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
