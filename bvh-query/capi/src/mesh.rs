//! Meshes: opened files, whole or object by object, with a radius or solid.

use crate::at_hand::MESHES;
use crate::entry::{about, caller_floats, entry, hand_out};
use crate::input::{self, array, text};
use crate::output::{self, One};
use crate::status::{Failure, Status};
use crate::types::{
    MAP, MAP_SPARSE, MAP_WHOLE, MeshHandle, OPEN_BOUNDARY, OPEN_CROWDED, OPEN_FLIPPED, OpenEdgeRow,
    OpenEdgesRow, READ,
};
use bvh_query::{Bvh, OpenEdge, OpenEdges, OwnedShape, ReadAhead};
use std::ffi::{c_char, c_void};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Refuses what is there and is no regular file: the system would wait for somebody to write to a pipe.
pub(crate) fn check_regular(file: &Path) -> Result<(), Failure> {
    match std::fs::metadata(file) {
        Ok(found) if !found.is_file() && !found.is_dir() => {
            let message = format!("{}: expected a regular file, found another kind", file.display());
            Err(Failure::new(Status::System, message))
        }
        // Opening it says what is wrong.
        _ => Ok(()),
    }
}

fn damaged(error: bvh_query::FormatError) -> Failure {
    Failure::new(Status::Damaged, format!("bytes: {error}"))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_open(path: *const c_char, mode: i32, mesh: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it, and that nobody changes a mapped file.
    unsafe {
        hand_out(("mesh", mesh), &MESHES, || {
            let file = input::path("path", path)?;
            check_regular(&file)?;
            let opened = match mode {
                MAP => Bvh::map_with(&file, ReadAhead::Usual),
                MAP_SPARSE => Bvh::map_with(&file, ReadAhead::Sparse),
                MAP_WHOLE => Bvh::map_with(&file, ReadAhead::Whole),
                READ => Bvh::read(&file),
                _ => return Err(Failure::argument("mode", "a number of cbvh_open_mode, 0 to 3", mode)),
            };
            Ok(opened?.into())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_from_bytes(
    bytes: *const c_void,
    size: usize,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        hand_out(("mesh", mesh), &MESHES, || {
            let bytes = array("bytes", bytes.cast::<u8>(), size)?;
            Ok(Bvh::from_bytes(bytes.to_vec()).map_err(damaged)?.into())
        })
    }
}

/// The function that tells a caller that something of it is no longer used.
pub(crate) type Release = Option<unsafe extern "C" fn(user: *mut c_void)>;

/// Bytes of the caller.
struct Borrowed {
    start: *const u8,
    size: usize,
    release: Release,
    user: *mut c_void,
    /// `OPENING`, until the bytes are `TAKEN` by a handle or `DROPPED`. Whichever of the two comes second sees the
    /// other one, and releases the bytes: a failure to open them releases nothing.
    state: Arc<AtomicU8>,
}

const OPENING: u8 = 0;
const TAKEN: u8 = 1;
const DROPPED: u8 = 2;

// SAFETY: the header asks that the bytes do not change and that `release` may be called on any thread.
unsafe impl Send for Borrowed {}
// SAFETY: as above.
unsafe impl Sync for Borrowed {}

impl AsRef<[u8]> for Borrowed {
    fn as_ref(&self) -> &[u8] {
        // SAFETY: the pointer was checked; the caller keeps the bytes until they are released.
        unsafe { std::slice::from_raw_parts(self.start, self.size) }
    }
}

impl Drop for Borrowed {
    fn drop(&mut self) {
        if self.state.swap(DROPPED, Ordering::AcqRel) == TAKEN {
            // SAFETY: the header asks for a function that may be called here.
            unsafe { call_release(self.release, self.user) };
        }
    }
}

/// Tells a caller that something of it is no longer used.
///
/// # Safety
/// The function may be called, once, with `user`.
pub(crate) unsafe fn call_release(release: Release, user: *mut c_void) {
    if let Some(release) = release {
        // SAFETY: the caller vouches for it, and it is no function of Rust.
        unsafe { caller_floats().run(|| release(user)) };
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_borrow_bytes(
    bytes: *const c_void,
    size: usize,
    release: Option<unsafe extern "C" fn(user: *mut c_void)>,
    user: *mut c_void,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        hand_out(("mesh", mesh), &MESHES, || {
            let start = array("bytes", bytes.cast::<u8>(), size)?.as_ptr();
            let state = Arc::new(AtomicU8::new(OPENING));
            let borrowed = Borrowed { start, size, release, user, state: state.clone() };
            let bvh = Bvh::from_bytes(borrowed).map_err(damaged)?;
            // Nothing can fail after this. A large file has been copied to large pages by now.
            if state.swap(TAKEN, Ordering::AcqRel) == DROPPED {
                call_release(release, user);
            }
            Ok(bvh.into())
        })
    }
}

fn no_object(objects: usize, number: usize) -> Failure {
    Failure::new(Status::NotFound, format!("number: expected a number below {objects}, found {number}"))
}

/// Asks about a mesh.
fn ask(mesh: MeshHandle, ask: impl FnOnce(OwnedShape) -> Result<(), Failure>) -> i32 {
    entry(|| ask(MESHES.share("mesh", mesh.id)?))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_clone(mesh: MeshHandle, other: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { hand_out(("other", other), &MESHES, || MESHES.share("mesh", mesh.id)) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_mesh_free(mesh: MeshHandle) -> i32 {
    entry(|| MESHES.free("mesh", mesh.id))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_object(mesh: MeshHandle, number: usize, object: *mut MeshHandle) -> i32 {
    let found = || {
        let bvh = MESHES.share("mesh", mesh.id)?.bvh().clone();
        let objects = bvh.objects().len();
        OwnedShape::object(bvh, number).ok_or_else(|| no_object(objects, number))
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("object", object), &MESHES, found) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_rounded(mesh: MeshHandle, radius: f64, rounded: *mut MeshHandle) -> i32 {
    let made = || Ok(MESHES.share("mesh", mesh.id)?.rounded(radius)?);
    // SAFETY: the header asks for it.
    unsafe { hand_out(("rounded", rounded), &MESHES, made) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_solid(mesh: MeshHandle, solid: *mut MeshHandle) -> i32 {
    let made = || Ok(MESHES.share("mesh", mesh.id)?.solid()?);
    // SAFETY: the header asks for it.
    unsafe { hand_out(("solid", solid), &MESHES, made) }
}

fn counts_of(edges: &OpenEdges) -> OpenEdgesRow {
    let [boundary, flipped, crowded] = edges.kinds().map(|(_, of_kind)| of_kind.count);
    OpenEdgesRow {
        boundary,
        flipped,
        crowded,
        cracks: edges.gaps.cracks,
        nearest_gap: edges.gaps.nearest.unwrap_or(f64::NAN),
        widest_crack: edges.gaps.widest_crack.unwrap_or(f64::NAN),
        proposed_weld: edges.proposed_weld().unwrap_or(f64::NAN),
    }
}

fn listed(edges: &OpenEdges) -> Vec<OpenEdgeRow> {
    let row = |(kind, edge): (i32, &OpenEdge)| {
        let mut triangles = [0; 4];
        triangles.iter_mut().zip(&edge.triangles).for_each(|(row, triangle)| *row = *triangle);
        OpenEdgeRow {
            ends: edge.ends,
            gap: edge.gap.unwrap_or(f64::NAN),
            object: edge.object,
            kind,
            triangle_count: edge.triangles.len() as u32,
            triangles,
            reserved: 0,
        }
    };
    let kinds = [OPEN_BOUNDARY, OPEN_FLIPPED, OPEN_CROWDED].into_iter().zip(edges.kinds());
    kinds
        .flat_map(|(kind, (_, of_kind))| of_kind.first.iter().map(move |edge| (kind, edge)))
        .map(row)
        .collect()
}

about! {
    mesh: MeshHandle, ask;
    one cbvh_mesh_radius() -> radius: f64 = mesh.shape().radius();
    one cbvh_mesh_max_move() -> max_move: f64 = mesh.shape().max_move();
    one cbvh_mesh_is_solid() -> is_solid: bool = mesh.shape().is_solid();
    one cbvh_mesh_object_count() -> count: usize = mesh.bvh().objects().len();
    one cbvh_mesh_triangle_count() -> count: u64 = mesh.shape().triangles();
    text cbvh_mesh_object_name(number: usize,) = {
        let objects = mesh.bvh().objects();
        objects.get(number).ok_or_else(|| no_object(objects.len(), number))?.name()
    };
    one cbvh_mesh_open_edge_counts() -> counts: OpenEdgesRow = counts_of(&mesh.shape().open_edges()?);
    list cbvh_mesh_open_edges() -> edges: OpenEdgeRow = listed(&mesh.shape().open_edges()?);
    text cbvh_mesh_open_edges_text() = &mesh.shape().open_edges()?.to_string();
    list cbvh_mesh_duplicates(triangle: u32,) -> triangles: u32 = mesh.bvh().duplicates_of(triangle)?;
    change cbvh_mesh_validate() = mesh.bvh().validate()?;
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_find(mesh: MeshHandle, name: *const c_char, number: *mut usize) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        let (name, mut number) = unsafe { (text("name", name)?, One::new("number", number)?) };
        let found = shape.bvh().find(name);
        number.set(found.ok_or_else(|| {
            Failure::new(Status::NotFound, format!("name: expected the name of an object, found {name:?}"))
        })?);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_bytes(
    mesh: MeshHandle,
    buffer: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    ask(mesh, |shape| unsafe { output::bytes(&shape.bytes()?, buffer.cast(), capacity, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_save(mesh: MeshHandle, path: *const c_char) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        let file = unsafe { input::path("path", path) }?;
        Ok(bvh_bake::write_atomically(&file, &shape.bytes()?)?)
    })
}
