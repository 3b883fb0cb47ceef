//! Asks about many points, rays or segments and one mesh, on all cores.
//!
//! Probes are sorted along a space-filling curve, so that the next probe finds in the caches what the last one needed.
//! Answers are in the order of the probes, and do not depend on the number of threads.

use crate::error::QueryError;
use crate::isa::{Backend, BackendError};
use crate::query::pool::Pool;
use crate::query::probe::closest::ClosestPoint;
use crate::query::probe::closest::check_within;
use crate::query::probe::line::LineQuestion;
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::check_point;
use crate::query::probe::ray::{All, Any, First, Ray, RayHit, Scaled};
use crate::query::probe::segment::{MeetsSegment, check_margin};
use crate::query::probe::side::{Side, SignedPointDistance};
use crate::query::querier::Querier;
use bvh_format::Stop;
use std::convert::Infallible;
use std::sync::Arc;

/// Probes in a run of one thread.
const PROBES_PER_RUN: usize = 256;
/// Lines that are asked about together: their questions stay in the nearest cache.
const LINES_AT_ONCE: usize = 32;
/// Lines are sorted where a file does not stay in the caches nearest to a processor.
const MIN_SORTED_BYTES: usize = 16 << 20;

/// Queries of many points, rays or segments and one mesh, on all threads of the rayon pool it is called in.
///
/// The answers are those of [`Querier`], bit for bit and in the order of the probes. A batch needs the memory of one querier
/// per thread, which it keeps for the next call, of the answers, and 16 bytes per probe. A batch of rays or segments takes less time
/// per probe than single queries do, as some are run together.
///
/// ```
/// use bvh_query::{ProbeBatch, Ray, Side};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let batch = ProbeBatch::new(&block)?;
/// let points: Vec<[f64; 3]> = (0..1000).map(|n| [f64::from(n) / 100.0, 0.0, 0.0]).collect();
/// assert_eq!(batch.sides(&points)?.iter().filter(|side| **side == Side::Inside).count(), 100);
/// assert_eq!(batch.closest_points(&points, 2.0)?.iter().flatten().count(), 301); // up to x = 3
/// let rays = points.iter().map(|&[x, y, _]| Ray::new([x, y, 5.0], [0.0, 0.0, -1.0]));
/// assert_eq!(batch.any_hits(&rays.collect::<Vec<_>>())?.iter().filter(|hit| **hit).count(), 101);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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

    /// Stops each query when the flag is set, as [`Querier::set_stop`] does. The query then ends with
    /// [`QueryError::Stopped`], and has no answer for any probe.
    pub fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.pool.stop = stop;
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
        self.each_line(rays, of_ray, Scaled::new, First::about, |first| first.hit().map(|(_, hit)| hit))
    }

    /// Answers [`Querier::any_hit`] for each ray.
    ///
    /// # Errors
    /// The error of the first ray that fails.
    pub fn any_hits(&self, rays: &[Ray]) -> Result<Vec<bool>, QueryError> {
        self.each_line(rays, of_ray, Scaled::new, Any::about, |any| any.found)
    }

    /// Answers [`Querier::all_hits`] for each ray.
    ///
    /// # Errors
    /// The error of the first ray that fails.
    pub fn all_hits(&self, rays: &[Ray]) -> Result<Vec<Vec<RayHit>>, QueryError> {
        self.each_line(rays, of_ray, Scaled::new, All::about, |all| {
            all.hits().into_iter().map(|(_, hit)| hit).collect()
        })
    }

    /// Answers [`Querier::segment_hit`] for each segment, given by its ends.
    ///
    /// # Errors
    /// The error of the first segment that fails.
    pub fn segment_hits(&self, segments: &[[[f64; 3]; 2]]) -> Result<Vec<bool>, QueryError> {
        self.each_line(
            segments,
            of_segment,
            |[from, to]| Ok([check_point(from)?, check_point(to)?]),
            MeetsSegment::about,
            |segment| segment.met,
        )
    }

    /// Answers [`Querier::visible`] for the two points of each pair.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the margin is negative or not finite; else the error of the first pair that fails.
    pub fn visible(&self, pairs: &[[[f64; 3]; 2]], margin: f64) -> Result<Vec<bool>, QueryError> {
        check_margin(margin)?;
        let read = |[from, to]: &[[f64; 3]; 2]| MeetsSegment::without_ends(*from, *to, margin);
        self.each_line(pairs, of_segment, read, |question| question, |question| !question.met)
    }

    /// Asks about each probe, in the order of their places along the curve.
    fn each<P: Sync, R: Send>(
        &self,
        probes: &[P],
        at: impl Fn(&P) -> [f64; 3],
        ask: impl Fn(&mut Querier, &P) -> Result<R, QueryError> + Sync,
    ) -> Result<Vec<R>, QueryError> {
        let order = along_curve(&probes.iter().map(at).collect::<Vec<_>>());
        self.runs(Some(&order), probes.len(), |querier, numbers, run| {
            for number in numbers {
                run.add(number, ask(querier, &probes[number]));
            }
        })
    }

    /// Asks a question about each line, some at a time. `read` checks a line, `about` makes a question of it, and `answer` answers it.
    fn each_line<P: Sync, S, Q: LineQuestion, R: Send>(
        &self,
        lines: &[P],
        line: impl Fn(&P) -> [[f64; 3]; 2],
        read: impl Fn(&P) -> Result<S, QueryError> + Sync,
        about: impl Fn(S) -> Q + Sync,
        answer: impl Fn(&mut Q) -> R + Sync,
    ) -> Result<Vec<R>, QueryError> {
        let is_large = self.shape.shape.bvh().bytes().len() >= MIN_SORTED_BYTES;
        let order = if is_large { along_lines(self.middle(), lines, line) } else { None };
        self.runs(order.as_deref(), lines.len(), |querier, numbers, run| {
            let mut questions = Vec::with_capacity(LINES_AT_ONCE);
            loop {
                let (mut of, mut count, mut are_read) = ([0; LINES_AT_ONCE], 0, true);
                questions.clear();
                for number in (&mut *numbers).take(LINES_AT_ONCE) {
                    (of[count], count) = (number, count + 1);
                    match read(&lines[number]) {
                        Ok(line) => questions.push(about(line)),
                        Err(_) => are_read = false,
                    }
                }
                if count == 0 {
                    break;
                }
                if are_read && querier.ask_lines(&self.shape, &mut questions).is_ok() {
                    for (question, number) in questions.iter_mut().zip(of) {
                        run.add(number, Ok(answer(question)));
                    }
                    continue;
                }
                // One of them has an error.
                for &number in &of[..count] {
                    run.add(
                        number,
                        read(&lines[number]).and_then(|line| {
                            let mut question = about(line);
                            querier.start();
                            querier.ask_line(&self.shape, &mut question)?;
                            Ok(answer(&mut question))
                        }),
                    );
                }
            }
        })
    }

    /// Returns the middle of the shape's first object, in the frame of the probes, and half its diagonal.
    fn middle(&self) -> ([f64; 3], f64) {
        let [lo, hi] =
            self.shape.shape.objects().first().map_or([[0.0; 3]; 2], |object| object.bounding_box());
        let (middle, half) =
            ([0, 1, 2].map(|k| lo[k] / 2.0 + hi[k] / 2.0), [0, 1, 2].map(|k| hi[k] / 2.0 - lo[k] / 2.0));
        let reach = half[0].hypot(half[1]).hypot(half[2]);
        (self.shape.pose.map_or(middle, |pose| pose.place(middle)), reach)
    }

    /// Calls `ask` with runs of numbers of probes, in an order, and returns the answers in the order of the probes.
    fn runs<R: Send>(
        &self,
        order: Option<&[u32]>,
        count: usize,
        ask: impl Fn(&mut Querier, &mut dyn Iterator<Item = usize>, &mut Run<R>) + Sync,
    ) -> Result<Vec<R>, QueryError> {
        let number = |place: usize| order.map_or(place, |order| order[place] as usize);
        let mut answers: Vec<Option<R>> = Vec::with_capacity(count);
        if order.is_some() {
            answers.resize_with(count, || None);
        }
        let (mut place, mut failed) = (0, None::<(usize, QueryError)>);
        // An error ends no run, because a probe that comes later along the curve may be the first that fails.
        let Ok(()) = self.pool.runs(
            rayon::current_num_threads(),
            count,
            PROBES_PER_RUN,
            |querier, places| {
                let answers = Vec::with_capacity(PROBES_PER_RUN.min(count));
                let mut run = Run { answers, failed: None };
                ask(querier, &mut places.map(number), &mut run);
                Ok::<_, (usize, Infallible)>(run)
            },
            |mut run| {
                if order.is_none() {
                    answers.append(&mut run.answers);
                }
                for answer in run.answers {
                    answers[number(place)] = answer;
                    place += 1;
                }
                failed = failed.take().into_iter().chain(run.failed).min_by_key(|(number, _)| *number);
            },
        );
        if let Some((_, error)) = failed {
            return Err(error);
        }
        let all = answers.into_iter();
        Ok(all.map(|answer| answer.unwrap_or_else(|| unreachable!("each probe has an answer"))).collect())
    }
}

