//! What a bake promises: bounds that hold and are proved, the same bytes always, and how far vertices move.

use super::mesh;
use bvh_bake::input;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeReport, Effort, Options, prove_bounds, to_bytes, to_bytes_with};
use bvh_format::checksum::checksum;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::ObjectRecord;
use bvh_format::page::{PAGE, Page, TightBound};
use bvh_format::profile::{Encoding, Profile};
use bvh_format::validate::validate;
use bvh_format::{Layout, Rule};
use cbvh_testkit::ball::ball;
use cbvh_testkit::loosen::{Node, move_sphere, remote_roots, rewritten, widen};
use cbvh_testkit::{Random, Triangle};
use std::path::Path;

/// Small triangles anywhere, their coordinates `f32` numbers.
fn soup(count: usize, seed: u64) -> Vec<Triangle> {
    let mut random = Random::new(seed);
    let mut point = |scale: f64| [(); 3].map(|()| f64::from((random.signed() * scale) as f32));
    let mut triangle = || {
        let (centre, corners) = (point(1.0), [(); 3].map(|()| point(0.1)));
        corners.map(|corner| [0, 1, 2].map(|k| f64::from((centre[k] + corner[k]) as f32)))
    };
    (0..count).map(|_| triangle()).collect()
}

/// Returns the file's triangles with their ids, in ascending order.
fn stored(bytes: &[u8]) -> Vec<(u32, Triangle)> {
    let all = cbvh_testkit::stored::stored(bytes);
    let mut triangles: Vec<_> = all.iter().map(|stored| (stored.id, stored.corners)).collect();
    triangles.sort_by_key(|&(id, _)| id);
    triangles
}

fn options(profile: Profile, encoding: TriangleEncoding) -> Options {
    Options::default().profile(profile).triangles(encoding)
}

/// Bakes in every profile and encoding; `to_bytes` proves each. Returns the reports with their options.
fn bake_all(mesh: &Mesh) -> Vec<(Options, Vec<u8>, BakeReport)> {
    let all = Profile::ALL.into_iter().flat_map(|profile| TriangleEncoding::ALL.map(|e| options(profile, e)));
    all.map(|options| {
        let (bytes, report) = to_bytes(mesh, &options).unwrap_or_else(|e| panic!("{}: {e}", options.stamp()));
        let layout = validate(&bytes).unwrap();
        let inflation = prove_bounds(&layout, &bytes[..]).unwrap();
        assert_eq!(inflation.mean_width(), report.width_inflation);
        assert!(report.width_inflation >= 1.0 && report.volume_inflation >= 1.0, "{report:?}");
        assert_eq!(report.file.file_bytes, bytes.len() as u64);
        assert_eq!(report.file.triangles + report.file.duplicates, mesh.triangle_count());
        (options, bytes, report)
    })
    .collect()
}

#[test]
fn packed_is_f32_bit_for_bit() {
    let [tenth, tiny, large, least] = [0.1f32, 1e-30, 1e30, -1e-45].map(f64::from);
    let odd = vec![[[tenth; 3], [tiny, 0.0, large], [least; 3]]];
    for triangles in [soup(700, 1), soup(3, 2), odd] {
        for bakes in bake_all(&mesh(&triangles)).chunks(3) {
            let [plain, packed, _] = bakes else { unreachable!() };
            let expected: Vec<_> = (0..).zip(triangles.iter().copied()).collect();
            assert_eq!(stored(&plain.1), expected, "{}", plain.0.stamp());
            assert_eq!(stored(&packed.1), expected, "{}", packed.0.stamp());
        }
    }
}

