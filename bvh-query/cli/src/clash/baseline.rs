//! The answer of an earlier run, with which clashes are compared.

use super::found::{Found, Status};
use crate::asking::files::read_text;
use crate::console::{Failure, Record, record};
use bvh_query::ClashClass;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;

/// What the comparison needs of an earlier run.
#[derive(Deserialize)]
struct Run {
    clashes: Vec<Old>,
}

/// A clash of an earlier run.
#[derive(Deserialize)]
pub(super) struct Old {
    id: String,
    pub(super) class: String,
    pub(super) a: String,
    pub(super) b: String,
    distance: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
}

/// The clashes of an earlier run by their ids.
pub(super) struct Baseline(HashMap<String, Old>);

impl Baseline {
    /// Reads what `--json` has printed.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let wrong = |place: &str, found: &str| {
            let expected = "expected what cbvh clash --json has printed";
            Failure::invalid(
                path,
                format_args!("{place}: {expected}, found {found}; name such a file, or leave out --baseline"),
            )
        };
        let run: Run = serde_json::from_slice(&read_text(path)?).map_err(|error| {
            let text = error.to_string();
            let what = text.split(" at line ").next().unwrap_or(&text);
            wrong(&format!("line {}, column {}", error.line(), error.column()), what)
        })?;
        let mut by_id = HashMap::new();
        for (number, old) in run.clashes.into_iter().enumerate() {
            let place = |field: &str| format!("clashes[{number}].{field}");
            if !ClashClass::ALL.iter().any(|class| class.name() == old.class) {
                return Err(wrong(&place("class"), &format!("{:?}", old.class)));
            }
            if let Some(twice) = by_id.insert(old.id.clone(), old) {
                return Err(wrong(&place("id"), &format!("{:?} again", twice.id)));
            }
        }
        Ok(Self(by_id))
    }

    /// Says of each clash whether it is new, changed or the same, and returns those that are gone, by their names.
    pub(super) fn compare(mut self, found: &mut [Found<'_>], tolerance: f64) -> Vec<Old> {
        for clash in found {
            clash.status = Some(match self.0.remove(&clash.id()) {
                None => Status::New,
                Some(old) if old.is_same(clash, tolerance) => Status::Same,
                Some(_) => Status::Changed,
            });
        }
        let mut gone: Vec<Old> = self.0.into_values().collect();
        gone.sort_by(|one, other| (&one.a, &one.b).cmp(&(&other.a, &other.b)));
        gone
    }
}

impl Old {
    fn is_same(&self, clash: &Found<'_>, tolerance: f64) -> bool {
        let pairs = [
            (self.distance, clash.distance),
            (self.lower, clash.depth.map(|[lower, _]| lower)),
            (self.upper, clash.depth.map(|[_, upper]| upper)),
        ];
        let agree = |(old, new): (Option<f64>, Option<f64>)| match (old, new) {
            (Some(old), Some(new)) => (old - new).abs() <= tolerance,
            (old, new) => old.is_none() && new.is_none(),
        };
        // A run without magnitudes does not divide overlapping parts.
        let is_same_class = ClashClass::ALL
            .into_iter()
            .any(|class| class.name() == self.class && clash.is_of(class))
            || clash.class == ClashClass::Overlapping && ["piercing", "protruding"].contains(&&*self.class);
        is_same_class && pairs.into_iter().all(agree)
    }

    /// Returns the clash as it was.
    pub(super) fn json(&self) -> Record {
        let Self { id, class, a, b, distance, lower, upper } = self;
        record! { id: id, class: class, a: a, b: b, distance: distance, lower: lower, upper: upper, status: "gone" }
    }
}
