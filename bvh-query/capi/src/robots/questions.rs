//! Questions about configurations of a robot, and about its motions.

use super::{ask, numbered};
use crate::entry::{entry, questions};
use crate::input::{self, each, reserve};
use crate::output::{List, Lists, Room};
use crate::status::Failure;
use crate::types::{
    BodyPairRow, FREE, HIT, MotionChoices, NEAR, PenetrationChoices, PoseRows, RobotDistanceRow, RobotHandle,
    RobotMotionRow, RobotNearPairRow, RobotSignedDistanceRow,
};
use bvh_query::{MotionOptions, NumberError, QueryError};
use cbvh_robot::{Edge, NearPair, Robot, RobotDistance, RobotError, RobotMotion, RobotSignedDistance};

/// Configurations, or other rows of numbers that a robot is asked about.
struct Rows {
    name: &'static str,
    numbers: *const f64,
    /// How many joint values a row is about, and how many numbers it has for each.
    joints: usize,
    per_joint: usize,
    count: usize,
}

impl Rows {
    /// Copies the numbers.
    ///
    /// # Safety
    /// As for `array`.
    unsafe fn read(&self, robot: &Robot) -> Result<Vec<f64>, Failure> {
        let expected = robot.joints().len();
        if self.joints != expected {
            let expected = format!("{expected}, as many as the robot has joint values");
            return Err(Failure::argument("joint_count", expected, self.joints));
        }
        let count = self.joints.saturating_mul(self.per_joint).saturating_mul(self.count);
        let mut copied = Vec::new();
        // SAFETY: the caller vouches for it.
        unsafe { each(self.name, self.numbers, count, &mut copied, |number| Ok(*number)) }?;
        Ok(copied)
    }

    /// Divides the numbers into rows. A robot may have no joint values.
    fn of<'a>(&self, numbers: &'a [f64]) -> impl Iterator<Item = &'a [f64]> + use<'a> {
        let length = self.joints * self.per_joint;
        (0..self.count).map(move |row| &numbers[row * length..][..length])
    }

    /// Says in which row something was found.
    fn at<'a>(&'a self, row: usize) -> impl Fn(RobotError) -> Failure + 'a {
        move |error| Failure::from(error).at(format_args!("{}[{row}]", self.name))
    }

    /// Copies configurations, and checks them.
    ///
    /// # Safety
    /// As for `array`.
    unsafe fn configurations(&self, robot: &Robot) -> Result<Vec<f64>, Failure> {
        // SAFETY: the caller vouches for it.
        let numbers = unsafe { self.read(robot) }?;
        for (row, joints) in self.of(&numbers).enumerate() {
            robot.check(joints).map_err(self.at(row))?;
        }
        Ok(numbers)
    }
}

/// A question about configurations.
struct Configurations(RobotHandle, Rows);

