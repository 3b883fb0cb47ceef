//! Shrinks a question with a wrong answer: fewer triangles, and numbers with fewer digits.

use super::files::Layout;
use cbvh_testkit::Triangle;
use serde::{Deserialize, Serialize};

/// Two meshes, how they are baked, a pose and a backend: all that a question about pairs needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Case {
    pub(super) a: Vec<Triangle>,
    pub(super) b: Vec<Triangle>,
    pub(super) rotation: [[f64; 3]; 3],
    pub(super) translation: [f64; 3],
    pub(super) layouts: [Layout; 2],
    pub(super) backend: String,
}

/// The largest number of smaller cases that are asked, so that a finding takes seconds.
const MAX_TRIES: usize = 3000;

/// Returns the smallest case that was found to be wrong as well, with what is wrong there. `ask` says what is wrong.
pub(super) fn shrunk(case: Case, wrong: String, ask: impl Fn(&Case) -> Option<String>) -> (Case, String) {
    let mut best = Best { case, wrong, tries: 0, ask };
    loop {
        let before = best.case.clone();
        best.remove(|case| &mut case.a);
        best.remove(|case| &mut case.b);
        best.simplify();
        if best.case == before || best.tries >= MAX_TRIES {
            return (best.case, best.wrong);
        }
    }
}

struct Best<F> {
    case: Case,
    wrong: String,
    tries: usize,
    ask: F,
}

impl<F: Fn(&Case) -> Option<String>> Best<F> {
    /// Takes a case if it is wrong, too.
    fn take(&mut self, case: Case) -> bool {
        if self.tries >= MAX_TRIES || case == self.case {
            return false;
        }
        self.tries += 1;
        let Some(wrong) = (self.ask)(&case) else { return false };
        (self.case, self.wrong) = (case, wrong);
        true
    }

    /// Leaves out stretches of triangles of one side, first half of them, at last single ones.
    fn remove(&mut self, side: impl Fn(&mut Case) -> &mut Vec<Triangle>) {
        let mut stretch = side(&mut self.case).len() / 2;
        while stretch > 0 {
            let mut at = 0;
            while at < side(&mut self.case).len() {
                let mut case = self.case.clone();
                let triangles = side(&mut case);
                let end = (at + stretch).min(triangles.len());
                triangles.drain(at..end);
                if triangles.is_empty() || !self.take(case) {
                    at += stretch;
                }
            }
            stretch /= 2;
        }
    }

    /// Makes numbers simpler: no rotation, no translation, and the fewest bits of each number.
    fn simplify(&mut self) {
        let mut case = self.case.clone();
        case.rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        self.take(case);
        for number in 0..self.numbers() {
            // From no bits, which is 0, to all but the last.
            for bits in [0, 1, 2, 4, 8, 12, 16, 24, 32, 40, 48, 51] {
                let mut case = self.case.clone();
                let x = nth(&mut case, number);
                let kept = f64::from_bits(x.to_bits() >> (53 - bits.max(1)) << (53 - bits.max(1)));
                *x = if bits == 0 { 0.0 } else { kept };
                if *x == *nth(&mut self.case, number) || self.take(case) {
                    break;
                }
            }
        }
    }

    fn numbers(&self) -> usize {
        3 + 9 * (self.case.a.len() + self.case.b.len())
    }
}

/// Returns a number of a case: its translation, then its corners.
fn nth(case: &mut Case, number: usize) -> &mut f64 {
    let corners = case.a.iter_mut().chain(&mut case.b).flatten().flatten();
    let mut numbers = case.translation.iter_mut().chain(corners);
    numbers.nth(number).expect("a number of the case")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wrong is a case in which the triangles numbered 77 and 5 are left, and one corner of A is above 1/3.
    #[test]
    fn the_fewest_triangles_and_the_simplest_numbers_are_left() {
        let triangle = |i: usize| [[i as f64, 0.3, 0.1], [i as f64, 1.7, 0.9], [i as f64, 0.2, 0.7]];
        let layout = Layout { profile: String::new(), triangles: String::new(), turning_slabs: true };
        let case = Case {
            a: (0..100).map(triangle).collect(),
            b: (0..40).map(triangle).collect(),
            rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.1, 0.2, 0.3],
            layouts: [layout.clone(), layout],
            backend: "scalar".into(),
        };
        let ask = |case: &Case| {
            let a = case.a.iter().any(|t| t[0][0] == 77.0 && t[1][1] > 1.0 / 3.0);
            (a && case.b.iter().any(|t| t[2][0] == 5.0)).then(|| "wrong".to_owned())
        };
        let (case, wrong) = shrunk(case.clone(), ask(&case).unwrap(), ask);
        assert_eq!((case.a.len(), case.b.len(), wrong.as_str()), (1, 1, "wrong"));
        assert_eq!((case.translation, case.rotation[0]), ([0.0; 3], [1.0, 0.0, 0.0]));
        assert_eq!(case.a[0], [[77.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]]);
        assert_eq!(case.b[0], [[0.0; 3], [0.0; 3], [5.0, 0.0, 0.0]]);
    }
}
