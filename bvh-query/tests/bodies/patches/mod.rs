//! Compares contact regions with exact arithmetic, and patches with configurations of which the answer is known.

mod known;
mod points;
mod regions;

use crate::common::nearest::dot;
use crate::common::shapes::{cube, outward};
use crate::common::{Triangle, baked, queriers};
use bvh_query::{Bvh, Patch, PatchOptions, Patches, Pose, Querier};

/// Asks all backends, which have to agree to the last bit.
fn patches(a: &Bvh, b: &Bvh, pose: &Pose, options: &PatchOptions) -> Patches {
    let mut answers = queriers().into_iter().map(|mut querier| querier.patches(a, b, pose, options).unwrap());
    let first = answers.next().unwrap();
    answers.for_each(|other| assert_eq!(other, first));
    let (mut place, mut point) = (0, 0);
    for patch in &first.patches {
        assert_eq!(patch.first, place, "{patch:?}");
        place += patch.count;
        assert_eq!(patch.first_point, point, "{patch:?}");
        assert!(patch.point_count <= options.max_points, "{patch:?}");
        point += patch.point_count;
        let contacts = &first.regions[patch.first..][..patch.count];
        assert!(contacts.is_sorted_by(|p, q| p.contact < q.contact) && contacts.len() == patch.count);
        assert!(patch.normal == [0.0; 3] || is_close(dot(patch.normal, patch.normal), 1.0), "{patch:?}");
        let numbers = [patch.center, patch.normal, [patch.length, patch.area, patch.depth]];
        assert!(numbers.as_flattened().iter().all(|x| x.is_finite()), "{patch:?}");
    }
    assert_eq!((place, point), (first.regions.len(), first.points.len()));
    for of in &first.points {
        assert!(of.point.iter().all(|x| x.is_finite()) && of.depth.is_finite(), "{of:?}");
        assert!(is_close(dot(of.normal, of.normal), 1.0), "{of:?}");
    }
    let lowest = first.patches.iter().map(|patch| first.regions[patch.first].contact);
    assert!(lowest.is_sorted());
    first
}

/// Asks about the triangles of two meshes, of which B is where it is.
fn patches_of(a: &[Triangle], b: &[Triangle]) -> Vec<Patch> {
    patches(&baked(a), &baked(b), &Pose::IDENTITY, &PatchOptions::new()).patches
}

fn only(patches: Vec<Patch>) -> Patch {
    assert_eq!(patches.len(), 1, "{patches:?}");
    patches[0]
}

fn is_close(x: f64, y: f64) -> bool {
    (x - y).abs() <= 1e-6 * (1.0 + y.abs())
}

#[track_caller]
fn expect_close(found: &[f64], expected: &[f64]) {
    assert!(found.iter().zip(expected).all(|(x, y)| is_close(*x, *y)), "{found:?}, not {expected:?}");
}

/// Makes the box between two corners, its faces turned outward.
fn block(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
    let place = |p: [f64; 3]| [0, 1, 2].map(|k| if p[k] < 0.0 { low[k] } else { high[k] });
    outward(cube()).into_iter().map(|t| t.map(place)).collect()
}

fn querier() -> Querier {
    queriers().remove(0)
}
