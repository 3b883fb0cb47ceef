//! Rays and segments: against labels from exact arithmetic, and against rationals over all triangles.

mod common;

use bvh_query::{Backend, Bvh, Querier, Ray};
use common::{bake, note, shared};

fn queriers() -> Vec<Querier> {
    let backends = Backend::ALL.into_iter().filter(|backend| backend.is_available());
    backends.map(Querier::with_backend).collect()
}

/// Calls `check` with the mesh, the six numbers of each line of a file of labelled probes and the label.
fn each_label(kind: &str, mut check: impl FnMut(&Bvh, &[f64; 6], f64, &str)) {
    for name in ["ball", "bunny", "nao", "apollo", "dragon"] {
        let folder = if name == "ball" { "probes" } else { "meshes" };
        let Some(path) = shared(&format!("{folder}/{name}.obj")) else { return };
        let Some(probes) = shared(&format!("probes/{name}_{kind}.txt")) else { return };
        let mut read = bvh_bake::input::read(&path).unwrap();
        for object in &mut read.objects {
            object.positions.iter_mut().for_each(|p| *p = p.map(|v| f64::from(v as f32)));
        }
        let bvh = bake(&read, &bvh_bake::Options::default());
        for line in std::fs::read_to_string(probes).unwrap().lines().filter(|line| !line.starts_with('#')) {
            let (numbers, label) = line.split_once('#').unwrap();
            let mut numbers = numbers.split_whitespace().map(|word| word.parse::<f64>().unwrap());
            let numbers = [(); 6].map(|()| numbers.next().unwrap());
            let label = label.split_whitespace().last().unwrap().parse().unwrap();
            check(&bvh, &numbers, label, &format!("{name}: {line}"));
        }
    }
}

#[test]
fn labelled_rays_hit_where_they_should() {
    let (mut hits, mut all, mut worst) = (0, 0, 0.0f64);
    let mut queriers = queriers();
    each_label("rays", |bvh, &[a, b, c, d, e, f], label, line| {
        let ray = Ray::new([a, b, c], [d, e, f]);
        let mut first = None;
        for querier in &mut queriers {
            let found = querier.first_hit(bvh, &ray).unwrap();
            assert_eq!(*first.get_or_insert(found), found, "{line} {:?}", querier.backend());
            assert_eq!(querier.any_hit(bvh, &ray), Ok(found.is_some()), "{line}");
            let all = querier.all_hits(bvh, &ray).unwrap();
            assert_eq!(all.first().copied(), found, "{line}");
            assert!(all.is_sorted_by(|x, y| x.t <= y.t));
        }
        let found = first.unwrap();
        assert_eq!(found.is_none(), label == -1.0, "{line} {found:?}");
        all += 1;
        let Some(hit) = found else { return };
        hits += 1;
        let slack = label * f64::EPSILON;
        assert!(hit.lower <= label + slack && label - slack <= hit.upper, "{line} {hit:?}");
        assert_eq!(hit.t == 0.0, label == 0.0);
        worst = worst.max((hit.t - label).abs() / label);
    });
    assert!(worst <= 2f64.powi(-43));
    note(&format!("{all} rays, {hits} hits, parameters off by at most {worst:e} of themselves"));
}

#[test]
fn labelled_segments_meet_what_they_should() {
    let (mut met, mut all) = (0, 0);
    let mut queriers = queriers();
    each_label("segments", |bvh, &[a, b, c, d, e, f], label, line| {
        for querier in &mut queriers {
            let found = querier.meets_segment(bvh, [a, b, c], [d, e, f]).unwrap();
            assert_eq!(found, label == 1.0, "{line} {:?}", querier.backend());
            assert_eq!(querier.meets_segment(bvh, [d, e, f], [a, b, c]), Ok(found), "{line}");
        }
        met += u32::from(label == 1.0);
        all += 1;
    });
    note(&format!("{all} segments, {met} meet their mesh"));
}
