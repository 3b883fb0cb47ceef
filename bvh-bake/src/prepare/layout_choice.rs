//! Chooses the profile and the triangle encoding of an object by estimated query cost.
//!
//! A pair traversal costs its number of node tests times the cost of one test, and that number depends on how often
//! bounds overlap whose contents do not. Trials estimate this: nodes of a brick's tree, with at least 1, 8 and 64 triangles
//! below them, are placed beside each other in random orientations, with gaps from 0 to the size of a node. They are tested
//! with the k-DOPs of each direction set, the second one re-aligned as in a query. The estimate is the number of overlaps
//! per trial times the measured cost of a test with that set. The tree is the one that the file will have: all candidates
//! have treelets of the same width. The random numbers have constant seeds, so that equal meshes get equal choices.

use crate::options::Options;
use crate::threads;
use crate::tree::{PacketTriangles, Tree};
use crate::triangles::{Corners, Triangle};
use bvh_format::kdop::{DIRECTIONS, DirectionSet, Kdop};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_format::realign::upper_form;
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::vec3::dot;
use std::collections::HashMap;

/// A layout, and the reason for choosing it.
pub(crate) struct Choice {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) reason: String,
}

/// The candidates, and the cost in nanoseconds of testing 16 pairs of their nodes, with everything that belongs to a
/// test. The cost is the median time of a collide query divided by the mean number of its node tests, for bunny poses
/// 1e-6 of the size apart (AVX-512, AMD EPYC, Zen 5 class, 2026-11-22).
const FAST_PROFILES: [(Profile, f64); 3] =
    [(Profile::Dop6F16, 94.0), (Profile::Dop14U8, 108.0), (Profile::Dop26U8Wide, 150.0)];
/// The same for profiles with treelets of one line, for files that must be small.
const COMPACT_PROFILES: [(Profile, f64); 3] =
    [(Profile::Dop6F16, 94.0), (Profile::Dop14U8, 108.0), (Profile::Dop26U4, 121.0)];
/// The number of node tests with dop26-u4 per node test with 8-bit codes and the same width, because 4-bit codes give
/// wider bounds: 111 to 78 for bunny poses 1e-6 apart.
const U4_TESTS: f64 = 1.4;
/// The bytes of nodes and plain triangles beyond which reading the file costs more than unpacking it. With warm caches,
/// packed triangles take up to 1.21 times as long as plain ones. This also holds where the caches are too small for
/// them, because the vertices of a packed packet take as many lines as a plain packet.
const MAX_PLAIN_BYTES: u64 = 256 << 20;
/// Bytes of nodes and plain lanes per triangle.
const PLAIN_BYTES_PER_TRIANGLE: u64 = 52;
/// The profile of clouds of points.
const CLOUD_PROFILE: Profile = Profile::Dop14U8;
/// The number of trials per object.
const TRIAL_COUNT: usize = 400;

/// The least numbers of triangles below the nodes of trials, which take turns.
const TRIAL_SIZES: [usize; 3] = [1, 8, 64];
/// A node with more than this many times the wanted number of triangles is not taken; the node below it is.
const MAX_EXCESS: usize = 4;

/// The width of all profiles among which the choice is open.
const WIDTH: usize = 4;

/// Returns the width of the treelets, which the builder of trees has to know before the choice is made.
pub(crate) fn width(options: &Options) -> usize {
    options.profile.map_or(WIDTH, Profile::width)
}

/// A node of trials.
struct Node {
    /// The corners of its triangles, relative to the middle of its box, in units of its largest extent.
    points: Vec<[f64; 3]>,
    /// The distance from the middle to the farthest corner.
    radius: f64,
    kdop: Kdop,
}

impl Node {
    fn new(triangles: &[Corners]) -> Self {
        let points = centred(triangles);
        let radius = points.iter().map(|p| dot(*p, *p)).fold(0.0, f64::max).sqrt();
        let kdop = Kdop::of_points(points.iter().map(|point| point.map(|v| v as f32)));
        Self { points, radius, kdop }
    }
}

