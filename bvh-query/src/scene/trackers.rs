//! Trackers for the pairs of a scene, which save time if instances move little between questions.

use crate::query::tracker::Tracker;
use std::collections::HashMap;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The most trackers that are kept for pairs about which no question is asked any more.
const MOST_IDLE: usize = 1024;

/// The most pairs of a question that have trackers, which take some 20 MiB.
const MOST_TRACKED: usize = 1 << 14;

/// A tracker for each pair of places, in scenes that want them.
#[derive(Default)]
pub(super) struct Trackers {
    /// Whether there are any.
    pub(super) on: bool,
    /// By the places of the pair: the number of the question that was last about it, and its tracker. The threads of a
    /// question use one each.
    of: HashMap<(u32, u32), (u64, Mutex<Tracker>)>,
    questions: u64,
    /// The number of pairs that the question is about.
    asked: usize,
}

impl Clone for Trackers {
    /// Copies the setting, and remembers nothing.
    fn clone(&self) -> Self {
        Self { on: self.on, ..Self::default() }
    }
}

impl fmt::Debug for Trackers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Trackers").field("on", &self.on).field("pairs", &self.of.len()).finish()
    }
}

impl Trackers {
    /// Begins a question. Removes the trackers of pairs that the last question was not about, if there are many.
    pub(super) fn start(&mut self) {
        if !self.on {
            self.of.clear();
            return;
        }
        let last = self.questions;
        if self.of.len() > self.asked + MOST_IDLE {
            self.of.retain(|_, (asked, _)| *asked == last);
        }
        self.questions += 1;
        self.asked = 0;
    }

    /// Makes a tracker for each pair that the question is about and that has none, as long as they are not too many.
    pub(super) fn expect(&mut self, pairs: impl Iterator<Item = (u32, u32)>) {
        if !self.on {
            return;
        }
        for pair in pairs {
            if self.asked >= MOST_TRACKED {
                return;
            }
            let asked = &mut self.of.entry(pair).or_default().0;
            self.asked += usize::from(*asked != self.questions);
            *asked = self.questions;
        }
    }

    /// Returns the tracker of a pair, if there are any.
    pub(super) fn get(&self, pair: (u32, u32)) -> Option<MutexGuard<'_, Tracker>> {
        if !self.on {
            return None;
        }
        // A panic elsewhere leaves a tracker whole: whatever it remembers, its answers are right.
        let (_, tracker) = self.of.get(&pair)?;
        Some(tracker.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
