//! Chooses a few of many contact points: the deepest one first, then those that most enlarge the outline of the chosen ones.
//!
//! Physics engines reduce contacts to such points (for instance, Jolt's `PruneContactPoints` and Bullet's persistent manifold), because a
//! convex outline carries the same forces and torques as all points in it. The choice here is stateless. A small tilt along a fixed
//! direction decides between points that are equal but for rounding, so the noise of a body at rest does not exchange them.

/// One of the points at which a patch pushes: see [`PatchOptions::max_points`](crate::PatchOptions::max_points). In A's frame and in
/// mesh units; rounded, and not certified.
///
/// [`Querier::patches`](crate::Querier::patches) has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PatchPoint {
    /// The middle between both surfaces on a line along the patch's normal, or a point of the curve in which they meet.
    pub point: [f64; 3],
    /// The direction in which A pushes B here, at length 1. It is the mean of the normals of A and, reversed, of B where the line
    /// meets them, weighted by the squares of their cosines to the patch's normal. For a vertex it is that of the other mesh alone,
    /// and at the patch's centre it is the patch's normal.
    pub normal: [f64; 3],
    /// How deep the meshes overlap here along `normal`: the length on the line times the cosine between `normal` and the patch's
    /// normal. For shapes with radii, it is about their cores: minus the gap where these are apart, which is at least minus the sum
    /// of the radii. So a radius serves as the margin of a simulator. If the radii are a part of the bodies, add their sum.
    pub depth: f64,
}

/// A contact point, and where it is in the plane of the patch.
#[derive(Clone, Copy)]
pub(super) struct PointCandidate {
    pub(super) place: [f64; 2],
    pub(super) point: PatchPoint,
}

/// The direction in the plane along which points count for a little more, of length 1.
const TILT: [f64; 2] = [0.8, 0.6];

/// How much more a point at the edge of the patch counts along that direction, as a share of the largest depth or of the area.
const TILT_SHARE: f64 = 1.0 / 1024.0;

/// A point has to enlarge the outline by this share of its area. A circle has about 16 such points.
const LEAST_GAIN: f64 = 1.0 / 256.0;

/// The least area of an outline, as a share of the square of the patch's size: below that, points are on one line.
const LEAST_AREA: f64 = 1.0 / (1 << 24) as f64;

/// Returns at most `most` of the candidates, in the order in which they were chosen.
pub(super) fn choose(mut candidates: Vec<PointCandidate>, most: usize) -> Vec<PatchPoint> {
    let size = candidates.iter().flat_map(|of| of.place).fold(0.0_f64, |size, x| size.max(x.abs()));
    if size > 0.0 {
        candidates.iter_mut().for_each(|of| of.place = of.place.map(|x| x / size));
    }
    let depths = || candidates.iter().map(|of| of.point.depth);
    let least = depths().fold(f64::INFINITY, f64::min);
    let span = depths().fold(0.0_f64, |span, depth| span.max(depth.abs()));
    let share = |depth: f64| if span > 0.0 { depth / span } else { 0.0 };
    let tilt = |of: &PointCandidate| TILT_SHARE * (TILT[0] * of.place[0] + TILT[1] * of.place[1]);
    // A deep point counts for up to twice as much as a shallow one, so that of two at one place the deeper one is chosen.
    let weight = |of: &PointCandidate| (1.0 + 0.5 * share(of.point.depth - least)) * (1.0 + tilt(of));
    let (mut chosen, mut outline) = (Vec::new(), Vec::<[f64; 2]>::new());
    while chosen.len() < most {
        let needed = needed_gain(&outline);
        let value = |of: &PointCandidate| {
            if outline.is_empty() {
                return Some(share(of.point.depth) + tilt(of));
            }
            let gain = gain(&outline, of.place);
            (gain >= needed).then(|| gain * weight(of))
        };
        let mut best: Option<(f64, usize)> = None;
        for (number, candidate) in candidates.iter().enumerate() {
            if let Some(value) = value(candidate)
                && best.is_none_or(|(most, _)| value > most)
            {
                best = Some((value, number));
            }
        }
        let Some((_, number)) = best else { break };
        chosen.push(candidates[number].point);
        outline.push(candidates[number].place);
        outline = hull(outline);
    }
    chosen
}

/// Returns how much a point has to enlarge an outline to be chosen, as [`gain`] measures it.
fn needed_gain(outline: &[[f64; 2]]) -> f64 {
    match outline {
        [] | [_] => LEAST_GAIN * LEAST_GAIN,
        [p, q] => LEAST_GAIN * LEAST_GAIN * squared(*p, *q),
        [p, rest @ ..] => {
            let area: f64 = rest.windows(2).map(|pair| twice_area(*p, pair[0], pair[1])).sum();
            (LEAST_GAIN * area).max(LEAST_AREA)
        }
    }
}

