//! Self-contained HTML pages that show meshes, motions, scenes, clashes and robots, and run cbvh in the browser.
//!
//! A page is one file. It needs no network and no server, and opens from a disk. It holds the files that it shows, the program
//! that draws them, and the query library itself as WebAssembly, so that what it answers is what the library answers.
//!
//! ```text
//! page.html (TypeScript and WebAssembly, built in bvh-query/web) ──┐
//! shapes ──> files, each once (files) ────────────────────────────┼──> page ──> any writer
//! poses, motions, scenes, clashes, robots ──> JSON (content, json) ┘
//! ```
//!
//! [`Page`] has an example. The command `cbvh view` and the method `Mesh.view` of the Python module make such pages.
#![forbid(unsafe_code)]

mod content;
mod error;
mod files;
mod json;
mod page;
mod robot;
mod scene;

pub use error::PageError;
pub use files::Named;
pub use page::{Page, Placed, PlacedClash};
pub use robot::RobotLine;
pub use scene::Frames;

/// The most bytes of a file in a page. A browser holds the packed text of a file as one string, of at most 2^29 - 24 characters
/// in V8. Base64 makes four characters of three bytes. Bytes that cannot be compressed become more by less than a hundredth.
pub const MAX_FILE_BYTES: u64 = 380 << 20;

/// The bytes of all files of a page up to which most browsers and most machines show it. A browser needs about five times as
/// much: for the page, the text, the unpacked file, and what is drawn.
pub const DEFAULT_MAX_BYTES: u64 = 256 << 20;

/// Compiles the examples of the crate's README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
