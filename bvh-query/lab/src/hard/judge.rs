//! Judges whether another library's answer is right.

use cbvh_testkit::Triangle;
use cbvh_testkit::hard_cases::Truth;
use serde::Serialize;

/// The largest error of a distance that counts as right, as a fraction of the distance: ten roundings of single precision.
pub(super) const MAX_RIGHT_ERROR: f64 = 1e-6;

/// How an answer compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Verdict {
    Right,
    Wrong,
    /// A distance whose error exceeds `MAX_RIGHT_ERROR` of the distance, but not of the size of both meshes.
    Off,
    Crash,
    Timeout,
}

/// Judges an answer to a mode; `scale` is the size of both meshes. A refused pose is never asked about. Returns the verdict,
/// and the error of a distance as a fraction of the true one, if that is not 0, and of the size.
pub(super) fn judge(mode: &str, answer: f64, truth: &Truth, scale: f64) -> (Verdict, [Option<f64>; 2]) {
    let (contacts, length) = match *truth {
        Truth::Touching { contacts } => (contacts, 0.0),
        Truth::Apart(length) => (0, length.floor()),
        Truth::Refused { .. } => (0, f64::NAN),
    };
    let plain = |right: bool| (if right { Verdict::Right } else { Verdict::Wrong }, [None; 2]);
    match mode {
        "collide" => plain((answer > 0.0) == (contacts > 0)),
        "contacts" => plain(answer == contacts as f64),
        _ => {
            let error = (answer - length).abs();
            // This comparison is false for NaN.
            let near = |part: f64| error <= MAX_RIGHT_ERROR * part;
            let verdict = match (near(length), near(scale)) {
                (true, _) => Verdict::Right,
                (false, true) => Verdict::Off,
                (false, false) => Verdict::Wrong,
            };
            (verdict, [(length > 0.0).then_some(error / length), Some(error / scale)])
        }
    }
}

/// Returns the size of both meshes: the longest side of the box around A and the placed B.
pub(super) fn span(a: &[Triangle], b: &[Triangle], pose: &[f64; 12]) -> f64 {
    let place = |p: [f64; 3]| {
        [0, 1, 2]
            .map(|i| pose[4 * i] * p[0] + pose[4 * i + 1] * p[1] + pose[4 * i + 2] * p[2] + pose[4 * i + 3])
    };
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in a.iter().flatten().copied().chain(b.iter().flatten().map(|&p| place(p))) {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::hard_cases::Length;

    #[test]
    fn distances_are_judged_by_themselves_and_by_size() {
        let truth = Truth::Apart(Length::Exactly(1e-3, ""));
        let verdict = |answer: f64| judge("distance", answer, &truth, 10.0).0;
        assert_eq!(verdict(1e-3), Verdict::Right);
        assert_eq!(verdict(1e-3 + 5e-10), Verdict::Right);
        assert_eq!(verdict(1e-3 + 5e-9), Verdict::Off);
        assert_eq!(verdict(2e-3), Verdict::Wrong);
        assert_eq!(verdict(f64::NAN), Verdict::Wrong);
        let touching = Truth::Touching { contacts: 2 };
        assert_eq!(judge("distance", 1e-9, &touching, 1.0).0, Verdict::Off);
        assert_eq!(judge("distance", 0.0, &touching, 1.0).0, Verdict::Right);
        assert_eq!(judge("collide", 1.0, &touching, 1.0).0, Verdict::Right);
        assert_eq!(judge("contacts", 1.0, &touching, 1.0).0, Verdict::Wrong);
        assert_eq!(judge("collide", 1.0, &truth, 1.0).0, Verdict::Wrong);
    }
}
