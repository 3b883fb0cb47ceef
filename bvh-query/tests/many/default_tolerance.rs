//! The default tolerance of motions: that of the smaller shape, and never one that poses cannot resolve.

use crate::common::shapes::cube;
use crate::common::{baked, queriers, translation as at};
use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Querier};

/// A plate of two triangles with sides of 1,000, at height 0.
fn floor() -> Bvh {
    let corner = |x: f64, y: f64| [500.0 * x, 500.0 * y, 0.0];
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    baked(&[[a, b, c], [a, c, d]])
}

/// What is small meets a large plate as exactly as its own size asks for, not as the plate's does.
#[test]
fn the_default_tolerance_is_that_of_the_smaller_shape() {
    let (floor, block, point) = (floor(), baked(&cube()), baked(&[[[0.0; 3]; 3]]));
    let ball = point.all().rounded(0.5).unwrap();
    let falls = Motion::between(&at(1.0, 2.0, 10.0), &at(1.0, 2.0, -10.0)).unwrap();
    let options = MotionOptions::new();
    for querier in &mut queriers() {
        for (falling, height, size) in [(block.all(), 1.0, 12f64.sqrt()), (ball, 0.5, 1.0)] {
            for (a, b, path) in [(floor.all(), falling, true), (falling, floor.all(), false)] {
                assert_eq!(options.tolerance_between(a, b), 1e-6 * size);
                // Seen from what falls, the plate rises.
                let rises = Motion::between(&at(-1.0, -2.0, -10.0), &at(-1.0, -2.0, 10.0)).unwrap();
                let answer = querier.motion(a, b, if path { &falls } else { &rises }, &options).unwrap();
                let MotionAnswer::Hit { free_until, touching_at, .. } = answer else { panic!("{answer:?}") };
                let met = (10.0 - height) / 20.0;
                assert!(free_until <= met + 1e-15 && touching_at >= met - 1e-15, "{answer:?}");
                assert!(20.0 * (touching_at - free_until) <= 1e-6 * size, "{answer:?}");
            }
        }
    }
    // A point has no size of its own, and two have none at all.
    assert_eq!(options.tolerance_between(&point, &floor), 1e-6 * 2e6f64.sqrt());
    assert_eq!(options.tolerance_between(&point, &point), 1e-6);
    assert_eq!(options.tolerance(0.25).tolerance_between(&point, &floor), 0.25);
}

/// However small a shape is, and however far from its frame's origin, the default tolerance is one that poses resolve.
#[test]
fn rounded_poses_resolve_the_default_tolerance() {
    let grain = |size: f64, far: f64| -> Bvh {
        baked(&cube().into_iter().map(|t| t.map(|p| p.map(|v| size * v + far))).collect::<Vec<_>>())
    };
    let mut querier = Querier::new().unwrap();
    for (size, far) in [(1e-9, 0.0), (2f64.powi(-20), 0.0), (2f64.powi(-10), 1e7)] {
        let (floor, grain) = (floor(), grain(size, far));
        let height = |z: f64| at(-far, -far, z - far);
        let falls = Motion::between(&height(10.0), &height(-10.0)).unwrap();
        let answer = querier.motion(&floor, &grain, &falls, &MotionOptions::new()).unwrap();
        let MotionAnswer::Hit { free_until, touching_at, .. } = answer else { panic!("{answer:?}") };
        let most = MotionOptions::new().tolerance_between(&floor, &grain) + 1e-9 * (1.0 + far);
        assert!(free_until <= 0.5 && 20.0 * (touching_at - free_until) <= most, "{answer:?}");
        assert!(20.0 * (0.5 - touching_at).abs() <= size + most, "{answer:?}");
    }
}
