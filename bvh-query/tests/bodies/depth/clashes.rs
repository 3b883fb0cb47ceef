//! The classes of pairs of parts, and those of a scene.

use crate::common::shapes::{cube, moved, outward, plate};
use crate::common::{Random, bake, baked, queriers, rotation, translation};
use bvh_query::{Bvh, Clash, ClashClass, ClashOptions, OwnedShape, Pose, Querier, Relation, Scene};

fn ask(querier: &mut Querier, a: &Bvh, b: &Bvh, pose: &Pose, options: &ClashOptions) -> Clash {
    querier.clash(a, b, pose, options).unwrap()
}

#[test]
fn pairs_have_the_class_that_their_gap_and_depth_say() {
    let (a, small) = (baked(&outward(cube())), baked(&moved(&outward(cube()), 0.25, [0.0; 3])));
    let (same, open) = (baked(&outward(cube())), baked(&plate(2)));
    let options = ClashOptions::new().clearance(0.25).tolerance(1e-3);
    let at = |x: f64| translation(x, 0.25, 0.125);
    let cases = [
        (&a, &a, at(2.5), ClashClass::Apart),
        (&a, &a, at(2.125), ClashClass::Near),
        (&a, &a, at(2.25), ClashClass::Near),
        (&a, &a, at(2.0), ClashClass::Touching),
        (&a, &a, at(2.0 - 1e-4), ClashClass::Touching),
        (&a, &a, at(1.99), ClashClass::Overlapping),
        (&a, &small, at(0.25), ClashClass::Contained),
        (&small, &a, at(0.25), ClashClass::Contained),
        (&a, &a, Pose::IDENTITY, ClashClass::Duplicated),
        (&a, &same, translation(1e-4, 0.0, -1e-4), ClashClass::Duplicated),
        (&a, &same, translation(1e-2, 0.0, 0.0), ClashClass::Overlapping),
        (&a, &open, at(0.5), ClashClass::Intersecting),
        (&open, &small, translation(0.0, 0.0, 4.0), ClashClass::Apart),
    ];
    for mut querier in queriers() {
        for (number, (a, b, pose, class)) in cases.iter().enumerate() {
            let found = ask(&mut querier, a, b, pose, &options);
            assert_eq!(found.class, *class, "case {number}: {found:?}");
            assert_eq!(
                found.depth.is_some(),
                matches!(class, ClashClass::Touching | ClashClass::Overlapping)
            );
            match class {
                ClashClass::Apart => assert_eq!(found.distance, f64::INFINITY),
                ClashClass::Near => assert!((found.distance - (pose.translation()[0] - 2.0)).abs() < 1e-12),
                _ => assert_eq!(found.distance, 0.0),
            }
        }
        for (options, what) in [
            (ClashOptions::new().clearance(-1.0), "clearance: expected"),
            (ClashOptions::new().tolerance(f64::NAN), "tolerance: expected"),
            (ClashOptions::new().relative_gap(0.0), "relative_gap: expected"),
        ] {
            let refused = querier.clash(&a, &a, &Pose::IDENTITY, &options).unwrap_err();
            assert!(refused.to_string().starts_with(what), "{refused}");
        }
    }
}

