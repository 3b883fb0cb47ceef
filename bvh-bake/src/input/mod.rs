//! Reads meshes from files: OBJ, STL, PLY, glTF and COLLADA, and clouds of points: XYZ, PCD and PLY.
//!
//! There is one reader per format. It reads a file piece by piece and passes what it finds either to a bake (module
//! `gather`), which keeps to its memory budget, or into a [`Mesh`] that keeps the contract of [`Mesh::check`]
//! ([`read`]). If a file is malformed, one line states what is wrong and where. No reader panics, and no reader
//! allocates from a count that the file declares before checking that the file is long enough for it. The parts
//! of glTF and COLLADA files may be in any order: the JSON of the former, of which buffers are read block by block, and the latter
//! are read as a whole.
//!
//! Polygons are triangulated (module `polygon`), objects without triangles are left out, degenerate triangles are kept,
//! and -0.0 is read as 0.0.

mod byte_reader;
mod checksums;
mod collada;
mod collect;
mod frame;
pub(crate) mod gather;
pub(crate) mod gltf;
mod head;
mod indexed;
mod input_file;
pub mod mesh;
mod names;
mod obj;
mod pcd;
mod ply;
pub(crate) mod polygon;
mod read_ahead;
mod stl;
mod text;
mod warnings;
pub mod xml;
mod xyz;

use crate::error::{BakeError, Fault, Halt, excerpt};
pub use crate::error::{Place, ReadError};
use crate::options::Options;
use crate::progress::Progress;
use crate::storage::resources::{Allowance, Resources};
pub(crate) use checksums::Checksums;
pub use collada::UpAxis;
use collect::mesh_of_faces;
use gather::SceneFaces;
use indexed::IndexedFaces;
pub(crate) use input_file::InputFile;
use input_file::Opener;
use mesh::Mesh;
use names::Names;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::thread;

/// A format of mesh files, or of files of points. A point becomes a triangle whose corners are equal.
///
/// ```
/// use bvh_bake::MeshFormat;
///
/// assert_eq!(MeshFormat::from_extension("part.STL".as_ref()), Some(MeshFormat::Stl));
/// assert_eq!(MeshFormat::from_content(b"ply\nformat ascii 1.0\n"), Some(MeshFormat::Ply));
/// assert!(MeshFormat::of_file("photo.jpeg".as_ref(), b"\xff\xd8\xff").is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront OBJ, text.
    Obj,
    /// STL, text or binary.
    Stl,
    /// PLY, text or binary of either byte order. Without an element `face`, its vertices are points.
    Ply,
    /// glTF 2.0, as JSON or as one binary file (GLB).
    Gltf,
    /// COLLADA 1.4 and 1.5, in metres and with z pointing up.
    Collada,
    /// XYZ, text with a point per line.
    Xyz,
    /// PCD, the points of the Point Cloud Library, as text, binary or compressed.
    Pcd,
}

const KNOWN: &str =
    "a mesh in a file named .obj, .stl, .ply, .gltf, .glb or .dae, or points in one named .xyz, .pcd or .ply";

impl MeshFormat {
    /// Returns the name of the format, such as `OBJ`.
    pub const fn name(self) -> &'static str {
        match self {
            MeshFormat::Obj => "OBJ",
            MeshFormat::Stl => "STL",
            MeshFormat::Ply => "PLY",
            MeshFormat::Gltf => "glTF",
            MeshFormat::Collada => "COLLADA",
            MeshFormat::Xyz => "XYZ",
            MeshFormat::Pcd => "PCD",
        }
    }

    /// Returns the format of a file: that of its extension or, if the extension is unknown or missing, the one that its bytes
    /// suggest.
    ///
    /// # Errors
    /// [`ReadError::Invalid`] if neither is known. It names what the file holds instead, if its first bytes tell.
    pub fn of_file(path: &Path, bytes: &[u8]) -> Result<MeshFormat, ReadError> {
        Self::of_head(path, bytes, bytes.len() as u64)
    }

    /// Returns the format of a file of `length` bytes. 4096 of its first bytes are enough.
    pub(crate) fn of_head(path: &Path, head: &[u8], length: u64) -> Result<MeshFormat, ReadError> {
        let known = Self::from_extension(path).or_else(|| Self::from_head(head, length));
        known.ok_or_else(|| unknown_format(path, head, length))
    }

    /// Returns the format that the extension of a file's name stands for, in upper or lower case.
    pub fn from_extension(path: &Path) -> Option<MeshFormat> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(MeshFormat::Obj),
            "stl" => Some(MeshFormat::Stl),
            "ply" => Some(MeshFormat::Ply),
            "gltf" | "glb" => Some(MeshFormat::Gltf),
            "dae" => Some(MeshFormat::Collada),
            "xyz" => Some(MeshFormat::Xyz),
            "pcd" => Some(MeshFormat::Pcd),
            _ => None,
        }
    }

    /// Recognises the format from the beginning of a file. XYZ has no mark of its own, and is not recognised.
    pub fn from_content(bytes: &[u8]) -> Option<MeshFormat> {
        Self::from_head(bytes, bytes.len() as u64)
    }

    /// Recognises the format from the first bytes of a file of `length` bytes. 4096 bytes are enough.
    pub(crate) fn from_head(bytes: &[u8], length: u64) -> Option<MeshFormat> {
        let head = &bytes[..bytes.len().min(4096)];
        let trimmed = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        let is_statement = |line: &[u8]| {
            matches!(text::words(line).next(), Some(b"v" | b"vn" | b"vt" | b"o" | b"g" | b"mtllib"))
        };
        if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
            Some(MeshFormat::Ply)
        } else if head.starts_with(b"# .PCD") || head.starts_with(b"VERSION .7\n") {
            Some(MeshFormat::Pcd)
        } else if head.starts_with(b"glTF") || trimmed.starts_with(b"{") {
            Some(MeshFormat::Gltf)
        } else if collada::is_collada(head) {
            Some(MeshFormat::Collada)
        } else if stl::is_ascii(bytes) || stl::is_exact_binary(bytes, length) {
            Some(MeshFormat::Stl)
        } else if !head.contains(&0) && text::Lines::new(head).any(is_statement) {
            Some(MeshFormat::Obj)
        } else {
            None
        }
    }
}

