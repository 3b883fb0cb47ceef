//! Exact collision and distance queries between `.cbvh` meshes.
#![deny(unsafe_code)]

mod bvh;
mod error;
mod isa;
mod leaf;
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
mod mapped;
mod narrow;
mod pose;
mod query;
mod traverse;

pub use bvh::{Bvh, Shape};
pub use error::{OpenError, QueryError};
pub use isa::{Backend, BackendError};
pub use pose::{Pose, PoseError};
pub use query::{Contact, Distance, DistanceOptions, Querier, QueryStats};
