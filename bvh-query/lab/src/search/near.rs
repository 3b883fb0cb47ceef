//! Asks about meshes near the boundary of contact, and judges the answers by exact arithmetic.
//!
//! A round bakes the two meshes of [`Stars`] in any layouts, and places B in many poses, which differ by single roundings
//! of the numbers of the pose: each rounding moves every placed corner by roundings of its own. All contacts are asked for
//! in each pose on every backend, and everything that the tests of `bvh-query` ask in some of them. The truth is about the
//! triangles before they are baked, which the lossless encodings must keep. In some poses, placed corners and edges of B are
//! also asked about as points and segments, and motions end in contact, pass it by a few roundings or slide along it.

use super::stars::Stars;
use super::{Counts, any_layout, bake, case, check, fewest, queriers};
use crate::Failure;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Random, Stored, Triangle, placed};
use crate::exact::ask::{Asked, difference};
use bvh_bake::Options;
use bvh_query::{Bvh, Contact, Motion, MotionAnswer, MotionOptions, Pose, Querier, QueryError, RigidPath};
use cbvh_testkit::exact::{Boxed, Decided, Length, intersect};

/// Poses of a round.
const POSES: usize = 64;
/// Pairs of which one is tested for being near the boundary.
const SAMPLE: usize = 512;
/// Triangles of B from which points and segments are taken in a pose.
const PROBES: usize = 10;
/// Poses along a motion, besides those at which the answer names times.
const SAMPLES: u32 = 12;
/// Visits of a question about a motion. One that slides along a mesh needs any number.
const MOTION_BUDGET: u64 = 300_000;

/// Answers with all contacts. Tests put wrong answers in place of those of the library.
type Contacts = fn(&mut Querier, &Bvh, &Bvh, &Pose) -> Result<Vec<Contact>, QueryError>;

/// The files of two meshes, and the triangles that they were baked from.
struct Meshes {
    files: [Bvh; 2],
    surfaces: [Surface; 2],
    queriers: Vec<Querier>,
    contacts: Contacts,
}

/// Runs one round.
pub(super) fn round(seed: u64, counts: &mut Counts) -> Result<(), Failure> {
    round_of(seed, |querier, a, b, pose| querier.contacts(a, b, pose), counts)
}

fn round_of(seed: u64, contacts: Contacts, counts: &mut Counts) -> Result<(), Failure> {
    let mut random = Random::new(seed);
    let stars = Stars::new(&mut random);
    let options = [(); 2].map(|()| any_layout(&mut random, 2));
    let mut meshes = Meshes::new([&stars.a, &stars.b], &options, contacts)?;
    for number in 0..POSES {
        let Some(pose) = stars.nudged(number, &mut random) else {
            counts.add("refused poses", 1);
            continue;
        };
        let truth = meshes.ask(number, &pose, counts).map_err(|wrong| {
            let [a, b] = shrunk([&stars.a, &stars.b], &options, &pose, contacts);
            format!("{wrong}; {}", case([&a, &b], &options, &pose))
        })?;
        sample(&stars, &pose, &truth, &mut random, counts);
        let beside = match number % 32 {
            3 | 19 => meshes.ask_probes(&pose, &mut random, counts),
            7 => meshes.ask_motion(&stars, &mut random, counts),
            _ => Ok(()),
        };
        beside.map_err(|wrong| format!("{wrong}; {}", case([&stars.a, &stars.b], &options, &pose)))?;
        counts.add("poses", 1);
        counts.add("pairs", stars.pairs() as u64);
    }
    Ok(())
}

/// Returns the fewest triangles of both sides about which an answer is wrong.
fn shrunk(
    [a, b]: [&[Triangle]; 2],
    options: &[Options; 2],
    pose: &Pose,
    contacts: Contacts,
) -> [Vec<Triangle>; 2] {
    let is_wrong = |a: &[Triangle], b: &[Triangle]| {
        let meshes = Meshes::new([a, b], options, contacts);
        meshes.is_ok_and(|mut meshes| meshes.ask(ALL, pose, &mut Counts::default()).is_err())
    };
    let a = fewest(a.to_vec(), |fewer| is_wrong(fewer, b));
    let b = fewest(b.to_vec(), |fewer| is_wrong(&a, fewer));
    [fewest(a, |fewer| is_wrong(fewer, &b)), b]
}

/// Tests of a few pairs of a star whether they are near the boundary.
fn sample(stars: &Stars, pose: &Pose, truth: &[Contact], random: &mut Random, counts: &mut Counts) {
    let placed = placed(&stars.b, pose);
    for _ in 0..stars.pairs().div_ceil(SAMPLE) {
        let (i, j) = stars.any_pair(random);
        let pair = |contact: &Contact| (contact.triangle_a as usize, contact.triangle_b as usize);
        let touching = truth.binary_search_by_key(&(i, j), pair).is_ok();
        let is_near = stars.is_near((&stars.a[i], &placed[j]), touching, pose);
        counts.add("sampled", 1);
        counts.add("sampled near the boundary", u64::from(is_near));
    }
}