/// A trial: two nodes, by number, and the placement of one beside the other.
struct Trial {
    nodes: [usize; 2],
    rotation: [[f64; 3]; 3],
    away: [f64; 3],
    gap: f64,
}

/// Makes the trials of a tree, and their nodes. A small tree has few nodes, which many trials share.
fn trials(tree: &Tree<PacketTriangles>, triangles: &[Triangle]) -> (Vec<Node>, Vec<Trial>) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut places, mut number_of) = (Vec::new(), HashMap::new());
    let mut node = |random: &mut Random, least: usize| {
        let place = (random.below(tree.node_count() as u64) as u32, least);
        *number_of.entry(place).or_insert_with(|| {
            places.push(place);
            places.len() - 1
        })
    };
    let mut trial = |number: usize| {
        let least = TRIAL_SIZES[number % 3];
        let nodes = [(); 2].map(|()| node(&mut random, least));
        Trial { nodes, rotation: random.rotation(), away: random.direction(), gap: random.unit() }
    };
    let trials = (0..TRIAL_COUNT).map(&mut trial).collect();
    let node = |&(place, least): &(u32, usize)| {
        let numbers = tree.triangles_around(place, least, MAX_EXCESS * least);
        let corners: Vec<_> = numbers.into_iter().map(|number| triangles[number as usize].corners).collect();
        Node::new(&corners)
    };
    (threads::map(&places, node), trials)
}

/// Chooses what the options leave open for a cloud of points, without trials.
fn of_cloud(options: &Options) -> Choice {
    let encoding = options.triangles.unwrap_or(TriangleEncoding::Packed);
    let profile = options.profile.unwrap_or(CLOUD_PROFILE);
    Choice {
        profile,
        encoding,
        reason: format!("{} and {} for a cloud of points", profile.name(), encoding.name()),
    }
}

/// Chooses what the options leave open for an object of `count` triangles, given the tree of one of its bricks.
pub(crate) fn choose(
    count: u64,
    tree: &Tree<PacketTriangles>,
    triangles: &[Triangle],
    is_cloud: bool,
    options: &Options,
) -> Choice {
    if is_cloud {
        return of_cloud(options);
    }
    let mut reasons = Vec::new();
    let encoding = options.triangles.unwrap_or_else(|| {
        let bytes = count * PLAIN_BYTES_PER_TRIANGLE;
        if bytes <= MAX_PLAIN_BYTES {
            reasons.push("plain triangles are the fastest".to_owned());
            return TriangleEncoding::F32;
        }
        let (size, limit) = (bytes >> 20, MAX_PLAIN_BYTES >> 20);
        reasons.push(format!(
            "packed triangles, because nodes and plain triangles take about {size} MiB without ids \
             ({PLAIN_BYTES_PER_TRIANGLE} bytes per triangle), more than the limit of {limit} MiB"
        ));
        TriangleEncoding::Packed
    });
    let profile = options.profile.unwrap_or_else(|| {
        // A caller who asks for packed triangles wants a small file, and one who asks for quantised triangles wants the
        // smallest.
        let candidates = match options.triangles {
            None | Some(TriangleEncoding::F32) => &FAST_PROFILES[..],
            Some(TriangleEncoding::Packed) => &COMPACT_PROFILES,
            Some(TriangleEncoding::Quantized) => &COMPACT_PROFILES[..2],
        };
        let (profile, reason) = cheapest(&trials(tree, triangles), candidates);
        reasons.push(reason);
        profile
    });
    Choice { profile, encoding, reason: reasons.join("; ") }
}

