//! Asks about files that a stranger may have made: damaged bytes, correct checksums over them, made-up trees, and loose
//! bounds in files that keep every rule.
//!
//! A file whose bounds hold and which keeps every rule must be answered exactly: the contacts are those of its triangles by
//! the reference decoder, all backends agree, and where only bounds were changed, distances and probes agree with the
//! file that was there before. A file with damage that no checksum hides is refused, or answered as before. Any other
//! file may be answered with anything, but soon and without a panic.

use super::stars::Stars;
use super::{Counts, any_layout, bake, case, caught, check, fewest, queriers};
use crate::Failure;
use crate::common::asked::{Answers, MAX_CONTACTS};
use crate::common::shapes::{moved, soup};
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Random, random_pose, stored};
use bvh_bake::prove_bounds;
use bvh_format::validate::validate;
use bvh_query::{Bvh, Pose, Querier, Relation};
use cbvh_testkit::damage::damage;
use cbvh_testkit::forge::forge_any;
use cbvh_testkit::loosen::loosened;
use cbvh_testkit::seal::{Seal, put, seal};
use std::time::{Duration, Instant};

/// Files of a round.
const FILES: usize = 256;
/// Visits that a question about a file that breaks a rule may take.
const BUDGET: u64 = 20_000;
/// Visits for a file that keeps all rules; all pairs of its nodes are fewer.
const VALID_BUDGET: u64 = 10_000_000;
/// All questions about one file take milliseconds.
const MAX_SECONDS: Duration = Duration::from_secs(20);
/// Triangles of the mesh that a forged file is asked about with.
const GOOD_TRIANGLES: usize = 20;

/// How a file was forged.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Only bounds, so that answers stay.
    Loose,
    /// Any bytes, with some checksums corrected.
    Damaged(Seal),
    /// A made-up tree.
    MadeUp,
}

impl Way {
    fn any(random: &mut Random) -> Self {
        match random.below(6) {
            0 | 1 => Self::Loose,
            2 => Self::Damaged(Seal::All),
            3 | 4 => Self::Damaged(Seal::ALL[random.below(Seal::ALL.len())]),
            _ => Self::MadeUp,
        }
    }

    /// Makes a file; `None` where that is not possible.
    fn forge(self, bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
        let seal = match self {
            Self::Loose => return loosened(bytes, random),
            Self::MadeUp => return Some(forge_any(random)),
            Self::Damaged(seal) => seal,
        };
        // The whole head of another file hides itself by its checksums.
        let other = if seal == Seal::None { bytes } else { other };
        let mut bytes = bytes.to_vec();
        for _ in 0..1 + random.below(3) {
            damage(&mut bytes, other, random);
        }
        seal.apply(&mut bytes);
        Some(bytes)
    }
}

/// What a file is asked with: the file of a part of the other mesh and its triangles, the pose, whether the file is A, and a
/// point.
struct Question<'a> {
    good: (&'a Bvh, &'a Surface),
    pose: &'a Pose,
    is_a: bool,
    point: [f64; 3],
}

