//! The WebAssembly module behind the npm package: typed arrays in, typed arrays out.
//!
//! The TypeScript in `ts/` is the API that users see: it converts arguments to the arrays that these functions take, and
//! names the parts of answers. What counts as a valid number is decided here, by the libraries. All functions run on the
//! thread of the page or worker that loaded the module. The answer to N questions is a list of arrays, one per field.
#![forbid(unsafe_code)]

mod answers;
mod arguments;
mod bake;
#[cfg(feature = "inspect")]
mod inspect;
mod mesh;
mod motions;
mod overlaps;
mod pairs;
mod paths;
mod poses;
mod probes;
mod scene;
mod scene_questions;
mod shapes;
mod time_limit;
