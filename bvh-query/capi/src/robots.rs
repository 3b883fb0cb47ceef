//! Robots among obstacles: read from URDF files, changed, and asked about with the values of their joints.
//!
//! A question is about the robot as it is when the question begins (`shared`). Changes name bodies, and answers number them.

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::{entry, hand_out, questions, write};
use crate::input::{self, each, flag, optional, path, pointers, reserve, text};
use crate::mesh::check_regular;
use crate::output::{self, List, Lists, One, Room};
use crate::poses;
use crate::shared::{Shared, Snapshot};
use crate::status::{Failure, Status};
use crate::table::{Kind, Table};
use crate::types::{
    BASE_FIXED, BASE_FLOATING, BASE_PLANAR, Body, BodyPairRow, FREE, FrequentPairRow, HIT, JointValueRow,
    LimitsRow, MeshHandle, MotionChoices, NEAR, PoseRows, RobotChoices, RobotCounts, RobotDistanceRow,
    RobotHandle, RobotMotionRow,
};
use bvh_query::{MotionOptions, OwnedShape};
use cbvh_robot::{Base, Edge, Geometry, Robot, RobotDistance, RobotError, RobotMotion, RobotOptions};
use std::ffi::c_char;

/// All robots that are open.
static ROBOTS: Table<Shared<Robot>> = Table::new(Kind::Robot);

impl Snapshot for Robot {
    fn snapshot(&mut self) -> Self {
        Self::snapshot(self)
    }
}

/// Looks at a robot or changes it.
fn with<R>(robot: RobotHandle, act: impl FnOnce(&mut Robot) -> Result<R, Failure>) -> Result<R, Failure> {
    let shared = ROBOTS.share("robot", robot.id)?;
    let mut held = shared.lock("robot")?;
    act(&mut held.now)
}

/// Looks at a robot or changes it. What `act` returns is dropped without the lock.
fn see<R>(robot: RobotHandle, act: impl FnOnce(&mut Robot) -> Result<R, Failure>) -> i32 {
    entry(|| with(robot, act).map(drop))
}

