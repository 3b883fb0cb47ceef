//! Puts parts of soups away on a thread of its own, while more are read.

use crate::error::BakeError;
use crate::scratch::Spill;
use crate::soup::{Part, Triangle, WideTriangle};
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};

/// Parts that may wait: some MiB.
const WAITING: usize = 3;

/// Takes parts, each of a body.
pub(super) struct Away {
    full: SyncSender<(usize, Vec<WideTriangle>)>,
    /// The memory of parts that have been put away.
    emptied: Receiver<Vec<WideTriangle>>,
}

/// The thread, which ends when its `Away` is gone; then it has all parts with their bodies, in order.
pub(super) type Putting<'scope> = ScopedJoinHandle<'scope, Result<Vec<(usize, Part)>, BakeError>>;

impl Away {
    /// Starts the thread.
    pub(super) fn start<'scope>(
        scope: &'scope Scope<'scope, '_>,
        spill: &'scope Spill,
    ) -> (Self, Putting<'scope>) {
        let (full, parts) = sync_channel::<(usize, Vec<WideTriangle>)>(WAITING);
        let (used, emptied) = channel();
        let putting = scope.spawn(move || {
            let put = |(body, triangles): (usize, Vec<WideTriangle>)| {
                let part = part(&triangles, spill)?;
                // Whoever reads may have ended.
                let _ = used.send(triangles);
                Ok((body, part))
            };
            parts.into_iter().map(put).collect()
        });
        (Self { full, emptied }, putting)
    }

    /// Takes a part; returns memory for the next. `None` if the thread has failed, and tells why when it is asked.
    pub(super) fn put(&self, body: usize, part: Vec<WideTriangle>) -> Option<Vec<WideTriangle>> {
        self.full.send((body, part)).ok()?;
        let mut next = self.emptied.try_recv().unwrap_or_default();
        next.clear();
        Some(next)
    }
}

/// Puts triangles away, in `f32` where that holds them.
pub(super) fn part(triangles: &[WideTriangle], spill: &Spill) -> Result<Part, BakeError> {
    let fits = |triangle: &WideTriangle| {
        triangle.corners.as_flattened().iter().all(|&value| f64::from(value as f32) == value)
    };
    let narrow = |triangle: &WideTriangle| Triangle {
        corners: triangle.corners.map(|corner| corner.map(|value| value as f32)),
        id: triangle.id,
    };
    Ok(if triangles.iter().all(fits) {
        Part::Narrow(spill.put(triangles.iter().map(narrow).collect())?)
    } else {
        Part::Wide(spill.put(triangles.to_vec())?)
    })
}
