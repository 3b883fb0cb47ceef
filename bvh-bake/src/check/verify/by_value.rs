//! Compares the triangles of a mesh and a file as multisets of rounded corners, for files without ids.
//!
//! The triangles of both are sorted by object and corners and then compared in that order.

use super::input::{Input, InputCorners};
use super::surfaces::Surfaces;
use super::{File, VerifyError, distance, source_of, tolerance};
use crate::storage::external_sort::{Ahead, Sorter};
use crate::storage::resources::Resources;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::Object;
use bvh_format::source::Source;
use bytemuck::{Pod, Zeroable};

/// The bits of the corners in ascending order: equal triangles have the same key, whatever the order of their
/// corners.
type Key = [[u64; 3]; 3];

/// A triangle with the number of its object in the file.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Keyed {
    object: u32,
    spare: u32,
    key: Key,
    /// 1 if the triangle goes around its corners in the order of the key, -1 if against it. 1 where corners are equal.
    way: i32,
    /// The place of a stored triangle in its object.
    place: u32,
}

impl Keyed {
    fn new(object: u32, corners: &[[f64; 3]; 3], place: u32) -> Self {
        let bits = corners.map(|corner| corner.map(f64::to_bits));
        let mut key = bits;
        key.sort_unstable();
        let [a, b, c] = key;
        let along = [[a, b, c], [b, c, a], [c, a, b]].contains(&bits);
        Self { object, spare: 0, key, way: if along { 1 } else { -1 }, place }
    }

    /// Returns whether another triangle has the same corners and is of the same object.
    fn equals(&self, other: &Self) -> bool {
        (self.object, self.key) == (other.object, other.key)
    }
}

impl<S: Source + ?Sized> File<'_, S>
where
    VerifyError: From<S::Error>,
{
    /// Checks each object of the file against the mesh objects from which it was made. Returns the largest distance
    /// between a corner and the place where it is stored, and the number of duplicates. Adds all triangles to the surfaces.
    pub(super) fn compare_by_value(
        &self,
        input: &impl Input,
        surfaces: &mut Surfaces,
        resources: &Resources,
    ) -> Result<(f64, u64), VerifyError> {
        let layout = self.layout;
        let spill = resources.scratch.spill();
        let run = resources.sorted_at_once::<Keyed>(u64::MAX);
        let mut stored = Sorter::of_runs(run);
        let mut roundings: Vec<Rounding> = layout.objects.iter().map(Rounding::new).collect();
        for (number, object) in (0..).zip(&layout.objects) {
            self.each_triangle(object, |triangle| {
                let keyed = Keyed::new(number, &triangle.corners, triangle.place);
                roundings[number as usize].add_stored(&triangle.corners);
                Ok(stored.extend(&[keyed], &spill)?)
            })?;
        }
        if roundings.iter().any(|rounding| rounding.origin != [0.0; 3]) {
            input.visit(&mut |mesh, _, corners| {
                roundings[source_of(layout, mesh)].add_expected(corners);
                Ok(())
            })?;
        }
        roundings.iter_mut().for_each(Rounding::settle);
        let mut expected = Sorter::of_runs(run);
        let mut max_move = 0.0f64;
        // The first difference in the order of the file's objects, then of the mesh's objects.
        let mut first: Option<((usize, u32, u32), VerifyError)> = None;
        input.visit(&mut |mesh, id, corners| {
            let number = source_of(layout, mesh);
            let (object, rounding) = (&layout.objects[number], &roundings[number]);
            let rounded = corners.map(|corner| rounding.round(corner));
            match check_moves(object, id, corners, &rounded) {
                Ok(moved) => max_move = max_move.max(moved),
                Err(error) if first.as_ref().is_none_or(|(at, _)| (number, mesh, id) < *at) => {
                    first = Some(((number, mesh, id), error));
                }
                Err(_) => {}
            }
            Ok(expected.extend(&[Keyed::new(number as u32, &rounded, 0)], &spill)?)
        })?;
        let (stored, expected) = (stored.finish(), expected.finish());
        let (mut stored, mut expected) = (Ahead::of(&stored)?, Ahead::of(&expected)?);
        let mut duplicates = 0;
        for number in 0..layout.objects.len() {
            if let Some((_, error)) = first.take_if(|((at, ..), _)| *at == number) {
                return Err(error);
            }
            duplicates += compare_sorted(number as u32, &mut expected, &mut stored, surfaces)?;
        }
        Ok((max_move, duplicates))
    }
}

/// Returns the largest distance by which rounding moves a corner of a triangle of the mesh.
fn check_moves(
    object: &Object,
    id: u32,
    corners: &InputCorners,
    rounded: &[[f64; 3]; 3],
) -> Result<f64, VerifyError> {
    let mut max_move = 0.0f64;
    for corner in 0..3 {
        let moved = distance(corners[corner], rounded[corner]);
        let limit = tolerance(object);
        if moved.is_nan() || moved > limit {
            let what = format!("triangle {id}, corner {corner}");
            return Err(VerifyError::differs(
                what,
                format!("a move of at most {limit:e}"),
                format!("{moved:e}"),
            ));
        }
        max_move = max_move.max(moved);
    }
    Ok(max_move)
}

/// Returns the next triangle of an object and skips all that are equal to it. Returns also how many these are, itself
/// included, and the sum of their ways.
fn next_distinct_of(keys: &mut Ahead<Keyed>, object: u32) -> Result<(Option<Keyed>, u64, i32), VerifyError> {
    let Some(now) = keys.next_if(|next| next.object == object)? else { return Ok((None, 0, 0)) };
    let (mut count, mut ways) = (1, now.way);
    while let Some(same) = keys.next_if(|next| next.equals(&now))? {
        count += 1;
        ways += same.way;
    }
    Ok((Some(now), count, ways))
}

