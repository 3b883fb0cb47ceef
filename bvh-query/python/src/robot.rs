//! Robots: a question takes a snapshot, and runs without Python's lock and without that of the robot.

use crate::answers::{Answers, array, matrix, signed_distances};
use crate::arguments::{number, pose_or_identity};
use crate::asking::{asked, detached, in_turns, locked, on_pool, on_threads};
use crate::errors::{
    backend_error, bake_error, open_error, query_error, question_error, system_error, value_error,
};
use crate::mesh::Mesh;
use crate::motions::options;
use crate::pairs::depth_options;
use crate::stops::of_this_thread;
use bvh_query::{NumberError, OwnedShape, Pose};
use cbvh_robot::{
    Base, Edge, Geometry, NearPair, OtherBody, RobotDistance, RobotError, RobotMotion, RobotOptions,
    RobotParts, UpAxis,
};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A robot among obstacles.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Robot(Mutex<Shared>);

struct Shared {
    robot: cbvh_robot::Robot,
    /// Robots that ask no question now, which hold what they remember of earlier ones.
    idle: Vec<cbvh_robot::Robot>,
    /// What callers added as obstacles and attached objects, by name: meshes know the files that they are in.
    meshes: HashMap<String, Arc<Py<PyAny>>>,
}

/// A file's name and its text.
type Text = (OsString, String);
/// The shape of a link: the number of its core, the radius, and whether it is solid.
type LinkRow = (usize, f64, bool);
/// An obstacle or an attached object: its name, what the caller added, whether it is solid, its link, and its pose.
type OtherRow = (String, Py<PyAny>, bool, Option<String>, [f64; 16]);
/// The texts of a robot, whether shapes are visual, the base, and the warnings of its meshes.
type Texts<Base> = (Text, Option<Text>, bool, Base, Vec<String>);
/// What a robot is made of: its texts, cores, links, others, margins and allowed pairs.
type Parts =
    (Texts<&'static str>, (Vec<Mesh>, Vec<LinkRow>), Vec<OtherRow>, Vec<(String, f64)>, Vec<[String; 2]>);

/// The nearest bodies: whether there are any, the distance and its bounds, both names, and the points in the world.
type Nearest = (bool, [f64; 3], [String; 2], [[f64; 3]; 2]);
/// The names of both bodies, if there are any, for each row, and the parts of the signed distances, in the world.
type NearestSigned<'py> = (Vec<Option<[String; 2]>>, Bound<'py, PyTuple>);
/// The names of both bodies of each near pair, and the numbers of rows, distances, bounds, points, normals, derivatives and whether there
/// is a depth.
type Near<'py> = (Vec<String>, Vec<String>, Bound<'py, PyTuple>);
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
        RobotError::NotSolid { source, .. } | RobotError::Pair { source, .. } => {
            question_error(&source, message)
        }
        RobotError::Backend(error) => backend_error(error),
        _ => PyValueError::new_err(message),
    }
}

impl Robot {
    fn of(robot: cbvh_robot::Robot, meshes: HashMap<String, Arc<Py<PyAny>>>) -> Self {
        Self(Mutex::new(Shared { robot, idle: Vec::new(), meshes }))
    }