/// A scene gives the box of what is shared in the world, wherever its parts are.
#[test]
fn overlapping_parts_pierce_or_protrude() {
    let block = |half: [f64; 3]| {
        baked(
            &outward(cube()).iter().map(|t| t.map(|p| [0, 1, 2].map(|k| p[k] * half[k]))).collect::<Vec<_>>(),
        )
    };
    let (wall, duct, open) = (block([4.0, 0.125, 4.0]), block([0.5, 3.0, 0.25]), baked(&plate(2)));
    let options = ClashOptions::new().magnitudes(true);
    for mut querier in queriers() {
        for (at, class, volume, pierced) in [
            ([0.0, 1.0, 0.0], ClashClass::Piercing, 0.125, Some(0.25)),
            ([0.0, 3.0, 0.0], ClashClass::Protruding, 0.0625, None),
            ([0.0, 3.0625, 0.0], ClashClass::Protruding, 0.03125, None),
        ] {
            let pose = translation(at[0], at[1], at[2]);
            let found = ask(&mut querier, &wall, &duct, &pose, &options);
            let shared = found.magnitudes.unwrap();
            assert!(
                found.class == class && (shared.volume - volume).abs() <= shared.volume_error,
                "{found:?}"
            );
            assert_eq!((shared.pierced_a, shared.pierced_b), (pierced, None));
            let without = ask(&mut querier, &wall, &duct, &pose, &ClashOptions::new());
            assert_eq!((without.class, without.magnitudes), (ClashClass::Overlapping, None));
        }
        for (a, b, at, class, has) in [
            (&wall, &wall, [0.0; 3], ClashClass::Duplicated, true),
            (&wall, &open, [0.0; 3], ClashClass::Intersecting, false),
            (&wall, &duct, [0.0, 3.125, 0.0], ClashClass::Touching, false),
        ] {
            let found = ask(&mut querier, a, b, &translation(at[0], at[1], at[2]), &options);
            assert_eq!((found.class, found.magnitudes.is_some()), (class, has), "{found:?}");
        }
    }
    // Cores share nothing where radii overlap.
    let round = wall.all().rounded(0.5).unwrap();
    let found = Querier::new().unwrap().clash(round, round, &translation(0.0, 1.0, 0.125), &options).unwrap();
    assert_eq!((found.class, found.magnitudes), (ClashClass::Overlapping, None));
    let turned = Pose::new([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [10.0, 20.0, 30.0]).unwrap();
    let beside = Pose::new(*turned.rotation(), turned.place([0.0, 1.0, 0.0])).unwrap();
    let mut scene = Scene::new().unwrap();
    for (bvh, pose) in [(wall, turned), (duct, beside)] {
        scene.add(bvh, pose).unwrap();
    }
    let found = scene.clashes(&options).unwrap();
    let shared = found[0].clash.magnitudes.unwrap();
    assert_eq!((found.len(), shared.bounds), (1, Some([[9.875, 19.5, 29.75], [10.125, 20.5, 30.25]])));
}

/// A peg in a hole without a gap touches on all sides: no way out is short, and nothing is deep.
#[test]
fn a_tight_fit_is_undecided_with_its_bounds() {
    let cells: Vec<[i32; 3]> = (0..9).filter(|&n| n != 4).map(|n| [n % 3, n / 3, 0]).collect();
    let ring = bvh_bake::shapes::voxels(&cells, 1.0).unwrap();
    let peg = bvh_bake::shapes::voxels(&[[1, 1, 0]], 1.0).unwrap();
    let [ring, peg] = [ring, peg].map(|mesh| bake(&mesh, &bvh_bake::Options::default()));
    let found = ask(&mut queriers()[0], &ring, &peg, &Pose::IDENTITY, &ClashOptions::new().tolerance(1e-3));
    let depth = found.depth.unwrap();
    assert_eq!(found.class, ClashClass::Undecided, "{found:?}");
    assert!(depth.lower == 0.0 && (1.0..1.01).contains(&depth.upper), "{found:?}");
}

#[test]
fn a_scene_lists_what_its_pairs_say_with_any_number_of_threads() {
    let a = OwnedShape::from(baked(&outward(cube())));
    let mut scene = Scene::new().unwrap();
    for (x, y, z) in [(0.0, 0.0, 0.0), (1.5, 0.25, 0.0), (3.5, 0.125, 0.5), (6.0, 0.0, 0.0), (6.0, 0.0, 0.0)]
    {
        scene.add(a.clone(), translation(x, y, z)).unwrap();
    }
    let options = ClashOptions::new().clearance(0.75).tolerance(1e-6);
    let found = scene.clashes(&options).unwrap();
    let classes: Vec<_> = found.iter().map(|clash| clash.clash.class).collect();
    use ClashClass::{Duplicated, Near, Overlapping, Touching};
    assert_eq!(classes, [Overlapping, Touching, Near, Near, Duplicated]);
    #[cfg(feature = "parallel")]
    {
        scene.set_parallel(true);
        assert_eq!(scene.clashes(&options).unwrap(), found);
    }
    assert!(scene.clashes(&ClashOptions::new().clearance(f64::NAN)).is_err());
}

/// Returns how B placed by a pose lies to A, and how A lies to B, which has to be the same.
#[track_caller]
fn both_ways(querier: &mut Querier, a: &Bvh, b: &Bvh, by: [f64; 3], options: &ClashOptions) -> Clash {
    let [there, back] = [by, by.map(|x| -x)].map(|[x, y, z]| translation(x, y, z));
    let (found, reversed) = (ask(querier, a, b, &there, options), ask(querier, b, a, &back, options));
    assert_eq!((found.class, found.distance), (reversed.class, reversed.distance), "{found:?} {reversed:?}");
    assert_eq!(found.depth.map(|depth| depth.lower > 0.0), reversed.depth.map(|depth| depth.lower > 0.0));
    found
}

/// Two cubes with a gap between faces, edges or corners that is a number, and the tolerance below, at and above it.
#[test]
fn parts_within_the_tolerance_touch_and_others_do_not() {
    use ClashClass::{Apart, Near, Touching};
    let a = baked(&outward(cube()));
    let ulp = 2f64.powi(-51);
    // Each gap is exact: 3, 4, 5 and 2, 3, 6, 7 are Pythagorean.
    let gaps = [
        ([ulp, 0.0, 0.0], ulp),
        ([0.0, -1024.0 * ulp, 0.5], 1024.0 * ulp),
        ([0.0, 0.25, 0.125], 0.125),
        ([3.0 * ulp, 4.0 * ulp, 0.0], 5.0 * ulp),
        ([-3.0 / 4096.0, 0.0, 4.0 / 4096.0], 5.0 / 4096.0),
        ([2.0 / 1024.0, -3.0 / 1024.0, 6.0 / 1024.0], 7.0 / 1024.0),
    ];
    for mut querier in queriers() {
        for (number, (by, gap)) in gaps.iter().enumerate() {
            // A coordinate without a gap is one by which the cubes overlap.
            let apart = |x: f64| x.abs() < 0.01 || x.abs() == *gap;
            let by = by.map(|x: f64| if x != 0.0 && apart(x) { x + 2.0_f64.copysign(x) } else { x });
            let mut class = |tolerance: f64, clearance: f64| {
                let options = ClashOptions::new().tolerance(tolerance).clearance(clearance);
                let found = both_ways(&mut querier, &a, &a, by, &options);
                assert_eq!(found.relation, Relation::Apart, "case {number}: {found:?}");
                match found.class {
                    Apart => assert_eq!((found.distance, found.depth), (f64::INFINITY, None)),
                    _ => assert!((found.distance / gap - 1.0).abs() < 1e-9, "case {number}: {found:?}"),
                }
                let depth = found.depth.map(|depth| (depth.lower, depth.upper));
                assert_eq!(depth, (found.class == Touching).then_some((0.0, 0.0)));
                found.class
            };
            let (below, above) = (gap.next_down(), gap.next_up());
            let with = |clearance: f64| [below, *gap, above].map(|tolerance| (tolerance, clearance));
            let classes = with(0.0).map(|(tolerance, clearance)| class(tolerance, clearance));
            assert_eq!(classes, [Apart, Touching, Touching], "case {number}");
            let classes = with(1.0).map(|(tolerance, clearance)| class(tolerance, clearance));
            assert_eq!(classes, [Near, Touching, Touching], "case {number}");
            // The clearance is exact in the same way, and does not matter where the tolerance is larger.
            assert_eq!([class(0.0, below), class(0.0, *gap), class(0.0, 0.0)], [Apart, Near, Apart]);
            assert_eq!([class(above, below), class(above, *gap)], [Touching, Touching], "case {number}");
        }
    }
}

/// A box by its lower corner and its sides, in units of a grid.
type GridBox = [[i64; 3]; 2];

/// The unit of the grid, in mesh units.
const GRID: f64 = 1.0 / 1024.0;

fn of_grid([lo, sides]: &GridBox) -> Bvh {
    let corner = |x: f64, k: usize| (lo[k] as f64 + if x > 0.0 { sides[k] as f64 } else { 0.0 }) * GRID;
    baked(&outward(cube()).iter().map(|t| t.map(|p| [0, 1, 2].map(|k| corner(p[k], k)))).collect::<Vec<_>>())
}

/// Returns the square of the gap of two boxes, or minus the depth by which they overlap; `None` if one may be inside the other.
fn gap_or_depth(a: &GridBox, b: &GridBox) -> Option<i64> {
    let gaps = [0, 1, 2].map(|k| (b[0][k] - a[0][k] - a[1][k]).max(a[0][k] - b[0][k] - b[1][k]));
    let contains = |a: &GridBox, b: &GridBox| {
        (0..3).all(|k| a[0][k] <= b[0][k] && b[0][k] + b[1][k] <= a[0][k] + a[1][k])
    };
    if contains(a, b) || contains(b, a) {
        return None;
    }
    if gaps.iter().any(|gap| *gap > 0) {
        return Some(gaps.iter().map(|gap| gap.max(&0).pow(2)).sum());
    }
    gaps.into_iter().max()
}

/// Random boxes at small distances from each other and a little in each other: integers say how they lie.
#[test]
fn boxes_have_the_classes_that_integers_say() {
    let mut random = Random::new(26);
    let mut queriers = queriers();
    let mut counts = [0; 8];
    for _ in 0..900 {
        let mut grid_box = |at: i64| -> GridBox {
            [[(); 3].map(|()| at + random.below(60) as i64), [(); 3].map(|()| 100 + random.below(40) as i64)]
        };
        let (one, mut other) = (grid_box(0), grid_box(0));
        let (axis, tolerance) = (random.below(3), random.below(30) as i64);
        other[0][axis] = one[0][axis] + one[1][axis] + random.below(60) as i64 - 20;
        if random.below(2) == 0 {
            let axis = (axis + 1) % 3;
            other[0][axis] = one[0][axis] + one[1][axis] + random.below(60) as i64 - 20;
        }
        let Some(truth) = gap_or_depth(&one, &other) else { continue };
        let options = ClashOptions::new().tolerance(tolerance as f64 * GRID).clearance(25.0 * GRID);
        let (a, b) = (of_grid(&one), of_grid(&other));
        for querier in &mut queriers {
            let class = both_ways(querier, &a, &b, [0.0; 3], &options).class;
            counts[class as usize] += 1;
            let expected = match truth {
                ..0 if -truth > tolerance => ClashClass::Overlapping,
                ..=0 => ClashClass::Touching,
                _ if truth <= tolerance * tolerance => ClashClass::Touching,
                _ if truth <= 25 * 25 => ClashClass::Near,
                _ => ClashClass::Apart,
            };
            // The bounds of a depth near the tolerance may be on both sides of it.
            let is_close = truth <= 0 && 4 * (-truth - tolerance).abs() <= tolerance;
            let is_right = class == expected || is_close && class == ClashClass::Undecided;
            assert!(is_right, "{one:?} {other:?} {tolerance}: {class:?}, not {expected:?}");
        }
    }
    // All of the first four classes, on each backend.
    assert!(counts[..4].iter().all(|count| *count > 40 * queriers.len()), "{counts:?}");
}

/// What a scene says of boxes with margins is what integers say of their gaps, less the margins.
#[test]
fn a_scene_finds_parts_within_the_tolerance_beyond_their_margins() {
    let mut random = Random::new(27);
    let (mut touching, mut apart) = (0, 0);
    for _ in 0..80 {
        // Each box is in a cell of its own, with up to 40 units to the next one.
        let place = |number: usize| [number % 3, number / 3 % 3, number / 9].map(|cell| 120 * cell as i64);
        let boxes: Vec<GridBox> = (0..12)
            .map(|number| {
                let from = place(number).map(|x| x + random.below(20) as i64);
                [from, [(); 3].map(|()| 80 + random.below(20) as i64)]
            })
            .collect();
        let margins: Vec<i64> = (0..12).map(|_| random.below(4) as i64).collect();
        let tolerance = random.below(20) as i64;
        let mut scene = Scene::new().unwrap();
        let mut ids = Vec::new();
        for (grid_box, margin) in boxes.iter().zip(&margins) {
            let [x, y, z] = grid_box[0].map(|x| x as f64 * GRID);
            let at_origin = OwnedShape::from(of_grid(&[[0; 3], grid_box[1]]));
            let id = scene.add(at_origin, translation(x, y, z)).unwrap();
            scene.set_margin(id, *margin as f64 * GRID).unwrap();
            ids.push(id);
        }
        let options = ClashOptions::new().tolerance(tolerance as f64 * GRID);
        let found = scene.clashes(&options).unwrap();
        for i in 0..12 {
            for j in i + 1..12 {
                let (gap, margin) = (gap_or_depth(&boxes[i], &boxes[j]).unwrap(), margins[i] + margins[j]);
                // Where the margins meet, depths decide.
                if gap <= margin * margin {
                    continue;
                }
                let of = found.iter().find(|clash| (clash.pair.a, clash.pair.b) == (ids[i], ids[j]));
                let expected = gap <= (margin + tolerance).pow(2);
                assert_eq!(of.is_some(), expected, "{gap} {margin} {tolerance}: {of:?}");
                if let Some(of) = of {
                    assert_eq!((of.clash.class, of.clash.relation), (ClashClass::Touching, Relation::Apart));
                    let distance = (gap as f64).sqrt() * GRID - margin as f64 * GRID;
                    assert!((of.clash.distance - distance).abs() < 1e-12, "{of:?}");
                }
                (touching, apart) = (touching + u32::from(expected), apart + u32::from(!expected));
            }
        }
        assert!(scene.clashes(&ClashOptions::new().tolerance(0.0)).unwrap().len() <= found.len());
    }
    assert!(touching > 100 && apart > 100, "{touching} {apart}");
}

/// The default tolerance is that of the larger part of each pair, also where it exceeds the clearance and other parts are small.
#[test]
fn the_default_tolerance_of_a_pair_is_that_of_its_larger_part() {
    let small = OwnedShape::from(baked(&outward(cube())));
    let large = OwnedShape::from(baked(&moved(&outward(cube()), 1024.0, [0.0; 3])));
    let mut scene = Scene::new().unwrap();
    // 0.002 is within a millionth of 2048, but not of 2.
    let gap = 0.002;
    scene.add(large, Pose::IDENTITY).unwrap();
    scene.add(small.clone(), translation(1025.0 + gap, 0.0, 0.0)).unwrap();
    scene.add(small, translation(1027.0 + 2.0 * gap, 0.0, 0.0)).unwrap();
    let found = scene.clashes(&ClashOptions::new()).unwrap();
    let classes: Vec<_> = found.iter().map(|of| (of.pair.b.to_bits(), of.clash.class)).collect();
    assert_eq!(classes, [(1, ClashClass::Touching)]);
}

/// Flush parts that a rotation places overlap or come apart by roundings, and touch in both cases.
#[test]
fn flush_parts_under_a_rotation_touch_although_some_come_apart() {
    let part = OwnedShape::from(baked(&outward(cube())));
    let mut random = Random::new(28);
    let (mut gaps, mut overlaps) = (0, 0);
    for _ in 0..60 {
        let turn = rotation(random.quaternion());
        let from = random.point().map(|x| 10.0 * x);
        let [x, y, z] = [0, 1, 2].map(|k| from[k] + 2.0 * turn[k][0]);
        let mut scene = Scene::new().unwrap();
        scene.add(part.clone(), Pose::new(turn, from).unwrap()).unwrap();
        scene.add(part.clone(), Pose::new(turn, [x, y, z]).unwrap()).unwrap();
        let found = scene.clashes(&ClashOptions::new().tolerance(1e-12)).unwrap();
        assert_eq!(found.len(), 1);
        let clash = found[0].clash;
        assert_eq!(clash.class, ClashClass::Touching, "{clash:?}");
        match clash.relation {
            Relation::Apart => gaps += u32::from(clash.distance > 0.0),
            _ => overlaps += u32::from(clash.distance == 0.0),
        }
        let bare = scene.clashes(&ClashOptions::new().tolerance(0.0)).unwrap();
        assert_eq!(bare.is_empty(), clash.relation == Relation::Apart);
    }
    assert!(gaps > 5 && overlaps > 5 && gaps + overlaps == 60, "{gaps} {overlaps}");
}

/// Surfaces that are not closed have no depth, but a gap.
#[test]
fn open_parts_touch_across_a_gap_and_a_sheet_may_be_there_twice() {
    let (sheet, block) = (baked(&plate(2)), baked(&outward(cube())));
    let options = ClashOptions::new().tolerance(1e-3);
    for mut querier in queriers() {
        let above = both_ways(&mut querier, &block, &sheet, [0.25, 0.0, 1.0 + 1e-4], &options);
        assert_eq!((above.class, above.depth), (ClashClass::Touching, None));
        assert!((above.distance - 1e-4).abs() < 1e-12);
        let into = both_ways(&mut querier, &block, &sheet, [0.25, 0.0, 1.0], &options);
        assert_eq!(into.class, ClashClass::Intersecting);
        let twice = both_ways(&mut querier, &sheet, &sheet, [0.0, 0.0, 1e-4], &options);
        assert_eq!((twice.class, twice.distance), (ClashClass::Duplicated, 0.0));
        let two = both_ways(&mut querier, &sheet, &sheet, [0.5, 0.0, 1e-4], &options);
        assert_eq!(two.class, ClashClass::Touching);
    }
}
