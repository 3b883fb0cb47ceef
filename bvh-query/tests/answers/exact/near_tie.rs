//! Two pairs of triangles that are almost equally near. The pair with the least distance in f64 is not the closest,
//! and the interval must contain the true distance of the meshes all the same.

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{baked, queriers, stored};
use bvh_query::Pose;

/// In f64 the segment of B is the nearest, 7.6e-17 from the edge of A and certainly beyond 5.2e-17. But the triangle
/// of B is 2.6e-32 away.
#[test]
fn an_edge_over_a_triangle_and_a_segment() {
    let a = [[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let triangle = [[-1.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 0.0]];
    let segment = [[-1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let turn = [
        [1.0, 1.0607114861118044e-13, 1.2715241987042194e-16],
        [-1.0607114861118044e-13, 1.0, 1.1556478117499873e-15],
        [-1.2715241987029937e-16, -1.1556478117500007e-15, 1.0],
    ];
    let translation = [1.1299171079459656, 1.5419387627434098, -6.428096199248133e-16];
    let pose = Pose::new(turn, translation).unwrap();
    let [a, b] = [&[a][..], &[triangle, segment][..]].map(baked);
    let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
    let truth = Truth::new(&surfaces[0], &surfaces[1], &pose);
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    let mut asked = Asked { a: &a, b: &b, queriers: &mut queriers };
    if let Err(error) = asked.all(&truth, &pose, &mut tally) {
        tally.wrong(error);
    }
    tally.report("a near tie");
}
