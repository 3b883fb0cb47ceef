//! Asks about files that a stranger may have made: damaged bytes, correct checksums over them, made-up trees, and loose
//! bounds in files that keep every rule.
//!
//! A file whose bounds hold and which keeps every rule must be answered exactly: the contacts are those of its triangles by
//! the reference decoder, all backends agree, and where only bounds were changed, distances and probes agree with the
//! file that was there before. A file with damage that no checksum hides is refused, or answered as before. Any other
//! file may be answered with anything, but soon and without a panic.

use super::files::{Layout as Baked, bake};
use super::pairs::{queriers, truth};
use super::record::{Counts, Finding, Forged};
use super::shrink::Case;
use super::stars::Stars;
use crate::Failure;
use crate::common::asked::{Answers, MAX_CONTACTS};
use crate::common::{corners, placed, rotation, stored};
use bvh_format::bounds::{Subtree, check_bounds, check_box};
use bvh_format::page::{Page, RootRef};
use bvh_format::validate::validate;
use bvh_query::{Bvh, Pose, Querier, RayHit, Relation};
use cbvh_testkit::damage::damage;
use cbvh_testkit::forge::{Input, forge};
use cbvh_testkit::loosen::loosened;
use cbvh_testkit::seal::{put, seal, seal_blocks, seal_header, seal_pages};
use cbvh_testkit::{Random, Triangle};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Files of a round.
const FILES: usize = 256;
/// Visits that a question about a file that breaks a rule may take.
const BUDGET: u64 = 20_000;
/// Visits for a file that keeps all rules; all pairs of its nodes are fewer.
const VALID_BUDGET: u64 = 10_000_000;
/// All questions about one file take milliseconds.
const MAX_SECONDS: Duration = Duration::from_secs(20);
/// Findings of a round; shrinking each takes seconds.
const MAX_FINDINGS: usize = 2;

/// What the questions about a file need: the other file, the pose, and which of the two is A.
struct Scene<'a> {
    good: &'a Bvh,
    triangles: &'a [Triangle],
    pose: &'a Pose,
    is_a: bool,
    point: [f64; 3],
}

impl Scene<'_> {
    fn ask(&self, querier: &mut Querier, file: &Bvh) -> Answers {
        let (a, b) = if self.is_a { (file, self.good) } else { (self.good, file) };
        let segment = [self.point, self.point.map(|x| -x)];
        Answers::of(querier, (a, b, self.pose), (file, &Pose::IDENTITY), segment)
    }
}

/// Returns what contradicts the answers of a file with the same triangles in another tree, where ties may be broken
/// otherwise.
fn contradiction(answers: &Answers, other: &Answers) -> Option<&'static str> {
    let apart = |one: [f64; 2], other: [f64; 2]| one[0] > other[1] || other[0] > one[1];
    let interval = |of: &Answers| of.distance.as_ref().ok().map(|d| [d.lower, d.upper]);
    let closest = |of: &Answers| of.closest.as_ref().ok().and_then(|c| c.map(|c| [c.lower, c.upper]));
    let differ = |one: Option<[f64; 2]>, other: Option<[f64; 2]>| match (one, other) {
        (Some(one), Some(other)) => apart(one, other),
        (one, other) => one.is_some() != other.is_some(),
    };
    let hit = |hits: &Vec<RayHit>| {
        let mut hits: Vec<_> = hits.iter().map(|hit| (hit.object, hit.triangle)).collect();
        hits.sort_unstable();
        hits
    };
    let is_undefined = |of: &Answers| of.relation == Ok(Relation::Undefined);
    let cases = [
        ("collide", answers.collide != other.collide),
        ("contacts", answers.contacts != other.contacts),
        ("distance", differ(interval(answers), interval(other))),
        // The relation of an open object is undefined where its box or sphere meets that of another, and both may be
        // loose.
        ("relation", answers.relation != other.relation && !is_undefined(answers) && !is_undefined(other)),
        ("closest point", differ(closest(answers), closest(other))),
        ("side", answers.side != other.side),
        ("hits", answers.hits.as_ref().map(hit) != other.hits.as_ref().map(hit)),
        ("segment", answers.segment != other.segment),
    ];
    cases.into_iter().find(|case| case.1).map(|case| case.0)
}

