//! Coordinates in f64 that are smaller than any f32: a file keeps them as its origin, and contact must still be
//! exact.

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{baked, queriers, stored};
use bvh_query::Pose;

/// Queries two equal triangles in parallel planes that are `gap` apart in the input. The truth is what the file
/// stores.
#[test]
fn parallel_triangles_less_than_all_f32_apart() {
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    for gap_exponent in [-149, -150, -200, -266, -300, -400, -700, -1000, -1074] {
        for size_exponent in [0, -20, -40, -80, -140] {
            let (gap, size) = (2f64.powi(gap_exponent), 2f64.powi(size_exponent));
            let at = |x: f64| [[x, 0.0, 0.0], [x, size, 0.0], [x, 0.0, size]];
            let [a, b] = [at(gap), at(0.0)].map(|t| baked(&[t]));
            let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
            let truth = Truth::new(&surfaces[0], &surfaces[1], &Pose::IDENTITY);
            let mut asked = Asked { a: &a, b: &b, queriers: &mut queriers };
            if let Err(error) = asked.all(&truth, &Pose::IDENTITY, &mut tally) {
                tally.wrong(format!("gap 2^{gap_exponent}, size 2^{size_exponent}: {error}"));
            }
        }
    }
    tally.report("tiny origins");
}
