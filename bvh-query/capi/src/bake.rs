//! Bakes meshes: arrays into memory, and files into files of any size.

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::{entry, hand_out};
use crate::input::{each, flag, optional, options, path, pointers, text};
use crate::output::{self, One};
use crate::status::{Failure, Status};
use crate::stops;
use crate::types::{BakeChoices, MeshHandle};
use bvh_bake::mesh::Mesh;
use bvh_bake::{
    BakeError, Effort, FileBake, MAX_RADIUS, Options, Outcome, Profile, Rounding, TriangleEncoding, to_bytes,
};
use bvh_query::{Bvh, OwnedShape};
use std::cell::RefCell;
use std::ffi::c_char;
use std::path::PathBuf;

thread_local! {
    /// The warnings of the last bake of files on this thread.
    static WARNINGS: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// What the options say, checked.
struct Choices {
    options: Options,
    scratch: Option<PathBuf>,
    max_memory: Option<u64>,
    force: bool,
    allow_outside: bool,
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
    let text = |name: &str, of: *const c_char| optional(of, |of| unsafe { text(name, of) });
    let encodings = TriangleEncoding::ALL;
    let profile = text("options.profile", given.profile)?;
    let triangles = text("options.triangles", given.triangles)?;
    let effort = text("options.effort", given.effort)?;
    let round = text("options.round", given.round)?;
    let of_name = |name: &str| encodings.into_iter().find(|encoding| encoding.name() == name);
    let max_error = if given.max_error == 0.0 { None } else { Some(given.max_error) };
    if let Some(found) = max_error
        && !(found.is_finite() && found > 0.0)
    {
        return Err(Failure::argument("options.max_error", "0 or a finite length above 0", found));
    }
    if !(0.0..=MAX_RADIUS).contains(&given.radius) {
        return Err(Failure::argument("options.radius", "a length from 0 to 2^118", given.radius));
    }
    if !(given.weld.is_finite() && given.weld >= 0.0) {
        return Err(Failure::argument("options.weld", "0 or a finite length above 0", given.weld));
    }
    let options = Options::default()
        .weld(given.weld)
        .profile(named("profile", profile, &Profile::ALL.map(Profile::name), Profile::from_name)?)
        .triangles(named("triangles", triangles, &encodings.map(TriangleEncoding::name), of_name)?)
        .effort(
            named("effort", effort, &Effort::ALL.map(Effort::name), Effort::from_name)?.unwrap_or_default(),
        )
        .max_error(max_error)
        .round(
            named("round", round, &Rounding::ALL.map(Rounding::name), Rounding::from_name)?
                .unwrap_or_default(),
        )
        .split_objects(flag("options.split_objects", given.split_objects)?)
        .scene(flag("options.scene", given.scene)?)
        .ids(!flag("options.no_ids", given.no_ids)?)
        .topology(!flag("options.no_topology", given.no_topology)?)
        .solid(flag("options.solid", given.solid)?)
        .drop_nan(flag("options.drop_nan", given.drop_nan)?)
        .radius(given.radius)
        .stop(stops::in_argument("options.stop", given.stop)?);
    // SAFETY: as above.
    let scratch = optional(given.scratch, |folder| unsafe { path("options.scratch", folder) })?;
    let max_memory = Some(given.max_memory).filter(|&bytes| bytes > 0);
    let force = flag("options.force", given.force)?;
    let allow_outside = flag("options.allow_outside", given.allow_outside)?;
    Ok(Choices { options, scratch, max_memory, force, allow_outside })
}

/// Makes triangles and bakes them in memory.
pub(crate) fn in_memory(
    options: &Options,
    triangles: impl FnOnce() -> Result<Mesh, Failure> + Send,
) -> Result<OwnedShape, Failure> {
    let (bytes, _) = cores::work(|| Ok(to_bytes(&triangles()?, options)?))?;
    Ok(Bvh::from_bytes(bytes).map_err(BakeError::from)?.into())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake(
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    options: *const BakeChoices,
    mesh: *mut MeshHandle,
) -> i32 {
    let baked = || {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        // SAFETY: the header asks for it; three values in an array are aligned as one is.
        let choices = unsafe {
            each("vertices", vertices.cast(), vertex_count, &mut positions, |of: &[f64; 3]| Ok(*of))?;
            each("faces", faces.cast(), face_count, &mut triangles, |of: &[u32; 3]| Ok(*of))?;
            choices(options)?
        };
        for (name, is_set) in [
            ("scene", choices.options.scene),
            ("drop_nan", choices.options.drop_nan),
            ("max_memory", choices.max_memory.is_some()),
            ("scratch", choices.scratch.is_some()),
            ("force", choices.force),
            ("allow_outside", choices.allow_outside),
        ] {
            if is_set {
                let name = format_args!("options.{name}");
                return Err(Failure::argument(name, "nothing, as arrays are baked in memory", "a value"));
            }
        }
        in_memory(&choices.options, || Ok(Mesh::from_triangles(positions, triangles)))
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, baked) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_files(
    inputs: *const *const c_char,
    input_count: usize,
    output: *const c_char,
    options: *const BakeChoices,
    was_up_to_date: *mut i32,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let inputs = pointers("inputs", inputs, input_count, |name, of| path(name, of))?;
        if inputs.is_empty() {
            return Err(Failure::argument("inputs", "at least one path", "none"));
        }
        let (output, choices) = (path("output", output)?, choices(options)?);
        WARNINGS.take();
        let up_to_date = optional(was_up_to_date, |_| One::new("was_up_to_date", was_up_to_date))?;
        let outcome = cores::work(|| {
            let bake = FileBake::new(inputs, output).options(choices.options);
            let bake = bake.max_memory(choices.max_memory).scratch(choices.scratch).force(choices.force);
            Ok(bake.allow_outside(choices.allow_outside).run()?)
        })?;
        if let Some(mut out) = up_to_date {
            out.set(i32::from(matches!(outcome, Outcome::UpToDate(_))));
        }
        if let Outcome::Baked(report) = outcome {
            WARNINGS.set(report.warnings);
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_bake_warning(
    number: usize,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> i32 {
    let write = |warnings: &RefCell<Vec<String>>| {
        let warnings = warnings.borrow();
        let none = || {
            let expected = format!("expected a warning of the last bake, found the number {number}");
            Failure::new(Status::NotFound, expected)
        };
        // SAFETY: the header asks for it.
        unsafe { output::text(warnings.get(number).ok_or_else(none)?, buffer, capacity, length) }
    };
    entry(|| WARNINGS.with(write))
}
