//! Asks about pairs of triangles near the boundary of contact, and judges the answers by exact arithmetic.
//!
//! One round bakes the two meshes of [`Stars`] once, in any layouts, and places B in many poses, which differ by single
//! roundings of the numbers of the pose: each rounding moves every placed corner by roundings of its own. All contacts are
//! asked for in each pose on every backend, `collide`, `within` and `distance` in some of them.
//!
//! A pair is *near the boundary* if moving B by [`ROUNDINGS`] of the largest magnitude in the pose parts the pair, or if
//! the pair is apart by no more than that. One pair of a star in [`SAMPLE`] is tested for that, in exact arithmetic.

use super::files::{Layout, bake};
use super::record::{Counts, Finding};
use super::shrink::{Case, shrunk};
use super::stars::Stars;
use crate::Failure;
use crate::common::{Stored, placed, stored};
use bvh_query::{Backend, Bvh, Contact, Pose, Querier, QueryError};
use cbvh_testkit::exact::{Boxed, Decided, Length, intersect};
use cbvh_testkit::{Random, Triangle};

/// Poses of a round.
const POSES: usize = 64;
/// Pairs of which one is tested for being near the boundary.
const SAMPLE: usize = 512;
/// How near the boundary a pair has to be, in units of 2^-53 of the largest magnitude that occurs in placing a corner. A
/// placed corner is within four of its exact place, and poses are moved by up to six.
const ROUNDINGS: f64 = 32.0;
const UNIT: f64 = f64::EPSILON / 2.0;

/// Answers with all contacts. Tests put wrong answers in place of those of the library.
pub(super) type Contacts = fn(&mut Querier, &Bvh, &Bvh, &Pose) -> Result<Vec<Contact>, QueryError>;

/// A pair of triangles, by their numbers.
pub(super) type Pair = (u32, u32);

/// Runs one round. Returns the wrong answers, shrunk.
pub(super) fn round(seed: u64, contacts: Contacts, counts: &mut Counts) -> Result<Vec<Finding>, Failure> {
    let mut random = Random::new(seed);
    let stars = Stars::new(&mut random);
    let layouts = [(); 2].map(|()| Layout::random(&mut random, 2));
    let [a, b] =
        [(&stars.a, &layouts[0]), (&stars.b, &layouts[1])].map(|(triangles, layout)| open(triangles, layout));
    let (a, b) = (a?, b?);
    let mut queriers = queriers();
    for number in 0..POSES {
        let Some(pose) = nudged(&stars, number, &mut random) else {
            counts.add("refused poses", 1);
            continue;
        };
        let in_a = placed(&stars.b, &pose);
        let truth = truth(&stars.a, &in_a, stars.sizes, counts);
        sample(&stars, &in_a, &pose, &truth, &mut random, counts);
        let depth = match number % 16 {
            5 => Depth::All,
            1 | 6 | 11 => Depth::Collide,
            _ => Depth::Contacts,
        };
        for querier in &mut queriers {
            counts.add("queries", depth.queries());
            let asked = Asked { a: &a, b: &b, pose: &pose, placed: [&stars.a, &in_a], truth: &truth };
            if let Some(wrong) = asked.wrong(querier, contacts, depth) {
                let case = Case {
                    a: stars.a.clone(),
                    b: stars.b.clone(),
                    rotation: *pose.rotation(),
                    translation: pose.translation(),
                    layouts: layouts.clone(),
                    backend: querier.backend().name().into(),
                };
                let (case, wrong) = shrunk(case, wrong, |case| ask_again(case, contacts));
                return Ok(vec![Finding {
                    kind: "pairs".into(),
                    round: seed,
                    wrong,
                    case: Some(case),
                    file: None,
                }]);
            }
        }
        counts.add("poses", 1);
    }
    Ok(Vec::new())
}