/// How a file was forged.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// Only bounds, so that answers stay.
    Loose,
    /// Any bytes, with all checksums corrected or some.
    Sealed,
    /// Any bytes, with no checksum corrected.
    Plain,
    /// A made-up tree.
    MadeUp,
}

/// Two meshes, with a pose in which they meet. Files of both are forged, and each is tested against a part of the
/// other.
struct Meshes {
    sides: [Vec<Triangle>; 2],
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// The number of triangles of the mesh against which a forged file is tested.
const GOOD_TRIANGLES: usize = 20;

impl Meshes {
    /// Returns stars, which touch in many triangles, or random triangles in any rotation; often of several pages.
    fn new(random: &mut Random) -> Self {
        if random.below(3) == 0 {
            let Stars { a, b, rotation, translation, sizes, .. } = Stars::new(random);
            // Of a single star with all others in contact, a part is enough.
            let every = |all: Vec<Triangle>, size: usize| {
                if size < 40 { all } else { all.into_iter().step_by(4).collect() }
            };
            return Self { sides: [every(a, sizes[0]), every(b, sizes[1])], rotation, translation };
        }
        let rotation = rotation(random.quaternion());
        let unit = 2f64.powi(random.below(80) as i32 - 40);
        let sides = [(); 2].map(|()| {
            let (count, reach) = ([30, 250, 700][random.below(3)], [0.05, 0.4, 2.0][random.below(3)]);
            let triangle = |_| {
                let centre = random.point();
                [(); 3].map(|()| {
                    let off = random.point();
                    [0, 1, 2].map(|k| f64::from(((centre[k] + reach * off[k]) * unit) as f32))
                })
            };
            (0..count).map(triangle).collect()
        });
        Self { sides, rotation, translation: random.point().map(|x| x * unit) }
    }

    /// Returns the pose in which they meet, one that is off by a rounding, one with a gap, and one farther off.
    fn poses(&self, random: &mut Random) -> Vec<Pose> {
        let size =
            self.sides.iter().flatten().flatten().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let moved = |share: f64| {
            let mut translation = self.translation;
            translation[random.below(3)] += size * share;
            Pose::new(self.rotation, translation).ok()
        };
        [0.0, f64::EPSILON, 2e-3, -0.3].into_iter().filter_map(moved).collect()
    }

