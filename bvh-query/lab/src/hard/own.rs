//! The answers of cbvh in every profile, in both lossless encodings and on every backend.

use super::judge::span;
use crate::common::{mesh, options};
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError};
use cbvh_testkit::Triangle;
use cbvh_testkit::hard_cases::{Case, Length, Ordered, Truth};
use serde::Serialize;

/// The largest error of a distance, as a fraction of the size of both meshes. The tests of the exact phase allow the same
/// fraction of the size of the pair of triangles, which is no larger.
const ACCURACY: f64 = 1e-14;

/// The number of shares into which the layouts are divided.
const SHARES: usize = 5;

/// The answers to one order of a case.
#[derive(Default, Serialize)]
pub(super) struct Own {
    /// The error message, if the pose was refused.
    pub(super) refusal: Option<String>,
    pub(super) collide: Option<bool>,
    pub(super) contacts: Option<u64>,
    pub(super) distance: Option<f64>,
    /// The least lower end of all intervals.
    pub(super) lower: Option<f64>,
    /// The largest upper end.
    pub(super) upper: Option<f64>,
    /// The number of combinations of profile, encoding and backend that were asked.
    pub(super) asked: usize,
    /// The names of the combinations whose collide, contacts or distance differ from the first one's.
    pub(super) differ: Vec<String>,
    /// Wrong answers, one line each.
    pub(super) wrong: Vec<String>,
}

/// The answers of one combination.
#[derive(Clone, Copy, PartialEq)]
struct Answers {
    collide: bool,
    contacts: u64,
    distance: f64,
    lower: f64,
    upper: f64,
}

/// Asks in all layouts, or in one share of them.
pub(super) fn ask(case: &Case, order: &Ordered, share: Option<usize>) -> Own {
    let mut own = Own::default();
    let pose = match (Pose::from_rows(&order.pose), case.truth) {
        (Ok(pose), Truth::Touching { .. } | Truth::Apart(_)) => pose,
        (Ok(_), Truth::Refused { .. }) => {
            own.wrong.push("the pose is not refused".into());
            return own;
        }
        (Err(error), truth) => {
            let said = error.to_string();
            if !matches!(truth, Truth::Refused { words } if said.contains(words)) {
                own.wrong.push(format!("refused: {said}"));
            }
            own.refusal = Some(said);
            return own;
        }
    };
    let scale = span(&order.a, &order.b, &order.pose);
    for (number, profile) in Profile::ALL.into_iter().enumerate() {
        for (packed, encoding) in [TriangleEncoding::F32, TriangleEncoding::Packed].into_iter().enumerate() {
            if share.is_some_and(|share| (2 * number + packed) % SHARES != share % SHARES) {
                continue;
            }
            let files = [&order.a, &order.b].map(|triangles| bake(triangles, profile, encoding));
            let [a, b] = match files {
                [Ok(a), Ok(b)] => [a, b],
                [Err(error), _] | [_, Err(error)] => {
                    own.wrong.push(format!("{} {}: {error}", profile.name(), encoding.name()));
                    continue;
                }
            };
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let name = format!("{} {} {backend}", profile.name(), encoding.name());
                let mut querier = Querier::with_backend(backend);
                own.asked += 1;
                match answers(&mut querier, &a, &b, &pose, &case.truth, scale) {
                    Ok((answers, wrong)) => own.take(&name, answers, wrong),
                    Err(error) => own.wrong.push(format!("{name}: {error}")),
                }
            }
        }
    }
    own
}

impl Own {
    fn take(&mut self, name: &str, answers: Answers, wrong: Vec<String>) {
        self.wrong.extend(wrong.into_iter().map(|wrong| format!("{name}: {wrong}")));
        let Answers { collide, contacts, distance, lower, upper } = answers;
        let same = *self.collide.get_or_insert(collide) == collide
            && *self.contacts.get_or_insert(contacts) == contacts
            && *self.distance.get_or_insert(distance) == distance;
        if !same {
            self.differ.push(format!(
                "{name}: collide {}, contacts {contacts}, distance {distance:e}",
                u8::from(collide)
            ));
        }
        self.lower = Some(self.lower.map_or(lower, |least| least.min(lower)));
        self.upper = Some(self.upper.map_or(upper, |most| most.max(upper)));
    }
}

