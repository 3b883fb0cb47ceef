//! Clouds of points: what is stored of them, radii and solids in files, and the bytes they take.

use bvh_bake::mesh::{Instance, Mesh};
use bvh_bake::{BakeError, Options, shapes, to_bytes, verify};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use cbvh_testkit::Random;

/// Points near a surface, of which some coincide.
fn points(count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random::new(seed);
    let mut next = || f64::from(random.signed() as f32);
    let mut points: Vec<[f64; 3]> = Vec::new();
    for number in 0..count {
        let [x, y] = [next(), next()];
        let again = (number % 11 == 10).then(|| points[number / 2]);
        points.push(again.unwrap_or([x, y, f64::from((x * y + 0.01 * next()) as f32)]));
    }
    points
}

#[test]
fn every_point_is_stored_in_every_layout() {
    for count in [1, 2, 63, 64, 65, 1000, 20_000] {
        let points = points(count, count as u64);
        let cloud = shapes::cloud(&points);
        for profile in Profile::ALL {
            for encoding in TriangleEncoding::ALL {
                let options = Options::default()
                    .profile(profile)
                    .triangles(encoding)
                    .max_error(Some(1e-3).filter(|_| encoding == TriangleEncoding::Quantized && count > 1));
                let bytes = to_bytes(&cloud, &options).unwrap().0;
                let stored = cbvh_testkit::stored::stored(&bytes);
                let mut found = vec![None; count];
                for one in &stored {
                    assert!(one.corners[0] == one.corners[1] && one.corners[1] == one.corners[2]);
                    assert_eq!(found[one.id as usize].replace(one.corners[0]), None);
                }
                let error = if encoding == TriangleEncoding::Quantized { 1e-3 } else { 0.0 };
                for (point, found) in points.iter().zip(&found) {
                    let far = (0..3).map(|k| (point[k] - found.unwrap()[k]).powi(2)).sum::<f64>().sqrt();
                    assert!(far <= error, "{profile:?} {encoding:?} {count}: {far}");
                }
                if encoding != TriangleEncoding::Quantized {
                    verify(&bytes, &cloud).unwrap();
                }
            }
        }
    }
}

/// More points than a brick holds.
#[test]
fn large_clouds_have_several_bricks() {
    let points = points((1 << 18) + 5000, 8);
    let cloud = shapes::cloud(&points);
    let (bytes, report) = to_bytes(&cloud, &Options::default()).unwrap();
    assert_eq!((report.file.triangles, report.file.duplicates), (points.len() as u64, 0));
    verify(&bytes, &cloud).unwrap();
    assert_eq!(bytes, to_bytes(&cloud, &Options::default().effort(bvh_bake::Effort::Quick)).unwrap().0);
}

/// A cloud has no boundary. Up to 64 points are listed as components, and more are not.
#[test]
fn clouds_are_closed() {
    for (count, listed) in [(1, 1), (64, 64), (65, 0), (5000, 0)] {
        let points: Vec<[f64; 3]> = (0..count).map(|n| [f64::from(n), f64::from(n % 7), 0.0]).collect();
        let (bytes, report) = to_bytes(&shapes::cloud(&points), &Options::default()).unwrap();
        assert_eq!(report.file.closed, Some(1));
        let topology = validate(&bytes).unwrap().check_topology(&bytes[..]).unwrap();
        assert_eq!(topology[0].component_count(), listed);
    }
}

#[test]
fn radii_and_solids_are_stored_and_checked() {
    let block = shapes::block([1.0, 2.0, 3.0]).unwrap();
    let options = Options::default().radius(0.25).solid(true).topology(false);
    let layout = validate(&to_bytes(&block, &options).unwrap().0).unwrap();
    assert_eq!((layout.objects[0].radius(), layout.objects[0].is_solid()), (0.25, true));
    assert_ne!(options.stamp(), Options::default().topology(false).stamp());
    let refused = |mesh: &Mesh, options: Options| to_bytes(mesh, &options).unwrap_err();
    for wrong in [-1.0, -f64::MIN_POSITIVE, f64::NAN, f64::INFINITY, 2f64.powi(118).next_up()] {
        assert!(matches!(refused(&block, Options::default().radius(wrong)), BakeError::Radius(_)), "{wrong}");
    }
    let negative_zero = validate(&to_bytes(&block, &Options::default().radius(-0.0)).unwrap().0).unwrap();
    assert!(negative_zero.objects[0].radius().is_sign_positive());
    let open = Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    assert!(matches!(refused(&open, Options::default().solid(true)), BakeError::NotClosed { .. }));

    let mut scene = block.clone();
    scene.objects.extend(open.objects.clone());
    scene.objects[1].name = "sheet".to_owned();
    scene.objects[1].triangle_ids = vec![12];
    scene.instances = vec![Instance { solid: true, margin: 0.5, ..Instance::of_object(0) }];
    let bytes = to_bytes(&scene, &Options::default().topology(false)).unwrap().0;
    let instances = validate(&bytes).unwrap().read_instances(&bytes[..]).unwrap();
    assert_eq!((instances[0].solid, instances[0].margin), (true, 0.5));
    verify(&bytes, &scene).unwrap();
    let mut other = scene.clone();
    other.instances[0].margin = 0.25;
    assert!(verify(&bytes, &other).unwrap_err().to_string().contains("margin"));
    scene.instances.push(Instance { solid: true, ..Instance::of_object(1) });
    let error = refused(&scene, Options::default());
    assert!(error.to_string().contains("sheet") && matches!(error, BakeError::NotClosed { .. }), "{error}");
    scene.instances[1] = Instance { margin: f64::NAN, ..Instance::of_object(1) };
    assert!(refused(&scene, Options::default()).to_string().contains("margin"));
}
