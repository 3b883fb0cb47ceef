//! Chooses the profile and the triangle encoding of an object by estimated query cost.
//!
//! A pair traversal costs its number of node tests times the cost of one test, and that number depends on how often
//! bounds overlap whose contents do not. Trials estimate this: patches of the mesh (runs of 1, 8 and 64 consecutive
//! triangles, which files mostly keep together) are placed beside each other in random orientations, with gaps from 0
//! to the size of a patch. They are tested with the k-DOPs of each direction set, the second one re-aligned as in a
//! query. The estimate is the number of overlaps per trial times the measured cost of a test with that set. The random
//! numbers have constant seeds, so that equal meshes get equal choices.

use crate::options::Options;
use crate::triangles::Corners;
use bvh_format::kdop::{DIRECTIONS, DirectionSet, Kdop};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_format::realign::upper_form;
use bvh_format::slabs::{Group, NodeSlabs};
use rayon::prelude::*;

/// A layout, and the reason for choosing it.
pub(crate) struct Choice {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) reason: String,
}

/// The candidates, and the cost in nanoseconds of testing 16 pairs of their nodes, with everything that belongs to a
/// test: the growth of a collide query's mean time divided by the growth of its node tests, from bunny poses 10 % of
/// the size apart to poses 1 % apart; AVX-512, Intel Xeon (model 167), 2026-11-21.
const FAST_PROFILES: [(Profile, f64); 3] =
    [(Profile::Dop6F16, 90.0), (Profile::Dop14U8, 108.0), (Profile::Dop26U8Wide, 151.0)];
/// The same for profiles with treelets of one line, for files that must be small.
const COMPACT_PROFILES: [(Profile, f64); 3] =
    [(Profile::Dop6F16, 90.0), (Profile::Dop14U8, 108.0), (Profile::Dop26U4, 112.0)];
/// The number of node tests with dop26-u4 per node test with dop26-u8, because 4-bit codes give wider bounds. From
/// traversals of a scanned surface (123 to 87) and of CAD parts (683 to 510).
const U4_TESTS: f64 = 1.4;
/// The bytes of nodes and plain triangles beyond which reading the file costs more than unpacking it. With warm caches,
/// packed triangles take 1.03 to 1.17 times as long as plain ones. This also holds where the caches are too small for
/// them, because the vertices of a packed packet take as many lines as a plain packet.
const MAX_PLAIN_BYTES: u64 = 256 << 20;
/// Bytes of nodes and plain lanes per triangle.
const PLAIN_BYTES_PER_TRIANGLE: u64 = 52;
/// The number of trials per object.
const TRIAL_COUNT: usize = 400;

/// The number of triangles in the longest patch.
pub(crate) const MAX_PATCH_TRIANGLES: u64 = 64;

/// A trial: two patches, each given by its first triangle and its length, and the placement of one beside the other.
pub(crate) struct Trial {
    patches: [(u64, u64); 2],
    rotation: [[f64; 3]; 3],
    away: [f64; 3],
    gap: f64,
}

