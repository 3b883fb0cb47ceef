//! Moves a robot among obstacles, and tells what touches, how much room is left, and whether the motions between are free.
//!
//! ```text
//! cargo run --release --example robot -- [URDF]
//! ```
//!
//! The robot is a URDF file whose collision meshes are beside it; by default, a small arm from the folder `testdata` of the
//! workspace. Links that a joint connects may touch. All joints that turn or slide follow a wave within their limits. From one
//! step to the next, they turn and slide at a constant rate, which is how planners and controllers connect configurations: a
//! path of a user's own, [`LinkPath`].
#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_query::{
    Bvh, Groups, InstanceId, MotionOptions, OwnedShape, Pose, PoseError, Scene, SceneMotionAnswer,
};
use std::collections::HashMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use urdf_rs::{Geometry, Joint, JointType};

/// What stands still is asked about with what moves only, and the robot with everything.
const STILL: Groups = Groups { member: 1, meets: 2 };
const MOVING: Groups = Groups { member: 2, meets: 1 | 2 };

fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "testdata/robot/robot.urdf".into()));
    let mut scene = Scene::new()?;
    let robot = Robot::load(&path, &mut scene)?;

    // Obstacles: two pillars, one of them in the way.
    let pillar = bake(Path::new("testdata/robot/base.obj"), [0.6, 0.6, 5.0])?;
    for (name, [x, y]) in [("pillar", [0.3, 0.2]), ("other pillar", [-0.4, -0.1])] {
        let id = scene.add_named(
            name,
            pillar.clone(),
            Pose::from_quaternion([0.0, 0.0, 0.0, 1.0], [x, y, 0.0])?,
        )?;
        scene.set_groups(id, STILL)?;
    }

    for step in 0..24 {
        let time = f64::from(step) / 24.0;
        let values = robot.values(time);
        // The poses of all links at once: either all move or none.
        scene.set_poses(robot.poses(&values)?)?;
        let touching = scene.pairs_in_contact()?;
        if touching.is_empty() {
            let Some(found) = scene.distance()? else { continue };
            let (a, b) = (scene.name(found.pair.a)?, scene.name(found.pair.b)?);
            let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
            println!("{time:.2}: free; {a} and {b} are {:.4} m apart", found.nearest.distance);
        }
        for pair in touching {
            let (a, b) = (scene.name(pair.a)?, scene.name(pair.b)?);
            println!("{time:.2}: {} touches {}", a.unwrap_or_default(), b.unwrap_or_default());
        }
        let next = robot.values(time + 1.0 / 24.0);
        let paths: Vec<LinkPath<'_>> = (0..robot.parts.len())
            .map(|part| LinkPath { robot: &robot, part, from: &values, to: &next })
            .collect();
        let paths: Vec<(InstanceId, &(dyn bvh_query::RigidPath + Sync))> =
            paths.iter().map(|path| (robot.parts[path.part].2, path as _)).collect();
        if let SceneMotionAnswer::Hit { free_until, pair, .. } =
            scene.motion(&paths, &MotionOptions::new())?
        {
            let (a, b) = (scene.name(pair.a)?, scene.name(pair.b)?);
            let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
            println!(
                "      the motion to the next step is free for {free_until:.4} of it, until {a} and {b} touch"
            );
        }
    }
    Ok(())
}

/// A robot in a scene.
struct Robot {
    /// Joints, each after the joint that moves its parent.
    joints: Vec<Joint>,
    /// Each collision mesh: its link, where it is in the link, and its instance.
    parts: Vec<(String, Pose, InstanceId)>,
}

impl Robot {
    /// Reads a URDF file, bakes its collision meshes and adds them to a scene.
    fn load(path: &Path, scene: &mut Scene) -> Result<Self, Box<dyn Error>> {
        let urdf = urdf_rs::read_file(path)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let mut parts = Vec::new();
        for link in &urdf.links {
            for (number, collision) in link.collision.iter().enumerate() {
                let Geometry::Mesh { filename, scale } = &collision.geometry else {
                    return Err(format!("link {}: expected a mesh, found another shape", link.name).into());
                };
                let shape = bake(&folder.join(filename), scale.map_or([1.0; 3], |scale| *scale))?;
                let name = if number == 0 { link.name.clone() } else { format!("{} {number}", link.name) };
                let id = scene.add_named(name, shape, Pose::IDENTITY)?;
                scene.set_groups(id, MOVING)?;
                parts.push((link.name.clone(), origin(&collision.origin)?, id));
            }
        }
        // What a joint connects overlaps there, in any position.
        for joint in &urdf.joints {
            for (link, _, a) in &parts {
                for (other, _, b) in &parts {
                    if *link == joint.parent.link && *other == joint.child.link {
                        scene.set_allowed(*a, *b, true)?;
                    }
                }
            }
        }
        Ok(Self { joints: in_order(urdf.joints), parts })
    }

    /// Returns the values of all joints at a time from 0 to 1.
    fn values(&self, time: f64) -> Vec<f64> {
        let value = |(number, joint): (usize, &Joint)| {
            let middle = (joint.limit.lower + joint.limit.upper) / 2.0;
            let wave = ((1.0 + number as f64) * std::f64::consts::TAU * time).sin();
            middle + 0.4 * (joint.limit.upper - joint.limit.lower) * wave
        };
        self.joints.iter().enumerate().map(value).collect()
    }

