//! Trackers: questions about poses that follow a path.

use crate::entry::entry;
use crate::output::{One, Room};
use crate::poses::poses;
use crate::queriers::{Asker, QUERIERS};
use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::{DistanceRow, MeshHandle, PoseRows, QuerierHandle, TrackerHandle};
use bvh_query::{Pose, Querier, QueryError, Shape, Tracker};

/// All trackers that are open.
static TRACKERS: Table<Box<Tracker>> = Table::new(Kind::Tracker);

/// `cbvh_tracker_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_new(tracker: *mut TrackerHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("tracker", tracker) }?;
        out.set(TrackerHandle { id: 0 });
        out.set(TrackerHandle { id: TRACKERS.insert(Box::default())? });
        Ok(())
    })
}

/// `cbvh_tracker_free`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_tracker_free(tracker: TrackerHandle) -> i32 {
    entry(|| if tracker.id == 0 { Ok(()) } else { TRACKERS.remove("tracker", tracker.id).map(drop) })
}

/// Who is asked about what.
struct Question {
    tracker: TrackerHandle,
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
}

impl Question {
    /// Asks about each pose, in order.
    ///
    /// # Safety
    /// As for `poses`, and for `Room::new`.
    unsafe fn each<R: Copy>(
        &self,
        answers: *mut R,
        one: impl Fn(&mut Tracker, &mut Querier, [Shape<'_>; 2], &Pose) -> Result<R, QueryError>,
    ) -> Result<(), Failure> {
        let mut held = TRACKERS.hold("tracker", self.tracker.id)?;
        let tracker = held.value()?;
        let mut held = QUERIERS.hold("querier", self.querier.id)?;
        let Asker { querier, at_hand, probes, .. } = &mut **held.value()?;
        let (a, b) = at_hand.pair(self.a, self.b)?;
        // SAFETY: the caller vouches for it.
        let mut room = unsafe {
            poses("poses", self.poses, self.count, &mut probes.poses)?;
            Room::new("answers", answers, self.count)?
        };
        for (number, pose) in probes.poses.iter().enumerate() {
            room.set(number, one(tracker, querier, [a, b], pose)?);
        }
        Ok(())
    }
}

/// `cbvh_tracker_collide`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_collide(
    tracker: TrackerHandle,
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    answers: *mut bool,
) -> i32 {
    let question = Question { tracker, querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.each(answers, |tracker, querier, [a, b], pose| tracker.collide(querier, a, b, pose))
    })
}

/// `cbvh_tracker_within`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_within(
    tracker: TrackerHandle,
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    d: f64,
    answers: *mut bool,
) -> i32 {
    let question = Question { tracker, querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.each(answers, |tracker, querier, [a, b], pose| tracker.within(querier, a, b, pose, d))
    })
}

/// `cbvh_tracker_distance`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_distance(
    tracker: TrackerHandle,
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    answers: *mut DistanceRow,
) -> i32 {
    let question = Question { tracker, querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.each(answers, |tracker, querier, [a, b], pose| {
            tracker.distance(querier, a, b, pose).map(DistanceRow::from)
        })
    })
}
