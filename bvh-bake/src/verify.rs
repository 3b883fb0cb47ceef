//! Verifies a file against the mesh it was baked from: the same triangles, and bounds that contain them.
//!
//! Shares no code with the baker's way from mesh to bytes, so that neither hides a mistake of the other. What it shares
//! is what surrounds that way: the readers of meshes, which give corners as the file has them; scratch files and the
//! sorter; and the checks of finished bytes, which work with the reference decoder of bvh-format.
//!
//! With ids every triangle is matched by its number, and its corners compared in order. Without ids the stored
//! triangles and the mesh's rounded ones are compared as multisets. Either way both are sorted and gone through side by
//! side, so that neither has to be in memory.

mod by_id;
mod by_value;
mod input;

use crate::error::BakeError;
use crate::files::{GLTF_BYTES, format_of};
use crate::gather::Gatherer;
use crate::io::MeshFormat;
use crate::means::Means;
use crate::mesh::{InputError, Mesh};
use crate::progress::Progress;
use crate::prove::{prove_bounds, validate_in_parallel};
use crate::stored::{FileError, StoredFile};
use bvh_format::FormatError;
use bvh_format::Layout;
use bvh_format::bounds::Inflation;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::object::Object;
use bvh_format::source::Source;
use bvh_format::validate::packets;
use input::{InMemory, Input};
use std::path::{Path, PathBuf};

/// What a successful verification found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerifyReport {
    /// Triangles stored, each equal to one of the mesh.
    pub triangles: u64,
    /// Triangles of the mesh that are exact duplicates of stored ones.
    pub duplicates: u64,
    /// Objects of the file.
    pub objects: u64,
    /// True if triangles were looked up by their ids, false if compared as multisets.
    pub by_id: bool,
    /// Largest distance of a mesh's corner from where it is stored, mesh units.
    pub max_move: f64,
    /// How much wider decoded bounds are than the tight ones.
    pub inflation: Inflation,
}

/// Why a file is not a faithful bake of a mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The file itself breaks a rule of the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The mesh breaks the input contract, so that no file can be a bake of it.
    #[error("the mesh: {0}")]
    Mesh(#[from] InputError),
    /// A mesh cannot be read, or what was read of it cannot be kept.
    #[error(transparent)]
    Input(#[from] BakeError),
    /// The file cannot be read, or not in the memory allowed.
    #[error(transparent)]
    File(FileError),
    /// The file is sound, but not this mesh's.
    #[error("{what}: expected {expected}, found {found}")]
    Differs {
        /// Which triangle or number.
        what: String,
        /// What the mesh has.
        expected: String,
        /// What the file has.
        found: String,
    },
}

impl From<FileError> for VerifyError {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Format(error) => Self::Format(error),
            other => Self::File(other),
        }
    }
}

impl VerifyError {
    #[cold]
    fn differs(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Differs { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }
}

/// Verifies that a file is a faithful bake of a mesh: it is valid, every bound contains what is below it,
/// its triangles are the mesh's (those that are not stored are exact duplicates of some that are), and
/// no corner is further from where the mesh has it than the file states.
///
/// Cost: about that of reading the mesh. Memory: 8 bytes a triangle of the mesh; 60 bytes a stored triangle with ids,
/// 40 bytes for each triangle of mesh and file without. [`verify_files`] takes as much as it may.
///
/// # Errors
/// The first thing found that does not hold.
pub fn verify(bytes: &[u8], mesh: &Mesh) -> Result<VerifyReport, VerifyError> {
    mesh.check()?;
    let layout = Layout::read(bytes)?;
    compare(&layout, bytes, || InMemory::new(mesh), &Means::unlimited(&Progress::default()))
}

/// How to go about files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct VerifyOptions {
    /// The most memory that the whole process may have resident, in bytes; `None` for 1.5 GiB. What does not fit goes to
    /// scratch files. glTF files are read into memory, other meshes piece by piece. An allocator that keeps much of what
    /// is freed is to be told not to, as said at [`FileOptions`](crate::FileOptions).
    pub max_memory: Option<u64>,
    /// The directory for scratch files; `None` for the system's for temporary files. They have no names there: nothing
    /// of them is left, however the process ends.
    pub scratch: Option<PathBuf>,
}

