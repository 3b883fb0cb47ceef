//! The checksums of an input: of its bytes and, where they do not suffice, of the mesh that is read from them.

use super::MeshFormat;
use super::gltf::{self, Sink};
use super::input_file::InputFile;
use crate::error::Halt;
use crate::progress::Progress;
use crate::storage::resources::Allowance;

/// The checksums that show whether an input has changed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Checksums {
    /// The checksum of the file's bytes.
    pub(crate) file: u64,
    /// The checksum of the mesh, if the bytes of the file do not suffice: a glTF file may name other files.
    pub(crate) mesh: Option<u64>,
}

impl Checksums {
    /// Reads an input only for its checksums.
    pub(crate) fn of(input: &InputFile, memory: Allowance, progress: &Progress) -> Result<Self, Halt> {
        if input.format() == MeshFormat::Gltf {
            return Self::of_gltf(input, &mut (), memory, progress);
        }
        Ok(Self { file: input.checksum(progress)?, mesh: None })
    }

    /// Reads a glTF file into `sink`.
    pub(crate) fn of_gltf(
        input: &InputFile,
        sink: &mut dyn Sink,
        memory: Allowance,
        progress: &Progress,
    ) -> Result<Self, Halt> {
        input.look(progress)?;
        let mesh = gltf::read(input, &input.random_access()?, sink, memory, progress)?;
        // The document is not in memory any more.
        Ok(Self { file: input.checksum(progress)?, mesh: Some(mesh) })
    }
}