/// The answers of a run.
struct Run<R> {
    /// None for a probe that failed.
    answers: Vec<Option<R>>,
    /// The first probe that failed.
    failed: Option<(usize, QueryError)>,
}

impl<R> Run<R> {
    #[inline(always)]
    fn add(&mut self, number: usize, answer: Result<R, QueryError>) {
        match answer {
            Ok(answer) => self.answers.push(Some(answer)),
            Err(error) => {
                if self.failed.as_ref().is_none_or(|&(first, _)| number < first) {
                    self.failed = Some((number, error));
                }
                self.answers.push(None);
            }
        }
    }
}

/// Returns the origin and the direction of a ray.
fn of_ray(ray: &Ray) -> [[f64; 3]; 2] {
    [ray.origin, ray.direction]
}

/// Returns the start of a segment, and what leads to its end.
fn of_segment([from, to]: &[[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [*from, [0, 1, 2].map(|k| to[k] - from[k])]
}

/// Returns the numbers of lines in an order in which neighbours meet the same parts of a shape: by the signs of their directions, and
/// then along a curve through where they pass its middle. Returns nothing for lines that start in one point, as those of a camera or
/// a scanner do, which are in such an order.
fn along_lines<P>(
    (middle, reach): ([f64; 3], f64),
    lines: &[P],
    line: impl Fn(&P) -> [[f64; 3]; 2],
) -> Option<Vec<u32>> {
    let first = lines.first().map(&line)?[0];
    if lines.iter().all(|of| line(of)[0] == first) {
        return None;
    }
    let (corner, cells) = (middle.map(|x| x - reach), 32768.0 / reach);
    let key = |of: &P| {
        let [origin, direction] = line(of);
        let squared = direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2];
        let to = [0, 1, 2].map(|k| middle[k] - origin[k]);
        let along = (to[0] * direction[0] + to[1] * direction[1] + to[2] * direction[2]) / squared;
        let passing = [0, 1, 2].map(|k| origin[k] + along * direction[k]);
        let signs = (0..3).fold(0, |signs, k| signs | u64::from(direction[k] < 0.0) << k);
        signs << 48 | place_on_curve(&passing, &corner, cells)
    };
    // The number of the line takes the place of the lowest bits, which tell only neighbours apart.
    let mut order: Vec<u64> =
        lines.iter().map(key).zip(0..).map(|(key, number)| key >> 19 << 32 | number).collect();
    order.sort_unstable();
    Some(order.into_iter().map(|key| key as u32).collect())
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
    let code = |point: &[f64; 3]| place_on_curve(point, &lo, cells);
    let mut order: Vec<(u64, u32)> = points.iter().map(code).zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, number)| number).collect()
}

/// Returns the place of a point along a Morton curve of 2^16 cells along each axis from a corner on. Points beyond the cells are in the
/// outermost ones, and a point that is no point counts as 0.
fn place_on_curve(point: &[f64; 3], corner: &[f64; 3], cells: f64) -> u64 {
    let cell = |axis: usize| every_third_bit(((point[axis] - corner[axis]) * cells) as u16);
    cell(0) | cell(1) << 1 | cell(2) << 2
}

/// Moves bit i to place 3i.
fn every_third_bit(bits: u16) -> u64 {
    let bits = u64::from(bits);
    let bits = (bits | bits << 16) & 0xff00_00ff;
    let bits = (bits | bits << 8) & 0x00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x0c30_c30c_30c3;
    (bits | bits << 2) & 0x2492_4924_9249
}