/// Returns the name of a file without its folders and its extension. Objects without a name get this name.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Reads a mesh file into memory. The format is that of the file's extension or, if the extension is unknown or
/// missing, the one that the content suggests. The buffers that a glTF file names must be regular files in its folder
/// or below it, after `..` and symbolic links are resolved. [`FileBake::allow_outside`](crate::FileBake::allow_outside)
/// allows others.
///
/// # Errors
/// [`ReadError`]: the error of the system, or the first defect of the file.
pub fn read(path: &Path) -> Result<Mesh, ReadError> {
    collect(&find(path)?)
}

/// Reads a mesh file as [`read`] does. `up_axis` says what to do with the axis that a COLLADA file declares to point up, and
/// `allow_outside` whether a glTF file may name buffers anywhere.
///
/// # Errors
/// The errors of [`read`].
pub fn read_with(path: &Path, up_axis: UpAxis, allow_outside: bool) -> Result<Mesh, ReadError> {
    collect(&find(path)?.with_up_axis(up_axis).allow_outside(allow_outside))
}

/// Reads a mesh file as a scene, which has instances. In a glTF or COLLADA file, each node with a mesh is an instance. Nodes
/// share their meshes, and a mesh becomes one object for each scale with which it occurs. A glTF node that repeats its mesh
/// (`EXT_mesh_gpu_instancing`) is as many instances, a mesh is another one with other weights of its morph targets, and a mesh with a
/// skin stands in the world. In other files, each object is an instance at its own place. Names that occur again get a number.
///
/// The transform of a node may be a matrix. If it is a rotation with scales to within 2^-22, it is treated as one. If a
/// scale is within 2^-22 of one that a node states, or of the scale of an earlier matrix, both count as equal, because
/// f32 numbers cannot distinguish them better. Each matrix above a vertex may therefore move it by 2^-21 of its
/// distance from the node's origin, and no field of a file records this. Nodes with a translation, a rotation and a
/// scale are exact except for roundings of f64.
///
/// # Errors
/// The errors of [`read`].
pub fn read_scene(path: &Path) -> Result<Mesh, ReadError> {
    collect(&find(path)?.for_scene(true))
}

/// Reads a mesh from the bytes of a file. `source` names the file in errors. Other files that a glTF file names are
/// looked up in the folder of `source`, as [`read`] does.
///
/// # Errors
/// The errors of [`read`].
pub fn read_bytes(bytes: &[u8], format: MeshFormat, source: &Path) -> Result<Mesh, ReadError> {
    read_bytes_with(bytes, format, source, &Options::default())
}

/// Reads a mesh from the bytes of a file as [`read_bytes`] does, with those options that concern reading: `scene` and
/// `drop_nan`.
///
/// # Errors
/// The errors of [`read`].
pub fn read_bytes_with(
    bytes: &[u8],
    format: MeshFormat,
    source: &Path,
    options: &Options,
) -> Result<Mesh, ReadError> {
    collect(&InputFile::of_bytes(bytes, format, source).with_options(options))
}

/// Finds a file that may take as much memory as there is.
fn find(path: &Path) -> Result<InputFile<'_>, ReadError> {
    InputFile::find(path, Allowance::UNLIMITED, &Progress::default()).map_err(|halt| read_error(halt, path))
}

/// Turns the reason why reading a file stopped into an error. Nothing is stored outside memory, which is not limited.
fn read_error(halt: Halt, path: &Path) -> ReadError {
    match halt.in_file(path) {
        BakeError::Read(error) => error,
        other => ReadError::Io { path: path.to_owned(), source: std::io::Error::other(other.to_string()) },
    }
}