#[test]
fn few_equal_collinear_and_point_triangles() {
    for count in 1..=9 {
        bake_all(&mesh(&soup(count, count as u64)));
    }
    let one = soup(1, 3)[0];
    for (_, bytes, report) in bake_all(&mesh(&vec![one; 500])) {
        assert_eq!((report.file.triangles, report.file.duplicates), (1, 499));
        assert_eq!(stored(&bytes), [(0, stored(&bytes)[0].1)]);
    }
    // Corners at 2^0 to 2^100 on a line: every triangle is a segment, and the last spans almost all.
    let row: Vec<Triangle> =
        (0..100).map(|i| [0, 1, 1].map(|step| [2f64.powi(i + step), 0.0, 2f64.powi(i + step)])).collect();
    for (_, _, report) in bake_all(&mesh(&row)) {
        assert_eq!(report.file.degenerate, report.file.triangles);
    }
    let points: Vec<Triangle> = soup(300, 4).into_iter().map(|[a, _, _]| [a; 3]).collect();
    for (_, _, report) in bake_all(&mesh(&points)) {
        assert_eq!(report.file.degenerate, report.file.triangles);
    }
    let same: Vec<Triangle> = vec![[[2f64.powi(120); 3]; 3], [[-(2f64.powi(120)); 3]; 3]];
    bake_all(&mesh(&same));
}

#[test]
fn meshes_of_every_scale() {
    for exponent in [-149, -140, -126, -100, -60, 60, 100, 119] {
        let scale = 2f64.powi(exponent);
        let scaled = soup(60, 5).into_iter().map(|t| t.map(|p| p.map(|x| f64::from((x * scale) as f32))));
        bake_all(&mesh(&scaled.collect::<Vec<_>>()));
    }
}

#[test]
fn the_bytes_depend_on_mesh_and_options_alone() {
    for encoding in TriangleEncoding::ALL {
        for profile in [Profile::Dop14U8, Profile::Dop6U8, Profile::Dop26U4] {
            let effort = Effort::ALL[encoding as usize % 2];
            let options = options(profile, encoding).effort(effort);
            let mesh = mesh(&soup(20_000, 6));
            let bake = |threads: usize| {
                let pool = cbvh_testkit::pool(threads);
                pool.install(|| to_bytes(&mesh, &options).unwrap().0)
            };
            let first = bake(1);
            for threads in [1, 2, 4] {
                assert!(bake(threads) == first, "{} on {threads} threads", options.stamp());
            }
        }
    }
}

#[test]
fn several_bricks_are_baked_to_the_same_bytes_by_any_number_of_threads() {
    // A wavy sheet of 2 * 400 * 400 triangles: two bricks at least.
    let at = |i: usize, j: usize| {
        let (x, y) = (i as f64 / 400.0, j as f64 / 400.0);
        [x, y, 0.05 * (20.0 * x).sin() * (17.0 * y).cos()].map(|v| f64::from(v as f32))
    };
    let squares = (0..400).flat_map(|i| (0..400).map(move |j| (i, j)));
    let triangles: Vec<Triangle> = squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
            [[a, b, c], [c, b, d]]
        })
        .collect();
    let mesh = mesh(&triangles);
    let bake = |effort: Effort, threads: usize| {
        let pool = cbvh_testkit::pool(threads);
        let options = options(Profile::Dop14U8, TriangleEncoding::Packed).effort(effort);
        pool.install(|| to_bytes(&mesh, &options).unwrap().0)
    };
    for effort in Effort::ALL {
        let bytes = bake(effort, 1);
        assert!(bytes == bake(effort, 2) && bytes == bake(effort, 5), "{}", effort.name());
        assert_eq!(stored(&bytes).len(), triangles.len());
    }
}

#[test]
fn provenance_is_no_part_of_the_content() {
    let mesh = mesh(&soup(50, 7));
    let (plain, report) = to_bytes(&mesh, &Options::default()).unwrap();
    let text = "generator=a test\ninput=nowhere\n";
    let mut stages = Vec::new();
    let (told, told_report) =
        to_bytes_with(&mesh, &Options::default(), text, &mut |stage| stages.push(stage)).unwrap();
    assert_eq!(report.file.content_xxh3, told_report.file.content_xxh3);
    assert_eq!(validate(&plain).unwrap().content_checksum, validate(&told).unwrap().content_checksum);
    assert!(plain.len() < told.len() && stages.len() == 4, "{stages:?}");
}

