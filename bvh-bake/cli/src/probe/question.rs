//! Questions about points, rays and segments: how they are read, and how they are asked.

use super::Mode;
use super::answer::Answer;
use crate::asking::files::{self, numbers, read_lines};
use crate::console::Failure;
use bvh_format::object::MAX_COORDINATE;
use bvh_query::{Querier, QueryError, Ray, Shape};
use std::ops::RangeInclusive;
use std::path::Path;

/// The magnitudes that the largest component of a direction may have, as [`Ray`] defines them: 2^-500 to 2^500.
const DIRECTIONS: RangeInclusive<f64> =
    f64::from_bits((1023 - 500) << 52)..=f64::from_bits((1023 + 500) << 52);

/// A question in the frame of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Question {
    /// Where is the mesh closest to a point?
    Closest([f64; 3]),
    /// Which side of the mesh is a point on?
    Side([f64; 3]),
    /// What does a ray hit first?
    Ray(Ray),
    /// Does the segment between two points meet the mesh?
    Segment([[f64; 3]; 2]),
}

impl Question {
    /// Asks the question.
    #[inline]
    pub(super) fn ask(&self, querier: &mut Querier, shape: Shape<'_>) -> Result<Answer, QueryError> {
        Ok(match self {
            Self::Closest(point) => Answer::Closest(querier.closest_point(shape, *point, f64::INFINITY)?),
            Self::Side(point) => Answer::Side(querier.side(shape, *point)?),
            Self::Ray(ray) => Answer::Hit(querier.first_hit(shape, ray)?),
            Self::Segment([from, to]) => Answer::Meets(querier.meets_segment(shape, *from, *to)?),
        })
    }
}

/// Reads a file of questions. `#` starts a comment, and blank lines are skipped.
pub(super) fn read(path: &Path, mode: Mode) -> Result<Vec<Question>, Failure> {
    let none = format!("{}, in at least one line, found none", expected(mode));
    read_lines(path, &none, |text| parse(text, mode))
}

/// Parses the question of `--probe`. Commas may separate the numbers.
pub(super) fn parse_one(text: &str, mode: Mode) -> Result<Question, Failure> {
    files::parse_one("--probe", text, expected(mode), |text| parse(text, mode))
}

/// Parses a question. Returns `None` if the text is blank.
fn parse(text: &str, mode: Mode) -> Result<Option<Question>, String> {
    let question = match (mode, &numbers(text)?[..]) {
        (_, []) => return Ok(None),
        (Mode::Closest, &[x, y, z]) => Question::Closest(point([x, y, z])?),
        (Mode::Side, &[x, y, z]) => Question::Side(point([x, y, z])?),
        (Mode::Ray, &[x, y, z, u, v, w]) => Question::Ray(Ray::new(point([x, y, z])?, direction([u, v, w])?)),
        (Mode::Segment, &[x, y, z, u, v, w]) => Question::Segment([point([x, y, z])?, point([u, v, w])?]),
        (_, other) => return Err(wrong_count(mode, other.len())),
    };
    Ok(Some(question))
}

/// Returns the form of a question, as messages state it.
fn expected(mode: Mode) -> &'static str {
    match mode {
        Mode::Closest | Mode::Side => "expected 3 numbers, a point",
        Mode::Ray => "expected 6 numbers, the origin and the direction of a ray",
        Mode::Segment => "expected 6 numbers, both ends of a segment",
    }
}

/// Guesses what a line with a wrong number of numbers means, and says what to write instead.
fn wrong_count(mode: Mode, count: usize) -> String {
    let guess = match count {
        3 => "; a point? use --mode closest or --mode side",
        6 => "; a ray or a segment? use --mode ray or --mode segment",
        _ => "",
    };
    format!("{}, found {count}{guess}", expected(mode))
}

/// Refuses a point that no question may be about.
fn point(point: [f64; 3]) -> Result<[f64; 3], String> {
    match point.iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
        None => Ok(point),
        Some(found) => {
            Err(format!("expected finite coordinates of at most 2^120 mesh units, found {found:?}"))
        }
    }
}

/// Refuses a direction that no ray may have.
fn direction(direction: [f64; 3]) -> Result<[f64; 3], String> {
    let largest = direction.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    if direction.iter().all(|x| !x.is_nan()) && DIRECTIONS.contains(&largest) {
        return Ok(direction);
    }
    let [x, y, z] = direction;
    let guess = if direction == [0.0; 3] { "; a point? use --mode closest or --mode side" } else { "" };
    Err(format!(
        "expected a direction of finite numbers, the largest from 2^-500 to 2^500 in magnitude, found {x:?} {y:?} {z:?}{guess}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, to_bytes};
    use bvh_query::Bvh;

    #[test]
    fn what_the_library_refuses_is_refused_in_its_line() {
        let mesh = Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let bvh = Bvh::from_bytes(to_bytes(&mesh, &Options::default()).unwrap().0).unwrap();
        let mut querier = Querier::new().unwrap();
        let (least, most) = (*DIRECTIONS.start(), *DIRECTIONS.end());
        let inf = f64::INFINITY;
        for z in [0.0, least, least.next_down(), 1.0, -most, most.next_up(), inf, -inf, f64::NAN] {
            let asked = querier.first_hit(&bvh, &Ray::new([0.5; 3], [0.0, -0.0, z]));
            assert_eq!(direction([0.0, -0.0, z]).is_ok(), asked.is_ok(), "{z:?}");
        }
        for z in [0.0, MAX_COORDINATE, -MAX_COORDINATE, MAX_COORDINATE.next_up(), inf, f64::NAN] {
            let asked = querier.closest_point(&bvh, [0.0, 1.0, z], inf);
            assert_eq!(point([0.0, 1.0, z]).is_ok(), asked.is_ok(), "{z:?}");
        }
    }
}
