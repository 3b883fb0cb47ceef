//! Whole turns: brings a goal to where a straight motion is the short way.

use crate::error::RobotError;
use crate::robot::Robot;
use std::f64::consts::{PI, TAU};

/// What `TAU` lacks of a whole turn, rounded to nearest.
const TAU_REST: f64 = 2.449_293_598_294_706_4e-16;
/// The farthest that a goal may be from its start, in radians. Up to here, no rounding reaches the number of turns.
const MAX_APART: f64 = 1e9;

impl Robot {
    /// Returns a goal with whole turns added or taken away, so that each joint that turns without limits goes the short way: by at
    /// most half a turn from the start. The robot is in the same place, but for the rounding of the angle to the nearest `f64`.
    ///
    /// Motions are straight in joint values, so that a continuous joint from 3.0 to -3.0 goes 6 radians the long way. From 3.0 to
    /// the nearest goal, 3.283, it goes 0.283. MoveIt and OMPL (`SO2StateSpace`) interpolate so; a joint with limits goes straight
    /// there as well.
    ///
    /// These values turn without limits: those of continuous joints, of revolute ones without limits, and `NAME/theta` of planar
    /// ones. Other values stay as they are. So do those that also set a mimic joint that slides, or that turns by another multiple
    /// than a whole number: a whole turn puts that one elsewhere. A floating joint turns the shorter way anyway. A value that is at
    /// most half a turn away stays as it is, to the bit.
    ///
    /// ```
    /// # fn way(robot: &mut cbvh_robot::Robot, start: &[f64], goal: &[f64]) -> Result<bool, cbvh_robot::RobotError> {
    /// let goal = robot.nearest_turns(start, goal)?;
    /// robot.is_free(start, &goal)
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RobotError::Count`], and [`RobotError::Value`] for invalid joint values and for angles that are more than 10^9 radians
    /// apart.
    pub fn nearest_turns(&self, start: &[f64], goal: &[f64]) -> Result<Vec<f64>, RobotError> {
        let model = &self.setting.model;
        model.check(start)?;
        model.check(goal)?;
        let mut nearest = goal.to_vec();
        for (number, _) in model.turning().iter().enumerate().filter(|(_, turns)| **turns) {
            let apart = goal[number] - start[number];
            if apart.abs() > MAX_APART {
                let (joint, expected) =
                    (model.numbers[number].clone(), "an angle within 10^9 radians of the start");
                return Err(RobotError::Value { joint, expected, found: goal[number] });
            }
            if apart.abs() > PI {
                nearest[number] = turned(goal[number], -(apart / TAU).round());
            }
        }
        Ok(nearest)
    }
}

/// Returns an angle and whole turns. The sum is rounded twice, by a part of itself and not of the angle.
fn turned(angle: f64, turns: f64) -> f64 {
    libm::fma(turns, TAU_REST, libm::fma(turns, TAU, angle))
}