/// Returns the trials for an object of `triangles` triangles, or none if the choice is not open.
pub(crate) fn trials(triangles: u64, options: &Options) -> Vec<Trial> {
    if options.profile.is_some() {
        return Vec::new();
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut trial = |number: usize| {
        let run = [1, 8, MAX_PATCH_TRIANGLES][number % 3].min(triangles);
        let patches = [(); 2].map(|()| (random.below(triangles - run + 1), run));
        Trial { patches, rotation: random.rotation(), away: random.direction(), gap: random.unit() }
    };
    (0..TRIAL_COUNT).map(&mut trial).collect()
}

/// Returns the patches that the trials use, in ascending order and each once.
pub(crate) fn patches(trials: &[Trial]) -> Vec<(u64, u64)> {
    let mut patches: Vec<_> = trials.iter().flat_map(|trial| trial.patches).collect();
    patches.sort_unstable();
    patches.dedup();
    patches
}

/// Chooses what the options leave open for an object of `triangles` triangles. `corners` holds those of the patches.
pub(crate) fn choose(
    triangles: u64,
    trials: &[Trial],
    corners: &[Vec<Corners>],
    options: &Options,
) -> Choice {
    let mut reasons = Vec::new();
    let encoding = options.triangles.unwrap_or_else(|| {
        let bytes = triangles * PLAIN_BYTES_PER_TRIANGLE;
        let (encoding, why) = if bytes > MAX_PLAIN_BYTES {
            (TriangleEncoding::Packed, "more than")
        } else {
            (TriangleEncoding::F32, "less than")
        };
        let (size, large) = (bytes as f64 / 1048576.0, MAX_PLAIN_BYTES >> 20);
        reasons.push(format!(
            "{} triangles, because nodes and plain triangles take about {size:.1} MiB without ids ({PLAIN_BYTES_PER_TRIANGLE} bytes \
             per triangle), {why} the limit of {large} MiB",
            encoding.name()
        ));
        encoding
    });
    let profile = options.profile.unwrap_or_else(|| {
        // A caller who asks for packed triangles wants a small file, and one who asks for quantised triangles wants the
        // smallest.
        let candidates = match options.triangles {
            None | Some(TriangleEncoding::F32) => &FAST_PROFILES[..],
            Some(TriangleEncoding::Packed) => &COMPACT_PROFILES,
            Some(TriangleEncoding::Quantized) => &COMPACT_PROFILES[..2],
        };
        let (profile, reason) = cheapest(trials, corners, candidates);
        reasons.push(reason);
        profile
    });
    Choice { profile, encoding, reason: reasons.join("; ") }
}

fn cheapest(trials: &[Trial], corners: &[Vec<Corners>], candidates: &[(Profile, f64)]) -> (Profile, String) {
    let rates = overlap_rates(trials, corners);
    let cost = |(profile, nanoseconds): &(Profile, f64)| {
        let widened = if *profile == Profile::Dop26U4 { U4_TESTS } else { 1.0 };
        rates[profile.directions() as usize] * widened * nanoseconds
    };
    let best = candidates.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(&candidates[0]);
    let relative: Vec<String> = candidates
        .iter()
        .map(|candidate| {
            format!("{} {:.2}", candidate.0.name(), cost(candidate) / cost(best).max(f64::MIN_POSITIVE))
        })
        .collect();
    (best.0, format!("{}, by estimated query cost: {}", best.0.name(), relative.join(", ")))
}

/// Returns how often patches that are apart overlap, for each direction set.
fn overlap_rates(trials: &[Trial], corners: &[Vec<Corners>]) -> [f64; 3] {
    let patches = patches(trials);
    let overlaps = trials.par_iter().map(|trial| {
        let points = |patch| {
            let place = patches.binary_search(&patch).unwrap_or_default();
            centred(corners.get(place).map_or(&[], |corners| corners))
        };
        let [points_a, points_b] = trial.patches.map(points);
        trial_overlaps(&points_a, &points_b, &trial.rotation, trial.away, trial.gap).map(u32::from)
    });
    let overlaps = overlaps.reduce(|| [0; 3], |a, b| [0, 1, 2].map(|set| a[set] + b[set]));
    // One overlap is added to each count, so that no set seems free.
    overlaps.map(|count| f64::from(count + 1) / TRIAL_COUNT as f64)
}

/// Returns, for each set, whether the k-DOPs overlap if B is placed beside A so that their extents along `away` leave a
/// gap of `gap` times the radius of the smaller patch.
fn trial_overlaps(
    points_a: &[[f64; 3]],
    points_b: &[[f64; 3]],
    rotation: &[[f64; 3]; 3],
    away: [f64; 3],
    gap: f64,
) -> [bool; 3] {
    let rotate = |p: &[f64; 3]| rotation.map(|row| dot(row, *p));
    let reach = |points: &[[f64; 3]], d: [f64; 3]| points.iter().map(|p| dot(*p, d)).fold(f64::MIN, f64::max);
    let turned: Vec<[f64; 3]> = points_b.iter().map(rotate).collect();
    let radius = |points: &[[f64; 3]]| points.iter().map(|p| dot(*p, *p)).fold(0.0, f64::max).sqrt();
    let space = gap * radius(points_a).min(radius(points_b));
    let distance = reach(points_a, away) + reach(&turned, away.map(|v| -v)) + space;
    let offset = away.map(|v| v * distance);
    let (kdop_a, kdop_b) = (kdop_of(points_a), kdop_of(points_b));
    [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26].map(|set| {
        let group = Group::of_one(&NodeSlabs::from_kdop(&kdop_b, set.slabs()));
        (0..set.slabs()).all(|slab| {
            let direction = DIRECTIONS[slab].map(f64::from);
            let seen = [0, 1, 2].map(|i| (0..3).map(|j| rotation[j][i] * direction[j]).sum());
            let form = upper_form(seen, set);
            let end = |rows: [u8; 3]| -> f64 {
                let term = |j: usize| {
                    f64::from(form.coefficients[j]) * f64::from(group.rows()[usize::from(rows[j])][0])
                };
                term(0) + term(1) + term(2) + dot(direction, offset)
            };
            let (lo, hi) = (end(form.mirrored().rows), end(form.rows));
            lo <= f64::from(kdop_a.hi[slab]) && hi >= f64::from(kdop_a.lo[slab])
        })
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn kdop_of(points: &[[f64; 3]]) -> Kdop {
    Kdop::of_points(points.iter().map(|point| point.map(|v| v as f32)))
}

/// Returns the corners of a patch relative to the middle of its box, in units of its largest extent.
fn centred(patch: &[Corners]) -> Vec<[f64; 3]> {
    let points: Vec<[f64; 3]> = patch.iter().flatten().map(|corner| corner.map(f64::from)).collect();
    let ends = [0, 1, 2].map(|axis| {
        let values = points.iter().map(|p| p[axis]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    });
    let extent = ends.iter().map(|(lo, hi)| hi - lo).fold(0.0, f64::max);
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    points.iter().map(|p| [0, 1, 2].map(|a| (p[a] - (ends[a].0 + ends[a].1) / 2.0) * scale)).collect()
}

/// A linear congruential generator. Its numbers must be reproducible; their quality does not matter.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 >> 33
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    /// Returns a number from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.next() as f64 / (1u64 << 31) as f64
    }

    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [(); 3].map(|()| 2.0 * self.unit() - 1.0);
            let length = dot(v, v).sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|c| c / length);
            }
        }
    }

    fn rotation(&mut self) -> [[f64; 3]; 3] {
        let x = self.direction();
        loop {
            let other = self.direction();
            let along = dot(x, other);
            if along.abs() < 0.9 {
                let length = (1.0 - along * along).sqrt();
                let y = [0, 1, 2].map(|i| (other[i] - along * x[i]) / length);
                let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                return [x, y, z];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thin bars along the axes. Boxes fit them only until they are rotated.
    fn bars() -> Vec<Corners> {
        (0..200)
            .map(|i| {
                let base = i as f32 * 0.1;
                [[base, 0.0, 0.0], [base + 5.0, 5.0, 0.01], [base + 5.0, 5.1, 0.0]]
            })
            .collect()
    }

    fn chosen(triangles: &[Corners], options: &Options) -> (Choice, [f64; 3]) {
        let count = triangles.len() as u64;
        let trials = trials(count, options);
        let patch = |&(start, length): &(u64, u64)| triangles[start as usize..][..length as usize].to_vec();
        let corners: Vec<Vec<Corners>> = patches(&trials).iter().map(patch).collect();
        (choose(count, &trials, &corners, options), overlap_rates(&trials, &corners))
    }

    #[test]
    fn more_directions_overlap_less_and_the_choice_is_reproducible() {
        let triangles = bars();
        let (choice, rates) = chosen(&triangles, &Options::default());
        assert!(rates[0] >= rates[1] && rates[1] >= rates[2], "{rates:?}");
        assert_eq!(rates, chosen(&triangles, &Options::default()).1);
        assert_eq!(choice.encoding, TriangleEncoding::F32);
        assert!(choice.reason.contains(choice.profile.name()), "{}", choice.reason);
        let small = Options::default().triangles(TriangleEncoding::Packed);
        assert_eq!(chosen(&triangles, &small).0.profile.treelet_bytes(), 64);
    }

    #[test]
    fn a_point_has_a_choice() {
        let point = vec![[[1.0f32, 2.0, 3.0]; 3]];
        assert!(!chosen(&point, &Options::default()).0.reason.is_empty());
    }
}
