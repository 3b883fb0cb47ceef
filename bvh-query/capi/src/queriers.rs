//! Queriers: the memory of questions, and how they are asked.

use crate::at_hand::AtHand;
use crate::cores;
use crate::entry::entry;
use crate::input::flag;
use crate::output::One;
use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::{QuerierHandle, StatsRow, backend};
use bvh_query::{Pose, Querier, Ray};

/// All queriers that are open.
pub(crate) static QUERIERS: Table<Box<Asker>> = Table::new(Kind::Querier);

/// What the handle of a querier stands for.
pub(crate) struct Asker {
    pub(crate) querier: Querier,
    /// Whether questions may use all cores, where they are not asked by a function of the caller.
    parallel: bool,
    pub(crate) budget: u64,
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

#[derive(Default)]
pub(crate) struct Probes {
    pub(crate) poses: Vec<Pose>,
    pub(crate) ends: Vec<Pose>,
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) rays: Vec<Ray>,
    pub(crate) segments: Vec<[[f64; 3]; 2]>,
}

/// `cbvh_querier_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_querier_new(backend_number: i32, querier: *mut QuerierHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("querier", querier) }?;
        out.set(QuerierHandle { id: 0 });
        let backend = backend("backend", backend_number)?;
        let querier = Querier::with_backend(backend);
        let at_hand = AtHand::default();
        let asker = Asker { querier, parallel: false, budget: u64::MAX, at_hand, probes: Probes::default() };
        out.set(QuerierHandle { id: QUERIERS.insert(Box::new(asker))? });
        Ok(())
    })
}

/// `cbvh_querier_free`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_free(querier: QuerierHandle) -> i32 {
    entry(|| if querier.id == 0 { Ok(()) } else { QUERIERS.remove("querier", querier.id).map(drop) })
}

/// Changes a querier that nobody uses.
fn change(querier: QuerierHandle, change: impl FnOnce(&mut Asker) -> Result<(), Failure>) -> i32 {
    entry(|| change(QUERIERS.hold("querier", querier.id)?.value()?))
}

/// `cbvh_querier_set_parallel`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_set_parallel(querier: QuerierHandle, parallel: i32) -> i32 {
    change(querier, |asker| {
        asker.parallel = flag("parallel", parallel)?;
        Ok(())
    })
}

/// `cbvh_querier_set_budget`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_querier_set_budget(querier: QuerierHandle, visits: u64) -> i32 {
    change(querier, |asker| {
        asker.budget = visits;
        asker.querier.set_budget(visits);
        Ok(())
    })
}

/// `cbvh_querier_stats`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_querier_stats(querier: QuerierHandle, stats: *mut StatsRow) -> i32 {
    change(querier, |asker| {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("stats", stats) }?;
        out.set(StatsRow::new(asker.querier.stats(), 1));
        Ok(())
    })
}
