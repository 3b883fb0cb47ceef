//! Questions about all pairs of a scene, in poses and on ways.

use super::ask as ask_scene;
use crate::entry::about;
use crate::input::{self, array, reserve};
use crate::output::One;
use crate::paths::AskedPath;
use crate::status::Failure;
use crate::types::{
    ClashChoices, Instance, MotionChoices, MotionRow, PairRow, PathHandle, PenetrationChoices, SceneClashRow,
    SceneContactRow, SceneDistanceRow, SceneHandle, SceneMeasuredClashRow, SceneNearPairRow,
    SceneRelationRow, SceneSignedDistanceRow,
};
use bvh_query::{InstanceId, MotionOptions, RigidPath, Scene, SceneError};

about! {
    scene: SceneHandle, ask_scene;
    one cbvh_scene_collide() -> answer: bool = scene.collide()?;
    one cbvh_scene_within(d: f64,) -> answer: bool = scene.within(d)?;
    one cbvh_scene_distance() -> answer: SceneDistanceRow = scene.distance()?.into();
    one cbvh_scene_signed_distance(options: *const PenetrationChoices,) -> answer: SceneSignedDistanceRow =
        scene.signed_distance(&input::options("options", options)?.read())?.into();
    list cbvh_scene_pairs_in_contact() -> pairs: PairRow = scene.pairs_in_contact()?;
    list cbvh_scene_pairs_within(d: f64,) -> pairs: PairRow = scene.pairs_within(d)?;
    list cbvh_scene_near_pairs(margin: f64, options: *const PenetrationChoices,) -> pairs: SceneNearPairRow =
        scene.near_pairs(margin, &input::options("options", options)?.read())?;
    list cbvh_scene_relations() -> relations: SceneRelationRow = scene.relations()?;
    list cbvh_scene_contacts() -> contacts: SceneContactRow = scene.contacts()?;
    list cbvh_scene_clashes(options: *const ClashChoices,) -> clashes: SceneClashRow =
        scene.clashes(&input::options("options", options)?.read())?;
    list cbvh_scene_measured_clashes(options: *const ClashChoices,) -> clashes: SceneMeasuredClashRow =
        scene.clashes(&input::options("options", options)?.read().magnitudes(true))?;
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

/// Asks a question about instances and the paths that they follow.
///
/// # Safety
/// As for `array`, `options` and `One::new`.
unsafe fn on_ways<T: Into<R>, R: Copy>(
    (scene, instances, paths, count): (SceneHandle, *const Instance, *const PathHandle, usize),
    choices: *const MotionChoices,
    answer: *mut R,
    ask: impl FnOnce(
        &mut Scene,
        &[(InstanceId, &(dyn RigidPath + Sync))],
        &MotionOptions,
    ) -> Result<T, SceneError>,
) -> i32 {
    ask_scene(scene, |scene| {
        // SAFETY: the caller vouches for it.
        let (instances, paths, options, mut out) = unsafe {
            (
                array("instances", instances, count)?,
                array("paths", paths, count)?,
                input::options("options", choices)?.read(),
                One::new("answer", answer)?,
            )
        };
        each_once(instances)?;
        let asked = AskedPath::many("paths", paths)?;
        let ids = instances.iter().map(|&instance| InstanceId::from(instance));
        let ways: Vec<_> = ids.zip(asked.iter().map(|path| path as &(dyn RigidPath + Sync))).collect();
        let found = ask(scene, &ways, &options);
        asked.iter().try_for_each(AskedPath::failure)?;
        out.set(found?.into());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_motion(
    scene: SceneHandle,
    instances: *const Instance,
    paths: *const PathHandle,
    count: usize,
    options: *const MotionChoices,
    answer: *mut MotionRow,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        on_ways((scene, instances, paths, count), options, answer, |scene, ways, how| scene.motion(ways, how))
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_is_free(
    scene: SceneHandle,
    instances: *const Instance,
    paths: *const PathHandle,
    count: usize,
    options: *const MotionChoices,
    answer: *mut bool,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        on_ways((scene, instances, paths, count), options, answer, |scene, ways, how| {
            scene.is_free(ways, how)
        })
    }
}
