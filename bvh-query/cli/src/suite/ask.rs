//! Puts one question of the suite to bvh-query.

use super::meshes::Meshes;
use super::message::{Number, Question};
use crate::console::{Record, record};
use bvh_query::{
    Bvh, Motion, MotionAnswer, MotionOptions, PenetrationOptions, Pose, Querier, QueryError, Ray, Relation,
    Side,
};

/// The questions that the command answers.
pub(super) const QUESTIONS: [&str; 12] = [
    "collide",
    "contacts",
    "distance",
    "within",
    "relation",
    "closest",
    "side",
    "ray",
    "segment",
    "motion",
    "penetration",
    "self_contacts",
];

/// Returns the fields of the answer of a question, or says why it has none.
pub(super) fn ask(question: &Question, meshes: &Meshes, querier: &mut Querier) -> Result<Record, String> {
    let a = meshes.get(&question.a)?;
    let b = || meshes.get(question.b.as_deref().unwrap_or_default());
    let pose = || pose("pose", question.pose);
    let answer = match question.ask.as_str() {
        "collide" => yes_or_no(querier.collide(a, b()?, &pose()?))?,
        "contacts" => {
            let contacts = querier.contacts(a, b()?, &pose()?).map_err(text)?;
            let pairs: Vec<[u32; 2]> =
                contacts.iter().map(|found| [found.triangle_a, found.triangle_b]).collect();
            record! { answer: pairs }
        }
        "distance" => {
            let found = querier.distance(a, b()?, &pose()?).map_err(text)?;
            record! { answer: found.distance, lower: found.lower, upper: found.upper }
        }
        "within" => yes_or_no(querier.within(a, b()?, &pose()?, number("within", question.within)?))?,
        "relation" => {
            let b = b()?;
            let found = querier.relation(a, b, &pose()?).map_err(text)?;
            let answer = match found {
                Relation::Touching => "touching",
                // The protocol leaves meshes that do not close undefined, also where bvh-query knows better: apart from their boxes.
                _ if !is_closed(a)? || !is_closed(b)? => "undefined",
                Relation::Apart => "apart",
                Relation::AInB => "a in b",
                Relation::BInA => "b in a",
                Relation::Mixed => "mixed",
                Relation::Undefined => "undefined",
            };
            record! { answer: answer }
        }
        "closest" => {
            let found =
                querier.closest_point(a, point("point", question.point)?, f64::INFINITY).map_err(text)?;
            let found = found.ok_or("expected a mesh with triangles, found none")?;
            record! { answer: found.distance, lower: found.lower, upper: found.upper, point: found.point }
        }
        "side" => {
            let answer = match querier.side(a, point("point", question.point)?).map_err(text)? {
                Side::Inside => "inside",
                Side::On => "on",
                Side::Outside => "outside",
                Side::Undefined => "undefined",
            };
            record! { answer: answer }
        }
        "ray" => {
            let ray = Ray::new(point("origin", question.origin)?, point("direction", question.direction)?);
            match querier.first_hit(a, &ray).map_err(text)? {
                None => record! { answer: false },
                Some(hit) => record! { answer: true, t: hit.t, lower: hit.lower, upper: hit.upper },
            }
        }
        "segment" => {
            yes_or_no(querier.segment_hit(a, point("from", question.from)?, point("to", question.to)?))?
        }
        "motion" => {
            let path =
                Motion::between(&self::pose("start", question.start)?, &self::pose("end", question.end)?);
            let path = path.map_err(|error| error.to_string())?;
            match querier.motion(a, b()?, &path, &MotionOptions::default()).map_err(text)? {
                MotionAnswer::Free => record! { answer: true },
                MotionAnswer::Hit { free_until, touching_at, .. } => {
                    record! { answer: false, free_until: free_until, touching_at: touching_at }
                }
                MotionAnswer::Near { free_until, .. } => record! { answer: (), free_until: free_until },
            }
        }
        "penetration" => {
            let found =
                querier.penetration(a, b()?, &pose()?, &PenetrationOptions::default()).map_err(text)?;
            record! { lower: found.lower, upper: found.upper, translation: found.translation }
        }
        "self_contacts" => {
            let contacts = querier.self_contacts(a).map_err(text)?;
            let pairs: Vec<[u32; 2]> =
                contacts.iter().map(|found| [found.triangle_a, found.triangle_b]).collect();
            record! { answer: pairs }
        }
        other => return Err(format!("expected one of {}, found {other:?}", QUESTIONS.join(", "))),
    };
    Ok(answer)
}

/// Returns whether all objects of a mesh are closed.
fn is_closed(mesh: &Bvh) -> Result<bool, String> {
    let mut all = true;
    for object in 0..mesh.objects().len() {
        all &= mesh.is_closed(object).map_err(text)?;
    }
    Ok(all)
}

fn yes_or_no(answer: Result<bool, QueryError>) -> Result<Record, String> {
    answer.map(|answer| record! { answer: answer }).map_err(text)
}

/// Returns a field that the question must have.
fn field<T>(name: &str, field: Option<T>) -> Result<T, String> {
    field.ok_or_else(|| format!("expected the field {name}, found none"))
}

fn number(name: &str, value: Option<Number>) -> Result<f64, String> {
    field(name, value).map(f64::from)
}

fn point(name: &str, value: Option<[Number; 3]>) -> Result<[f64; 3], String> {
    field(name, value).map(|point| point.map(f64::from))
}

fn pose(name: &str, value: Option<[Number; 12]>) -> Result<Pose, String> {
    Pose::from_rows(&field(name, value)?.map(f64::from)).map_err(|error| error.to_string())
}

/// Returns the message of an error.
fn text(error: QueryError) -> String {
    error.to_string()
}