/// Reads an input into a mesh that keeps the contract.
fn collect(input: &InputFile) -> Result<Mesh, ReadError> {
    let (progress, checksum) = (&Progress::default(), OnceLock::new());
    let mesh = if input.format() == MeshFormat::Collada {
        let resources = Resources::unlimited(progress);
        let mut found = SceneFaces::new(&resources);
        let read = collada::read(input, &mut found, Allowance::UNLIMITED, progress);
        read.and_then(|_| found.finish(input)).and_then(|()| found.into_mesh())
    } else if input.format() == MeshFormat::Gltf {
        let mut found = gltf::InMemory::default();
        let read = input.look(progress).and_then(|()| {
            gltf::read(input, &input.random_access()?, &mut found, Allowance::UNLIMITED, progress)
        });
        read.map(|_| found.mesh)
    } else {
        thread::scope(|scope| {
            let opener = Opener { input, progress, checksum: &checksum, scope };
            let open = || opener.open();
            // Nothing goes to scratch files.
            let resources = Resources::unlimited(progress);
            let mut faces = IndexedFaces::new(&resources);
            match input.format() {
                MeshFormat::Stl => stl::read_mesh(open()?, input.warnings()),
                MeshFormat::Ply => {
                    ply::read(open, &mut faces, input)?;
                    mesh_of_faces(&faces, &Names::unnamed())
                }
                MeshFormat::Xyz => {
                    xyz::read(open()?, &mut faces, input)?;
                    mesh_of_faces(&faces, &Names::unnamed())
                }
                MeshFormat::Pcd => {
                    pcd::read(open()?, &mut faces, input, &resources)?;
                    mesh_of_faces(&faces, &Names::unnamed())
                }
                _ => {
                    let names = obj::read(open, &mut faces, input.warnings(), &resources)?;
                    mesh_of_faces(&faces, &names)
                }
            }
        })
    };
    let mut mesh = mesh.map_err(|halt| read_error(halt, input.path()))?;
    mesh.drop_empty_objects();
    if input.is_scene() {
        // As a bake of files names them.
        let unnamed = mesh.objects.iter_mut().filter(|object| object.name.is_empty());
        unnamed.for_each(|object| object.name = stem(input.path()));
        mesh.place_all();
        mesh::tell_apart(&mut mesh.instances);
    }
    mesh.warnings = input.warnings().take(input.path());
    mesh.drop_negative_zeros();
    mesh.check().map_err(|error| ReadError::Mesh { path: input.path().to_owned(), source: error })?;
    Ok(mesh)
}

/// Returns the error for a file of no known format, given its length and its first bytes.
fn unknown_format(path: &Path, head: &[u8], length: u64) -> ReadError {
    if let Some(fault) = head::misnamed(head, length, None) {
        return fault.in_file(path);
    }
    let found = match path.extension() {
        Some(extension) => format!("an unsupported format, .{}", excerpt(extension.as_encoded_bytes())),
        None => "content of no known format".to_owned(),
    };
    Fault::new(Place::File, KNOWN, found).in_file(path)
}

/// Reads mesh files as [`crate::FileBake`] does: the objects of one file follow those of the previous one, and the ids
/// are consecutive.
///
/// # Errors
/// The errors of [`read`], and an error if the files together have more triangles than there are ids.
pub fn read_meshes(inputs: &[PathBuf]) -> Result<Mesh, BakeError> {
    let mut joined = Mesh::default();
    for input in inputs {
        append(&mut joined, read(input)?)?;
    }
    Ok(joined)
}

/// Appends the objects of a mesh. Their ids follow the present ones.
fn append(joined: &mut Mesh, mut mesh: Mesh) -> Result<(), BakeError> {
    let first = joined.triangle_count();
    let all = first + mesh.triangle_count();
    if all > mesh::MAX_TRIANGLES {
        return Err(mesh::InputError::TooManyTriangles(all).into());
    }
    let ids = mesh.objects.iter_mut().flat_map(|object| &mut object.triangle_ids);
    ids.for_each(|id| *id = id.saturating_add(first as u32));
    let objects = joined.objects.len() as u32;
    mesh.instances.iter_mut().for_each(|instance| instance.object = instance.object.saturating_add(objects));
    joined.instances.append(&mut mesh.instances);
    joined.objects.append(&mut mesh.objects);
    joined.warnings.append(&mut mesh.warnings);
    Ok(())
}

/// Returns the ids of the next `count` triangles.
fn next_ids(next: &mut u32, count: usize) -> Result<Vec<u32>, Fault> {
    let most = mesh::MAX_TRIANGLES;
    let end = u64::from(*next) + count as u64;
    if end > most {
        return Err(Fault::Limit { place: Place::File, most, what: "triangles" });
    }
    let ids = (*next..end as u32).collect();
    *next = end as u32;
    Ok(ids)
}

/// The requirement for a coordinate, as messages state it.
pub(crate) const COORDINATE: &str = "a finite coordinate of at most 2^120 in magnitude";

/// Returns how a message states a coordinate that the format cannot hold. A point may lack a position, which has a remedy.
fn misfit(value: f64, of_point: bool) -> String {
    match of_point && !value.is_finite() {
        true => format!("{value:e}; --drop-nan (drop_nan) leaves out points without a position"),
        false => format!("{value:e}"),
    }
}

/// Returns the fault of a file that was malformed at the first reading but not at the second.
fn changed_meanwhile() -> Fault {
    Fault::new(Place::File, "the file as it was at the first reading", "a changed file")
}