/// The other side of "every bake is proved": a slab drawn in by one step is found out.
#[test]
fn a_tightened_slab_fails_the_proof() {
    for profile in Profile::ALL {
        let (bytes, _) = to_bytes(&mesh(&soup(200, 8)), &options(profile, TriangleEncoding::F32)).unwrap();
        let layout = validate(&bytes).unwrap();
        let at = layout.page_offset(0) as usize;
        let line = usize::from(bytes[at + 61]);
        let mut refused = 0;
        let places = places_of_codes(profile);
        for &place in &places {
            let mut changed = bytes.clone();
            let code = &mut changed[at + 64 * line + place..];
            match profile.encoding() {
                // Lower end in the low nibble, upper end in the high one: each one step inward.
                Encoding::U4 if code[0] & 15 == 15 => continue,
                Encoding::U4 => code[0] += 1,
                Encoding::U8 if code[0] == 255 => continue,
                Encoding::U8 => code[0] += 1,
                // To the next exponent: inward by at least the residual itself.
                Encoding::F16 => code[1] += 4,
                Encoding::F32 => {
                    let end = f32::from_le_bytes([code[0], code[1], code[2], code[3]]);
                    let inward = if place < 128 { end.next_up() } else { end.next_down() };
                    code[..4].copy_from_slice(&inward.to_le_bytes());
                }
            }
            repair_page(&mut changed[at..at + PAGE]);
            let error = prove_bounds(&Layout::read(&changed).unwrap(), &changed[..]).err();
            refused += usize::from(error.is_some());
            assert!(error.is_none_or(|error| error.rule == Rule::BoundContains));
        }
        // Codes are the tightest that hold, but f16 steps may be below the rounding of f32 and the upper
        // end of a u4 code is not touched.
        assert!(refused * 10 >= places.len() * 9, "{}: {refused} of {}", profile.name(), places.len());
    }
}

/// Offsets in the first treelet of the codes of child 0 in slabs 0 to 2.
fn places_of_codes(profile: Profile) -> Vec<usize> {
    // The table of places in the specification: row stride, hi.
    let (row, hi) = match profile {
        Profile::Dop14U8 => (4, 32),
        Profile::Dop6U8 => (4, 16),
        Profile::Dop6F16 => (8, 32),
        Profile::Dop26U4 => (4, 0),
        Profile::Dop26U8Wide => (4, 64),
        Profile::Dop14F32 => (16, 128),
    };
    let ends: &[usize] = if hi == 0 { &[0] } else { &[0, hi] };
    ends.iter().flat_map(|end| (0..3).map(move |slab| end + row * slab)).collect()
}

fn repair_page(page: &mut [u8]) {
    let sum = checksum(&page[8..]);
    page[..8].copy_from_slice(&sum.to_le_bytes());
}

/// Returns a baked ball in the profile with turning slabs, and where its pages start.
fn ball_with_turning_slabs() -> (Vec<u8>, usize) {
    let (positions, triangles) = ball(6_000);
    let mesh = Mesh::from_triangles(positions, triangles);
    let (bytes, _) = to_bytes(&mesh, &options(Profile::Dop26U8Wide, TriangleEncoding::F32)).unwrap();
    let at = validate(&bytes).unwrap().page_offset(0) as usize;
    (bytes, at)
}

/// Raises each code of each turning slab by one and each direction by many, in treelets all over the tree.
#[test]
fn a_tightened_turning_slab_fails_the_proof() {
    let (bytes, at) = ball_with_turning_slabs();
    let pages = validate(&bytes).unwrap().objects[0].record().pages.get() as usize;
    let (mut refused, mut changes) = (0, 0);
    for page in (0..pages).step_by(9).map(|page| at + PAGE * page) {
        let first = page + 64 * usize::from(bytes[page + 61]);
        for treelet in (0..usize::from(bytes[page + 59])).map(|slot| first + 128 * slot) {
            // Rows 7 and 14 of both halves; see the table in section 7.4 of the specification.
            for place in [28, 92, 56, 120] {
                let mut changed = bytes.clone();
                let slab = [28, 92, 56, 120].map(|row| changed[treelet + row]);
                if slab == [0; 4] || slab[..2].contains(&255) {
                    continue;
                }
                let code = &mut changed[treelet + place];
                *code = if place < 56 || place == 92 { *code + 1 } else { code.wrapping_add(60) };
                repair_page(&mut changed[page..page + PAGE]);
                let error = prove_bounds(&Layout::read(&changed).unwrap(), &changed[..]).err();
                changes += 1;
                refused += usize::from(error.is_some());
                assert!(error.is_none_or(|error| error.rule == Rule::BoundContains));
            }
        }
    }
    assert!(changes > 100 && refused * 10 >= changes * 9, "{refused} of {changes}");
}

