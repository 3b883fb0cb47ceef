//! Names the stages of a query about two meshes. With the feature `stages`, a clock tells what each of them takes.
//!
//! A stage lasts as long as the guard that `Stage::enter` returns. A stage within another one interrupts it, so that no time is
//! counted twice. Without the feature, a guard has size zero and does nothing, so it is not in the compiled code.
//!
//! Reading the counter takes tens of cycles, as long as the shortest stages. So readings are counted too, and their cost can be
//! subtracted. CPUs run instructions of neighbouring stages at the same time: a stage of less than a hundred cycles is known
//! to within some ten.

macro_rules! stages {
    ($(#[doc = $name:literal] $stage:ident,)+) => {
        /// A stage of a query about two meshes.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Stage {
            $(#[doc = $name] $stage,)+
        }

        impl Stage {
            /// All stages, in the order of a query. The number of each is its place here.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$stage),+];

            /// Returns what the stage does, in a few words.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$stage => $name.trim_ascii(),)+
                }
            }
        }
    };
}

stages! {
    /// around the walk
    Around,
    /// bounding volumes
    Volumes,
    /// preparing a pose
    Prepare,
    /// rest of the walk
    Walk,
    /// choosing the next pair
    Choose,
    /// triangles of large packets
    LargeLeaf,
    /// finding opened nodes
    Open,
    /// preparing B's directions
    PrepareAlongB,
    /// decoding a node
    Decode,
    /// aligning a node of B
    AlignB,
    /// node test along A's directions
    TestAlongA,
    /// turning slabs
    Slabs,
    /// aligning a node of A
    AlignA,
    /// node test along B's directions
    TestAlongB,
    /// keeping pairs of children
    Keep,
    /// placing a packet
    Place,
    /// testing two packets in f32
    Packets,
    /// what is pending at the end
    Finish,
    /// exact test
    Exact,
}

/// A stage under way: it ends when this is dropped.
pub(crate) struct Running {
    #[cfg(feature = "stages")]
    outer: Option<Stage>,
}

impl Stage {
    /// Starts the stage.
    #[inline(always)]
    pub(crate) fn enter(self) -> Running {
        Running {
            #[cfg(feature = "stages")]
            outer: clock::enter(self),
        }
    }
}

impl Running {
    /// Ends the stage before the end of the block.
    #[inline(always)]
    pub(crate) fn leave(self) {}
}

#[cfg(feature = "stages")]
pub use clock::{Spent, record};

#[cfg(feature = "stages")]
mod clock {
    use super::{Running, Stage};
    use crate::isa::ticks::ticks;
    use std::cell::Cell;

    const STAGES: usize = Stage::ALL.len();

    /// What a stage took, without the stages within it.
    #[derive(Clone, Copy, Debug, Default)]
    pub struct Spent {
        /// How often the stage was entered.
        pub calls: u64,
        /// The ticks of the counter, including what reading it took.
        pub ticks: u64,
        /// How often the counter was read in this time.
        pub readings: u64,
    }

    impl Spent {
        const NOTHING: Self = Self { calls: 0, ticks: 0, readings: 0 };
    }

    struct Clock {
        /// The stage under way, while a question is recorded.
        stage: Cell<Option<Stage>>,
        /// When the counter was last read.
        since: Cell<u64>,
        spent: [Cell<Spent>; STAGES],
    }

    thread_local! {
        static CLOCK: Clock = const {
            Clock {
                stage: Cell::new(None),
                since: Cell::new(0),
                spent: [const { Cell::new(Spent::NOTHING) }; STAGES],
            }
        };
    }

    /// Starts a stage and returns the one that it interrupts, if a question is recorded.
    #[inline(always)]
    pub(super) fn enter(stage: Stage) -> Option<Stage> {
        CLOCK.with(|clock| {
            let outer = clock.stage.get()?;
            clock.change(outer, Some(stage));
            let spent = clock.spent[stage as usize].get();
            clock.spent[stage as usize].set(Spent { calls: spent.calls + 1, ..spent });
            Some(outer)
        })
    }

