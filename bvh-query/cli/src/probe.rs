//! `cbvh probe`: runs queries about a mesh, for files of points, rays or segments, or for one of these.

use crate::asking::files::{self, numbers, read_all, read_lines};
use crate::asking::mesh::{self, LoadedMesh};
use crate::asking::{self, AskingArguments, Session};
use crate::console::{Failure, Record, record};
use crate::open_edges;
use bvh_format::checksum::Hasher;
use bvh_format::object::MAX_COORDINATE;
use bvh_query::{ClosestPoint, Querier, QueryError, Ray, RayHit, Shape, Side};
use clap::{Args, ValueEnum};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

const HELP: &str = "\
Examples:
  cbvh probe part.cbvh points.txt --mode side
  cbvh probe part.obj near.txt,far.txt --mode closest --json
  cbvh probe room.cbvh --mode ray --probe \"0 0 1.5  1 0 0\"

With --mode closest and side, each line of FILE is a point, 3 numbers. With --mode ray it is the origin and the direction of \
a ray, 6 numbers; the direction may have any length. With --mode segment it is both ends of a segment, 6 numbers. All are in \
the frame of the mesh, in mesh units. # starts a comment.

closest is the distance to the surface, whether the point is inside or outside. The surface is all triangles of the mesh: \
where parts overlap, the closest one may be inside. side is defined for meshes that are closed \
and consistently oriented; for others it is undefined, except on the surface. A ray or a segment that only touches an edge or \
a corner hits the mesh.

One result is printed per line, in the order of the file: with --mode closest the distance; with side 1 inside, 0 on \
the mesh, -1 outside, 2 undefined; with ray the parameter of the first hit in units of the direction, or -1; with segment 1 \
if it meets the mesh, 0 if not. --json prints one object per line: probe, its number in the file, from 0; probes, the \
name of the file, if there are several; distance (closest), side, hit and t (ray) or meets (segment); and of a closest point \
and of a hit lower, upper, point, object and triangle. --bench prints one object per file: the fields of cbvh query --bench \
for one mesh; positives counts points on the mesh with --mode closest, points inside it with side, rays that hit it with ray, \
and segments that meet it with segment. --out writes the lines, each with its nanoseconds; %s stands for the name of the \
file.";

/// What `probe` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ProbeArguments {
    /// The mesh: a .cbvh file, or a mesh file that is baked in memory first
    a: PathBuf,
    /// Files of points, rays or segments, separated by commas
    #[arg(value_name = "FILE[,FILE...]", required_unless_present = "one", conflicts_with = "one")]
    files: Option<String>,
    /// The query
    #[arg(long, value_enum, default_value = "closest")]
    mode: Mode,
    #[command(flatten)]
    asking: AskingArguments,
    /// Query one point, ray or segment, given as 3 or 6 numbers, and print the result for a person
    #[arg(id = "one", long = "probe", value_name = "3 OR 6 NUMBERS", allow_hyphen_values = true, conflicts_with_all = asking::OF_FILES)]
    probe: Option<String>,
}

/// A question about one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// How far is the mesh from a point?
    Closest,
    /// Is a point inside the mesh, on it or outside?
    Side,
    /// Where does a ray first hit the mesh?
    Ray,
    /// Does a segment meet the mesh?
    Segment,
}

/// Answers the question about files of points, rays or segments, or about one.
pub(crate) fn run(arguments: &ProbeArguments) -> Result<(), Failure> {
    let (mode, options) = (arguments.mode, &arguments.asking);
    let what = (asking::backend(&options.run.isa)?, ["probe", "probes"], asking::mode_name(&mode), true);
    let session = || Session::load(options, what, &arguments.a, None);
    if let Some(probe) = &arguments.probe {
        let question = files::parse_option("--probe", probe, expected(mode), |text| parse(text, mode))?;
        let session = session()?;
        let answer = session.ask(|querier| question.ask(querier, session.shapes()[0]))?;
        return session.tell_one(&answer, &answer.describe(session.meshes()[0]));
    }
    let (files, read) = (arguments.files.as_deref(), |file: &Path| read(file, mode));
    let files = read_all(files, "files of points, rays or segments", options, &[&arguments.a], read)?;
    let session = session()?;
    session.ask_files(&files, |querier, question: &Question| question.ask(querier, session.shapes()[0]))
}

/// The magnitudes that the largest component of a direction may have, as [`Ray`] defines them: 2^-500 to 2^500.
const DIRECTIONS: RangeInclusive<f64> =
    f64::from_bits((1023 - 500) << 52)..=f64::from_bits((1023 + 500) << 52);

/// A question in the frame of the mesh: a point, a ray by its origin and direction, or a segment by both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Question {
    mode: Mode,
    first: [f64; 3],
    second: [f64; 3],
}

impl Question {
    /// Asks the question.
    #[inline]
    fn ask(&self, querier: &mut Querier, shape: Shape<'_>) -> Result<Answer, QueryError> {
        let Self { mode, first, second } = *self;
        Ok(match mode {
            Mode::Closest => Answer::Closest(querier.closest_point(shape, first, f64::INFINITY)?),
            Mode::Side => Answer::Side(querier.side(shape, first)?),
            Mode::Ray => Answer::Hit(querier.first_hit(shape, &Ray::new(first, second))?),
            Mode::Segment => Answer::Meets(querier.segment_hit(shape, first, second)?),
        })
    }
}

