//! Moves a pose to where the meshes start to touch, until two neighbouring f64 numbers give different answers.

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use bvh_query::Pose;

/// Two meshes, and poses that depend on one parameter.
pub(crate) struct Walk<'a> {
    pub(crate) asked: Asked<'a>,
    pub(crate) surfaces: [&'a Surface; 2],
    pub(crate) pose: &'a dyn Fn(f64) -> Option<Pose>,
    /// The pair of triangles that touched last.
    pub(crate) hint: (usize, usize),
}

/// Returns an integer such that integers are in the order of the numbers.
fn order(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    if bits < 0 { i64::MIN - bits } else { bits }
}

fn from_order(order: i64) -> f64 {
    f64::from_bits(if order < 0 { i64::MIN - order } else { order } as u64)
}

impl Walk<'_> {
    /// Returns whether the meshes meet, by the oracle. The library must give the same answer.
    pub(crate) fn collide(&mut self, x: f64, tally: &mut Tally) -> Result<bool, String> {
        let pose = (self.pose)(x).ok_or("no such pose")?;
        let truth = Truth::new(self.surfaces[0], self.surfaces[1], &pose);
        let expected = truth.collide(&mut self.hint, tally);
        tally.poses += 1;
        self.asked.collide(expected, &pose, tally).map_err(|error| format!("{error}; {}", show(&pose)))?;
        Ok(expected)
    }

    /// Asks every query.
    pub(crate) fn all(&mut self, x: f64, tally: &mut Tally) -> Result<(), String> {
        let Some(pose) = (self.pose)(x) else { return Ok(()) };
        let truth = Truth::new(self.surfaces[0], self.surfaces[1], &pose);
        self.asked.all(&truth, &pose, tally).map_err(|error| format!("{error}; {}", show(&pose)))
    }

    /// Bisects from `one` to `other`, of which exactly one is a contact, down to neighbouring numbers. Asks every
    /// query around them.
    pub(crate) fn find_boundary(&mut self, one: f64, other: f64, tally: &mut Tally) -> Result<f64, String> {
        let (mut one, mut other) = (order(one), order(other));
        let touching = self.collide(from_order(one), tally)?;
        while one.abs_diff(other) > 1 {
            let middle = one.midpoint(other);
            if self.collide(from_order(middle), tally)? == touching { one = middle } else { other = middle }
        }
        tally.boundaries += 2;
        for step in -1..=1 {
            self.all(from_order(one + step), tally)?;
            self.all(from_order(other + step), tally)?;
        }
        Ok(from_order(if touching { other } else { one }))
    }
}

/// Shows all bits of a pose.
fn show(pose: &Pose) -> String {
    format!("pose {:?} {:?}", pose.rotation(), pose.translation())
}
