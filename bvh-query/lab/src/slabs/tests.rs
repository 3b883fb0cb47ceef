//! Checks that slabs contain their triangles, and that they only ever save tests.

use super::direction::DirectionCode;
use super::patch::Patch;
use super::separation::{Factors, Side, SlabRule};
use super::slab::{Making, Owners, Wish};
use super::vector::{Vector, dot};
use super::walk::{Rule, Slabbed, walk};
use crate::input;
use crate::tree::Tree;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, Profile, TriangleEncoding};
use bvh_format::kdop::DirectionSet;
use bvh_query::{Bvh, Querier};
use cbvh_measure::poses::{self, Random};
use cbvh_testkit::ball::ball;

fn baked() -> Bvh {
    let (positions, triangles) = ball(3000);
    let options = Options::default().profile(Profile::Dop26U8Wide).triangles(TriangleEncoding::F32);
    input::bake(&Mesh::from_triangles(positions, triangles), &options).unwrap()
}

fn makings() -> impl Iterator<Item = Making> {
    let codes = [DirectionCode::Exact, DirectionCode::Octahedral(8), DirectionCode::Octahedral(4)];
    let each = codes.into_iter().flat_map(|code| [4, 8].map(|end_bits| (code, end_bits)));
    each.flat_map(|(code, end_bits)| {
        [Wish::Normal, Wish::Axis, Wish::Narrower].map(|wish| Making {
            wish,
            one_per_treelet: end_bits == 4,
            code,
            end_bits,
            ..Making::USUAL
        })
    })
}

/// The triangles below a node, found by going down to the leaves.
fn triangles_below(tree: &Tree, number: u32) -> Vec<[[f32; 3]; 3]> {
    let node = &tree.nodes[number as usize];
    if node.triangles > 0 {
        return tree.corners_below(node).to_vec();
    }
    node.children.iter().flat_map(|&child| triangles_below(tree, child)).collect()
}

#[test]
fn slabs_contain_all_triangles_below_and_bound_them_along_all_directions() {
    let tree = Tree::of_file(&baked()).unwrap();
    let patches = Patch::of_tree(&tree);
    let mut random = Random::default();
    for making in makings() {
        let slabs = making.slabs(&tree, &patches);
        assert!(slabs[0].is_none() && slabs[1..].iter().all(Option::is_some));
        for (number, slab) in slabs.iter().enumerate().skip(1) {
            let Some(slab) = slab else { continue };
            let (node, below) = (&tree.nodes[number], triangles_below(&tree, number as u32));
            assert_eq!(below.len(), node.below as usize);
            let corners: Vec<Vector> = below.iter().flatten().map(|corner| corner.map(f64::from)).collect();
            assert!((0.0..=1.0).contains(&slab.share), "{slab:?}");
            for &corner in &corners {
                let along = dot(slab.n, corner);
                assert!(slab.ends[0] <= along && along <= slab.ends[1], "{making:?}: {slab:?} {along}");
            }
            let (x, side) = (random.direction(), Side { node, slab: Some(slab) });
            let most = corners.iter().map(|&corner| dot(x, corner)).fold(f64::NEG_INFINITY, f64::max);
            for factors in [Factors::None, Factors::Projection, Factors::Whole, Factors::Both] {
                let upper = side.upper(x, false, factors);
                assert!(upper >= most - 1e-12 * most.abs(), "{factors:?}: {upper} {most}");
            }
        }
    }
}

#[test]
fn only_owners_within_the_limit_have_slabs() {
    let tree = Tree::of_file(&baked()).unwrap();
    let patches = Patch::of_tree(&tree);
    let narrow = Making { max_share: 0.5, ..Making::USUAL }.slabs(&tree, &patches);
    assert!(narrow.iter().flatten().all(|slab| slab.share <= 0.5) && narrow.iter().flatten().count() > 0);
    for owners in [Owners::All, Owners::Leaves, Owners::Treelets] {
        let slabs = Making { owners, max_triangles: 64, ..Making::USUAL }.slabs(&tree, &patches);
        for (node, slab) in tree.nodes.iter().zip(&slabs) {
            let leaf = node.triangles > 0;
            let expected = node.below <= 64
                && match owners {
                    Owners::All => true,
                    Owners::Leaves => leaf,
                    Owners::Treelets => !leaf,
                };
            assert_eq!(slab.is_some(), expected, "{owners:?}");
        }
    }
}

#[test]
fn slabs_save_tests_and_cost_none() {
    let bvh = baked();
    let tree = Tree::of_file(&bvh).unwrap();
    let patches = Patch::of_tree(&tree);
    let mut querier = Querier::new().unwrap();
    for gap in [1e-6, 0.05] {
        for pose in poses::apart(&mut querier, &bvh, &bvh, gap, 4).unwrap() {
            let distance = querier.distance(&bvh, &bvh, &pose).unwrap().distance;
            for limit in [0.0, distance] {
                for (set, two_frames) in [(DirectionSet::Dop26, true), (DirectionSet::Dop6, false)] {
                    let count = |slab, making: Making| {
                        let slabs = making.slabs(&tree, &patches);
                        let side = Slabbed { tree: &tree, slabs: &slabs };
                        walk(side, side, &pose, limit, Rule { set, two_frames, slab })
                    };
                    let plain = count(None, Making::USUAL);
                    let all = count(Some(SlabRule::USUAL), Making::USUAL);
                    let few = count(Some(SlabRule { directions: 3, ..SlabRule::USUAL }), Making::USUAL);
                    let coarse = count(
                        Some(SlabRule { factors: Factors::None, ..SlabRule::USUAL }),
                        Making { end_bits: 4, max_triangles: 256, ..Making::USUAL },
                    );
                    assert!(all.slab_pairs > 0 || limit == 0.0, "{all:?}");
                    assert_eq!(plain.slab_pairs, 0);
                    for (more, fewer) in [(plain, few), (plain, coarse), (few, all)] {
                        assert!(fewer.node_tests <= more.node_tests, "{fewer:?} {more:?}");
                        assert!(fewer.packet_tests <= more.packet_tests, "{fewer:?} {more:?}");
                    }
                    // The pair of the nearest triangles is never stopped.
                    assert!(limit == 0.0 || all.packet_tests > 0, "{all:?}");
                }
            }
        }
    }
}
