//! Scenes: many placed meshes.

mod probes;
mod questions;

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::entry;
use crate::input::{array, flag, optional_text, path, text};
use crate::mesh::{check_regular, hand_out, new_mesh};
use crate::output::{self, List, One};
use crate::poses::{pose, poses};
use crate::status::{Failure, Status};
use crate::table::{Kind, Table};
use crate::types::{Instance, MeshHandle, PoseRows, SceneHandle, StatsRow, backend};
use bvh_query::{Bvh, Groups, InstanceId, Scene};
use std::ffi::c_char;

/// All scenes that are open.
static SCENES: Table<Box<Asked>> = Table::new(Kind::Scene);

/// What the handle of a scene stands for.
#[derive(Clone)]
struct Asked {
    scene: Scene,
    /// Whether questions may use all cores, where they are not asked by a function of the caller.
    parallel: bool,
}

/// Makes a scene, and hands it out.
///
/// # Safety
/// As for `One::new`.
unsafe fn make(name: &str, scene: *mut SceneHandle, make: impl FnOnce() -> Result<Scene, Failure>) -> i32 {
    entry(|| {
        // SAFETY: the caller vouches for it.
        let mut out = unsafe { One::new(name, scene) }?;
        out.set(SceneHandle { id: 0 });
        let asked = Box::new(Asked { scene: make()?, parallel: false });
        out.set(SceneHandle { id: SCENES.insert(asked)? });
        Ok(())
    })
}

/// Does something with a scene that nobody uses.
fn with(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<(), Failure>) -> i32 {
    entry(|| change(scene, act))
}

fn change(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<(), Failure>) -> Result<(), Failure> {
    let mut held = SCENES.hold("scene", scene.id)?;
    let asked = held.value()?;
    asked.scene.set_parallel(asked.parallel && cores::may_use_all());
    act(&mut asked.scene)
}

/// Looks at a scene that nobody changes: many threads may do it at the same time.
fn see(scene: SceneHandle, act: impl FnOnce(&Scene) -> Result<(), Failure>) -> i32 {
    entry(|| act(&SCENES.see("scene", scene.id)?.value()?.scene))
}

/// `cbvh_scene_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_new(backend_number: i32, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { make("scene", scene, || Ok(Scene::with_backend(backend("backend", backend_number)?))) }
}

/// `cbvh_scene_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_open(file: *const c_char, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it.
    let made = || {
        // SAFETY: the header asks for it.
        let file = unsafe { path("path", file) }?;
        check_regular(&file)?;
        // SAFETY: the header asks that nobody changes a mapped file.
        let bvh = unsafe { Bvh::map(&file) }?;
        Scene::of_file(bvh).map_err(|error| Failure::from(error).at(file.display().to_string()))
    };
    // SAFETY: the header asks for it.
    unsafe { make("scene", scene, made) }
}

/// `cbvh_scene_of_mesh`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_of_mesh(mesh: MeshHandle, scene: *mut SceneHandle) -> i32 {
    let made = || {
        let bvh = MESHES.share("mesh", mesh.id)?.bvh().clone();
        Scene::of_file(bvh).map_err(|error| Failure::from(error).at("mesh"))
    };
    // SAFETY: the header asks for it.
    unsafe { make("scene", scene, made) }
}

/// `cbvh_scene_clone`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_clone(scene: SceneHandle, other: *mut SceneHandle) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("other", other) }?;
        out.set(SceneHandle { id: 0 });
        let copy = SCENES.see("scene", scene.id)?.value()?.clone();
        out.set(SceneHandle { id: SCENES.insert(copy)? });
        Ok(())
    })
}

/// `cbvh_scene_free`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_free(scene: SceneHandle) -> i32 {
    entry(|| if scene.id == 0 { Ok(()) } else { SCENES.remove("scene", scene.id).map(drop) })
}

/// `cbvh_scene_set_parallel`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_parallel(scene: SceneHandle, parallel: i32) -> i32 {
    entry(|| {
        SCENES.hold("scene", scene.id)?.value()?.parallel = flag("parallel", parallel)?;
        Ok(())
    })
}

/// `cbvh_scene_set_tracking`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_tracking(scene: SceneHandle, tracking: i32) -> i32 {
    with(scene, |scene| {
        scene.set_tracking(flag("tracking", tracking)?);
        Ok(())
    })
}

/// `cbvh_scene_set_budget`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_budget(scene: SceneHandle, visits: u64) -> i32 {
    with(scene, |scene| {
        scene.set_budget(visits);
        Ok(())
    })
}

