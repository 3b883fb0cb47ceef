//! Points that see each other past a mesh, against exact distances of what is left between them from every triangle.

use crate::common::{Random, Triangle, baked, queriers, stored};
use bvh_query::{NumberError, Pose, QueryError, Scene, SceneError};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::Length;

/// Vectors of whole length: quarters and halves of them are exact, and so are the margins that leave these out.
const WAYS: [([f64; 3], f64); 5] = [
    ([4.0, 8.0, 8.0], 12.0),
    ([8.0, -12.0, 24.0], 28.0),
    ([0.0, 12.0, -16.0], 20.0),
    ([0.0, 0.0, 8.0], 8.0),
    ([0.0; 3], 0.0),
];

#[test]
fn points_see_each_other_past_what_the_margins_leave() {
    let mut queriers = queriers();
    let mut random = Random::new(71);
    let mut seen = [0; 2];
    for round in 0..rounds(60) {
        let mut corner = || [(); 3].map(|()| random.below(17) as f64 - 8.0);
        let mut triangles: Vec<Triangle> = (0..6).map(|_| [corner(), corner(), corner()]).collect();
        let starts = [triangles[0][0], triangles[1][2], corner(), corner(), corner()];
        triangles[5][2] = triangles[5][1];
        let bvh = baked(&triangles);
        let core: Vec<Triangle> = stored(&bvh).iter().map(|stored| stored.corners).collect();
        let radius = [0.0, 1.0][round as usize % 2];
        let shape = bvh.all().rounded(radius).unwrap();
        let mut scene = Scene::new().unwrap();
        let id = scene.add(bvh.clone(), Pose::IDENTITY).unwrap();
        scene.set_margin(id, radius).unwrap();
        for share in [0.0, 0.125, 0.25, 0.5, 1.0] {
            for (way, length) in WAYS {
                let margin = share * length;
                let pairs = starts.map(|from| [from, [0, 1, 2].map(|k| from[k] + way[k])]);
                let expected: Vec<bool> = pairs
                    .iter()
                    .map(|[from, to]| {
                        let end =
                            |from: &[f64; 3], sign: f64| [0, 1, 2].map(|k| from[k] + sign * share * way[k]);
                        let [p, q] = [end(from, 1.0), end(to, -1.0)];
                        let is_near = |of: &Triangle| Length::between(of, &[p, q, q]).compare(radius).is_le();
                        margin > 0.0 && share >= 0.5 || !core.iter().any(is_near)
                    })
                    .collect();
                for querier in &mut queriers {
                    for ([from, to], expected) in pairs.iter().zip(&expected) {
                        let found = querier.visible(shape, *from, *to, margin);
                        assert_eq!(found, Ok(*expected), "{from:?} {to:?} {margin} {core:?} {radius}");
                        assert_eq!(querier.visible(shape, *to, *from, margin), Ok(*expected));
                        if margin == 0.0 {
                            assert_eq!(querier.segment_hit(shape, *from, *to), Ok(!expected));
                        }
                    }
                }
                #[cfg(feature = "parallel")]
                assert_eq!(
                    bvh_query::ProbeBatch::new(shape).unwrap().visible(&pairs, margin).unwrap(),
                    expected
                );
                assert_eq!(scene.visible(&pairs, margin).unwrap(), expected);
                expected.iter().for_each(|&expected| seen[usize::from(expected)] += 1);
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
}

/// From a face that rounding moved, margins see out.
#[test]
fn points_on_a_surface_see_out_with_a_margin() {
    let bvh = baked(&[[[0.1, 0.2, 0.3], [1.3, 0.1, 0.7], [0.4, 1.7, 0.9]]]);
    let [a, b, c] = stored(&bvh)[0].corners;
    let mut random = Random::new(72);
    let mut blocked = 0;
    for querier in &mut queriers() {
        for _ in 0..rounds(200) {
            let (s, t) = (0.1 + 0.4 * random.unit(), 0.1 + 0.4 * random.unit());
            let on = [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
            for side in [5.0, -5.0] {
                let to = [on[0] + random.signed(), on[1] + random.signed(), on[2] + side];
                blocked += u32::from(!querier.visible(&bvh, on, to, 0.0).unwrap());
                assert!(querier.visible(&bvh, on, to, 1e-6).unwrap(), "{on:?} {to:?}");
            }
        }
    }
    assert!(blocked > 0, "rounding leaves some points behind the face");
}

#[test]
fn margins_that_are_no_length_are_refused() {
    let bvh = baked(&crate::common::shapes::cube());
    let mut scene = Scene::new().unwrap();
    scene.add(bvh.clone(), Pose::IDENTITY).unwrap();
    let (from, to) = ([-9.0, 0.0, 0.0], [9.0, 0.0, 0.0]);
    for querier in &mut queriers() {
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            let is_refused = |found| matches!(found, Err(QueryError::Number(NumberError::Margin(_))));
            assert!(is_refused(querier.visible(&bvh, from, to, bad)));
            #[cfg(feature = "parallel")]
            assert!(is_refused(bvh_query::ProbeBatch::new(&bvh).unwrap().visible(&[], bad).map(|_| true)));
            assert!(matches!(scene.visible(&[], bad), Err(SceneError::Query(QueryError::Number(_)))));
        }
        assert!(querier.visible(&bvh, from, [f64::NAN; 3], 1.0).is_err());
        // Numbers whose squares are too large or too small.
        let far = 2f64.powi(120);
        assert_eq!(querier.visible(&bvh, [-far, 0.0, 0.0], [far, 0.0, 0.0], 1.0), Ok(false));
        assert_eq!(querier.visible(&bvh, [-far, 0.0, 0.0], [far, 0.0, 0.0], far), Ok(true));
        assert_eq!(querier.visible(&bvh, [1.0, 0.0, 0.0], [1.0, 1e-200, 0.0], 1e-300), Ok(false));
        assert_eq!(querier.visible(&bvh, [1.0, 0.0, 0.0], [1.0, 1e-200, 0.0], 1e-200), Ok(true));
        assert_eq!(querier.visible(&bvh, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.0), Ok(false));
    }
}