/// Compares the triangles of an object, and returns the number of duplicates.
fn compare_sorted(
    number: u32,
    expected: &mut Ahead<Keyed>,
    stored: &mut Ahead<Keyed>,
    surfaces: &mut Surfaces,
) -> Result<u64, VerifyError> {
    let place = |keyed: Option<Keyed>| match keyed {
        Some(keyed) => format!("{:?}", keyed.key.map(|corner| corner.map(f64::from_bits))),
        None => "no more".to_owned(),
    };
    let mut duplicates = 0;
    for index in 0u64.. {
        let (wanted, count, ways) = next_distinct_of(expected, number)?;
        let found = stored.next_if(|next| next.object == number)?;
        match (wanted, found) {
            (None, None) => break,
            (Some(wanted), Some(found)) if wanted.equals(&found) => {
                duplicates += count - 1;
                let [a, b, c] = found.key.map(|corner| corner.map(f64::from_bits));
                let corners = if found.way == 1 { [a, b, c] } else { [b, a, c] };
                surfaces.add(number, &corners, 1)?;
                if count > 1 {
                    surfaces.add_duplicates(number, found.place, &corners, ways * found.way - 1)?;
                }
            }
            _ => {
                let what = format!("the triangles in order of their corners, number {index}");
                return Err(VerifyError::differs(what, place(wanted), place(found)));
            }
        }
    }
    Ok(duplicates)
}

/// The rounding that the baker applied to coordinates, reconstructed from the file.
struct Rounding {
    origin: [f64; 3],
    /// Whether the baker may have put vertices on a grid.
    quantized: bool,
    /// Whether it may have rounded coordinates to `f32`: they moved, and the file has no others.
    rounded: bool,
    /// The lowest bit set in any stored coordinate, per axis.
    lowest: [Option<i32>; 3],
    /// The largest magnitude of the mesh's coordinates, per axis.
    largest: [f64; 3],
    /// The grid of the origin per axis; 0 if the origin is 0.
    origin_grid: [f64; 3],
    /// The grid of quantisation per axis; 0 for no grid, and infinite if every coordinate became 0.
    grid: [f64; 3],
}

impl Rounding {
    fn new(object: &Object) -> Self {
        Self {
            origin: object.origin(),
            quantized: object.triangle_encoding() == TriangleEncoding::Quantized,
            rounded: object.record().max_vertex_rounding.get() > 0.0,
            lowest: [None; 3],
            largest: [0.0; 3],
            origin_grid: [0.0; 3],
            grid: [0.0; 3],
        }
    }

    /// Adds a stored triangle.
    fn add_stored(&mut self, corners: &[[f64; 3]; 3]) {
        if !self.quantized {
            // The nearest f32 number is the nearest multiple of 2^-180, too, if this is an f32 number.
            self.rounded &= corners.as_flattened().iter().all(|&x| f64::from(x as f32) == x);
            return;
        }
        for corner in corners {
            for axis in 0..3 {
                let bit = lowest_bit(corner[axis] - self.origin[axis]);
                self.lowest[axis] = [self.lowest[axis], bit].into_iter().flatten().min();
            }
        }
    }

    /// Adds a triangle of the mesh.
    fn add_expected(&mut self, corners: &InputCorners) {
        for corner in corners {
            for axis in 0..3 {
                self.largest[axis] = self.largest[axis].max(corner[axis].abs());
            }
        }
    }

    /// Derives the grids, after all triangles of the file and the mesh have been added.
    ///
    /// The grid of quantisation is the coarsest power of two of which all stored coordinates of an axis are
    /// multiples. The baker's own grid may be finer, but rounding to either gives the same result: a value that the
    /// finer grid puts on the coarser one is within half a fine step of it.
    fn settle(&mut self) {
        for axis in 0..3 {
            if self.origin[axis] != 0.0 {
                // The sum of origin and vertex stays below twice the largest coordinate, where this is the spacing of
                // `f64`.
                let largest = 2.0 * self.largest[axis];
                self.origin_grid[axis] = largest.next_up() - largest;
            }
            if self.quantized {
                self.grid[axis] = self.lowest[axis].map_or(f64::INFINITY, |exponent| 2f64.powi(exponent));
            }
        }
    }

    fn round(&self, position: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            if !self.quantized {
                // As it was rounded on purpose, or to multiples of 2^-180; adding 0.0 turns -0.0 into 0.0, so that equal values have equal bits.
                if self.rounded {
                    return f64::from(position[axis] as f32) + 0.0;
                }
                let units = position[axis] * 2f64.powi(180);
                let is_small = units.abs() < 2f64.powi(52);
                return if is_small { units.round_ties_even() / 2f64.powi(180) } else { position[axis] }
                    + 0.0;
            }
            let mut offset = position[axis] - self.origin[axis];
            let snap = |value: f64, grid: f64| match grid {
                0.0 => value,
                f64::INFINITY => 0.0,
                _ => (value / grid).round() * grid,
            };
            offset = snap(offset, self.origin_grid[axis]);
            let rounded = f64::from(offset as f32);
            self.origin[axis] + f64::from(snap(rounded, self.grid[axis]) as f32) + 0.0
        })
    }
}

/// Returns the exponent of the lowest set bit of a float, or `None` for 0.
fn lowest_bit(value: f64) -> Option<i32> {
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i32, bits & ((1 << 52) - 1));
    let (mantissa, scale) =
        if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
    (mantissa != 0).then(|| scale + mantissa.trailing_zeros() as i32)
}
