//! The kinematic tree: links, joints that move, and the numbers that set them.
//!
//! Links that only fixed joints connect are one body, a *group*, which has the frame of its first link. A joint connects two groups.

use crate::error::RobotError;
use crate::frame::{Frame, Point, each, product};
use std::collections::HashSet;

/// The links and joints of a robot.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) name: String,
    /// Each after the link that it hangs from. The first is the root.
    pub(crate) links: Vec<Link>,
    /// The joint that moves each group; none moves the first.
    pub(crate) groups: Vec<Option<usize>>,
    /// Each after the joint that moves its parent.
    pub(crate) joints: Vec<Joint>,
    /// The names of the numbers that set the joints.
    pub(crate) numbers: Vec<String>,
    /// The lower and the upper limit of each number.
    pub(crate) limits: Vec<[f64; 2]>,
    /// The names of joints that do not move, which are none of the joints above.
    pub(crate) fixed: HashSet<String>,
}

#[derive(Debug)]
pub(crate) struct Link {
    pub(crate) name: String,
    /// Its group, and where it is there.
    pub(crate) group: usize,
    pub(crate) origin: Frame,
}

#[derive(Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    /// The groups that it connects.
    pub(crate) parent: usize,
    pub(crate) child: usize,
    /// Where the joint is in its parent.
    pub(crate) origin: Frame,
    pub(crate) kind: Kind,
}

/// How a joint moves its child.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "nearly all joints turn")]
pub(crate) enum Kind {
    /// About an axis, by an angle in radians: see [`Kind::turn`].
    Turn { by: Value, axis: Point, turns: [[[f64; 3]; 3]; 3] },
    /// Along a unit axis, by a length.
    Slide { by: Value, axis: Point },
    /// By x, y and an angle about z: the numbers from this one on.
    Planar(usize),
    /// By x, y, z and a quaternion, its real part last: the numbers from this one on.
    Floating(usize),
}

/// A joint value: a number times a factor, and an offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value {
    pub(crate) number: usize,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

impl Value {
    pub(crate) fn at(&self, numbers: &[f64]) -> f64 {
        self.factor * numbers[self.number] + self.offset
    }
}

impl Kind {
    /// Returns a joint that turns, with what its origin's rotation makes of the three parts of a turn: R (I + sin K + (1 - cos) K^2).
    pub(crate) fn turn(by: Value, axis: Point, origin: &Frame) -> Self {
        let [x, y, z] = axis;
        let across = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let first = product(&origin.rotation, &across);
        Self::Turn { by, axis, turns: [origin.rotation, first, product(&first, &across)] }
    }
}

impl Model {
    /// Returns an error unless these are finite values for all joints.
    pub(crate) fn check(&self, numbers: &[f64]) -> Result<(), RobotError> {
        if numbers.len() != self.numbers.len() {
            return Err(RobotError::Count { expected: self.numbers.len(), found: numbers.len() });
        }
        for (name, &found) in self.numbers.iter().zip(numbers) {
            if !found.is_finite() {
                return Err(RobotError::Value { joint: name.clone(), expected: "a finite value", found });
            }
        }
        for joint in &self.joints {
            if let Kind::Floating(first) = joint.kind {
                let found = quaternion_length(numbers, first);
                if !(1e-3..=1e3).contains(&found) {
                    let expected = "a quaternion of length 1, qx qy qz qw";
                    return Err(RobotError::Value { joint: joint.name.clone(), expected, found });
                }
            }
        }
        Ok(())
    }

    /// Returns the frames of all groups in the world, given valid numbers: forward kinematics.
    pub(crate) fn place(&self, numbers: &[f64], groups: &mut Vec<Frame>) {
        groups.resize(self.groups.len(), Frame::IDENTITY);
        for joint in &self.joints {
            groups[joint.child] = groups[joint.parent].of(&joint.at(numbers));
        }
    }

