//! Reads the labelled probes.

use crate::common::{bake, shared};
use bvh_query::Bvh;

/// Calls `check` with each labelled line about a mesh: its numbers, the words of its label and the line itself. The mesh is that
/// of an OBJ rounded to f32, as the labels are about.
pub(crate) fn each_label<const N: usize>(
    names: &[&str],
    kind: &str,
    mut check: impl FnMut(&Bvh, [f64; N], &[&str], &str),
) {
    for name in names {
        let folder = if *name == "ball" { "probes" } else { "meshes" };
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
