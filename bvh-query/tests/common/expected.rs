//! Asks every query about two meshes, also large ones, and compares the answers with the truth in a pose.

use super::nearest::point_triangle;
use super::tally::Tally;
use super::truth::{Surface, Truth};
use bvh_query::{Bvh, Contact, Distance, DistanceOptions, Pose, Querier};
use cbvh_testkit::exact::Length;

/// The largest error of a distance, as a fraction of the size.
const TOLERANCE: f64 = 1e-12;

/// What is true of two meshes in a pose, computed once for many files that hold them.
pub(crate) struct Expected<'a> {
    truth: Truth<'a>,
    contacts: Vec<Contact>,
    /// The exact distances of pairs that may be the nearest.
    nearest: Vec<Length>,
    tolerance: f64,
}

impl<'a> Expected<'a> {
    pub(crate) fn new(a: &'a Surface, b: &'a Surface, pose: &Pose) -> Self {
        Self::within(a, b, pose, f64::INFINITY)
    }

    /// Computes the answers as `new` does, but looks for nearest pairs only up to `reach`. This is for large meshes:
    /// it shows that nothing is nearer than their answer.
    pub(crate) fn within(a: &'a Surface, b: &'a Surface, pose: &Pose, reach: f64) -> Self {
        let truth = Truth::new(a, b, pose);
        let contacts = truth.contacts(&mut Tally::default());
        let nearest = if contacts.is_empty() { truth.nearest(reach) } else { Vec::new() };
        let tolerance = TOLERANCE * truth.size;
        Self { truth, contacts, nearest, tolerance }
    }

    /// The contacts, in the order of answers.
    pub(crate) fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Asks every query on all backends. Returns the distance, on which they must agree.
    pub(crate) fn check(&self, a: &Bvh, b: &Bvh, pose: &Pose, queriers: &mut [Querier]) -> Distance {
        let first = queriers[0].distance(a, b, pose).unwrap();
        self.check_distance(&first);
        for querier in queriers {
            let touching = !self.contacts.is_empty();
            assert_eq!(querier.collide(a, b, pose).unwrap(), touching, "{}", querier.backend());
            assert_eq!(querier.contacts(a, b, pose).unwrap(), self.contacts, "{}", querier.backend());
            let answer = querier.distance(a, b, pose).unwrap();
            assert_eq!(answer, first, "{}", querier.backend());
            let fresh = Querier::with_backend(querier.backend()).distance(a, b, pose).unwrap();
            assert_eq!(answer, fresh, "{}", querier.backend());
            let d = answer.distance;
            let Distance { lower, upper, .. } = answer;
            let ends = [d, lower, upper].into_iter().flat_map(|x| [x.next_down(), x, x.next_up()]);
            let far = [0.0, f64::MAX, f64::MIN_POSITIVE, d * 3.0, d * 0.5];
            let near = [upper * (1.0 + 1e-9), lower * (1.0 - 1e-9)];
            for limit in ends.chain(far).chain(near) {
                // For limits between `lower` and `upper`, integers decide; the tests with an exact oracle cover
                // those.
                if limit < 0.0 || lower <= limit && limit < upper {
                    continue;
                }
                let within = querier.within(a, b, pose, limit).unwrap();
                assert_eq!(within, limit >= upper, "{} within {limit}, {answer:?}", querier.backend());
            }
            for (rel_err, abs_err) in [(0.2, 0.0), (0.0, 0.1 * d), (0.05, 0.01 * d)] {
                let options = DistanceOptions::new().rel_err(rel_err).abs_err(abs_err);
                let rough = querier.distance_with(a, b, pose, &options).unwrap();
                let allowed = d * (1.0 + rel_err) + abs_err + self.tolerance;
                assert!((d..=allowed).contains(&rough.distance), "{rough:?}, least {d}, {options:?}");
                assert!(rough.lower <= first.upper, "{rough:?}, least {d}, {options:?}");
                let proved = rough.lower * (1.0 + rel_err) + abs_err + self.tolerance;
                assert!(rough.distance <= proved, "{rough:?}, {options:?}");
            }
        }
        first
    }

    pub(crate) fn check_distance(&self, answer: &Distance) {
        let [a, b] = self.truth.triangles(answer).expect("the triangles are there").map(|of| &of.corners);
        let d = answer.distance;
        let &Distance { object_a, triangle_a, object_b, triangle_b, .. } = answer;
        let named = Contact { object_a, triangle_a, object_b, triangle_b };
        assert_eq!(d == 0.0, self.contacts.contains(&named), "{named:?} at {d}");
        assert_eq!(d == 0.0, !self.contacts.is_empty(), "{named:?} at {d}");
        let pair = Length::between(a, b);
        assert!(pair.is(d, self.tolerance), "{d} is not the distance of {named:?}");
        assert!(answer.lower <= d && d <= answer.upper, "{answer:?}");
        assert!(pair.compare(answer.lower).is_ge() && pair.compare(answer.upper).is_le(), "{answer:?}");
        assert!(d == 0.0 || !self.nearest.is_empty(), "nothing is as near as {d}");
        for exact in &self.nearest {
            assert!(
                exact.compare(d - self.tolerance).is_ge(),
                "{d}, but a pair is {:e} apart",
                exact.floor()
            );
            assert!(
                exact.compare(answer.lower).is_ge(),
                "{answer:?}, but a pair is {:e} apart",
                exact.floor()
            );
        }
        let gap = [0, 1, 2].map(|k| answer.point_a[k] - answer.point_b[k]);
        let largest = gap.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let length = largest * gap.iter().map(|x| (x / largest).powi(2)).sum::<f64>().sqrt();
        // Points of meshes far from the origin are rounded to the coarser spacing of f64 there.
        let magnitude = answer.point_a.iter().chain(&answer.point_b).fold(0.0, |m: f64, x| m.max(x.abs()));
        let rounding = 4.0 * f64::EPSILON * magnitude;
        assert!((length - d).abs() <= self.tolerance + rounding, "{answer:?}: the points are {length} apart");
        for (point, triangle) in [(answer.point_a, a), (answer.point_b, b)] {
            let off = point_triangle(point, triangle);
            assert!(off <= self.tolerance + rounding, "{answer:?}: a point is {off} off its triangle");
        }
    }
}