/// What `VerifyOptions::max_memory` is if nothing is said.
const USUAL_MEMORY: u64 = 3 << 29;

/// [`verify`] of a file of any size and of the meshes that it was baked from, read piece by piece.
///
/// Cost: reading the meshes once and the file five times, and up to 240 bytes of scratch a triangle, each written and read
/// once or twice.
///
/// # Errors
/// As [`verify`]; [`VerifyError::Input`] if a mesh or scratch file cannot be read or written, [`VerifyError::File`] if the
/// file cannot be read or the memory is too little.
pub fn verify_files(
    path: &Path,
    meshes: &[PathBuf],
    options: &VerifyOptions,
) -> Result<VerifyReport, VerifyError> {
    let budget = options.max_memory.unwrap_or(USUAL_MEMORY);
    let enough = |path: &Path, needed: u64| {
        let path = path.to_owned();
        if needed <= budget { Ok(()) } else { Err(FileError::Memory { path, needed, budget }) }
    };
    enough(path, Means::least_of_check())?;
    let file = StoredFile::open(path, options.max_memory)?;
    let layout = Layout::read_from(&file)?;
    let scratch = options.scratch.clone().unwrap_or_else(std::env::temp_dir);
    let means = Means::of_check(budget, &scratch);
    let mut gatherer = Gatherer::in_sequence(&means);
    for mesh in meshes {
        let (format, length) = format_of(mesh, &means.progress)?;
        if format == MeshFormat::Gltf && options.max_memory.is_some() {
            enough(mesh, length.saturating_mul(GLTF_BYTES).saturating_add(Means::least_of_check()))?;
        }
        gatherer.read(mesh, format)?;
    }
    let sequence = gatherer.into_sequence()?;
    compare(&layout, &file, || Ok(sequence), &means)
}

/// Checks a file, and compares it with a mesh that has been checked.
fn compare<S: Source + ?Sized, I: Input>(
    layout: &Layout,
    source: &S,
    input: impl FnOnce() -> Result<I, VerifyError>,
    means: &Means,
) -> Result<VerifyReport, VerifyError>
where
    VerifyError: From<S::Error>,
{
    validate_in_parallel(source)?;
    let inflation = prove_bounds(layout, source)?;
    let input = input()?;
    match_objects(layout, input.counts())?;
    let all = input.counts().iter().sum();
    for (number, object) in layout.objects.iter().enumerate() {
        let own = if layout.objects.len() == 1 { all } else { input.counts()[number] };
        check_counts(object, own, all)?;
        check_hull(layout, source, object)?;
    }
    let (max_move, duplicates) = if layout.has_ids() {
        by_id::compare(layout, source, &input, means)?
    } else {
        by_value::compare(layout, source, &input, means)?
    };
    Ok(VerifyReport {
        triangles: layout.objects.iter().map(|object| object.record.triangles.get()).sum(),
        duplicates,
        objects: layout.objects.len() as u64,
        by_id: layout.has_ids(),
        max_move,
        inflation,
    })
}

/// A file has one object of all the mesh's, or one of each that has triangles.
fn match_objects(layout: &Layout, full: &[u64]) -> Result<(), VerifyError> {
    match layout.objects.len() {
        1 => Ok(()),
        count if count == full.len() => Ok(()),
        count => Err(VerifyError::differs("objects", format!("1 or {}", full.len()), count)),
    }
}

/// The number of the file's object that an object of the mesh is in, counted among those with triangles.
fn source_of(layout: &Layout, number: u32) -> usize {
    if layout.objects.len() == 1 { 0 } else { number as usize }
}

