//! Meshes: opened files, whole or object by object.

use crate::at_hand::MESHES;
use crate::entry::{caller_floats, entry};
use crate::input::{array, path, text};
use crate::output::{self, List, One, Room};
use crate::status::{Failure, Status};
use crate::types::{MAP, MAP_SPARSE, MAP_WHOLE, MeshHandle, READ};
use bvh_query::{Bvh, OpenError, OwnedShape, ReadAhead};
use std::ffi::{c_char, c_void};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Room for the handle of a new mesh, which holds no handle until there is one.
///
/// # Safety
/// As for `One::new`.
pub(crate) unsafe fn new_mesh<'a>(name: &str, out: *mut MeshHandle) -> Result<One<'a, MeshHandle>, Failure> {
    // SAFETY: the caller vouches for it.
    let mut out = unsafe { One::new(name, out) }?;
    out.set(MeshHandle { id: 0 });
    Ok(out)
}

pub(crate) fn hand_out(mut out: One<'_, MeshHandle>, shape: OwnedShape) -> Result<(), Failure> {
    out.set(MeshHandle { id: MESHES.insert(shape)? });
    Ok(())
}

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

/// `cbvh_mesh_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_open(file: *const c_char, mode: i32, mesh: *mut MeshHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let (out, file) = unsafe { (new_mesh("mesh", mesh)?, path("path", file)?) };
        check_regular(&file)?;
        // SAFETY: the header asks that nobody changes a mapped file.
        let map = |read_ahead| unsafe { Bvh::map_with(&file, read_ahead) };
        let opened: Result<Bvh, OpenError> = match mode {
            MAP => map(ReadAhead::Usual),
            MAP_SPARSE => map(ReadAhead::Sparse),
            MAP_WHOLE => map(ReadAhead::Whole),
            READ => Bvh::read(&file),
            _ => return Err(Failure::argument("mode", "a number of cbvh_open_mode, 0 to 3", mode)),
        };
        hand_out(out, opened?.into())
    })
}

/// `cbvh_mesh_from_bytes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_from_bytes(bytes: *const u8, size: usize, mesh: *mut MeshHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let (out, bytes) = unsafe { (new_mesh("mesh", mesh)?, array("bytes", bytes, size)?) };
        hand_out(out, Bvh::from_bytes(bytes.to_vec()).map_err(damaged)?.into())
    })
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

/// `cbvh_mesh_borrow_bytes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_borrow_bytes(
    bytes: *const u8,
    size: usize,
    release: Release,
    user: *mut c_void,
    mesh: *mut MeshHandle,
) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let (out, bytes) = unsafe { (new_mesh("mesh", mesh)?, array("bytes", bytes, size)?) };
        let state = Arc::new(AtomicU8::new(OPENING));
        let borrowed = Borrowed { start: bytes.as_ptr(), size, release, user, state: state.clone() };
        let bvh = Bvh::from_bytes(borrowed).map_err(damaged)?;
        hand_out(out, bvh.into())?;
        // A large file has been copied to large pages by now.
        if state.swap(TAKEN, Ordering::AcqRel) == DROPPED {
            // SAFETY: as in `drop`.
            unsafe { call_release(release, user) };
        }
        Ok(())
    })
}

fn no_object(objects: usize, number: usize) -> Failure {
    Failure::new(Status::NotFound, format!("number: expected a number below {objects}, found {number}"))
}

/// Asks about a mesh.
fn ask(mesh: MeshHandle, ask: impl FnOnce(OwnedShape) -> Result<(), Failure>) -> i32 {
    entry(|| ask(MESHES.share("mesh", mesh.id)?))
}

/// `cbvh_mesh_clone`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_clone(mesh: MeshHandle, other: *mut MeshHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let out = unsafe { new_mesh("other", other) }?;
        hand_out(out, MESHES.share("mesh", mesh.id)?)
    })
}

/// `cbvh_mesh_free`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_mesh_free(mesh: MeshHandle) -> i32 {
    entry(|| if mesh.id == 0 { Ok(()) } else { MESHES.remove("mesh", mesh.id).map(drop) })
}

/// `cbvh_mesh_object`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_object(mesh: MeshHandle, number: usize, object: *mut MeshHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let out = unsafe { new_mesh("object", object) }?;
        let bvh = MESHES.share("mesh", mesh.id)?.bvh().clone();
        let objects = bvh.objects().len();
        let object = OwnedShape::object(bvh, number);
        hand_out(out, object.ok_or_else(|| no_object(objects, number))?)
    })
}

/// `cbvh_mesh_find`.
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

/// `cbvh_mesh_object_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_object_count(mesh: MeshHandle, count: *mut usize) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        unsafe { One::new("count", count) }?.set(shape.bvh().objects().len());
        Ok(())
    })
}

/// `cbvh_mesh_object_name`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_object_name(
    mesh: MeshHandle,
    number: usize,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> i32 {
    ask(mesh, |shape| {
        let objects = shape.bvh().objects();
        let object = objects.get(number).ok_or_else(|| no_object(objects.len(), number))?;
        // SAFETY: the header asks for it.
        unsafe { output::text("buffer", object.name(), buffer, capacity, length) }
    })
}

/// `cbvh_mesh_triangle_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_triangle_count(mesh: MeshHandle, count: *mut u64) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        unsafe { One::new("count", count) }?.set(shape.shape().triangles());
        Ok(())
    })
}

/// `cbvh_mesh_duplicates`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_duplicates(
    mesh: MeshHandle,
    triangle: u32,
    triangles: *mut u32,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        let mut list = unsafe { List::new("triangles", triangles, capacity, count) }?;
        shape.bvh().duplicates_of(triangle)?.for_each(|id| list.push(id));
        list.finish()
    })
}

/// `cbvh_mesh_bytes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_bytes(
    mesh: MeshHandle,
    buffer: *mut u8,
    capacity: usize,
    size: *mut usize,
) -> i32 {
    ask(mesh, |shape| {
        let bytes = shape.bvh().bytes();
        // SAFETY: the header asks for it.
        let (mut size, room) = unsafe { (One::new("size", size)?, Room::new("buffer", buffer, capacity)?) };
        size.set(bytes.len());
        room.fill(&bytes[..bytes.len().min(capacity)]);
        if bytes.len() <= capacity {
            return Ok(());
        }
        let message = format!("buffer: expected room for {} bytes, found room for {capacity}", bytes.len());
        Err(Failure::new(Status::BufferTooSmall, message))
    })
}

/// `cbvh_mesh_save`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_mesh_save(mesh: MeshHandle, file: *const c_char) -> i32 {
    ask(mesh, |shape| {
        // SAFETY: the header asks for it.
        let file = unsafe { path("path", file) }?;
        Ok(bvh_bake::write_atomically(&file, shape.bvh().bytes())?)
    })
}

/// `cbvh_mesh_validate`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_mesh_validate(mesh: MeshHandle) -> i32 {
    ask(mesh, |shape| Ok(shape.bvh().validate()?))
}
