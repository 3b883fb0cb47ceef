//! Scenes: many placed meshes.
//!
//! A question is about the scene as it is when the question begins (`shared`).

mod questions;

use crate::at_hand::MESHES;
use crate::entry::{about, entry, hand_out, write};
use crate::input::{self, array, flag, optional, text};
use crate::mesh::check_regular;
use crate::output::One;
use crate::poses;
use crate::shared::{Shared, Snapshot};
use crate::status::{Failure, Status};
use crate::stops;
use crate::table::{Kind, Table};
use crate::types::{self, Instance, MeshHandle, PoseRows, SceneHandle, StatsRow, StopHandle};
use bvh_query::{Bvh, Groups, InstanceId, QueryStats, Scene, SceneShape};
use std::ffi::c_char;

/// All scenes that are open, each with how much work the question that ended last took, and how many pairs it was about.
static SCENES: Table<Shared<Scene, (QueryStats, u64)>> = Table::new(Kind::Scene);

impl Snapshot for Scene {
    fn snapshot(&mut self) -> Self {
        Self::snapshot(self)
    }
}

/// Makes a scene and another one of the same backend without instances, and hands the first out.
///
/// # Safety
/// As for `hand_out`.
unsafe fn make(scene: *mut SceneHandle, make: impl FnOnce() -> Result<[Scene; 2], Failure>) -> i32 {
    let made = || make().map(|[scene, empty]| Shared::new(scene, empty));
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("scene", scene), &SCENES, made) }
}

/// Looks at a scene or changes it.
fn with<R>(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<R, Failure>) -> Result<R, Failure> {
    let shared = SCENES.share("scene", scene.id)?;
    let mut held = shared.lock("scene")?;
    act(&mut held.now)
}

/// Looks at a scene or changes it. What `act` returns is dropped without the lock.
fn see<R>(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<R, Failure>) -> i32 {
    entry(|| with(scene, act).map(drop))
}