/// `own` are the triangles that the mesh has for this object, `all` those for all.
fn check_counts(object: &Object, own: u64, all: u64) -> Result<(), VerifyError> {
    let record = &object.record;
    let counts = [
        ("triangles of the input", all, record.input_triangles.get()),
        (
            "triangles stored and duplicates left out",
            own,
            record.triangles.get().saturating_add(record.duplicates.get()),
        ),
    ];
    for (what, expected, found) in counts {
        if expected != found {
            return Err(VerifyError::differs(what, expected, found));
        }
    }
    Ok(())
}

/// Checks that the record's box and sphere contain all corners stored.
fn check_hull<S: Source + ?Sized>(layout: &Layout, source: &S, object: &Object) -> Result<(), VerifyError>
where
    VerifyError: From<S::Error>,
{
    let record = &object.record;
    let axes = [0, 1, 2];
    let (lo, hi) = (axes.map(|a| record.box_lo[a].get()), axes.map(|a| record.box_hi[a].get()));
    let centre = axes.map(|a| f64::from(record.sphere_centre[a].get()));
    let radius = f64::from(record.sphere_radius.get());
    each_triangle(layout, source, object, |triangle| {
        for (corner, v) in triangle.corners.iter().enumerate() {
            let what = || format!("{}, corner {corner}", triangle.name());
            if axes.iter().any(|&a| v[a] < lo[a] || v[a] > hi[a]) {
                return Err(VerifyError::differs(
                    what(),
                    format!("within {lo:?} to {hi:?}"),
                    format!("{v:?}"),
                ));
            }
            let distance = axes.map(|a| (f64::from(v[a]) - centre[a]).powi(2)).iter().sum::<f64>().sqrt();
            if distance > radius {
                let expected = format!("within {radius:e} of {centre:?}");
                return Err(VerifyError::differs(what(), expected, format!("{v:?}, at {distance:e}")));
            }
        }
        Ok(())
    })
}

/// A stored triangle.
struct Stored {
    page: u32,
    packet: u16,
    lane: usize,
    /// Its number in the input, if the file has ids.
    id: Option<u32>,
    /// Around the object's origin.
    corners: [[f32; 3]; 3],
}

impl Stored {
    fn name(&self) -> String {
        match self.id {
            Some(id) => format!("triangle {id}"),
            None => format!("page {}, packet {}, lane {}", self.page, self.packet, self.lane),
        }
    }
}

/// Calls `visit` for every triangle of an object of a validated file, in the order of the leaves.
fn each_triangle<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    mut visit: impl FnMut(&Stored) -> Result<(), VerifyError>,
) -> Result<(), VerifyError>
where
    VerifyError: From<S::Error>,
{
    for number in object.pages() {
        let bytes = layout.read_page(source, number)?;
        let page = bytes.page(object);
        let leaves = layout.read_leaf_block(source, page.header())?;
        let ids = layout.read_id_block(source, page.header())?;
        let (block, ids) = (leaves.bytes(), ids.bytes());
        for (packet, count) in packets(&page) {
            let values = decode_packet(object.triangle_encoding, block, usize::from(packet));
            for lane in 0..count {
                let id = layout.has_ids().then(|| decode_id(ids, usize::from(packet), lane));
                visit(&Stored { page: number, packet, lane, id, corners: values.triangle(lane) })?;
            }
        }
    }
    Ok(())
}

/// A stored vertex in mesh coordinates: exact, by rule 37.
fn place(object: &Object, v: [f32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| object.record.origin[axis].get() + f64::from(v[axis]))
}

/// How far a corner of the mesh may be from where it is stored: both stated errors, with room for the few
/// roundings in their sum and in lengths.
fn tolerance(object: &Object) -> f64 {
    let stated = object.record.max_vertex_rounding.get() + object.record.max_quantization_error.get();
    stated * (1.0 + 2f64.powi(-40))
}

/// The distance of two points, safe from overflow and underflow of squares.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let difference = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    let largest = difference.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * difference.iter().map(|value| (value / largest).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests;
