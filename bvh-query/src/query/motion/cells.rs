//! The search over time: it skips intervals that are certainly free, and decides the remaining cells.
//!
//! ```text
//! intervals := {[0, 1]}
//! while interval := earliest(intervals):
//!     if it is a cell: decide it
//!     else if a sweep shows that the meshes are apart all the time: skip it
//!     else if its end is within the clearance, or few pairs of triangles are left:
//!         descend to the cell that is likely to have the first contact, and sweep the intervals before it in groups
//!     else: halve it
//! ```
//!
//! After an undecided cell, only hits matter, so that an interval is skipped even if the meshes come nearer than a cell reaches.
//!
//! Descending is a guess, and a wrong guess costs little. The search does not assume that the time before the cell is
//! free: it sweeps that time or searches it. The time after the cell waits.

use crate::error::{NumberError, QueryError};
use crate::pose::Pose;
use crate::query::displacement::displacement;
use crate::query::motion::limits::{MAX_DEPTH, Middle, Question, TimeSpan};
use crate::query::motion::sweep::Room;
use crate::query::motion::swept_pairs::{Kept, Sweep};
use crate::query::placed_pair::each_pair;
use crate::query::querier::Querier;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};

/// The most pairs of triangles that an interval passes on to its parts.
const MOST_PAIRS: usize = 24;
/// The most pairs of packets that the first walk tests; each halving allows eight times as many. A walk of a long
/// interval in which many packets are near is given up early. In a short interval, all of them must be tested in the
/// end.
const FIRST_PACKET_TESTS: u64 = 12;
/// An interval that ends within the clearance is swept if B moves by less than this fraction of the larger object's
/// diagonal. Few pairs of triangles are likely to be left then.
const FINE: f64 = 1.0 / 4096.0;
/// The search guesses no time of contact in an interval in which B moves by less than this many times the tolerance.
/// Guessing would take as many steps as the interval has cells.
const LEAST_GUESSED: f64 = 16.0;
/// The most intervals that may wait while a search for any hit takes long intervals first.
const MOST_SPREAD: usize = 64;
/// Bounds how close to a guessed contact several intervals are swept together. From the end of such a group to the
/// contact, B must still move by at least this many times the gap that a sweep of the group needs. The value only
/// divides the work; it affects no answer.
const SAFE_REST: f64 = 4.0;

/// What a search has found.
pub(super) enum Outcome {
    Free,
    Hit { free_until: f64, touching_at: f64 },
    Undecided { free_until: f64, at: f64 },
}

/// An interval of time to search, which comes from halving the whole time `depth` times.
#[derive(Clone)]
struct Interval {
    span: TimeSpan,
    depth: u32,
    /// Whether the end is within the clearance, if that is known. If it is, no sweep can separate the meshes all the
    /// time.
    ends_within: Option<bool>,
    /// If there are few, pairs of triangles that include all pairs that are not apart all the time.
    pairs: Option<Kept>,
}

/// The outcome for a cell.
enum Cell {
    Clear,
    Hit,
    Undecided,
}

/// The earliest hit that several parallel searches have found so far.
pub(crate) struct Earliest(AtomicU64);

impl Earliest {
    /// No search has found any.
    pub(crate) fn new() -> Self {
        Self(AtomicU64::new(f64::INFINITY.to_bits()))
    }

    fn time(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    fn lower(&self, time: f64) {
        // Numbers from 0 on are ordered as their bits are.
        self.0.fetch_min(time.to_bits(), Ordering::Relaxed);
    }
}

/// A search for the first hit, or for any.
pub(super) struct TimeSearch<'s, 'a> {
    querier: &'s mut Querier,
    question: &'s Question<'a>,
    /// The start of the interval that is looked at in the order of time: all before has been decided.
    pub(super) decided_until: f64,
    /// The start and the middle of the first undecided cell.
    undecided: Option<(f64, f64)>,
}

impl<'s, 'a> TimeSearch<'s, 'a> {
    pub(super) fn new(querier: &'s mut Querier, question: &'s Question<'a>) -> Self {
        Self { querier, question, decided_until: 0.0, undecided: None }
    }

    /// Returns the first hit, or the first cell that is undecided. It ignores the time after the earliest hit of all
    /// parallel searches.
    pub(super) fn first(&mut self, earliest: &Earliest) -> Result<Outcome, QueryError> {
        let found = self.first_before(earliest)?;
        if let Outcome::Hit { touching_at, .. } = found {
            earliest.lower(touching_at);
        }
        Ok(found)
    }

