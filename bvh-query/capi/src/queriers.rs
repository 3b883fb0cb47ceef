//! Queriers: the memory of questions, and how they are asked.

use crate::at_hand::AtHand;
use crate::cores;
use crate::entry::{entry, hand_out, write};
use crate::input::flag;
use crate::status::Failure;
use crate::stops;
use crate::table::{Exclusive, Kind, Table};
use crate::types::{self, QuerierHandle, StatsRow, StopHandle};
use bvh_query::{Pose, Querier, Ray, Stop};
use std::sync::Arc;

/// All queriers that are open.
static QUERIERS: Table<Exclusive<Asker>> = Table::new(Kind::Querier);

/// What the handle of a querier stands for.
pub(crate) struct Asker {
    pub(crate) querier: Querier,
    /// Whether questions may use all cores, where they are not asked by a function of the caller.
    parallel: bool,
    pub(crate) limits: Limits,
    pub(crate) at_hand: AtHand,
    /// Memory for what a question is about.
    pub(crate) probes: Probes,
}

impl Asker {
    /// Returns whether the question that is asked now uses all cores.
    pub(crate) fn uses_all_cores(&self) -> bool {
        self.parallel && cores::may_use_all()
    }
}

/// What ends a question early, on one core as on all.
pub(crate) struct Limits {
    pub(crate) budget: u64,
    pub(crate) stop: Option<Arc<dyn Stop>>,
}

#[derive(Default)]
pub(crate) struct Probes {
    pub(crate) poses: Vec<Pose>,
    pub(crate) ends: Vec<Pose>,
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) rays: Vec<Ray>,
    pub(crate) segments: Vec<[[f64; 3]; 2]>,
}

/// Uses a querier that nobody else uses.
pub(crate) fn with<R>(
    querier: QuerierHandle,
    act: impl FnOnce(&mut Asker) -> Result<R, Failure>,
) -> Result<R, Failure> {
    QUERIERS.hold("querier", querier.id, act)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_querier_new(backend: i32, querier: *mut QuerierHandle) -> i32 {
    let made = || {
        let querier = Querier::with_backend(types::backend("backend", backend)?);
        let (at_hand, probes) = (AtHand::default(), Probes::default());
        let limits = Limits { budget: u64::MAX, stop: None };
        Ok(Exclusive::new(Asker { querier, parallel: false, limits, at_hand, probes }))
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("querier", querier), &QUERIERS, made) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_free(querier: QuerierHandle) -> i32 {
    entry(|| QUERIERS.free_unused("querier", querier.id))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_set_parallel(querier: QuerierHandle, parallel: i32) -> i32 {
    entry(|| {
        with(querier, |asker| {
            asker.parallel = flag("parallel", parallel)?;
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_set_budget(querier: QuerierHandle, visits: u64) -> i32 {
    entry(|| {
        with(querier, |asker| {
            asker.limits.budget = visits;
            asker.querier.set_budget(visits);
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_set_stop(querier: QuerierHandle, stop: StopHandle) -> i32 {
    entry(|| {
        with(querier, |asker| {
            asker.limits.stop = stops::of(stop)?;
            asker.querier.set_stop(asker.limits.stop.clone());
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_querier_stats(querier: QuerierHandle, stats: *mut StatsRow) -> i32 {
    // SAFETY: the header asks for it.
    let out =
        |asker: &mut Asker| unsafe { write("stats", stats, || Ok(StatsRow::new(asker.querier.stats(), 1))) };
    entry(|| with(querier, out))
}
