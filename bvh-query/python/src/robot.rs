//! Robots: a question takes a snapshot, and runs without Python's lock and without that of the robot.

use crate::answers::array;
use crate::arguments::pose_or_identity;
use crate::asking::{detached, in_turns, on_pool};
use crate::errors::{backend_error, bake_error, open_error, query_error, question_error, system_error};
use crate::mesh::Mesh;
use crate::paths::locked;
use bvh_query::{MotionOptions, Pose};
use cbvh_robot::{Base, Edge, Geometry, RobotDistance, RobotError, RobotMotion, RobotOptions};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Mutex;

/// A robot among obstacles.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Robot(Mutex<Shared>);

struct Shared {
    robot: cbvh_robot::Robot,
    /// Robots that ask no question now, which hold what they remember of earlier ones.
    idle: Vec<cbvh_robot::Robot>,
}

/// The nearest bodies: whether there are any, the distance and its bounds, both names, and the points in the world.
type Nearest = (bool, [f64; 3], [String; 2], [[f64; 3]; 2]);
/// A named configuration: its group, its name, and values at the places of joints.
type State = (String, String, Vec<(usize, f64)>);
/// How a motion ends: 0 free, 1 hit, 2 near; until when it is free, when it ends, with what joint values, bodies and distance.
type Motion = (u8, f64, f64, Vec<f64>, [String; 2], f64);

fn robot_error(error: RobotError) -> PyErr {
    let message = error.to_string();
    match error {
        RobotError::Io { path, source } => system_error(&path, &source, message),
        RobotError::Mesh { source, .. } => match bake_error(*source) {
            error if Python::attach(|py| error.is_instance_of::<pyo3::exceptions::PyOSError>(py)) => error,
            _ => crate::errors::BakeError::new_err(message),
        },
        RobotError::Cache { source } => open_error(source),
        RobotError::Unknown { .. } => PyKeyError::new_err(message),
        RobotError::Query(source) => query_error(source),
        RobotError::Pair { source, .. } => question_error(&source, message),
        RobotError::Backend(error) => backend_error(error),
        _ => PyValueError::new_err(message),
    }
}

impl Robot {
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut cbvh_robot::Robot) -> Result<T, RobotError> + Send,
    ) -> PyResult<T> {
        detached(py, || change(&mut locked(&self.0).robot)).map_err(robot_error)
    }

    /// Asks a snapshot.
    fn ask<T>(&self, ask: impl FnOnce(&mut cbvh_robot::Robot) -> PyResult<T>) -> PyResult<T> {
        let mut own = {
            let shared = &mut *locked(&self.0);
            let now = shared.robot.snapshot();
            match shared.idle.pop() {
                Some(mut own) => {
                    own.clone_from(&now);
                    own
                }
                None => now,
            }
        };
        let answer = ask(&mut own);
        locked(&self.0).idle.push(own);
        answer
    }

    /// Asks about each row, one after the other or on all cores.
    fn each<T: Send>(
        &self,
        py: Python<'_>,
        rows: &[Vec<f64>],
        parallel: bool,
        one: impl Fn(&mut cbvh_robot::Robot, &[f64]) -> Result<T, RobotError> + Sync,
        many: impl Fn(&mut cbvh_robot::Robot, &[f64]) -> Result<Vec<T>, RobotError> + Sync,
    ) -> PyResult<Vec<T>> {
        detached(py, || {
            self.ask(|robot| {
                let parallel = parallel && rows.iter().all(|row| !row.is_empty());
                in_turns(rows, if parallel { 8192 } else { 64 }, |rows| {
                    if parallel {
                        return on_pool(|| many(robot, &rows.concat()))?.map_err(robot_error);
                    }
                    rows.iter().map(|row| one(robot, row).map_err(robot_error)).collect()
                })
            })
        })
    }
}

