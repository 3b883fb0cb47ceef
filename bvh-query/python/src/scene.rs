//! Scenes: placed meshes under numbers of their own, and questions about all of them.
//!
//! A number is given once and never again. A question is about the scene as it is when the question begins: it takes a
//! snapshot, and runs without any lock. The scene is locked only while it is changed or looked at, or a snapshot is taken,
//! without Python's lock. So a thread that changes the scene neither waits for a question nor disturbs it.

use crate::answers::{Answers, array, table};
use crate::arguments::{self, pose_or_identity};
use crate::asking::{asked, detached, locked, on_threads};
use crate::errors::{FormatError, backend_error, open_error, query_error, question_error, value_error};
use crate::mesh::Mesh;
use bvh_query::{
    Bvh, Groups, InstanceId, InstanceLabel, OwnedShape, Pose, SceneError, ScenePair, SceneShape,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// An instance, as far as the scene of the library does not tell.
#[derive(Clone)]
struct Entry {
    id: InstanceId,
    /// What the caller added.
    mesh: Arc<Py<PyAny>>,
}

/// A scene, and its numbers of instances. A clone shares all of that until one changes.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) scene: bvh_query::Scene,
    entries: Arc<HashMap<i64, Entry>>,
    numbers: Arc<HashMap<InstanceId, i64>>,
    next: i64,
    pub(crate) parallel: bool,
    tracking: bool,
}

impl State {
    fn new(scene: bvh_query::Scene) -> Self {
        Self {
            scene,
            entries: Arc::default(),
            numbers: Arc::default(),
            next: 0,
            parallel: false,
            tracking: false,
        }
    }

    fn enter(&mut self, number: Option<i64>, id: InstanceId, mesh: Py<PyAny>) -> i64 {
        let number = number.unwrap_or(self.next);
        self.insert(number, Entry { id, mesh: Arc::new(mesh) });
        self.next = self.next.max(number.saturating_add(1));
        number
    }

    fn insert(&mut self, number: i64, entry: Entry) {
        Arc::make_mut(&mut self.numbers).insert(entry.id, number);
        Arc::make_mut(&mut self.entries).insert(number, entry);
    }

    fn entry(&self, number: i64, name: &str) -> PyResult<&Entry> {
        self.entries.get(&number).ok_or_else(|| no_instance(name, number))
    }

    pub(crate) fn id(&self, number: i64, name: &str) -> PyResult<InstanceId> {
        Ok(self.entry(number, name)?.id)
    }

    /// Returns the number of an instance of the scene.
    pub(crate) fn number(&self, id: InstanceId) -> i64 {
        self.numbers.get(&id).copied().unwrap_or(-1)
    }

    pub(crate) fn pair(&self, pair: ScenePair) -> [i64; 2] {
        [self.number(pair.a), self.number(pair.b)]
    }

    /// Names an instance that an error of the scene names: by its name or, without one, by its number.
    fn called(&self, instance: &InstanceLabel) -> String {
        match &instance.name {
            Some(name) => format!("{name:?}"),
            None => self.number(instance.id).to_string(),
        }
    }

    /// The exception of what the scene refuses, which names instances as callers know them.
    pub(crate) fn refused(&self, error: impl Into<SceneError>) -> PyErr {
        match error.into() {
            SceneError::Pair { a, b, source } => {
                let message = format!("instances {} and {}: {source}", self.called(&a), self.called(&b));
                question_error(&source, message)
            }
            SceneError::Instance { instance, source } => {
                question_error(&source, format!("instance {}: {source}", self.called(&instance)))
            }
            SceneError::Query(source) => query_error(source),
            SceneError::Pose { instance, source } => {
                value_error(&format!("instance {}", self.called(&instance)), source)
            }
            SceneError::Cycle { child, parent } => value_error(
                "parent",
                format!(
                    "expected an instance that does not move with instance {}, found {}",
                    self.called(&child),
                    self.called(&parent)
                ),
            ),
            error => PyValueError::new_err(error.to_string()),
        }
    }
}

