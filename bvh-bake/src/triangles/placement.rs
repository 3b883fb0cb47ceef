//! Places vertices: turns the coordinates of the input into the offsets of a file, and moves those that have to move.
//!
//! Offsets are `f32` numbers relative to an `f64` origin. The vertices behind them stay as they were given, except where they
//! are moved to a grid on request, or lie below the least unit of the format. The distance by which a vertex moves is measured,
//! not estimated.

use bvh_format::vertex::{LEAST_UNIT, NO_FINER, Vertices};

/// The range of the coordinates of an object.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) lo: [f64; 3],
    pub(crate) hi: [f64; 3],
    /// Per axis, whether all coordinates are `f32` numbers.
    pub(crate) all_f32: [bool; 3],
}

impl Extent {
    pub(crate) const EMPTY: Self =
        Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3], all_f32: [true; 3] };

    #[inline]
    pub(crate) fn add(&mut self, position: &[f64; 3]) {
        for axis in 0..3 {
            let value = position[axis];
            // `min` and `max` would take extra instructions for NaN, which does not occur here.
            self.lo[axis] = if value < self.lo[axis] { value } else { self.lo[axis] };
            self.hi[axis] = if value > self.hi[axis] { value } else { self.hi[axis] };
            self.all_f32[axis] &= f64::from(value as f32) == value;
        }
    }

    /// Adds the corners of a triangle, and returns whether it is a point. Corners become multiples of the least unit.
    #[inline]
    pub(crate) fn add_triangle(&mut self, corners: &mut [[f64; 3]; 3], moved: &mut Moved) -> bool {
        let mut all_on_unit = true;
        corners.as_flattened().iter().for_each(|&c| all_on_unit &= (c.abs() >= NO_FINER) | (c == 0.0));
        if !all_on_unit {
            move_to_unit(corners, moved);
        }
        let [a, b, c] = *corners;
        self.add(&a);
        if a == b && b == c {
            return true;
        }
        self.add(&b);
        self.add(&c);
        false
    }

    pub(crate) fn joined(self, other: Self) -> Self {
        Self {
            lo: [0, 1, 2].map(|axis| self.lo[axis].min(other.lo[axis])),
            hi: [0, 1, 2].map(|axis| self.hi[axis].max(other.hi[axis])),
            all_f32: [0, 1, 2].map(|axis| self.all_f32[axis] && other.all_f32[axis]),
        }
    }

    /// Returns the diagonal of the box, in mesh units.
    pub(crate) fn diagonal(&self) -> f64 {
        (0..3).map(|a| (self.hi[a] - self.lo[a]).powi(2)).sum::<f64>().sqrt()
    }

    /// The middle of an axis, rounded to the spacing of numbers there, if it gains two bits or more to measure from it; else 0.
    /// Differences of coordinates and the middle are then exact.
    pub(super) fn middle(&self, axis: usize) -> AxisOrigin {
        let (lo, hi) = (self.lo[axis], self.hi[axis]);
        let largest = lo.abs().max(hi.abs());
        let half = (hi - lo) / 2.0;
        if largest <= 4.0 * half || self.all_f32[axis] {
            return AxisOrigin::default();
        }
        // `origin + v` stays below twice the largest coordinate, where this is the spacing of `f64` numbers.
        let grid = spacing(2.0 * largest).max(LEAST_UNIT);
        let middle = lo + half;
        AxisOrigin { origin: (middle / grid).round() * grid, grid }
    }
}

/// One axis of the origin, and the grid on which `origin + v` is exact.
#[derive(Clone, Copy, Default)]
pub(super) struct AxisOrigin {
    pub(super) origin: f64,
    /// Vertices that move are multiples of this number; 0 stands for no grid.
    grid: f64,
}

/// Moves coordinates of a triangle to multiples of the least unit.
#[cold]
#[inline(never)]
fn move_to_unit(corners: &mut [[f64; 3]; 3], moved: &mut Moved) {
    for value in corners.as_flattened_mut() {
        let given = std::mem::replace(value, on_unit(*value));
        if *value != given {
            // Half a unit along each axis: the root of three quarters.
            moved.rounding = moved.rounding.max(0.9 * LEAST_UNIT);
        }
    }
}

/// Returns the multiple of the least unit that is nearest to a coordinate, ties to even.
pub(crate) fn on_unit(coordinate: f64) -> f64 {
    if coordinate.abs() >= NO_FINER || !coordinate.is_finite() {
        return coordinate;
    }
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    (coordinate / LEAST_UNIT).round_ties_even() * LEAST_UNIT + 0.0
}

/// The largest distances by which vertices moved, in mesh units.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Moved {
    pub(crate) rounding: f64,
    pub(crate) quantization: f64,
}

impl Moved {
    /// Records how far rounding moved a vertex.
    #[inline]
    pub(crate) fn record_rounding(&mut self, by: [f64; 3]) {
        self.rounding = max_norm(self.rounding, by);
    }

    pub(crate) fn joined(self, other: Self) -> Self {
        Self {
            rounding: self.rounding.max(other.rounding),
            quantization: self.quantization.max(other.quantization),
        }
    }

