//! Questions about all pairs of a scene, in poses and on ways.

use super::ask as ask_scene;
use crate::entry::write;
use crate::input::{self, array, reserve};
use crate::output::{List, One};
use crate::paths::AskedPath;
use crate::status::Failure;
use crate::types::{
    ClashChoices, Instance, MotionChoices, MotionRow, PairRow, PathHandle, SceneClashRow, SceneContactRow,
    SceneDistanceRow, SceneHandle, SceneRelationRow,
};
use bvh_query::{InstanceId, MotionOptions, RigidPath, Scene, SceneError};

/// Asks a question with one answer.
///
/// # Safety
/// As for `One::new`.
unsafe fn one<T: Into<R>, R: Copy>(
    scene: SceneHandle,
    answer: *mut R,
    ask: impl FnOnce(&mut Scene) -> Result<T, SceneError>,
) -> i32 {
    // SAFETY: the caller vouches for it.
    ask_scene(scene, |scene| unsafe { write("answer", answer, || Ok(ask(scene)?.into())) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_collide(scene: SceneHandle, answer: *mut bool) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, Scene::collide) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_within(scene: SceneHandle, d: f64, answer: *mut bool) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, |scene| scene.within(d)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_distance(scene: SceneHandle, answer: *mut SceneDistanceRow) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { one(scene, answer, Scene::distance) }
}

/// Asks a question with a list of answers.
///
/// # Safety
/// As for `List::new`.
unsafe fn list<T: Into<R>, R: Copy, E: Into<Failure>>(
    scene: SceneHandle,
    (name, rows, capacity, count): (&'static str, *mut R, usize, *mut usize),
    ask: impl FnOnce(&mut Scene) -> Result<Vec<T>, E>,
) -> i32 {
    ask_scene(scene, |scene| {
        // SAFETY: the caller vouches for it.
        let mut list = unsafe { List::new(name, rows, capacity, count) }?;
        list.add(ask(scene).map_err(Into::into)?);
        list.finish()
    })
}

macro_rules! lists {
    ($($name:ident ($($own:tt)*) -> $rows:ident: $row:ty, $ask:expr;)*) => { $(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            scene: SceneHandle,
            $($own)*
            $rows: *mut $row,
            capacity: usize,
            count: *mut usize,
        ) -> i32 {
            // SAFETY: the header asks for it.
            unsafe { list(scene, (stringify!($rows), $rows, capacity, count), $ask) }
        }
    )* };
}
lists! {
    cbvh_scene_pairs_in_contact() -> pairs: PairRow, Scene::pairs_in_contact;
    cbvh_scene_pairs_within(d: f64,) -> pairs: PairRow, |scene| scene.pairs_within(d);
    cbvh_scene_relations() -> relations: SceneRelationRow, Scene::relations;
    cbvh_scene_contacts() -> contacts: SceneContactRow, Scene::contacts;
    cbvh_scene_clashes(options: *const ClashChoices,) -> clashes: SceneClashRow, |scene| -> Result<_, Failure> {
        Ok(scene.clashes(&input::options("options", options)?.read())?)
    };
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
