//! All questions and answers, as `hard.json` holds them.

use super::judge::Verdict;
use super::own::Own;
use super::peers::{Other, Peer};
use bvh_query::Backend;
use cbvh_measure::origin::Origin;
use cbvh_testkit::hard_cases::{Case, Length, Truth};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Record {
    #[serde(flatten)]
    pub(super) origin: Origin,
    pub(super) backends: Vec<&'static str>,
    pub(super) cases: Vec<Asked>,
    pub(super) peers: Vec<Column>,
}

/// A case and all answers.
#[derive(Serialize)]
pub(super) struct Asked {
    pub(super) kind: &'static str,
    pub(super) name: String,
    pub(super) hard: &'static str,
    pub(super) triangles_a: usize,
    pub(super) triangles_b: usize,
    /// Whether single precision holds all coordinates and the pose without rounding.
    pub(super) single: bool,
    pub(super) truth: Known,
    pub(super) orders: Vec<Answers>,
}

/// The truth; a field that does not apply is null.
#[derive(Serialize)]
pub(super) struct Known {
    pub(super) touching: Option<bool>,
    pub(super) contacts: Option<u64>,
    /// The largest f64 that is not larger than the distance.
    pub(super) distance: Option<f64>,
    /// Whether `distance` is exact.
    pub(super) exact: Option<bool>,
    pub(super) why: &'static str,
}

#[derive(Serialize)]
pub(super) struct Answers {
    pub(super) order: &'static str,
    pub(super) own: Own,
    pub(super) others: Vec<Other>,
}

/// A library's answers, counted.
#[derive(Serialize)]
pub(super) struct Column {
    pub(super) name: &'static str,
    pub(super) version: String,
    pub(super) precision: &'static str,
    pub(super) modes: Vec<Counts>,
}

/// The counts of one mode.
#[derive(Default, Serialize)]
pub(super) struct Counts {
    pub(super) mode: &'static str,
    pub(super) asked: usize,
    pub(super) wrong: usize,
    /// The number of distances whose error is too large relative to the distance, but not to the size of the meshes.
    pub(super) off: usize,
    pub(super) crashes: usize,
    pub(super) timeouts: usize,
    /// The number of questions whose numbers single precision holds.
    pub(super) single_asked: usize,
    /// How many of these were not answered right.
    pub(super) single_not_right: usize,
}

impl Asked {
    pub(super) fn new(case: &Case) -> Self {
        let exact = "exact integer arithmetic";
        let truth = match case.truth {
            Truth::Touching { contacts } => Known {
                touching: Some(true),
                contacts: Some(contacts),
                distance: Some(0.0),
                exact: Some(true),
                why: exact,
            },
            Truth::Apart(length) => Known {
                touching: Some(false),
                contacts: Some(0),
                distance: Some(length.floor()),
                exact: Some(length.floor() == length.ceil()),
                why: if let Length::Exactly(_, why) = length { why } else { exact },
            },
            Truth::Refused { .. } => Known {
                touching: None,
                contacts: None,
                distance: None,
                exact: None,
                why: "the pose is refused",
            },
        };
        let numbers = case.a.iter().chain(&case.b).flatten().flatten().chain(&case.pose);
        Self {
            kind: case.kind,
            name: case.name.clone(),
            hard: case.hard,
            triangles_a: case.a.len(),
            triangles_b: case.b.len(),
            single: numbers.copied().all(|x| f64::from(x as f32) == x),
            truth,
            orders: Vec::new(),
        }
    }
}

impl Record {
    pub(super) fn new(cases: Vec<Asked>, peers: &[Peer]) -> Self {
        let columns = peers.iter().map(|peer| Column::new(peer, &cases)).collect();
        let backends = Backend::ALL.into_iter().filter(|backend| backend.is_available());
        Self {
            origin: Origin::of("cbvh-lab hard"),
            backends: backends.map(Backend::name).collect(),
            cases,
            peers: columns,
        }
    }

    /// Returns the number of wrong answers of cbvh.
    pub(super) fn wrong(&self) -> usize {
        self.own().map(|(_, own)| own.wrong.len() + own.differ.len()).sum()
    }

    /// Returns the first of them, with its case.
    pub(super) fn first_wrong(&self) -> Option<String> {
        let mut lines = self.own().flat_map(|(case, own)| {
            own.wrong
                .iter()
                .chain(&own.differ)
                .map(move |line| format!("{}: {}: {line}", case.kind, case.name))
        });
        lines.next()
    }

    fn own(&self) -> impl Iterator<Item = (&Asked, &Own)> {
        self.cases.iter().flat_map(|case| case.orders.iter().map(move |answers| (case, &answers.own)))
    }
}

impl Column {
    fn new(peer: &Peer, cases: &[Asked]) -> Self {
        let counts = |mode: &'static str| {
            let mut counts = Counts { mode, ..Counts::default() };
            for case in cases {
                let others = case.orders.iter().flat_map(|answers| &answers.others);
                for other in others.filter(|other| other.peer == peer.name && other.mode == mode) {
                    counts.add(other.verdict, case.single);
                }
            }
            counts
        };
        let modes = peer.modes.iter().copied().map(counts).collect();
        Self { name: peer.name, version: peer.version.clone(), precision: peer.precision, modes }
    }

    pub(super) fn total_asked(&self) -> usize {
        self.modes.iter().map(|counts| counts.asked).sum()
    }

    /// Returns how many answers are not right.
    pub(super) fn total_wrong(&self) -> usize {
        self.modes.iter().map(|counts| counts.wrong + counts.off + counts.crashes + counts.timeouts).sum()
    }
}

impl Counts {
    fn add(&mut self, verdict: Verdict, single: bool) {
        self.asked += 1;
        match verdict {
            Verdict::Right => {}
            Verdict::Wrong => self.wrong += 1,
            Verdict::Off => self.off += 1,
            Verdict::Crash => self.crashes += 1,
            Verdict::Timeout => self.timeouts += 1,
        }
        self.single_asked += usize::from(single);
        self.single_not_right += usize::from(single && verdict != Verdict::Right);
    }
}
