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

    /// Warns of what was left out: "face" and "faces", say, and what is wrong with them.
    pub(crate) fn tell(&self, warnings: &Warnings, [one, many]: [&str; 2], which: &str) {
        match (self.count, self.first) {
            (1, Some(place)) => warnings.add(place, format!("left out a {one} {which}")),
            (count, Some(place)) => {
                warnings.add(place, format!("left out {count} {many} {which}, of which this is the first"));
            }
            (_, None) => {}
        }
    }
}

/// Warns of the faces that have no triangle: points and lines.
pub(crate) fn tell_short_faces(short: &LeftOut, warnings: &Warnings) {
    short.tell(warnings, ["face", "faces"], "of fewer than three corners");
}
