//! `cbvh query`: runs queries about two meshes, for files of poses or for one pose.

use crate::asking::files::{self, read_all, read_poses, refuse_overwriting, write_file};
use crate::asking::mesh::{self, LoadedMesh};
use crate::asking::{self, AskingArguments, Session};
use crate::console::{Failure, Record, counted, record, significant};
use crate::open_edges;
use crate::options::not_negative;
use bvh_format::checksum::Hasher;
use bvh_query::{
    Contact, Distance, DistanceOptions, Penetration, PenetrationOptions, Pose, Querier, QueryError, Relation,
    Shape, SignedDistance,
};
use clap::{Args, ValueEnum};
use std::ops::ControlFlow;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh query a.cbvh b.cbvh poses.txt --mode collide > results.txt
  cbvh query a.obj b.obj near.txt,far.txt --mode distance --json
  cbvh query bin.cbvh part.cbvh poses.txt --mode relation
  cbvh query a.cbvh b.cbvh --mode distance --pose \"1 0 0 2  0 1 0 0  0 0 1 0\" --witness w.obj

Each line of a pose file has 12 numbers: the rows of the 3 by 4 matrix that places B in the frame of A. The first three \
numbers of a row are the rotation and the fourth is the translation, in mesh units. # starts a comment.

One result is printed per line, in the order of the poses: collide and within 0 or 1, contacts the number of pairs of \
triangles, distance the distance in mesh units (17 digits), relation a number, penetration and signed five numbers. The result for a single pose is printed as \
text for a person.

collide is about surfaces: a mesh that is inside another without touching it does not collide. relation is 0 touching, \
1 apart, 2 A inside B, 3 B inside A, 4 mixed (some parts of a mesh are inside the other and some are not, or some of each \
mesh are), or 5 undefined, because a mesh that might contain the other is not closed.

penetration is how deep closed meshes overlap: a lower and an upper bound of the length of the shortest translation of B after \
which the insides have nothing in common, and such a translation of the upper length, in the frame of A. All are 0 for meshes \
that are apart, and nan if a mesh is not closed. signed is the distance of meshes that are apart and minus that depth of others, \
between two bounds, and then the translation, 0 where they are apart. Where a mesh encloses nothing, it is never below 0.

--json prints one object per pose: pose, its number in the file, from 0; poses, the name of the file, if there are several; \
and collide, within (true or false), relation, contacts and pairs (the triangles), lower, upper, translation, point and radii (what \
proves lower: a ball about the point in each mesh, unless more is known of convex parts, where radii are 0), for signed also normal (the way of B out of A) and \
signed (false if a mesh encloses nothing), or distance, lower, upper, point_a, \
point_b, object_a, triangle_a, object_b, triangle_b. The true distance lies between lower and upper, and points are in the \
frame of A. If a file has moved vertices, given_lower and given_upper are bounds for the meshes that were given.

--bench prints one object per file: the query, the times, positives (all results of relation but 1 and 5) \
and answers_xxh3, a hash of the results, which is the same for every --isa and --jobs. It is null if --budget cut the run \
short, or if --rel-err or --abs-err allow several results. --out writes the lines, each with its nanoseconds; %s stands for the name of the file.";

/// What `query` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct QueryArguments {
    /// The first mesh: a .cbvh file, or a mesh file that is baked in memory first
    a: PathBuf,
    /// The second mesh, which the poses place
    b: PathBuf,
    /// Pose files, separated by commas. Without them, both meshes are in one frame
    #[arg(value_name = "POSES[,POSES...]", conflicts_with = "one")]
    poses: Option<String>,
    /// The query
    #[arg(long, value_enum, default_value = "collide")]
    mode: Mode,
    /// With --mode within: the distance to compare with, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true)]
    within: Option<f64>,
    /// With --mode distance: the result may exceed the least distance by this fraction of it
    #[arg(long, value_name = "R", value_parser = not_negative, allow_negative_numbers = true)]
    rel_err: Option<f64>,
    /// With --mode distance: the result may exceed the least distance by this length, in mesh units
    #[arg(long, value_name = "E", value_parser = not_negative, allow_negative_numbers = true)]
    abs_err: Option<f64>,
    #[command(flatten)]
    asking: AskingArguments,
    /// Query one pose, given as 12 numbers, and print the result for a person
    #[arg(id = "one", long = "pose", value_name = "12 NUMBERS", allow_hyphen_values = true, conflicts_with_all = asking::OF_FILES)]
    pose: Option<String>,
    /// With --mode distance about one pose: write both closest triangles and the segment between them as OBJ
    #[arg(long, value_name = "OBJ")]
    witness: Option<PathBuf>,
}

