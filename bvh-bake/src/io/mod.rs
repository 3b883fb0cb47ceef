//! Reads meshes from files: OBJ, STL, PLY and glTF.
//!
//! Every reader takes the whole file as bytes and gives a [`Mesh`] that keeps the contract of
//! [`Mesh::check`], or one line that says what is wrong and where. No reader panics, and none allocates from
//! a count that the file declares before checking that the file is long enough to hold what it counts.
//!
//! Polygons are triangulated (module `polygon`), objects without triangles are left out, degenerate triangles
//! stay, and -0.0 is read as 0.0.

mod error;
mod feed;
mod gltf;
mod input;
pub(crate) mod obj;
pub(crate) mod ply;
pub(crate) mod polygon;
mod relay;
pub(crate) mod stl;
mod text;

pub(crate) use error::{Fault, Halt, excerpt};
pub use error::{Place, ReadError};
pub(crate) use feed::Feed;
pub(crate) use input::Input;
pub(crate) use relay::Relay;

use crate::error::BakeError;
use crate::files::Checksums;
use crate::mesh::Mesh;
use crate::progress::{Progress, Step, WHOLE};
use bvh_format::checksum::checksum;
use std::path::Path;

/// A format of mesh files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront OBJ, text.
    Obj,
    /// STL, text or binary.
    Stl,
    /// PLY, text or binary of either byte order.
    Ply,
    /// glTF 2.0, as JSON or as one binary file (GLB).
    Gltf,
}

const KNOWN: &str = "a mesh in a file named .obj, .stl, .ply, .gltf or .glb";

impl MeshFormat {
    /// Tells the format from the end of a file's name, whatever its case.
    pub fn from_extension(path: &Path) -> Option<MeshFormat> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(MeshFormat::Obj),
            "stl" => Some(MeshFormat::Stl),
            "ply" => Some(MeshFormat::Ply),
            "gltf" | "glb" => Some(MeshFormat::Gltf),
            _ => None,
        }
    }

    /// Tells the format from the beginning of a file.
    pub fn from_content(bytes: &[u8]) -> Option<MeshFormat> {
        Self::from_head(bytes, bytes.len() as u64)
    }

    /// Tells the format from the first bytes of a file of `length` bytes; 4096 do.
    pub(crate) fn from_head(bytes: &[u8], length: u64) -> Option<MeshFormat> {
        let head = &bytes[..bytes.len().min(4096)];
        let trimmed = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        let is_statement = |line: &[u8]| {
            matches!(text::words(line).next(), Some(b"v" | b"vn" | b"vt" | b"o" | b"g" | b"mtllib"))
        };
        if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
            Some(MeshFormat::Ply)
        } else if head.starts_with(b"glTF") || trimmed.starts_with(b"{") {
            Some(MeshFormat::Gltf)
        } else if stl::is_ascii(bytes) || stl::is_exact_binary(bytes, length) {
            Some(MeshFormat::Stl)
        } else if !head.contains(&0) && text::Lines::new(head).any(is_statement) {
            Some(MeshFormat::Obj)
        } else {
            None
        }
    }
}

/// Reads a mesh file, whole, into memory. The format is that of the file's extension, or, if that is unknown
/// or missing, what the content looks like.
///
/// # Errors
/// [`ReadError`]: the system's, or the first thing that the file gets wrong.
pub fn read(path: &Path) -> Result<Mesh, ReadError> {
    let bytes = read_whole(path, &Progress::default())?;
    let format = MeshFormat::from_extension(path).or_else(|| MeshFormat::from_content(&bytes));
    read_bytes(&bytes, format.ok_or_else(|| unknown_format(path))?, path)
}

/// Reads a glTF file, which is a pass of so much weight, with what tells whether it is still as it was.
pub(crate) fn read_gltf(
    path: &Path,
    progress: &Progress,
    weight: u64,
) -> Result<(Mesh, Checksums), ReadError> {
    let bytes = read_whole(path, progress)?;
    let mesh = parse(&bytes, MeshFormat::Gltf, path, progress, weight)?;
    let checksums = Checksums { file: checksum(&bytes), mesh: Some(mesh.checksum()) };
    Ok((mesh, checksums))
}

fn read_whole(path: &Path, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let read = Input::open(path, progress, 0).and_then(|mut input| input.read_all());
    read.map_err(|source| ReadError::Io { path: path.to_owned(), source })
}

/// What is said of a file of no known format.
pub(crate) fn unknown_format(path: &Path) -> ReadError {
    let found = match path.extension() {
        Some(extension) => format!("an unsupported format, .{}", excerpt(extension.as_encoded_bytes())),
        None => "content of no known format".to_owned(),
    };
    Fault::new(Place::File, KNOWN, found).in_file(path)
}

/// Reads a mesh from the bytes of a file. `source` names the file in errors; the files that a glTF file
/// refers to are looked for beside it.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(bytes: &[u8], format: MeshFormat, source: &Path) -> Result<Mesh, ReadError> {
    parse(bytes, format, source, &Progress::default(), WHOLE)
}

/// As [`read_bytes`]; it is a pass of so much weight.
pub(crate) fn parse(
    bytes: &[u8],
    format: MeshFormat,
    source: &Path,
    progress: &Progress,
    weight: u64,
) -> Result<Mesh, ReadError> {
    let length = bytes.len() as u64;
    let tally = |units| progress.tally(Step::Read, weight, length, units);
    let mesh = match format {
        // The text is gone through twice.
        MeshFormat::Obj => obj::read(bytes, tally(2 * length)).map_err(Halt::from),
        MeshFormat::Stl => stl::read(Feed::watched(bytes, &tally(length))),
        MeshFormat::Ply => ply::read(Feed::watched(bytes, &tally(length))),
        MeshFormat::Gltf => gltf::read(bytes, source, progress).map_err(Halt::from),
    };
    let mut mesh = mesh.map_err(|halt| match halt.in_file(source) {
        BakeError::Read(error) => error,
        // Nothing is kept elsewhere.
        other => ReadError::Io { path: source.to_owned(), source: std::io::Error::other(other.to_string()) },
    })?;
    mesh.objects.retain(|object| !object.triangles.is_empty());
    mesh.drop_negative_zeros();
    mesh.check().map_err(|error| ReadError::Mesh { path: source.to_owned(), source: error })?;
    Ok(mesh)
}

/// The ids of the next `count` triangles.
fn next_ids(next: &mut u32, count: usize) -> Result<Vec<u32>, Fault> {
    let most = crate::mesh::MAX_TRIANGLES;
    let end = u64::from(*next) + count as u64;
    if end > most {
        return Err(Fault::Limit { place: Place::File, most, what: "triangles" });
    }
    let ids = (*next..end as u32).collect();
    *next = end as u32;
    Ok(ids)
}

/// What a coordinate has to be, for messages.
pub(crate) const COORDINATE: &str = "a finite coordinate of at most 2^120 in magnitude";
