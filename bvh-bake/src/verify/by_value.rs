//! Compares the triangles of mesh and file as multisets of rounded corners, for files without ids.

use super::{VerifyError, distance, each_triangle, place, tolerance};
use crate::mesh::Object as MeshObject;
use bvh_format::Layout;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::Object;
use rayon::prelude::*;

/// The corners' bits, in ascending order: the same for equal triangles, however they are turned.
type Key = [[u32; 3]; 3];

/// Checks each object of the file against the mesh objects it was made of. Returns the largest distance
/// of a corner from where it is stored, and the number of duplicates.
pub(super) fn compare(
    layout: &Layout,
    bytes: &[u8],
    sources: &[Vec<&MeshObject>],
) -> Result<(f64, u64), VerifyError> {
    let (mut max_move, mut duplicates) = (0.0f64, 0);
    for (object, source) in layout.objects.iter().zip(sources) {
        let mut stored = Vec::with_capacity(object.record.triangles.get() as usize);
        each_triangle(layout, bytes, object, |triangle| {
            stored.push(key(&triangle.corners));
            Ok(())
        })?;
        stored.par_sort_unstable();
        let rounding = Rounding::new(object, source, &stored);
        let mut expected = Vec::with_capacity(stored.len());
        for mesh in source {
            for (index, corners) in mesh.triangles.iter().enumerate() {
                let corners = corners.map(|vertex| mesh.positions[vertex as usize]);
                let rounded = corners.map(|corner| rounding.round(corner));
                for corner in 0..3 {
                    let moved = distance(corners[corner], place(object, rounded[corner]));
                    let limit = tolerance(object);
                    if moved.is_nan() || moved > limit {
                        let what = format!("triangle {}, corner {corner}", mesh.triangle_ids[index]);
                        let found = format!("{moved:e}");
                        return Err(VerifyError::differs(
                            what,
                            format!("a move of at most {limit:e}"),
                            found,
                        ));
                    }
                    max_move = max_move.max(moved);
                }
                expected.push(key(&rounded));
            }
        }
        expected.par_sort_unstable();
        let all = expected.len();
        expected.dedup();
        duplicates += (all - expected.len()) as u64;
        compare_sorted(object, &expected, &stored)?;
    }
    Ok((max_move, duplicates))
}

fn compare_sorted(object: &Object, expected: &[Key], stored: &[Key]) -> Result<(), VerifyError> {
    let place = |key: Option<&Key>| match key {
        Some(key) => format!("{:?}", key.map(|corner| place(object, corner.map(f32::from_bits)))),
        None => "no more".to_owned(),
    };
    let count = expected.len().max(stored.len());
    match (0..count).find(|&index| expected.get(index) != stored.get(index)) {
        Some(index) => {
            let what = format!("the triangles in order of their corners, number {index}");
            Err(VerifyError::differs(what, place(expected.get(index)), place(stored.get(index))))
        }
        None => Ok(()),
    }
}

fn key(corners: &[[f32; 3]; 3]) -> Key {
    let mut key = corners.map(|corner| corner.map(f32::to_bits));
    key.sort_unstable();
    key
}

/// What a baker does to a coordinate, found again from the file.
struct Rounding {
    origin: [f64; 3],
    /// Grid of the origin by axis; 0 where the origin is.
    origin_grid: [f64; 3],
    /// Grid of quantisation by axis; 0 for none, infinite if it leaves nothing but 0.
    grid: [f64; 3],
}

impl Rounding {
    fn new(object: &Object, source: &[&MeshObject], stored: &[Key]) -> Self {
        let origin = object.record.origin.map(|value| value.get());
        let used = || {
            let corners = |mesh: &'_ MeshObject| mesh.triangles.iter().flatten().copied().collect::<Vec<_>>();
            source
                .iter()
                .flat_map(move |mesh| corners(mesh).into_iter().map(|vertex| mesh.positions[vertex as usize]))
        };
        let origin_grid = [0, 1, 2].map(|axis| {
            if origin[axis] == 0.0 {
                return 0.0;
            }
            // Sums of origin and vertex stay below twice the largest coordinate; their f64 have this spacing.
            let largest = 2.0 * used().map(|position| position[axis].abs()).fold(0.0, f64::max);
            largest.next_up() - largest
        });
        let quantized = object.triangle_encoding == TriangleEncoding::Quantized;
        let grid = [0, 1, 2].map(|axis| if quantized { coarsest_grid(stored, axis) } else { 0.0 });
        Self { origin, origin_grid, grid }
    }

    fn round(&self, position: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis| {
            let mut offset = position[axis] - self.origin[axis];
            let snap = |value: f64, grid: f64| match grid {
                0.0 => value,
                f64::INFINITY => 0.0,
                _ => (value / grid).round() * grid,
            };
            offset = snap(offset, self.origin_grid[axis]);
            let rounded = f64::from(offset as f32);
            // + 0.0: equal values have equal bits.
            snap(rounded, self.grid[axis]) as f32 + 0.0
        })
    }
}

/// The coarsest power of two of which all stored coordinates of an axis are multiples. Rounding to it is
/// the same as to the baker's own, perhaps finer, grid: a value that the finer grid puts on the coarser one
/// is within half a fine step of it. Infinite if all coordinates are 0.
fn coarsest_grid(stored: &[Key], axis: usize) -> f64 {
    let coordinates = stored.par_iter().flat_map_iter(|key| key.iter().map(|corner| corner[axis]));
    let lowest = coordinates.filter_map(lowest_bit).min();
    lowest.map_or(f64::INFINITY, |exponent| 2f64.powi(exponent))
}

/// The exponent of the lowest set bit of a float, `None` for 0.
fn lowest_bit(bits: u32) -> Option<i32> {
    let (exponent, fraction) = ((bits >> 23 & 255) as i32, bits & 0x7f_ffff);
    let (mantissa, scale) =
        if exponent == 0 { (fraction, -149) } else { (fraction | 1 << 23, exponent - 150) };
    (mantissa != 0).then(|| scale + mantissa.trailing_zeros() as i32)
}