/// A question about two meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Do they touch? This is about surfaces: a mesh inside another does not touch it; relation finds it
    Collide,
    /// How many pairs of triangles touch?
    Contacts,
    /// How far apart are they?
    Distance,
    /// Are they at most --within apart?
    Within,
    /// Do they touch and, if not, is one inside the other?
    Relation,
    /// How deep do they overlap, and which translation of B ends that?
    Penetration,
    /// How far apart are they or, below zero, how deep do they overlap?
    Signed,
}

/// Answers the question about pose files or about one pose.
pub(crate) fn run(arguments: &QueryArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.asking.run.isa)?;
    let question = Question::new(arguments)?;
    let what = (backend, ["pose", "poses"], asking::mode_name(&question.mode), question.is_exact());
    let session = || Session::load(&arguments.asking, what, &arguments.a, Some(&arguments.b));
    let meshes = [&arguments.a, &arguments.b];
    if let Some(files) = &arguments.poses {
        let files = read_all(Some(files), "pose files", &arguments.asking, &meshes, read_poses)?;
        let session = session()?;
        return session.ask_files(&files, |querier, pose| question.ask(querier, session.shapes(), pose));
    }
    arguments.asking.require_no_files()?;
    refuse_overwriting(&arguments.witness, meshes)?;
    let pose = arguments.pose.as_deref().map_or(Ok(Pose::IDENTITY), files::one_pose)?;
    let session = session()?;
    let answer = session.ask(|querier| question.ask(querier, session.shapes(), &pose))?;
    if let (Some(path), Answer::Distance(distance, _)) = (&arguments.witness, &answer) {
        write_file(path, &mesh::obj(session.meshes(), &pose, distance)?)?;
    }
    session.tell_one(&answer, &question.describe(session.meshes(), &answer))
}

/// The most contacts that are listed for a person; the others are only counted.
const MAX_LISTED: usize = 10;

/// A question with its parameters.
#[derive(Debug, Clone, Copy)]
struct Question {
    mode: Mode,
    /// The distance of `Mode::Within`, in mesh units.
    within: f64,
    errors: DistanceOptions,
    /// Whether answers are told in full: contacts are listed, not only counted.
    list: bool,
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
enum Answer {
    /// Whether the meshes touch.
    Collide(bool),
    /// Whether they are near enough.
    Within(bool),
    /// The number of pairs of triangles in contact, and the pairs if they are to be listed.
    Contacts(u64, Vec<Contact>),
    /// How far apart they are, and how far vertices moved before they were stored.
    Distance(Distance, [f64; 2]),
    /// How they lie.
    Relation(Relation),
    /// How deep they overlap; none if a mesh is not closed.
    Penetration(Option<Penetration>),
    /// How far apart they are or how deep they overlap.
    Signed(SignedDistance),
}

impl Question {
    /// Takes the question from the command line, and refuses options that do not belong to its mode.
    fn new(arguments: &QueryArguments) -> Result<Self, Failure> {
        let mode = arguments.mode;
        let within = asking::within(mode == Mode::Within, arguments.within)?;
        if (arguments.rel_err.is_some() || arguments.abs_err.is_some()) && mode != Mode::Distance {
            return Err(Failure::usage("--rel-err and --abs-err require --mode distance"));
        }
        if arguments.witness.is_some() && (arguments.poses.is_some() || mode != Mode::Distance) {
            let what = "--witness requires --mode distance and one pose, --pose instead of files";
            return Err(Failure::usage(what));
        }
        let [rel_err, abs_err] = [arguments.rel_err, arguments.abs_err].map(Option::unwrap_or_default);
        let errors = DistanceOptions::new().rel_err(rel_err).abs_err(abs_err);
        let list = arguments.asking.run.json || arguments.poses.is_none();
        Ok(Self { mode, within, errors, list })
    }

