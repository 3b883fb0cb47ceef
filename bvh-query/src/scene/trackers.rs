//! What is remembered of each pair between questions, where instances move little.

use crate::query::tracker::Tracker;
use std::collections::HashMap;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How many trackers are kept for pairs that are no longer asked about, before they are let go.
const MOST_IDLE: usize = 1024;

/// How many pairs of a question have trackers at most: some 20 MiB of them.
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
    /// Begins a question. Lets go of pairs that the last one was not about, if they are many.
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