fn bake(triangles: &[Triangle], profile: Profile, encoding: TriangleEncoding) -> Result<Bvh, String> {
    let baked = to_bytes(&mesh(triangles), &options(profile, encoding));
    let (bytes, report) = baked.map_err(|error| error.to_string())?;
    if report.file.max_vertex_rounding > 0.0 {
        return Err(format!("baking moved a vertex by {:e}", report.file.max_vertex_rounding));
    }
    Bvh::from_bytes(bytes).map_err(|error| error.to_string())
}

/// Returns all answers of a combination, and what is wrong with them.
fn answers(
    querier: &mut Querier,
    a: &Bvh,
    b: &Bvh,
    pose: &Pose,
    truth: &Truth,
    scale: f64,
) -> Result<(Answers, Vec<String>), QueryError> {
    let collide = querier.collide(a, b, pose)?;
    let contacts = querier.contacts(a, b, pose)?.len() as u64;
    let answer = querier.distance(a, b, pose)?;
    let answers =
        Answers { collide, contacts, distance: answer.distance, lower: answer.lower, upper: answer.upper };
    let mut wrong = misjudged(&answers, truth, scale);
    let Answers { distance, lower, upper, .. } = answers;
    let limits = [lower, distance, upper].into_iter().flat_map(|x| [x.next_down(), x, x.next_up()]);
    for limit in limits.filter(|limit| *limit >= 0.0 && limit.is_finite()) {
        let within = querier.within(a, b, pose, limit)?;
        // Where the truth lies between two neighbouring f64, nothing is stated about the lower one.
        let misjudged = if within { limit < truth.floor() } else { limit >= truth.ceil() };
        if misjudged {
            wrong.push(format!("within {limit:e}: {within}, distance {distance:e}"));
        }
    }
    Ok((answers, wrong))
}

fn misjudged(answers: &Answers, truth: &Truth, scale: f64) -> Vec<String> {
    let &Answers { collide, contacts, distance, lower, upper } = answers;
    let (touching, expected, length) = match *truth {
        Truth::Touching { contacts } => (true, contacts, Length::Exactly(0.0, "")),
        Truth::Apart(length) => (false, 0, length),
        Truth::Refused { .. } => return vec!["the pose is not refused".into()],
    };
    let (floor, ceil) = (length.floor(), length.ceil());
    let mut wrong = Vec::new();
    if collide != touching {
        wrong.push(format!("collide {collide}"));
    }
    if contacts != expected {
        wrong.push(format!("{contacts} contacts, expected {expected}"));
    }
    if (distance == 0.0) != touching {
        wrong.push(format!("distance {distance:e}"));
    }
    // Where the truth lies between two neighbouring f64, an end that equals one of them is on the right side.
    if !(lower <= floor && ceil <= upper && lower <= distance && distance <= upper) {
        wrong.push(format!("distance {distance:e} in [{lower:e}, {upper:e}], expected {floor:e}"));
    }
    if distance < floor - ACCURACY * scale || distance > ceil + ACCURACY * scale {
        wrong.push(format!("distance {distance:e}, expected {floor:e} to within {:e}", ACCURACY * scale));
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The library gives no wrong answers, so the test makes some.
    #[test]
    fn wrong_answers_are_noticed() {
        let right = Answers { collide: false, contacts: 0, distance: 1.0, lower: 0.75, upper: 1.25 };
        let touching = Answers { collide: true, contacts: 3, distance: 0.0, lower: 0.0, upper: 0.0 };
        let apart = Truth::Apart(Length::Exactly(1.0, ""));
        let between = Truth::Apart(Length::Above(1.0));
        let contact = Truth::Touching { contacts: 3 };
        let count = |answers: Answers, truth: &Truth| misjudged(&answers, truth, 2.0).len();
        assert_eq!([count(right, &apart), count(right, &between), count(touching, &contact)], [0; 3]);
        assert_eq!(count(Answers { collide: true, ..right }, &apart), 1);
        assert_eq!(count(Answers { contacts: 1, ..right }, &apart), 1);
        assert_eq!(count(Answers { distance: 1.0 + 1e-12, ..right }, &apart), 1);
        assert_eq!(count(Answers { lower: 1.0f64.next_up(), ..right }, &apart), 1);
        // The truth is exactly 1 in the first case and above 1 in the second, so only the first interval contains it.
        assert_eq!(count(Answers { upper: 1.0, ..right }, &apart), 0);
        assert_eq!(count(Answers { upper: 1.0, ..right }, &between), 1);
        assert_eq!(count(Answers { contacts: 2, ..touching }, &contact), 1);
        assert!(count(touching, &apart) >= 3 && count(right, &contact) >= 3);
    }
}