    /// Returns whether the answer is the same on every backend and with every number of threads.
    fn is_exact(&self) -> bool {
        self.errors == DistanceOptions::default()
    }

    /// Asks the question about one pose.
    #[inline]
    fn ask(&self, querier: &mut Querier, [a, b]: [Shape<'_>; 2], pose: &Pose) -> Result<Answer, QueryError> {
        Ok(match self.mode {
            Mode::Collide => Answer::Collide(querier.collide(a, b, pose)?),
            Mode::Contacts if self.list => {
                let contacts = querier.contacts(a, b, pose)?;
                Answer::Contacts(contacts.len() as u64, contacts)
            }
            Mode::Contacts => {
                let count = querier.visit_contacts(a, b, pose, |_| ControlFlow::Continue(()))?;
                Answer::Contacts(count, Vec::new())
            }
            Mode::Distance => {
                let moves = if self.list { [a, b].map(|shape| shape.max_move()) } else { [0.0; 2] };
                Answer::Distance(querier.distance_with(a, b, pose, &self.errors)?, moves)
            }
            Mode::Within => Answer::Within(querier.within(a, b, pose, self.within)?),
            Mode::Relation => Answer::Relation(querier.relation(a, b, pose)?),
            Mode::Signed => {
                Answer::Signed(querier.signed_distance(a, b, pose, &PenetrationOptions::default())?)
            }
            Mode::Penetration => match querier.penetration(a, b, pose, &PenetrationOptions::default()) {
                Err(QueryError::NotClosed { .. }) => Answer::Penetration(None),
                answer => Answer::Penetration(Some(answer?)),
            },
        })
    }

    /// Returns an answer for a person, with the closest points and triangles or with the first contacts.
    fn describe(&self, [mesh_a, mesh_b]: [&LoadedMesh; 2], answer: &Answer) -> String {
        let why = || open_edges::why(&[("A", mesh_a.shape()), ("B", mesh_b.shape())]);
        match answer {
            Answer::Collide(true) => "the meshes touch\n".to_owned(),
            Answer::Collide(false) => "the meshes do not touch\n".to_owned(),
            Answer::Within(within) => {
                let how = if *within { "at most" } else { "more than" };
                format!("the meshes are {how} {:?} apart\n", self.within)
            }
            Answer::Contacts(count, contacts) => {
                let mut text = format!("{} of triangles in contact\n", counted(*count, "pair"));
                for contact in contacts.iter().take(MAX_LISTED) {
                    let a = mesh::name(mesh_a, contact.object_a, contact.triangle_a);
                    let b = mesh::name(mesh_b, contact.object_b, contact.triangle_b);
                    text.push_str(&format!("  A: {a}  B: {b}\n"));
                }
                if contacts.len() > MAX_LISTED {
                    text.push_str(&format!("  and {} more\n", contacts.len() - MAX_LISTED));
                }
                text
            }
            Answer::Distance(distance, moves) => mesh::describe([mesh_a, mesh_b], distance, *moves),
            Answer::Relation(Relation::Undefined) => format!("{}{}\n", in_words(Relation::Undefined), why()),
            Answer::Relation(relation) => format!("{}\n", in_words(*relation)),
            Answer::Signed(of) => {
                let [x, y, z] = of.translation;
                let way = if of.lower < 0.0 {
                    format!("moving B by {x:?} {y:?} {z:?} makes the insides disjoint\n")
                } else if of.is_signed {
                    String::new()
                } else {
                    format!("a mesh encloses nothing, so that there is no depth{}\n", why())
                };
                format!("signed distance from {:?} to {:?}\n{way}", of.lower, of.upper)
            }
            Answer::Penetration(None) => format!("undefined, because a mesh is not closed{}\n", why()),
            Answer::Penetration(Some(of)) => {
                let [x, y, z] = of.translation;
                format!(
                    "depth from {:?} to {:?}\nmoving B by {x:?} {y:?} {z:?} makes the insides disjoint\n",
                    of.lower, of.upper
                )
            }
        }
    }
}

impl asking::Answer for Answer {
    /// Returns true for contact, for a yes to `within`, and if any part of a mesh is inside the other.
    fn is_positive(&self) -> bool {
        match self {
            Self::Distance(of, _) => of.distance <= 0.0,
            Self::Signed(of) => of.upper < 0.0,
            Self::Relation(relation) => !matches!(relation, Relation::Apart | Relation::Undefined),
            _ => self.value() > 0.0,
        }
    }