/// Asks every question about a case again. Returns what is wrong.
pub(super) fn ask_again(case: &Case, contacts: Contacts) -> Option<String> {
    let (a, b) = (open(&case.a, &case.layouts[0]).ok()?, open(&case.b, &case.layouts[1]).ok()?);
    let pose = Pose::new(case.rotation, case.translation).ok()?;
    let in_a = placed(&case.b, &pose);
    let truth = truth(&case.a, &in_a, [case.a.len(), case.b.len()], &mut Counts::default());
    let mut querier = Querier::with_backend(Backend::from_name(&case.backend).ok()?);
    let asked = Asked { a: &a, b: &b, pose: &pose, placed: [&case.a, &in_a], truth: &truth };
    asked.wrong(&mut querier, contacts, Depth::All)
}

/// Returns a querier for each backend that this CPU has.
pub(super) fn queriers() -> Vec<Querier> {
    let here = Backend::ALL.into_iter().filter(|backend| backend.is_available());
    here.map(Querier::with_backend).collect()
}

/// Bakes triangles without loss, which the stored ones prove.
fn open(triangles: &[Triangle], layout: &Layout) -> Result<Bvh, Failure> {
    let bvh = Bvh::from_bytes(bake(triangles, &layout.options())?)?;
    let stored = stored(&bvh);
    let same = |(number, stored): (usize, &Stored)| {
        stored.id as usize == number && sorted(&stored.corners) == sorted(&triangles[number])
    };
    match stored.iter().enumerate().find(|stored| !same(*stored)) {
        None if stored.len() == triangles.len() => Ok(bvh),
        other => {
            Err(format!("{} triangles in {layout:?}: stored {}, {other:?}", triangles.len(), stored.len())
                .into())
        }
    }
}

/// Returns the corners in order. A duplicate counts as stored in any order of its corners.
fn sorted(t: &Triangle) -> Triangle {
    let mut t = t.map(|p| p.map(|x| x + 0.0));
    t.sort_by(|p, q| p.partial_cmp(q).unwrap_or(std::cmp::Ordering::Equal));
    t
}

/// Returns the pose of the construction, or one whose numbers are moved by a few roundings. The pose may be refused.
fn nudged(stars: &Stars, number: usize, random: &mut Random) -> Option<Pose> {
    let (mut rotation, mut translation) = (stars.rotation, stars.translation);
    let largest = largest_magnitude(stars, &rotation, translation);
    let mut step = |x: &mut f64, unit: f64| {
        let steps = random.below(5) as f64 - 2.0;
        let moved = if unit > 0.0 { *x + steps * unit } else { *x + steps * (x.abs().next_up() - x.abs()) };
        *x = moved;
    };
    if number & 1 == 1 {
        let unit = if number & 2 == 0 { 0.0 } else { UNIT * largest };
        let axes = if number & 4 == 0 { 0..3 } else { number / 8 % 3..number / 8 % 3 + 1 };
        translation[axes].iter_mut().for_each(|x| step(x, unit));
    }
    if number & 8 == 8 {
        let unit = if number & 16 == 0 { 0.0 } else { UNIT };
        rotation.as_flattened_mut().iter_mut().for_each(|x| step(x, unit));
    }
    Pose::new(rotation, translation).ok()
}

/// Returns the largest sum of the magnitudes of the terms of a placed coordinate, and of a coordinate of A.
fn largest_magnitude(stars: &Stars, rotation: &[[f64; 3]; 3], translation: [f64; 3]) -> f64 {
    let of_b = stars.b.iter().flatten().flat_map(|p| {
        (0..3).map(move |k| (0..3).map(|j| (rotation[k][j] * p[j]).abs()).sum::<f64>() + translation[k].abs())
    });
    let of_a = stars.a.iter().flatten().flatten().map(|x| x.abs());
    of_b.chain(of_a).fold(0.0, f64::max)
}

