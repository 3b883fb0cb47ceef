//! Verifies a file against the mesh it was baked from: the same triangles, and bounds that contain them.
//!
//! The comparison shares no code with the steps from mesh to bytes, so neither can hide a mistake of the other. It
//! shares the code around these steps: the mesh readers, which return corners as the file states them; scratch files
//! and the sorter; and the checks of finished bytes, which use the reference decoder of bvh-format.
//!
//! With ids, every triangle is matched by its number, and its corners are compared in order. Without ids, the stored
//! triangles and the rounded triangles of the mesh are compared as multisets. In both cases the two sides are sorted
//! and then read in step, so that neither must be in memory.

mod by_id;
mod by_value;
mod input;
mod second_reading;
mod surfaces;
mod welded;

use crate::check::prove::{prove_bounds, validate_in_parallel};
use crate::error::BakeError;
use crate::input::InputFile;
use crate::input::gather::Gatherer;
use crate::input::mesh::{InputError, Instance, Mesh};
use crate::progress::Progress;
use crate::storage::resources::Resources;
use crate::storage::stored_file::{FileError, StoredFile};
use bvh_format::FormatError;
use bvh_format::Layout;
use bvh_format::bounds::Inflation;
use bvh_format::ids::decode_id;
use bvh_format::leaf::{PACKET, VertexBlock};
use bvh_format::object::Object;
use bvh_format::source::Source;
use bvh_format::validate::packets;
use input::{InMemory, Input};
use second_reading::SecondReading;
use std::path::{Path, PathBuf};
use surfaces::Surfaces;
use welded::WeldedInput;

/// The figures of a successful verification.
///
/// [`verify`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct VerifyReport {
    /// The number of stored triangles, each of which equals one of the mesh.
    pub triangles: u64,
    /// The number of triangles of the mesh that are exact duplicates of stored ones.
    pub duplicates: u64,
    /// The number of objects in the file.
    pub objects: u64,
    /// Whether triangles were matched by their ids (true) or compared as multisets (false).
    pub by_id: bool,
    /// The largest distance between a corner of the mesh and the place where it is stored, in mesh units. For a welded file, the
    /// largest move of the weld plus the largest move after it. A move to the nearest multiple of 2^-180 does not count.
    pub max_move: f64,
    /// How much wider decoded bounds are than the tight ones.
    pub inflation: Inflation,
}

