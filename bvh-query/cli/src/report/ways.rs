//! The methods to ask about a motion: samples, which programs without certified answers take, and the certified
//! answers. Also compares the answers of samples with the certified ones.
//!
//! Samples may miss a contact or find one late. They must not find one in a motion that is certified free: this would
//! be an error of the certified answer, or of the query about a pose.

use super::timing::median;
use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Querier, QueryError, RigidPath};

/// How many poses samplers ask about, with both ends.
pub(super) const SAMPLES: [u32; 7] = [10, 30, 100, 300, 1_000, 3_000, 10_000];

/// A way to ask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// Asks about equally spaced poses in the order of time, until one touches.
    Ordered(u32),
    /// [`Querier::motion`], which finds the first hit.
    Motion,
    /// [`Querier::is_free`], which looks for any hit.
    IsFree,
}

/// What is said about a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Said {
    /// No contact.
    Free,
    /// A contact at this time.
    Contact(f64),
    /// Not certified free, without a time.
    NotFree,
    /// Neither free nor a contact.
    Undecided,
}

impl Method {
    /// Returns all ways.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        SAMPLES.map(Self::Ordered).into_iter().chain([Self::Motion, Self::IsFree])
    }

    /// What each kind of way is, in tables and for people. Ways of a kind differ in the number of samples.
    pub(super) const KINDS: [[&'static str; 2]; 3] = [
        ["ordered samples", "samples in the order of time"],
        ["motion", "certified: first contact"],
        ["is_free", "certified: any contact"],
    ];

    /// Returns the place of its kind in [`Self::KINDS`].
    pub(super) fn kind(self) -> usize {
        match self {
            Self::Ordered(_) => 0,
            Self::Motion => 1,
            Self::IsFree => 2,
        }
    }

    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        Self::KINDS[self.kind()][0]
    }

    /// The name for people.
    pub(super) fn in_words(self) -> String {
        self.samples_in_words() + Self::KINDS[self.kind()][1]
    }

    /// The number of samples and a space.
    fn samples_in_words(self) -> String {
        self.samples().map_or(String::new(), |samples| format!("{samples} "))
    }

    /// Returns the number of samples.
    pub(super) fn samples(self) -> Option<u32> {
        if let Self::Ordered(samples) = self { Some(samples) } else { None }
    }

    /// Returns the times of its samples, in order.
    pub(super) fn times(self) -> Vec<f64> {
        let count = self.samples().unwrap_or(0);
        (0..count).map(|sample| f64::from(sample) / f64::from(count - 1)).collect()
    }

    /// Asks about a motion at the times of [`Self::times`]. Making the poses of samples is part of the work.
    pub(super) fn ask(
        self,
        times: &[f64],
        querier: &mut Querier,
        [a, b]: [&Bvh; 2],
        motion: &Motion,
    ) -> Result<Said, QueryError> {
        let options = MotionOptions::new();
        match self {
            Self::Motion => Ok(match querier.motion(a, b, motion, &options)? {
                MotionAnswer::Free => Said::Free,
                MotionAnswer::Hit { touching_at, .. } => Said::Contact(touching_at),
                MotionAnswer::Near { .. } => Said::Undecided,
            }),
            Self::IsFree => {
                Ok(if querier.is_free(a, b, motion, &options)? { Said::Free } else { Said::NotFree })
            }
            Self::Ordered(_) => {
                for &time in times {
                    if querier.collide(a, b, &motion.pose(time))? {
                        return Ok(Said::Contact(time));
                    }
                }
                Ok(Said::Free)
            }
        }
    }
}

/// The errors of one way to ask.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Errors {
    /// The number of certified hits for which the method says that the motion is free.
    pub(super) missed: u64,
    /// How late its first contacts are after the time until which the motion is certified free, as a fraction of the
    /// motion.
    pub(super) late_median: Option<f64>,
    pub(super) late_max: Option<f64>,
    /// Motions that a certified answer leaves undecided.
    pub(super) undecided: Option<u64>,
}

/// Returns the errors, and a line for each contradiction.
pub(super) fn judge(
    pair: &str,
    method: Method,
    certified: &[MotionAnswer],
    said: &[Said],
) -> (Errors, Vec<String>) {
    let both = || certified.iter().zip(said);
    // Only these find the first contact, and can be late with it.
    let finds_the_first = matches!(method, Method::Ordered(_) | Method::Motion);
    let late = both().filter_map(|(certified, said)| match (certified, said) {
        (MotionAnswer::Hit { free_until, .. }, Said::Contact(time)) => Some(time - free_until),
        _ => None,
    });
    let late: Vec<f64> = late.filter(|_| finds_the_first).collect();
    let missed = both().filter(|&(certified, &said)| is_hit(certified) && said == Said::Free);
    let undecided = both().filter(|&(certified, said)| is_undecided(certified, *said));
    let errors = Errors {
        missed: missed.count() as u64,
        late_max: late.iter().copied().reduce(f64::max),
        late_median: median(late),
        undecided: method.samples().is_none().then(|| undecided.count() as u64),
    };
    let samples = method.samples_in_words();
    let wrong = (1..).zip(both()).filter_map(|(number, (certified, &said))| {
        let text = contradiction(method, certified, said)?;
        Some(format!("{pair}, {samples}{}, motion {number}: {text}", method.name()))
    });
    (errors, wrong.collect())
}