    impl Drop for Running {
        #[inline(always)]
        fn drop(&mut self) {
            CLOCK.with(|clock| {
                if let (Some(stage), Some(outer)) = (clock.stage.get(), self.outer) {
                    clock.change(stage, Some(outer));
                }
            });
        }
    }

    impl Clock {
        /// Adds the time since the last change to the stage `from`, and goes on with another one.
        #[inline(always)]
        fn change(&self, from: Stage, to: Option<Stage>) {
            let now = ticks();
            let Spent { calls, ticks, readings } = self.spent[from as usize].get();
            let ticks = ticks + now.saturating_sub(self.since.replace(now));
            self.spent[from as usize].set(Spent { calls, ticks, readings: readings + 1 });
            self.stage.set(to);
        }
    }

    /// Asks a question on this thread, and returns the answer with what each stage took, in the order of `Stage::ALL`. `ask`
    /// may not call this function.
    pub fn record<T>(ask: impl FnOnce() -> T) -> (T, [Spent; STAGES]) {
        CLOCK.with(|clock| {
            clock.spent.iter().for_each(|spent| spent.set(Spent::NOTHING));
            clock.spent[Stage::Around as usize].set(Spent { calls: 1, ..Spent::NOTHING });
            clock.stage.set(Some(Stage::Around));
            clock.since.set(ticks());
            let answer = ask();
            clock.change(Stage::Around, None);
            (answer, clock.spent.each_ref().map(Cell::get))
        })
    }

    #[cfg(test)]
    mod tests {
        use super::*;
        use crate::{Bvh, Pose, Querier, QueryError, QueryStats};

        /// B touches A, or is apart from it, or far away.
        #[test]
        fn stages_are_counted_as_often_as_queries_say_and_take_no_longer_than_the_whole() {
            type Ask = fn(&mut Querier, &Bvh, &Pose) -> Result<(), QueryError>;
            let asks: [Ask; 3] = [
                |querier, bvh, pose| querier.collide(bvh, bvh, pose).map(drop),
                |querier, bvh, pose| querier.contacts(bvh, bvh, pose).map(drop),
                |querier, bvh, pose| querier.distance(bvh, bvh, pose).map(drop),
            ];
            let bvh = Bvh::from_static(include_bytes!("../../../testdata/ok-everything.cbvh")).unwrap();
            let mut querier = Querier::new().unwrap();
            let mut all = QueryStats::default();
            for ask in asks {
                for shift in [0.0, 0.3, 1.7, 1000.0] {
                    let pose = Pose::new(*Pose::IDENTITY.rotation(), [shift, shift / 3.0, 0.0]).unwrap();
                    let start = ticks();
                    let (answer, spent) = record(|| ask(&mut querier, &bvh, &pose));
                    let whole = ticks().saturating_sub(start);
                    answer.unwrap();
                    let stats = querier.stats();
                    let calls = |stage: Stage| spent[stage as usize].calls;
                    let counted = [Stage::TestAlongA, Stage::Packets, Stage::Exact].map(calls);
                    assert_eq!(counted, [stats.node_tests, stats.packet_tests, stats.exact_tests]);
                    assert_eq!(calls(Stage::Prepare), calls(Stage::Walk));
                    assert!(calls(Stage::Volumes) >= calls(Stage::Walk));
                    assert!(spent.iter().map(|spent| spent.ticks).sum::<u64>() <= whole);
                    all.add(stats.node_tests, stats);
                }
            }
            assert!(all.node_tests > 0 && all.packet_tests > 0 && all.exact_tests > 0, "{all:?}");
            // Outside of `record`, nothing is counted.
            assert!(Stage::Walk.enter().outer.is_none());
        }
    }
}
