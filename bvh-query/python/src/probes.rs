//! Questions about many points, rays or segments: in the frame of a mesh, or in the world, over all instances of a scene.

use crate::answers::{self, Answers};
use crate::arguments::{Rows, flag, number, numbers, points as read_points, pose_or_identity, shape_error};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::{backend_error, query_error};
use crate::mesh::Mesh;
use crate::scene::{Scene, State};
use bvh_query::{
    ClosestPoint, InstanceId, PlacedShape, Pose, ProbeBatch, Querier, QueryError, Ray, RayHit, SceneError,
    SceneRayHit,
};
use numpy::PyUntypedArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

/// What a question is about: a mesh, its pose in the frame of the probes (`None` for the identity) and whether to use all
/// cores; or a scene, which has its own of both.
#[derive(FromPyObject)]
pub(crate) enum Of<'py> {
    Scene(Bound<'py, Scene>),
    Mesh(Bound<'py, Mesh>, Option<Bound<'py, PyAny>>, Bound<'py, PyAny>),
}

/// What a question is about, where a mesh stands in the frame of the probes, and the probes.
struct Question<'py, P> {
    py: Python<'py>,
    of: Of<'py>,
    pose: Pose,
    probes: Rows<P>,
    parallel: bool,
}

/// The instance, if there is one, and what is found of it.
type OfInstance<T> = (Option<InstanceId>, T);

impl<'py, P: Sync> Question<'py, P> {
    fn new(py: Python<'py>, of: Of<'py>, probes: Rows<P>) -> PyResult<Self> {
        let (pose, parallel) = match &of {
            Of::Scene(_) => (Pose::IDENTITY, false),
            Of::Mesh(_, pose, parallel) => {
                (pose_or_identity(pose.as_ref(), "pose")?, flag(parallel, "parallel")?)
            }
        };
        Ok(Self { py, of, pose, probes, parallel })
    }

    /// Asks about all probes without Python's lock: a mesh on all cores or one after the other, and a scene about all of them.
    /// Returns the numbers of instances, of a scene alone, and what is found.
    fn ask_of_instances<T: Send>(
        &self,
        batch: impl Fn(&ProbeBatch<'_>, &[P]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, PlacedShape<'_>, &P) -> Result<T, QueryError> + Send + Sync,
        scene: impl FnOnce(&mut bvh_query::Scene, &[P]) -> Result<Vec<OfInstance<T>>, SceneError> + Send,
    ) -> PyResult<(Option<Vec<i64>>, Vec<T>)> {
        let probes = &self.probes.rows;
        let mesh = match &self.of {
            Of::Mesh(mesh, ..) => mesh.get(),
            Of::Scene(asked) => {
                let (numbers, found) = asked.get().ask(
                    self.py,
                    |asked| scene(asked, probes),
                    |state, found| {
                        let number = |id: Option<InstanceId>| id.map_or(-1, |id| state.number(id));
                        found.into_iter().map(|(id, found)| (number(id), found)).unzip()
                    },
                )?;
                return Ok((Some(numbers), found));
            }
        };
        let placed = mesh.shape().shape().at(&self.pose);
        // Without probes, too, the other arguments are checked.
        let found = if self.parallel || probes.is_empty() {
            let all = ProbeBatch::new(placed).map_err(backend_error)?;
            on_all_cores(self.py, probes, |stop, probes| {
                let mut all = all.clone();
                all.set_stop(Some(stop));
                batch(&all, probes).map_err(query_error)
            })
        } else {
            one_by_one(self.py, probes, |querier, probe| one(querier, placed, probe).map_err(query_error))
        };
        Ok((None, found?))
    }

    /// Asks what has the same answer of a mesh and of all instances together.
    fn ask<T: Send>(
        &self,
        batch: impl Fn(&ProbeBatch<'_>, &[P]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, PlacedShape<'_>, &P) -> Result<T, QueryError> + Send + Sync,
        scene: impl FnOnce(&mut bvh_query::Scene, &[P]) -> Result<Vec<T>, SceneError> + Send,
    ) -> PyResult<Vec<T>> {
        let scene = |asked: &mut bvh_query::Scene, probes: &[P]| {
            Ok(scene(asked, probes)?.into_iter().map(|found| (None, found)).collect())
        };
        Ok(self.ask_of_instances(batch, one, scene)?.1)
    }