/// Returns all pairs in contact in ascending order, from boxes of stars and exact arithmetic.
pub(super) fn truth(a: &[Triangle], b: &[Triangle], sizes: [usize; 2], counts: &mut Counts) -> Vec<Pair> {
    let boxed = |triangles: &[Triangle]| triangles.iter().copied().map(Boxed::new).collect::<Vec<_>>();
    let (a, b) = (boxed(a), boxed(b));
    let (mut pairs, mut decided) = (Vec::new(), Decided::default());
    let stars_b: Vec<_> = b.chunks(sizes[1]).map(Boxed::around).collect();
    for (star_a, group) in a.chunks(sizes[0]).enumerate() {
        let whole = Boxed::around(group);
        let near: Vec<usize> = (0..stars_b.len()).filter(|&star| whole.overlaps(&stars_b[star])).collect();
        for (i, of_a) in (star_a * sizes[0]..).zip(group) {
            for j in near.iter().flat_map(|star| star * sizes[1]..((star + 1) * sizes[1]).min(b.len())) {
                if intersect(of_a, &b[j], &mut decided) {
                    pairs.push((i as u32, j as u32));
                }
            }
        }
    }
    counts.add("pairs", (a.len().div_ceil(sizes[0]) * sizes[0] * sizes[1]) as u64);
    counts.add("contacts", pairs.len() as u64);
    counts.add("decided in integers", decided.by_integers);
    pairs
}

/// Tests of a few pairs of a star whether they are near the boundary.
fn sample(
    stars: &Stars,
    b: &[Triangle],
    pose: &Pose,
    truth: &[Pair],
    random: &mut Random,
    counts: &mut Counts,
) {
    let off = ROUNDINGS * UNIT * largest_magnitude(stars, pose.rotation(), pose.translation());
    let length = stars.normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let count = stars.a.len() / stars.sizes[0];
    for _ in 0..(count * stars.sizes[0] * stars.sizes[1]).div_ceil(SAMPLE) {
        let star = random.below(count);
        let [i, j] = [0, 1].map(|side| star * stars.sizes[side] + random.below(stars.sizes[side]));
        let is_near = if truth.binary_search(&(i as u32, j as u32)).is_ok() {
            let moved = b[j].map(|p| [0, 1, 2].map(|k| p[k] + off * stars.normal[k] / length));
            !intersect(&Boxed::new(stars.a[i]), &Boxed::new(moved), &mut Decided::default())
        } else {
            Length::between(&stars.a[i], &b[j]).compare(off).is_le()
        };
        counts.add("sampled", 1);
        counts.add("sampled near the boundary", u64::from(is_near));
    }
}

/// The questions to ask in a pose.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Depth {
    Contacts,
    Collide,
    All,
}

impl Depth {
    fn queries(self) -> u64 {
        match self {
            Self::Contacts => 1,
            Self::Collide => 2,
            Self::All => 9,
        }
    }
}

/// Two files in a pose, with their triangles in A's frame.
struct Asked<'a> {
    a: &'a Bvh,
    b: &'a Bvh,
    pose: &'a Pose,
    placed: [&'a [Triangle]; 2],
    truth: &'a [Pair],
}

