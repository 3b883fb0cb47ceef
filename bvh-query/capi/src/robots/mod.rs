//! Robots among obstacles: read from URDF files, changed, and asked about with the values of their joints.
//!
//! A question is about the robot as it is when the question begins (`shared`). Changes name bodies, and answers number them.

mod questions;

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::{about, entry, hand_out};
use crate::input::{self, flag, optional, path, pointers, reserve, text};
use crate::mesh::check_regular;
use crate::output::{List, One};
use crate::poses;
use crate::shared::{Shared, Snapshot};
use crate::status::{Failure, Status};
use crate::stops;
use crate::table::{Kind, Table};
use crate::types::{
    BASE_FIXED, BASE_FLOATING, BASE_PLANAR, Body, BodyPairRow, FrequentPairRow, JointValueRow, LimitsRow,
    MeshHandle, PoseRows, RobotChoices, RobotCounts, RobotHandle, StopHandle,
};
use bvh_query::OwnedShape;
use cbvh_robot::{Base, Geometry, Robot, RobotOptions, UpAxis};
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
    options.allow_outside = flag("options.allow_outside", given.allow_outside)?;
    if flag("options.visual", given.visual)? {
        options.geometry = Geometry::Visual;
    }
    if flag("options.apply_up_axis", given.apply_up_axis)? {
        options.up_axis = UpAxis::Turned;
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

/// Fails for want of something with a number.
fn none_of(what: &str, number: u64) -> Failure {
    Failure::new(Status::NotFound, format!("expected a {what} of the robot, found the number {number}"))
}

/// Returns something that has a number.
fn found<'a, T>(what: &str, number: usize, found: Option<&'a T>) -> Result<&'a T, Failure> {
    found.ok_or_else(|| none_of(what, number as u64))
}

about! {
    robot: RobotHandle, see;
    one cbvh_robot_count() -> counts: RobotCounts = RobotCounts {
        joints: robot.joints().len(),
        links: robot.links().count(),
        groups: robot.groups().len(),
        states: robot.states().len(),
    };
    text cbvh_robot_name() = robot.name();
    text cbvh_robot_joint_name(number: usize,) =
        found("joint value", number, robot.joints().get(number))?;
    text cbvh_robot_warning(number: usize,) = found("warning", number, robot.warnings().get(number))?;
    text cbvh_robot_group_name(number: usize,) = &found("group", number, robot.groups().get(number))?.name;
    text cbvh_robot_state_name(number: usize,) = &found("state", number, robot.states().get(number))?.name;
    text cbvh_robot_state_group(number: usize,) = &found("state", number, robot.states().get(number))?.group;
    text cbvh_robot_body_name(body: Body,) =
        robot.body_name(body.number()).ok_or_else(|| none_of("body", body.id))?;
    list cbvh_robot_limits() -> limits: LimitsRow =
        robot.limits().iter().map(|&[lower, upper]| LimitsRow { lower, upper });
    list cbvh_robot_links() -> links: Body = (0..robot.links().count()).map(Body::of);
    list cbvh_robot_group_joints(number: usize,) -> joints: usize =
        found("group", number, robot.groups().get(number))?.joints.iter().copied();
    list cbvh_robot_state_values(number: usize,) -> values: JointValueRow = {
        let values = &found("state", number, robot.states().get(number))?.values;
        values.iter().map(|&(joint, value)| JointValueRow { joint, value })
    };
    list cbvh_robot_pairs() -> pairs: BodyPairRow = {
        let pairs = robot.pairs();
        pairs.iter().map(|pair| numbered(robot, pair)).collect::<Vec<_>>()
    };
    change cbvh_robot_set_stop(stop: StopHandle,) = robot.set_stop(stops::of(stop)?);
    one cbvh_robot_find(name: *const c_char,) -> body: Body = Body::of(robot.body(text("name", name)?)?);
}

/// Returns the numbers of two bodies.
fn numbered(robot: &Robot, names: &[String; 2]) -> BodyPairRow {
    let [a, b] = [0, 1].map(|k| robot.body(&names[k]).map_or(Body { id: 0 }, Body::of));
    BodyPairRow { a, b }
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
pub unsafe extern "C" fn cbvh_robot_make_solid(robot: RobotHandle, name: *const c_char) -> i32 {
    // SAFETY: the header asks for it.
    see(robot, |robot| unsafe { Ok(robot.make_solid(text("name", name)?)?) })
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
        let found = ask(robot, |own, _| {
            let numbers = samples.saturating_mul(own.joints().len());
            reserve("samples", numbers, &mut Vec::<f64>::new())?;
            cores::work(|| Ok(own.allow_frequent(samples, share)?))
        })?;
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