    fn value(&self) -> f64 {
        match self {
            Self::Collide(flag) | Self::Within(flag) => f64::from(u8::from(*flag)),
            Self::Contacts(count, _) => *count as f64,
            Self::Distance(of, _) => of.distance,
            Self::Signed(of) => of.lower,
            Self::Relation(relation) => f64::from(*relation as u8),
            Self::Penetration(depth) => depth.map_or(0.0, |of| of.lower),
        }
    }

    fn line(&self) -> String {
        match self {
            Self::Penetration(None) => ["nan"; 5].join(" "),
            Self::Signed(SignedDistance { lower, upper, translation: [x, y, z], .. })
            | Self::Penetration(Some(Penetration { lower, upper, translation: [x, y, z], .. })) => {
                [lower, upper, x, y, z].map(|number| significant(*number)).join(" ")
            }
            _ => significant(self.value()),
        }
    }

    fn json(&self) -> Record {
        match self {
            Self::Collide(flag) => record! { collide: flag },
            Self::Within(flag) => record! { within: flag },
            Self::Contacts(count, contacts) => {
                let pairs = contacts.iter().map(|of| {
                    record! {
                        object_a: of.object_a, triangle_a: of.triangle_a, object_b: of.object_b,
                        triangle_b: of.triangle_b,
                    }
                });
                record! { contacts: count, pairs: pairs.collect::<Vec<_>>() }
            }
            Self::Distance(distance, moves) => {
                let given = mesh::as_given(*moves, distance);
                let given = given.map(|[lower, upper]| record! { given_lower: lower, given_upper: upper });
                asking::distance_json(distance).with(given)
            }
            Self::Relation(relation) => record! { relation: *relation as u8 },
            Self::Signed(of) => record! {
                lower: of.lower, upper: of.upper, translation: of.translation, normal: of.normal, point_a: of.point_a,
                point_b: of.point_b, signed: of.is_signed,
            },
            Self::Penetration(None) => record! { penetration: None::<f64> },
            Self::Penetration(Some(of)) => record! {
                lower: of.lower, upper: of.upper, translation: of.translation, point: of.point, radii: of.radii,
            },
        }
    }

    /// Hashes a byte for yes or no and for a relation, a `u64` for a count, the bits of a distance.
    fn hash(&self, hasher: &mut Hasher) {
        match self {
            Self::Collide(flag) | Self::Within(flag) => hasher.update(&[u8::from(*flag)]),
            Self::Contacts(count, _) => hasher.update(&count.to_le_bytes()),
            Self::Distance(of, _) => hasher.update(&of.distance.to_bits().to_le_bytes()),
            Self::Relation(relation) => hasher.update(&[*relation as u8]),
            Self::Signed(SignedDistance { lower, upper, translation: [x, y, z], .. })
            | Self::Penetration(Some(Penetration { lower, upper, translation: [x, y, z], .. })) => {
                hash_numbers(hasher, &[*lower, *upper, *x, *y, *z]);
            }
            Self::Penetration(None) => hash_numbers(hasher, &[f64::NAN; 5]),
        }
    }
}

fn hash_numbers(hasher: &mut Hasher, numbers: &[f64]) {
    numbers.iter().for_each(|number| hasher.update(&number.to_bits().to_le_bytes()));
}

/// Returns a relation in words.
fn in_words(relation: Relation) -> &'static str {
    match relation {
        Relation::Touching => "touching",
        Relation::Apart => "apart",
        Relation::AInB => "A inside B",
        Relation::BInA => "B inside A",
        Relation::Mixed => "not touching, some parts inside the other mesh and some not",
        Relation::Undefined => "not touching, undefined because a mesh is not closed",
    }
}
