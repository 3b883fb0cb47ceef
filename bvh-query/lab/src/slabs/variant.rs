//! The variants of bounds and tests that are counted, by the questions that they answer.

use super::direction::DirectionCode;
use super::separation::{self, CENTRES, Factors, N_A, N_B, SlabRule};
use super::slab::{Making, Owners, Wish};
use super::walk::Rule;
use bvh_format::kdop::DirectionSet;

/// What a variant is compared for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topic {
    /// The number of fixed directions, with one and two frames, with and without slabs.
    Fixed,
    /// Which direction a slab has, and in how many bits.
    Stored,
    /// Which directions are tested for contact, the most useful one first.
    ForContact,
    /// The same for distance.
    ForDistance,
    /// Subsets that were tried on the way and not taken.
    NotTaken,
    /// The factors of slabs along other directions.
    Factors,
    /// The most triangles below a node with a slab.
    Largest,
    /// Leaf packets, treelets, or both.
    Owners,
    /// Only slabs that are much narrower than their box.
    Narrow,
    /// The ball in several sizes.
    Growth,
}

impl Topic {
    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed directions",
            Self::Stored => "slab's direction",
            Self::ForContact => "tested directions, contact",
            Self::ForDistance => "tested directions, distance",
            Self::NotTaken => "tested directions, not taken",
            Self::Factors => "factors",
            Self::Largest => "largest patch",
            Self::Owners => "owners",
            Self::Narrow => "narrow slabs",
            Self::Growth => "growth",
        }
    }
}

/// A way to bound and to test.
#[derive(Debug, Clone)]
pub(super) struct Variant {
    pub(super) topic: Topic,
    /// The fixed directions.
    pub(super) base: &'static str,
    pub(super) name: String,
    pub(super) making: Making,
    pub(super) rule: Rule,
}

/// The fixed directions: their name, the set, and whether those of B are tested, too.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base(&'static str, DirectionSet, bool);

const SIX: Base = Base("6, one frame", DirectionSet::Dop6, false);
const MOST: Base = Base("26, two frames", DirectionSet::Dop26, true);
const BASES: [Base; 6] = [
    MOST,
    Base("26, one frame", DirectionSet::Dop26, false),
    Base("14, two frames", DirectionSet::Dop14, true),
    Base("14, one frame", DirectionSet::Dop14, false),
    Base("6, two frames", DirectionSet::Dop6, true),
    SIX,
];
/// The directions that are worth a test.
const LEAN: u8 = N_A | N_B | CENTRES;
/// The bases for all questions but the first.
pub(super) const EXTREMES: [Base; 2] = [MOST, SIX];

impl Base {
    fn variant(self, topic: Topic, name: &str, making: Making, slab: Option<SlabRule>) -> Variant {
        let Self(base, set, two_frames) = self;
        Variant { topic, base, name: name.to_owned(), making, rule: Rule { set, two_frames, slab } }
    }

    /// The fixed directions alone.
    pub(super) fn plain(self, topic: Topic) -> Variant {
        self.variant(topic, "no slab", Making::USUAL, None)
    }

    fn usual(self, topic: Topic, name: &str) -> Variant {
        self.variant(topic, name, Making::USUAL, Some(SlabRule::USUAL))
    }

    /// The usual slab, tested along a subset of the directions.
    pub(super) fn tested(self, topic: Topic, directions: u8) -> Variant {
        const NAMES: [&str; 5] = ["n_A", "n_B", "n_A - n_B", "n_A + n_B", "centres"];
        let named = NAMES.iter().enumerate().filter(|(bit, _)| directions >> bit & 1 == 1);
        let name = named.map(|(_, &name)| name).collect::<Vec<_>>().join(", ");
        self.variant(topic, &name, Making::USUAL, Some(SlabRule { directions, ..SlabRule::USUAL }))
    }
}

/// Returns the variants of all questions but those that are searched for, and of growth.
pub(super) fn variants() -> Vec<Variant> {
    let mut all = Vec::new();
    for base in BASES {
        all.extend([base.plain(Topic::Fixed), base.usual(Topic::Fixed, "slab")]);
    }
    for base in EXTREMES {
        stored(base, &mut all);
        factors(base, &mut all);
        largest(base, &mut all);
        owners(base, &mut all);
        narrow(base, &mut all);
    }
    all
}