    fn first_before(&mut self, earliest: &Earliest) -> Result<Outcome, QueryError> {
        let whole = self.whole();
        if self.is_hit(&whole.span.poses[0])? {
            return Ok(Outcome::Hit { free_until: 0.0, touching_at: 0.0 });
        }
        let found = self.in_order(whole, earliest)?;
        if let Outcome::Undecided { free_until, .. } = found
            && self.is_hit(&self.question.path.pose(1.0))?
        {
            return Ok(Outcome::Hit { free_until, touching_at: 1.0 });
        }
        Ok(found)
    }

    /// Looks at an interval and its parts in the order of time.
    fn in_order(&mut self, interval: Interval, earliest: &Earliest) -> Result<Outcome, QueryError> {
        let mut todo = vec![interval];
        while let Some(interval) = todo.pop() {
            self.decided_until = interval.span.times[0];
            if self.decided_until > earliest.time() {
                break;
            }
            let middle = self.middle(&interval.span)?;
            if self.is_cell(&middle) {
                let start = interval.span.times[0];
                match self.decide(&interval, &middle)? {
                    Cell::Clear => {}
                    Cell::Hit => {
                        let free_until = self.undecided.map_or(start, |(free_until, _)| free_until);
                        return Ok(Outcome::Hit { free_until, touching_at: middle.at });
                    }
                    Cell::Undecided => _ = self.undecided.get_or_insert((start, middle.at)),
                }
            } else {
                self.look(interval, &middle, &mut todo)?;
            }
        }
        Ok(self.undecided.map_or(Outcome::Free, |(free_until, at)| Outcome::Undecided { free_until, at }))
    }

    /// Returns whether there is neither a hit nor an undecided cell. Long intervals come first while there are few of
    /// them, because poses that are spread over the path find a hit earlier.
    pub(super) fn is_free(&mut self) -> Result<bool, QueryError> {
        let (whole, clearance) = (self.whole(), self.question.clearance);
        if self.is_hit(&whole.span.poses[0])? {
            return Ok(false);
        }
        let mut todo = VecDeque::from([whole]);
        loop {
            let spread = todo.len() < MOST_SPREAD;
            let Some(mut interval) = (if spread { todo.pop_front() } else { todo.pop_back() }) else {
                return Ok(true);
            };
            let middle = self.middle(&interval.span)?;
            if self.is_cell(&middle) {
                if !matches!(self.decide(&interval, &middle)?, Cell::Clear) {
                    return Ok(false);
                }
                continue;
            }
            interval.pairs = self.not_apart(&interval, &middle.pose)?;
            let hits = match &interval.pairs {
                Some(pairs) if pairs.left().is_empty() => continue,
                // Of a few pairs, the first one is the likeliest.
                Some(pairs) => self.querier.any_pair_within(&pairs.left()[..1], &middle.pose, clearance),
                None => self.is_within(&middle.pose, clearance)?,
            };
            if hits {
                return Ok(false);
            }
            let halves = self.halves(&interval, &middle)?;
            if spread { todo.extend(halves) } else { todo.extend(halves.into_iter().rev()) }
        }
    }

    fn whole(&self) -> Interval {
        Interval { span: self.question.span(0.0, 1.0), depth: 0, ends_within: None, pairs: None }
    }

    /// Returns the middle of an interval, and charges it to the budget, because it takes a step for each object of B.
    fn middle(&mut self, span: &TimeSpan) -> Result<Middle, QueryError> {
        self.querier.memory.budget.charge(self.question.b.objects().len() as u64)?;
        Ok(self.question.middle(span))
    }

    fn is_cell(&self, middle: &Middle) -> bool {
        middle.reach <= self.question.tolerance / 8.0
    }

    /// Decides a cell by the definition.
    fn decide(&mut self, interval: &Interval, middle: &Middle) -> Result<Cell, QueryError> {
        let (clearance, may_be_inside) = (self.question.clearance, self.may_be_inside());
        let mut is_within = |d: f64| match &interval.pairs {
            Some(pairs) => Ok(self.querier.any_pair_within(pairs.left(), &middle.pose, d)),
            None => self.is_within(&middle.pose, d),
        };
        // Rounded up: where the reach is small beside the clearance, it must not vanish.
        let near = is_within((clearance + middle.reach).next_up())?;
        if near && is_within(clearance)? || may_be_inside && self.is_inside(&middle.pose)? {
            return Ok(Cell::Hit);
        }
        Ok(if near { Cell::Undecided } else { Cell::Clear })
    }