    fn answers(&self) -> Answers<'py> {
        Answers { py: self.py, one: self.probes.one }
    }
}

/// Numbers of instances, of a scene alone, and what is found.
type Found<'py> = PyResult<(Option<Bound<'py, PyAny>>, Bound<'py, PyAny>)>;

#[pyfunction]
pub(crate) fn closest_points<'py>(
    of: Of<'py>,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
) -> Found<'py> {
    let question = Question::new(points.py(), of, read_points(points, "points")?)?;
    let within = number(within, "within")?;
    let (instances, found): (_, Vec<Option<ClosestPoint>>) = question.ask_of_instances(
        |batch, points| batch.closest_points(points, within),
        |querier, shape, &point| querier.closest_point(shape, point, within),
        |scene, points| {
            let found = scene.closest_points(points, within)?.into_iter();
            Ok(found.map(|found| (found.map(|of| of.instance), found.map(|of| of.closest))).collect())
        },
    )?;
    let to = question.answers();
    let instances = instances.map(|instances| to.values(instances.into_iter())).transpose()?;
    Ok((instances, answers::closest(to, found.into_iter())?.into_any()))
}

#[pyfunction]
pub(crate) fn sides<'py>(of: Of<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(points.py(), of, read_points(points, "points")?)?;
    let found = question.ask(
        |batch, points| batch.sides(points),
        |querier, shape, &point| querier.side(shape, point),
        |scene, points| scene.sides(points),
    )?;
    question.answers().values(found.into_iter().map(|side| side as i8))
}

/// NaN where there is no inside, and where no surface is within the distance.
#[pyfunction]
pub(crate) fn signed_point_distances<'py>(
    of: Of<'py>,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(points.py(), of, read_points(points, "points")?)?;
    let within = number(within, "within")?;
    let found = question.ask(
        |batch, points| batch.signed_point_distances(points, within),
        |querier, shape, &point| querier.signed_point_distance(shape, point, within),
        |scene, points| {
            let found = scene.signed_point_distances(points, within)?.into_iter();
            Ok(found.map(|found| found.map(|(_, found)| found)).collect())
        },
    )?;
    let distances = found.into_iter().map(|found| found.and_then(|found| found.value()).unwrap_or(f64::NAN));
    question.answers().values(distances)
}

/// Reads rays: origins and directions of shape (3,) or (N, 3), and their greatest parameters of shape () or (N,). One origin
/// serves N directions, and one direction N origins.
fn rays(
    origins: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    until: &Bound<'_, PyAny>,
) -> PyResult<Rows<Ray>> {
    let (origins, directions) = (read_points(origins, "origins")?, read_points(directions, "directions")?);
    let mut rays = origins.with("origins", (&directions, "directions"), |&origin, &direction, _| {
        Ok(Ray::new(origin, direction))
    })?;
    let until = numbers(until, "until")?;
    let count = rays.rows.len();
    if !until.shape().is_empty() && (rays.one || until.shape() != [count]) {
        let expected = if rays.one { "()".to_owned() } else { format!("() or ({count},)") };
        return Err(shape_error("until", &expected, until.shape()));
    }
    for (ray, &until) in rays.rows.iter_mut().zip(until.as_slice()?.iter().cycle()) {
        *ray = ray.until(until);
    }
    Ok(rays)
}

fn of_instance(found: Option<SceneRayHit>) -> OfInstance<Option<RayHit>> {
    (found.map(|found| found.instance), found.map(|found| found.hit))
}

