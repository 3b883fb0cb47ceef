//! A question about two meshes that is hard to answer, and its only right answer.

use cbvh_testkit::Triangle;

/// The pose that moves nothing.
const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A question and its only right answer.
#[derive(Clone)]
pub(super) struct Case {
    /// The name of the case, which no other case has.
    pub(super) name: String,
    /// Mesh A.
    pub(super) a: Vec<Triangle>,
    /// Mesh B, before the pose places it.
    pub(super) b: Vec<Triangle>,
    /// The rows of the 3 by 4 matrix that places B in the frame of A.
    pub(super) pose: [f64; 12],
    /// The only right answer.
    pub(super) truth: Truth,
}

/// The only right answer to a question.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Truth {
    /// The surfaces share a point, and so do this many pairs of triangles.
    Touching { contacts: u64 },
    /// The surfaces share no point. Their distance is between two f64 that are neighbours, or equal if it is an f64.
    Apart { lower: f64, upper: f64 },
    /// The pose is not rigid. The error message contains these words.
    Refused { words: &'static str },
}

/// A case without its truth: `moved` and `turned` give the pose, and the last call states the truth.
pub(super) struct Question(Case);

pub(super) fn question(name: String, a: Vec<Triangle>, b: Vec<Triangle>) -> Question {
    Question(Case { name, a, b, pose: IDENTITY, truth: Truth::Touching { contacts: 0 } })
}

impl Question {
    pub(super) fn moved(mut self, by: [f64; 3]) -> Self {
        for axis in 0..3 {
            self.0.pose[4 * axis + 3] = by[axis];
        }
        self
    }

    pub(super) fn turned(mut self, rows: [[f64; 3]; 3]) -> Self {
        for axis in 0..3 {
            self.0.pose[4 * axis..4 * axis + 3].copy_from_slice(&rows[axis]);
        }
        self
    }

    fn truth(mut self, truth: Truth) -> Case {
        self.0.truth = truth;
        self.0
    }

    pub(super) fn touching(self, contacts: u64) -> Case {
        self.truth(Truth::Touching { contacts })
    }

    pub(super) fn exactly(self, distance: f64) -> Case {
        self.truth(Truth::Apart { lower: distance, upper: distance })
    }

    /// States a distance between a number and the next larger f64.
    pub(super) fn above(self, distance: f64) -> Case {
        self.truth(Truth::Apart { lower: distance, upper: distance.next_up() })
    }

    pub(super) fn refused(self, words: &'static str) -> Case {
        self.truth(Truth::Refused { words })
    }
}