    /// Adds what is left of an interval to the intervals to look at, of which the last one comes next.
    fn look(
        &mut self,
        mut interval: Interval,
        middle: &Middle,
        todo: &mut Vec<Interval>,
    ) -> Result<(), QueryError> {
        // Do not descend into an interval that cannot be halved: it would come back unchanged.
        let can_halve = interval.depth < MAX_DEPTH;
        let ends_within = interval.pairs.is_none() && interval.ends_within == Some(true);
        if can_halve && ends_within && middle.reach > FINE * self.question.size {
            return self.descend(interval, None, todo);
        }
        interval.pairs = self.not_apart(&interval, &middle.pose)?;
        if let Some(pairs) = &interval.pairs {
            if pairs.left().is_empty() {
                return self.skip(interval, middle, todo);
            }
            if can_halve
                && middle.reach > LEAST_GUESSED * self.question.tolerance
                && let Some(time) = self.querier.contact_time(self.question, &interval.span, pairs.left())
            {
                return self.descend(interval, Some(time), todo);
            }
        }
        let mut halves = self.halves(&interval, middle)?;
        if interval.pairs.is_none() {
            let clearance = self.question.clearance;
            halves[0].ends_within = Some(self.is_within(&middle.pose, clearance)?);
            if interval.ends_within.is_none() {
                halves[1].ends_within = Some(self.is_within(&interval.span.poses[1], clearance)?);
            }
        }
        todo.extend(halves.into_iter().rev());
        Ok(())
    }

    /// Leaves out an interval in which the surfaces are apart all the time. If a part is inside a solid, it is inside all that
    /// time, and the first cell is a hit.
    fn skip(
        &mut self,
        mut interval: Interval,
        middle: &Middle,
        todo: &mut Vec<Interval>,
    ) -> Result<(), QueryError> {
        if !self.may_be_inside() || !self.is_inside(&middle.pose)? {
            return Ok(());
        }
        loop {
            let middle = self.middle(&interval.span)?;
            if self.is_cell(&middle) {
                todo.push(interval);
                return Ok(());
            }
            [interval, _] = self.halves(&interval, &middle)?;
        }
    }

    /// Returns whether a part may have passed the surface of a solid shape: an undecided cell came before.
    fn may_be_inside(&self) -> bool {
        self.question.is_solid && self.undecided.is_some()
    }

    /// Returns how far apart parts must be at both ends of an interval to be left out. Before the first undecided cell, all cells
    /// of what is left out are clear. After it, only hits matter, and none of these cells is one.
    fn limit(&self, span: &TimeSpan) -> f64 {
        self.question.limit(span, self.reach(span))
    }

    /// How far B may be from its pose in the middle of a cell, if cells that are not clear matter.
    fn reach(&self, span: &TimeSpan) -> f64 {
        if self.undecided.is_none() { self.question.reach_of_cells(span) } else { 0.0 }
    }

    /// Returns whether a pose is a hit.
    fn is_hit(&mut self, pose: &Pose) -> Result<bool, QueryError> {
        Ok(self.is_within(pose, self.question.clearance)?
            || self.question.is_solid && self.is_inside(pose)?)
    }

    /// Returns whether a part of one shape is inside the other, which is solid.
    fn is_inside(&mut self, pose: &Pose) -> Result<bool, QueryError> {
        Ok(self.querier.inside_point(self.question.a, self.question.b, pose)?.is_some())
    }

    /// Descends to the cell of a contact and adds it, with the intervals left on the way down. If a time is given, the
    /// cell is the one at that time. Otherwise it halves between a time without contact and one with it, until B moves
    /// little.
    fn descend(
        &mut self,
        mut interval: Interval,
        time: Option<f64>,
        todo: &mut Vec<Interval>,
    ) -> Result<(), QueryError> {
        let mut passed = Vec::new();
        loop {
            let middle = self.middle(&interval.span)?;
            let is_fine = time.is_none() && middle.reach <= FINE * self.question.size;
            // An interval too deep to be halved is an error only when its turn comes.
            if is_fine || self.is_cell(&middle) || interval.depth == MAX_DEPTH {
                break;
            }
            let is_before = match time {
                Some(time) => time < middle.at,
                None => self.is_within(&middle.pose, self.question.clearance)?,
            };
            let [mut left, right] = self.halves(&interval, &middle)?;
            left.ends_within = time.is_none().then_some(is_before);
            if is_before {
                todo.push(right);
                interval = left;
            } else {
                passed.push(left);
                interval = right;
            }
        }
        let contact = self.question.span(time.unwrap_or(interval.span.times[1]), 1.0);
        todo.push(interval);
        self.pass(passed, &contact, todo)
    }

