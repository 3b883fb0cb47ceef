//! Simple shapes, baked in memory: cores, which `cbvh_mesh_rounded` and `cbvh_mesh_solid` make balls, capsules and solids of.

use crate::at_hand::MESHES;
use crate::bake::in_memory;
use crate::entry::hand_out;
use crate::input::{Plain, each, optional, value};
use crate::output::One;
use crate::status::Failure;
use crate::types::MeshHandle;
use bvh_bake::mesh::Mesh;
use bvh_bake::shapes::{self, Circumscribed, OctreeCell};
use bvh_bake::{Options, ShapeError};

/// Reads the arguments of a core, bakes what `core` makes of them, and hands it out.
///
/// # Safety
/// As for `hand_out`.
unsafe fn bake<T: Send>(
    mesh: *mut MeshHandle,
    arguments: impl FnOnce() -> Result<T, Failure>,
    core: impl FnOnce(T) -> Result<Mesh, ShapeError> + Send,
) -> i32 {
    let baked = || {
        let arguments = arguments()?;
        in_memory(&Options::default(), || Ok(core(arguments)?))
    };
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, baked) }
}

/// Bakes a polyhedron around a round shape, and writes how far it reaches beyond that, if anybody wants to know.
///
/// # Safety
/// As for `hand_out`, and for `One::new` unless `error` is null.
unsafe fn bake_around(
    mesh: *mut MeshHandle,
    error: *mut f64,
    around: impl FnOnce() -> Result<Circumscribed, ShapeError> + Send,
) -> i32 {
    let baked = || {
        // SAFETY: the caller vouches for it.
        let out = optional(error, |_| unsafe { One::new("error", error) })?;
        let mut found = f64::NONE;
        let made = in_memory(&Options::default(), || {
            let around = around()?;
            found = around.error;
            Ok(around.mesh)
        })?;
        if let Some(mut out) = out {
            out.set(found);
        }
        Ok(made)
    };
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, baked) }
}

/// Copies an array of `count` groups of numbers, such as points.
///
/// # Safety
/// If the pointer is aligned and not null, as many numbers are there.
unsafe fn groups<T: Plain, const N: usize>(
    name: &str,
    numbers: *const T,
    count: usize,
) -> Result<Vec<[T; N]>, Failure> {
    let mut copied = Vec::new();
    // SAFETY: the caller vouches for it; values in an array are aligned as one is.
    unsafe { each(name, numbers.cast(), count, &mut copied, |of: &[T; N]| Ok(*of)) }?;
    Ok(copied)
}

/// Reads one group of numbers.
///
/// # Safety
/// As for `groups`, for one group.
unsafe fn group<const N: usize>(name: &str, numbers: *const f64) -> Result<[f64; N], Failure> {
    // SAFETY: the caller vouches for it; values in an array are aligned as one is.
    unsafe { value(name, numbers.cast()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_cloud(points: *const f64, count: usize, mesh: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, || groups("points", points, count), |points| Ok(shapes::cloud(&points))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_segment(from: *const f64, to: *const f64, mesh: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        bake(
            mesh,
            || Ok((group("from", from)?, group("to", to)?)),
            |(from, to)| Ok(shapes::segment(from, to)),
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_box(sides: *const f64, mesh: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, || group("sides", sides), shapes::block) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_ground(sides: *const f64, thickness: f64, mesh: *mut MeshHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, || group("sides", sides), |sides| shapes::ground(sides, thickness)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_cylinder(
    radius: f64,
    length: f64,
    max_error: f64,
    error: *mut f64,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake_around(mesh, error, || shapes::cylinder(radius, length, max_error)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_cone(
    radius: f64,
    height: f64,
    max_error: f64,
    error: *mut f64,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake_around(mesh, error, || shapes::cone(radius, height, max_error)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_height_field(
    heights: *const f64,
    columns: usize,
    rows: usize,
    cell: *const f64,
    mesh: *mut MeshHandle,
) -> i32 {
    // A product beyond all numbers is more than any array has, and refused as such.
    let count = columns.saturating_mul(rows);
    // SAFETY: the header asks for it.
    let read = || unsafe {
        let mut copied = Vec::new();
        each("heights", heights, count, &mut copied, |height| Ok(*height))?;
        Ok((copied, group("cell", cell)?))
    };
    let field = |(heights, cell): (Vec<f64>, _)| shapes::height_field(columns, &heights, cell);
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, read, field) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_voxels(
    cells: *const i32,
    count: usize,
    side: f64,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, || groups("cells", cells, count), |cells| shapes::voxels(&cells, side)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_octree(
    cells: *const i32,
    sizes: *const u32,
    count: usize,
    side: f64,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    let read = || unsafe {
        let corners: Vec<[i32; 3]> = groups("cells", cells, count)?;
        let mut read = Vec::new();
        each("sizes", sizes, count, &mut read, |size| Ok(*size))?;
        Ok(corners.into_iter().zip(read).map(|(corner, size)| OctreeCell { corner, size }).collect())
    };
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, read, |cells: Vec<OctreeCell>| shapes::octree(&cells, side)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_convex_hull(
    points: *const f64,
    count: usize,
    mesh: *mut MeshHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { bake(mesh, || groups("points", points, count), |points| shapes::convex_hull(&points)) }
}
