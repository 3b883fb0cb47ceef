//! The open data of overlaps with labelled depths, and its purely geometric check: no triangles meet after the translation.

use super::{moved, penetration};
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{bake, queriers, shared, shared_mesh, stored};
use bvh_bake::Options;
use bvh_query::{PenetrationOptions, Pose, QueryError};

/// A pose and the interval that its depth is in; none where the question has no answer.
type Labelled = (Pose, Option<[f64; 2]>);

fn read(text: &str) -> Vec<Labelled> {
    let line = |line: &str| {
        let (numbers, label) = line.split_once('#').unwrap();
        let numbers: Vec<f64> = numbers.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let words: Vec<&str> = label.split_whitespace().collect();
        let depth = words.get(1).map(|low| {
            let high =
                words.get(2).filter(|word| word.starts_with(|c: char| c.is_ascii_digit())).unwrap_or(low);
            [low, high].map(|word| word.parse().unwrap())
        });
        (Pose::from_rows(numbers.as_slice().try_into().unwrap()).unwrap(), depth)
    };
    text.lines().filter(|line| line.contains('#') && !line.starts_with('#')).map(line).collect()
}

#[test]
#[ignore = "needs ../shared"]
fn labelled_depths_are_between_the_bounds() {
    let pairs = shared("depth/pairs.txt");
    let text = std::fs::read_to_string(&pairs).unwrap();
    let mut queriers = queriers();
    let (mut ratios, mut count) = ([0.0; 2], 0);
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [a, b] = [words[1], words[2]]
            .map(|name| bake(&shared_mesh(&format!("../depth/{name}")), &Options::default()));
        let poses = std::fs::read_to_string(pairs.with_file_name(format!("{}.txt", words[0]))).unwrap();
        let [of_a, of_b] = [&a, &b].map(|bvh| Surface::new(stored(bvh)));
        for (number, (pose, depth)) in read(&poses).into_iter().enumerate().step_by(3) {
            let Some([low, high]) = depth else {
                let refused = queriers[0].penetration(&a, &b, &pose, &PenetrationOptions::new());
                assert!(matches!(refused.unwrap_err(), QueryError::NotClosed { object: 0, edges: Some(_) }));
                continue;
            };
            let found = penetration(&mut queriers, &a, &b, &pose);
            let context = format!("{line}, pose {number}: {found:?}");
            assert!(found.lower <= high * (1.0 + 1e-9) + 1e-14, "{context}, depth {high}");
            assert!(found.upper >= low * (1.0 - 1e-9) - 1e-13, "{context}, depth {low}");
            if high > 1e-9 {
                let better = f64::max(found.lower, 1e-3 * low);
                ratios = [ratios[0] + (found.upper / high).ln(), ratios[1] + (low / better).ln()];
                count += 1;
            } else {
                assert!(found.lower == 0.0 && found.upper < 1e-11, "{context}");
            }
            if number % 9 == 0 && of_a.stored.len() * of_b.stored.len() < 40_000 {
                let after = Truth::new(&of_a, &of_b, &moved(&pose, found.translation));
                assert!(!after.collide(&mut (0, 0), &mut Tally::default()), "{context}");
            }
        }
    }
    assert!(count > 300, "{count} overlaps");
    let means = ratios.map(|sum: f64| (sum / f64::from(count)).exp());
    assert!(means[0] < 1.05 && means[1] < 2.0, "{means:?} over {count}");
}