    /// Adds a body, which callers know as `known`.
    fn add(
        &self,
        py: Python<'_>,
        (name, known): (String, Py<PyAny>),
        add: impl FnOnce(&mut cbvh_robot::Robot, &str) -> Result<(), RobotError> + Send,
    ) -> PyResult<()> {
        let added = detached(py, || {
            let shared = &mut *locked(&self.0);
            add(&mut shared.robot, &name)?;
            shared.meshes.insert(name, Arc::new(known));
            Ok(())
        });
        added.map_err(robot_error)
    }

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
        asked(py, || {
            self.ask(|robot| {
                for (row, joints) in rows.iter().enumerate().filter(|_| rows.len() > 1) {
                    robot.check(joints).map_err(|source| robot_error(in_row(row, source)))?;
                }
                let parallel = parallel && rows.iter().all(|row| !row.is_empty());
                in_turns(rows, if parallel { 8192 } else { 64 }, |rows| {
                    let found = on_threads(parallel, |stop| {
                        robot.set_stop(Some(stop));
                        if parallel {
                            return many(robot, &rows.concat());
                        }
                        rows.iter().map(|row| one(robot, row)).collect()
                    });
                    found?.map_err(robot_error)
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

fn in_row(row: usize, source: RobotError) -> RobotError {
    RobotError::Row { row, source: Box::new(source) }
}

fn base_of(name: &str) -> Base {
    match name {
        "planar" => Base::Planar,
        "floating" => Base::Floating,
        _ => Base::Fixed,
    }
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
        apply_up_axis: bool,
        cache: Option<PathBuf>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let mut options = RobotOptions::default();
        (options.packages, options.srdf, options.cache) = (packages, srdf, cache);
        options.geometry = if visual { Geometry::Visual } else { Geometry::Collision };
        options.base = base_of(base);
        options.cylinder_error = cylinder_error;
        options.allow_outside = allow_outside;
        options.up_axis = if apply_up_axis { UpAxis::Turned } else { UpAxis::Kept };
        let robot = detached(py, || on_pool(|_| cbvh_robot::Robot::from_urdf(path, &options)))?;
        Ok(Self::of(robot.map_err(robot_error)?, HashMap::new()))
    }

    fn copy(&self, py: Python<'_>) -> Self {
        let (robot, meshes) = detached(py, || {
            let shared = &mut *locked(&self.0);
            (shared.robot.snapshot(), shared.meshes.clone())
        });
        Self::of(robot, meshes)
    }

    /// All that the robot holds. Links that have one core have one number of it.
    fn parts(&self, py: Python<'_>) -> Parts {
        let (parts, meshes) = detached(py, || {
            let shared = locked(&self.0);
            (shared.robot.to_parts(), shared.meshes.clone())
        });
        let mut cores: Vec<OwnedShape> = Vec::new();
        let mut link = |shape: &OwnedShape| {
            let bytes = shape.bvh().bytes().as_ptr();
            let known = cores.iter().position(|core| core.bvh().bytes().as_ptr() == bytes);
            let number = known.unwrap_or_else(|| {
                cores.push(shape.bvh().clone().into());
                cores.len() - 1
            });
            (number, shape.shape().radius(), shape.shape().is_solid())
        };
        let links = parts.links.iter().map(&mut link).collect();
        let other = |OtherBody { name, shape, link, pose }: OtherBody| {
            let Some(known) = meshes.get(&name) else {
                unreachable!("a body and its mesh are added and removed together")
            };
            let known = known.clone_ref(py);
            (name, known, shape.shape().is_solid(), link, matrix(&pose))
        };
        let others = parts.others.into_iter().map(other).collect();
        let text = |(path, text): (PathBuf, String)| (path.into_os_string(), text);
        let base = match parts.base {
            Base::Fixed => "fixed",
            Base::Planar => "planar",
            Base::Floating => "floating",
        };
        (
            (
                text(parts.urdf),
                parts.srdf.map(text),
                parts.geometry == Geometry::Visual,
                base,
                parts.mesh_warnings,
            ),
            (cores.into_iter().map(Mesh::of).collect(), links),
            others,
            parts.margins,
            parts.allowed,
        )
    }

    /// A robot of what another one holds. A link has its core, a radius, and whether it is solid.
    #[staticmethod]
    #[expect(clippy::type_complexity, reason = "it is what `parts` returns, with meshes in place of numbers")]
    fn of_parts(
        py: Python<'_>,
        texts: Texts<String>,
        links: Vec<(Bound<'_, Mesh>, f64, bool)>,
        others: Vec<(String, Bound<'_, Mesh>, Py<PyAny>, Option<String>, Bound<'_, PyAny>)>,
        margins: Vec<(String, f64)>,
        allowed: Vec<[String; 2]>,
    ) -> PyResult<Self> {
        let (urdf, srdf, visual, base, mesh_warnings) = texts;
        let link = |(core, radius, is_solid): (Bound<'_, Mesh>, f64, bool)| {
            let shape = core.get().shape().clone().rounded(radius)?;
            if is_solid { shape.solid() } else { Ok(shape) }
        };
        let links = links.into_iter().map(link).collect::<Result<_, _>>().map_err(query_error)?;
        let (mut bodies, mut meshes) = (Vec::new(), HashMap::new());
        for (name, mesh, known, link, pose) in others {
            let (shape, pose) = (mesh.get().shape().clone(), pose_or_identity(Some(&pose), "pose")?);
            meshes.insert(name.clone(), Arc::new(known));
            bodies.push(OtherBody { name, shape, link, pose });
        }
        let text = |(path, text): Text| (PathBuf::from(path), text);
        let parts = RobotParts {
            urdf: text(urdf),
            srdf: srdf.map(text),
            geometry: if visual { Geometry::Visual } else { Geometry::Collision },
            base: base_of(&base),
            mesh_warnings,
            links,
            others: bodies,
            margins,
            allowed,
        };
        let robot = detached(py, || cbvh_robot::Robot::from_parts(parts)).map_err(robot_error)?;
        Ok(Self::of(robot, meshes))
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

    fn warnings(&self) -> Vec<String> {
        locked(&self.0).robot.warnings().to_vec()
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
        samples: &Bound<'_, PyAny>,
        share: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<([String; 2], f64)>> {
        let wrong = || format!("expected a whole number of at least 1, found {samples}");
        let samples = samples.extract().ok().filter(|&samples: &usize| samples > 0);
        let samples = samples.ok_or_else(|| value_error("samples", wrong()))?;
        let share = number(share, "share")?;
        if !(share > 0.0 && share <= 1.0) {
            let found = format!("expected a part above 0 and at most 1, found {share}");
            return Err(value_error("share", found));
        }
        asked(py, || {
            let frequent = self.ask(|robot| {
                let found = on_pool(|stop| {
                    robot.set_stop(Some(stop));
                    robot.allow_frequent(samples, share)
                });
                found?.map_err(robot_error)
            })?;
            let robot = &mut locked(&self.0).robot;
            for ([a, b], _) in &frequent {
                robot.allow(a, b).map_err(robot_error)?;
            }
            Ok(frequent)
        })
    }

    fn add_obstacle(
        &self,
        py: Python<'_>,
        name: String,
        mesh: &Bound<'_, Mesh>,
        known: Py<PyAny>,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (shape, pose) = (mesh.get().shape().clone(), pose_or_identity(pose, "pose")?);
        self.add(py, (name, known), |robot, name| robot.add_obstacle(name, shape, &pose))
    }

    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn attach(
        &self,
        py: Python<'_>,
        name: String,
        mesh: &Bound<'_, Mesh>,
        known: Py<PyAny>,
        link: &str,
        pose: Option<&Bound<'_, PyAny>>,
        may_touch: Vec<String>,
    ) -> PyResult<()> {
        let (shape, pose) = (mesh.get().shape().clone(), pose_or_identity(pose, "pose")?);
        let may_touch: Vec<&str> = may_touch.iter().map(String::as_str).collect();
        self.add(py, (name, known), |robot, name| robot.attach(name, shape, link, &pose, &may_touch))
    }

    fn remove(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let removed = detached(py, || {
            let shared = &mut *locked(&self.0);
            shared.robot.remove(name)?;
            Ok(shared.meshes.remove(name))
        });
        removed.map(drop).map_err(robot_error)
    }

    fn set_pose(&self, py: Python<'_>, name: &str, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = pose_or_identity(Some(pose), "pose")?;
        self.change(py, |robot| robot.set_pose(name, &pose))
    }

    fn set_margin(&self, py: Python<'_>, name: &str, margin: f64) -> PyResult<()> {
        self.change(py, |robot| robot.set_margin(name, margin))
    }

    fn make_solid(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.change(py, |robot| robot.make_solid(name))
    }

    /// The nearest goals, flat, for each row.
    fn nearest_turns<'py>(
        &self,
        py: Python<'py>,
        from: PyReadonlyArray2<'_, f64>,
        to: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (from, to) = (rows(&from)?, rows(&to)?);
        let nearest = detached(py, || {
            self.ask(|robot| {
                let of =
                    |(from, to): (&Vec<f64>, &Vec<f64>)| robot.nearest_turns(from, to).map_err(robot_error);
                from.iter().zip(&to).map(of).collect::<PyResult<Vec<Vec<f64>>>>()
            })
        })?;
        Ok(array(py, nearest.into_iter().flatten()))
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
        Ok(array(py, poses.iter().flatten().flat_map(matrix)))
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

    fn pairs_inside(
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
            |robot, row| robot.pairs_inside(row),
            |robot, rows| robot.pairs_inside_many(rows),
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

    /// Asks about rows, which are one alone or many.
    fn signed_distance<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'_, f64>,
        one: bool,
        relative_gap: &Bound<'py, PyAny>,
        tolerance: Option<&Bound<'py, PyAny>>,
        parallel: bool,
    ) -> PyResult<NearestSigned<'py>> {
        let (rows, options) = (rows(&joints)?, depth_options(relative_gap, tolerance)?);
        // Without rows, too, the options are checked.
        options.check().map_err(query_error)?;
        let found = self.each(
            py,
            &rows,
            parallel,
            |robot, row| robot.signed_distance(row, &options),
            |robot, rows| robot.signed_distance_many(rows, &options),
        )?;
        let nearest = found.iter().map(|of| of.as_ref().map(|of| of.nearest));
        let nearest = signed_distances(Answers { py, one }, nearest)?;
        Ok((found.into_iter().map(|of| of.map(|of| of.bodies)).collect(), nearest))
    }

    /// Finds the near pairs of all rows, one row after the other.
    fn near_pairs<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'_, f64>,
        margin: &Bound<'py, PyAny>,
        relative_gap: &Bound<'py, PyAny>,
        tolerance: Option<&Bound<'py, PyAny>>,
        parallel: bool,
    ) -> PyResult<Near<'py>> {
        let width = joints.as_array().ncols();
        let (rows, margin) = (rows(&joints)?, number(margin, "margin")?);
        let options = depth_options(relative_gap, tolerance)?;
        // Without rows, too, numbers are checked.
        if !(0.0..f64::INFINITY).contains(&margin) {
            return Err(query_error(NumberError::Margin(margin).into()));
        }
        options.check().map_err(query_error)?;
        let found = self.each(
            py,
            &rows,
            parallel,
            |robot, row| robot.near_pairs(row, margin, &options),
            |robot, rows| robot.near_pairs_many(rows, margin, &options),
        )?;
        let numbers = found.iter().enumerate().flat_map(|(row, pairs)| pairs.iter().map(move |_| row as i64));
        let pairs = || found.iter().flatten();
        let many = Answers { py, one: false };
        let values = |of: fn(&NearPair) -> f64| many.values(pairs().map(of));
        let points = |of: fn(&NearPair) -> [f64; 3]| many.rows(pairs().map(of));
        let gradients: Vec<f64> = pairs().flat_map(|pair| pair.gradient.iter().copied()).collect();
        let parts = (
            array(py, numbers),
            values(|of| of.nearest.distance)?,
            values(|of| of.nearest.lower)?,
            values(|of| of.nearest.upper)?,
            points(|of| of.nearest.point_a)?,
            points(|of| of.nearest.point_b)?,
            points(|of| of.nearest.normal)?,
            PyArray1::from_vec(py, gradients).reshape([pairs().count(), width])?,
            many.values(pairs().map(|of| of.nearest.is_signed))?,
        )
            .into_pyobject(py)?;
        let (a, b) = found.into_iter().flatten().map(|NearPair { bodies: [a, b], .. }| (a, b)).unzip();
        Ok((a, b, parts))
    }

    fn is_free<'py>(
        &self,
        py: Python<'py>,
        from: PyReadonlyArray2<'_, f64>,
        to: PyReadonlyArray2<'_, f64>,
        clearance: &Bound<'_, PyAny>,
        tolerance: Option<&Bound<'_, PyAny>>,
        parallel: bool,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (edges, options) = (edges(&from, &to)?, options(clearance, tolerance)?);
        let free = asked(py, || {
            self.ask(|robot| {
                for (row, edge) in edges.iter().enumerate().filter(|_| edges.len() > 1) {
                    robot.check_edge(edge).map_err(|source| robot_error(in_row(row, source)))?;
                }
                in_turns(&edges, if parallel { 256 } else { 1 }, |edges| {
                    let found = on_threads(parallel, |stop| {
                        robot.set_stop(Some(stop));
                        if parallel {
                            return robot.are_free(edges, &options);
                        }
                        edges.iter().map(|edge| robot.is_edge_free(edge, &options)).collect()
                    });
                    found?.map_err(robot_error)
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
        clearance: &Bound<'_, PyAny>,
        tolerance: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Motion> {
        let edge = Edge::polynomials(rows(&coefficients)?);
        let options = options(clearance, tolerance)?;
        let found = asked(py, || {
            self.ask(|robot| {
                robot.set_stop(Some(of_this_thread()));
                robot.motion(&edge, &options).map_err(robot_error)
            })
        })?;
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
