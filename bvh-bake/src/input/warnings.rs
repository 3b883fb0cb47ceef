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

/// Counts the things of one kind that a reader leaves out.
#[derive(Default)]
pub(crate) struct LeftOut {
    pub(crate) count: u64,
    first: Option<Place>,
}

impl LeftOut {
    /// Counts a thing at a place, which the warning names if it is the first.
    pub(crate) fn add(&mut self, place: Place) {
        self.add_all(1, place);
    }

    /// Counts things of which the first is at a place.
    pub(crate) fn add_all(&mut self, count: u64, place: Place) {
        self.count += count;
        if count > 0 {
            self.first.get_or_insert(place);
        }
    }

    /// Warns of what was left out, given the words for one and for several.
    pub(crate) fn tell(&self, warnings: &Warnings, words: [&str; 2]) {
        let (Some(place), Some(counted)) = (self.first, self.counted(words)) else { return };
        let first = if self.count > 1 { ", of which this is the first" } else { "" };
        warnings.add(place, format!("left out {counted}{first}"));
    }

    /// Returns how many were left out, if any were.
    pub(crate) fn counted(&self, words: [&str; 2]) -> Option<String> {
        (self.count > 0).then(|| counted(self.count, words))
    }
}

/// The words for faces without a triangle: points and lines.
pub(crate) const SHORT_FACES: [&str; 2] =
    ["face of fewer than three corners", "faces of fewer than three corners"];

/// Names a number of things by the words for one and for several.
pub(crate) fn counted(count: u64, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
