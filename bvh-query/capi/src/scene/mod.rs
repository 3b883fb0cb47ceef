//! Scenes: many placed meshes.

mod questions;

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::{entry, hand_out, write};
use crate::input::{self, array, flag, optional, text};
use crate::mesh::check_regular;
use crate::output::{self, List, One};
use crate::poses;
use crate::status::{Failure, Status};
use crate::table::{Exclusive, Kind, Table};
use crate::types::{self, Instance, MeshHandle, PoseRows, SceneHandle, StatsRow};
use bvh_query::{Bvh, Groups, InstanceId, Scene};
use std::ffi::c_char;

/// All scenes that are open.
static SCENES: Table<Exclusive<Asked>> = Table::new(Kind::Scene);

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
/// As for `hand_out`.
unsafe fn make(scene: *mut SceneHandle, make: impl FnOnce() -> Result<Scene, Failure>) -> i32 {
    let made = || Ok(Exclusive::new(Asked { scene: make()?, parallel: false }));
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("scene", scene), &SCENES, made) }
}

/// Does something with a scene that nobody uses.
pub(crate) fn with(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<(), Failure>) -> i32 {
    entry(|| change(scene, act))
}

fn change<R>(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<R, Failure>) -> Result<R, Failure> {
    SCENES.hold("scene", scene.id, |asked| {
        asked.scene.set_parallel(asked.parallel && cores::may_use_all());
        act(&mut asked.scene)
    })
}

/// Looks at a scene that nobody changes: many threads may do it at the same time.
fn see(scene: SceneHandle, act: impl FnOnce(&Scene) -> Result<(), Failure>) -> i32 {
    entry(|| SCENES.see("scene", scene.id, |asked| act(&asked.scene)))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_new(backend: i32, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { make(scene, || Ok(Scene::with_backend(types::backend("backend", backend)?))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_open(path: *const c_char, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it, and that nobody changes a mapped file.
    unsafe {
        make(scene, || {
            let file = input::path("path", path)?;
            check_regular(&file)?;
            Scene::of_file(Bvh::map(&file)?)
                .map_err(|error| Failure::from(error).at(file.display().to_string()))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_of_mesh(mesh: MeshHandle, scene: *mut SceneHandle) -> i32 {
    let made = || {
        let bvh = MESHES.share("mesh", mesh.id)?.bvh().clone();
        Scene::of_file(bvh).map_err(|error| Failure::from(error).at("mesh"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(scene, made) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_clone(scene: SceneHandle, other: *mut SceneHandle) -> i32 {
    let copy = || SCENES.see("scene", scene.id, |asked| Ok(Exclusive::new(asked.clone())));
    // SAFETY: the header asks for it.
    unsafe { hand_out(("other", other), &SCENES, copy) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_free(scene: SceneHandle) -> i32 {
    entry(|| SCENES.free_unused("scene", scene.id))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_parallel(scene: SceneHandle, parallel: i32) -> i32 {
    entry(|| {
        SCENES.hold("scene", scene.id, |asked| {
            asked.parallel = flag("parallel", parallel)?;
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_tracking(scene: SceneHandle, tracking: i32) -> i32 {
    with(scene, |scene| {
        scene.set_tracking(flag("tracking", tracking)?);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_budget(scene: SceneHandle, visits: u64) -> i32 {
    with(scene, |scene| {
        scene.set_budget(visits);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_add(
    scene: SceneHandle,
    mesh: MeshHandle,
    world: *const PoseRows,
    name: *const c_char,
    instance: *mut Instance,
) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it. The pose and the name are copied before anything is written.
        let (mut out, world, name) = unsafe {
            let out = optional(instance, |_| One::new("instance", instance))?;
            (out, poses::read("world", world), optional(name, |name| Ok(text("name", name)?.to_owned())))
        };
        out.iter_mut().for_each(|out| out.set(Instance { id: 0 }));
        let id = change(scene, |scene| {
            let shape = MESHES.share("mesh", mesh.id)?;
            let (world, name) = (world?, name?);
            Ok(match name {
                Some(name) => scene.add_named(&name, shape, world)?,
                None => scene.add(shape, world)?,
            })
        })?;
        out.iter_mut().for_each(|out| out.set(id.into()));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_remove(scene: SceneHandle, instance: Instance) -> i32 {
    with(scene, |scene| Ok(scene.remove(instance.into())?))
}

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
            poses::read_many("worlds", worlds, count, &mut to)?;
            instances
        };
        let moves = instances.iter().map(|&instance| InstanceId::from(instance)).zip(to);
        Ok(scene.set_poses(moves)?)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_groups(
    scene: SceneHandle,
    instance: Instance,
    member: u32,
    meets: u32,
) -> i32 {
    with(scene, |scene| Ok(scene.set_groups(instance.into(), Groups { member, meets })?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_allowed(scene: SceneHandle, a: Instance, b: Instance, allowed: i32) -> i32 {
    with(scene, |scene| Ok(scene.set_allowed(a.into(), b.into(), flag("allowed", allowed)?)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_margin(scene: SceneHandle, instance: Instance, margin: f64) -> i32 {
    with(scene, |scene| Ok(scene.set_margin(instance.into(), margin)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_pair_margin(
    scene: SceneHandle,
    a: Instance,
    b: Instance,
    margin: f64,
) -> i32 {
    with(scene, |scene| Ok(scene.set_pair_margin(a.into(), b.into(), margin)?))
}

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
        list.add(scene.instances());
        list.finish()
    })
}

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
        unsafe { output::text(name, buffer, capacity, length) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_pose(
    scene: SceneHandle,
    instance: Instance,
    world: *mut PoseRows,
) -> i32 {
    // SAFETY: the header asks for it.
    see(scene, |scene| unsafe { write("world", world, || Ok(scene.pose(instance.into())?.into())) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_mesh(
    scene: SceneHandle,
    instance: Instance,
    mesh: *mut MeshHandle,
) -> i32 {
    let found = || SCENES.see("scene", scene.id, |asked| Ok(asked.scene.shape(instance.into())?.opened()?));
    // SAFETY: the header asks for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, found) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_instance_margin(
    scene: SceneHandle,
    instance: Instance,
    margin: *mut f64,
) -> i32 {
    // SAFETY: the header asks for it.
    see(scene, |scene| unsafe { write("margin", margin, || Ok(scene.margin(instance.into())?)) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_pair_margin(
    scene: SceneHandle,
    a: Instance,
    b: Instance,
    margin: *mut f64,
) -> i32 {
    // SAFETY: the header asks for it.
    see(scene, |scene| unsafe { write("margin", margin, || Ok(scene.pair_margin(a.into(), b.into())?)) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_stats(scene: SceneHandle, stats: *mut StatsRow) -> i32 {
    // SAFETY: the header asks for it.
    see(scene, |scene| unsafe {
        write("stats", stats, || Ok(StatsRow::new(scene.stats(), scene.pairs_asked())))
    })
}
