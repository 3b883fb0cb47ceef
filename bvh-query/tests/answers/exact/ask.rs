//! Asks every query on every backend, and compares the answers with the truth.
//!
//! These are the promises: `collide` and `contacts` are exact on the placed corners. `distance` is 0 exactly if the
//! meshes touch, and the true distance of the placed meshes lies between `lower` and `upper`. `within` is exact on
//! the placed meshes, too. All backends give the same answers.

use crate::common::tally::Tally;
use crate::common::truth::Truth;
use bvh_query::{Bvh, Contact, Distance, DistanceOptions, Pose, Querier};
use cbvh_testkit::exact::Length;

/// The largest error of the distance of two triangles in f64, relative to the largest difference between two of their
/// coordinates. The tests of the narrow phase allow the same error. A pair with the least such distance may be
/// farther apart than another pair by as much.
const ACCURACY: f64 = 1e-14;

/// Two files, and the queriers that ask about them.
pub(crate) struct Asked<'a> {
    pub(crate) a: &'a Bvh,
    pub(crate) b: &'a Bvh,
    pub(crate) queriers: &'a mut [Querier],
}

impl Asked<'_> {
    /// Asks every query about one pose.
    pub(crate) fn all(&mut self, truth: &Truth<'_>, pose: &Pose, tally: &mut Tally) -> Result<(), String> {
        let contacts = truth.contacts(tally);
        let touching = !contacts.is_empty();
        tally.poses += 1;
        self.collide(touching, pose, tally)?;
        for querier in &mut *self.queriers {
            let answer = querier.contacts(self.a, self.b, pose).map_err(|error| error.to_string())?;
            if answer != contacts {
                let backend = querier.backend();
                return Err(format!("{backend} contacts: {}", difference(&answer, &contacts)));
            }
        }
        let first = self.same_distance(pose)?;
        tally.queries += 2 * self.queriers.len() as u64;
        let &Distance { object_a, triangle_a, object_b, triangle_b, lower, upper, distance, .. } = &first;
        let pair = Contact { object_a, triangle_a, object_b, triangle_b };
        if (distance == 0.0) != touching || touching != contacts.binary_search(&pair).is_ok() {
            return Err(format!("distance {first:?}, but {} contacts", contacts.len()));
        }
        if touching {
            let whole = lower == 0.0 && upper == 0.0;
            return if whole { Ok(()) } else { Err(format!("touching, but {first:?}")) };
        }
        let named = truth.named(&first, tally).ok_or_else(|| format!("no such triangles: {first:?}"))?;
        let (least, span) = truth.distance(named.clone(), tally);
        tally.widths.push((upper - lower) / truth.size);
        if !(lower <= distance && distance <= upper) {
            return Err(format!("not in order: {first:?}"));
        }
        let named = named.0;
        if named.compare(lower).is_lt() || named.compare(upper).is_gt() {
            return Err(format!("{first:?}, but the named pair is {:e} apart", named.floor()));
        }
        if least.compare(distance - ACCURACY * span).is_lt() {
            return Err(format!("{first:?}, but another pair of size {span:e} is {:e} apart", least.floor()));
        }
        if least.compare(lower).is_lt() || least.compare(upper).is_gt() {
            tally.missed(format!("{first:?}, but the true distance is {:e}; {pose:?}", least.floor()));
        }
        self.rough(&least, span, truth.size, pose, tally)?;
        let floor = least.floor();
        let ends = [floor, distance, lower, upper].into_iter();
        let limits: Vec<_> = ends.flat_map(|x| [x.next_down(), x, x.next_up()]).collect();
        for limit in limits.into_iter().filter(|limit| *limit > 0.0) {
            let expected = least.compare(limit).is_le();
            if lower <= limit && limit < upper {
                tally.within[0] += 1;
                tally.within[1] += u64::from(expected != (distance <= limit));
            }
            self.within(limit, expected, pose, tally).map_err(|error| format!("{error}: {first:?}"))?;
        }
        Ok(())
    }

    /// Asks for a distance with an allowed error. `least` is the true distance, and `span` the size of its pair.
    fn rough(
        &mut self,
        least: &Length,
        span: f64,
        size: f64,
        pose: &Pose,
        tally: &mut Tally,
    ) -> Result<(), String> {
        for (rel_err, abs_err) in [(0.25, 0.0), (0.0, 1e-3 * size)] {
            for querier in &mut *self.queriers {
                tally.queries += 1;
                let options = DistanceOptions::new().rel_err(rel_err).abs_err(abs_err);
                let answer = querier.distance_with(self.a, self.b, pose, &options);
                let answer = answer.map_err(|error| error.to_string())?;
                let allowed = (least.floor().next_up() + ACCURACY * span) * (1.0 + rel_err) + abs_err;
                // The limit itself is computed with three roundings.
                if answer.distance <= 0.0 || answer.distance > allowed * (1.0 + 4.0 * f64::EPSILON) {
                    return Err(format!("{answer:?}, {options:?}, but {allowed:e} is allowed"));
                }
                if least.compare(answer.lower).is_lt() || least.compare(answer.upper).is_gt() {
                    let floor = least.floor();
                    tally.missed(format!(
                        "{answer:?}, {options:?}, but the true distance is {floor:e}; {pose:?}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Asks whether the meshes touch.
    pub(crate) fn collide(&mut self, expected: bool, pose: &Pose, tally: &mut Tally) -> Result<(), String> {
        for querier in &mut *self.queriers {
            tally.queries += 1;
            let answer = querier.collide(self.a, self.b, pose).map_err(|error| error.to_string())?;
            if answer != expected {
                return Err(format!("{} collide: {answer}", querier.backend()));
            }
        }
        Ok(())
    }

    fn within(&mut self, limit: f64, expected: bool, pose: &Pose, tally: &mut Tally) -> Result<(), String> {
        for querier in &mut *self.queriers {
            tally.queries += 1;
            let answer = querier.within(self.a, self.b, pose, limit).map_err(|error| error.to_string())?;
            if answer != expected {
                return Err(format!("{} within {limit:e}: {answer}", querier.backend()));
            }
        }
        Ok(())
    }

    /// Returns the distance, which must be the same on all backends.
    fn same_distance(&mut self, pose: &Pose) -> Result<Distance, String> {
        let mut first = None;
        for querier in &mut *self.queriers {
            let answer = querier.distance(self.a, self.b, pose).map_err(|error| error.to_string())?;
            let first = *first.get_or_insert(answer);
            if first != answer {
                return Err(format!("{} distance {answer:?}, first {first:?}", querier.backend()));
            }
        }
        first.ok_or_else(|| "no backend".to_owned())
    }
}

/// Says which contacts of the answer are wrong and which are missing.
pub(crate) fn difference(answer: &[Contact], expected: &[Contact]) -> String {
    let pairs = |these: &[Contact], those: &[Contact]| -> Vec<_> {
        let missing = these.iter().filter(|contact| those.binary_search(contact).is_err());
        missing.map(|contact| (contact.triangle_a, contact.triangle_b)).take(4).collect()
    };
    format!("wrong {:?}, missing {:?}", pairs(answer, expected), pairs(expected, answer))
}