/// Reads the options of a robot.
///
/// # Safety
/// As for `options`; its arrays and text are as the header says.
unsafe fn choices(pointer: *const RobotChoices) -> Result<RobotOptions, Failure> {
    // SAFETY: the caller vouches for it.
    let given = unsafe { input::options("options", pointer) }?;
    let mut options = RobotOptions::default();
    // SAFETY: as above.
    unsafe {
        options.packages =
            pointers("options.packages", given.packages, given.package_count, |name, of| path(name, of))?;
        options.srdf = optional(given.srdf, |of| path("options.srdf", of))?;
        options.cache = optional(given.cache, |of| path("options.cache", of))?;
    }
    match given.cylinder_error {
        0.0 => {}
        error if error.is_finite() && error > 0.0 => options.cylinder_error = error,
        error => {
            return Err(Failure::argument("options.cylinder_error", "0 or a finite number above 0", error));
        }
    }
    if flag("options.visual", given.visual)? {
        options.geometry = Geometry::Visual;
    }
    options.base = match given.base {
        BASE_FIXED => Base::Fixed,
        BASE_PLANAR => Base::Planar,
        BASE_FLOATING => Base::Floating,
        other => return Err(Failure::argument("options.base", "a number of cbvh_robot_base, 0 to 2", other)),
    };
    Ok(options)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_from_urdf(
    path: *const c_char,
    options: *const RobotChoices,
    robot: *mut RobotHandle,
) -> i32 {
    let read = || {
        // SAFETY: the header asks for it.
        let (file, options) = unsafe { (input::path("path", path)?, choices(options)?) };
        check_regular(&file)?;
        options.srdf.as_deref().map_or(Ok(()), check_regular)?;
        let robot = cores::work_apart(|| Ok(Robot::from_urdf(&file, &options)?))?;
        Ok(Shared::new(robot.clone(), robot))
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("robot", robot), &ROBOTS, read) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_clone(robot: RobotHandle, other: *mut RobotHandle) -> i32 {
    let copy = || ROBOTS.share("robot", robot.id)?.copy("robot");
    // SAFETY: the header asks for it.
    unsafe { hand_out(("other", other), &ROBOTS, copy) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_robot_free(robot: RobotHandle) -> i32 {
    entry(|| ROBOTS.free("robot", robot.id))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_robot_set_parallel(robot: RobotHandle, parallel: i32) -> i32 {
    entry(|| ROBOTS.share("robot", robot.id)?.set_parallel("robot", parallel))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_count(robot: RobotHandle, counts: *mut RobotCounts) -> i32 {
    see(robot, |robot| {
        let (joints, links) = (robot.joints().len(), robot.links().count());
        let (groups, states) = (robot.groups().len(), robot.states().len());
        // SAFETY: the header asks for it.
        unsafe { write("counts", counts, || Ok(RobotCounts { joints, links, groups, states })) }
    })
}

/// Fails for want of something with a number.
fn none_of(what: &str, number: u64) -> Failure {
    Failure::new(Status::NotFound, format!("expected a {what} of the robot, found the number {number}"))
}

/// Functions that write the name of something with a number.
macro_rules! names {
    ($($name:ident: $what:literal, $found:expr;)*) => { $(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            robot: RobotHandle,
            number: usize,
            buffer: *mut c_char,
            capacity: usize,
            length: *mut usize,
        ) -> i32 {
            see(robot, |robot| {
                let found: fn(&Robot, usize) -> Option<&String> = $found;
                let name = found(robot, number).ok_or_else(|| none_of($what, number as u64))?;
                // SAFETY: the header asks for it.
                unsafe { output::text(name, buffer, capacity, length) }
            })
        }
    )* };
}
names! {
    cbvh_robot_joint_name: "joint value", |robot, number| robot.joints().get(number);
    cbvh_robot_group_name: "group", |robot, number| Some(&robot.groups().get(number)?.name);
    cbvh_robot_state_name: "state", |robot, number| Some(&robot.states().get(number)?.name);
    cbvh_robot_state_group: "state", |robot, number| Some(&robot.states().get(number)?.group);
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_name(
    robot: RobotHandle,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    see(robot, |robot| unsafe { output::text(robot.name(), buffer, capacity, length) })
}

/// Functions that list what a robot has.
macro_rules! lists {
    ($($name:ident ($($own:tt)*) -> $rows:ident: $row:ty, $found:expr;)*) => { $(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            robot: RobotHandle,
            $($own)*
            $rows: *mut $row,
            capacity: usize,
            count: *mut usize,
        ) -> i32 {
            see(robot, |robot| {
                // SAFETY: the header asks for it.
                let mut list = unsafe { List::new(stringify!($rows), $rows, capacity, count) }?;
                let found: Result<Vec<$row>, Failure> = $found(robot);
                list.add(found?);
                list.finish()
            })
        }
    )* };
}
lists! {
    cbvh_robot_limits() -> limits: LimitsRow, |robot: &mut Robot| {
        Ok(robot.limits().iter().map(|&[lower, upper]| LimitsRow { lower, upper }).collect())
    };
    cbvh_robot_links() -> links: Body, |robot: &mut Robot| Ok((0..robot.links().count()).map(Body::of).collect());
    cbvh_robot_group_joints(number: usize,) -> joints: usize, |robot: &mut Robot| {
        let group = robot.groups().get(number).ok_or_else(|| none_of("group", number as u64))?;
        Ok(group.joints.clone())
    };
    cbvh_robot_state_values(number: usize,) -> values: JointValueRow, |robot: &mut Robot| {
        let state = robot.states().get(number).ok_or_else(|| none_of("state", number as u64))?;
        Ok(state.values.iter().map(|&(joint, value)| JointValueRow { joint, value }).collect())
    };
    cbvh_robot_pairs() -> pairs: BodyPairRow, |robot: &mut Robot| {
        let pairs = robot.pairs();
        Ok(pairs.iter().map(|pair| numbered(robot, pair)).collect())
    };
}

/// Returns the numbers of two bodies.
fn numbered(robot: &Robot, names: &[String; 2]) -> BodyPairRow {
    let [a, b] = [0, 1].map(|k| robot.body(&names[k]).map_or(Body { id: 0 }, Body::of));
    BodyPairRow { a, b }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_find(robot: RobotHandle, name: *const c_char, body: *mut Body) -> i32 {
    see(robot, |robot| {
        // SAFETY: the header asks for it.
        unsafe { write("body", body, || Ok(Body::of(robot.body(text("name", name)?)?))) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_body_name(
    robot: RobotHandle,
    body: Body,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> i32 {
    see(robot, |robot| {
        let name = robot.body_name(body.number()).ok_or_else(|| none_of("body", body.id))?;
        // SAFETY: the header asks for it.
        unsafe { output::text(name, buffer, capacity, length) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_shape(
    robot: RobotHandle,
    body: Body,
    number: usize,
    mesh: *mut MeshHandle,
    pose: *mut PoseRows,
) -> i32 {
    let found = || {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("pose", pose) }?;
        let shapes = with(robot, |robot| {
            robot.body_name(body.number()).ok_or_else(|| none_of("body", body.id))?;
            Ok(robot.shapes(body.number())?)
        })?;
        let (shape, pose) = shapes.into_iter().nth(number).ok_or_else(|| none_of("shape", number as u64))?;
        out.set((&pose).into());
        Ok(shape)
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, found) }
}

/// Adds a body, and writes its number if anybody wants to know.
///
/// # Safety
/// As for `text` and `poses::read`, and for `One::new` unless `body` is null.
unsafe fn add(
    (robot, name, mesh): (RobotHandle, *const c_char, MeshHandle),
    pose: *const PoseRows,
    body: *mut Body,
    add: impl FnOnce(&mut Robot, &str, OwnedShape, &bvh_query::Pose) -> Result<(), Failure>,
) -> i32 {
    entry(|| {
        // SAFETY: the caller vouches for it. The pose and the name are copied before anything is written.
        let (mut out, pose, name) = unsafe {
            let out = optional(body, |_| One::new("body", body))?;
            (out, poses::read("pose", pose), text("name", name).map(str::to_owned))
        };
        out.iter_mut().for_each(|out| out.set(Body { id: 0 }));
        // The robot is checked before the mesh, and the mesh is let go without the lock if it is refused.
        ROBOTS.share("robot", robot.id)?;
        let shape = MESHES.share("mesh", mesh.id)?;
        let (pose, name) = (pose?, name?);
        let number = with(robot, |robot| {
            add(robot, &name, shape.clone(), &pose)?;
            Ok(robot.body(&name)?)
        })?;
        out.iter_mut().for_each(|out| out.set(Body::of(number)));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_add_obstacle(
    robot: RobotHandle,
    name: *const c_char,
    mesh: MeshHandle,
    pose: *const PoseRows,
    body: *mut Body,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        add((robot, name, mesh), pose, body, |robot, name, shape, pose| {
            Ok(robot.add_obstacle(name, shape, pose)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_attach(
    robot: RobotHandle,
    name: *const c_char,
    mesh: MeshHandle,
    link: *const c_char,
    pose: *const PoseRows,
    may_touch: *const *const c_char,
    may_touch_count: usize,
    body: *mut Body,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        add((robot, name, mesh), pose, body, |robot, name, shape, pose| {
            let link = text("link", link)?;
            let may_touch = pointers("may_touch", may_touch, may_touch_count, |name, of| text(name, of))?;
            Ok(robot.attach(name, shape, link, pose, &may_touch)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_remove(robot: RobotHandle, name: *const c_char) -> i32 {
    see(robot, |robot| {
        // SAFETY: the header asks for it.
        let name = unsafe { text("name", name) }?;
        robot.body(name)?;
        // What is removed is let go without the lock.
        let before = robot.clone();
        robot.remove(name)?;
        Ok(before)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_set_pose(
    robot: RobotHandle,
    name: *const c_char,
    pose: *const PoseRows,
) -> i32 {
    // SAFETY: the header asks for it.
    see(robot, |robot| unsafe { Ok(robot.set_pose(text("name", name)?, &poses::read("pose", pose)?)?) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_set_margin(robot: RobotHandle, name: *const c_char, margin: f64) -> i32 {
    // SAFETY: the header asks for it.
    see(robot, |robot| unsafe { Ok(robot.set_margin(text("name", name)?, margin)?) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_set_allowed(
    robot: RobotHandle,
    a: *const c_char,
    b: *const c_char,
    allowed: i32,
) -> i32 {
    see(robot, |robot| {
        // SAFETY: the header asks for it.
        let (a, b) = unsafe { (text("a", a)?, text("b", b)?) };
        let allowed = flag("allowed", allowed)?;
        Ok(if allowed { robot.allow(a, b) } else { robot.disallow(a, b) }?)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_robot_allow_frequent(
    robot: RobotHandle,
    samples: usize,
    share: f64,
    pairs: *mut FrequentPairRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let mut list = unsafe { List::new("pairs", pairs, capacity, count) }?;
        let found = ask(robot, |own, _| cores::work(|| Ok(own.allow_frequent(samples, share)?)))?;
        with(robot, |robot| {
            list.add(
                found
                    .iter()
                    .map(|(pair, share)| FrequentPairRow { pair: numbered(robot, pair), share: *share }),
            );
            list.finish()?;
            found.iter().try_for_each(|([a, b], _)| Ok(robot.allow(a, b)?))
        })
    })
}

/// Asks a question about a robot as it is now.
fn ask<R>(
    robot: RobotHandle,
    ask: impl FnOnce(&mut Robot, bool) -> Result<R, Failure>,
) -> Result<R, Failure> {
    ROBOTS.share("robot", robot.id)?.ask("robot", |own, parallel| (ask(own, parallel), ()))?
}

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
    unsafe fn each<T, R: Copy>(
        self,
        answers: *mut R,
        one: impl Fn(&mut Robot, &[f64]) -> Result<T, RobotError>,
        all: impl FnOnce(&mut Robot, &[f64]) -> Result<Vec<T>, RobotError>,
        row: impl Fn(&Robot, T) -> R,
    ) -> i32 {
        // SAFETY: the caller vouches for it.
        entry(|| unsafe {
            let room = || Room::new("answers", answers, self.1.count);
            self.ask(room, one, all, |mut room, own, found| {
                room.fill(found.into_iter().map(Ok::<_, Failure>), |found| row(own, found))
            })
        })
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
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        configurations(robot, joints, joint_count, count).ask(
            || Lists::new(("pairs", pairs, capacity, pair_count), counts, count),
            |robot, joints| robot.pairs_in_contact(joints),
            |robot, joints| robot.pairs_in_contact_many(joints),
            |lists, own, found| {
                let rows = |pairs: &Vec<_>| Ok(pairs.iter().map(|pair| numbered(own, pair)).collect());
                lists.finish_with::<BodyPairRow, Failure>(found.iter().map(rows))
            },
        )
    })
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
