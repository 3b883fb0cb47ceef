//! How a robot is read: which shapes, which base, and where meshes are.

use bvh_bake::input::UpAxis;
use std::path::PathBuf;

/// Which geometry of links to use.
///
/// [`RobotOptions`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Geometry {
    /// The `<collision>` geometry.
    #[default]
    Collision,
    /// The `<visual>` geometry.
    Visual,
}

/// How the root of a robot is connected with the world.
///
/// [`RobotOptions`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// It stands at the origin.
    #[default]
    Fixed,
    /// It moves in the plane z = 0: three more joint values come first, `base/x`, `base/y` and `base/theta`.
    Planar,
    /// It moves freely: seven more joint values come first, `base/x` to `base/z` and a quaternion, `base/qx` to `base/qw`.
    Floating,
}

/// How a robot is read. Each field has a method of its name, which sets it.
///
/// ```
/// use cbvh_robot::{Base, Geometry, Robot, RobotOptions};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
/// let options = RobotOptions::new().base(Base::Planar).geometry(Geometry::Collision);
/// let robot = Robot::from_urdf(path, &options)?;
/// assert_eq!(robot.joints(), ["base/x", "base/y", "base/theta", "waist", "shoulder", "elbow", "wrist"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct RobotOptions {
    /// Folders in which packages are looked for, before those of `ROS_PACKAGE_PATH` and those above the URDF file.
    pub packages: Vec<PathBuf>,
    /// An SRDF file, whose disabled pairs are not checked.
    pub srdf: Option<PathBuf>,
    /// Which geometry of links to use.
    pub geometry: Geometry,
    /// How the root is connected with the world.
    pub base: Base,
    /// What to do with the axis that a COLLADA mesh declares to point up. By default coordinates stay as they are: rviz, MoveIt,
    /// Gazebo and Pinocchio ignore the axis, and robots are modelled so that they look right there. The unit of lengths that a
    /// mesh declares is always applied.
    pub up_axis: UpAxis,
    /// A cylinder is a prism around it that is this part of the radius wider at most. The default is 1/1000. A cylinder with spheres of
    /// its radius at both ends is a capsule, without any prism, even if they are off by a thousandth, as rounded angles make them. It
    /// contains all three, and is wider by that at most: a thousandth of the sum of its radius and half of its length.
    pub cylinder_error: f64,
    /// A folder for baked meshes, under names that follow from what was read, so that they are baked once.
    pub cache: Option<PathBuf>,
    /// Lets the URDF name meshes anywhere. By default they must be in the folder above that of the URDF or below it, in the
    /// package of the URDF, in a package that a `package://` path names, or in `packages`, because the author of the file could
    /// otherwise choose which files of this system are read. Also lets glTF meshes name buffers outside their own folders.
    pub allow_outside: bool,
}

impl Default for RobotOptions {
    fn default() -> Self {
        Self {
            packages: Vec::new(),
            srdf: None,
            geometry: Geometry::Collision,
            base: Base::Fixed,
            up_axis: UpAxis::Kept,
            cylinder_error: 1e-3,
            cache: None,
            allow_outside: false,
        }
    }
}

impl RobotOptions {
    /// Returns the defaults.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets [`Self::packages`](RobotOptions#structfield.packages).
    #[must_use]
    pub fn packages(self, packages: impl IntoIterator<Item: Into<PathBuf>>) -> Self {
        Self { packages: packages.into_iter().map(Into::into).collect(), ..self }
    }

    /// Sets [`Self::srdf`](RobotOptions#structfield.srdf).
    #[must_use]
    pub fn srdf(self, srdf: impl Into<PathBuf>) -> Self {
        Self { srdf: Some(srdf.into()), ..self }
    }

    /// Sets [`Self::geometry`](RobotOptions#structfield.geometry).
    #[must_use]
    pub fn geometry(self, geometry: Geometry) -> Self {
        Self { geometry, ..self }
    }

    /// Sets [`Self::base`](RobotOptions#structfield.base).
    #[must_use]
    pub fn base(self, base: Base) -> Self {
        Self { base, ..self }
    }

    /// Sets [`Self::up_axis`](RobotOptions#structfield.up_axis).
    #[must_use]
    pub fn up_axis(self, up_axis: UpAxis) -> Self {
        Self { up_axis, ..self }
    }

    /// Sets [`Self::cylinder_error`](RobotOptions#structfield.cylinder_error).
    #[must_use]
    pub fn cylinder_error(self, cylinder_error: f64) -> Self {
        Self { cylinder_error, ..self }
    }

    /// Sets [`Self::cache`](RobotOptions#structfield.cache).
    #[must_use]
    pub fn cache(self, cache: impl Into<PathBuf>) -> Self {
        Self { cache: Some(cache.into()), ..self }
    }

    /// Sets [`Self::allow_outside`](RobotOptions#structfield.allow_outside).
    #[must_use]
    pub fn allow_outside(self, allow_outside: bool) -> Self {
        Self { allow_outside, ..self }
    }
}