/// A file whose last page has no turning slabs is proved like any other, whatever the pages before it have.
#[test]
fn turning_slabs_are_proved_where_the_last_page_has_none() {
    let (mut bytes, at) = ball_with_turning_slabs();
    let pages = validate(&bytes).unwrap().objects[0].record().pages.get() as usize;
    let inflation = prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).unwrap();
    let places = |bytes: &[u8], page: usize| {
        let first = page + 64 * usize::from(bytes[page + 61]);
        (0..usize::from(bytes[page + 59]))
            .flat_map(move |slot| [28, 92, 56, 120].map(|row| first + 128 * slot + row))
    };
    let last = at + PAGE * (pages - 1);
    let of_last: Vec<usize> = places(&bytes, last).collect();
    assert!(of_last.iter().any(|&place| bytes[place] != 0));
    of_last.iter().for_each(|&place| bytes[place..place + 4].fill(0));
    repair_page(&mut bytes[last..last + PAGE]);
    assert_eq!(prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).unwrap(), inflation);
    // Some slab of an earlier page cuts its triangles.
    let page = at + PAGE * (pages / 2);
    let slab = places(&bytes, page).step_by(4).find(|&place| bytes[place] != 0).expect("a turning slab");
    bytes[slab] = 255;
    repair_page(&mut bytes[page..page + PAGE]);
    let error = prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).unwrap_err();
    assert_eq!(error.rule, Rule::BoundContains, "{error}");
}

/// A slab of a child with more triangles than a reader has to keep is refused, even one that contains them.
#[test]
fn a_turning_slab_over_too_many_triangles_fails_the_proof() {
    let (mut bytes, at) = ball_with_turning_slabs();
    let treelet = at + 64 * usize::from(bytes[at + 61]);
    assert_eq!([28, 92, 56, 120].map(|row| bytes[treelet + row]), [0; 4]);
    (bytes[treelet + 56], bytes[treelet + 120]) = (127, 127);
    repair_page(&mut bytes[at..at + PAGE]);
    let error = prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).unwrap_err();
    assert_eq!(error.rule, Rule::TurningTriangles, "{error}");
}

/// The slabs of roots are proved too.
#[test]
fn a_tightened_anchor_fails_the_proof() {
    for profile in Profile::ALL {
        let (mut bytes, _) =
            to_bytes(&mesh(&soup(200, 9)), &options(profile, TriangleEncoding::Packed)).unwrap();
        let at = validate(&bytes).unwrap().page_offset(0) as usize;
        let lo = f32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[at + 64 + i]));
        bytes[at + 64..at + 68].copy_from_slice(&lo.next_up().to_le_bytes());
        repair_page(&mut bytes[at..at + PAGE]);
        let error = prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).unwrap_err();
        assert_eq!(error.rule, Rule::BoundContains, "{}", profile.name());
    }
}

/// Queries rely on spheres and on anchors within the nodes that lead to them, so these are proved as well.
#[test]
fn the_proof_refuses_a_sphere_or_an_anchor_that_is_wrong() {
    let (good, _) =
        to_bytes(&mesh(&soup(900, 10)), &options(Profile::Dop26U8Wide, TriangleEncoding::Packed)).unwrap();
    let broken = |record: &dyn Fn(&mut ObjectRecord), node: &dyn Fn(&Node, &mut TightBound)| {
        let bytes = rewritten(&good, record, node).unwrap();
        prove_bounds(&Layout::read(&bytes).unwrap(), &bytes[..]).err().map(|error| error.rule)
    };
    let radius = |by: f32| {
        broken(&|record| record.sphere_radius = (record.sphere_radius.get() * by).into(), &|_, _| ())
    };
    assert_eq!(broken(&|record| move_sphere(record, 1, 1e-3), &|_, _| ()), None);
    assert_eq!(radius(0.999), Some(Rule::BoundContains));
    // The sphere is as small as its centre allows.
    assert_eq!(radius(0.999999), Some(Rule::BoundContains));
    let roots = remote_roots(&good);
    assert!(roots.len() > 2);
    for &root in &roots {
        for (slab, upper, end) in [(0, true, 1e3f32), (4, false, 1e3), (12, true, 1e30)] {
            let error = broken(&|_| (), &|node, bound| {
                if node.root == root {
                    widen(&mut bound.kdop, slab, upper, end);
                }
            });
            assert_eq!(error, Some(Rule::Nested), "root {root:?}, slab {slab}");
        }
    }
}