/// Copies rows, which another thread may change meanwhile. A robot without joint values has rows of nothing.
fn rows(values: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Vec<f64>>> {
    let (count, width) = values.as_array().dim();
    let flat = values.as_slice()?;
    Ok((0..count).map(|row| flat[row * width..][..width].to_vec()).collect())
}

fn options(clearance: f64, tolerance: Option<f64>) -> MotionOptions {
    MotionOptions::new().clearance(clearance).tolerance(tolerance)
}

/// Makes the straight motions from each row to the same one of others.
fn edges(from: &PyReadonlyArray2<'_, f64>, to: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Edge>> {
    let (from, to) = (rows(from)?, rows(to)?);
    from.iter().zip(&to).map(|(from, to)| Edge::straight(from, to).map_err(robot_error)).collect()
}

#[pymethods]
impl Robot {
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn from_urdf(
        py: Python<'_>,
        path: PathBuf,
        packages: Vec<PathBuf>,
        srdf: Option<PathBuf>,
        visual: bool,
        base: &str,
        cylinder_error: f64,
        cache: Option<PathBuf>,
    ) -> PyResult<Self> {
        let mut options = RobotOptions::default();
        (options.packages, options.srdf, options.cache) = (packages, srdf, cache);
        options.geometry = if visual { Geometry::Visual } else { Geometry::Collision };
        options.base = match base {
            "planar" => Base::Planar,
            "floating" => Base::Floating,
            _ => Base::Fixed,
        };
        options.cylinder_error = cylinder_error;
        let robot = detached(py, || on_pool(|| cbvh_robot::Robot::from_urdf(path, &options)))?;
        Ok(Self(Mutex::new(Shared { robot: robot.map_err(robot_error)?, idle: Vec::new() })))
    }

    fn copy(&self, py: Python<'_>) -> Self {
        let robot = detached(py, || locked(&self.0).robot.snapshot());
        Self(Mutex::new(Shared { robot, idle: Vec::new() }))
    }

    fn name(&self) -> String {
        locked(&self.0).robot.name().to_owned()
    }

    fn joints(&self) -> Vec<String> {
        locked(&self.0).robot.joints().to_vec()
    }

    fn limits(&self) -> Vec<[f64; 2]> {
        locked(&self.0).robot.limits().to_vec()
    }

    fn links(&self) -> Vec<String> {
        locked(&self.0).robot.links().map(str::to_owned).collect()
    }

    /// The names and the joints' places of groups.
    fn groups(&self) -> Vec<(String, Vec<usize>)> {
        let shared = locked(&self.0);
        shared.robot.groups().iter().map(|group| (group.name.clone(), group.joints.clone())).collect()
    }

    fn states(&self) -> Vec<State> {
        let shared = locked(&self.0);
        let state = |of: &cbvh_robot::State| (of.group.clone(), of.name.clone(), of.values.clone());
        shared.robot.states().iter().map(state).collect()
    }

    fn pairs(&self, py: Python<'_>) -> Vec<[String; 2]> {
        detached(py, || locked(&self.0).robot.pairs())
    }

    fn allow(&self, py: Python<'_>, a: &str, b: &str, allowed: bool) -> PyResult<()> {
        self.change(py, |robot| if allowed { robot.allow(a, b) } else { robot.disallow(a, b) })
    }

    fn allow_frequent(
        &self,
        py: Python<'_>,
        samples: usize,
        share: f64,
    ) -> PyResult<Vec<([String; 2], f64)>> {
        detached(py, || on_pool(|| locked(&self.0).robot.allow_frequent(samples, share)))?
            .map_err(robot_error)
    }

    #[pyo3(signature = (name, mesh, pose))]
    fn add_obstacle(
        &self,
        py: Python<'_>,
        name: String,
        mesh: &Bound<'_, Mesh>,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (shape, pose) = (mesh.get().shape().clone(), pose_or_identity(pose, "pose")?);
        self.change(py, |robot| robot.add_obstacle(name, shape, &pose))
    }

    fn attach(
        &self,
        py: Python<'_>,
        name: String,
        mesh: &Bound<'_, Mesh>,
        link: &str,
        pose: Option<&Bound<'_, PyAny>>,
        may_touch: Vec<String>,
    ) -> PyResult<()> {
        let (shape, pose) = (mesh.get().shape().clone(), pose_or_identity(pose, "pose")?);
        let may_touch: Vec<&str> = may_touch.iter().map(String::as_str).collect();
        self.change(py, |robot| robot.attach(name, shape, link, &pose, &may_touch))
    }

    fn remove(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.change(py, |robot| robot.remove(name))
    }

    fn set_pose(&self, py: Python<'_>, name: &str, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = pose_or_identity(Some(pose), "pose")?;
        self.change(py, |robot| robot.set_pose(name, &pose))
    }

    fn set_margin(&self, py: Python<'_>, name: &str, margin: f64) -> PyResult<()> {
        self.change(py, |robot| robot.set_margin(name, margin))
    }

    /// The poses of all links, flat, for each row.
    fn link_poses<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let rows = rows(&joints)?;
        let poses = detached(py, || {
            self.ask(|robot| {
                let of = |row: &Vec<f64>| robot.link_poses(row).map_err(robot_error);
                rows.iter().map(of).collect::<PyResult<Vec<Vec<Pose>>>>()
            })
        })?;
        Ok(array(py, poses.iter().flatten().flat_map(crate::answers::matrix)))
    }

    fn collide<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'_, f64>,
        parallel: bool,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let rows = rows(&joints)?;
        let found = self.each(
            py,
            &rows,
            parallel,
            |robot, row| robot.collide(row),
            |robot, rows| robot.collide_many(rows),
        )?;
        Ok(array(py, found.into_iter()))
    }

    fn pairs_in_contact(
        &self,
        py: Python<'_>,
        joints: PyReadonlyArray2<'_, f64>,
        parallel: bool,
    ) -> PyResult<Vec<Vec<[String; 2]>>> {
        let rows = rows(&joints)?;
        self.each(
            py,
            &rows,
            parallel,
            |robot, row| robot.pairs_in_contact(row),
            |robot, rows| robot.pairs_in_contact_many(rows),
        )
    }

    fn distance(
        &self,
        py: Python<'_>,
        joints: PyReadonlyArray2<'_, f64>,
        parallel: bool,
    ) -> PyResult<Vec<Nearest>> {
        let rows = rows(&joints)?;
        let found = self.each(
            py,
            &rows,
            parallel,
            |robot, row| robot.distance(row),
            |robot, rows| robot.distance_many(rows),
        )?;
        let answer = |found: Option<RobotDistance>| match found {
            Some(RobotDistance { bodies, nearest, points, .. }) => {
                (true, [nearest.distance, nearest.lower, nearest.upper], bodies, points)
            }
            None => (false, [f64::INFINITY; 3], Default::default(), [[f64::NAN; 3]; 2]),
        };
        Ok(found.into_iter().map(answer).collect())
    }

    fn is_free<'py>(
        &self,
        py: Python<'py>,
        from: PyReadonlyArray2<'_, f64>,
        to: PyReadonlyArray2<'_, f64>,
        clearance: f64,
        tolerance: Option<f64>,
        parallel: bool,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (edges, options) = (edges(&from, &to)?, options(clearance, tolerance));
        let free = detached(py, || {
            self.ask(|robot| {
                in_turns(&edges, if parallel { 256 } else { 1 }, |edges| {
                    if parallel {
                        return on_pool(|| robot.are_free(edges, &options))?.map_err(robot_error);
                    }
                    let of = |edge| robot.is_edge_free(edge, &options).map_err(robot_error);
                    edges.iter().map(of).collect()
                })
            })
        })?;
        Ok(array(py, free.into_iter()))
    }

    /// The motion on which each joint value follows a polynomial of time: a row of coefficients each, the constant first.
    fn motion(
        &self,
        py: Python<'_>,
        coefficients: PyReadonlyArray2<'_, f64>,
        clearance: f64,
        tolerance: Option<f64>,
    ) -> PyResult<Motion> {
        let edge = Edge::polynomials(rows(&coefficients)?);
        let options = options(clearance, tolerance);
        let found = detached(py, || self.ask(|robot| robot.motion(&edge, &options).map_err(robot_error)))?;
        Ok(match found {
            RobotMotion::Hit { free_until, touching_at, joints, bodies, nearest, .. } => {
                (1, free_until, touching_at, joints, bodies, nearest.distance)
            }
            RobotMotion::Near { free_until, at, joints, bodies, nearest, .. } => {
                (2, free_until, at, joints, bodies, nearest.distance)
            }
            _ => (0, 1.0, 1.0, Vec::new(), Default::default(), f64::INFINITY),
        })
    }
}
