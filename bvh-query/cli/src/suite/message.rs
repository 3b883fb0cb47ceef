//! The lines that the suite sends: a greeting, a mesh, or a question.

use serde::Deserialize;
use std::path::PathBuf;

/// A line.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Message {
    /// The first line.
    Hello(Hello),
    /// A mesh, which later lines name.
    Mesh(MeshMessage),
    /// A mesh in a file, which later lines name.
    File(MeshFile),
    /// Instances of meshes, which later lines name together.
    Field(FieldMessage),
    /// A set of rays or points in a file, which later lines name.
    Probes(ProbesMessage),
    /// A question about many poses of meshes that were sent, to be timed.
    Timed(TimedQuestion),
    /// A question about all rays or points of a set, to be timed.
    Probed(ProbedQuestion),
    /// A question about meshes that were sent.
    Question(Box<Question>),
}

/// The greeting, with the version of the protocol.
#[derive(Debug, Deserialize)]
pub(super) struct Hello {
    pub(super) hello: u32,
}

/// What of a question is read if its other fields are not as they should be.
#[derive(Debug, Deserialize)]
pub(super) struct Numbered {
    pub(super) id: u64,
}

/// A mesh and its name.
#[derive(Debug, Deserialize)]
pub(super) struct MeshMessage {
    pub(super) mesh: String,
    pub(super) vertices: Vec<[Number; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// A mesh whose corners and triangles are in a file, as little-endian `f32` and `u32`.
#[derive(Debug, Deserialize)]
pub(super) struct MeshFile {
    pub(super) mesh: String,
    pub(super) file: PathBuf,
    pub(super) corners: usize,
    pub(super) triangles: usize,
}

/// Instances: the number of each mesh in the list, and its pose.
#[derive(Debug, Deserialize)]
pub(super) struct FieldMessage {
    pub(super) field: String,
    pub(super) meshes: Vec<String>,
    pub(super) instances: Vec<(usize, [f64; 12])>,
}

/// A question about many poses.
#[derive(Debug, Deserialize)]
pub(super) struct TimedQuestion {
    pub(super) id: u64,
    pub(super) ask: String,
    pub(super) a: String,
    pub(super) b: String,
    pub(super) poses: Vec<[f64; 12]>,
    /// No pose is begun after so many seconds.
    pub(super) budget: f64,
    /// All poses in one call, on all cores.
    #[serde(default)]
    pub(super) batch: bool,
}

/// Rays or points, whose numbers are in a file as little-endian `f32`.
#[derive(Debug, Deserialize)]
pub(super) struct ProbesMessage {
    pub(super) probes: String,
    pub(super) file: PathBuf,
    pub(super) count: usize,
    /// 3 for points. 6 for rays: the origin, then the direction.
    pub(super) numbers: usize,
}

/// A question about a set of rays or points.
#[derive(Debug, Deserialize)]
pub(super) struct ProbedQuestion {
    pub(super) id: u64,
    pub(super) ask: String,
    pub(super) a: String,
    pub(super) probes: String,
    /// No ray or point is begun after so many seconds.
    pub(super) budget: f64,
    /// All in one call, on all cores.
    #[serde(default)]
    pub(super) batch: bool,
}

/// A question. Which of the fields it has depends on what it asks.
#[derive(Debug, Deserialize)]
pub(super) struct Question {
    pub(super) id: u64,
    pub(super) ask: String,
    pub(super) a: String,
    pub(super) b: Option<String>,
    pub(super) pose: Option<[Number; 12]>,
    pub(super) start: Option<[Number; 12]>,
    pub(super) end: Option<[Number; 12]>,
    pub(super) within: Option<Number>,
    pub(super) point: Option<[Number; 3]>,
    pub(super) origin: Option<[Number; 3]>,
    pub(super) direction: Option<[Number; 3]>,
    pub(super) from: Option<[Number; 3]>,
    pub(super) to: Option<[Number; 3]>,
}

/// A number. JSON has no NaN and no infinity, so these are sent as text.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(super) enum Number {
    /// A number of JSON.
    Finite(f64),
    /// `"nan"`, `"inf"` or `"-inf"`.
    Special(Special),
}

/// What is no number of JSON.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) enum Special {
    #[serde(rename = "nan")]
    NaN,
    #[serde(rename = "inf")]
    Infinity,
    #[serde(rename = "-inf")]
    MinusInfinity,
}

impl From<Number> for f64 {
    fn from(number: Number) -> Self {
        match number {
            Number::Finite(value) => value,
            Number::Special(Special::NaN) => Self::NAN,
            Number::Special(Special::Infinity) => Self::INFINITY,
            Number::Special(Special::MinusInfinity) => Self::NEG_INFINITY,
        }
    }
}