/// Asks a question about a scene as it is now.
pub(crate) fn ask(scene: SceneHandle, ask: impl FnOnce(&mut Scene) -> Result<(), Failure>) -> i32 {
    entry(|| {
        SCENES.share("scene", scene.id)?.ask("scene", |own, parallel| {
            own.set_parallel(parallel);
            let answer = ask(own);
            (answer, (own.stats(), own.pairs_asked()))
        })?
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_new(backend: i32, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        make(scene, || {
            let empty = Scene::with_backend(types::backend("backend", backend)?);
            Ok([empty.clone(), empty])
        })
    }
}

fn of_file(bvh: Bvh) -> Result<[Scene; 2], Failure> {
    Ok([Scene::of_file(bvh)?, Scene::new()?])
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_open(path: *const c_char, scene: *mut SceneHandle) -> i32 {
    // SAFETY: the header asks for it, and that nobody changes a mapped file.
    unsafe {
        make(scene, || {
            let file = input::path("path", path)?;
            check_regular(&file)?;
            of_file(Bvh::map(&file)?).map_err(|error| error.at(file.display().to_string()))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_of_mesh(mesh: MeshHandle, scene: *mut SceneHandle) -> i32 {
    let made = || {
        let bvh = MESHES.share("mesh", mesh.id)?.bvh().clone();
        of_file(bvh).map_err(|error| error.at("mesh"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(scene, made) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_clone(scene: SceneHandle, other: *mut SceneHandle) -> i32 {
    let copy = || SCENES.share("scene", scene.id)?.copy("scene");
    // SAFETY: the header asks for it.
    unsafe { hand_out(("other", other), &SCENES, copy) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_free(scene: SceneHandle) -> i32 {
    entry(|| SCENES.free("scene", scene.id))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_parallel(scene: SceneHandle, parallel: i32) -> i32 {
    entry(|| SCENES.share("scene", scene.id)?.set_parallel("scene", parallel))
}

about! {
    scene: SceneHandle, see;
    change cbvh_scene_set_tracking(tracking: i32,) = scene.set_tracking(flag("tracking", tracking)?);
    change cbvh_scene_set_budget(visits: u64,) = scene.set_budget(visits);
    change cbvh_scene_set_stop(stop: StopHandle,) = scene.set_stop(stops::of(stop)?);
    change cbvh_scene_remove(instance: Instance,) = {
        let held = held(scene, instance)?;
        scene.remove(instance.into())?;
        held
    };
    change cbvh_scene_attach(child: Instance, parent: Instance,) = scene.attach(child.into(), parent.into())?;
    change cbvh_scene_detach(child: Instance,) = scene.detach(child.into())?;
    change cbvh_scene_set_groups(instance: Instance, member: u32, meets: u32,) =
        scene.set_groups(instance.into(), Groups { member, meets })?;
    change cbvh_scene_set_allowed(a: Instance, b: Instance, allowed: i32,) =
        scene.set_allowed(a.into(), b.into(), flag("allowed", allowed)?)?;
    change cbvh_scene_set_margin(instance: Instance, margin: f64,) = scene.set_margin(instance.into(), margin)?;
    change cbvh_scene_set_pair_margin(a: Instance, b: Instance, margin: f64,) =
        scene.set_pair_margin(a.into(), b.into(), margin)?;
    list cbvh_scene_instances() -> instances: Instance = scene.instances();
    text cbvh_scene_instance_name(instance: Instance,) = scene.name(instance.into())?.unwrap_or_default();
    one cbvh_scene_instance_pose(instance: Instance,) -> world: PoseRows = scene.pose(instance.into())?.into();
    one cbvh_scene_instance_margin(instance: Instance,) -> margin: f64 = scene.margin(instance.into())?;
    one cbvh_scene_pair_margin(a: Instance, b: Instance,) -> margin: f64 = scene.pair_margin(a.into(), b.into())?;
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
        // The scene is checked before the mesh, and the mesh is let go without the lock if it is refused.
        SCENES.share("scene", scene.id)?;
        let shape = MESHES.share("mesh", mesh.id)?;
        let (world, name) = (world?, name?);
        let id = with(scene, |scene| {
            Ok(match name {
                Some(name) => scene.add_named(&name, shape.clone(), world)?,
                None => scene.add(shape.clone(), world)?,
            })
        })?;
        out.iter_mut().for_each(|out| out.set(id.into()));
        Ok(())
    })
}

/// Returns what an instance holds, to be let go without the lock.
fn held(scene: &Scene, instance: Instance) -> Result<SceneShape, Failure> {
    Ok(scene.shape(instance.into())?.clone())
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_mesh(scene: SceneHandle, instance: Instance, mesh: MeshHandle) -> i32 {
    entry(|| {
        SCENES.share("scene", scene.id)?;
        let shape = MESHES.share("mesh", mesh.id)?;
        let held = with(scene, |scene| {
            let held = held(scene, instance)?;
            scene.set_shape(instance.into(), shape.clone())?;
            Ok(held)
        })?;
        drop(held);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_parent(
    scene: SceneHandle,
    child: Instance,
    parent: *mut Instance,
) -> i32 {
    see(scene, |scene| {
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("parent", parent)? };
        let found = scene.parent(child.into())?.ok_or_else(|| {
            let found = format!("child: expected an attached instance, found {}", child.id);
            Failure::new(Status::NotFound, found)
        })?;
        out.set(found.0.into());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_set_poses(
    scene: SceneHandle,
    instances: *const Instance,
    worlds: *const PoseRows,
    count: usize,
) -> i32 {
    see(scene, |scene| {
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
pub unsafe extern "C" fn cbvh_scene_instance_mesh(
    scene: SceneHandle,
    instance: Instance,
    mesh: *mut MeshHandle,
) -> i32 {
    let found = || Ok(with(scene, |scene| held(scene, instance))?.opened()?);
    // SAFETY: the header asks for it.
    unsafe { hand_out(("mesh", mesh), &MESHES, found) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_scene_stats(scene: SceneHandle, stats: *mut StatsRow) -> i32 {
    entry(|| {
        let (of, pairs) = SCENES.share("scene", scene.id)?.lock("scene")?.note;
        // SAFETY: the header asks for it.
        unsafe { write("stats", stats, || Ok(StatsRow::new(of, pairs))) }
    })
}