fn stored(base: Base, all: &mut Vec<Variant>) {
    let usual = Making::USUAL;
    let coarse = DirectionCode::Octahedral(4);
    all.push(base.plain(Topic::Stored));
    for (name, making) in [
        ("usual: narrower of both, per child, 2 x 8 bits, ends in 8", usual),
        ("mean normal", Making { wish: Wish::Normal, ..usual }),
        ("least principal axis", Making { wish: Wish::Axis, ..usual }),
        ("one per treelet", Making { one_per_treelet: true, ..usual }),
        ("exact direction", Making { code: DirectionCode::Exact, ..usual }),
        ("2 x 6 bits, ends in 6", Making { code: DirectionCode::Octahedral(6), end_bits: 6, ..usual }),
        ("2 x 4 bits", Making { code: coarse, ..usual }),
        ("ends in 4 bits", Making { end_bits: 4, ..usual }),
        ("2 x 4 bits, ends in 4", Making { code: coarse, end_bits: 4, ..usual }),
    ] {
        all.push(base.variant(Topic::Stored, name, making, Some(SlabRule::USUAL)));
    }
}

fn factors(base: Base, all: &mut Vec<Variant>) {
    let usual = SlabRule::USUAL;
    let lean = SlabRule { factors: Factors::Projection, one_side: true, directions: LEAN, ..usual };
    for (name, rule) in [
        ("projection and 1", usual),
        ("projection", SlabRule { factors: Factors::Projection, ..usual }),
        ("1", SlabRule { factors: Factors::Whole, ..usual }),
        ("none", SlabRule { factors: Factors::None, ..usual }),
        ("projection and 1, one side", SlabRule { one_side: true, ..usual }),
        ("lean: projection, one side, n_A, n_B and centres", lean),
    ] {
        all.push(base.variant(Topic::Factors, name, Making::USUAL, Some(rule)));
    }
}

fn largest(base: Base, all: &mut Vec<Variant>) {
    all.push(base.usual(Topic::Largest, "all"));
    for max_triangles in [4096, 1024, 256, 64, 16, 4] {
        let making = Making { max_triangles, ..Making::USUAL };
        let name = format!("at most {max_triangles}");
        all.push(base.variant(Topic::Largest, &name, making, Some(SlabRule::USUAL)));
    }
}

fn owners(base: Base, all: &mut Vec<Variant>) {
    let packets_only = SlabRule { packets_only: true, ..SlabRule::USUAL };
    for (name, owners, rule) in [
        ("all children", Owners::All, SlabRule::USUAL),
        ("treelets have slabs, packets none", Owners::Treelets, SlabRule::USUAL),
        ("packets have slabs, treelets none", Owners::Leaves, SlabRule::USUAL),
        ("tested on pairs of packets only", Owners::Leaves, packets_only),
    ] {
        all.push(base.variant(Topic::Owners, name, Making { owners, ..Making::USUAL }, Some(rule)));
    }
}

fn narrow(base: Base, all: &mut Vec<Variant>) {
    all.push(base.usual(Topic::Narrow, "all"));
    for max_share in [0.75, 0.5, 0.25] {
        let name = format!("at most {max_share} of the box's reach");
        let making = Making { max_share, ..Making::USUAL };
        all.push(base.variant(Topic::Narrow, &name, making, Some(SlabRule::USUAL)));
    }
}

/// Returns the variants that are counted on balls.
pub(super) fn of_growth() -> Vec<Variant> {
    let [two, one, _, fourteen, _, six] = BASES;
    let mut all = vec![two.plain(Topic::Growth)];
    all.extend([two, one, fourteen, six].map(|base| base.usual(Topic::Growth, "slab")));
    all
}

/// Returns the sets of directions with one more than `chosen`.
pub(super) fn one_more(chosen: u8) -> impl Iterator<Item = u8> {
    (0..5).map(|bit| 1 << bit).filter(move |bit| chosen & bit == 0).map(move |bit| chosen | bit)
}

/// Returns true if a set of directions is complete.
pub(super) fn is_complete(chosen: u8) -> bool {
    chosen == separation::ALL
}