impl Configurations {
    /// Asks about each configuration on the calling thread, or about all on all cores, and lets `write` write the answers to `out`.
    ///
    /// # Safety
    /// As for `array`.
    unsafe fn ask<O, T>(
        &self,
        out: impl FnOnce() -> Result<O, Failure>,
        one: impl Fn(&mut Robot, &[f64]) -> Result<T, RobotError>,
        all: impl FnOnce(&mut Robot, &[f64]) -> Result<Vec<T>, RobotError>,
        write: impl FnOnce(O, &Robot, Vec<T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Self(robot, rows) = self;
        ask(*robot, |own, parallel| {
            // SAFETY: the caller vouches for it.
            let numbers = unsafe { rows.configurations(own) }?;
            let out = out()?;
            let found = if parallel && !numbers.is_empty() {
                all(own, &numbers)?
            } else {
                let mut found = Vec::new();
                reserve("answers", rows.count, &mut found)?;
                for (row, joints) in rows.of(&numbers).enumerate() {
                    found.push(one(own, joints).map_err(rows.at(row))?);
                }
                found
            };
            write(out, own, found)
        })
    }

    /// Asks for an answer about each.
    ///
    /// # Safety
    /// As for `array` and `Room::new`.
    unsafe fn answer<T, R: Copy>(
        self,
        answers: *mut R,
        one: impl Fn(&mut Robot, &[f64]) -> Result<T, RobotError>,
        all: impl FnOnce(&mut Robot, &[f64]) -> Result<Vec<T>, RobotError>,
        row: impl Fn(&Robot, T) -> R,
    ) -> Result<(), Failure> {
        // SAFETY: the caller vouches for it.
        unsafe {
            let room = || Room::new("answers", answers, self.1.count);
            self.ask(room, one, all, |mut room, own, found| {
                room.fill(found.into_iter().map(Ok::<_, Failure>), |found| row(own, found))
            })
        }
    }

    /// Asks for an answer about each, as a function of the interface.
    ///
    /// # Safety
    /// As for `array` and `Room::new`.
    unsafe fn each<T, R: Copy>(
        self,
        answers: *mut R,
        one: impl Fn(&mut Robot, &[f64]) -> Result<T, RobotError>,
        all: impl FnOnce(&mut Robot, &[f64]) -> Result<Vec<T>, RobotError>,
        row: impl Fn(&Robot, T) -> R,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        entry(|| unsafe { self.answer(answers, one, all, row) })
    }
}

/// Returns a question about configurations.
fn configurations(robot: RobotHandle, numbers: *const f64, joints: usize, count: usize) -> Configurations {
    Configurations(robot, Rows { name: "joints", numbers, joints, per_joint: 1, count })
}

questions! {
    (robot: RobotHandle, joints: *const f64, joint_count: usize, count: usize,)
        => configurations(robot, joints, joint_count, count);
    cbvh_robot_collide() -> bool:
        |robot, joints| robot.collide(joints), |robot, joints| robot.collide_many(joints), |_, answer| answer;
    cbvh_robot_distances() -> RobotDistanceRow:
        |robot, joints| robot.distance(joints), |robot, joints| robot.distance_many(joints), distance;
}

/// Makes the row of the nearest bodies. Its points are in the world.
fn distance(robot: &Robot, of: Option<RobotDistance>) -> RobotDistanceRow {
    let Some(RobotDistance { bodies, mut nearest, points: [point_a, point_b], .. }) = of else {
        return input::Plain::NONE;
    };
    (nearest.point_a, nearest.point_b) = (point_a, point_b);
    RobotDistanceRow { pair: numbered(robot, &bodies), nearest: nearest.into(), found: 1, reserved: 0 }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_signed_distances(
    robot: RobotHandle,
    joints: *const f64,
    joint_count: usize,
    count: usize,
    options: *const PenetrationChoices,
    answers: *mut RobotSignedDistanceRow,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        // No configuration is to blame for them.
        options.check()?;
        configurations(robot, joints, joint_count, count).answer(
            answers,
            |robot, joints| robot.signed_distance(joints, &options),
            |robot, joints| robot.signed_distance_many(joints, &options),
            signed_distance,
        )
    })
}

/// Makes the row of the bodies with the least signed distance.
fn signed_distance(robot: &Robot, of: Option<RobotSignedDistance>) -> RobotSignedDistanceRow {
    let Some(RobotSignedDistance { bodies, nearest, .. }) = of else { return input::Plain::NONE };
    RobotSignedDistanceRow { pair: numbered(robot, &bodies), nearest: nearest.into(), found: 1, reserved: 0 }
}

/// Room for a list of pairs of bodies for each configuration.
struct Pairs {
    counts: *mut usize,
    pairs: *mut BodyPairRow,
    capacity: usize,
    count: *mut usize,
}

