//! Questions about configurations: one, or many on all threads.

use crate::asker::{Asker, Nearest};
use crate::error::RobotError;
use crate::robot::Robot;
use crate::setting::Setting;
use bvh_query::{Distance, PenetrationOptions, SignedDistance};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::PI;

/// The nearest two bodies.
///
/// [`Robot::distance`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RobotDistance {
    /// The names of both.
    pub bodies: [String; 2],
    /// How far they are apart, and which triangles are nearest. Its points are in the frames of shapes.
    pub nearest: Distance,
    /// The nearest points of both, in the world.
    pub points: [[f64; 3]; 2],
}

/// The two bodies with the least signed distance.
///
/// [`Robot::signed_distance`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RobotSignedDistance {
    /// The names of both.
    pub bodies: [String; 2],
    /// How far they are apart or, below zero, how deep they overlap, with points, normal and translation turned into the world, which
    /// rounds them.
    pub nearest: SignedDistance,
}

impl Robot {
    /// Returns whether any two bodies touch. A body that is inside a mesh without touching it does not: see
    /// [`Robot::pairs_inside`].
    ///
    /// Cost: the poses of all links, a comparison of balls for each pair, and a query about contact for pairs whose balls
    /// meet, until one touches.
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// assert!(!robot.collide(&[0.0; 4])?);
    /// assert!(robot.collide(&[0.0, 2.8, 2.8, 0.0])?); // folded into itself
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`RobotError::Count`] and [`RobotError::Value`] for invalid joint values, [`RobotError::Pose`] if a link is too far away,
    /// and [`RobotError::Pair`] if a query has no answer.
    pub fn collide(&mut self, joints: &[f64]) -> Result<bool, RobotError> {
        self.refresh();
        self.asker.collide(&self.setting, joints)
    }

    /// Returns the bodies that touch, in the order of [`Robot::pairs`].
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// assert!(robot.pairs_in_contact(&[0.0; 4])?.is_empty());
    /// for [a, b] in robot.pairs_in_contact(&[0.0, 2.8, 2.8, 0.0])? {
    ///     println!("{a} touches {b}");
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`].
    pub fn pairs_in_contact(&mut self, joints: &[f64]) -> Result<Vec<[String; 2]>, RobotError> {
        self.refresh();
        let touching = self.asker.touching(&self.setting, joints)?;
        Ok(names(&self.setting, parts_of(&self.setting, touching)))
    }

    /// Returns the bodies that are inside others without touching them, each with the body around it. [`Robot::collide`] does not
    /// find them, and a motion within is free, because a mesh is its surface: a room may stand around a robot. If the outer body
    /// is meant to be full, add its shape as a solid ([`OwnedShape::solid`](bvh_query::OwnedShape::solid)), or call
    /// [`Robot::make_solid`]; both bodies then touch.
    ///
    /// A body counts if a connected part of it is inside a shape of the other one. A shape that is not closed has nothing inside.
    ///
    /// Cost: that of [`Robot::pairs_in_contact`], and a query about contact for pairs whose boxes meet.
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// # let room = bvh_bake::to_bytes(&bvh_bake::shapes::block([9.0; 3])?, &Default::default())?.0;
    /// # let room = bvh_query::Bvh::from_bytes(room)?;
    /// robot.add_obstacle("room", room, &bvh_query::Pose::IDENTITY)?; // a block of 9 m
    /// assert!(!robot.collide(&[0.0; 4])?); // the walls are far away
    /// assert!(robot.pairs_inside(&[0.0; 4])?.contains(&["hand".to_owned(), "room".to_owned()]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`]; [`RobotError::Pair`] also if a file in question was baked without topology.
    pub fn pairs_inside(&mut self, joints: &[f64]) -> Result<Vec<[String; 2]>, RobotError> {
        self.refresh();
        let inside = self.asker.inside(&self.setting, joints)?;
        Ok(names(&self.setting, inside))
    }

    /// Returns the nearest two bodies; `None` if there are no pairs.
    ///
    /// ```
    /// use cbvh_robot::RobotDistance;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let Some(RobotDistance { bodies, nearest, points, .. }) = robot.distance(&[0.0; 4])? else { panic!() };
    /// println!("{} and {} are {} m apart", bodies[0], bodies[1], nearest.distance);
    /// let squared: f64 = (0..3).map(|k| (points[0][k] - points[1][k]).powi(2)).sum();
    /// assert!((squared.sqrt() - nearest.distance).abs() < 1e-9); // the points are in the world
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`].
    pub fn distance(&mut self, joints: &[f64]) -> Result<Option<RobotDistance>, RobotError> {
        self.refresh();
        let nearest = self.asker.nearest(&self.setting, joints)?;
        Ok(nearest.map(|nearest| of_bodies(&self.setting, nearest)))
    }

    /// Returns the two bodies with the least signed distance: those that overlap most or, where none do, the nearest ones. `None` if
    /// there are no pairs. No other two have a lower one, but for roundings and how far bounds of depths are apart. A body inside another one overlaps it,
    /// unless one of them is not closed.
    ///
    /// Cost: that of [`Robot::distance`], and a depth for each pair that overlaps.
    ///
    /// ```
    /// use bvh_query::PenetrationOptions;
    /// use cbvh_robot::RobotSignedDistance;
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let folded = robot.signed_distance(&[0.0, 2.8, 2.8, 0.0], &PenetrationOptions::new())?;
    /// let Some(RobotSignedDistance { bodies, nearest, .. }) = folded else { panic!() };
    /// println!("{} and {} overlap by {} m at most", bodies[0], bodies[1], -nearest.lower);
    /// assert!(nearest.upper < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`]; [`RobotError::Query`] if an option is invalid; [`RobotError::Pair`] also if a file in question
    /// was baked without topology.
    pub fn signed_distance(
        &mut self,
        joints: &[f64],
        options: &PenetrationOptions,
    ) -> Result<Option<RobotSignedDistance>, RobotError> {
        self.refresh();
        let nearest = self.asker.nearest_signed(&self.setting, joints, options)?;
        Ok(nearest.map(|nearest| signed_of_bodies(&self.setting, nearest)))
    }

    /// Returns the two bodies with the least signed distance for each of many configurations, as [`Robot::collide_many`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::collide_many`] and [`Robot::signed_distance`].
    pub fn signed_distance_many(
        &mut self,
        joints: &[f64],
        options: &PenetrationOptions,
    ) -> Result<Vec<Option<RobotSignedDistance>>, RobotError> {
        self.many(joints, |asker, setting, joints| {
            let nearest = asker.nearest_signed(setting, joints, options)?;
            Ok(nearest.map(|nearest| signed_of_bodies(setting, nearest)))
        })
    }

    /// Returns for each of many configurations, one after the other, whether any two bodies touch. Uses all threads of the rayon
    /// pool in which it is called; the answers do not depend on their number.
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let two = [0.0, 0.0, 0.0, 0.0, /* and */ 0.0, 2.8, 2.8, 0.0];
    /// assert_eq!(robot.collide_many(&two)?, [false, true]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`], for the first configuration that has one, with [`RobotError::Row`] around those of its numbers;
    /// [`RobotError::Count`] if the numbers are no whole number of configurations.
    pub fn collide_many(&mut self, joints: &[f64]) -> Result<Vec<bool>, RobotError> {
        self.many(joints, Asker::collide)
    }

    /// Returns the nearest two bodies for each of many configurations, as [`Robot::collide_many`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::collide_many`].
    pub fn distance_many(&mut self, joints: &[f64]) -> Result<Vec<Option<RobotDistance>>, RobotError> {
        self.many(joints, |asker, setting, joints| {
            Ok(asker.nearest(setting, joints)?.map(|nearest| of_bodies(setting, nearest)))
        })
    }

    /// Returns the bodies that touch for each of many configurations, as [`Robot::collide_many`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::collide_many`].
    pub fn pairs_in_contact_many(&mut self, joints: &[f64]) -> Result<Vec<Vec<[String; 2]>>, RobotError> {
        self.many(joints, |asker, setting, joints| {
            Ok(names(setting, parts_of(setting, asker.touching(setting, joints)?)))
        })
    }

    /// Returns the bodies that are inside others for each of many configurations, as [`Robot::collide_many`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::collide_many`] and [`Robot::pairs_inside`].
    pub fn pairs_inside_many(&mut self, joints: &[f64]) -> Result<Vec<Vec<[String; 2]>>, RobotError> {
        self.many(joints, |asker, setting, joints| Ok(names(setting, asker.inside(setting, joints)?)))
    }

    /// Asks about many configurations.
    pub(crate) fn many<R: Send>(
        &mut self,
        joints: &[f64],
        ask: impl Fn(&mut Asker, &Setting, &[f64]) -> Result<R, RobotError> + Sync,
    ) -> Result<Vec<R>, RobotError> {
        self.refresh();
        let expected = self.setting.model.numbers.len();
        if expected == 0 || !joints.len().is_multiple_of(expected) {
            return Err(RobotError::Count { expected, found: joints.len() });
        }
        let named = |(row, answer): (usize, Result<R, RobotError>)| answer.map_err(|error| error.in_row(row));
        let setting = &*self.setting;
        if rayon::current_num_threads() == 1 {
            let asker = &mut self.asker;
            return joints
                .chunks(expected)
                .map(|joints| ask(asker, setting, joints))
                .enumerate()
                .map(named)
                .collect();
        }
        let asker = &self.asker;
        // Long runs, so that an asker remembers what is near.
        let run = (joints.len() / expected).div_ceil(4 * rayon::current_num_threads()).clamp(1, 256);
        let answers: Vec<Vec<Result<R, RobotError>>> = joints
            .par_chunks(run * expected)
            .map_init(
                || asker.clone(),
                |asker, run| run.chunks(expected).map(|joints| ask(asker, setting, joints)).collect(),
            )
            .collect();
        answers.into_iter().flatten().enumerate().map(named).collect()
    }

    /// Allows contact between pairs that collide in nearly every configuration: in at least this share of some random configurations
    /// within the joints' limits, as MoveIt's assistant does. A joint value without limits is taken between -pi and pi. Returns the
    /// pairs, each with its share. The configurations are the same each time.
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// let allowed = robot.allow_frequent(100, 0.95)?;
    /// let neighbours = ["turret".to_owned(), "upper_arm".to_owned()];
    /// assert!(allowed.contains(&(neighbours, 1.0))); // they overlap at their joint
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::collide`].
    pub fn allow_frequent(
        &mut self,
        samples: usize,
        share: f64,
    ) -> Result<Vec<([String; 2], f64)>, RobotError> {
        let model = self.setting.model.clone();
        if model.numbers.is_empty() {
            return Ok(Vec::new());
        }
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut times: HashMap<[String; 2], usize> = HashMap::new();
        let mut left = samples;
        while left > 0 {
            let some = left.min(SAMPLES_AT_ONCE);
            left -= some;
            let mut joints = Vec::new();
            for [lower, upper] in (0..some).flat_map(|_| &model.limits) {
                let is_limited = upper - lower < f64::INFINITY;
                let [lower, upper] = if is_limited { [*lower, *upper] } else { [-PI, PI] };
                joints.push(lower + (upper - lower) * random());
            }
            for pair in self.pairs_in_contact_many(&joints)?.into_iter().flatten() {
                *times.entry(pair).or_default() += 1;
            }
        }
        let mut frequent = Vec::new();
        for pair in self.pairs() {
            let times = times.get(&pair).copied().unwrap_or(0);
            let part = times as f64 / samples.max(1) as f64;
            if times > 0 && part >= share {
                self.allow(&pair[0], &pair[1])?;
                frequent.push((pair, part));
            }
        }
        Ok(frequent)
    }
}

/// The random configurations that are in memory at a time.
const SAMPLES_AT_ONCE: usize = 1024;

/// Returns the parts of pairs.
fn parts_of(setting: &Setting, pairs: Vec<usize>) -> impl Iterator<Item = [usize; 2]> {
    pairs.into_iter().map(|number| [setting.pairs[number].a, setting.pairs[number].b])
}

/// Returns the names of the bodies of pairs of parts, each once.
fn names(setting: &Setting, parts: impl IntoIterator<Item = [usize; 2]>) -> Vec<[String; 2]> {
    let mut names: Vec<[String; 2]> = Vec::new();
    for parts in parts {
        let bodies = setting.names(parts);
        if !names.contains(&bodies) {
            names.push(bodies);
        }
    }
    names
}

/// Returns the names of the bodies of a pair of parts.
pub(crate) fn bodies(setting: &Setting, pair: usize) -> [String; 2] {
    let pair = &setting.pairs[pair];
    setting.names([pair.a, pair.b])
}

fn signed_of_bodies(setting: &Setting, (pair, nearest): (usize, SignedDistance)) -> RobotSignedDistance {
    RobotSignedDistance { bodies: bodies(setting, pair), nearest }
}

fn of_bodies(setting: &Setting, Nearest { pair, distance, points }: Nearest) -> RobotDistance {
    RobotDistance { bodies: bodies(setting, pair), nearest: distance, points }
}
