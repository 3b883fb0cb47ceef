//! Asks about many points, rays or segments and one mesh, on all cores.
//!
//! Probes are sorted along a space-filling curve, so that the next probe finds in the caches what the last one needed.
//! Answers are in the order of the probes, and do not depend on the number of threads.

use crate::error::QueryError;
use crate::isa::{Backend, BackendError};
use crate::query::pool::Pool;
use crate::query::probe::closest::ClosestPoint;
use crate::query::probe::closest::check_within;
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::ray::Ray;
use crate::query::probe::ray::RayHit;
use crate::query::probe::side::{Side, SignedPointDistance};
use crate::query::querier::Querier;
use std::convert::Infallible;

/// Probes in a run of one thread.
const PROBES_PER_RUN: usize = 256;

/// Asks about many points, rays or segments and one mesh, on all threads of the rayon pool it is called in.
///
/// The answers are those of [`Querier`], bit for bit and in the order of the probes. A batch needs the memory of one querier
/// per thread, which it keeps for the next call, of the answers, and 16 bytes per probe.
///
/// # Errors
/// Each method returns the error of the first probe, in their order, that has no answer.
#[derive(Debug, Clone)]
pub struct ProbeBatch<'a> {
    shape: PlacedShape<'a>,
    pool: Pool,
}

impl<'a> ProbeBatch<'a> {
    /// Creates a batch with the fastest backend of this CPU, or with the one that the environment variable `CBVH_ISA`
    /// names.
    ///
    /// # Errors
    /// [`BackendError`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn new(shape: impl Into<PlacedShape<'a>>) -> Result<Self, BackendError> {
        Ok(Self::with_backend(shape, Backend::detect()?))
    }

    /// Creates a batch with a backend. The portable backend replaces one that the CPU lacks.
    pub fn with_backend(shape: impl Into<PlacedShape<'a>>, backend: Backend) -> Self {
        Self { shape: shape.into(), pool: Pool::new(backend) }
    }

    /// Bounds the work per probe, as [`Querier::set_budget`] does.
    pub fn set_budget(&mut self, visits: u64) {
        self.pool.budget = visits;
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
        self.each(points, |point| *point, |querier, point| querier.closest_point(self.shape, *point, within))
    }

    /// Answers [`Querier::side`] for each point.
    ///
    /// # Errors
    /// The error of the first point that fails.
    pub fn sides(&self, points: &[[f64; 3]]) -> Result<Vec<Side>, QueryError> {
        self.each(points, |point| *point, |querier, point| querier.side(self.shape, *point))
    }

    /// Answers [`Querier::signed_point_distance`] for each point.
    ///
    /// # Errors
    /// [`QueryError::Number`] if `within` is negative or NaN; else the error of the first point that fails.
    pub fn signed_point_distances(
        &self,
        points: &[[f64; 3]],
        within: f64,
    ) -> Result<Vec<Option<SignedPointDistance>>, QueryError> {
        check_within(within)?;
        self.each(
            points,
            |point| *point,
            |querier, point| querier.signed_point_distance(self.shape, *point, within),
        )
    }

    /// Answers [`Querier::first_hit`] for each ray.
    ///
    /// # Errors
    /// The error of the first ray that fails.
    pub fn first_hits(&self, rays: &[Ray]) -> Result<Vec<Option<RayHit>>, QueryError> {
        self.each(rays, |ray| ray.origin, |querier, ray| querier.first_hit(self.shape, ray))
    }

    /// Answers [`Querier::any_hit`] for each ray.
    ///
    /// # Errors
    /// The error of the first ray that fails.
    pub fn any_hits(&self, rays: &[Ray]) -> Result<Vec<bool>, QueryError> {
        self.each(rays, |ray| ray.origin, |querier, ray| querier.any_hit(self.shape, ray))
    }

    /// Answers [`Querier::all_hits`] for each ray.
    ///
    /// # Errors
    /// The error of the first ray that fails.
    pub fn all_hits(&self, rays: &[Ray]) -> Result<Vec<Vec<RayHit>>, QueryError> {
        self.each(rays, |ray| ray.origin, |querier, ray| querier.all_hits(self.shape, ray))
    }

    /// Answers [`Querier::segment_hit`] for each segment, given by its ends.
    ///
    /// # Errors
    /// The error of the first segment that fails.
    pub fn segment_hits(&self, segments: &[[[f64; 3]; 2]]) -> Result<Vec<bool>, QueryError> {
        let middle = |[p, q]: &[[f64; 3]; 2]| [0, 1, 2].map(|k| p[k] / 2.0 + q[k] / 2.0);
        self.each(segments, middle, |querier, [from, to]| querier.segment_hit(self.shape, *from, *to))
    }

    /// Asks about each probe, in the order of their places along the curve.
    fn each<P: Sync, R: Send>(
        &self,
        probes: &[P],
        at: impl Fn(&P) -> [f64; 3],
        ask: impl Fn(&mut Querier, &P) -> Result<R, QueryError> + Sync,
    ) -> Result<Vec<R>, QueryError> {
        let order = along_curve(&probes.iter().map(at).collect::<Vec<_>>());
        let mut answers: Vec<Option<Result<R, QueryError>>> = probes.iter().map(|_| None).collect();
        let mut numbers = order.iter();
        // An error ends no run, because a probe that comes later along the curve may be the first that fails.
        let Ok(()) = self.pool.runs(
            rayon::current_num_threads(),
            order.len(),
            PROBES_PER_RUN,
            |querier, places| {
                let of_run = places.map(|place| ask(querier, &probes[order[place] as usize]));
                Ok::<_, (usize, Infallible)>(of_run.collect::<Vec<_>>())
            },
            |of_run| {
                // The answers first, so that the end of a run takes no number of the next one.
                for (answer, &number) in of_run.into_iter().zip(numbers.by_ref()) {
                    answers[number as usize] = Some(answer);
                }
            },
        );
        answers.into_iter().flatten().collect()
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
    let cells = 65535.0 / widest;
    let code = |point: &[f64; 3]| {
        // A point that is no point counts as 0.
        let cell = |axis: usize| every_third_bit(((point[axis] - lo[axis]) * cells) as u16);
        cell(0) | cell(1) << 1 | cell(2) << 2
    };
    let mut order: Vec<(u64, u32)> = points.iter().map(code).zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, number)| number).collect()
}

/// Moves bit i to place 3i.
fn every_third_bit(bits: u16) -> u64 {
    let bits = u64::from(bits);
    let bits = (bits | bits << 16) & 0xff00_00ff;
    let bits = (bits | bits << 8) & 0x00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x0c30_c30c_30c3;
    (bits | bits << 2) & 0x2492_4924_9249
}
