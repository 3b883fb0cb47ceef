//! The regions of contacts: their points lie on both triangles, and curves of closed meshes are closed.

use super::{block, dot, querier};
use crate::common::shapes::{dirty, on_lattice, outward, soup, sphere, torus};
use crate::common::{Random, Triangle, baked, placed, queriers, random_pose, stored, translation};
use bvh_query::{Bvh, Contact, ContactRegion, Pose, RegionKind};
use cbvh_testkit::exact::Length;
use std::collections::HashMap;

fn corners(bvh: &Bvh) -> HashMap<(u32, u32), Triangle> {
    stored(bvh).into_iter().map(|stored| ((stored.object, stored.id), stored.corners)).collect()
}

fn normal([p, q, r]: &Triangle) -> [f64; 3] {
    let [d, e] = [q, r].map(|x| [0, 1, 2].map(|k| x[k] - p[k]));
    let n = [d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]];
    let length = dot(n, n).sqrt();
    n.map(|x| x / length)
}

/// Checks each region against both triangles, in exact arithmetic. Returns the number of points that were not exact.
fn check(a: &Bvh, b: &Bvh, pose: &Pose) -> usize {
    let contacts = querier().contacts(a, b, pose).unwrap();
    let answer = querier().contact_regions(a, b, pose, usize::MAX).unwrap();
    assert_eq!(answer.regions.iter().map(|region| region.contact).collect::<Vec<_>>(), contacts);
    assert_eq!((answer.total, answer.is_truncated()), (contacts.len() as u64, false));
    for mut querier in queriers() {
        assert_eq!(querier.contact_regions(a, b, pose, usize::MAX).unwrap(), answer, "{}", querier.backend());
        let some = querier.contact_regions(a, b, pose, contacts.len() / 2).unwrap();
        assert_eq!(some.regions, answer.regions[..contacts.len() / 2]);
        assert_eq!(some.total, answer.total);
    }
    let (of_a, of_b) = (corners(a), corners(b));
    let mut rounded = 0;
    for region in &answer.regions {
        let Contact { object_a, triangle_a, object_b, triangle_b } = region.contact;
        let (t, u) = (of_a[&(object_a, triangle_a)], placed(&[of_b[&(object_b, triangle_b)]], pose)[0]);
        assert!((1..=6).contains(&region.points().len()));
        for point in region.points() {
            for triangle in [&t, &u] {
                let off = Length::between(&[*point; 3], triangle);
                assert!(off.compare(region.error).is_le(), "{region:?} {t:?} {u:?}");
            }
        }
        assert!(region.error < 1e-9, "{region:?}");
        rounded += usize::from(region.error > 0.0);
        for (found, triangle) in [(region.normal_a, &t), (region.normal_b, &u)] {
            // Slivers and triangles without area are for the tests of the narrow phase.
            let expected = normal(triangle);
            let facing = dot(found, expected);
            assert!(facing.is_nan() || found == [0.0; 3] || facing > 0.9, "{region:?} {triangle:?}");
        }
    }
    rounded
}

#[test]
fn points_lie_on_both_triangles() {
    let meshes = [sphere(2), torus(12, 8), dirty(&soup(60, 3), 4), block([-0.5; 3], [0.75, 0.5, 0.25])];
    let mut random = Random::new(21);
    let mut rounded = 0;
    for (i, a) in meshes.iter().enumerate() {
        for b in &meshes[i..] {
            let (a, b) = (baked(a), baked(b));
            for pose in [Pose::IDENTITY, random_pose(&mut random, 0.5), translation(0.5, 0.25, 0.0)] {
                rounded += check(&a, &b, &pose);
            }
        }
    }
    assert!(rounded > 1000, "{rounded}");
}

/// Returns the segments, from end to end.
fn directed(regions: &[ContactRegion]) -> Vec<[[u64; 3]; 2]> {
    let bits = |p: &[f64; 3]| p.map(f64::to_bits);
    let segments = regions.iter().filter(|region| region.kind == RegionKind::Segment);
    segments.map(|region| [bits(&region.points()[0]), bits(&region.points()[1])]).collect()
}

