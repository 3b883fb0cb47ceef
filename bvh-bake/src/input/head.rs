//! Tells from its first bytes that a file holds no mesh of the format that its name states, so that the error can name what it
//! holds instead, and the remedy. Readers pass over much that they do not know, and would refuse such a file by a detail.

use super::{MeshFormat, stl};
use crate::error::{Fault, Place};

/// The number of bytes that are looked at.
pub(crate) const HEAD_BYTES: usize = 4096;

const COMPRESSED: &str = "unpack it first";
const NO_MESH: &str = "it holds no mesh of a known format; export the mesh from the program that made it";

/// What a file begins with, what it is, and the remedy. Letters may be in upper or lower case.
const SIGNATURES: &[(&[u8], &str, &str)] = &[
    (
        b"version https://git-lfs.github.com/spec/",
        "a pointer of Git LFS",
        "run \"git lfs pull\" to get the file itself",
    ),
    (
        b"version https://hawser.github.com/spec/",
        "a pointer of Git LFS",
        "run \"git lfs pull\" to get the file itself",
    ),
    (b"<!doctype html", "an HTML page", "download the file itself"),
    (b"<html", "an HTML page", "download the file itself"),
    (b"%PDF-", "a PDF document", NO_MESH),
    (b"\x1f\x8b", "a file packed by gzip", COMPRESSED),
    (b"PK\x03\x04", "a zip archive", COMPRESSED),
    (b"BZh", "a file packed by bzip2", COMPRESSED),
    (b"\xfd7zXZ\0", "a file packed by xz", COMPRESSED),
    (b"\x28\xb5\x2f\xfd", "a file packed by zstd", COMPRESSED),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", COMPRESSED),
    (b"Rar!\x1a\x07", "a RAR archive", COMPRESSED),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture", NO_MESH),
    (b"\xff\xd8\xff", "a JPEG picture", NO_MESH),
    (b"BLENDER", "a Blender file", NO_MESH),
    (b"Kaydara FBX Binary", "an FBX file", NO_MESH),
    (b"ISO-10303-21", "a STEP file", NO_MESH),
    (b"glTF", "binary glTF", "give the name of the file the ending .glb"),
];

/// Returns the fault of a file of `length` bytes that starts with `head`, if that shows that it holds no mesh of `format`, or
/// no mesh at all if the format is not known.
pub(crate) fn misnamed(head: &[u8], length: u64, format: Option<MeshFormat>) -> Option<Fault> {
    let head = &head[..head.len().min(HEAD_BYTES)];
    // The first 80 bytes of a binary STL may hold anything.
    if format == Some(MeshFormat::Stl) && stl::is_exact_binary(head, length) {
        return None;
    }
    let (what, remedy) = found(head, length, format)?;
    let expected = format.map_or(super::KNOWN, MeshFormat::name);
    Some(Fault::new(Place::Byte(0), expected, format!("{what}; {remedy}")))
}

/// Returns what a file is instead, and the remedy.
fn found(head: &[u8], length: u64, format: Option<MeshFormat>) -> Option<(&'static str, &'static str)> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let starts = |text: &[u8], with: &[u8]| {
        text.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with))
    };
    let is_own = |signature: &[u8]| match format {
        Some(MeshFormat::Gltf) => signature == b"glTF",
        // XML may be in UTF-16.
        Some(MeshFormat::Collada) => signature == b"\xff\xfe" || signature == b"\xfe\xff",
        _ => false,
    };
    let mut signatures = SIGNATURES.iter().filter(|(signature, ..)| !is_own(signature));
    if let Some(&(_, what, remedy)) =
        signatures.find(|(signature, ..)| starts(head, signature) || starts(text, signature))
    {
        return Some((what, remedy));
    }
    if starts(text, b"<?xml") || starts(text, b"<COLLADA") {
        if format == Some(MeshFormat::Collada) {
            return None;
        }
        let is_collada = memchr::memmem::find(text, b"<COLLADA").is_some();
        return Some(match is_collada {
            true => ("COLLADA", "give the name of the file the ending .dae"),
            false => ("an XML document", NO_MESH),
        });
    }
    other_format(head, length, format?)
}

/// Returns which other format a file has than its name states.
fn other_format(head: &[u8], length: u64, named: MeshFormat) -> Option<(&'static str, &'static str)> {
    let is_comment = head.starts_with(b"#") && matches!(named, MeshFormat::Obj | MeshFormat::Xyz);
    match MeshFormat::from_head(head, length)? {
        found if found == named => None,
        // In other text, the mark of PCD is a comment.
        MeshFormat::Pcd if is_comment && memchr::memmem::find(head, b"\nFIELDS ").is_none() => None,
        // The header of a binary STL with a rest may be anything, too.
        _ if named == MeshFormat::Stl && head.contains(&0) && !head.starts_with(b"ply") => None,
        MeshFormat::Obj => Some(("OBJ", "give the name of the file the ending .obj")),
        MeshFormat::Stl => Some(("STL", "give the name of the file the ending .stl")),
        MeshFormat::Ply => Some(("PLY", "give the name of the file the ending .ply")),
        MeshFormat::Gltf => Some(("JSON, perhaps of glTF", "give the name of a glTF file the ending .gltf")),
        MeshFormat::Collada => Some(("COLLADA", "give the name of the file the ending .dae")),
        MeshFormat::Pcd => Some(("PCD", "give the name of the file the ending .pcd")),
        MeshFormat::Xyz => unreachable!("XYZ has no mark"),
    }
}
