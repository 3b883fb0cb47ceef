//! Bakes meshes: arrays into memory, and files into files of any size.

use crate::cores;
use crate::entry::entry;
use crate::input::{array, flag, optional_text, options, path, rows_of_three};
use crate::mesh::{hand_out, new_mesh};
use crate::output::One;
use crate::status::Failure;
use crate::types::{BakeChoices, MeshHandle};
use bvh_bake::{Effort, FileBake, Options, Outcome, Profile, TriangleEncoding, to_bytes};
use bvh_query::Bvh;
use std::ffi::c_char;
use std::path::PathBuf;

/// What the options say, checked.
struct Choices {
    options: Options,
    scratch: Option<PathBuf>,
    max_memory: Option<u64>,
    force: bool,
}

/// Refuses a name that no choice has.
fn named<T>(
    option: &str,
    name: Option<&str>,
    known: &[&str],
    find: impl Fn(&str) -> Option<T>,
) -> Result<Option<T>, Failure> {
    let unknown = |name: &str| {
        let expected = format!("NULL or one of {}", known.join(", "));
        Failure::argument(format_args!("options.{option}"), expected, format_args!("{name:?}"))
    };
    name.map(|name| find(name).ok_or_else(|| unknown(name))).transpose()
}

/// Reads the options of a bake.
///
/// # Safety
/// As for `options`; its text ends with zero bytes.
unsafe fn choices(pointer: *const BakeChoices) -> Result<Choices, Failure> {
    // SAFETY: the caller vouches for it.
    let given = unsafe { options("options", pointer) }?;
    // SAFETY: as above.
    let text = |name: &str, text: *const c_char| unsafe { optional_text(name, text) };
    let encodings = TriangleEncoding::ALL;
    let profile = text("options.profile", given.profile)?;
    let triangles = text("options.triangles", given.triangles)?;
    let effort = text("options.effort", given.effort)?;
    let of_name = |name: &str| encodings.into_iter().find(|encoding| encoding.name() == name);
    let max_error = if given.max_error == 0.0 { None } else { Some(given.max_error) };
    if let Some(found) = max_error
        && !(found.is_finite() && found > 0.0)
    {
        return Err(Failure::argument("options.max_error", "0 or a finite length above 0", found));
    }
    let options = Options::default()
        .profile(named("profile", profile, &Profile::ALL.map(Profile::name), Profile::from_name)?)
        .triangles(named("triangles", triangles, &encodings.map(TriangleEncoding::name), of_name)?)
        .effort(
            named("effort", effort, &Effort::ALL.map(Effort::name), Effort::from_name)?.unwrap_or_default(),
        )
        .max_error(max_error)
        .split_objects(flag("options.split_objects", given.split_objects)?)
        .scene(flag("options.scene", given.scene)?)
        .ids(!flag("options.no_ids", given.no_ids)?)
        .turning_slabs(!flag("options.no_turning_slabs", given.no_turning_slabs)?)
        .topology(!flag("options.no_topology", given.no_topology)?);
    let scratch = if given.scratch.is_null() {
        None
    } else {
        // SAFETY: as above.
        Some(unsafe { path("options.scratch", given.scratch) }?)
    };
    let max_memory = Some(given.max_memory).filter(|&bytes| bytes > 0);
    Ok(Choices { options, scratch, max_memory, force: flag("options.force", given.force)? })
}

/// `cbvh_bake`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake(
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    options: *const BakeChoices,
    mesh: *mut MeshHandle,
) -> i32 {
    entry(|| {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        // SAFETY: the header asks for it.
        let (out, choices) = unsafe {
            let out = new_mesh("mesh", mesh)?;
            rows_of_three("vertices", vertices, vertex_count, &mut positions)?;
            rows_of_three("faces", faces, face_count, &mut triangles)?;
            (out, choices(options)?)
        };
        for (name, is_set) in [
            ("scene", choices.options.scene),
            ("max_memory", choices.max_memory.is_some()),
            ("scratch", choices.scratch.is_some()),
            ("force", choices.force),
        ] {
            if is_set {
                let name = format_args!("options.{name}");
                return Err(Failure::argument(name, "nothing, as arrays are baked in memory", "a value"));
            }
        }
        let source = bvh_bake::mesh::Mesh::from_triangles(positions, triangles);
        let (bytes, _) = cores::work(|| Ok(to_bytes(&source, &choices.options)?))?;
        drop(source);
        let opened = Bvh::from_bytes(bytes);
        hand_out(out, opened.map_err(|error| Failure::from(bvh_bake::BakeError::from(error)))?.into())
    })
}

/// `cbvh_bake_files`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_files(
    inputs: *const *const c_char,
    input_count: usize,
    output: *const c_char,
    options: *const BakeChoices,
    was_up_to_date: *mut i32,
) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it; pointers are numbers until they are followed.
        let addresses = unsafe { array("inputs", inputs.cast::<Address>(), input_count) }?;
        if addresses.is_empty() {
            return Err(Failure::argument("inputs", "at least one path", "none"));
        }
        // SAFETY: as above.
        let read =
            |(number, input): (usize, &Address)| unsafe { path(&format!("inputs[{number}]"), input.0) };
        let inputs: Vec<PathBuf> = addresses.iter().enumerate().map(read).collect::<Result<_, _>>()?;
        // SAFETY: as above.
        let (output, choices) = unsafe { (path("output", output)?, choices(options)?) };
        let up_to_date = if was_up_to_date.is_null() {
            None
        } else {
            // SAFETY: as above.
            Some(unsafe { One::new("was_up_to_date", was_up_to_date) }?)
        };
        let outcome = cores::work(|| {
            let bake = FileBake::new(inputs, output).options(choices.options);
            let bake = bake.max_memory(choices.max_memory).scratch(choices.scratch).force(choices.force);
            Ok(bake.run()?)
        })?;
        if let Some(mut out) = up_to_date {
            out.set(i32::from(matches!(outcome, Outcome::UpToDate(_))));
        }
        Ok(())
    })
}

/// The address of a text.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Address(*const c_char);
// SAFETY: a pointer is a number until it is followed.
unsafe impl crate::input::Plain for Address {}