/// Two closed meshes in general position: where a segment ends, another one starts, in the same bits.
#[test]
fn curves_of_closed_meshes_are_directed_loops_to_the_last_bit() {
    let mut random = Random::new(22);
    let closed = |triangles| on_lattice(outward(triangles));
    let shapes = [closed(sphere(3)), closed(sphere(2)), block([-0.8; 3], [0.7, 0.9, 0.6])];
    let mut segments = 0;
    for a in &shapes {
        for b in &shapes {
            let (a, b) = (baked(a), baked(b));
            for _ in 0..4 {
                let pose = random_pose(&mut random, 0.6);
                let regions = querier().contact_regions(&a, &b, &pose, usize::MAX).unwrap().regions;
                let mut balance: HashMap<[u64; 3], i32> = HashMap::new();
                for [from, to] in directed(&regions) {
                    *balance.entry(from).or_default() += 1;
                    *balance.entry(to).or_default() -= 1;
                    segments += 1;
                }
                assert!(balance.values().all(|&balance| balance == 0), "{pose:?} {balance:?}");
            }
        }
    }
    assert!(segments > 2000, "{segments}");
}

/// With B in A's frame, the triangles have the same points whichever is A, and opposite directions.
#[test]
fn exchanging_the_meshes_gives_the_same_points() {
    let mut meshes = [dirty(&soup(150, 8), 9), dirty(&soup(150, 8), 10)];
    meshes[1].extend(torus(16, 10));
    let (a, b) = (baked(&meshes[0]), baked(&meshes[1]));
    let one = querier().contact_regions(&a, &b, &Pose::IDENTITY, usize::MAX).unwrap().regions;
    let other = querier().contact_regions(&b, &a, &Pose::IDENTITY, usize::MAX).unwrap().regions;
    let other: HashMap<_, _> = other
        .iter()
        .map(|region| ((region.contact.triangle_b, region.contact.triangle_a), *region))
        .collect();
    assert!(one.len() > 400, "{}", one.len());
    for region in &one {
        let swapped = &other[&(region.contact.triangle_a, region.contact.triangle_b)];
        assert_eq!((swapped.kind, swapped.error, swapped.count), (region.kind, region.error, region.count));
        assert_eq!((swapped.normal_b, swapped.normal_a), (region.normal_a, region.normal_b));
        let sorted = |region: &ContactRegion| {
            let mut points = region.points().to_vec();
            points.sort_by(|p, q| p.partial_cmp(q).unwrap());
            points
        };
        assert_eq!(sorted(swapped), sorted(region));
    }
}

/// The point of two rounded triangles is at most the radius, and the error, from either core.
#[test]
fn points_of_rounded_triangles_are_within_both() {
    let mut random = Random::new(23);
    let (a, b) = (baked(&torus(10, 6)), baked(&dirty(&block([-0.6; 3], [0.7, 0.8, 0.5]), 14)));
    let (of_a, of_b) = (corners(&a), corners(&b));
    let (mut apart, mut crossing) = (0, 0);
    for radii in [[0.2, 0.1], [0.0, 0.15], [0.25, 0.0]] {
        let pose = random_pose(&mut random, 0.5);
        let shapes = [a.all().rounded(radii[0]).unwrap(), b.all().rounded(radii[1]).unwrap()];
        let answer = querier().contact_regions(shapes[0], shapes[1], &pose, usize::MAX).unwrap();
        for region in &answer.regions {
            let Contact { object_a, triangle_a, object_b, triangle_b } = region.contact;
            let (t, u) = (of_a[&(object_a, triangle_a)], placed(&[of_b[&(object_b, triangle_b)]], &pose)[0]);
            let cores = Length::between(&t, &u);
            assert!(cores.is(radii[0] + radii[1] - region.overlap, 1e-12), "{region:?}");
            if cores.compare(0.0).is_eq() {
                crossing += 1;
                continue;
            }
            apart += 1;
            assert_eq!((region.kind, region.points().len()), (RegionKind::Point, 1));
            assert!(region.error < 1e-13, "{region:?}");
            for (core, radius) in [(&t, radii[0]), (&u, radii[1])] {
                let off = Length::between(&[region.points()[0]; 3], core);
                assert!(off.compare(radius + region.error).is_le(), "{region:?} {core:?} {radius}");
            }
        }
    }
    assert!(apart > 200 && crossing > 20, "{apart} {crossing}");
}