fn cheapest(trials: &(Vec<Node>, Vec<Trial>), candidates: &[(Profile, f64)]) -> (Profile, String) {
    let rates = overlap_rates(trials);
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

/// Returns how often nodes that are apart overlap, for each direction set.
fn overlap_rates((nodes, trials): &(Vec<Node>, Vec<Trial>)) -> [f64; 3] {
    let overlaps = |trial: &Trial| trial_overlaps(trial.nodes.map(|node| &nodes[node]), trial);
    let found = threads::map(trials, overlaps);
    // One overlap is added to each count, so that no set seems free.
    [0, 1, 2].map(|set| (1 + found.iter().filter(|found| found[set]).count()) as f64 / TRIAL_COUNT as f64)
}

/// Returns, for each set, whether the k-DOPs overlap if B is placed beside A so that their extents along `away` leave a
/// gap of `gap` times the radius of the smaller node.
fn trial_overlaps([a, b]: [&Node; 2], trial: &Trial) -> [bool; 3] {
    let Trial { rotation, away, gap, .. } = *trial;
    let rotate = |p: &[f64; 3]| rotation.map(|row| dot(row, *p));
    let reach = |points: &mut dyn Iterator<Item = [f64; 3]>, d: [f64; 3]| {
        points.map(|p| dot(p, d)).fold(f64::MIN, f64::max)
    };
    let space = gap * a.radius.min(b.radius);
    let reach_b = reach(&mut b.points.iter().map(rotate), away.map(|v| -v));
    let distance = reach(&mut a.points.iter().copied(), away) + reach_b + space;
    let offset = away.map(|v| v * distance);
    [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26].map(|set| {
        let group = Group::of_one(&NodeSlabs::from_kdop(&b.kdop, set.slabs()));
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
            lo <= f64::from(a.kdop.hi[slab]) && hi >= f64::from(a.kdop.lo[slab])
        })
    })
}

/// Returns the corners of a node relative to the middle of its box, in units of its largest extent.
fn centred(triangles: &[Corners]) -> Vec<[f64; 3]> {
    let points: Vec<[f64; 3]> = triangles.iter().flatten().map(|corner| corner.map(f64::from)).collect();
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
    use crate::tree::tree_of;

    /// Thin bars along the axes. Boxes fit them only until they are rotated.
    fn bars() -> Vec<Corners> {
        (0..200)
            .map(|i| {
                let base = i as f32 * 0.1;
                [[base, 0.0, 0.0], [base + 5.0, 5.0, 0.01], [base + 5.0, 5.1, 0.0]]
            })
            .collect()
    }

    fn chosen(corners: &[Corners], options: &Options) -> (Choice, [f64; 3]) {
        let triangles: Vec<Triangle> =
            corners.iter().zip(0..).map(|(&corners, id)| Triangle { corners, id }).collect();
        let tree = tree_of(&triangles, width(options), options.effort);
        let rates = overlap_rates(&trials(&tree, &triangles));
        (choose(corners.len() as u64, &tree, &triangles, false, options), rates)
    }

    /// Numbers of a permutation of `count` numbers.
    fn shuffled(count: usize) -> Vec<usize> {
        let (mut random, mut numbers) = (Random(77), (0..count).collect::<Vec<_>>());
        (1..count).rev().for_each(|last| numbers.swap(last, random.below(last as u64 + 1) as usize));
        numbers
    }

    #[test]
    fn candidates_have_the_width_for_which_the_tree_is_built() {
        for (profile, _) in FAST_PROFILES.iter().chain(&COMPACT_PROFILES) {
            assert_eq!(profile.width(), WIDTH, "{}", profile.name());
        }
    }

    /// Neighbours in a tree are near each other, whatever the order of the input is.
    #[test]
    fn the_order_of_the_input_hardly_matters() {
        let (positions, faces) = cbvh_testkit::ball::ball(4_000);
        let corner = |index: u32| positions[index as usize].map(|c| c as f32);
        let ball: Vec<Corners> = faces.iter().map(|face| face.map(corner)).collect();
        let mixed: Vec<Corners> = shuffled(ball.len()).into_iter().map(|number| ball[number]).collect();
        let (options, mut rates) = (Options::default(), Vec::new());
        for triangles in [&ball, &mixed] {
            let (choice, found) = chosen(triangles, &options);
            assert_eq!(choice.profile, Profile::Dop26U8Wide, "{}", choice.reason);
            rates.push(found);
        }
        for set in 0..3 {
            let ratio = rates[0][set] / rates[1][set];
            assert!((0.7..1.4).contains(&ratio), "{rates:?}");
        }
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