/// `cbvh_scene_add`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_add(
    scene: SceneHandle,
    mesh: MeshHandle,
    world: *const PoseRows,
    name: *const c_char,
    instance: *mut Instance,
) -> i32 {
    entry(|| {
        let mut out = if instance.is_null() {
            None
        } else {
            // SAFETY: the header asks for it.
            Some(unsafe { One::new("instance", instance) }?)
        };
        // SAFETY: as above. The pose and the name are copied before anything is written.
        let (world, name) = unsafe { (pose("world", world), optional_text("name", name)) };
        let name = name.map(|name| name.map(str::to_owned));
        out.iter_mut().for_each(|out| out.set(Instance { id: 0 }));
        change(scene, |scene| {
            let shape = MESHES.share("mesh", mesh.id)?;
            let (world, name) = (world?, name?);
            let id = match name {
                Some(name) => scene.add_named(&name, shape, world)?,
                None => scene.add(shape, world)?,
            };
            out.iter_mut().for_each(|out| out.set(id.into()));
            Ok(())
        })
    })
}

/// `cbvh_scene_remove`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_remove(scene: SceneHandle, instance: Instance) -> i32 {
    with(scene, |scene| Ok(scene.remove(instance.into())?))
}

/// `cbvh_scene_set_poses`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_set_poses(
    scene: SceneHandle,
    instances: *const Instance,
    worlds: *const PoseRows,
    count: usize,
) -> i32 {
    with(scene, |scene| {
        let mut to = Vec::new();
        // SAFETY: the header asks for it.
        let instances = unsafe {
            let instances = array("instances", instances, count)?;
            poses("worlds", worlds, count, &mut to)?;
            instances
        };
        let moves = instances.iter().map(|&instance| InstanceId::from(instance)).zip(to);
        Ok(scene.set_poses(moves)?)
    })
}

/// `cbvh_scene_set_groups`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_groups(
    scene: SceneHandle,
    instance: Instance,
    member: u32,
    meets: u32,
) -> i32 {
    with(scene, |scene| Ok(scene.set_groups(instance.into(), Groups { member, meets })?))
}

/// `cbvh_scene_set_allowed`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_allowed(scene: SceneHandle, a: Instance, b: Instance, allowed: i32) -> i32 {
    with(scene, |scene| Ok(scene.set_allowed(a.into(), b.into(), flag("allowed", allowed)?)?))
}

/// `cbvh_scene_find`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_find(
    scene: SceneHandle,
    name: *const c_char,
    instance: *mut Instance,
) -> i32 {
    see(scene, |scene| {
        // SAFETY: the header asks for it.
        let (name, mut out) = unsafe { (text("name", name)?, One::new("instance", instance)?) };
        let id = scene.find(name).ok_or_else(|| {
            Failure::new(Status::NotFound, format!("name: expected the name of an instance, found {name:?}"))
        })?;
        out.set(id.into());
        Ok(())
    })
}

/// `cbvh_scene_instances`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instances(
    scene: SceneHandle,
    instances: *mut Instance,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    see(scene, |scene| {
        // SAFETY: the header asks for it.
        let mut list = unsafe { List::new("instances", instances, capacity, count) }?;
        scene.instances().for_each(|id| list.push(id.into()));
        list.finish()
    })
}

/// `cbvh_scene_instance_name`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_name(
    scene: SceneHandle,
    instance: Instance,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> i32 {
    see(scene, |scene| {
        let name = scene.name(instance.into())?.unwrap_or_default();
        // SAFETY: the header asks for it.
        unsafe { output::text("buffer", name, buffer, capacity, length) }
    })
}

/// `cbvh_scene_instance_pose`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_pose(
    scene: SceneHandle,
    instance: Instance,
    world: *mut PoseRows,
) -> i32 {
    see(scene, |scene| {
        // SAFETY: the header asks for it.
        unsafe { One::new("world", world) }?.set(PoseRows::from(scene.pose(instance.into())?));
        Ok(())
    })
}

/// `cbvh_scene_instance_mesh`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_mesh(
    scene: SceneHandle,
    instance: Instance,
    mesh: *mut MeshHandle,
) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let out = unsafe { new_mesh("mesh", mesh) }?;
        let seen = SCENES.see("scene", scene.id)?;
        hand_out(out, seen.value()?.scene.shape(instance.into())?.opened()?)
    })
}

/// `cbvh_scene_stats`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_stats(scene: SceneHandle, stats: *mut StatsRow) -> i32 {
    see(scene, |scene| {
        // SAFETY: the header asks for it.
        unsafe { One::new("stats", stats) }?.set(StatsRow::new(scene.stats(), scene.pairs_asked()));
        Ok(())
    })
}
