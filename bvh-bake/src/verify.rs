//! Verifies a file against the mesh it was baked from: the same triangles, and bounds that contain them.
//!
//! Shares no code with the baker's way from mesh to bytes, so that neither hides a mistake of the other.
//! With ids every triangle is looked up by its number, and its corners compared in order. Without ids
//! the stored triangles and the mesh's rounded ones are sorted and compared as multisets.

mod by_id;
mod by_value;

use crate::mesh::{InputError, Mesh, Object as MeshObject};
use crate::prove::{prove_bounds, validate_in_parallel};
use bvh_format::FormatError;
use bvh_format::Layout;
use bvh_format::bounds::Inflation;
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::object::Object;
use bvh_format::page::Page;
use bvh_format::validate::packets;

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
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The file itself breaks a rule of the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The mesh breaks the input contract, so that no file can be a bake of it.
    #[error("the mesh: {0}")]
    Mesh(#[from] InputError),
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
/// Cost: about that of reading the mesh. Memory: 9 bytes a triangle of the mesh and about 110 bytes a page
/// with ids, 36 bytes for each triangle of mesh and file without.
///
/// # Errors
/// The first thing found that does not hold.
pub fn verify(bytes: &[u8], mesh: &Mesh) -> Result<VerifyReport, VerifyError> {
    mesh.check()?;
    let layout = validate_in_parallel(bytes)?;
    let inflation = prove_bounds(&layout, bytes)?;
    let sources = match_objects(&layout, mesh)?;
    for (object, source) in layout.objects.iter().zip(&sources) {
        check_counts(object, source, mesh)?;
        check_hull(&layout, bytes, object)?;
    }
    let (max_move, duplicates) = if layout.has_ids() {
        by_id::compare(&layout, bytes, mesh)?
    } else {
        by_value::compare(&layout, bytes, &sources)?
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

/// For each object of the file the objects of the mesh that it was made of: all, or one each.
fn match_objects<'m>(layout: &Layout, mesh: &'m Mesh) -> Result<Vec<Vec<&'m MeshObject>>, VerifyError> {
    let full: Vec<_> = mesh.objects.iter().filter(|object| !object.triangles.is_empty()).collect();
    match layout.objects.len() {
        1 => Ok(vec![full]),
        count if count == full.len() => Ok(full.into_iter().map(|object| vec![object]).collect()),
        count => Err(VerifyError::differs("objects", format!("1 or {}", full.len()), count)),
    }
}

fn check_counts(object: &Object, source: &[&MeshObject], mesh: &Mesh) -> Result<(), VerifyError> {
    let record = &object.record;
    let counts = [
        ("triangles of the input", mesh.triangle_count(), record.input_triangles.get()),
        (
            "triangles stored and duplicates left out",
            source.iter().map(|object| object.triangles.len() as u64).sum(),
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
fn check_hull(layout: &Layout, bytes: &[u8], object: &Object) -> Result<(), VerifyError> {
    let record = &object.record;
    let axes = [0, 1, 2];
    let (lo, hi) = (axes.map(|a| record.box_lo[a].get()), axes.map(|a| record.box_hi[a].get()));
    let centre = axes.map(|a| f64::from(record.sphere_centre[a].get()));
    let radius = f64::from(record.sphere_radius.get());
    each_triangle(layout, bytes, object, |triangle| {
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
fn each_triangle(
    layout: &Layout,
    bytes: &[u8],
    object: &Object,
    mut visit: impl FnMut(&Stored) -> Result<(), VerifyError>,
) -> Result<(), VerifyError> {
    let first = object.record.first_page.get();
    for number in first..first + object.record.pages.get() {
        // Validation has seen every page.
        let Some(page_bytes) = layout.page_bytes(bytes, number) else { continue };
        let page = Page::new(page_bytes, object.profile);
        let block = layout.leaf_block(bytes, page.header());
        let ids = layout.id_block(bytes, page.header());
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
