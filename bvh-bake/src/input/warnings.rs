//! Collects what a reader did with a file that its author may not expect, such as bytes or points that it left out.

use crate::error::{Place, quoted};
use std::cell::RefCell;
use std::path::Path;

/// The warnings of one file. A reader warns once of each kind of thing, and counts the rest, so that their number is bounded.
#[derive(Default)]
pub(crate) struct Warnings(RefCell<Vec<(Place, String)>>);

impl Warnings {
    /// Adds a warning, in one line without the names of the file and the place. A file that is read twice warns once.
    pub(crate) fn add(&self, place: Place, what: impl Into<String>) {
        let (warning, mut all) = ((place, what.into()), self.0.borrow_mut());
        if !all.contains(&warning) {
            all.push(warning);
        }
    }

    /// Takes the warnings out, each as one line that names the file and the place.
    pub(crate) fn take(&self, path: &Path) -> Vec<String> {
        let line = |(place, what): (Place, String)| format!("{}: {place}{what}", quoted(path));
        self.0.take().into_iter().map(line).collect()
    }
}