    /// Returns the poses of all parts in the world, given the values of all joints: forward kinematics, from the base outward.
    fn poses(&self, values: &[f64]) -> Result<Vec<(InstanceId, Pose)>, PoseError> {
        let mut links: HashMap<&str, Pose> = HashMap::new();
        for (joint, value) in self.joints.iter().zip(values) {
            let parent = links.get(joint.parent.link.as_str()).copied().unwrap_or(Pose::IDENTITY);
            let pose = moved(joint, *value)?.then(&origin(&joint.origin)?)?.then(&parent)?;
            links.insert(&joint.child.link, pose);
        }
        let part = |(link, origin, id): &(String, Pose, InstanceId)| {
            let link = links.get(link.as_str()).copied().unwrap_or(Pose::IDENTITY);
            Ok((*id, origin.then(&link)?))
        };
        self.parts.iter().map(part).collect()
    }

    /// Returns the joints that move a part, by their numbers, from the part inward.
    fn chain(&self, part: usize) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut link = &self.parts[part].0;
        while let Some(number) = self.joints.iter().position(|joint| joint.child.link == *link) {
            chain.push(number);
            link = &self.joints[number].parent.link;
        }
        chain
    }
}

/// The path of a part while all joints go from some values to others at constant rates.
struct LinkPath<'a> {
    robot: &'a Robot,
    part: usize,
    from: &'a [f64],
    to: &'a [f64],
}

impl bvh_query::RigidPath for LinkPath<'_> {
    fn pose(&self, t: f64) -> Pose {
        let values: Vec<f64> =
            self.from.iter().zip(self.to).map(|(from, to)| (1.0 - t) * from + t * to).collect();
        // Rotations stay as rigid as rounding leaves them, and a pose of the start is one.
        self.robot.poses(&values).map_or(Pose::IDENTITY, |poses| poses[self.part].1)
    }

    /// An eighth of the greatest acceleration times the square of the time. Joint j moves a point that is `arm` from its axis
    /// at a rate of at most `rate * arm`, and a slide at its rate. Every joint further in that turns, i, turns that velocity:
    /// the acceleration is at most the sum of `rate_i * rate_j * arm_j` over all pairs of joints, j being the outer one.
    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut arm = radius + length(self.robot.parts[self.part].1.translation());
        let (mut acceleration, mut outer) = (0.0, 0.0);
        for number in self.robot.chain(self.part) {
            let joint = &self.robot.joints[number];
            let (from, to) = (self.from[number], self.to[number]);
            let rate = (to - from).abs();
            if joint.joint_type == JointType::Prismatic {
                let axis = length(*joint.axis.xyz);
                outer += rate * axis;
                arm += from.abs().max(to.abs()) * axis;
            } else {
                // With itself once, and twice with each joint further out.
                acceleration += rate * (rate * arm + 2.0 * outer);
                outer += rate * arm;
            }
            arm += length(*joint.origin.xyz);
        }
        acceleration * (t1 - t0).powi(2) / 8.0 + 1e-12 * arm
    }
}

/// Orders joints so that each follows the joint that moves its parent.
fn in_order(mut joints: Vec<Joint>) -> Vec<Joint> {
    let mut ordered: Vec<Joint> = Vec::new();
    loop {
        let waits = |joint: &Joint| joints.iter().any(|other| other.child.link == joint.parent.link);
        let Some(next) = joints.iter().position(|joint| !waits(joint)) else { return ordered };
        ordered.push(joints.swap_remove(next));
    }
}

/// Returns what a joint does to its child at a value: an angle in radians or a length in metres.
fn moved(joint: &Joint, value: f64) -> Result<Pose, PoseError> {
    let axis = *joint.axis.xyz;
    match joint.joint_type {
        JointType::Revolute | JointType::Continuous => Pose::from_quaternion(turn(axis, value), [0.0; 3]),
        JointType::Prismatic => Pose::from_quaternion([0.0, 0.0, 0.0, 1.0], axis.map(|a| a * value)),
        _ => Ok(Pose::IDENTITY),
    }
}

/// Returns an origin of URDF: turns about the fixed axes x, y and z, then a translation.
fn origin(origin: &urdf_rs::Pose) -> Result<Pose, PoseError> {
    let [roll, pitch, yaw] = *origin.rpy;
    let about = |axis, angle| Pose::from_quaternion(turn(axis, angle), [0.0; 3]);
    let turned = about([1.0, 0.0, 0.0], roll)?.then(&about([0.0, 1.0, 0.0], pitch)?)?;
    turned.then(&Pose::from_quaternion(turn([0.0, 0.0, 1.0], yaw), *origin.xyz)?)
}

/// Returns the quaternion of a turn about an axis of length 1.
fn turn([x, y, z]: [f64; 3], angle: f64) -> [f64; 4] {
    let (sin, cos) = (angle / 2.0).sin_cos();
    [x * sin, y * sin, z * sin, cos]
}

/// Bakes a mesh at its scale. An application would rather bake when it is built, and open files.
fn bake(path: &Path, scale: [f64; 3]) -> Result<OwnedShape, Box<dyn Error>> {
    let mut mesh = bvh_bake::read_meshes(&[path.to_owned()])?.merged();
    for object in &mut mesh.objects {
        for position in &mut object.positions {
            *position = [0, 1, 2].map(|axis| position[axis] * scale[axis]);
        }
    }
    let (bytes, _) = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?;
    Ok(Bvh::from_bytes(bytes)?.into())
}
