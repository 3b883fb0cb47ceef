//! A robot: reads it, and changes what stands around it and which pairs are asked about.

use crate::asker::Asker;
use crate::balls::Layout;
use crate::capsules::join;
use crate::error::RobotError;
use crate::frame::Frame;
use crate::model::{Link, Model};
use crate::options::RobotOptions;
use crate::screen::Screens;
use crate::setting::{Body, Part, Setting};
use crate::shapes::Shapes;
use crate::source::Source;
use crate::srdf::{self, Group, Semantics, State};
use crate::urdf::{self, Element};
use bvh_query::{Backend, NumberError, OwnedShape, Pose, Querier, QueryError, Stop};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

/// A robot among obstacles. Queries take the values of its joints.
///
/// A body is a link, an obstacle or an attached object. Queries check all pairs of bodies that can move against each
/// other, but for those whose contact is allowed: by [`Robot::allow`], or by the SRDF. Links that only fixed joints connect, and
/// obstacles among themselves, are never checked.
///
/// All answers are certain, as those of [`Querier`](bvh_query::Querier) are, about the poses that the joint values give in `f64`.
/// They have the same bits on all systems. Lengths are in the unit of the URDF file, metres; angles are in radians.
///
/// A clone shares what the robot holds until one of them changes.
///
/// ```
/// use cbvh_robot::{Robot, RobotOptions};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
/// let mut robot = Robot::from_urdf(path, &RobotOptions::default())?;
/// // Their meshes touch or overlap at the joints.
/// robot.allow("turret", "upper_arm")?;
/// robot.allow("upper_arm", "forearm")?;
/// robot.allow("forearm", "hand")?;
/// let still = vec![0.0; robot.joints().len()];
/// let mut bent = still.clone();
/// bent[1] = 0.4;
/// assert!(!robot.collide(&bent)?);
/// assert!(robot.is_free(&still, &bent)?);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Robot {
    pub(crate) setting: Arc<Setting>,
    /// What has been computed of the setting.
    pub(crate) screens: Arc<Screens>,
    pub(crate) asker: Asker,
    pub(crate) source: Arc<Source>,
    semantics: Arc<Semantics>,
    warnings: Arc<[String]>,
    /// Pairs of bodies whose contact is allowed, in order.
    pub(crate) allowed: Arc<HashSet<[usize; 2]>>,
    /// The setting lacks pairs after a change.
    pub(crate) is_stale: bool,
}

impl Clone for Robot {
    /// Returns a robot that shares what this one holds, and remembers nothing of earlier questions.
    fn clone(&self) -> Self {
        Self {
            setting: Arc::clone(&self.setting),
            screens: Arc::clone(&self.screens),
            asker: self.asker.clone(),
            source: Arc::clone(&self.source),
            semantics: Arc::clone(&self.semantics),
            warnings: Arc::clone(&self.warnings),
            allowed: Arc::clone(&self.allowed),
            is_stale: self.is_stale,
        }
    }

    /// Makes this a robot like another one, which keeps what it remembers of its own questions. None of it affects an answer.
    fn clone_from(&mut self, source: &Self) {
        self.setting = Arc::clone(&source.setting);
        self.screens = Arc::clone(&source.screens);
        self.source = Arc::clone(&source.source);
        self.semantics = Arc::clone(&source.semantics);
        self.warnings = Arc::clone(&source.warnings);
        self.asker.set_stop(source.asker.stop().cloned());
        self.allowed = Arc::clone(&source.allowed);
        self.is_stale = source.is_stale;
    }
}

impl Robot {
    /// Reads a URDF file, and bakes the shapes of all links.
    ///
    /// # Errors
    /// [`RobotError`] with the file, the link or joint, and what is wrong.
    pub fn from_urdf(path: impl AsRef<Path>, options: &RobotOptions) -> Result<Self, RobotError> {
        let path = path.as_ref();
        let source = Source::read(path, options)?;
        let mut shapes = Shapes::new(path, options);
        Self::of_source(source, |model, elements| {
            let make = |element: &Element| shapes.make(element, &model.links[element.link].name);
            let made = elements.iter().map(make).collect::<Result<_, _>>()?;
            Ok((made, shapes.take_warnings()))
        })
    }

