//! Pairs of meshes that are hard to answer about, each with the exact truth as a literal fact.
//!
//! This folder depends on nothing but itself: the command asks about these cases for its report, and the exact
//! oracle among the tests of bvh-query includes the same text and proves every fact stated here. A module of this
//! name instead of `cases.rs` lets it be found from both places.
//!
//! A file holds every coordinate of every case without rounding. Either the poses place corners without rounding
//! too, or the truth is far enough from both sides of contact that no way of rounding makes a difference. So the
//! facts hold for whoever computes with these numbers, in whatever way.

mod apart;
mod contact;
mod degenerate;
mod flat;
mod needles;
mod nested;
mod order;
mod refused;
mod scale;
mod shapes;
mod turned;

pub(crate) use order::Ordered;
pub(crate) use shapes::Triangle;

/// A pose without motion.
pub(crate) const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A question and its only right answer.
#[derive(Clone)]
pub(crate) struct Case {
    /// What family it is of.
    pub(crate) kind: &'static str,
    /// Unique among all cases.
    pub(crate) name: String,
    /// What makes it hard, in a line.
    pub(crate) hard: &'static str,
    pub(crate) a: Vec<Triangle>,
    pub(crate) b: Vec<Triangle>,
    /// The rows of a 3x4 matrix that places B in A's frame.
    pub(crate) pose: [f64; 12],
    pub(crate) truth: Truth,
}

/// The exact truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Truth {
    /// The surfaces share a point, and so many pairs of triangles do.
    Touching { contacts: u64 },
    /// They do not, and are this far apart.
    Apart(Length),
    /// The pose is no placement, and the error says so with these words.
    Refused { words: &'static str },
}

impl Truth {
    /// An f64 that the distance is at least; infinite where there is none.
    pub(crate) fn floor(&self) -> f64 {
        match self {
            Self::Touching { .. } => 0.0,
            Self::Apart(length) => length.floor(),
            Self::Refused { .. } => f64::INFINITY,
        }
    }

    /// An f64 that the distance is at most, the same or the next.
    pub(crate) fn ceil(&self) -> f64 {
        match self {
            Self::Touching { .. } => 0.0,
            Self::Apart(length) => length.ceil(),
            Self::Refused { .. } => f64::INFINITY,
        }
    }
}

/// An exact distance, mesh units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Length {
    /// Just this number, for the reason given.
    Exactly(f64, &'static str),
    /// Between this number and the next larger f64, by exact integer arithmetic.
    Above(f64),
}

impl Length {
    /// The largest f64 that is not larger.
    pub(crate) fn floor(self) -> f64 {
        match self {
            Self::Exactly(length, _) | Self::Above(length) => length,
        }
    }

    /// The smallest f64 that is not smaller.
    pub(crate) fn ceil(self) -> f64 {
        match self {
            Self::Exactly(length, _) => length,
            Self::Above(length) => length.next_up(),
        }
    }
}

/// All cases, family by family.
pub(crate) fn all() -> Vec<Case> {
    [
        degenerate::cases(),
        flat::cases(),
        contact::cases(),
        apart::cases(),
        nested::cases(),
        needles::cases(),
        scale::cases(),
        turned::cases(),
        refused::cases(),
    ]
    .concat()
}

/// The start of a case; what follows says the pose, if there is a motion, and ends with the truth.
struct Question(Case);

fn question(
    kind: &'static str,
    name: impl Into<String>,
    hard: &'static str,
    a: Vec<Triangle>,
    b: Vec<Triangle>,
) -> Question {
    let truth = Truth::Touching { contacts: 0 };
    Question(Case { kind, name: name.into(), hard, a, b, pose: IDENTITY, truth })
}

impl Question {
    fn moved(mut self, by: [f64; 3]) -> Self {
        for axis in 0..3 {
            self.0.pose[4 * axis + 3] = by[axis];
        }
        self
    }

    fn turned(mut self, rows: [[f64; 3]; 3]) -> Self {
        for axis in 0..3 {
            self.0.pose[4 * axis..4 * axis + 3].copy_from_slice(&rows[axis]);
        }
        self
    }

    fn truth(mut self, truth: Truth) -> Case {
        self.0.truth = truth;
        self.0
    }

    fn touching(self, contacts: u64) -> Case {
        self.truth(Truth::Touching { contacts })
    }

    fn apart(self, distance: f64, why: &'static str) -> Case {
        self.truth(Truth::Apart(Length::Exactly(distance, why)))
    }

    fn above(self, distance: f64) -> Case {
        self.truth(Truth::Apart(Length::Above(distance)))
    }

    fn refused(self, words: &'static str) -> Case {
        self.truth(Truth::Refused { words })
    }
}