    /// Adds those of some adjoining intervals before a contact that a sweep does not clear, in the order of time.
    fn pass(
        &mut self,
        passed: Vec<Interval>,
        contact: &TimeSpan,
        todo: &mut Vec<Interval>,
    ) -> Result<(), QueryError> {
        let first_new = todo.len();
        let mut rest = passed.as_slice();
        while let [first, ..] = rest {
            let (count, span) = self.safe_stretch(rest, contact);
            let (group, later) = rest.split_at(count);
            rest = later;
            if count == 1 {
                todo.push(first.clone());
                continue;
            }
            let joined = Interval { span, ..first.clone() };
            let middle = self.question.middle(&span).pose;
            let pairs = self.not_apart(&joined, &middle)?;
            let is_apart = pairs.as_ref().is_some_and(|pairs| pairs.left().is_empty());
            if !is_apart || self.may_be_inside() && self.is_inside(&middle)? {
                todo.extend(group.iter().map(|one| Interval { pairs: pairs.clone(), ..one.clone() }));
            }
        }
        todo[first_new..].reverse();
        Ok(())
    }

    /// Returns how many of some adjoining intervals one sweep is likely to clear together, and their union.
    fn safe_stretch(&self, rest: &[Interval], contact: &TimeSpan) -> (usize, TimeSpan) {
        let start = &rest[0].span;
        let (time, pose) = (contact.times[0], contact.poses[0]);
        let speed = displacement(self.question.b, &start.poses[0], &pose) / (time - start.times[0]);
        let joined = |count: usize| {
            let end = &rest[count - 1].span;
            TimeSpan { times: [start.times[0], end.times[1]], poses: [start.poses[0], end.poses[1]] }
        };
        let is_safe = |count: &usize| {
            let span = joined(*count);
            speed * (time - span.times[1]) >= SAFE_REST * self.limit(&span)
        };
        let count = (2..=rest.len()).rev().find(is_safe).unwrap_or(1);
        (count, joined(count))
    }

    /// Halves an interval.
    fn halves(&self, interval: &Interval, middle: &Middle) -> Result<[Interval; 2], QueryError> {
        if interval.depth == MAX_DEPTH {
            return Err(NumberError::Unresolved(self.question.tolerance).into());
        }
        let TimeSpan { times: [t0, t1], poses: [start, end] } = interval.span;
        let half = |times, poses, ends_within| Interval {
            span: TimeSpan { times, poses },
            depth: interval.depth + 1,
            ends_within,
            pairs: interval.pairs.clone(),
        };
        Ok([
            half([t0, middle.at], [start, middle.pose], None),
            half([middle.at, t1], [middle.pose, end], interval.ends_within),
        ])
    }

    /// Returns pairs of triangles that include all that may come within the clearance during an interval, or `None` if
    /// there are many. If the list is not empty, its first pair may do so.
    fn not_apart(&mut self, interval: &Interval, middle: &Pose) -> Result<Option<Kept>, QueryError> {
        let question = self.question;
        let [start, end] = interval.span.poses;
        let reach = self.reach(&interval.span);
        let [limit, box_limit] =
            [question.limit(&interval.span, reach), question.box_limit(&interval.span, reach)];
        let sweep = Sweep { start, middle: *middle, end, limit, box_limit };
        let pairs = match &interval.pairs {
            Some(pairs) => pairs.clone(),
            None => {
                let packet_tests = FIRST_PACKET_TESTS << (3 * interval.depth).min(48);
                let room = Room { pairs: MOST_PAIRS, packet_tests };
                let mut found = Vec::new();
                let is_crowded = each_pair(question.a, question.b, middle, |placed| {
                    let is_whole = self.querier.sweep((placed, &sweep), &mut found, room)?;
                    Ok((!is_whole).then_some(()))
                })?;
                if is_crowded.is_some() {
                    return Ok(None);
                }
                Kept::new(found)
            }
        };
        self.querier.memory.budget.visit()?;
        // One pair that is not apart suffices. It is the first one to look at in both halves; those before it are apart all
        // the time, and those behind it are not looked at yet.
        Ok(Some(self.querier.leave_out(&sweep, pairs)))
    }

