//! A robot as plain data, which can be stored, sent to another process, and made a robot again without any file.

use crate::error::RobotError;
use crate::options::{Base, Geometry};
use crate::robot::Robot;
use crate::source::Source;
use bvh_query::{OwnedShape, Pose};
use std::path::PathBuf;
use std::sync::Arc;

/// All that a robot holds: see [`Robot::to_parts`].
///
/// [`Robot::to_parts`] has an example.
#[derive(Clone, Debug)]
pub struct RobotParts {
    /// The URDF file, for messages, and its text.
    pub urdf: (PathBuf, String),
    /// The SRDF file, for messages, and its text.
    pub srdf: Option<(PathBuf, String)>,
    /// Which geometry of links to use.
    pub geometry: Geometry,
    /// How the root is connected with the world.
    pub base: Base,
    /// What the readers of meshes warned of, which is in [`Robot::warnings`].
    pub mesh_warnings: Vec<String>,
    /// The shapes of all links without margins, in the order of the links, and of a link in that of the file. A capsule that the file
    /// spells as a cylinder and two spheres is one shape, in the place of the cylinder.
    pub links: Vec<OwnedShape>,
    /// Obstacles and attached objects, in the order in which they were added.
    pub others: Vec<OtherBody>,
    /// The bodies that have a margin.
    pub margins: Vec<(String, f64)>,
    /// The pairs of bodies that may touch, in the order of the bodies.
    pub allowed: Vec<[String; 2]>,
}

/// An obstacle, or an object that is attached to a link.
///
/// [`Robot::to_parts`] has an example.
#[derive(Clone, Debug)]
pub struct OtherBody {
    /// Its name.
    pub name: String,
    /// Its shape without a margin.
    pub shape: OwnedShape,
    /// The link that it is attached to; `None` for an obstacle.
    pub link: Option<String>,
    /// Where it is: in the frame of the link or, as an obstacle, in the world.
    pub pose: Pose,
}

impl Robot {
    /// Returns all that the robot holds. Shapes are shared, not copied.
    ///
    /// ```
    /// use cbvh_robot::{OtherBody, Robot, RobotParts};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    /// # let mut robot = cbvh_robot::Robot::from_urdf(path, &Default::default())?;
    /// # for [a, b] in [["turret", "upper_arm"], ["upper_arm", "forearm"], ["forearm", "hand"]] {
    /// #     robot.allow(a, b)?;
    /// # }
    /// # let ball = bvh_bake::to_bytes(&bvh_bake::shapes::point([0.0; 3]), &bvh_bake::Options::default().radius(0.1))?.0;
    /// # let ball = bvh_query::Bvh::from_bytes(ball)?;
    /// robot.add_obstacle("ball", ball, &bvh_query::Pose::IDENTITY)?;
    /// let parts: RobotParts = robot.to_parts();
    /// let [OtherBody { name, link: None, .. }] = &parts.others[..] else { panic!() };
    /// assert_eq!((name.as_str(), parts.links.len(), parts.allowed.len()), ("ball", 5, 3));
    /// let mut copy = Robot::from_parts(parts)?;
    /// assert_eq!(copy.pairs(), robot.pairs());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_parts(&self) -> RobotParts {
        let (setting, source) = (&self.setting, &self.source);
        let name = |body: usize| self.body_name(body).unwrap_or_default().to_owned();
        let (mut links, mut others, mut margins) = (Vec::new(), Vec::new(), Vec::new());
        for part in &setting.parts {
            let shape = part.bare.clone();
            match setting.bodies[part.body].as_ref().filter(|body| !body.is_link) {
                Some(body) => {
                    let (name, link) = (body.name.clone(), body.link.map(name));
                    others.push(OtherBody { name, shape, link, pose: body.pose });
                }
                None => links.push(shape),
            }
            if part.margin > 0.0 {
                margins.push((name(part.body), part.margin));
            }
        }
        margins.dedup();
        let mut allowed: Vec<[usize; 2]> = self.allowed.iter().copied().collect();
        allowed.sort_unstable();
        RobotParts {
            urdf: (source.path.clone(), source.urdf.clone()),
            srdf: source.srdf.clone(),
            geometry: source.geometry,
            base: source.base,
            mesh_warnings: source.mesh_warnings.clone(),
            links,
            others,
            margins,
            allowed: allowed.into_iter().map(|pair| pair.map(name)).collect(),
        }
    }

    /// Makes a robot that gives the answers of the one whose parts these are, to the bit. Reads no file. Only the numbers of
    /// bodies may be others, if some were removed.
    ///
    /// # Errors
    /// Those of [`Robot::from_urdf`] for the texts, and [`RobotError::Description`] unless there is a shape for each that the
    /// file describes; and those of the functions that add bodies, set margins and allow pairs.
    pub fn from_parts(parts: RobotParts) -> Result<Self, RobotError> {
        let RobotParts { urdf: (path, urdf), srdf, geometry, base, mesh_warnings, .. } = parts;
        let (links, others, margins, allowed) = (parts.links, parts.others, parts.margins, parts.allowed);
        let source = Source { path, urdf, srdf, geometry, base, mesh_warnings: Vec::new() };
        let path = source.path.clone();
        let mut robot = Self::of_source(source, |_, elements| {
            if links.len() == elements.len() {
                return Ok((links, mesh_warnings));
            }
            let found = format!("{} shapes for {} elements", links.len(), elements.len());
            let (place, expected) =
                ("the shapes of its links".to_owned(), "one for each element that describes one");
            Err(RobotError::Description { path, place, expected: expected.into(), found })
        })?;
        for OtherBody { name, shape, link, pose } in others {
            match link {
                Some(link) => robot.attach(name, shape, &link, &pose, &[])?,
                None => robot.add_obstacle(name, shape, &pose)?,
            }
        }
        for (name, margin) in &margins {
            robot.set_margin(name, *margin)?;
        }
        let pairs = allowed.iter().map(|[a, b]| robot.bodies(a, b));
        robot.allowed = Arc::new(pairs.collect::<Result<_, _>>()?);
        robot.is_stale = true;
        robot.refresh();
        Ok(robot)
    }
}
