//! Compares answers with those of the reference: the profile of plain floats, with the same triangles.
//!
//! Contact and exact distances have one right answer for given triangles, bit for bit. With an allowed error the answer
//! lies between the least distance and that much more. Quantised triangles have moved and have answers of their own:
//! these are compared with the reference for the same moved triangles, and their difference from the answers for the
//! mesh itself is an error that is reported.

use super::{EXACT_DISTANCE, Layout, QUESTIONS};
use bvh_format::leaf::TriangleEncoding;
use cbvh_measure::rounds::{Asked, Question};
use cbvh_measure::spread::median;

/// The factor that allows for rounding in the product of a distance and 1 + an allowed error: two roundings of 2^-53
/// each are needed, and the factor allows eight.
const ROUNDING: f64 = 1.0 + 4.0 * f64::EPSILON;

/// How far distances are from the exact ones.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    /// Relative errors, over the poses in which the meshes are apart.
    pub(super) median: Option<f64>,
    pub(super) max: Option<f64>,
    /// The largest error over all poses, mesh units.
    pub(super) max_length: Option<f64>,
}

/// Returns the wrong answers, one line each, and the errors of each layout's answers, by question.
pub(super) fn judge(pair: &str, layouts: &[Layout], asked: &[Vec<Asked>]) -> (Vec<String>, Vec<Vec<Errors>>) {
    let reference = |triangles: TriangleEncoding| {
        let place = layouts.iter().position(|layout| layout.is_reference(triangles));
        &asked[place.unwrap_or(0)]
    };
    let exact = &reference(TriangleEncoding::F32)[EXACT_DISTANCE].answers;
    let mut wrong = Vec::new();
    let mut errors = Vec::new();
    for (layout, found) in layouts.iter().zip(asked) {
        let right = reference(layout.triangles);
        let name = format!("{pair}, {}", layout.name());
        let mut errors_of = Vec::new();
        for (number, question) in QUESTIONS.into_iter().enumerate() {
            let expected = match question {
                Question::Collide => &right[number].answers,
                Question::Distance(_) => &right[EXACT_DISTANCE].answers,
            };
            for (pose, (&found, &expected)) in found[number].answers.iter().zip(expected).enumerate() {
                if !is_right(question, found, expected) {
                    let (asked, rel_err) = (question.name(), question.rel_err().unwrap_or(0.0));
                    wrong.push(format!(
                        "{name}, {asked} with an allowed error of {rel_err}, pose {}: expected {expected:?}, \
                         found {found:?}",
                        pose + 1
                    ));
                }
            }
            errors_of.push(match question {
                Question::Collide => Errors::default(),
                Question::Distance(_) => errors_against(exact, &found[number].answers),
            });
        }
        errors.push(errors_of);
    }
    (wrong, errors)
}

fn is_right(question: Question, found: f64, expected: f64) -> bool {
    match question {
        Question::Collide => found == expected,
        Question::Distance(0.0) => found.to_bits() == expected.to_bits(),
        Question::Distance(rel_err) => expected <= found && found <= expected * (1.0 + rel_err) * ROUNDING,
    }
}

fn errors_against(exact: &[f64], found: &[f64]) -> Errors {
    let pairs = || exact.iter().zip(found);
    let relative: Vec<f64> = pairs()
        .filter(|(exact, _)| **exact > 0.0)
        .map(|(exact, found)| (found - exact).abs() / exact)
        .collect();
    let largest = |values: Vec<f64>| values.into_iter().reduce(f64::max);
    Errors {
        max: largest(relative.clone()),
        median: median(relative),
        max_length: largest(pairs().map(|(exact, found)| (found - exact).abs()).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_and_wrong_are_told_apart() {
        let exact = Question::Distance(0.0);
        assert!(is_right(exact, 2.0, 2.0) && !is_right(exact, 2.0f64.next_up(), 2.0));
        let loose = Question::Distance(0.1);
        assert!(is_right(loose, 2.2, 2.0) && is_right(loose, 2.0, 2.0) && is_right(loose, 0.0, 0.0));
        assert!(!is_right(loose, 2.21, 2.0) && !is_right(loose, 1.99, 2.0) && !is_right(loose, 0.1, 0.0));
        assert!(!is_right(loose, f64::NAN, 2.0));
        assert!(is_right(Question::Collide, 1.0, 1.0) && !is_right(Question::Collide, 0.0, 1.0));
    }

    #[test]
    fn relative_errors_are_of_poses_that_are_apart() {
        let errors = errors_against(&[0.0, 1.0, 2.0, 4.0], &[0.5, 1.0, 2.5, 3.0]);
        assert_eq!((errors.median, errors.max, errors.max_length), (Some(0.25), Some(0.25), Some(1.0)));
        let touching = errors_against(&[0.0], &[0.0]);
        assert_eq!((touching.median, touching.max, touching.max_length), (None, None, Some(0.0)));
    }

    #[test]
    fn one_wrong_answer_is_named() {
        let layouts: Vec<Layout> = Layout::all().collect();
        // The answers in two poses, of which the second is 2 apart.
        let asked = |question: Question| {
            let answers = if question == Question::Collide { vec![1.0, 0.0] } else { vec![0.0, 2.0] };
            Asked { answers, ..Asked::default() }
        };
        let mut found = vec![QUESTIONS.map(asked).to_vec(); layouts.len()];
        assert!(judge("pair", &layouts, &found).0.is_empty());
        let place = layouts.iter().position(|layout| layout.name() == "dop6-u8 packed").unwrap();
        found[place][0].answers[1] = 1.0;
        assert_eq!(
            judge("pair", &layouts, &found).0,
            ["pair, dop6-u8 packed, collide with an allowed error of 0, pose 2: expected 0.0, found 1.0"]
        );
    }
}
