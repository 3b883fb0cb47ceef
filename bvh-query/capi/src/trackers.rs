//! Trackers: questions about poses that follow a path.

use crate::entry::{entry, hand_out, questions};
use crate::input;
use crate::output::Room;
use crate::poses;
use crate::queriers::{self, Asker};
use crate::status::Failure;
use crate::table::{Exclusive, Kind, Table};
use crate::types::{
    DistanceRow, MeshHandle, PenetrationChoices, PoseRows, QuerierHandle, SignedDistanceRow, TrackerHandle,
};
use bvh_query::{Pose, Querier, QueryError, Shape, Tracker};

/// All trackers that are open.
static TRACKERS: Table<Exclusive<Tracker>> = Table::new(Kind::Tracker);

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_new(tracker: *mut TrackerHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { hand_out(("tracker", tracker), &TRACKERS, || Ok(Exclusive::new(Tracker::default()))) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_tracker_free(tracker: TrackerHandle) -> i32 {
    entry(|| TRACKERS.free_unused("tracker", tracker.id))
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
    /// As for `poses::read_many` and `Room::new`.
    unsafe fn each<T, R: Copy + From<T>>(
        &self,
        answers: *mut R,
        one: impl Fn(&mut Tracker, &mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        entry(|| unsafe { self.ask(answers, one) })
    }

    /// Asks about each pose inside of a function of the interface.
    ///
    /// # Safety
    /// That of `each`.
    unsafe fn ask<T, R: Copy + From<T>>(
        &self,
        answers: *mut R,
        one: impl Fn(&mut Tracker, &mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
    ) -> Result<(), Failure> {
        let ask = |tracker: &mut Tracker, Asker { querier, at_hand, probes, .. }: &mut Asker| {
            let (a, b) = at_hand.pair(self.a, self.b)?;
            // SAFETY: the caller vouches for it.
            let (poses, mut room) = unsafe {
                let poses = poses::read_many("poses", self.poses, self.count, &mut probes.poses)?;
                (poses, Room::new("answers", answers, self.count)?)
            };
            room.fill(poses.iter().map(|pose| one(tracker, querier, [a, b], pose)), R::from)
        };
        TRACKERS.hold("tracker", self.tracker.id, |tracker| {
            queriers::with(self.querier, |asker| ask(tracker, asker))
        })
    }
}

/// Apart from the other questions, because it has options to read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_tracker_signed_distance(
    tracker: TrackerHandle,
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const PenetrationChoices,
    answers: *mut SignedDistanceRow,
) -> i32 {
    let question = Question { tracker, querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        question.ask(answers, |tracker, querier, [a, b], pose| {
            tracker.signed_distance(querier, a, b, pose, &options)
        })
    })
}

questions! {
    (tracker: TrackerHandle, querier: QuerierHandle, a: MeshHandle, b: MeshHandle,
        poses: *const PoseRows, count: usize,)
        => Question { tracker, querier, a, b, poses, count };
    cbvh_tracker_collide() -> bool: |tracker, querier, [a, b], pose| tracker.collide(querier, a, b, pose);
    cbvh_tracker_within(d: f64,) -> bool: |tracker, querier, [a, b], pose| tracker.within(querier, a, b, pose, d);
    cbvh_tracker_distance() -> DistanceRow: |tracker, querier, [a, b], pose| tracker.distance(querier, a, b, pose);
}