    /// Returns for each number whether a whole turn more gives the same configuration: it has no limits, and turns each joint that
    /// it sets by a whole multiple.
    pub(crate) fn turning(&self) -> Vec<bool> {
        let mut turning: Vec<bool> =
            self.limits.iter().map(|limits| limits.iter().all(|limit| limit.is_infinite())).collect();
        for joint in &self.joints {
            match joint.kind {
                Kind::Turn { by, .. } => turning[by.number] &= by.factor.fract() == 0.0,
                Kind::Slide { by, .. } => turning[by.number] = false,
                Kind::Planar(first) => turning[first..first + 2].fill(false),
                Kind::Floating(first) => turning[first..first + 7].fill(false),
            }
        }
        turning
    }

    /// Adds a group, which is moved by a joint from another one.
    pub(crate) fn add_joint(&mut self, name: &str, parent: usize, origin: Frame, kind: Kind) -> usize {
        let child = self.groups.len();
        self.groups.push(Some(self.joints.len()));
        self.joints.push(Joint { name: name.to_owned(), parent, child, origin, kind });
        child
    }

    /// Returns the joints above a group, from there to the root.
    pub(crate) fn above(&self, group: usize) -> impl Iterator<Item = usize> {
        self.between(group, 0)
    }

    /// Returns the joints between a group and one that it hangs from, in this order.
    pub(crate) fn between(&self, group: usize, top: usize) -> impl Iterator<Item = usize> {
        let above = move |group: usize| self.groups[group].filter(|_| group != top);
        std::iter::successors(above(group), move |&joint| above(self.joints[joint].parent))
    }

    /// Returns the group nearest to two groups that both hang from.
    pub(crate) fn common(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            // Each group comes after the one that it hangs from.
            let later = if a > b { &mut a } else { &mut b };
            let joint =
                self.groups[*later].expect("only the first group has no joint, and no other comes before it");
            *later = self.joints[joint].parent;
        }
        a
    }

    /// Returns the number of a link.
    pub(crate) fn link(&self, name: &str) -> Result<usize, RobotError> {
        self.links.iter().position(|link| link.name == name).ok_or_else(|| RobotError::Unknown {
            what: "a link",
            name: name.to_owned(),
            known: self.links.iter().map(|link| link.name.clone()).collect(),
        })
    }
}

impl Joint {
    /// Returns the frame of the child in that of the parent.
    #[inline]
    pub(crate) fn at(&self, numbers: &[f64]) -> Frame {
        match &self.kind {
            Kind::Turn { by, turns: [still, first, second], .. } => {
                let (sin, cos) = libm::sincos(by.at(numbers));
                let versine = 1.0 - cos;
                let rotation = each(|i| each(|j| still[i][j] + sin * first[i][j] + versine * second[i][j]));
                Frame { rotation, translation: self.origin.translation }
            }
            Kind::Slide { by, axis } => {
                let way = by.at(numbers);
                let translation = self.origin.place(axis.map(|x| way * x));
                Frame { rotation: self.origin.rotation, translation }
            }
            &Kind::Planar(first) => {
                let [x, y, angle] = [0, 1, 2].map(|k| numbers[first + k]);
                self.origin.of(&Frame::from_angles([0.0, 0.0, angle], [x, y, 0.0]))
            }
            &Kind::Floating(first) => {
                let long = quaternion_length(numbers, first);
                let quaternion = [3, 4, 5, 6].map(|k| numbers[first + k] / long);
                self.origin.of(&Frame::from_quaternion(quaternion, [0, 1, 2].map(|k| numbers[first + k])))
            }
        }
    }
}

/// Returns the length of the quaternion of a floating joint.
pub(crate) fn quaternion_length(numbers: &[f64], first: usize) -> f64 {
    let [x, y, z, w] = [3, 4, 5, 6].map(|k| numbers[first + k]);
    (x * x + y * y + z * z + w * w).sqrt()
}
