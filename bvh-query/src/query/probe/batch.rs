//! Asks about many points of one mesh, on all cores.
//!
//! Points are sorted along a space-filling curve, so that what one touches is in the caches for the next. Each thread takes
//! runs of them. Answers are placed in the order of the points, and do not depend on the number of threads.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::isa::Backend;
use crate::query::answers::ClosestPoint;
use crate::query::probe::closest::check_within;
use crate::query::querier::Querier;
use rayon::prelude::*;

/// Points in a run of one thread.
const POINTS_PER_RUN: usize = 256;

/// Asks about many points of one mesh, on all threads of the rayon pool it is called in.
///
/// The answers are those of [`Querier`], bit for bit and in the order of the points. A batch needs the memory of one querier
/// per thread, of the answers, and 16 bytes per point.
///
/// # Errors
/// Each method returns the error of the first point, in their order, that has no answer.
#[derive(Debug, Clone, Copy)]
pub struct ProbeBatch<'a> {
    shape: Shape<'a>,
    backend: Backend,
    budget: u64,
}

impl<'a> ProbeBatch<'a> {
    /// Creates a batch with the fastest backend of this CPU, or with the one that the environment variable `CBVH_ISA`
    /// names.
    ///
    /// # Errors
    /// [`QueryError::Backend`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn new(shape: impl Into<Shape<'a>>) -> Result<Self, QueryError> {
        Ok(Self::with_backend(shape, Backend::detect()?))
    }

    /// Creates a batch with a backend. The portable backend replaces one that the CPU lacks.
    pub fn with_backend(shape: impl Into<Shape<'a>>, backend: Backend) -> Self {
        Self { shape: shape.into(), backend, budget: u64::MAX }
    }

    /// Bounds the work per point, as [`Querier::set_budget`] does.
    pub fn set_budget(&mut self, visits: u64) {
        self.budget = visits;
    }

    /// Answers [`Querier::closest_point`] for each point.
    ///
    /// # Errors
    /// [`QueryError::Number`] if `within` is negative or NaN; else the error of the first point that fails.
    pub fn closest_points(
        &self,
        points: &[[f64; 3]],
        within: f64,
    ) -> Result<Vec<Option<ClosestPoint>>, QueryError> {
        check_within(within)?;
        let order = along_curve(points);
        let ask = |querier: &mut Querier, run: &[u32]| -> Vec<Result<Option<ClosestPoint>, QueryError>> {
            querier.set_budget(self.budget);
            run.iter()
                .map(|&number| querier.closest_point(self.shape, points[number as usize], within))
                .collect()
        };
        let runs: Vec<Vec<Result<Option<ClosestPoint>, QueryError>>> =
            order.par_chunks(POINTS_PER_RUN).map_init(|| Querier::with_backend(self.backend), ask).collect();
        let mut answers = vec![None; points.len()];
        let mut first: Option<(u32, QueryError)> = None;
        for (&number, answer) in order.iter().zip(runs.into_iter().flatten()) {
            match answer {
                Ok(found) => answers[number as usize] = found,
                Err(error) if first.as_ref().is_none_or(|(least, _)| number < *least) => {
                    first = Some((number, error));
                }
                Err(_) => {}
            }
        }
        first.map_or(Ok(answers), |(_, error)| Err(error))
    }
}

/// Returns the numbers of points in the order of a Morton curve through the box around them: bits of the three coordinates in
/// turns (G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing", 1966).
fn along_curve(points: &[[f64; 3]]) -> Vec<u32> {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            (lo[axis], hi[axis]) = (lo[axis].min(point[axis]), hi[axis].max(point[axis]));
        }
    }
    let widest = (0..3).map(|axis| hi[axis] - lo[axis]).fold(0.0, f64::max);
    let code = |point: &[f64; 3]| {
        (0..3).fold(0u64, |code, axis| {
            // A point that is no point counts as 0.
            let cell = ((point[axis] - lo[axis]) / widest * 65535.0) as u64;
            (0..16).fold(code, |code, bit| code | (cell >> bit & 1) << (3 * bit + axis))
        })
    };
    let mut order: Vec<(u64, u32)> = points.iter().map(code).zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, number)| number).collect()
}