    /// Returns whether the meshes are at most `d` apart in a pose.
    fn is_within(&mut self, pose: &Pose, d: f64) -> Result<bool, QueryError> {
        self.querier.cores_within(self.question.a, self.question.b, pose, d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::bvh::Bvh;
    use crate::isa::Backend;
    use crate::motion::Motion;
    use crate::query::motion::MotionOptions;
    use crate::query::motion::swept_pairs::SweptPair;
    use bvh_bake::mesh::Mesh;

    type Triangle = [[f64; 3]; 3];

    /// A mesh of one triangle, whose vertices are rounded to `f32`.
    fn baked(triangle: &Triangle) -> Bvh {
        let corners = triangle.map(|corner| corner.map(|x| f64::from(x as f32)));
        let mesh = Mesh::from_triangles(corners.to_vec(), vec![[0, 1, 2]]);
        Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default()).unwrap().0).unwrap()
    }

    /// Asks about two triangles whose vertices need not be `f32`: the search as it is when one pair is left of a walk. The
    /// meshes say only how far B may be from its frame's origin, which does not matter for a translation.
    fn ask(backend: Backend, pair: SweptPair, path: &Motion, tolerance: f64) -> Outcome {
        let (a, b) = (baked(&pair.a), baked(&pair.b));
        let options = MotionOptions::new().tolerance(tolerance);
        let question = Question::new(a.all(), b.all(), path, &options).unwrap();
        let mut querier = Querier::with_backend(backend);
        querier.start();
        let mut search = TimeSearch::new(&mut querier, &question);
        let interval = Interval { pairs: Some(Kept::new(vec![pair])), ..search.whole() };
        let mut touches_at =
            |time: usize| search.querier.any_pair_within(&[pair], &interval.span.poses[time], 0.0);
        if touches_at(0) {
            return Outcome::Hit { free_until: 0.0, touching_at: 0.0 };
        }
        let touches_at_end = touches_at(1);
        match search.in_order(interval, &Earliest::new()).unwrap() {
            Outcome::Undecided { free_until, .. } if touches_at_end => {
                Outcome::Hit { free_until, touching_at: 1.0 }
            }
            outcome => outcome,
        }
    }

    /// Translations of a triangle, an edge or a point past another, with labels from rational arithmetic; many touch at the
    /// start, or only just. A point meets a triangle at one instant, which may be no `f64`; then the answer is undecided.
    fn check_translations(path: &str) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let text = std::fs::read_to_string(path).unwrap();
        // By label: free and hit.
        let (mut all, mut undecided) = ([0; 2], [0; 2]);
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let is_labelled_hit = words[2] == "1";
            let numbers: Vec<f64> = words[4..].iter().map(|word| word.parse().unwrap()).collect();
            let points = numbers.as_chunks::<3>().0;
            let pair =
                SweptPair { a: [points[0], points[1], points[2]], b: [points[3], points[4], points[5]] };
            let moved = Pose::new(*Pose::IDENTITY.rotation(), points[6]).unwrap();
            let path = Motion::between(&Pose::IDENTITY, &moved).unwrap();
            let size = points[..6].as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                all[usize::from(is_labelled_hit)] += 1;
                match ask(backend, pair, &path, 1e-11 * size) {
                    Outcome::Free => assert!(!is_labelled_hit, "free: {line}"),
                    Outcome::Hit { .. } => assert!(is_labelled_hit, "hit: {line}"),
                    Outcome::Undecided { .. } => undecided[usize::from(is_labelled_hit)] += 1,
                }
            }
        }
        assert!(
            20 * undecided[0] < all[0] && undecided[1] < all[1],
            "{undecided:?} of {all:?} are undecided"
        );
    }

    #[test]
    fn translations_of_f64_triangles_are_as_labelled() {
        check_translations("../testdata/labelled/translations.txt");
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn more_translations_of_f64_triangles_are_as_labelled() {
        check_translations("../../shared/motions/ccd/translations.txt");
    }
}