    /// Makes a robot of its files' texts and of the shapes of its links, one for each element, in the order of the links, with what the
    /// readers of their meshes warned of.
    pub(crate) fn of_source(
        mut source: Source,
        shapes: impl FnOnce(&Model, &[Element]) -> Result<(Vec<OwnedShape>, Vec<String>), RobotError>,
    ) -> Result<Self, RobotError> {
        let urdf::Robot { model, mut elements, mut warnings } =
            urdf::read(&source.path, &source.urdf, source.geometry, source.base)?;
        let mut has_shape = vec![false; model.links.len()];
        elements.iter().for_each(|element| has_shape[element.link] = true);
        let mut semantics = match &source.srdf {
            Some((path, text)) => srdf::read(path, text, &model, &has_shape)?,
            None => Semantics::default(),
        };
        let body = |link: &Link| {
            Some(Body { name: link.name.clone(), is_link: true, link: None, pose: Pose::IDENTITY })
        };
        let bodies = model.links.iter().map(body).collect();
        // In the order of the links, so that answers are.
        elements.sort_by_key(|element| element.link);
        join(&mut elements);
        let mut parts = Vec::new();
        let (shapes, of_meshes) = shapes(&model, &elements)?;
        for (element, shape) in elements.iter().zip(shapes) {
            let link = &model.links[element.link];
            let origin = link.origin.of(&element.origin);
            parts.push(Part::new(element.link, (link.group, false), origin, shape, 0.0)?);
        }
        let allowed = std::mem::take(&mut semantics.disabled).into_iter().collect();
        warnings.extend_from_slice(&of_meshes);
        warnings.append(&mut semantics.warnings);
        source.mesh_warnings = of_meshes;
        let (pairs, layout) = (Vec::new(), Layout::default());
        let setting = Setting { model: Arc::new(model), parts, pairs, layout, bodies };
        let mut robot = Self {
            setting: Arc::new(setting),
            screens: Arc::default(),
            asker: Asker::new()?,
            source: Arc::new(source),
            semantics: Arc::new(semantics),
            warnings: warnings.into(),
            allowed: Arc::new(allowed),
            is_stale: true,
        };
        robot.refresh();
        Ok(robot)
    }

    /// Returns a clone for use on another thread, which does not have to find the pairs again.
    pub fn snapshot(&mut self) -> Self {
        self.refresh();
        self.clone()
    }

    /// Returns the backend that answers queries: the one that `CBVH_ISA` names or the fastest one of this CPU, unless
    /// [`Robot::set_backend`] has set another one.
    pub fn backend(&self) -> Backend {
        self.asker.querier.backend()
    }

    /// Sets the backend that answers queries from now on. Answers do not depend on it. The portable backend replaces one that the
    /// CPU lacks. A clone has the backend of the original.
    pub fn set_backend(&mut self, backend: Backend) {
        let stop = self.asker.stop().cloned();
        self.asker = Asker::with(Querier::with_backend(backend));
        self.asker.set_stop(stop);
    }