impl Asked<'_> {
    /// Returns the first wrong answer.
    fn wrong(&self, querier: &mut Querier, contacts: Contacts, depth: Depth) -> Option<String> {
        self.answers(querier, contacts, depth).unwrap_or_else(|error| Some(format!("refused: {error}")))
    }

    fn answers(
        &self,
        querier: &mut Querier,
        contacts: Contacts,
        depth: Depth,
    ) -> Result<Option<String>, QueryError> {
        let &Self { a, b, pose, truth, .. } = self;
        let found = contacts(querier, a, b, pose)?;
        let is_same = |(contact, pair): (&Contact, &Pair)| (contact.triangle_a, contact.triangle_b) == *pair;
        if found.len() != truth.len() || !found.iter().zip(truth).all(is_same) {
            return Ok(Some(differences(&found, truth)));
        }
        let touching = !truth.is_empty();
        if depth >= Depth::Collide && querier.collide(a, b, pose)? != touching {
            return Ok(Some(format!("collide: {}", !touching)));
        }
        if depth < Depth::All {
            return Ok(None);
        }
        let answer = querier.distance(a, b, pose)?;
        let (i, j) = (answer.triangle_a, answer.triangle_b);
        if (answer.distance == 0.0) != touching || touching && truth.binary_search(&(i, j)).is_err() {
            return Ok(Some(format!("distance: {answer:?}, though contact is {touching}")));
        }
        let corners =
            |i: u32, j: u32| Some((self.placed[0].get(i as usize)?, self.placed[1].get(j as usize)?));
        let Some((p, q)) = corners(i, j) else {
            return Ok(Some(format!("distance: {answer:?} of no triangles")));
        };
        let named = Length::between(p, q);
        if named.compare(answer.lower).is_lt() || named.compare(answer.upper).is_gt() {
            return Ok(Some(format!("distance: {answer:?}, exactly {:e}", named.floor())));
        }
        for (number, (p, q)) in self.placed[0].iter().zip(self.placed[1]).enumerate().take(8) {
            if Length::between(p, q).compare(answer.lower).is_lt() {
                return Ok(Some(format!("distance: {answer:?}, but the triangles {number} are nearer")));
            }
        }
        let limits = [answer.lower, answer.distance, answer.upper];
        for limit in
            limits.into_iter().chain([answer.lower.next_down().max(0.0), answer.upper.next_up(), 0.0])
        {
            let within = querier.within(a, b, pose, limit)?;
            // Another pair may be nearer than the named one by less than its interval; it has been asked for above.
            let is_wrong = if within { limit < answer.lower } else { named.compare(limit).is_le() };
            if is_wrong || limit == 0.0 && within != touching {
                return Ok(Some(format!("within {limit:e}: {within}, {answer:?}")));
            }
        }
        Ok(None)
    }
}

/// Describes how contacts differ from the truth, by the first pairs that one of them lacks.
fn differences(found: &[Contact], truth: &[Pair]) -> String {
    let found: Vec<Pair> = found.iter().map(|contact| (contact.triangle_a, contact.triangle_b)).collect();
    let lacks = |some: &[Pair], others: &[Pair]| -> Vec<Pair> {
        some.iter().filter(|pair| others.binary_search(pair).is_err()).take(4).copied().collect()
    };
    let (missed, invented) = (lacks(truth, &found), lacks(&found, truth));
    format!("contacts: {} of {}; missed {missed:?}, invented {invented:?}", found.len(), truth.len())
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
            let findings = round(3, plant, &mut Counts::default()).unwrap();
            let [Finding { case: Some(case), wrong, .. }] = &findings[..] else { panic!("{findings:?}") };
            assert!(wrong.starts_with("contacts: "), "{wrong}");
            assert_eq!((case.a.len(), case.b.len()), (1, 1), "{case:?}");
            assert_eq!(ask_again(case, plant).as_ref(), Some(wrong));
            assert_eq!(ask_again(case, |querier, a, b, pose| querier.contacts(a, b, pose)), None);
        }
    }

    /// Nearly all pairs that are counted are near the boundary, on either side of it.
    #[test]
    fn pairs_are_near_the_boundary() {
        let mut counts = Counts::default();
        for seed in 0..6 {
            let findings =
                round(seed, |querier, a, b, pose| querier.contacts(a, b, pose), &mut counts).unwrap();
            assert!(findings.is_empty(), "{findings:?}");
        }
        let count = |name: &str| counts.0[name];
        assert!(20 * count("sampled near the boundary") > 19 * count("sampled"), "{:?}", counts.0);
        assert!(
            count("contacts") * 5 > count("pairs") && count("contacts") * 5 < 4 * count("pairs"),
            "{:?}",
            counts.0
        );
    }
}
