//! What a function returns when it fails: a status for the program, and a message for a person.

use bvh_bake::{BakeError, ReadError, ShapeError};
use bvh_query::{BackendError, OpenError, PoseError, QueryError, SceneError};
use cbvh_robot::RobotError;
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
    Stopped = 12,
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

fn of_query(error: &QueryError) -> Status {
    match error {
        QueryError::Damaged(_) => Status::Damaged,
        QueryError::File { .. } => Status::System,
        QueryError::Budget { .. } => Status::Limit,
        QueryError::Stopped => Status::Stopped,
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

fn of_bake(error: &BakeError) -> Status {
    match error {
        BakeError::Write { .. } | BakeError::Scratch { .. } | BakeError::Room { .. } => Status::System,
        BakeError::Read(ReadError::Io { .. }) => Status::System,
        BakeError::Read(ReadError::Limit { .. }) => Status::Limit,
        BakeError::Memory { .. } | BakeError::Limit(_) => Status::Limit,
        BakeError::Unproved(_) => Status::Internal,
        BakeError::Stopped => Status::Stopped,
        _ => Status::BakeFailed,
    }
}

fn of_robot(error: &RobotError) -> Status {
    match error {
        RobotError::Io { .. } | RobotError::NoMesh { .. } => Status::System,
        RobotError::Mesh { source, .. } => of_bake(source),
        RobotError::TooLong { .. } => Status::Limit,
        RobotError::Cache { source } => of_open(source),
        RobotError::Unknown { .. } => Status::NotFound,
        RobotError::Query(source) | RobotError::Pair { source, .. } | RobotError::NotSolid { source, .. } => {
            of_query(source)
        }
        _ => Status::InvalidArgument,
    }
}

macro_rules! failures {
    ($($error:ty: $status:expr),*) => { $(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::new($status(&error), error.to_string())
            }
        }
    )* };
}
failures!(QueryError: of_query, SceneError: of_scene, OpenError: of_open, BakeError: of_bake);
failures!(BackendError: |_| Status::InvalidArgument, PoseError: |_| Status::InvalidArgument);
failures!(ShapeError: |_| Status::InvalidArgument, RobotError: of_robot);
