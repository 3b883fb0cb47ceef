//! The model against files: the same bounds, and the same work as queries that visit all there is.

use super::*;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::{Encoding, Profile};
use bvh_query::{Bvh, Pose, Querier};

/// A bumpy slope of 2 n^2 triangles: laid over itself, boxes overlap where triangles are apart.
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

fn baked(profile: Profile) -> (Bvh, f64) {
    let options =
        Options { profile: Some(profile), triangles: Some(TriangleEncoding::F32), ..Options::default() };
    let (bytes, report) = to_bytes(&sheet(40), &options).unwrap();
    (Bvh::from_bytes(bytes).unwrap(), report.width_inflation)
}

fn above(z: f64) -> Pose {
    let (sin, cos) = 0.01f64.sin_cos();
    Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, z]).unwrap()
}

#[test]
fn bounds_are_those_of_the_file_and_counts_those_of_queries() {
    for profile in Profile::ALL {
        let (bvh, inflation) = baked(profile);
        let tree = Tree::of_file(&bvh).unwrap();
        assert_eq!(tree.leaves().1, 3200, "{}", profile.name());
        assert!((tree.inflation().mean_width() - inflation).abs() < 1e-9, "{}", profile.name());
        // Apart, so that nothing ends the query early. Queries round outward, and their first 16 tests look along
        // A's directions alone: those may let through 256 pairs more.
        let counts = walk(&tree, &tree, &above(0.1), 0.0).unwrap();
        let mut querier = Querier::new().unwrap();
        assert!(!querier.collide(&bvh, &bvh, &above(0.1)).unwrap());
        let asked = querier.stats();
        assert!(counts.node_tests > 10, "{counts:?}");
        for (found, modelled) in
            [(asked.node_tests, counts.node_tests), (asked.packet_tests, counts.packet_tests)]
        {
            assert!(modelled <= found && found <= modelled + modelled / 50 + 256, "{found} {modelled}");
        }
    }
}

#[test]
fn other_shapes_hold_the_same_triangles_and_predictors_contain_them() {
    let binary = Tree::of_file(&baked(Profile::Dop14F16).0).unwrap();
    let mut widths = Vec::new();
    for (branching, leaf) in [(2, 4), (4, 4), (8, 4), (4, 8), (4, 16)] {
        let mut tree = Cut { branching, leaf }.of(&binary);
        assert_eq!(tree.leaves().1, 3200);
        assert!(tree.nodes.iter().all(|node| node.children.len() <= branching && node.triangles <= leaf));
        for predictor in Predictor::ALL {
            predictor.apply(Encoding::U8, &mut tree);
            assert!(tree.nodes.iter().all(|node| node.bound.contains(&node.tight, 7)), "{predictor:?}");
            widths.push(tree.inflation().mean_width());
        }
    }
    // The tight parent is the least, the root the most.
    for [chain, tight, root] in widths.as_chunks::<3>().0 {
        assert!(1.0 <= *tight && tight <= chain && chain < root, "{widths:?}");
    }
}

#[test]
fn a_binary_tree_cut_in_twos_is_itself() {
    let binary = Tree::of_file(&baked(Profile::Dop14F16).0).unwrap();
    let same = Cut { branching: 2, leaf: 4 }.of(&binary);
    assert_eq!((same.treelets(), same.leaves()), (binary.treelets(), binary.leaves()));
}
