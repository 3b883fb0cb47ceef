//! How deep shapes overlap, against depths that are known.

mod clashes;
mod convex;
mod known;
mod labelled;
mod signed;

use bvh_query::{Bvh, Penetration, PenetrationOptions, Pose, Querier, Relation};

/// Asks for a penetration on all backends, which have to agree. Checks that its bounds are in order, and that the translation
/// makes the shapes disjoint.
#[track_caller]
fn penetration(queriers: &mut [Querier], a: &Bvh, b: &Bvh, pose: &Pose) -> Penetration {
    let options = PenetrationOptions::new();
    let first = queriers[0].penetration(a, b, pose, &options).unwrap();
    for querier in &mut queriers[1..] {
        assert_eq!(querier.penetration(a, b, pose, &options).unwrap(), first, "{}", querier.backend());
    }
    assert!(0.0 <= first.lower && first.lower <= first.upper && first.upper.is_finite(), "{first:?}");
    let length = first.translation.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!((length - first.upper).abs() <= 1e-14 * length, "{first:?}");
    let moved = moved(pose, first.translation);
    assert_eq!(queriers[0].relation(a, b, &moved).unwrap(), Relation::Apart, "{first:?}");
    first
}

fn moved(pose: &Pose, translation: [f64; 3]) -> Pose {
    let from = pose.translation();
    Pose::new(*pose.rotation(), [0, 1, 2].map(|k| from[k] + translation[k])).unwrap()
}
