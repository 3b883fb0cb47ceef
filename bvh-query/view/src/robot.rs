//! The page of a robot of the robot library.

use crate::PageError;
use crate::content::{Carried, End, Joint, Line, Show, Value};
use crate::files::Named;
use crate::page::{Page, Placed, instances};
use bvh_query::Groups;
use cbvh_robot::{JointKind, Robot, RobotMotion, RobotTree, TreeShape};
use std::collections::HashSet;
use std::f64::consts::PI;

/// The groups of obstacles, which no question is about among themselves, and of what the robot carries.
const STILL: u32 = 1;
const CARRIED: u32 = 2;

/// A configuration or an edge that the page of a robot lists.
///
/// [`Page::of_robot`] has an example.
#[derive(Clone, Debug)]
pub struct RobotLine<'a> {
    /// The joint values of the configuration, or those at the start of the edge.
    pub start: Vec<f64>,
    /// The goal of the edge, to which all joint values go straight, and whether the edge is free.
    pub edge: Option<(Vec<f64>, &'a RobotMotion)>,
}

impl Page {
    /// Shows a robot among its obstacles, with a slider for each joint value, and lists configurations and edges. It stands where
    /// the first line says. Without a line, each joint value is 0, or the limit that is nearest to 0.
    ///
    /// The page computes where joint values put the links, and asks which bodies touch there. Its poses are those of
    /// [`Robot::link_poses`] but for roundings, because browsers round sines and cosines in ways of their own. The answers about
    /// edges are the given ones.
    ///
    /// ```
    /// use bvh_query::MotionOptions;
    /// use cbvh_robot::Edge;
    /// use cbvh_view::{Page, RobotLine};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let (start, goal) = (vec![0.0; 4], vec![0.0, 0.4, 0.0, 0.0]);
    /// let motion = robot.motion(&Edge::straight(&start, &goal)?, &MotionOptions::new())?;
    /// let page = Page::of_robot(&mut robot, [RobotLine { start, edge: Some((goal, &motion)) }])?;
    /// # page.write(&mut std::io::sink())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`]; [`PageError::Robot`] if a line has no valid joint values, or if they put a link too far away.
    pub fn of_robot<'a>(
        robot: &mut Robot,
        lines: impl IntoIterator<Item = RobotLine<'a>>,
    ) -> Result<Self, PageError> {
        let tree = robot.tree()?;
        let line = |RobotLine { start, edge }: RobotLine<'a>| {
            robot.check(&start)?;
            let (goal, motion) = edge.unzip();
            goal.iter().try_for_each(|goal| robot.check(goal))?;
            Ok(Line { start, goal, end: motion.and_then(end) })
        };
        let lines = lines.into_iter().map(line).collect::<Result<Vec<_>, PageError>>()?;
        let first = lines.first().map_or_else(|| rest(robot, &tree), |line| line.start.clone());
        let poses = robot.shape_poses(&first)?;
        let placed = tree.shapes.iter().zip(&poses).map(|(shape, pose)| {
            let (name, path) = (shape.body.clone(), shape.body.clone());
            let groups = match shape.is_obstacle {
                true => Groups { member: STILL, meets: CARRIED },
                false => Groups { member: CARRIED, meets: STILL | CARRIED },
            };
            Placed {
                name: shape.body.clone(),
                of: Named { name, path, shape: shape.shape.clone() },
                pose: *pose,
                margin: shape.margin,
                groups,
                moving: !shape.is_obstacle,
            }
        });
        let (files, instances) = instances(placed)?;
        let carried = instances.into_iter().zip(&tree.shapes).map(|(instance, shape)| Carried {
            instance,
            frame: shape.frame,
            origin: shape.origin,
        });
        let show = Show::Robot {
            instances: carried.collect(),
            allowed: allowed(&tree),
            values: values(robot, &tree, &first),
            joints: tree.joints.into_iter().map(Joint::from).collect(),
            lines,
        };
        Ok(Self { files, parts: Vec::new(), show })
    }
}

/// Returns the joint values that are nearest to 0 within the limits, and no turn for a quaternion.
fn rest(robot: &Robot, tree: &RobotTree) -> Vec<f64> {
    let mut rest: Vec<f64> =
        robot.limits().iter().map(|[lower, upper]| 0.0_f64.max(*lower).min(*upper)).collect();
    let floating = tree.joints.iter().filter(|joint| joint.kind == JointKind::Floating);
    floating.for_each(|joint| rest[joint.value + 6] = 1.0);
    rest
}

/// Returns the pairs of shapes that no question is about, but for those of obstacles among themselves.
fn allowed(tree: &RobotTree) -> Vec<[usize; 2]> {
    let asked: HashSet<&[usize; 2]> = tree.pairs.iter().collect();
    let is_still =
        |shape: usize| -> bool { tree.shapes.get(shape).is_some_and(|of: &TreeShape| of.is_obstacle) };
    let count = tree.shapes.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    pairs.filter(|pair| !asked.contains(pair) && !pair.iter().all(|&shape| is_still(shape))).collect()
}

/// Returns the joint values, with limits or, without them, a turn for angles and all values of a quaternion.
fn values(robot: &Robot, tree: &RobotTree, at: &[f64]) -> Vec<Value> {
    let mut ends: Vec<f64> = vec![f64::INFINITY; at.len()];
    for joint in &tree.joints {
        match joint.kind {
            // Not one that mimics another joint, which may slide.
            JointKind::Turn if robot.joints()[joint.value] == joint.name => ends[joint.value] = PI,
            JointKind::Planar => ends[joint.value + 2] = PI,
            JointKind::Floating => ends[joint.value + 3..joint.value + 7].fill(1.0),
            _ => {}
        }
    }
    let value = |number: usize| {
        let [lower, upper] = robot.limits()[number];
        let end = |limit: f64, end: f64| [limit, end].into_iter().find(|end| end.is_finite());
        Value {
            name: robot.joints()[number].clone(),
            at: at[number],
            lower: end(lower, -ends[number]),
            upper: end(upper, ends[number]),
        }
    };
    (0..at.len()).map(value).collect()
}

/// Returns where an edge ends before its goal.
fn end(motion: &RobotMotion) -> Option<End> {
    let (hit, free_until, at, bodies, points) = match motion {
        RobotMotion::Hit { free_until, touching_at, bodies, points, .. } => {
            (true, free_until, touching_at, bodies, points)
        }
        RobotMotion::Near { free_until, at, bodies, points, .. } => (false, free_until, at, bodies, points),
        _ => return None,
    };
    Some(End { hit, free_until: *free_until, at: *at, bodies: bodies.clone(), points: *points })
}

impl From<cbvh_robot::TreeJoint> for Joint {
    fn from(joint: cbvh_robot::TreeJoint) -> Self {
        let kind = match joint.kind {
            JointKind::Slide => "slide",
            JointKind::Planar => "planar",
            JointKind::Floating => "floating",
            _ => "turn",
        };
        let cbvh_robot::TreeJoint { parent, origin, axis, value, factor, offset, .. } = joint;
        Self { kind, parent, origin, axis, value, factor, offset }
    }
}