    /// Returns the part of a mesh that forged files of the other one are asked about with.
    fn part(&self, side: usize) -> Vec<Triangle> {
        let all = &self.sides[side];
        all.iter().step_by(all.len().div_ceil(GOOD_TRIANGLES)).copied().collect()
    }
}

/// Runs one round. Returns the wrong answers, shrunk.
pub(super) fn round(seed: u64, counts: &mut Counts) -> Result<Vec<Finding>, Failure> {
    let mut random = Random::new(seed);
    let meshes = Meshes::new(&mut random);
    let layouts = [(); 2].map(|()| Baked::random(&mut random, 3));
    let has_topology = random.below(2) == 0;
    let baked = |triangles: &[Triangle], side: usize| {
        bake(triangles, &layouts[side].options().topology(has_topology))
    };
    let (parts, poses) = ([meshes.part(0), meshes.part(1)], meshes.poses(&mut random));
    let files = [baked(&meshes.sides[0], 0)?, baked(&meshes.sides[1], 1)?];
    let goods = [Bvh::from_bytes(baked(&parts[0], 0)?)?, Bvh::from_bytes(baked(&parts[1], 1)?)?];
    let stored = goods.each_ref().map(|good| corners(&stored(good)));
    let mut all = queriers();
    let scene = |side: usize, pose| Scene {
        good: &goods[1 - side],
        triangles: &stored[1 - side],
        pose,
        is_a: side == 0,
        point: meshes.sides[side][0][0],
    };
    let mut before = Vec::new();
    for side in [0, 1] {
        let file = Bvh::from_bytes(files[side].clone())?;
        before.push(poses.iter().map(|pose| scene(side, pose).ask(&mut all[0], &file)).collect::<Vec<_>>());
    }
    let mut findings = Vec::new();
    for _ in 0..FILES {
        let (side, number, backend) = (random.below(2), random.below(poses.len()), random.below(all.len()));
        let way =
            [Way::Loose, Way::Loose, Way::Sealed, Way::Sealed, Way::Plain, Way::MadeUp][random.below(6)];
        let (scene, before) = (scene(side, &poses[number]), &before[side][number]);
        let Some(bytes) = forged(&files[side], &files[1 - side], way, &mut random) else { continue };
        counts.add("files", 1);
        let Some(wrong) = judged(&bytes, way, &scene, before, &mut all, backend, counts) else {
            continue;
        };
        let mut ask = |bytes: &[u8]| {
            // Nothing is kept of a querier that panicked.
            let mut all = queriers();
            judged(bytes, way, &scene, before, &mut all, backend, &mut Counts::default())
        };
        let (bytes, wrong) = shrunk(bytes, &files[side], wrong, way, &mut ask);
        let mut sides = meshes.sides.clone();
        sides[1 - side] = parts[1 - side].clone();
        let [a, b] = sides;
        let case = Case {
            a,
            b,
            rotation: *poses[number].rotation(),
            translation: poses[number].translation(),
            layouts: layouts.clone(),
            backend: all[backend].backend().name().into(),
        };
        let hex = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let file = Some(Forged { is_a: side == 0, hex });
        findings.push(Finding { kind: "hostile".into(), round: seed, wrong, case: Some(case), file });
        if findings.len() >= MAX_FINDINGS {
            break;
        }
        all = queriers();
    }
    Ok(findings)
}

/// Makes a file in a way; `None` where that is not possible.
fn forged(bytes: &[u8], other: &[u8], way: Way, random: &mut Random) -> Option<Vec<u8>> {
    match way {
        Way::Loose => loosened(bytes, random),
        Way::MadeUp => {
            // Most numbers are small, so that they exceed limits rarely enough for some files to be valid.
            let byte = |random: &mut Random| {
                if random.below(40) == 0 { random.bits() as u8 } else { random.below(64) as u8 }
            };
            let description: Vec<u8> = (0..800).map(|_| byte(random)).collect();
            Some(forge(&mut Input(&description)))
        }
        Way::Sealed | Way::Plain => {
            // The whole head of another file hides itself by its checksums.
            let other = if way == Way::Plain { bytes } else { other };
            let mut bytes = bytes.to_vec();
            for _ in 0..1 + random.below(3) {
                damage(&mut bytes, other, random);
            }
            if way == Way::Sealed && bytes.len() >= 64 {
                match random.below(8) {
                    0 => seal_header(&mut bytes),
                    1 => {
                        seal_blocks(&mut bytes);
                        seal_pages(&mut bytes);
                    }
                    _ => seal(&mut bytes),
                }
            }
            Some(bytes)
        }
    }
}

/// Asks everything about a file, and returns what is wrong with the answers. A panic is caught.
fn judged(
    bytes: &[u8],
    way: Way,
    scene: &Scene<'_>,
    before: &Answers,
    queriers: &mut [Querier],
    backend: usize,
    counts: &mut Counts,
) -> Option<String> {
    let start = Instant::now();
    let judge = AssertUnwindSafe(|| judge(bytes, way, scene, before, queriers, backend, counts));
    match catch_unwind(judge) {
        Ok(None) if start.elapsed() > MAX_SECONDS => Some(format!("took {:?}", start.elapsed())),
        Ok(wrong) => wrong,
        Err(_) => Some("panicked".to_owned()),
    }
}

fn judge(
    bytes: &[u8],
    way: Way,
    scene: &Scene<'_>,
    before: &Answers,
    queriers: &mut [Querier],
    backend: usize,
    counts: &mut Counts,
) -> Option<String> {
    let whole = validate(bytes);
    let bvh = match (Bvh::from_bytes(bytes.to_vec()), &whole) {
        (Ok(bvh), _) => bvh,
        (Err(_), Err(_)) => {
            counts.add("files refused when opened", 1);
            return None;
        }
        (Err(error), Ok(_)) => return Some(format!("a valid file is not opened: {error}")),
    };
    let keeps_rules = whole.is_ok() && bounds_hold(&bvh);
    queriers
        .iter_mut()
        .for_each(|querier| querier.set_budget(if keeps_rules { VALID_BUDGET } else { BUDGET }));
    let answers = scene.ask(&mut queriers[backend], &bvh);
    if !keeps_rules {
        counts.add(if whole.is_ok() { "files with wrong bounds" } else { "files that break a rule" }, 1);
        let holds = way != Way::Plain || answers.are_refused_or(before);
        return (!holds).then(|| format!("damage without a seal changes answers: {answers:?}"));
    }
    counts.add(
        if way == Way::Loose { "loose files that keep all rules" } else { "other files that keep all rules" },
        1,
    );
    if let Some(error) = answers.refusal() {
        return Some(format!("a file that keeps all rules is refused: {error}"));
    }
    for querier in queriers.iter_mut() {
        // The one that was asked is asked again: answers must not depend on the questions before.
        if scene.ask(querier, &bvh) != answers {
            return Some(format!("{} disagrees", querier.backend()));
        }
    }
    if way == Way::Loose
        && let Some(what) = contradiction(&answers, before)
    {
        return Some(format!("loose bounds change: {what}"));
    }
    let stored = stored(&bvh);
    let triangles = corners(&stored);
    let (a, b) =
        if scene.is_a { (&triangles[..], scene.triangles) } else { (scene.triangles, &triangles[..]) };
    let pairs = truth(a, &placed(b, scene.pose), [a.len().max(1), b.len().max(1)], &mut Counts::default());
    let contact = |(i, j): (u32, u32)| {
        let own = &stored[if scene.is_a { i } else { j } as usize];
        if scene.is_a { (own.object, own.id, 0, j) } else { (0, i, own.object, own.id) }
    };
    let mut expected: Vec<_> = pairs.into_iter().map(contact).collect();
    expected.sort_unstable();
    let found = answers.contacts.as_deref().unwrap_or_default();
    let found: Vec<_> = found.iter().map(|c| (c.object_a, c.triangle_a, c.object_b, c.triangle_b)).collect();
    if found != expected && expected.len() < MAX_CONTACTS {
        return Some(format!("{} contacts of {}", found.len(), expected.len()));
    }
    let touching = !expected.is_empty();
    let distance = answers.distance.as_ref().map_or(f64::NAN, |answer| answer.distance);
    if answers.collide != Ok(touching) || (distance == 0.0) != touching {
        return Some(format!("contact is {touching}; collide {:?}, distance {distance:e}", answers.collide));
    }
    None
}

/// Returns whether all bounds of a valid file contain their triangles.
fn bounds_hold(bvh: &Bvh) -> bool {
    let (layout, bytes) = (bvh.layout(), bvh.bytes());
    bvh.objects().iter().all(|object| {
        let mut subtrees: BTreeMap<(u32, u8), Subtree> = BTreeMap::new();
        let first = object.record().first_page.get();
        let pages_hold = (first..first + object.record().pages.get()).rev().all(|number| {
            let Some(page) = layout.page_bytes(bytes, number) else { return false };
            let page = Page::new(page, object.profile());
            let below = |to: RootRef| subtrees.get(&(to.page(), to.root())).unwrap_or(Subtree::unknown());
            let Ok((found, _)) =
                check_bounds(layout, object, &page, layout.leaf_block(bytes, page.header()), below)
            else {
                return false;
            };
            subtrees.extend((0..).zip(found).map(|(root, subtree)| ((number, root), subtree)));
            true
        });
        pages_hold && check_box(layout, object, &subtrees[&(first, 0)]).is_ok()
    })
}

/// Turns stretches of changed bytes back to what they were, as long as the answers stay wrong.
fn shrunk(
    bytes: Vec<u8>,
    original: &[u8],
    wrong: String,
    way: Way,
    ask: &mut dyn FnMut(&[u8]) -> Option<String>,
) -> (Vec<u8>, String) {
    if bytes.len() != original.len() || way == Way::Plain {
        return (bytes, wrong);
    }
    let (mut best, mut wrong) = (bytes, wrong);
    let changed: Vec<usize> =
        (0..best.len() / 4).filter(|at| best[4 * at..][..4] != original[4 * at..][..4]).collect();
    let mut stretch = changed.len().div_ceil(2).max(1);
    for _ in 0..12 {
        for words in changed.chunks(stretch) {
            let mut bytes = best.clone();
            words.iter().for_each(|at| put(&mut bytes, 4 * at, &original[4 * at..][..4]));
            seal(&mut bytes);
            if bytes != best
                && let Some(still) = ask(&bytes)
            {
                (best, wrong) = (bytes, still);
            }
        }
        if stretch == 1 {
            break;
        }
        stretch = stretch.div_ceil(2);
    }
    (best, wrong)
}
