//! The texts that a robot was read from.

use crate::error::RobotError;
use crate::options::{Base, Geometry, RobotOptions};
use crate::xml::text_of;
use std::path::{Path, PathBuf};

/// The texts that a robot was read from, and how they are read.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) urdf: String,
    pub(crate) srdf: Option<(PathBuf, String)>,
    pub(crate) geometry: Geometry,
    pub(crate) base: Base,
    /// What the readers of meshes warned of.
    pub(crate) mesh_warnings: Vec<String>,
}

impl Source {
    pub(crate) fn read(path: &Path, options: &RobotOptions) -> Result<Self, RobotError> {
        let urdf = text_of(path)?;
        let srdf = options.srdf.as_ref().map(|srdf| Ok::<_, RobotError>((srdf.clone(), text_of(srdf)?)));
        let (geometry, base) = (options.geometry, options.base);
        Ok(Self {
            path: path.to_owned(),
            urdf,
            srdf: srdf.transpose()?,
            geometry,
            base,
            mesh_warnings: Vec::new(),
        })
    }
}
