//! What a function returns when it fails: a status for the program, and a message for a person.

use bvh_bake::{BakeError, ReadError};
use bvh_query::{MotionError, OpenError, PoseError, QueryError, SceneError};
use std::fmt::Display;

/// The numbers of `cbvh_status`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum Status {
    Ok = 0,
    InvalidArgument = 1,
    InvalidHandle = 2,
    Busy = 3,
    NotFound = 4,
    BufferTooSmall = 5,
    System = 6,
    Damaged = 7,
    Limit = 8,
    BakeFailed = 9,
    CallbackFailed = 10,
    Internal = 11,
}

/// Why a function fails.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(status: Status, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    /// An argument that is not what it has to be.
    pub(crate) fn argument(name: impl Display, expected: impl Display, found: impl Display) -> Self {
        Self::new(Status::InvalidArgument, format!("{name}: expected {expected}, found {found}"))
    }

    /// Says in which argument something was found.
    pub(crate) fn at(self, place: impl Display) -> Self {
        Self { message: format!("{place}: {}", self.message), ..self }
    }
}

/// The status of a question that has no answer.
fn of_query(error: &QueryError) -> Status {
    match error {
        QueryError::Damaged(_) => Status::Damaged,
        QueryError::File { .. } => Status::System,
        QueryError::Budget { .. } => Status::Limit,
        _ => Status::InvalidArgument,
    }
}

fn of_scene(error: &SceneError) -> Status {
    match error {
        SceneError::Pair { source, .. } | SceneError::Instance { source, .. } | SceneError::Query(source) => {
            of_query(source)
        }
        SceneError::NoInstance(_) => Status::NotFound,
        _ => Status::InvalidArgument,
    }
}

fn of_open(error: &OpenError) -> Status {
    if matches!(error, OpenError::Io { .. }) { Status::System } else { Status::Damaged }
}

impl From<QueryError> for Failure {
    fn from(error: QueryError) -> Self {
        Self::new(of_query(&error), error.to_string())
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::new(of_scene(&error), error.to_string())
    }
}

impl From<OpenError> for Failure {
    fn from(error: OpenError) -> Self {
        Self::new(of_open(&error), error.to_string())
    }
}

impl From<PoseError> for Failure {
    fn from(error: PoseError) -> Self {
        Self::new(Status::InvalidArgument, error.to_string())
    }
}

impl From<MotionError> for Failure {
    fn from(error: MotionError) -> Self {
        Self::new(Status::InvalidArgument, error.to_string())
    }
}

impl From<BakeError> for Failure {
    fn from(error: BakeError) -> Self {
        let status = match &error {
            BakeError::Write { .. } | BakeError::Scratch { .. } | BakeError::Room { .. } => Status::System,
            BakeError::Read(ReadError::Io { .. }) => Status::System,
            BakeError::Read(ReadError::Limit { .. }) => Status::Limit,
            BakeError::Memory { .. } | BakeError::Limit(_) => Status::Limit,
            BakeError::Unproved(_) => Status::Internal,
            _ => Status::BakeFailed,
        };
        Self::new(status, error.to_string())
    }
}
