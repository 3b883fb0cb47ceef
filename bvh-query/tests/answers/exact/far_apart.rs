//! Tiny meshes that are farther apart than f32 can tell in units of their size.
//!
//! The tracker starts from the pair that was closest before, and looks along the line between its points. Another object
//! lies nearer, across that line and 2^128 times its size away. B is large as a whole, so that its steps count as small.

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Triangle, bake, mesh, options, queriers, stored, translation};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::Tracker;

/// A triangle with its first corner at a point, from which it extends along all axes.
fn triangle(at: [f64; 3], size: [f64; 3]) -> Triangle {
    let [x, y, z] = at;
    [at, [x + size[0], y + size[1], z], [x + size[0], y, z + size[2]]]
}

#[test]
fn tiny_meshes_beyond_the_range_of_f32() {
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    let mut round = 0;
    for size_exponent in [-20, -30, -60, -118] {
        for far_exponent in [60, 98, 99, 100, 112] {
            // Along which the seed's line runs, and across it.
            for [along, across] in [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]] {
                let (size, far) = (2f64.powi(size_exponent), 2f64.powi(far_exponent));
                // The seed's line runs along an axis, or along a diagonal away from it.
                let slope = [0.0, -1.0][round % 2];
                let profile = Profile::ALL[round % Profile::ALL.len()];
                let options = options(profile, TriangleEncoding::F32).split_objects(true);
                round += 1;
                let mut to_b = [0.0; 3];
                to_b[across] = far;
                // The other object ends at a corner that is twice as far from B.
                let mut corner = to_b;
                corner[along] -= 2.0 * far;
                corner[across] -= slope * 2.0 * far;
                let wide = triangle(corner, [-far / 8.0; 3].map(|x| x / (1.0 + slope.abs())));
                let mut both = mesh(&[triangle([0.0; 3], [-size; 3])]);
                let mut other = mesh(&[wide]).objects.remove(0);
                other.triangle_ids = vec![1];
                both.objects.push(other);
                let mut ballast = [0.0; 3];
                ballast[along] = 64.0 * far;
                let mut moving = mesh(&[triangle([0.0; 3], [size; 3])]);
                let mut other = mesh(&[triangle(ballast, [64.0 * far; 3])]).objects.remove(0);
                other.triangle_ids = vec![1];
                moving.objects.push(other);
                let (a, b) = (bake(&both, &options), bake(&moving, &options));
                let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
                let near_other = [0, 1, 2].map(|k| corner[k] + (to_b[k] - corner[k]) / 1024.0);
                let poses = [near_other, to_b].map(|[x, y, z]| translation(x, y, z));
                let what = format!("size 2^{size_exponent}, 2^{far_exponent} across {across} from {along}");
                for pose in &poses {
                    let truth = Truth::new(&surfaces[0], &surfaces[1], pose);
                    let mut asked = Asked { a: &a, b: &b, queriers: &mut queriers };
                    if let Err(error) = asked.all(&truth, pose, &mut tally) {
                        tally.wrong(format!("{what}: {error}"));
                    }
                }
                for querier in &mut queriers {
                    let mut tracker = Tracker::new();
                    for pose in &poses {
                        let alone = querier.distance(&a, &b, pose).unwrap();
                        let tracked = tracker.distance(querier, &a, &b, pose).unwrap();
                        if alone != tracked {
                            tally.wrong(format!("{what}: {tracked:?}, alone {alone:?}"));
                        }
                    }
                }
            }
        }
    }
    tally.report("tiny meshes far apart");
}
