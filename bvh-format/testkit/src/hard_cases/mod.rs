//! Pairs of meshes for which queries are hard to answer, each with the exact truth as a literal.
//!
//! The tests of bvh-query prove every stated fact with exact integer arithmetic and compare the answers of the
//! library with it; the laboratory asks other libraries the same questions.
//!
//! A file holds every coordinate of every case without rounding. Either the poses place corners without rounding,
//! too, or the truth is so far from the border of contact that rounding makes no difference, however it is done. The
//! facts therefore hold for everybody who computes with these numbers, in whatever way.

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

use crate::Triangle;
pub use order::Ordered;

/// The pose that moves nothing.
pub const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A question and its only right answer.
#[derive(Clone)]
pub struct Case {
    /// The family to which the case belongs.
    pub kind: &'static str,
    /// The name of the case, unique within its family.
    pub name: String,
    /// What makes the case hard, in one line.
    pub hard: &'static str,
    /// Mesh A.
    pub a: Vec<Triangle>,
    /// Mesh B, before the pose places it.
    pub b: Vec<Triangle>,
    /// The rows of the 3 by 4 matrix that places B in the frame of A.
    pub pose: [f64; 12],
    /// The only right answer.
    pub truth: Truth,
}

/// The only right answer to a question.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    /// The surfaces share a point.
    Touching {
        /// The number of pairs of triangles that share a point.
        contacts: u64,
    },
    /// The surfaces share no point and are this far apart.
    Apart(Length),
    /// The pose is not rigid.
    Refused {
        /// What the error message contains.
        words: &'static str,
    },
}

impl Truth {
    /// Returns the largest f64 that is not above the distance; infinity for a refused pose.
    pub fn floor(&self) -> f64 {
        match self {
            Self::Touching { .. } => 0.0,
            Self::Apart(length) => length.floor(),
            Self::Refused { .. } => f64::INFINITY,
        }
    }

    /// Returns the smallest f64 that is not below the distance; infinity for a refused pose.
    pub fn ceil(&self) -> f64 {
        match self {
            Self::Touching { .. } => 0.0,
            Self::Apart(length) => length.ceil(),
            Self::Refused { .. } => f64::INFINITY,
        }
    }
}

/// An exact distance, in mesh units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// Exactly this number, for the reason given.
    Exactly(f64, &'static str),
    /// Between this number and the next larger f64, by exact integer arithmetic.
    Above(f64),
}

impl Length {
    /// Returns the largest f64 that is not above the distance.
    pub fn floor(self) -> f64 {
        match self {
            Self::Exactly(length, _) | Self::Above(length) => length,
        }
    }

    /// Returns the smallest f64 that is not below the distance.
    pub fn ceil(self) -> f64 {
        match self {
            Self::Exactly(length, _) => length,
            Self::Above(length) => length.next_up(),
        }
    }
}

/// Returns all cases, family by family.
pub fn all() -> Vec<Case> {
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

/// A case without its truth: `moved` and `turned` give the pose, and the last call states the truth.
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