/// The exception of a number that names no instance, or no longer.
fn no_instance(name: &str, found: i64) -> PyErr {
    PyKeyError::new_err(format!("{name}: expected an instance of the scene, found {found}; was it removed?"))
}

/// Many placed meshes.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Scene(Mutex<Shared>);

/// A scene, and what earlier questions about it left.
struct Shared {
    state: State,
    /// Scenes that ask no question now. They hold what they remember of earlier ones, and no instances.
    idle: Vec<bvh_query::Scene>,
    /// A scene without instances.
    empty: bvh_query::Scene,
}

impl Scene {
    fn of_state(state: State) -> PyResult<Self> {
        let empty = bvh_query::Scene::new().map_err(backend_error)?;
        Ok(Self(Mutex::new(Shared { state, idle: Vec::new(), empty })))
    }

    /// Waits for the scene without Python's lock, and calls `work` with it, without Python's lock. No question is asked there.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut State) -> T + Send) -> T {
        detached(py, || work(&mut locked(&self.0).state))
    }

    /// Looks at an instance or changes it.
    fn of<T: Send>(
        &self,
        py: Python<'_>,
        number: i64,
        work: impl FnOnce(&mut bvh_query::Scene, InstanceId) -> Result<T, SceneError> + Send,
    ) -> PyResult<T> {
        self.with(py, |state| {
            let id = state.id(number, "id")?;
            work(&mut state.scene, id).map_err(|error| state.refused(error))
        })
    }

    /// Changes two instances.
    fn of_both<T: Send>(
        &self,
        py: Python<'_>,
        [a, b]: [(i64, &str); 2],
        work: impl FnOnce(&mut bvh_query::Scene, InstanceId, InstanceId) -> Result<T, SceneError> + Send,
    ) -> PyResult<T> {
        self.with(py, |state| {
            let (a, b) = (state.id(a.0, a.1)?, state.id(b.0, b.1)?);
            work(&mut state.scene, a, b).map_err(|error| state.refused(error))
        })
    }

    /// Calls `work` with the scene as it is now, without Python's lock: later changes do not affect it.
    pub(crate) fn with_snapshot<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        asked(py, || {
            let (mut own, empty) = {
                let Shared { state, idle, empty } = &mut *locked(&self.0);
                let snapshot = state.scene.snapshot();
                let mut own = state.clone();
                if let Some(remembers) = idle.pop() {
                    own.scene = remembers;
                    own.scene.clone_from(&snapshot);
                }
                (own, empty.clone())
            };
            // After an error, which is rare, what asked may be in the middle of a question, and is thrown away.
            let answer = work(&mut own)?;
            own.scene.clone_from(&empty);
            locked(&self.0).idle.push(own.scene);
            Ok(answer)
        })
    }

    /// Asks a question, and reads the answer.
    pub(crate) fn ask<A: Send, T: Send>(
        &self,
        py: Python<'_>,
        ask: impl FnOnce(&mut bvh_query::Scene) -> Result<A, SceneError> + Send,
        read: impl FnOnce(&State, A) -> T + Send,
    ) -> PyResult<T> {
        self.with_snapshot(py, |state| {
            let answer = on_threads(state.parallel, |stop| {
                state.scene.set_stop(Some(stop));
                ask(&mut state.scene)
            })?;
            match answer {
                Ok(answer) => Ok(read(state, answer)),
                Err(error) => Err(state.refused(error)),
            }
        })
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> PyResult<Self> {
        let scene = bvh_query::Scene::new().map_err(backend_error)?;
        Self::of_state(State::new(scene))
    }

    /// Opens a scene file. `mesh` makes what callers know of an object of the file.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf, mesh: Bound<'_, PyAny>) -> PyResult<Self> {
        let damaged = |error: String| FormatError::new_err(format!("{}: {error}", path.display()));
        let (bvh, scene) = detached(py, || {
            // SAFETY: the documentation of `Scene.open` asks that nobody changes the file.
            let bvh = unsafe { Bvh::map(&path) }.map_err(open_error)?;
            let scene = bvh_query::Scene::of_file(bvh.clone());
            Ok::<_, PyErr>((bvh, scene.map_err(|error| damaged(error.to_string()))?))
        })?;
        let instances = bvh.layout().read_instances(bvh.bytes());
        let instances = instances.map_err(|error| damaged(error.to_string()))?;
        let ids: Vec<InstanceId> = scene.instances().collect();
        let mut meshes = HashMap::new();
        let mut state = State::new(scene);
        for (id, instance) in ids.into_iter().zip(instances) {
            let known = meshes.get(&instance.object).map(|mesh: &Py<PyAny>| mesh.clone_ref(py));
            let mesh = match known {
                Some(mesh) => mesh,
                None => {
                    let shape = OwnedShape::object(bvh.clone(), instance.object as usize);
                    let own = shape.unwrap_or_else(|| OwnedShape::from(bvh.clone()));
                    let made = mesh.call1((Mesh::of(own), instance.object))?.unbind();
                    meshes.insert(instance.object, made.clone_ref(py));
                    made
                }
            };
            state.enter(None, id, mesh);
        }
        Self::of_state(state)
    }

    /// A scene of the same instances, under the same numbers.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        Self::of_state(self.with(py, |state| state.clone()))
    }

    /// A scene of these instances alone, under the same numbers.
    fn only(&self, py: Python<'_>, numbers: PyReadonlyArray1<'_, i64>) -> PyResult<Self> {
        let numbers = numbers.as_slice()?.to_vec();
        self.with(py, |state| {
            let ids = numbers.iter().map(|&number| state.id(number, "instances"));
            let mut ids = ids.collect::<PyResult<Vec<_>>>()?;
            // In the order of the scene, each once.
            ids.sort_unstable();
            ids.dedup();
            let made = bvh_query::Scene::new().map_err(backend_error)?;
            let mut only = State::new(made);
            only.parallel = state.parallel;
            only.scene.set_parallel(state.parallel);
            for id in ids {
                let known = (|| {
                    let (shape, pose) = (state.scene.shape(id)?.clone(), *state.scene.pose(id)?);
                    match state.scene.name(id)? {
                        Some(name) => only.scene.add_named(name, shape, pose),
                        None => only.scene.add(shape, pose),
                    }
                })();
                let added = known.map_err(|error| state.refused(error))?;
                let margin = state.scene.margin(id).map_err(|error| state.refused(error))?;
                only.scene.set_margin(added, margin).map_err(|error| state.refused(error))?;
                let number = state.number(id);
                let mesh = Arc::clone(&state.entry(number, "instances")?.mesh);
                only.insert(number, Entry { id: added, mesh });
            }
            Self::of_state(only)
        })
    }

    /// Adds `mesh`, which callers know as `known`. A number that is given is that of a scene that this one is made after.
    #[expect(clippy::too_many_arguments, reason = "these are what an instance has")]
    fn add(
        &self,
        py: Python<'_>,
        mesh: &Mesh,
        known: Py<PyAny>,
        pose: Option<Bound<'_, PyAny>>,
        name: Option<String>,
        groups: [u32; 2],
        number: Option<i64>,
    ) -> PyResult<i64> {
        let pose = pose_or_identity(pose.as_ref(), "pose")?;
        let shape = SceneShape::from(mesh.shape().clone());
        let groups = Groups { member: groups[0], meets: groups[1] };
        self.with(py, |state| {
            let added = match name {
                Some(name) => state.scene.add_named(name, shape, pose),
                None => state.scene.add(shape, pose),
            };
            let id = added.map_err(|error| match error {
                SceneError::Pose { source, .. } => value_error("pose", source),
                SceneError::NameTaken(name) => {
                    value_error("name", format!("expected one that no instance has, found {name:?}"))
                }
                error => state.refused(error),
            })?;
            // The instance is there.
            state.scene.set_groups(id, groups).map_err(|error| state.refused(error))?;
            Ok(state.enter(number, id, known))
        })
    }

    fn remove(&self, py: Python<'_>, number: i64) -> PyResult<()> {
        self.with(py, |state| {
            let id = state.id(number, "id")?;
            state.scene.remove(id).map_err(|error| state.refused(error))?;
            Arc::make_mut(&mut state.numbers).remove(&id);
            Arc::make_mut(&mut state.entries).remove(&number);
            Ok(())
        })
    }

    /// Replaces the mesh of an instance by `mesh`, which callers know as `known`.
    fn set_mesh(&self, py: Python<'_>, number: i64, mesh: &Mesh, known: Py<PyAny>) -> PyResult<()> {
        let shape = SceneShape::from(mesh.shape().clone());
        self.with(py, |state| {
            let id = state.id(number, "id")?;
            state.scene.set_shape(id, shape).map_err(|error| state.refused(error))?;
            state.insert(number, Entry { id, mesh: Arc::new(known) });
            Ok(())
        })
    }

    /// Attaches an instance to a parent, where it is or at a pose of shape (4, 4) in the parent's frame.
    fn attach(
        &self,
        py: Python<'_>,
        child: i64,
        parent: i64,
        pose: Option<Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let pose = pose.map(|pose| arguments::pose(&pose, "pose")).transpose()?;
        self.of_both(py, [(child, "child"), (parent, "parent")], |scene, child, parent| match pose {
            Some(kept) => scene.attach_at(child, parent, kept),
            None => scene.attach(child, parent),
        })
    }

    fn detach(&self, py: Python<'_>, child: i64) -> PyResult<()> {
        self.of(py, child, |scene, child| scene.detach(child))
    }

    /// The parent of an instance, and its pose in the parent's frame, shape (4, 4); or `None`.
    fn parent<'py>(&self, py: Python<'py>, child: i64) -> PyResult<Option<(i64, Bound<'py, PyAny>)>> {
        let found = self.with(py, |state| {
            let id = state.id(child, "id")?;
            let found = state.scene.parent(id).map_err(|error| state.refused(error))?;
            Ok::<_, PyErr>(found.map(|(parent, kept)| (state.number(parent), *kept)))
        })?;
        let told = |(parent, kept)| Ok((parent, Answers { py, one: true }.poses(&[kept])?));
        found.map(told).transpose()
    }

    /// Moves an instance to a pose of shape (4, 4).
    fn set_pose(&self, number: i64, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let (py, pose) = (pose.py(), arguments::pose(pose, "pose")?);
        self.of(py, number, |scene, id| scene.set_pose(id, pose))
    }

    /// Moves as many instances as there are poses, of shape (N, 4, 4).
    fn set_poses(
        &self,
        py: Python<'_>,
        numbers: PyReadonlyArray1<'_, i64>,
        poses: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let (numbers, poses) = (numbers.as_slice()?.to_vec(), arguments::many_poses(poses, "poses")?);
        if numbers.len() != poses.len() {
            let found = format!("poses: expected as many as ids, {}, found {}", numbers.len(), poses.len());
            return Err(PyValueError::new_err(found));
        }
        self.with(py, |state| {
            let ids = numbers.iter().map(|&number| state.id(number, "ids")).collect::<PyResult<Vec<_>>>()?;
            let moved = state.scene.set_poses(ids.into_iter().zip(poses));
            moved.map_err(|error| state.refused(error))
        })
    }

    fn set_groups(&self, py: Python<'_>, number: i64, groups: [u32; 2]) -> PyResult<()> {
        let groups = Groups { member: groups[0], meets: groups[1] };
        self.of(py, number, |scene, id| scene.set_groups(id, groups))
    }

    fn groups(&self, py: Python<'_>, number: i64) -> PyResult<(u32, u32)> {
        self.of(py, number, |scene, id| scene.groups(id).map(|groups| (groups.member, groups.meets)))
    }

    fn set_allowed(&self, py: Python<'_>, a: i64, b: i64, allowed: bool) -> PyResult<()> {
        self.of_both(py, [(a, "a"), (b, "b")], |scene, a, b| scene.set_allowed(a, b, allowed))
    }

    /// The pairs that may touch, lower numbers first: the order of instances depends on which were removed before.
    fn allowed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let mut allowed: Vec<_> =
            self.with(py, |state| state.scene.allowed().map(|pair| state.pair(pair)).collect());
        allowed.iter_mut().for_each(|pair| pair.sort_unstable());
        allowed.sort_unstable();
        table(py, allowed.into_iter())
    }

    fn set_margin(&self, py: Python<'_>, number: i64, margin: f64) -> PyResult<()> {
        self.of(py, number, |scene, id| scene.set_margin(id, margin))
    }

    fn margin(&self, py: Python<'_>, number: i64) -> PyResult<f64> {
        self.of(py, number, |scene, id| scene.margin(id))
    }

    fn set_pair_margin(&self, py: Python<'_>, a: i64, b: i64, margin: f64) -> PyResult<()> {
        self.of_both(py, [(a, "a"), (b, "b")], |scene, a, b| scene.set_pair_margin(a, b, margin))
    }

    /// The pairs with margins of their own, lower numbers first, and these.
    fn pair_margins(&self, py: Python<'_>) -> Vec<(i64, i64, f64)> {
        let mut found: Vec<(i64, i64, f64)> = self.with(py, |state| {
            let of_pair = |(pair, margin)| {
                let mut numbers = state.pair(pair);
                numbers.sort_unstable();
                (numbers[0], numbers[1], margin)
            };
            state.scene.pair_margins().map(of_pair).collect()
        });
        found.sort_unstable_by_key(|&(a, b, _)| (a, b));
        found
    }

    fn find(&self, py: Python<'_>, name: &str) -> Option<i64> {
        self.with(py, |state| state.scene.find(name).map(|id| state.number(id)))
    }

    fn name(&self, py: Python<'_>, number: i64) -> PyResult<Option<String>> {
        self.of(py, number, |scene, id| Ok(scene.name(id)?.map(str::to_owned)))
    }

    /// What callers know of the mesh of an instance.
    fn mesh(&self, py: Python<'_>, number: i64) -> PyResult<Py<PyAny>> {
        let mesh = self.with(py, |state| Ok::<_, PyErr>(state.entry(number, "id")?.mesh.clone()))?;
        Ok(mesh.clone_ref(py))
    }

    /// The numbers of all instances, in their order.
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let numbers: Vec<i64> =
            self.with(py, |state| state.scene.instances().map(|id| state.number(id)).collect());
        array(py, numbers.into_iter())
    }

    fn has(&self, py: Python<'_>, number: i64) -> bool {
        self.with(py, |state| state.entries.contains_key(&number))
    }

    fn count(&self, py: Python<'_>) -> usize {
        self.with(py, |state| state.entries.len())
    }

    /// The number that the next instance gets.
    fn next(&self, py: Python<'_>) -> i64 {
        self.with(py, |state| state.next)
    }

    /// Numbers instances from here on, if that many have not been given yet.
    fn skip_to(&self, py: Python<'_>, next: i64) {
        self.with(py, |state| state.next = state.next.max(next));
    }

    /// The pose of an instance, shape (4, 4).
    fn pose<'py>(&self, py: Python<'py>, number: i64) -> PyResult<Bound<'py, PyAny>> {
        let found = self.of(py, number, |scene, id| scene.pose(id).copied())?;
        Answers { py, one: true }.poses(&[found])
    }

    /// The poses of instances, shape (N, 4, 4).
    fn poses<'py>(
        &self,
        py: Python<'py>,
        numbers: PyReadonlyArray1<'py, i64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let numbers = numbers.as_slice()?.to_vec();
        let found = self.with(py, |state| {
            let pose = |&number: &i64| -> PyResult<Pose> {
                let id = state.id(number, "ids")?;
                state.scene.pose(id).copied().map_err(|_| no_instance("ids", number))
            };
            numbers.iter().map(pose).collect::<PyResult<Vec<_>>>()
        })?;
        Answers { py, one: false }.poses(&found)
    }

    /// Whether questions use all cores, and whether the scene remembers what it found of each pair.
    fn switches(&self, py: Python<'_>) -> (bool, bool) {
        self.with(py, |state| (state.parallel, state.tracking))
    }

    fn set_switches(&self, py: Python<'_>, parallel: bool, tracking: bool) {
        self.with(py, |state| {
            (state.parallel, state.tracking) = (parallel, tracking);
            state.scene.set_parallel(parallel);
            state.scene.set_tracking(tracking);
        });
    }
}