/// A pose of which everything is asked.
const ALL: usize = 5;

impl Meshes {
    fn new(meshes: [&[Triangle]; 2], options: &[Options; 2], contacts: Contacts) -> Result<Self, Failure> {
        let stored = |(id, &corners): (u32, &Triangle)| Stored { object: 0, id, corners };
        let surfaces = meshes.map(|triangles| Surface::new((0..).zip(triangles).map(stored).collect()));
        let files = [bake(meshes[0], &options[0])?, bake(meshes[1], &options[1])?];
        Ok(Self { files, surfaces, queriers: queriers(), contacts })
    }

    /// Asks for the contacts on every backend, in some poses whether there are any, and in one of sixteen everything.
    fn ask(&mut self, number: usize, pose: &Pose, counts: &mut Counts) -> Result<Vec<Contact>, Failure> {
        let ([a, b], queriers) = (&self.files, &mut self.queriers[..]);
        let truth = Truth::new(&self.surfaces[0], &self.surfaces[1], pose);
        let mut tally = Tally::default();
        let expected = truth.contacts(&mut tally);
        for querier in &mut *queriers {
            let found = (self.contacts)(querier, a, b, pose)?;
            let (count, backend) = (found.len(), querier.backend());
            let wrong = || {
                format!(
                    "{backend}: {count} contacts of {}, {}",
                    expected.len(),
                    difference(&found, &expected)
                )
            };
            check(found == expected, wrong)?;
        }
        counts.add("queries", queriers.len() as u64);
        let mut asked = Asked { a, b, queriers };
        match number % 16 {
            ALL => asked.all(&truth, pose, &mut tally)?,
            1 | 6 | 11 => asked.collide(!expected.is_empty(), pose, &mut tally)?,
            _ => {}
        }
        check(tally.missed == 0, || tally.first_missed.unwrap_or_default())?;
        counts.add("queries", tally.queries);
        counts.add("contacts", expected.len() as u64);
        Ok(expected)
    }

    /// Asks about corners and edges of B. A point is a triangle whose corners are the same, and a segment one with two such
    /// corners.
    fn ask_probes(&mut self, pose: &Pose, random: &mut Random, counts: &mut Counts) -> Result<(), Failure> {
        let all: Vec<Boxed> = self.surfaces[0].corners.iter().map(|t| Boxed::new(*t)).collect();
        for _ in 0..PROBES {
            let corners = &self.surfaces[1].corners;
            let [p, q, _] = corners[random.below(corners.len())].map(|corner| pose.place(corner));
            let (point, segment) = (Boxed::new([p; 3]), Boxed::new([p, q, q]));
            let [on, met] = [point, segment]
                .map(|probe| all.iter().any(|t| intersect(t, &probe, &mut Decided::default())));
            for querier in &mut self.queriers {
                let backend = querier.backend();
                let context = |what| format!("{backend}, {p:?} to {q:?}: {what}");
                let hit = querier.segment_hit(&self.files[0], p, q)?;
                check(hit == met, || context(format!("segment_hit: {hit}")))?;
                let answer = querier.closest_point(&self.files[0], p, f64::INFINITY)?;
                let answer = answer.ok_or_else(|| context("closest_point: none".to_owned()))?;
                let to = |t: &Boxed| Length::between(&[p; 3], &t.corners);
                let named = to(&all[answer.triangle as usize]);
                let is_within = named.compare(answer.lower).is_ge() && named.compare(answer.upper).is_le();
                let is_nearer =
                    |t: &Boxed| t.gap(&point) < answer.lower && to(t).compare(answer.lower).is_lt();
                let holds = (answer.distance == 0.0) == on && is_within && !all.iter().any(is_nearer);
                check(holds, || context(format!("{answer:?}, named exactly {:e}", named.floor())))?;
            }
            counts.add("probes", 2 * self.queriers.len() as u64);
            counts.add("probes that touch", u64::from(on) + u64::from(met));
        }
        Ok(())
    }