/// Returns by how much a point enlarges an outline: the square of its distance from a point, or twice the area.
fn gain(outline: &[[f64; 2]], point: [f64; 2]) -> f64 {
    match outline {
        [] => 0.0,
        [p] => squared(*p, point),
        [p, q] => twice_area(*p, *q, point).abs(),
        _ => {
            let next = outline.iter().cycle().skip(1);
            outline.iter().zip(next).map(|(p, q)| (-twice_area(*p, *q, point)).max(0.0)).sum()
        }
    }
}

fn squared(p: [f64; 2], q: [f64; 2]) -> f64 {
    let [x, y] = [q[0] - p[0], q[1] - p[1]];
    x * x + y * y
}

/// Returns twice the area of a triangle, which is positive if its corners go around counterclockwise.
fn twice_area(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Returns the corners of the convex hull, counterclockwise (A. M. Andrew, "Another Efficient Algorithm for Convex Hulls in Two
/// Dimensions", 1979).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if points.len() < 3 {
        return points;
    }
    points.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain = Vec::<[f64; 2]>::new();
        for point in points {
            while let [.., p, q] = chain[..]
                && twice_area(p, q, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        // The last point is the first one of the other chain.
        chain.pop();
        chain
    };
    let mut corners = chain(&mut points.iter().copied());
    corners.extend(chain(&mut points.iter().rev().copied()));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    fn candidate(x: f64, y: f64, depth: f64) -> PointCandidate {
        PointCandidate {
            place: [x, y],
            point: PatchPoint { point: [x, y, 0.0], normal: [0.0, 0.0, 1.0], depth },
        }
    }

    /// The corners of a square win against points on its sides and in it, whatever the number of these.
    #[test]
    fn corners_are_chosen_and_nothing_else() {
        let mut random = Random::new(11);
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        for most in 4..9 {
            let mut all: Vec<_> = corners.iter().map(|[x, y]| candidate(*x, *y, 0.5)).collect();
            for _ in 0..50 {
                let side = corners[random.below(4)];
                let (x, y) = (random.signed(), random.signed());
                all.push(candidate(x, y, 0.0));
                all.push(candidate(side[0], y, 0.25));
            }
            all.reverse();
            let chosen = choose(all, most);
            assert_eq!(chosen.len(), 4);
            assert!(chosen.iter().all(|of| of.depth == 0.5));
        }
        // None of no candidates, and one where all are at one place.
        assert!(choose(Vec::new(), 4).is_empty());
        assert_eq!(choose(vec![candidate(0.0, 0.0, 0.0); 5], 4).len(), 1);
    }

    /// An exhaustive search finds no four points whose outline is much larger. The first one is chosen for its depth alone.
    #[test]
    fn outlines_are_nearly_as_large_as_the_largest() {
        let mut random = Random::new(12);
        for _ in 0..100 {
            let all: Vec<_> = (0..12).map(|_| candidate(random.signed(), random.signed(), 0.0)).collect();
            let area = |of: &[[f64; 2]]| {
                let of = hull(of.to_vec());
                (1..of.len().saturating_sub(1)).map(|k| twice_area(of[0], of[k], of[k + 1])).sum::<f64>()
            };
            let chosen: Vec<_> = choose(all.clone(), 4).iter().map(|of| [of.point[0], of.point[1]]).collect();
            let mut largest = 0.0_f64;
            for i in 0..12 {
                for j in 0..i {
                    for k in 0..j {
                        for l in 0..k {
                            largest = largest.max(area(&[i, j, k, l].map(|n| all[n].place)));
                        }
                    }
                }
            }
            assert!(area(&chosen) > 0.6 * largest, "{} of {largest}", area(&chosen));
        }
    }

    #[test]
    fn noise_does_not_exchange_equal_points() {
        let mut random = Random::new(13);
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let mut noisy = || {
            let mut noise = || 1.0 + 1e-9 * random.signed();
            let all = corners.map(|[x, y]| candidate(x * noise(), y * noise(), 0.5 * noise()));
            choose(all.to_vec(), 3)
        };
        let first = noisy();
        for _ in 0..100 {
            for (p, q) in noisy().iter().zip(&first) {
                assert!((0..3).all(|k| (p.point[k] - q.point[k]).abs() < 1e-8));
            }
        }
    }
}
