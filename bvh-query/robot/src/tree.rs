//! A robot as data for programs that draw it or place its links themselves: joints that move frames, and shapes in these frames.

use crate::error::RobotError;
use crate::model::{Joint, Kind, Value};
use crate::robot::Robot;
use crate::setting::Part;
use bvh_query::{OwnedShape, Pose};

/// The joints of a robot, and the shapes that they carry: see [`Robot::tree`].
///
/// Frame 0 is the world. The first joint moves frame 1, the second frame 2, and so on.
///
/// [`Robot::tree`] has an example.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct RobotTree {
    /// The joints that move, each after those that it hangs from.
    pub joints: Vec<TreeJoint>,
    /// The shapes of links, in the order of [`Robot::links`], then those of other bodies.
    pub shapes: Vec<TreeShape>,
    /// The pairs of shapes that queries are about, by their places in `shapes`.
    pub pairs: Vec<[usize; 2]>,
}

/// A joint that moves a frame.
///
/// [`Robot::tree`] has an example.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TreeJoint {
    /// Its name.
    pub name: String,
    /// The frame that it hangs from.
    pub parent: usize,
    /// Where it is in that frame. Its own motion comes first, then this pose.
    pub origin: Pose,
    /// How it moves.
    pub kind: JointKind,
    /// The unit axis about which it turns or along which it slides; that of z for other kinds.
    pub axis: [f64; 3],
    /// The place of its joint value, or of the first of them, in [`Robot::joints`].
    pub value: usize,
    /// By what the joint value is multiplied, for a joint that mimics another one.
    pub factor: f64,
    /// What is then added.
    pub offset: f64,
}

/// How a joint moves.
///
/// [`Robot::tree`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum JointKind {
    /// By an angle in radians about its axis.
    Turn,
    /// By a length along its axis.
    Slide,
    /// By three values: x, y and an angle about z.
    Planar,
    /// By seven values: x, y, z and a quaternion, its real part last, whose length is divided out.
    Floating,
}

/// A shape of a body.
///
/// [`Robot::tree`] has an example.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TreeShape {
    /// The body, which may have several shapes.
    pub body: String,
    /// Whether the body is an obstacle. Obstacles are in frame 0, as are links that do not move.
    pub is_obstacle: bool,
    /// The frame that carries it.
    pub frame: usize,
    /// Where it is in that frame.
    pub origin: Pose,
    /// The shape without the margin of its body.
    pub shape: OwnedShape,
    /// That margin.
    pub margin: f64,
}

impl Robot {
    /// Returns the joints, and the shapes that they carry, as plain data. Shapes are shared, not copied.
    ///
    /// ```
    /// use cbvh_robot::{JointKind, RobotTree, TreeJoint, TreeShape};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// let RobotTree { joints, shapes, pairs, .. } = robot.tree()?;
    /// let TreeJoint { name, kind, axis, .. } = &joints[1]; // moves frame 2
    /// assert_eq!((name.as_str(), *kind, *axis), ("shoulder", JointKind::Turn, [0.0, 1.0, 0.0]));
    /// let carried = shapes.iter().filter(|TreeShape { frame, .. }| *frame == 2);
    /// assert_eq!(carried.map(|shape| shape.body.as_str()).collect::<Vec<_>>(), ["upper_arm"]);
    /// assert_eq!(pairs.len(), robot.pairs().len()); // each body has one shape here
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`RobotError::Pose`] if a joint or a shape is too far from the frame that carries it.
    pub fn tree(&mut self) -> Result<RobotTree, RobotError> {
        self.refresh();
        let setting = &self.setting;
        let shape = |part: &Part| {
            Ok(TreeShape {
                body: self.body_name(part.body).unwrap_or_default().to_owned(),
                is_obstacle: part.is_still,
                frame: part.group,
                origin: part.origin.pose()?,
                shape: part.bare.clone(),
                margin: part.margin,
            })
        };
        Ok(RobotTree {
            joints: setting.model.joints.iter().map(joint).collect::<Result<_, _>>()?,
            shapes: setting.parts.iter().map(shape).collect::<Result<_, RobotError>>()?,
            pairs: setting.pairs.iter().map(|pair| [pair.a, pair.b]).collect(),
        })
    }

    /// Returns the poses of all shapes in the world, in the order of [`RobotTree::shapes`].
    ///
    /// # Errors
    /// The errors of [`Robot::link_poses`].
    pub fn shape_poses(&self, joints: &[f64]) -> Result<Vec<Pose>, RobotError> {
        let model = &self.setting.model;
        model.check(joints)?;
        let mut frames = Vec::new();
        model.place(joints, &mut frames);
        self.setting.parts.iter().map(|part| Ok(frames[part.group].of(&part.origin).pose()?)).collect()
    }
}

fn joint(joint: &Joint) -> Result<TreeJoint, RobotError> {
    let all = |number| Value { number, factor: 1.0, offset: 0.0 };
    let z = [0.0, 0.0, 1.0];
    let (kind, axis, by) = match &joint.kind {
        Kind::Turn { by, axis, .. } => (JointKind::Turn, *axis, *by),
        Kind::Slide { by, axis } => (JointKind::Slide, *axis, *by),
        Kind::Planar(first) => (JointKind::Planar, z, all(*first)),
        Kind::Floating(first) => (JointKind::Floating, z, all(*first)),
    };
    let Value { number: value, factor, offset } = by;
    let (name, parent) = (joint.name.clone(), joint.parent);
    Ok(TreeJoint { name, parent, origin: joint.origin.pose()?, kind, axis, value, factor, offset })
}