    /// Stops each query from now on when the flag is set, as [`Querier::set_stop`] does. The query then ends with
    /// [`RobotError::Query`] and [`QueryError::Stopped`], and has no result for any configuration or motion. Clones share the flag.
    ///
    /// Queries read the flag before each configuration and each motion, too. Reading a robot from its files is not stopped.
    pub fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.asker.set_stop(stop);
    }

    /// Returns the name of the robot.
    pub fn name(&self) -> &str {
        &self.setting.model.name
    }

    /// Returns the names of the joint values, in their order. That is the order of the joints in the URDF file. A planar joint
    /// has three, `NAME/x`, `NAME/y` and `NAME/theta`, and a floating one seven: `NAME/x` to `NAME/z`, and a quaternion, `NAME/qx`
    /// to `NAME/qw`. Fixed joints and joints that mimic others have none.
    pub fn joints(&self) -> &[String] {
        &self.setting.model.numbers
    }

    /// Returns the lower and the upper limit of each joint value, infinite where there is none. A lower limit above the upper one is none,
    /// with a warning. No query checks them.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.setting.model.limits
    }

    /// Returns the names of the links, each after the link that it hangs from.
    pub fn links(&self) -> impl Iterator<Item = &str> {
        self.setting.model.links.iter().map(|link| link.name.as_str())
    }

    /// Returns what was read otherwise than its author may have meant, one line each: first of the URDF, then of the meshes, then of the
    /// SRDF. Among them are a robot without shapes, mimic joints without a joint to follow, limits that are the wrong way round, names
    /// in the SRDF that the robot does not have, and what the readers of meshes left out. A line begins with the file and the line
    /// there or the link. Each of both files has up to 101 of them, the last of which says so if there are more.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the groups of the SRDF.
    pub fn groups(&self) -> &[Group] {
        &self.semantics.groups
    }

    /// Returns the named configurations of the SRDF.
    pub fn states(&self) -> &[State] {
        &self.semantics.states
    }

    /// Returns the poses of all links in the world, in the order of [`Robot::links`].
    ///
    /// # Errors
    /// [`RobotError::Count`], [`RobotError::Value`], or [`RobotError::Pose`] if a link is too far away.
    pub fn link_poses(&self, joints: &[f64]) -> Result<Vec<Pose>, RobotError> {
        let model = &self.setting.model;
        model.check(joints)?;
        let mut frames = Vec::new();
        model.place(joints, &mut frames);
        model.links.iter().map(|link| Ok(frames[link.group].of(&link.origin).pose()?)).collect()
    }

    /// Returns an error unless these are values for all joints.
    ///
    /// # Errors
    /// [`RobotError::Count`] and [`RobotError::Value`].
    pub fn check(&self, joints: &[f64]) -> Result<(), RobotError> {
        self.setting.model.check(joints)
    }

    /// Adds an obstacle: a body that stands in the world.
    ///
    /// A mesh is its surface, and what is inside does not touch it, so that a room may stand around the robot. If what is
    /// inside counts, add a solid ([`OwnedShape::solid`]). [`Robot::pairs_inside`] tells which bodies are inside others.
    ///
    /// # Errors
    /// [`RobotError::Taken`] if a body has the name.
    pub fn add_obstacle(
        &mut self,
        name: impl Into<String>,
        shape: impl Into<OwnedShape>,
        pose: &Pose,
    ) -> Result<(), RobotError> {
        self.add_body(name.into(), None, shape.into(), pose).map(drop)
    }

    /// Attaches an object to a link, at a pose in the link's frame. It may touch that link and the given ones.
    ///
    /// The link's margin does not apply to the object, which has a margin of its own, 0 at first: see [`Robot::set_margin`].
    ///
    /// # Errors
    /// [`RobotError::Taken`] if a body has the name, and [`RobotError::Unknown`] for a link that the robot does not have.
    pub fn attach(
        &mut self,
        name: impl Into<String>,
        shape: impl Into<OwnedShape>,
        link: &str,
        pose: &Pose,
        may_touch: &[&str],
    ) -> Result<(), RobotError> {
        let model = &self.setting.model;
        let place = model.link(link)?;
        let touched = may_touch.iter().map(|name| model.link(name)).collect::<Result<Vec<_>, _>>()?;
        let body = self.add_body(name.into(), Some(place), shape.into(), pose)?;
        Arc::make_mut(&mut self.allowed)
            .extend(touched.into_iter().chain([place]).map(|link| [link.min(body), link.max(body)]));
        Ok(())
    }

    fn add_body(
        &mut self,
        name: String,
        link: Option<usize>,
        shape: OwnedShape,
        pose: &Pose,
    ) -> Result<usize, RobotError> {
        if self.body(&name).is_ok() {
            return Err(RobotError::Taken(name));
        }
        let setting = self.changed();
        let body = setting.bodies.len();
        let (group, origin) = match link {
            Some(link) => {
                (setting.model.links[link].group, setting.model.links[link].origin.of(&pose.into()))
            }
            None => (0, pose.into()),
        };
        let part = Part::new(body, (group, link.is_none()), origin, shape, 0.0)?;
        setting.bodies.push(Some(Body { name, is_link: false, link, pose: *pose }));
        setting.parts.push(part);
        self.is_stale = true;
        Ok(body)
    }

    /// Removes an obstacle or an attached object.
    ///
    /// # Errors
    /// [`RobotError::Unknown`] if there is no such body, or if it is a link.
    pub fn remove(&mut self, name: &str) -> Result<(), RobotError> {
        let body = self.own_body(name)?;
        let setting = self.changed();
        setting.bodies[body] = None;
        setting.parts.retain(|part| part.body != body);
        Arc::make_mut(&mut self.allowed).retain(|pair| !pair.contains(&body));
        self.is_stale = true;
        Ok(())
    }

    /// Moves an obstacle, or an attached object in the frame of its link.
    ///
    /// # Errors
    /// The errors of [`Robot::remove`].
    pub fn set_pose(&mut self, name: &str, pose: &Pose) -> Result<(), RobotError> {
        let body = self.own_body(name)?;
        let setting = Arc::make_mut(&mut self.setting);
        let mut link = None;
        if let Some(body) = &mut setting.bodies[body] {
            (link, body.pose) = (body.link, *pose);
        }
        match link {
            Some(_) => self.screens = Arc::default(),
            None => Arc::make_mut(&mut self.screens).forget_places(),
        }
        for part in setting.parts.iter_mut().filter(|part| part.body == body) {
            let origin =
                link.map_or(Frame::IDENTITY, |link| setting.model.links[link].origin).of(&pose.into());
            // Pairs know how far places are from rigid ones.
            let before = part.departure;
            part.place(origin);
            self.is_stale |= part.departure != before;
        }
        setting.place_balls();
        Ok(())
    }

    /// Sets how near others may come to a body, in mesh units. What is nearer than the margins of both counts as contact, and
    /// distances are those of the bodies with their margins.
    ///
    /// The margin is that of this body alone. What is attached to a link does not get the link's: set the margins of both.
    ///
    /// # Errors
    /// [`RobotError::Unknown`], and [`RobotError::Query`] if the margin is negative or not finite.
    pub fn set_margin(&mut self, name: &str, margin: f64) -> Result<(), RobotError> {
        // A radius of its own would make up for a negative margin.
        if !(0.0..f64::INFINITY).contains(&margin) {
            return Err(QueryError::from(NumberError::Margin(margin)).into());
        }
        self.reshape(name, |part| Ok((part.bare.clone(), margin)))
    }

    /// Makes a body a solid: what is inside touches it from now on.
    ///
    /// # Errors
    /// [`RobotError::Unknown`], and [`RobotError::NotSolid`] if a shape of the body has no inside: see [`OwnedShape::solid`].
    pub fn make_solid(&mut self, name: &str) -> Result<(), RobotError> {
        let refused = |source| RobotError::NotSolid { body: name.to_owned(), source };
        self.reshape(name, |part| Ok((part.bare.clone().solid().map_err(refused)?, part.margin)))
    }

    /// Makes the parts of a body anew, each of a bare shape and with a margin; all of them or none.
    fn reshape(
        &mut self,
        name: &str,
        shape: impl Fn(&Part) -> Result<(OwnedShape, f64), RobotError>,
    ) -> Result<(), RobotError> {
        let body = self.body(name)?;
        let setting = self.changed();
        let mut parts = setting.parts.clone();
        for part in parts.iter_mut().filter(|part| part.body == body) {
            let (bare, margin) = shape(part)?;
            *part = Part::new(body, (part.group, part.is_still), part.origin, bare, margin)?;
        }
        setting.parts = parts;
        self.is_stale = true;
        Ok(())
    }

    /// Lets two bodies touch: queries are no longer about them.
    ///
    /// # Errors
    /// [`RobotError::Unknown`].
    pub fn allow(&mut self, a: &str, b: &str) -> Result<(), RobotError> {
        let pair = self.bodies(a, b)?;
        Arc::make_mut(&mut self.allowed).insert(pair);
        self.is_stale = true;
        Ok(())
    }

    /// Asks about two bodies again, unless they cannot move against each other.
    ///
    /// # Errors
    /// [`RobotError::Unknown`].
    pub fn disallow(&mut self, a: &str, b: &str) -> Result<(), RobotError> {
        let pair = self.bodies(a, b)?;
        Arc::make_mut(&mut self.allowed).remove(&pair);
        self.is_stale = true;
        Ok(())
    }

    /// Returns the pairs of bodies that are checked.
    pub fn pairs(&mut self) -> Vec<[String; 2]> {
        self.refresh();
        let setting = &self.setting;
        let name = |part: usize| setting.name(part).to_owned();
        let mut seen = HashSet::new();
        let pairs =
            setting.pairs.iter().filter(|pair| seen.insert([pair.a, pair.b].map(|p| setting.parts[p].body)));
        pairs.map(|pair| [name(pair.a), name(pair.b)]).collect()
    }

    /// Returns the name of the body with a number; `None` if it was removed.
    pub fn body_name(&self, number: usize) -> Option<&str> {
        self.setting.bodies.get(number)?.as_ref().map(|body| body.name.as_str())
    }

    /// Returns the shapes of the body with a number, each with its pose: in the frame of its link or, for an obstacle, in the world. The
    /// margin of the body is a part of their radii. Use them for queries that robots do not answer, such as contact regions.
    ///
    /// # Errors
    /// [`RobotError::Pose`] if a shape is too far away.
    pub fn shapes(&self, body: usize) -> Result<Vec<(OwnedShape, Pose)>, RobotError> {
        let Setting { model, parts, bodies, .. } = &*self.setting;
        let link = match bodies.get(body) {
            Some(Some(of)) if of.is_link => Some(body),
            Some(Some(of)) => of.link,
            _ => None,
        };
        let frame = link.map_or(Frame::IDENTITY, |link| model.links[link].origin);
        let placed = |part: &Part| Ok((part.shape.clone(), frame.relative(&part.origin).pose()?));
        parts.iter().filter(|part| part.body == body).map(placed).collect()
    }

    pub(crate) fn bodies(&self, a: &str, b: &str) -> Result<[usize; 2], RobotError> {
        let (a, b) = (self.body(a)?, self.body(b)?);
        Ok([a.min(b), a.max(b)])
    }

    /// Returns the number of a body. Links have the first ones, in the order of [`Robot::links`]. A robot and its clones give a number
    /// to no other body after it was removed.
    ///
    /// # Errors
    /// [`RobotError::Unknown`].
    pub fn body(&self, name: &str) -> Result<usize, RobotError> {
        let bodies = &self.setting.bodies;
        let is_named = |body: &Option<Body>| body.as_ref().is_some_and(|body| body.name == name);
        bodies.iter().position(is_named).ok_or_else(|| RobotError::Unknown {
            what: "a body",
            name: name.to_owned(),
            known: bodies.iter().flatten().map(|body| body.name.clone()).collect(),
        })
    }

    /// Returns the number of a body that is no link.
    fn own_body(&self, name: &str) -> Result<usize, RobotError> {
        let bodies = &self.setting.bodies;
        let is_own = |number: &usize| bodies[*number].as_ref().is_some_and(|body| !body.is_link);
        self.body(name).ok().filter(is_own).ok_or_else(|| RobotError::Unknown {
            what: "an obstacle or attached object",
            name: name.to_owned(),
            known: bodies
                .iter()
                .flatten()
                .filter(|body| !body.is_link)
                .map(|body| body.name.clone())
                .collect(),
        })
    }

    /// Returns the setting, to change it: what has been computed of it is forgotten.
    fn changed(&mut self) -> &mut Setting {
        self.screens = Arc::default();
        Arc::make_mut(&mut self.setting)
    }

    /// Lists the pairs that are asked about, after a change.
    pub(crate) fn refresh(&mut self) {
        if !std::mem::take(&mut self.is_stale) {
            return;
        }
        let allowed = Arc::clone(&self.allowed);
        self.changed().list_pairs(&allowed);
    }
}