    /// Asks about a motion between poses that are off the plane between the stars by much, by some roundings or not at all,
    /// or through it. A motion that is free has no contact in any pose along the way, and one that is not has none before
    /// the time until which it is said to be free, and one at the time of the hit. The tests of `bvh-query` compare motions
    /// with their slow definition; poses along the way are faster.
    fn ask_motion(&mut self, stars: &Stars, random: &mut Random, counts: &mut Counts) -> Result<(), Failure> {
        let size = stars.b.iter().flatten().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let mut end = || {
            let off =
                size * [0.3, 1e-3, 4.0 * f64::EPSILON, 0.0, -4.0 * f64::EPSILON, -1e-3][random.below(6)];
            let mut to = [0, 1, 2].map(|k| stars.translation[k] + off * stars.normal[k]);
            to[random.below(3)] += [0.0, 0.0, 0.02 * size][random.below(3)] * random.signed();
            Pose::new(stars.rotation, to)
        };
        let (Ok(from), Ok(to)) = (end(), end()) else { return Ok(()) };
        let Ok(motion) = Motion::between(&from, &to) else { return Ok(()) };
        let contact = |t: f64| {
            let truth = Truth::new(&self.surfaces[0], &self.surfaces[1], &motion.pose(t));
            truth.collide(&mut (0, 0), &mut Tally::default())
        };
        let options = MotionOptions::new().tolerance([None, Some(size * 1e-4)][random.below(2)]);
        let mut first = None;
        for backend in self.queriers.iter().map(Querier::backend) {
            let mut querier = Querier::with_backend(backend);
            querier.set_budget(MOTION_BUDGET);
            let answer = match querier.motion(&self.files[0], &self.files[1], &motion, &options) {
                // Which errors there are may depend on the backend.
                Err(QueryError::Budget { .. } | QueryError::Number(_)) => continue,
                answer => answer?,
            };
            let context = |what| format!("{backend}, {from:?} to {to:?}, {options:?}: {answer:?}, {what}");
            let is_first = first.is_none();
            let first = *first.get_or_insert(answer);
            check(first == answer, || context(format!("not {first:?}")))?;
            if is_first {
                counts.add("motions", 1);
                check_motion(&answer, contact).map_err(|wrong| context(wrong.to_string()))?;
            }
        }
        Ok(())
    }
}

/// Compares an answer with whether the meshes touch at a time.
fn check_motion(answer: &MotionAnswer, contact: impl Fn(f64) -> bool) -> Result<(), Failure> {
    let (free_until, at) = match *answer {
        MotionAnswer::Free => (1.0, None),
        MotionAnswer::Hit { free_until, touching_at, .. } => (free_until, Some((touching_at, true))),
        MotionAnswer::Near { free_until, at, .. } => (free_until, Some((at, false))),
    };
    let times = (0..=SAMPLES).map(|i| free_until * f64::from(i) / f64::from(SAMPLES));
    let before = times.filter(|t| *t < free_until || at.is_none()).map(|t| (t, false));
    for (t, touching) in before.chain(at) {
        check(contact(t) == touching, || format!("contact at {t} is {}", !touching))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The library gives no wrong answers, so the tests make some: a contact is missed, or one is invented.
    #[test]
    fn planted_wrong_answers_are_found_and_shrunk_to_a_pair() {
        let plants: [Contacts; 2] = [
            |querier, a, b, pose| {
                let mut contacts = querier.contacts(a, b, pose)?;
                contacts.pop();
                Ok(contacts)
            },
            |querier, a, b, pose| {
                let mut contacts = querier.contacts(a, b, pose)?;
                contacts.extend(contacts.last().copied());
                Ok(contacts)
            },
        ];
        for plant in plants {
            let wrong = round_of(4, plant, &mut Counts::default()).unwrap_err().to_string();
            assert!(wrong.contains(" contacts of "), "{wrong}");
            let mut random = Random::new(4);
            let stars = Stars::new(&mut random);
            let options = [(); 2].map(|()| any_layout(&mut random, 2));
            let pose = stars.nudged(0, &mut random).unwrap();
            let [a, b] = shrunk([&stars.a, &stars.b], &options, &pose, plant);
            assert_eq!((a.len(), b.len()), (1, 1));
            assert!(wrong.ends_with(&case([&a, &b], &options, &pose)), "{wrong}");
            let mut meshes = Meshes::new([&a, &b], &options, plant).unwrap();
            assert!(meshes.ask(ALL, &pose, &mut Counts::default()).is_err());
            meshes.contacts = |querier, a, b, pose| querier.contacts(a, b, pose);
            assert_eq!(meshes.ask(ALL, &pose, &mut Counts::default()).unwrap().len(), 1);
        }
    }

    /// Nearly all pairs that are counted are near the boundary, on either side of it.
    #[test]
    fn pairs_are_near_the_boundary() {
        let mut counts = Counts::default();
        (0..6).for_each(|seed| round(seed, &mut counts).unwrap());
        let count = |name: &str| counts.0[name];
        assert!(20 * count("sampled near the boundary") > 19 * count("sampled"), "{counts:?}");
        let (contacts, pairs) = (count("contacts"), count("pairs"));
        assert!(contacts * 5 > pairs && contacts * 5 < 4 * pairs, "{counts:?}");
        assert!(count("probes that touch") > 0 && count("motions") > 0, "{counts:?}");
    }
}
