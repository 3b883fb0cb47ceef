//! Reads the labelled probes.

use crate::common::{bake, shared, stated};
use bvh_query::Bvh;

/// Calls `check` with each labelled line about a mesh: its numbers, the words of its label and the line itself. The mesh is that
/// of an OBJ rounded to f32, as the labels are about. Each mesh has a thousand lines.
pub(crate) fn each_label<const N: usize>(
    names: &[&str],
    kind: &str,
    mut check: impl FnMut(&Bvh, [f64; N], &[&str], &str),
) {
    for name in names {
        let folder = if *name == "ball" { "probes" } else { "meshes" };
        let path = shared(&format!("{folder}/{name}.obj"));
        let probes = std::fs::read_to_string(shared(&format!("probes/{name}_{kind}.txt"))).unwrap();
        assert_eq!(stated(&probes).count(), 1000, "{name}_{kind}");
        let mut read = bvh_bake::input::read(&path).unwrap();
        for object in &mut read.objects {
            object.positions.iter_mut().for_each(|p| *p = p.map(|v| f64::from(v as f32)));
        }
        let bvh = bake(&read, &bvh_bake::Options::default());
        for line in stated(&probes) {
            let (numbers, label) = line.split_once('#').unwrap();
            let mut numbers = numbers.split_whitespace().map(|word| word.parse::<f64>().unwrap());
            let numbers = [(); N].map(|()| numbers.next().unwrap());
            let label: Vec<&str> = label.split_whitespace().collect();
            check(&bvh, numbers, &label, &format!("{name}: {line}"));
        }
    }
}

/// Returns the number after a word of a label.
pub(crate) fn number(label: &[&str], word: &str) -> f64 {
    let at = label.iter().position(|found| *found == word).unwrap();
    label[at + 1].parse().unwrap()
}
