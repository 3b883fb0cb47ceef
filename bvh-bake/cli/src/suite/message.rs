//! The lines that the suite sends: a greeting, a mesh, or a question.

use serde::Deserialize;

/// A line.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Message {
    /// The first line.
    Hello(Hello),
    /// A mesh, which later lines name.
    Mesh(MeshMessage),
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