impl Configurations {
    /// Lists pairs of bodies for each configuration.
    ///
    /// # Safety
    /// As for `array` and `Lists::new`.
    unsafe fn pairs(
        &self,
        to: Pairs,
        one: impl Fn(&mut Robot, &[f64]) -> Result<Vec<[String; 2]>, RobotError>,
        all: impl FnOnce(&mut Robot, &[f64]) -> Result<Vec<Vec<[String; 2]>>, RobotError>,
    ) -> i32 {
        let Pairs { counts, pairs, capacity, count } = to;
        // SAFETY: the caller vouches for it.
        entry(|| unsafe {
            let room = || Lists::new(("pairs", pairs, capacity, count), counts, self.1.count);
            self.ask(room, one, all, |lists, own, found| {
                let rows = |pairs: &Vec<_>| Ok(pairs.iter().map(|pair| numbered(own, pair)).collect());
                lists.finish_with::<BodyPairRow, Failure>(found.iter().map(rows))
            })
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_pairs_in_contact(
    robot: RobotHandle,
    joints: *const f64,
    joint_count: usize,
    count: usize,
    counts: *mut usize,
    pairs: *mut BodyPairRow,
    capacity: usize,
    pair_count: *mut usize,
) -> i32 {
    let to = Pairs { counts, pairs, capacity, count: pair_count };
    // SAFETY: the header asks for it.
    unsafe {
        configurations(robot, joints, joint_count, count).pairs(
            to,
            |robot, joints| robot.pairs_in_contact(joints),
            |robot, joints| robot.pairs_in_contact_many(joints),
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_pairs_inside(
    robot: RobotHandle,
    joints: *const f64,
    joint_count: usize,
    count: usize,
    counts: *mut usize,
    pairs: *mut BodyPairRow,
    capacity: usize,
    pair_count: *mut usize,
) -> i32 {
    let to = Pairs { counts, pairs, capacity, count: pair_count };
    // SAFETY: the header asks for it.
    unsafe {
        configurations(robot, joints, joint_count, count).pairs(
            to,
            |robot, joints| robot.pairs_inside(joints),
            |robot, joints| robot.pairs_inside_many(joints),
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_near_pairs(
    robot: RobotHandle,
    joints: *const f64,
    joint_count: usize,
    count: usize,
    margin: f64,
    options: *const PenetrationChoices,
    counts: *mut usize,
    pairs: *mut RobotNearPairRow,
    gradients: *mut f64,
    capacity: usize,
    pair_count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        // No configuration is to blame for them.
        options.check()?;
        if !(0.0..f64::INFINITY).contains(&margin) {
            return Err(QueryError::from(NumberError::Margin(margin)).into());
        }
        let room = || {
            let lists = Lists::new(("pairs", pairs, capacity, pair_count), counts, count)?;
            let slopes = if gradients.is_null() { 0 } else { capacity.saturating_mul(joint_count) };
            Ok((lists, Room::new("gradients", gradients, slopes)?))
        };
        configurations(robot, joints, joint_count, count).ask(
            room,
            |robot, joints| robot.near_pairs(joints, margin, &options),
            |robot, joints| robot.near_pairs_many(joints, margin, &options),
            |(lists, mut slopes), own, found| {
                let all = found.iter().flatten().flat_map(|pair| &pair.gradient);
                all.enumerate().for_each(|(place, slope)| slopes.set(place, *slope));
                let rows =
                    |pairs: Vec<NearPair>| Ok(pairs.into_iter().map(|pair| near(own, &pair)).collect());
                lists.finish_with::<RobotNearPairRow, Failure>(found.into_iter().map(rows))
            },
        )
    })
}

fn near(robot: &Robot, of: &NearPair) -> RobotNearPairRow {
    let distance = of.nearest.distance;
    RobotNearPairRow { pair: numbered(robot, &of.bodies), distance, nearest: of.nearest.into() }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_link_poses(
    robot: RobotHandle,
    joints: *const f64,
    joint_count: usize,
    count: usize,
    poses: *mut PoseRows,
    capacity: usize,
    pose_count: *mut usize,
) -> i32 {
    let of = |robot: &mut Robot, joints: &[f64]| robot.link_poses(joints);
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        configurations(robot, joints, joint_count, count).ask(
            || List::new("poses", poses, capacity, pose_count),
            of,
            |robot, all| all.chunks(joint_count).map(|joints| of(robot, joints)).collect(),
            |mut list, _, found| {
                list.add(found.iter().flatten());
                list.finish()
            },
        )
    })
}

/// A question about motions.
struct Motions<R>(RobotHandle, *const MotionChoices, usize, R);

impl<R: FnOnce(&Robot) -> Result<Vec<Edge>, Failure>> Motions<R> {
    /// Asks about each motion.
    ///
    /// # Safety
    /// As for `options` and `Room::new`.
    unsafe fn each<T, A: Copy>(
        self,
        answers: *mut A,
        one: impl Fn(&mut Robot, &Edge, &MotionOptions) -> Result<T, RobotError>,
        all: impl FnOnce(&mut Robot, &[Edge], &MotionOptions) -> Result<Vec<T>, RobotError>,
        row: impl Fn(&Robot, T) -> A,
    ) -> i32 {
        let Self(robot, choices, count, read) = self;
        let asked = |own: &mut Robot, parallel: bool| {
            let edges = read(own)?;
            // SAFETY: the caller vouches for it.
            let (options, mut room) = unsafe {
                (input::options("options", choices)?.read(), Room::new("answers", answers, count)?)
            };
            let found = if parallel {
                all(own, &edges, &options)?
            } else {
                edges.iter().map(|edge| one(own, edge, &options)).collect::<Result<_, _>>()?
            };
            room.fill(found.into_iter().map(Ok::<_, Failure>), |found| row(own, found))
        };
        entry(|| ask(robot, asked))
    }
}

/// Makes motions straight from one configuration to another each.
///
/// # Safety
/// As for `array`.
unsafe fn straight(robot: &Robot, starts: &Rows, ends: &Rows) -> Result<Vec<Edge>, Failure> {
    // SAFETY: the caller vouches for it.
    let (from, to) = unsafe { (starts.configurations(robot)?, ends.configurations(robot)?) };
    let mut edges = Vec::new();
    reserve(starts.name, starts.count, &mut edges)?;
    for (row, (from, to)) in starts.of(&from).zip(ends.of(&to)).enumerate() {
        edges.push(Edge::straight(from, to).map_err(starts.at(row))?);
    }
    Ok(edges)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_nearest_turns(
    robot: RobotHandle,
    starts: *const f64,
    ends: *const f64,
    joint_count: usize,
    count: usize,
    nearest: *mut f64,
) -> i32 {
    let rows = |name, numbers| Rows { name, numbers, joints: joint_count, per_joint: 1, count };
    let (starts, ends) = (rows("starts", starts), rows("ends", ends));
    let turned = |own: &mut Robot, _| {
        // SAFETY: the header asks for it. The numbers are copied before any is written.
        let (from, to, mut room) = unsafe {
            let (from, to) = (starts.configurations(own)?, ends.configurations(own)?);
            (from, to, Room::new("nearest", nearest, joint_count * count)?)
        };
        for (row, (from, to)) in starts.of(&from).zip(ends.of(&to)).enumerate() {
            let turned = own.nearest_turns(from, to).map_err(ends.at(row))?;
            (0..).zip(turned).for_each(|(number, value)| room.set(row * joint_count + number, value));
        }
        Ok(())
    };
    entry(|| ask(robot, turned))
}

/// Makes motions on which each joint value follows a polynomial.
///
/// # Safety
/// As for `array`.
unsafe fn polynomials(robot: &Robot, rows: &Rows) -> Result<Vec<Edge>, Failure> {
    if rows.per_joint == 0 {
        return Err(Failure::argument("coefficient_count", "at least 1", 0));
    }
    // SAFETY: the caller vouches for it.
    let numbers = unsafe { rows.read(robot) }?;
    let mut edges = Vec::new();
    reserve(rows.name, rows.count, &mut edges)?;
    for (row, of) in rows.of(&numbers).enumerate() {
        let edge = Edge::polynomials(of.chunks(rows.per_joint).map(<[f64]>::to_vec).collect());
        robot.check_edge(&edge).map_err(rows.at(row))?;
        edges.push(edge);
    }
    Ok(edges)
}

questions! {
    (robot: RobotHandle, starts: *const f64, ends: *const f64, joint_count: usize, count: usize,
        options: *const MotionChoices,)
        => Motions(robot, options, count, |robot: &Robot| {
            let rows = |name, numbers| Rows { name, numbers, joints: joint_count, per_joint: 1, count };
            straight(robot, &rows("starts", starts), &rows("ends", ends))
        });
    cbvh_robot_edges_are_free() -> bool:
        |robot, edge, options| robot.is_edge_free(edge, options),
        |robot, edges, options| robot.are_free(edges, options), |_, answer| answer;
    cbvh_robot_edge_motions() -> RobotMotionRow:
        |robot, edge, options| robot.motion(edge, options),
        |robot, edges, options| robot.motions(edges, options), motion;
}

questions! {
    (robot: RobotHandle, coefficients: *const f64, coefficient_count: usize, joint_count: usize, count: usize,
        options: *const MotionChoices,)
        => Motions(robot, options, count, |robot: &Robot| {
            let (name, per_joint) = ("coefficients", coefficient_count);
            polynomials(robot, &Rows { name, numbers: coefficients, joints: joint_count, per_joint, count })
        });
    cbvh_robot_are_free() -> bool:
        |robot, edge, options| robot.is_edge_free(edge, options),
        |robot, edges, options| robot.are_free(edges, options), |_, answer| answer;
    cbvh_robot_motions() -> RobotMotionRow:
        |robot, edge, options| robot.motion(edge, options),
        |robot, edges, options| robot.motions(edges, options), motion;
}

/// Makes the row of a motion. Its points are in the world.
fn motion(robot: &Robot, of: RobotMotion) -> RobotMotionRow {
    let (outcome, free_until, at, bodies, mut nearest, points) = match of {
        RobotMotion::Hit { free_until, touching_at, bodies, nearest, points, .. } => {
            (HIT, free_until, touching_at, bodies, nearest, points)
        }
        RobotMotion::Near { free_until, at, bodies, nearest, points, .. } => {
            (NEAR, free_until, at, bodies, nearest, points)
        }
        _ => return RobotMotionRow { outcome: FREE, free_until: 1.0, ..input::Plain::NONE },
    };
    [nearest.point_a, nearest.point_b] = points;
    let (pair, reserved) = (numbered(robot, &bodies), 0);
    RobotMotionRow { outcome, reserved, free_until, at, pair, nearest: nearest.into() }
}