pub(super) fn is_hit(certified: &MotionAnswer) -> bool {
    matches!(certified, MotionAnswer::Hit { .. })
}

/// Returns whether an answer other than free tells nothing: `is_free` does not say which motions it leaves undecided.
fn is_undecided(certified: &MotionAnswer, said: Said) -> bool {
    said == Said::Undecided || said == Said::NotFree && matches!(certified, MotionAnswer::Near { .. })
}

/// Says what is wrong.
fn contradiction(method: Method, certified: &MotionAnswer, said: Said) -> Option<String> {
    let free_until = match (certified, said) {
        (MotionAnswer::Free, Said::Free) => return None,
        (MotionAnswer::Free, _) => return Some(format!("expected a free way, found {said:?}")),
        (MotionAnswer::Hit { free_until, .. } | MotionAnswer::Near { free_until, .. }, _) => *free_until,
    };
    match said {
        Said::Contact(time) if time < free_until => {
            Some(format!("expected a free way until {free_until:?}, found a contact at {time:?}"))
        }
        Said::Free if method.samples().is_none() => {
            Some("expected a way that is not free, found Free".into())
        }
        Said::Undecided if is_hit(certified) => Some("expected a hit, found Undecided".into()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, to_bytes};
    use bvh_query::Pose;

    #[test]
    fn samples_have_both_ends() {
        for samples in SAMPLES {
            let times = Method::Ordered(samples).times();
            assert_eq!((times.len(), times[0], *times.last().unwrap()), (samples as usize, 0.0, 1.0));
            assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        }
        assert!(Method::Motion.times().is_empty());
    }

    /// Returns the answers about two meshes that meet at a quarter of the time, and about two that part.
    fn certified() -> [MotionAnswer; 2] {
        let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let spike = [[0.2, 0.2, 0.0], [0.4, 0.2, 0.0], [0.3, 0.2, 1.0]];
        let mesh = Mesh::from_triangles([floor, spike].concat(), vec![[0, 1, 2], [3, 4, 5]]);
        let bvh = Bvh::from_bytes(to_bytes(&mesh, &Options::default()).unwrap().0).unwrap();
        [-2.0, 3.0].map(|end| {
            let at = |z| Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, z]).unwrap();
            let motion = Motion::between(&at(2.0), &at(end)).unwrap();
            Querier::new().unwrap().motion(&bvh, &bvh, &motion, &MotionOptions::new()).unwrap()
        })
    }

    #[test]
    fn missed_and_late_contacts_are_counted() {
        let [hit, free] = certified();
        let judged = |said: [Said; 4]| {
            let (errors, wrong) = judge("pair", Method::Ordered(10), &[hit, hit, hit, free], &said);
            assert!(wrong.is_empty(), "{wrong:?}");
            errors
        };
        let errors = judged([Said::Contact(0.75), Said::Free, Said::Contact(0.375), Said::Free]);
        assert_eq!((errors.missed, errors.undecided), (1, None));
        let late = [errors.late_median, errors.late_max].map(|late| (late.unwrap() * 1e3).round());
        assert_eq!(late, [500.0, 500.0]);
        let errors = judged([Said::Free; 4]);
        assert_eq!((errors.missed, errors.late_median, errors.late_max), (3, None, None));
    }

    #[test]
    fn a_contact_where_the_way_is_free_is_wrong() {
        let [hit, free] = certified();
        let wrong = |method, certified, said| judge("pair", method, &[certified], &[said]).1;
        let sampled = Method::Ordered(30);
        assert_eq!(
            wrong(sampled, free, Said::Contact(0.5)),
            ["pair, 30 ordered samples, motion 1: expected a free way, found Contact(0.5)"]
        );
        let early = wrong(sampled, hit, Said::Contact(0.125));
        assert!(early[0].contains("found a contact at 0.125"), "{early:?}");
        for right in [Said::Free, Said::Contact(1.0)] {
            assert!(wrong(sampled, hit, right).is_empty());
        }
        assert!(wrong(Method::IsFree, hit, Said::NotFree).is_empty());
        assert_eq!(wrong(Method::IsFree, hit, Said::Free).len(), 1);
        assert_eq!(wrong(Method::IsFree, free, Said::NotFree).len(), 1);
        assert_eq!(wrong(Method::Motion, hit, Said::Undecided).len(), 1);
    }
}