#[pyfunction]
pub(crate) fn first_hits<'py>(
    of: Of<'py>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> Found<'py> {
    let question = Question::new(origins.py(), of, rays(origins, directions, until)?)?;
    let (instances, found) = question.ask_of_instances(
        |batch, rays| batch.first_hits(rays),
        |querier, shape, ray| querier.first_hit(shape, ray),
        |scene, rays| Ok(scene.first_hits(rays)?.into_iter().map(of_instance).collect()),
    )?;
    let to = question.answers();
    let instances = instances.map(|instances| to.values(instances.into_iter())).transpose()?;
    Ok((instances, answers::hits(to, found.into_iter())?.into_any()))
}

#[pyfunction]
pub(crate) fn any_hits<'py>(
    of: Of<'py>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(origins.py(), of, rays(origins, directions, until)?)?;
    let found = question.ask(
        |batch, rays| batch.any_hits(rays),
        |querier, shape, ray| querier.any_hit(shape, ray),
        |scene, rays| scene.any_hits(rays),
    )?;
    question.answers().values(found.into_iter())
}

/// Each ray has as many hits as there are: of a scene, with an instance each.
#[pyfunction]
pub(crate) fn all_hits<'py>(
    of: Of<'py>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let rays = rays(origins, directions, until)?;
    let (py, one) = (origins.py(), rays.one);
    let along_one = Answers { py, one: false };
    if let Of::Scene(scene) = &of {
        type Hits = (Vec<i64>, Vec<RayHit>);
        let of_ray = |state: &State, hits: Vec<SceneRayHit>| {
            hits.into_iter().map(|of| (state.number(of.instance), of.hit)).unzip()
        };
        let found: Vec<Hits> = scene.get().ask(
            py,
            |scene| scene.all_hits(&rays.rows),
            |state, found| found.into_iter().map(|hits| of_ray(state, hits)).collect(),
        )?;
        return Answers { py, one }.lists(&found, |(numbers, hits)| {
            let hits = answers::hits(along_one, hits.iter().copied().map(Some))?;
            (along_one.values(numbers.iter().copied())?, hits).into_bound_py_any(py)
        });
    }
    let question = Question::new(py, of, rays)?;
    let found = question.ask(
        |batch, rays| batch.all_hits(rays),
        |querier, shape, ray| querier.all_hits(shape, ray),
        |_, _| Ok(Vec::new()),
    )?;
    let hits = |hits: &Vec<RayHit>| Ok(answers::hits(along_one, hits.iter().copied().map(Some))?.into_any());
    question.answers().lists(&found, hits)
}

/// Reads pairs of points, such as the ends of segments, of shape (3,) or (N, 3) with the names of their arguments. One point of
/// either kind serves N of the other.
fn pairs(
    (starts, of_starts): (&Bound<'_, PyAny>, &str),
    (ends, of_ends): (&Bound<'_, PyAny>, &str),
) -> PyResult<Rows<[[f64; 3]; 2]>> {
    let ends = read_points(ends, of_ends)?;
    read_points(starts, of_starts)?.with(of_starts, (&ends, of_ends), |&start, &end, _| Ok([start, end]))
}

#[pyfunction]
pub(crate) fn visible<'py>(
    of: Of<'py>,
    points_a: &Bound<'py, PyAny>,
    points_b: &Bound<'py, PyAny>,
    margin: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let pairs = pairs((points_a, "points_a"), (points_b, "points_b"))?;
    let question = Question::new(points_a.py(), of, pairs)?;
    let margin = number(margin, "margin")?;
    let found = question.ask(
        |batch, pairs| batch.visible(pairs, margin),
        |querier, shape, &[a, b]| querier.visible(shape, a, b, margin),
        |scene, pairs| scene.visible(pairs, margin),
    )?;
    question.answers().values(found.into_iter())
}

#[pyfunction]
pub(crate) fn segment_hits<'py>(
    of: Of<'py>,
    starts: &Bound<'py, PyAny>,
    ends: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(starts.py(), of, pairs((starts, "starts"), (ends, "ends"))?)?;
    let found = question.ask(
        |batch, segments| batch.segment_hits(segments),
        |querier, shape, &[start, end]| querier.segment_hit(shape, start, end),
        |scene, segments| scene.segment_hits(segments),
    )?;
    question.answers().values(found.into_iter())
}
