//! What a page shows, as it says so in JSON.

use crate::files::{Entry, Part};
use crate::json::is_false;
use bvh_query::{ClashClass, Pose};
use serde::{Serialize, Serializer};

/// The version of what pages say.
pub(crate) const VERSION: u32 = 1;

/// All that a page says besides the bytes of its files.
#[derive(Serialize)]
pub(crate) struct Content<'a> {
    pub(crate) version: u32,
    pub(crate) files: Vec<Entry<'a>>,
    pub(crate) show: &'a Show,
}

/// What is shown of the files.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(crate) enum Show {
    /// One file alone.
    File,
    /// B in the frame of A.
    Pair {
        #[serde(serialize_with = "one_pose")]
        pose: Pose,
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<f64>,
        /// Whether the first file is both A and B.
        #[serde(skip_serializing_if = "is_false")]
        same: bool,
    },
    /// B on its way from one pose to another.
    Motion {
        #[serde(serialize_with = "both_poses")]
        motion: [Pose; 2],
        clearance: f64,
        /// None leaves the choice to the library.
        tolerance: Option<f64>,
        #[serde(skip_serializing_if = "is_false")]
        same: bool,
    },
    /// Instances in the world, and frames of those that move.
    Scene {
        instances: Vec<Instance>,
        allowed: Vec<[usize; 2]>,
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pair_margins: Vec<(usize, usize, f64)>,
        frames: Vec<Frame>,
    },
    /// Instances in the world, and which of them clash.
    Clash { instances: Vec<Instance>, clashes: Vec<Found> },
    /// A robot: shapes where joint values put them, and lines of a file with such values.
    Robot {
        instances: Vec<Carried>,
        allowed: Vec<[usize; 2]>,
        joints: Vec<Joint>,
        values: Vec<Value>,
        lines: Vec<Line>,
    },
}

/// A shape in the world.
#[derive(Debug, Serialize)]
pub(crate) struct Instance {
    pub(crate) name: String,
    /// The number of its file.
    pub(crate) file: usize,
    #[serde(flatten)]
    pub(crate) part: Part,
    #[serde(serialize_with = "one_pose")]
    pub(crate) pose: Pose,
    pub(crate) margin: f64,
    pub(crate) moving: bool,
    /// The groups that it is in.
    pub(crate) member: u32,
    /// The groups that it meets.
    pub(crate) meets: u32,
}

/// A shape that a joint of a robot carries. Shapes of one body have one name.
#[derive(Debug, Serialize)]
pub(crate) struct Carried {
    #[serde(flatten)]
    pub(crate) instance: Instance,
    /// The frame that carries it: 0 is the world, and each joint moves the next one.
    pub(crate) frame: usize,
    /// Where it is in that frame.
    #[serde(serialize_with = "one_pose")]
    pub(crate) origin: Pose,
}

/// A joint of a robot.
#[derive(Debug, Serialize)]
pub(crate) struct Joint {
    pub(crate) kind: &'static str,
    /// The frame that it hangs from, and where it is there.
    pub(crate) parent: usize,
    #[serde(serialize_with = "one_pose")]
    pub(crate) origin: Pose,
    pub(crate) axis: [f64; 3],
    /// The place of its value, or of the first of them, and by what that is multiplied and moved.
    pub(crate) value: usize,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

/// A joint value.
#[derive(Debug, Serialize)]
pub(crate) struct Value {
    pub(crate) name: String,
    /// What it is in the poses of the instances.
    pub(crate) at: f64,
    /// The ends of its slider. None leaves the choice to the page, which knows how large the robot is.
    pub(crate) lower: Option<f64>,
    pub(crate) upper: Option<f64>,
}

/// A configuration or, with a goal, an edge.
#[derive(Debug, Serialize)]
pub(crate) struct Line {
    pub(crate) start: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) goal: Option<Vec<f64>>,
    /// Where the edge ends before its goal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) end: Option<End>,
}

impl Line {
    /// Returns how many joint values it has.
    pub(crate) fn numbers(&self) -> u64 {
        (self.start.len() + self.goal.as_ref().map_or(0, Vec::len)) as u64
    }
}

/// The first hit of an edge, or where it is undecided.
#[derive(Debug, Serialize)]
pub(crate) struct End {
    pub(crate) hit: bool,
    pub(crate) free_until: f64,
    pub(crate) at: f64,
    pub(crate) bodies: [String; 2],
    /// The nearest points of both, in the world.
    pub(crate) points: [[f64; 3]; 2],
}

/// The poses of all moving instances, in the order of the instances.
#[derive(Debug)]
pub(crate) struct Frame(pub(crate) Vec<Pose>);

/// Two instances that clash.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    pub(crate) a: usize,
    pub(crate) b: usize,
    #[serde(serialize_with = "class_name")]
    pub(crate) class: ClashClass,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lower: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) upper: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) distance: Option<f64>,
    pub(crate) point: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) translation: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) volume: Option<f64>,
    #[serde(skip_serializing_if = "is_neither")]
    pub(crate) pierced: [Option<f64>; 2],
}

fn is_neither(pierced: &[Option<f64>; 2]) -> bool {
    *pierced == [None; 2]
}

/// Returns the rows of the 3 by 4 matrix of a pose.
fn rows(pose: &Pose) -> [f64; 12] {
    let ([a, b, c], [x, y, z]) = (pose.rotation(), pose.translation());
    [a[0], a[1], a[2], x, b[0], b[1], b[2], y, c[0], c[1], c[2], z]
}

fn one_pose<S: Serializer>(pose: &Pose, serializer: S) -> Result<S::Ok, S::Error> {
    rows(pose).serialize(serializer)
}

fn both_poses<S: Serializer>(poses: &[Pose; 2], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(poses.iter().flat_map(rows))
}

impl Serialize for Frame {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().flat_map(rows))
    }
}

fn class_name<S: Serializer>(class: &ClashClass, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(class.name())
}