    /// Returns upper bounds of the true distances, if `norm` computed these.
    pub(crate) fn rounded_up(self) -> Self {
        Self { rounding: rounded_up(self.rounding), quantization: rounded_up(self.quantization) }
    }
}

/// The way the vertices of an object are placed.
#[derive(Clone, Copy)]
pub(crate) struct Placement {
    behind: Vertices,
    /// The grids on which sums with the origin are exact, and the step of the grid of quantised triangles.
    quantized: Option<([f64; 3], f64)>,
}

impl Default for Placement {
    fn default() -> Self {
        Self::of(Vertices::around([0.0; 3]))
    }
}

impl Placement {
    /// Leaves vertices where they are.
    pub(crate) fn of(behind: Vertices) -> Self {
        Self { behind, quantized: None }
    }

    /// Moves vertices to a grid, by at most `error`.
    pub(crate) fn quantized(extent: &Extent, error: f64) -> Self {
        let axes = [0, 1, 2].map(|axis| extent.middle(axis));
        let behind = Vertices::around(axes.map(|axis| axis.origin));
        Self { behind, quantized: Some((axes.map(|axis| axis.grid), grid_step(error))) }
    }

    /// How vertices follow from offsets.
    pub(crate) fn behind(&self) -> Vertices {
        self.behind
    }

    /// Whether vertices do not follow from offsets alone.
    pub(crate) fn is_corrected(&self) -> bool {
        self.behind.are_corrected()
    }

    /// Returns whether `f32` coordinates stay as they are.
    pub(crate) fn keeps_f32(&self) -> bool {
        self.quantized.is_none() && self.behind == Vertices::around([0.0; 3])
    }

    /// Returns the offsets of a file for a vertex of the input, and records in `moved` how far the vertex moved.
    #[inline]
    pub(crate) fn place(&self, position: [f64; 3], moved: &mut Moved) -> [f32; 3] {
        let offset = |axis: usize| (position[axis] - self.behind.origin[axis]) as f32;
        let offsets = match &self.quantized {
            None => [0, 1, 2].map(offset),
            Some((grids, step)) => self.snapped(position, grids, *step, moved),
        };
        // Equal values must have equal bits.
        offsets.map(|value| if value == 0.0 { 0.0 } else { value })
    }

    fn snapped(&self, position: [f64; 3], grids: &[f64; 3], step: f64, moved: &mut Moved) -> [f32; 3] {
        let (mut vertex, mut moves) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let (origin, grid) = (self.behind.origin[axis], grids[axis]);
            let mut offset = position[axis] - origin;
            if grid > 0.0 {
                offset = (offset / grid).round() * grid;
            }
            vertex[axis] = offset as f32;
            moves[axis] = position[axis] - (origin + f64::from(vertex[axis]));
        }
        moved.rounding = max_norm(moved.rounding, moves);
        for axis in 0..3 {
            let rounded = f64::from(vertex[axis]);
            // If the step is smaller than the spacing of `f32` at the vertex, the vertex is on the grid already. That
            // includes a step so small that the quotient overflows.
            let snapped = ((rounded / step).round() * step) as f32;
            vertex[axis] = if snapped.is_finite() { snapped } else { vertex[axis] };
            moves[axis] = f64::from(vertex[axis]) - rounded;
        }
        moved.quantization = max_norm(moved.quantization, moves);
        vertex
    }
}

/// Returns the distance from `value` to the next larger `f64`, a power of two.
fn spacing(value: f64) -> f64 {
    value.next_up() - value
}

/// Returns `least.max(norm(v))`, without the divisions and the root of `norm` for a vector that is certainly shorter than
/// `least`.
#[inline]
fn max_norm(least: f64, v: [f64; 3]) -> f64 {
    // The sum, its comparand and `norm` are each wrong by less than 2^-50 of themselves, besides squares that vanish. What
    // is added makes up for those. A sum that overflows is no shorter.
    let sum = v.iter().map(|c| c * c).sum::<f64>() + 8.0 * f64::MIN_POSITIVE;
    if sum < least * least * (1.0 - 2f64.powi(-48)) { least } else { least.max(norm(v)) }
}

/// Returns the length of a vector, scaled such that squares neither overflow nor vanish.
fn norm(v: [f64; 3]) -> f64 {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * v.iter().map(|c| (c / largest).powi(2)).sum::<f64>().sqrt()
}

/// Returns an upper bound of a true length that `norm` computed with at most five rounding errors of 2^-53.
fn rounded_up(length: f64) -> f64 {
    if length == 0.0 { 0.0 } else { (length * (1.0 + 2f64.powi(-49))).next_up() }
}

/// Returns the largest power of two whose grid moves no vertex by more than `error`: half a step along each of three
/// axes is sqrt(3) / 2 steps.
fn grid_step(error: f64) -> f64 {
    let limit = error * 2.0 / 3f64.sqrt();
    // Keeps the leading bit only. A logarithm could differ between the libraries of two platforms.
    f64::from_bits(limit.to_bits() & 0x7ff << 52).max(f64::MIN_POSITIVE)
}