#[test]
fn quantized_vertices_move_by_at_most_the_stated_error() {
    let triangles = soup(500, 10);
    for max_error in [None, Some(1e-2), Some(1e-4), Some(1e-9), Some(0.036)] {
        let options = options(Profile::Dop14U8, TriangleEncoding::Quantized).max_error(max_error);
        let (bytes, report) = to_bytes(&mesh(&triangles), &options).unwrap();
        let diagonal = 2.2 * 3f64.sqrt();
        let allowed = max_error.unwrap_or(1e-5 * diagonal);
        assert!(
            report.file.max_quantization_error <= allowed,
            "{} > {allowed}",
            report.file.max_quantization_error
        );
        let record = *validate(&bytes).unwrap().objects[0].record();
        assert_eq!(record.max_quantization_error.get(), report.file.max_quantization_error);
        let mut moved = 0.0f64;
        for (id, stored) in stored(&bytes) {
            for (input, stored) in triangles[id as usize].iter().zip(stored) {
                moved = moved.max((0..3).map(|k| (input[k] - stored[k]).powi(2)).sum::<f64>().sqrt());
            }
        }
        // Of triangles that become equal one is stored; its corners moved no farther.
        assert!(moved <= report.file.max_quantization_error * (1.0 + 1e-14), "{moved} > {report:?}");
        if report.file.duplicates == 0 {
            assert!(moved >= report.file.max_quantization_error * (1.0 - 1e-14), "{moved} < {report:?}");
        }
        let packed = to_bytes(&mesh(&triangles), &self::options(Profile::Dop14U8, TriangleEncoding::Packed));
        if max_error.is_none_or(|error| error > 1e-6) {
            assert!(report.file.triangle_bytes < packed.unwrap().1.file.triangle_bytes, "{max_error:?}");
        }
    }
}

#[test]
fn numbers_beyond_f32_get_an_origin_and_the_rounding_is_measured() {
    for offset in [1e5, 1e7, -3e9, 1e15, 0.1, 1e300f64.powf(0.1)] {
        let far: Vec<Triangle> = soup(200, 11)
            .into_iter()
            .map(|t| t.map(|p| [p[0] + offset, p[1] - 2.0 * offset, p[2]]))
            .collect();
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            let (bytes, report) = to_bytes(&mesh(&far), &options(Profile::Dop14U8, encoding)).unwrap();
            let mut moved = 0.0f64;
            for (id, stored) in stored(&bytes) {
                for (input, stored) in far[id as usize].iter().zip(stored) {
                    let distance = (0..3).map(|k| (input[k] - stored[k]).powi(2)).sum::<f64>().sqrt();
                    moved = moved.max(distance);
                }
            }
            assert!(
                moved <= report.file.max_vertex_rounding * (1.0 + 1e-14),
                "{offset}: {moved}, {report:?}"
            );
            assert!(
                moved >= report.file.max_vertex_rounding * (1.0 - 1e-14) || report.file.duplicates > 0,
                "{offset}"
            );
            let ulp = 2.0 * offset.abs() * f64::EPSILON;
            assert!(report.file.max_vertex_rounding <= 1e-6 + 4.0 * ulp, "{offset}: {report:?}");
            // The third axis is of f32 numbers: its origin is 0.
            assert_eq!(validate(&bytes).unwrap().objects[0].origin()[2], 0.0);
        }
    }
    let exact = to_bytes(&mesh(&soup(100, 12)), &Options::default()).unwrap();
    assert_eq!(exact.1.file.max_vertex_rounding, 0.0);
    assert_eq!(validate(&exact.0).unwrap().objects[0].origin(), [0.0; 3]);
}