/// Reads a file of questions. `#` starts a comment, and blank lines are skipped.
fn read(path: &Path, mode: Mode) -> Result<Vec<Question>, Failure> {
    let none = format!("{}, in at least one line, found none", expected(mode));
    read_lines(path, &none, |text| parse(text, mode)).map(files::unnumbered)
}

/// Parses a question. Returns `None` if the text is blank.
fn parse(text: &str, mode: Mode) -> Result<Option<Question>, String> {
    let is_point = matches!(mode, Mode::Closest | Mode::Side);
    let (first, second) = match numbers(text)?[..] {
        [] => return Ok(None),
        [x, y, z] if is_point => (point([x, y, z])?, [0.0; 3]),
        [x, y, z, u, v, w] if mode == Mode::Ray => (point([x, y, z])?, direction([u, v, w])?),
        [x, y, z, u, v, w] if !is_point => (point([x, y, z])?, point([u, v, w])?),
        ref other => return Err(wrong_count(mode, other.len())),
    };
    Ok(Some(Question { mode, first, second }))
}

/// Returns the form of a question, as messages state it.
fn expected(mode: Mode) -> &'static str {
    match mode {
        Mode::Closest | Mode::Side => "expected 3 numbers, a point",
        Mode::Ray => "expected 6 numbers, the origin and the direction of a ray",
        Mode::Segment => "expected 6 numbers, both ends of a segment",
    }
}

/// Guesses the meaning of a line with a wrong count of numbers, and says what to write instead.
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

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Answer {
    /// The closest point of the mesh; `None` if the mesh has no triangles.
    Closest(Option<ClosestPoint>),
    /// The side that a point is on.
    Side(Side),
    /// The first hit of a ray.
    Hit(Option<RayHit>),
    /// Whether a segment meets the mesh.
    Meets(bool),
}

impl asking::Answer for Answer {
    /// Returns true for a point on the mesh or, where the side is asked for, inside it; for a hit; and for a meeting.
    fn is_positive(&self) -> bool {
        match self {
            Self::Closest(_) => self.value() <= 0.0,
            Self::Side(side) => *side == Side::Inside,
            Self::Hit(hit) => hit.is_some(),
            Self::Meets(meets) => *meets,
        }
    }

    fn value(&self) -> f64 {
        match self {
            Self::Closest(closest) => closest.map_or(f64::INFINITY, |closest| closest.distance),
            Self::Side(side) => f64::from(*side as i8),
            Self::Hit(hit) => hit.map_or(-1.0, |hit| hit.t),
            Self::Meets(meets) => f64::from(u8::from(*meets)),
        }
    }

    fn json(&self) -> Record {
        let record = match self {
            Self::Closest(of) => record! { distance: of.map(|of| of.distance) },
            Self::Side(side) => record! { side: *side as i8 },
            Self::Hit(None) => record! { hit: false },
            Self::Hit(Some(of)) => record! { hit: true, t: of.t },
            Self::Meets(meets) => record! { meets: meets },
        };
        record.with(self.found().map(|(lower, upper, point, object, triangle)| {
            record! { lower: lower, upper: upper, point: point, object: object, triangle: triangle }
        }))
    }

    /// Hashes the bits of the value.
    fn hash(&self, hasher: &mut Hasher) {
        hasher.update(&self.value().to_bits().to_le_bytes());
    }
}

impl Answer {
    /// Returns the answer in words, with its unit.
    fn in_words(&self) -> String {
        let words = match self {
            Self::Closest(None) => "the mesh has no triangles",
            Self::Closest(Some(closest)) if closest.distance > 0.0 => {
                return format!("{:?} mesh units from the mesh", closest.distance);
            }
            Self::Closest(Some(_)) | Self::Side(Side::On) => "on the mesh",
            Self::Side(Side::Inside) => "inside the mesh",
            Self::Side(Side::Outside) => "outside the mesh",
            Self::Side(Side::Undefined) => {
                "undefined, because the mesh is not closed and consistently oriented"
            }
            Self::Hit(Some(hit)) => return format!("hits the mesh at {:?} times the direction", hit.t),
            Self::Hit(None) => "does not hit the mesh",
            Self::Meets(true) => "meets the mesh",
            Self::Meets(false) => "does not meet the mesh",
        };
        words.to_owned()
    }

    /// Returns the bounds, the point, the object and the triangle of a closest point or a hit.
    fn found(&self) -> Option<(f64, f64, [f64; 3], u32, u32)> {
        match self {
            Self::Closest(of) => of.map(|of| (of.lower, of.upper, of.point, of.object, of.triangle)),
            Self::Hit(of) => of.map(|of| (of.lower, of.upper, of.point, of.object, of.triangle)),
            _ => None,
        }
    }

    /// Returns the answer in words, with its bounds, its point and its triangle.
    fn describe(&self, mesh: &LoadedMesh) -> String {
        let found = self.found().map(|(lower, upper, point, object, triangle)| {
            let (point, triangle) = (mesh::point(point), mesh::name(mesh, object, triangle));
            format!("  certainly {lower:?} to {upper:?}\n  at {point}, {triangle}\n")
        });
        let why = match self {
            Self::Side(Side::Undefined) => open_edges::why(&[("", mesh.shape())]),
            _ => String::new(),
        };
        format!("{}{why}\n{}", self.in_words(), found.unwrap_or_default())
    }
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
