//! Reads Wavefront OBJ with `tobj`, behind a filter that hands it nothing but clean statements.
//!
//! `tobj` parses, and rounds every decimal to the nearest f64; but it names no line in an error, wraps
//! indices that are out of range, fails on a face that comes before its vertices when another object follows,
//! takes a fourth number of a vertex for a divisor, and cuts polygons into fans. So the filter (`clean`)
//! reads each line first, reports what is wrong by line, and passes on all vertices and then all faces, with
//! position numbers only; what comes back is triangulated here.
//!
//! Accepted: any line ending, a byte order mark, `\` at the end of a `v` or `f` line, faces before their
//! vertices, numbers counted back from the face (negative), missing texture coordinates and normals,
//! statements that say nothing about triangles. A vertex beyond f64 or the format, or `nan`, is an error when
//! a face uses it. Objects are named by `o`, or by `g` where the file has no `o`; all faces under one name
//! are one object.

mod clean;
mod stream;

pub(crate) use stream::{Statements, misfit, stream};

use super::error::{Fault, Place};
use super::{Relay, next_ids, polygon};
use crate::mesh::{Mesh, Object};
use crate::progress::Tally;
use clean::Cleaner;
use std::io::BufRead;
use std::thread;

/// Bytes of a file that is filtered on a thread beside the one that parses.
const LARGE: usize = 1 << 20;

fn parse(clean: &mut impl BufRead) -> tobj::LoadResult {
    // No option is set: one index a corner, polygons as they are.
    tobj::load_obj_buf(clean, &tobj::LoadOptions::default(), |_| Ok(Default::default()))
}

/// `tally` is over the bytes of the text, twice.
pub(super) fn read(text: &[u8], tally: Tally) -> Result<Mesh, Fault> {
    let mut cleaner = Cleaner::new(text, tally);
    let parsed = if text.len() >= LARGE && rayon::current_num_threads() > 1 {
        thread::scope(|scope| parse(&mut Relay::start(scope, &mut cleaner)))
    } else {
        parse(&mut cleaner)
    };
    if let Some(fault) = cleaner.fault.take() {
        return Err(fault);
    }
    // The filter refuses every line that tobj would.
    let (models, _) =
        parsed.map_err(|error| Fault::new(Place::File, "statements that tobj reads", error.to_string()))?;

    let mut objects: Vec<Object> =
        cleaner.names.names.iter().map(|name| Object { name: name.clone(), ..Object::default() }).collect();
    let mut next_id = 0;
    for tobj::Model { mesh, name } in models {
        if mesh.indices.is_empty() {
            continue;
        }
        // The filter numbers the objects, and calls them by number.
        let Some(object) = name.parse::<usize>().ok().and_then(|number| objects.get_mut(number)) else {
            return Err(Fault::new(Place::File, "an object that was named", name));
        };
        let positions = mesh.positions.as_chunks::<3>().0;
        let triangles = polygon::triangulate(positions, mesh.indices, &mesh.face_arities)?;
        object.triangle_ids.extend(next_ids(&mut next_id, triangles.len())?);
        if object.triangles.is_empty() {
            object.positions = positions.to_vec();
            object.triangles = triangles;
        } else {
            // Only a checked mesh has all its vertices in 32 bits; until then a number may stay out of range.
            let first = u32::try_from(object.positions.len()).unwrap_or(u32::MAX);
            object.positions.extend_from_slice(positions);
            object.triangles.extend(triangles.iter().map(|t| t.map(|corner| corner.saturating_add(first))));
        }
    }
    Ok(Mesh { objects })
}