#[test]
fn duplicates_are_found_in_any_order_of_corners() {
    let mut triangles = soup(100, 13);
    let mut expected = Vec::new();
    for (kept, order) in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].iter().enumerate()
    {
        expected.push([kept as u32, triangles.len() as u32]);
        triangles.push(order.map(|corner| triangles[kept][corner]));
    }
    // Once more the first: the pairs of a kept triangle ascend.
    expected.insert(1, [0, triangles.len() as u32]);
    triangles.push(triangles[0]);
    // Equal corners but another triangle: two corners fall together.
    triangles.push([triangles[0][0], triangles[0][0], triangles[0][1]]);
    triangles.push([triangles[0][0], triangles[0][1], triangles[0][1]]);
    for ids in [true, false] {
        let (bytes, report) = to_bytes(&mesh(&triangles), &Options::default().ids(ids)).unwrap();
        assert_eq!((report.file.duplicates, report.file.triangles), (7, 102));
        let layout = validate(&bytes).unwrap();
        let pairs: Vec<_> = layout.duplicate_ids(&bytes).iter().map(|pair| pair.map(|id| id.get())).collect();
        assert_eq!(pairs, if ids { expected.clone() } else { vec![] });
        assert_eq!((layout.has_ids(), report.file.id_bytes > 0), (ids, ids));
        let record = layout.objects[0].record();
        assert_eq!(
            (record.triangles.get(), record.input_triangles.get(), record.duplicates.get()),
            (102, 109, 7)
        );
        let kept: Vec<u32> = stored(&bytes).iter().map(|&(id, _)| id).collect();
        if ids {
            let dropped: Vec<u32> = expected.iter().map(|pair| pair[1]).collect();
            assert_eq!(kept, (0..109).filter(|id| !dropped.contains(id)).collect::<Vec<_>>());
        }
    }
}

#[test]
fn objects_are_merged_unless_split_and_keep_names_and_ids() {
    let mut input = mesh(&soup(40, 14));
    for (number, name) in ["second", "", "empty"].into_iter().enumerate() {
        let mut object = mesh(&soup(30 * (2 - number), 15)).objects.remove(0);
        let first = input.triangle_count() as u32;
        object.triangle_ids.iter_mut().for_each(|id| *id += first);
        object.name = name.to_owned();
        input.objects.push(object);
    }
    let (one, _) = to_bytes(&input, &Options::default()).unwrap();
    let (split, report) = to_bytes(&input, &Options::default().split_objects(true)).unwrap();
    let names = |bytes: &[u8]| -> Vec<_> {
        let names = validate(bytes).unwrap().objects.into_iter();
        names.map(|object| (object.name().to_owned(), object.triangles())).collect()
    };
    // 30 triangles of the third are the first of the second, but of another object.
    assert_eq!(names(&one), [(String::new(), 100)]);
    let expected = [("", 40), ("second", 60), ("", 30)].map(|(name, count)| (name.to_owned(), count));
    assert_eq!((names(&split), report.file.objects), (expected.to_vec(), 3));
    assert_eq!(stored(&split).iter().map(|&(id, _)| id).collect::<Vec<_>>(), (0..130).collect::<Vec<_>>());
    let empty = Mesh { objects: vec![input.objects[3].clone()], ..Mesh::default() };
    assert!(to_bytes(&empty, &Options::default()).is_err());
}

#[test]
fn every_page_holds_leaves_of_at_most_four_and_children_of_at_most_its_width() {
    for (options, bytes, report) in bake_all(&mesh(&soup(3000, 16))) {
        let layout = Layout::read(&bytes).unwrap();
        let (profile, pages) = (layout.objects[0].profile(), layout.page_count());
        assert_eq!((Some(profile), report.file.profile), (options.profile, profile));
        let mut children = 0;
        for number in 0..pages {
            let page = Page::new(layout.page_bytes(&bytes, number).unwrap(), profile);
            let slots = 0..page.header().treelets;
            children += slots.map(|slot| page.links(slot).children()).sum::<usize>();
        }
        let treelets = layout.objects[0].record().treelets.get();
        assert_eq!(report.mean_children, children as f64 / treelets as f64);
    }
}

#[test]
fn the_meshes_of_testdata_bake() {
    for name in ["fclenv.obj", "fclrob.obj"] {
        let mesh =
            input::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata").join(name)).unwrap();
        bake_all(&mesh);
    }
}