impl Question<'_> {
    fn ask(&self, querier: &mut Querier, file: &Bvh) -> Answers {
        let (a, b) = if self.is_a { (file, self.good.0) } else { (self.good.0, file) };
        let segment = [self.point, self.point.map(|x| -x)];
        Answers::of(querier, (a, b, self.pose), (file, &Pose::IDENTITY), segment)
    }

    /// Asks one backend everything about a file, and all of them if it keeps every rule. An error says what is wrong.
    fn judge(
        &self,
        bytes: &[u8],
        way: Way,
        before: &Answers,
        (queriers, backend): (&mut [Querier], usize),
        counts: &mut Counts,
    ) -> Result<(), Failure> {
        let whole = validate(bytes);
        let bvh = match (Bvh::from_bytes(bytes.to_vec()), &whole) {
            (Ok(bvh), _) => bvh,
            (Err(_), Err(_)) => {
                counts.add("files refused when opened", 1);
                return Ok(());
            }
            (Err(error), Ok(_)) => return Err(format!("a valid file is not opened: {error}").into()),
        };
        let keeps_rules = whole.as_ref().is_ok_and(|layout| prove_bounds(layout, bytes).is_ok());
        let budget = if keeps_rules { VALID_BUDGET } else { BUDGET };
        queriers.iter_mut().for_each(|querier| querier.set_budget(budget));
        let answers = self.ask(&mut queriers[backend], &bvh);
        if !keeps_rules {
            counts.add("files that break a rule", 1);
            let holds = way != Way::Damaged(Seal::None) || answers.are_refused_or(before);
            return check(holds, || format!("damage without a seal changes answers: {answers:?}"));
        }
        counts.add("files that keep every rule", 1);
        check(!answers.is_refused(), || format!("a file that keeps all rules is refused: {answers:?}"))?;
        for querier in queriers.iter_mut() {
            // The one that was asked is asked again: answers must not depend on the questions before.
            let again = self.ask(querier, &bvh);
            check(again == answers, || format!("{} disagrees: {again:?}, {answers:?}", querier.backend()))?;
        }
        let changed = contradiction(&answers, before).filter(|_| way == Way::Loose);
        check(changed.is_none(), || format!("loose bounds change: {changed:?}"))?;
        let (file, good) = (Surface::new(stored(&bvh)), self.good.1);
        let (a, b) = if self.is_a { (&file, good) } else { (good, &file) };
        let mut expected = Truth::new(a, b, self.pose).contacts(&mut Tally::default());
        expected.sort_unstable();
        let contacts = answers.contacts.as_deref().unwrap_or_default();
        let is_same = contacts == expected || expected.len() >= MAX_CONTACTS;
        check(is_same, || format!("{} contacts of {}", contacts.len(), expected.len()))?;
        let touching = !expected.is_empty();
        let is_same = answers.collide == Ok(touching)
            && answers.distance.as_ref().is_ok_and(|answer| (answer.distance == 0.0) == touching);
        check(is_same, || format!("contact is {touching}, but {:?}, {:?}", answers.collide, answers.distance))
    }
}

/// Returns what contradicts the answers of a file with the same triangles in a tree with other bounds, where ties may be
/// broken otherwise.
fn contradiction(one: &Answers, other: &Answers) -> Option<&'static str> {
    let distance = |of: &Answers| of.distance.as_ref().ok().map(|d| [d.lower, d.upper]);
    let closest = |of: &Answers| of.closest.as_ref().ok().and_then(|c| c.map(|c| [c.lower, c.upper]));
    let differ = |one: Option<[f64; 2]>, other: Option<[f64; 2]>| match (one, other) {
        (Some(one), Some(other)) => one[0] > other[1] || other[0] > one[1],
        (one, other) => one.is_some() != other.is_some(),
    };
    let hits = |of: &Answers| {
        let mut hits: Vec<_> = of.hits.iter().flatten().map(|hit| (hit.object, hit.triangle)).collect();
        hits.sort_unstable();
        hits
    };
    // Nothing is known about an open object whose box or sphere, which may be loose, meets that of another.
    let is_known = |of: &Answers| of.relation != Ok(Relation::Undefined);
    let cases = [
        ("contacts", one.contacts != other.contacts),
        ("distance", differ(distance(one), distance(other))),
        ("relation", one.relation != other.relation && is_known(one) && is_known(other)),
        ("closest point", differ(closest(one), closest(other))),
        ("side", one.side != other.side),
        ("hits", hits(one) != hits(other)),
        ("segment", one.segment != other.segment),
    ];
    cases.into_iter().find(|case| case.1).map(|case| case.0)
}

