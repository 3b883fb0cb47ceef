//! Stands in for `browser` on WebAssembly, which has no temporary folder and starts no programs.

use crate::console::Failure;
use cbvh_view::Page;
use std::path::PathBuf;

/// Refuses to show a page.
pub(super) fn show(_: &Page) -> Result<PathBuf, Failure> {
    Err(Failure::usage("expected -o PAGE.html, because no browser can be started from here, found none"))
}
