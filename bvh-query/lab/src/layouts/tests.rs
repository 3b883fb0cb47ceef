//! Checks that walks do the same work as queries that visit everything.

use super::walk::walk;
use crate::tree::Tree;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier};

/// Makes a bumpy slope of 2 n^2 triangles. If it is laid over itself, boxes overlap where triangles are apart.
fn sheet(n: u32) -> Mesh {
    let at = |i: u32| f64::from(i) / f64::from(n);
    let height = |x: f64, y: f64| x * x + 0.02 * (7.0 * x).sin() * (5.0 * y).cos();
    let positions =
        (0..=n).flat_map(|i| (0..=n).map(move |j| [at(i), at(j), height(at(i), at(j))])).collect();
    let corner = |i: u32, j: u32| i * (n + 1) + j;
    let quad = |i: u32, j: u32| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
        [[a, b, d], [a, d, c]]
    };
    let triangles = (0..n).flat_map(|i| (0..n).flat_map(move |j| quad(i, j))).collect();
    Mesh::from_triangles(positions, triangles)
}

fn baked(profile: Profile) -> Bvh {
    let options = Options::default().profile(profile).triangles(TriangleEncoding::F32);
    let (bytes, _) = to_bytes(&sheet(40), &options).unwrap();
    Bvh::from_bytes(bytes).unwrap()
}

fn above(z: f64) -> Pose {
    let (sin, cos) = 0.01f64.sin_cos();
    Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, z]).unwrap()
}

#[test]
fn counts_are_those_of_queries_that_visit_everything() {
    for profile in Profile::ALL {
        let bvh = baked(profile);
        let tree = Tree::of_file(&bvh).unwrap();
        let triangles: u32 = tree.nodes.iter().map(|node| node.triangles).sum();
        assert_eq!(triangles, 3200, "{}", profile.name());
        // The meshes are apart, so that nothing ends the query early. Queries round outward, and their first 16 tests
        // use only A's directions: those may let through 256 more pairs. Turning slabs, which the model leaves out, keep
        // some pairs apart.
        let counts = walk(&tree, &tree, &above(0.1), 0.0).unwrap();
        let mut querier = Querier::new().unwrap();
        assert!(!querier.collide(&bvh, &bvh, &above(0.1)).unwrap());
        let asked = querier.stats();
        assert!(counts.node_tests > 10, "{counts:?}");
        for (found, modelled) in
            [(asked.node_tests, counts.node_tests), (asked.packet_tests, counts.packet_tests)]
        {
            let least = if profile.has_turning_slabs() { 0 } else { modelled };
            assert!(least <= found && found <= modelled + modelled / 50 + 256, "{found} {modelled}");
        }
    }
}