/// Runs one round.
pub(super) fn round(seed: u64, counts: &mut Counts) -> Result<(), Failure> {
    let mut random = Random::new(seed);
    // Stars, which touch in many triangles, or random triangles in any rotation; often of several pages.
    let stars = Stars::new(&mut random);
    let (mut sides, mut rotation, mut translation) = ([stars.a, stars.b], stars.rotation, stars.translation);
    if random.below(3) > 0 {
        let unit = 2f64.powi(random.below(80) as i32 - 40);
        sides = sides.map(|_| moved(&soup([30, 250, 700][random.below(3)], random.bits()), unit, [0.0; 3]));
        let pose = random_pose(&mut random, unit);
        (rotation, translation) = (*pose.rotation(), pose.translation());
    }
    let size = sides.iter().flatten().flatten().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    // The pose in which they meet, one that is off by a rounding, one with a gap, and one farther off.
    let poses = [0.0, f64::EPSILON, 2e-3, -0.3].map(|share| {
        let mut to = translation;
        to[random.below(3)] += size * share;
        Pose::new(rotation, to)
    });
    let poses = poses.into_iter().flatten().collect::<Vec<_>>();
    let has_topology = random.below(2) == 0;
    let options = [(); 2].map(|()| any_layout(&mut random, 3).topology(has_topology));
    let part = |side: usize| &sides[side][..GOOD_TRIANGLES.min(sides[side].len())];
    let files = [bake(&sides[0], &options[0])?, bake(&sides[1], &options[1])?];
    let parts = [bake(part(0), &options[0])?, bake(part(1), &options[1])?];
    let stored = parts.each_ref().map(|part| Surface::new(stored(part)));
    let question = |side: usize, pose| {
        let good = (&parts[1 - side], &stored[1 - side]);
        Question { good, pose, is_a: side == 0, point: sides[side][0][0] }
    };
    let mut all = queriers();
    let before = [0, 1].map(|side| {
        poses.iter().map(|pose| question(side, pose).ask(&mut all[0], &files[side])).collect::<Vec<_>>()
    });
    for _ in 0..FILES {
        let (side, number, backend) = (random.below(2), random.below(poses.len()), random.below(all.len()));
        let way = Way::any(&mut random);
        let (question, before) = (question(side, &poses[number]), &before[side][number]);
        let original = files[side].bytes();
        let Some(bytes) = way.forge(original, files[1 - side].bytes(), &mut random) else { continue };
        counts.add("files", 1);
        let judge = |bytes: &[u8], queriers: &mut [Querier], counts: &mut Counts| {
            let start = Instant::now();
            caught(|| question.judge(bytes, way, before, (queriers, backend), counts))?;
            check(start.elapsed() <= MAX_SECONDS, || format!("took {:?}", start.elapsed()))
        };
        judge(&bytes, &mut all, counts).map_err(|wrong| {
            // Queriers that have not panicked.
            let is_wrong = |bytes: &[u8]| judge(bytes, &mut queriers(), &mut Counts::default()).is_err();
            let is_sealed = way != Way::Damaged(Seal::None);
            let shrunk = shrunk(&bytes, original, is_wrong).filter(|_| is_sealed);
            let bytes = shrunk.as_ref().unwrap_or(&bytes);
            let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            let how = format!("{way:?}, {}, in place of {}", all[backend].backend(), ["A", "B"][side]);
            format!("{wrong}; {how}; {}; the file {hex}", case([part(0), part(1)], &options, &poses[number]))
        })?;
    }
    Ok(())
}

/// Turns changed words back to what they were, as long as the answers stay wrong. `None` if they are not wrong for a file of
/// the same length with correct checksums.
fn shrunk(bytes: &[u8], original: &[u8], is_wrong: impl Fn(&[u8]) -> bool) -> Option<Vec<u8>> {
    let with = |words: &[usize]| {
        let mut file = original.to_vec();
        words.iter().for_each(|at| put(&mut file, 4 * at, &bytes[4 * at..][..4]));
        seal(&mut file);
        file
    };
    if bytes.len() != original.len() {
        return None;
    }
    let is_changed = |at: &usize| bytes[4 * at..][..4] != original[4 * at..][..4];
    let changed: Vec<_> = (0..bytes.len() / 4).filter(is_changed).collect();
    is_wrong(&with(&changed)).then(|| with(&fewest(changed, |words| is_wrong(&with(words)))))
}
