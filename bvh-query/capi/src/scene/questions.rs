//! Questions about all pairs of a scene, in poses and on ways.

use super::with;
use crate::input::{array, options, reserve};
use crate::output::{List, One};
use crate::paths::AskedPath;
use crate::status::Failure;
use crate::types::{
    Instance, MotionChoices, MotionRow, PairRow, PathHandle, SceneContactRow, SceneDistanceRow, SceneHandle,
    SceneRelationRow,
};
use bvh_query::{InstanceId, MotionOptions, RigidPath, Scene, SceneError};

/// Asks a question with one answer.
///
/// # Safety
/// As for `One::new`.
unsafe fn one<R: Copy>(
    scene: SceneHandle,
    answer: *mut R,
    ask: impl FnOnce(&mut Scene) -> Result<R, SceneError>,
) -> i32 {
    with(scene, |scene| {
        // SAFETY: the caller vouches for it.
        let mut out = unsafe { One::new("answer", answer) }?;
        out.set(ask(scene)?);
        Ok(())
    })
}

/// Asks a question with a list of answers.
///
/// # Safety
/// As for `List::new`.
unsafe fn list<T: Into<R>, R: Copy>(
    scene: SceneHandle,
    (name, rows, capacity, count): (&'static str, *mut R, usize, *mut usize),
    ask: impl FnOnce(&mut Scene) -> Result<Vec<T>, SceneError>,
) -> i32 {
    with(scene, |scene| {
        // SAFETY: the caller vouches for it.
        let mut list = unsafe { List::new(name, rows, capacity, count) }?;
        ask(scene)?.into_iter().for_each(|found| list.push(found.into()));
        list.finish()
    })
}

/// `cbvh_scene_collide`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_collide(scene: SceneHandle, answer: *mut bool) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, Scene::collide) }
}

/// `cbvh_scene_within`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_within(scene: SceneHandle, d: f64, answer: *mut bool) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, |scene| scene.within(d)) }
}

/// `cbvh_scene_distance`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_distance(scene: SceneHandle, answer: *mut SceneDistanceRow) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, |scene| scene.distance().map(SceneDistanceRow::from)) }
}

/// `cbvh_scene_pairs_in_contact`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_pairs_in_contact(
    scene: SceneHandle,
    pairs: *mut PairRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { list(scene, ("pairs", pairs, capacity, count), Scene::pairs_in_contact) }
}

/// `cbvh_scene_pairs_within`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_pairs_within(
    scene: SceneHandle,
    d: f64,
    pairs: *mut PairRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { list(scene, ("pairs", pairs, capacity, count), |scene| scene.pairs_within(d)) }
}

/// `cbvh_scene_relations`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_relations(
    scene: SceneHandle,
    relations: *mut SceneRelationRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { list(scene, ("relations", relations, capacity, count), Scene::relations) }
}

/// `cbvh_scene_contacts`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_contacts(
    scene: SceneHandle,
    contacts: *mut SceneContactRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { list(scene, ("contacts", contacts, capacity, count), Scene::contacts) }
}

/// Refuses an instance that is named twice: only one of its ways would be looked at.
fn each_once(instances: &[Instance]) -> Result<(), Failure> {
    let mut numbered = Vec::new();
    reserve("instances", instances.len(), &mut numbered)?;
    numbered.extend(instances.iter().zip(0..).map(|(instance, number): (_, usize)| (instance.id, number)));
    numbered.sort_unstable();
    match numbered.windows(2).find(|two| two[0].0 == two[1].0) {
        None => Ok(()),
        Some(two) => Err(Failure::argument(
            format_args!("instances[{}]", two[1].1),
            "each instance once",
            format_args!("that of instances[{}]", two[0].1),
        )),
    }
}

/// Instances, and the paths that they follow.
struct Ways {
    instances: *const Instance,
    paths: *const PathHandle,
    count: usize,
    choices: *const MotionChoices,
}

impl Ways {
    /// Asks a question about the ways.
    ///
    /// # Safety
    /// As for `array`, `options` and `One::new`.
    unsafe fn ask<R: Copy>(
        &self,
        scene: SceneHandle,
        answer: *mut R,
        ask: impl FnOnce(
            &mut Scene,
            &[(InstanceId, &(dyn RigidPath + Sync))],
            &MotionOptions,
        ) -> Result<R, SceneError>,
    ) -> i32 {
        with(scene, |scene| {
            // SAFETY: the caller vouches for it.
            let (instances, paths, options, mut out) = unsafe {
                (
                    array("instances", self.instances, self.count)?,
                    array("paths", self.paths, self.count)?,
                    options("options", self.choices)?.read(),
                    One::new("answer", answer)?,
                )
            };
            each_once(instances)?;
            let asked: Vec<AskedPath> = AskedPath::many("paths", paths)?;
            let path = |path| path as &(dyn RigidPath + Sync);
            let ids = instances.iter().map(|&instance| InstanceId::from(instance));
            let ways: Vec<_> = ids.zip(asked.iter().map(path)).collect();
            let found = ask(scene, &ways, &options);
            asked.iter().try_for_each(AskedPath::failure)?;
            out.set(found.map_err(Failure::from)?);
            Ok(())
        })
    }
}

/// `cbvh_scene_motion`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_motion(
    scene: SceneHandle,
    instances: *const Instance,
    paths: *const PathHandle,
    count: usize,
    choices: *const MotionChoices,
    answer: *mut MotionRow,
) -> i32 {
    let ways = Ways { instances, paths, count, choices };
    // SAFETY: the header asks for it.
    unsafe {
        ways.ask(scene, answer, |scene, ways, options| scene.motion(ways, options).map(MotionRow::from))
    }
}

/// `cbvh_scene_is_free`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_is_free(
    scene: SceneHandle,
    instances: *const Instance,
    paths: *const PathHandle,
    count: usize,
    choices: *const MotionChoices,
    answer: *mut bool,
) -> i32 {
    let ways = Ways { instances, paths, count, choices };
    // SAFETY: the header asks for it.
    unsafe { ways.ask(scene, answer, |scene, ways, options| scene.is_free(ways, options)) }
}