/// The reason why a file is not a faithful bake of a mesh.
///
/// [`verify`] has an example.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The file itself breaks a rule of the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The mesh breaks the input contract, so that no file can be a bake of it.
    #[error("the mesh: {0}")]
    Mesh(#[from] InputError),
    /// A mesh cannot be read, or the triangles that were read cannot be kept.
    #[error(transparent)]
    Input(#[from] BakeError),
    /// The file cannot be read, or it needs more memory than allowed.
    #[error(transparent)]
    File(FileError),
    /// The file is valid, but it is not a bake of this mesh.
    #[error("{what}: expected {expected}, found {found}")]
    Differs {
        /// The triangle or number that differs.
        what: String,
        /// The value that the mesh requires.
        expected: String,
        /// The value in the file.
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

/// Verifies that a file is a faithful bake of a mesh:
///
/// - the file is valid, and every bound contains what is below it;
/// - the triangles are those of the mesh, and any that are not stored are exact duplicates of stored ones;
/// - no corner has moved farther than the file states, and each went where a weld takes it if the file's provenance states one;
/// - the file states correctly which surfaces of the mesh are closed;
/// - the instances are those of the mesh.
///
/// Cost: about that of reading the mesh. Memory: 104 bytes per triangle of the mesh; in addition, 64 bytes per stored
/// triangle with ids, or 48 bytes per triangle of mesh and file without ids. [`verify_files`] accepts a memory limit.
///
/// ```
/// use bvh_bake::{Options, VerifyError, VerifyReport, shapes, to_bytes, verify};
///
/// let block = shapes::block([2.0, 2.0, 2.0])?;
/// let (bytes, _) = to_bytes(&block, &Options::default())?;
/// let VerifyReport { triangles, by_id, max_move, .. } = verify(&bytes, &block)?;
/// assert_eq!((triangles, by_id, max_move), (12, true, 0.0));
///
/// let other = shapes::block([2.0, 2.0, 3.0])?;
/// assert!(matches!(verify(&bytes, &other), Err(VerifyError::Differs { .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Returns the first difference or broken rule that was found.
pub fn verify(bytes: &[u8], mesh: &Mesh) -> Result<VerifyReport, VerifyError> {
    mesh.check()?;
    let layout = Layout::read(bytes)?;
    let file = File { layout: &layout, source: bytes };
    file.compare(|| InMemory::new(mesh), &Resources::unlimited(&Progress::default()))
}

/// Options of [`verify_files`].
///
/// ```
/// use bvh_bake::{FileBake, VerifyOptions, verify_files};
///
/// # let folder = std::env::temp_dir().join(format!("cbvh-verify-options-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # let output = folder.join("robot.cbvh");
/// # let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/fclrob.obj");
/// FileBake::new([mesh], &output).run()?;
/// let options = VerifyOptions::default().max_memory(256 << 20);
/// let report = verify_files(&output, &[mesh.into()], &options)?;
/// assert_eq!(report.triangles, 216);
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct VerifyOptions {
    /// The most memory that the whole process may have resident, in bytes; `None` for 1.5 GiB. Data that do not fit go
    /// to scratch files. Of the meshes, only COLLADA files, the JSON of glTF files, and files that are not regular are read into memory
    /// as a whole. If the allocator keeps much of the freed memory, tell it not to; see
    /// [`FileBake::max_memory`](crate::FileBake::max_memory).
    pub max_memory: Option<u64>,
    /// The directory for scratch files; `None` for the system's directory for temporary files. Scratch files have no
    /// names there, so that nothing is left however the process ends.
    pub scratch: Option<PathBuf>,
    /// Whether a glTF file may name buffers outside its own folder; see
    /// [`FileBake::allow_outside`](crate::FileBake::allow_outside).
    pub allow_outside: bool,
}

impl VerifyOptions {
    /// Sets the most memory that the whole process may have resident, in bytes; `None` for 1.5 GiB.
    #[must_use]
    pub fn max_memory(self, bytes: impl Into<Option<u64>>) -> Self {
        Self { max_memory: bytes.into(), ..self }
    }

    /// Sets whether a glTF file may name buffers outside its own folder.
    #[must_use]
    pub fn allow_outside(self, allow: bool) -> Self {
        Self { allow_outside: allow, ..self }
    }

    /// Sets the directory for scratch files; `None` for the system's directory for temporary files.
    #[must_use]
    pub fn scratch(self, directory: impl Into<Option<PathBuf>>) -> Self {
        Self { scratch: directory.into(), ..self }
    }
}

/// The bytes of memory for a process whose caller gives no `VerifyOptions::max_memory`.
const USUAL_MEMORY: u64 = 3 << 29;

/// Verifies a file of any size like [`verify`]. The file and the meshes are read piece by piece. If the file is a scene, the
/// meshes are read as scenes.
///
/// OBJ files of up to a 32nd of the memory are read a second time, with the parser of the crate `tobj`, and both
/// readings must agree. The first reading uses the readers of the bake, and so would share their mistakes. Files that
/// `tobj` is known to read differently are read once.
///
/// Cost: reading the meshes once and the file five times, and up to 350 bytes of scratch per triangle, which are
/// written and read once or twice.
///
/// # Errors
/// The errors of [`verify`]; [`VerifyError::Input`] if a mesh or scratch file cannot be read or written; and
/// [`VerifyError::File`] if the file cannot be read or the memory limit is too low.
pub fn verify_files(
    path: &Path,
    meshes: &[PathBuf],
    options: &VerifyOptions,
) -> Result<VerifyReport, VerifyError> {
    let budget = options.max_memory.unwrap_or(USUAL_MEMORY);
    let needed = Resources::least_of_check();
    if needed > budget {
        return Err(FileError::Memory { path: path.to_owned(), needed, budget }.into());
    }
    let file = StoredFile::open(path, options.max_memory)?;
    let layout = Layout::read_from(&file)?;
    // WASI has no directory for temporary files, and asking for it would panic.
    let usual = || if cfg!(target_family = "wasm") { PathBuf::from(".") } else { std::env::temp_dir() };
    let scratch = options.scratch.clone().unwrap_or_else(usual);
    let resources = Resources::of_check(budget, &scratch);
    let mut gatherer = Gatherer::in_input_order(&resources);
    let (mut inputs, mut taken) = (Vec::new(), 0);
    for mesh in meshes {
        let input = InputFile::find(mesh, resources.document.less(taken), &resources.progress)
            .map_err(|halt| halt.in_file(mesh))?;
        // A bake has refused points without a position, or left them out.
        let input = input.drop_nan(true);
        let input = input.for_scene(layout.has_instances()).allow_outside(options.allow_outside);
        taken += input.bytes_in_memory();
        gatherer.read(&input)?;
        inputs.push(input);
    }
    let triangles = gatherer.into_input_order()?;
    if let Some(second) = SecondReading::of(&inputs, budget / 4) {
        second.compare(&triangles)?;
    }
    drop(inputs);
    File { layout: &layout, source: &file }.compare(|| Ok(triangles), &resources)
}

/// The file that is compared.
struct File<'a, S: ?Sized> {
    layout: &'a Layout,
    source: &'a S,
}

impl<S: Source + ?Sized> File<'_, S>
where
    VerifyError: From<S::Error>,
{
    /// Checks a file, and compares it with a mesh that has been checked.
    fn compare<I: Input>(
        &self,
        input: impl FnOnce() -> Result<I, VerifyError>,
        resources: &Resources,
    ) -> Result<VerifyReport, VerifyError> {
        let Self { layout, source } = *self;
        validate_in_parallel(source)?;
        let inflation = prove_bounds(layout, source)?;
        let input = input()?;
        match_objects(layout, input.counts())?;
        self.match_instances(&input.instances())?;
        let all = input.counts().iter().sum();
        for (number, object) in layout.objects.iter().enumerate() {
            let own = if layout.objects.len() == 1 { all } else { input.counts()[number] };
            check_counts(object, own, all)?;
            self.check_hull(object)?;
        }
        let (max_move, duplicates) = match welded::stated(layout, source)? {
            (_, 0.0) => self.compare_triangles(&input, resources)?,
            stated => {
                let welded = WeldedInput::new(&input, stated, layout, resources)?;
                let (max_move, duplicates) = self.compare_triangles(&welded, resources)?;
                (welded.moved + max_move, duplicates)
            }
        };
        Ok(VerifyReport {
            triangles: layout.objects.iter().map(|object| object.triangles()).sum(),
            duplicates,
            objects: layout.objects.len() as u64,
            by_id: layout.has_ids(),
            max_move,
            inflation,
        })
    }

    /// Compares the triangles of a file and a mesh, and what the file states about surfaces. Returns the largest move of a corner, and
    /// the number of duplicates.
    fn compare_triangles(
        &self,
        input: &impl Input,
        resources: &Resources,
    ) -> Result<(f64, u64), VerifyError> {
        let mut surfaces = Surfaces::new(self.layout, self.source, resources)?;
        let compared = if self.layout.has_ids() {
            self.compare_by_id(input, &mut surfaces, resources)?
        } else {
            self.compare_by_value(input, &mut surfaces, resources)?
        };
        surfaces.compare(self.source)?;
        Ok(compared)
    }

    /// Checks that a file has the instances of the mesh, in their order.
    fn match_instances(&self, expected: &[Instance]) -> Result<(), VerifyError> {
        let found = self.layout.read_instances(self.source)?;
        if found.len() != expected.len() {
            return Err(VerifyError::differs("instances", expected.len(), found.len()));
        }
        match (0..).zip(expected.iter().zip(&found)).find(|(_, (expected, found))| expected != found) {
            Some((number, (expected, found))) => {
                let (what, expected, found) = difference(expected, found);
                Err(VerifyError::differs(format!("{what} of instance {number}"), expected, found))
            }
            None => Ok(()),
        }
    }

    /// Checks that the record's box and sphere contain all corners stored.
    fn check_hull(&self, object: &Object) -> Result<(), VerifyError> {
        let (record, origin) = (object.record(), object.origin());
        let axes = [0, 1, 2];
        let (lo, hi) = (axes.map(|a| record.box_lo[a].get()), axes.map(|a| record.box_hi[a].get()));
        let centre = axes.map(|a| f64::from(record.sphere_centre[a].get()));
        let radius = f64::from(record.sphere_radius.get());
        self.each_triangle(object, |triangle| {
            for (corner, vertex) in triangle.corners.iter().enumerate() {
                // Rounded to nearest, as the ends of the box are: the order stays.
                let v = axes.map(|a| vertex[a] - origin[a]);
                let what = || format!("{}, corner {corner}", triangle.name());
                if axes.iter().any(|&a| v[a] < lo[a].into() || v[a] > hi[a].into()) {
                    return Err(VerifyError::differs(
                        what(),
                        format!("within {lo:?} to {hi:?}"),
                        format!("{v:?}"),
                    ));
                }
                let distance = axes.map(|a| (v[a] - centre[a]).powi(2)).iter().sum::<f64>().sqrt();
                if distance > radius {
                    let expected = format!("within {radius:e} of {centre:?}");
                    return Err(VerifyError::differs(what(), expected, format!("{v:?}, at {distance:e}")));
                }
            }
            Ok(())
        })
    }

    /// Calls `visit` for every triangle of an object of a validated file, in the order of the leaves.
    fn each_triangle(
        &self,
        object: &Object,
        mut visit: impl FnMut(&Stored) -> Result<(), VerifyError>,
    ) -> Result<(), VerifyError> {
        let Self { layout, source } = *self;
        for number in object.pages() {
            let bytes = layout.read_page(source, number)?;
            let page = bytes.page(object);
            let leaves = layout.read_leaf_block(source, page.header())?;
            let ids = layout.read_id_block(source, page.header())?;
            let (block, ids) = (leaves.bytes(), ids.bytes());
            let number_of_packets = page.header().packets.get().into();
            let vertices =
                VertexBlock::new(object.triangle_encoding(), object.vertices(), block, number_of_packets);
            for (packet, count) in packets(&page) {
                let first = PACKET as u32 * (page.header().first_packet.get() + u32::from(packet));
                for lane in 0..count {
                    let id = layout.has_ids().then(|| decode_id(ids, usize::from(packet), lane));
                    let (place, corners) = (first + lane as u32, vertices.triangle(packet.into(), lane));
                    visit(&Stored { place, page: number, packet, lane, id, corners })?;
                }
            }
        }
        Ok(())
    }
}

/// Checks that a file has one object for the whole mesh, or one for each object of the mesh that has triangles.
fn match_objects(layout: &Layout, full: &[u64]) -> Result<(), VerifyError> {
    match layout.objects.len() {
        1 if !layout.has_instances() => Ok(()),
        count if count == full.len() => Ok(()),
        count if layout.has_instances() => Err(VerifyError::differs("objects", full.len(), count)),
        count => Err(VerifyError::differs("objects", format!("1 or {}", full.len()), count)),
    }
}

/// Returns the first field in which two instances differ, and its values.
fn difference(expected: &Instance, found: &Instance) -> (&'static str, String, String) {
    let of = |instance: &Instance| {
        let Instance { name, object, member, meets, solid, margin, rotation, translation } = instance;
        [
            ("name", format!("{name:?}")),
            ("object", object.to_string()),
            ("groups", format!("{member:#x}, meets {meets:#x}")),
            ("margin", format!("{margin:?}, {}", if *solid { "solid" } else { "not solid" })),
            ("rotation", format!("{rotation:?}")),
            ("translation", format!("{translation:?}")),
        ]
    };
    let mut fields = of(expected).into_iter().zip(of(found));
    let differing = fields.find(|((_, expected), (_, found))| expected != found);
    differing.map_or(("pose", String::new(), String::new()), |((what, expected), (_, found))| {
        (what, expected, found)
    })
}

/// Returns the number of the file's object for an object of the mesh, counted among those with triangles.
fn source_of(layout: &Layout, number: u32) -> usize {
    if layout.objects.len() == 1 { 0 } else { number as usize }
}

/// Checks an object's counts. `own` is the number of triangles that the mesh has for this object, and `all` the number
/// for all objects.
fn check_counts(object: &Object, own: u64, all: u64) -> Result<(), VerifyError> {
    let record = object.record();
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

/// A stored triangle.
struct Stored {
    /// Its place in the object.
    place: u32,
    page: u32,
    packet: u16,
    lane: usize,
    /// Its number in the input, if the file has ids.
    id: Option<u32>,
    /// The vertices, in mesh units.
    corners: [[f64; 3]; 3],
}

impl Stored {
    fn name(&self) -> String {
        match self.id {
            Some(id) => format!("triangle {id}"),
            None => format!("page {}, packet {}, lane {}", self.page, self.packet, self.lane),
        }
    }
}

/// Returns the largest distance that a corner of the mesh may have from its stored place: both stated errors, plus room
/// for the few roundings in their sum and in lengths.
fn tolerance(object: &Object) -> f64 {
    let stated = object.record().max_vertex_rounding.get() + object.record().max_quantization_error.get();
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
