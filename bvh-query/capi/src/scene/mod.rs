//! Scenes: many placed meshes.
//!
//! A question is about the scene as it is when the question begins: it takes a snapshot, and runs without any lock. So threads
//! may ask while others change the scene, and nobody waits for a question. No function of the caller is called with the lock.

mod questions;

use crate::at_hand::MESHES;
use crate::cores;
use crate::entry::{entry, hand_out, write};
use crate::input::{self, array, flag, optional, text};
use crate::mesh::check_regular;
use crate::output::{self, List, One};
use crate::poses;
use crate::status::{Failure, Status};
use crate::table::{Kind, Table};
use crate::types::{self, Instance, MeshHandle, PoseRows, SceneHandle, StatsRow};
use bvh_query::{Bvh, Groups, InstanceId, QueryStats, Scene, SceneShape};
use std::ffi::c_char;
use std::sync::{Arc, Mutex, MutexGuard};

/// All scenes that are open.
static SCENES: Table<Arc<Mutex<Asked>>> = Table::new(Kind::Scene);

/// What the handle of a scene stands for.
struct Asked {
    scene: Scene,
    /// Whether questions may use all cores, where they are not asked by a function of the caller.
    parallel: bool,
    /// How much work the question that ended last took, and how many pairs it was about.
    stats: (QueryStats, u64),
    /// Scenes that ask no question now. They hold what they remember of earlier ones, and no instances.
    idle: Vec<Scene>,
    /// A scene without instances, of the same backend.
    empty: Scene,
}

/// Makes a scene and another one of the same backend without instances, and hands the first out.
///
/// # Safety
/// As for `hand_out`.
unsafe fn make(scene: *mut SceneHandle, make: impl FnOnce() -> Result<[Scene; 2], Failure>) -> i32 {
    let made = || {
        let [scene, empty] = make()?;
        let (parallel, stats, idle) = (false, Default::default(), Vec::new());
        Ok(Arc::new(Mutex::new(Asked { scene, parallel, stats, idle, empty })))
    };
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("scene", scene), &SCENES, made) }
}

/// Locks a scene for a moment.
fn locked(shared: &Mutex<Asked>) -> Result<MutexGuard<'_, Asked>, Failure> {
    let ended = "scene: a defect of cbvh ended its last use; free it, and make another one";
    shared.lock().map_err(|_| Failure::new(Status::Internal, ended.to_owned()))
}

/// Looks at a scene or changes it.
fn with<R>(scene: SceneHandle, act: impl FnOnce(&mut Asked) -> Result<R, Failure>) -> Result<R, Failure> {
    let shared = SCENES.share("scene", scene.id)?;
    let mut asked = locked(&shared)?;
    act(&mut asked)
}

/// Looks at a scene or changes it. What `act` returns is dropped without the lock.
fn see<R>(scene: SceneHandle, act: impl FnOnce(&mut Scene) -> Result<R, Failure>) -> i32 {
    entry(|| with(scene, |asked| act(&mut asked.scene)).map(drop))
}

/// Asks a question about a scene as it is now.
pub(crate) fn ask(scene: SceneHandle, ask: impl FnOnce(&mut Scene) -> Result<(), Failure>) -> i32 {
    entry(|| {
        let shared = SCENES.share("scene", scene.id)?;
        let (mut own, empty) = {
            let asked = &mut *locked(&shared)?;
            let snapshot = asked.scene.snapshot();
            let mut own = asked.idle.pop().unwrap_or_else(|| snapshot.clone());
            own.clone_from(&snapshot);
            own.set_parallel(asked.parallel && cores::may_use_all());
            (own, asked.empty.clone())
        };
        let answer = ask(&mut own);
        let stats = (own.stats(), own.pairs_asked());
        own.clone_from(&empty);
        let mut asked = locked(&shared)?;
        asked.stats = stats;
        asked.idle.push(own);
        answer
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
    let copy = || {
        with(scene, |asked| {
            let (scene, empty) = (asked.scene.clone(), asked.empty.clone());
            let (parallel, stats, idle) = (asked.parallel, asked.stats, Vec::new());
            Ok(Arc::new(Mutex::new(Asked { scene, parallel, stats, idle, empty })))
        })
    };
    // SAFETY: the header asks for it.
    unsafe { hand_out(("other", other), &SCENES, copy) }
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_free(scene: SceneHandle) -> i32 {
    entry(|| SCENES.free("scene", scene.id))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_parallel(scene: SceneHandle, parallel: i32) -> i32 {
    entry(|| {
        with(scene, |asked| {
            asked.parallel = flag("parallel", parallel)?;
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_tracking(scene: SceneHandle, tracking: i32) -> i32 {
    see(scene, |scene| {
        scene.set_tracking(flag("tracking", tracking)?);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_budget(scene: SceneHandle, visits: u64) -> i32 {
    see(scene, |scene| {
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
        // The scene is checked before the mesh, and the mesh is let go without the lock if it is refused.
        SCENES.share("scene", scene.id)?;
        let shape = MESHES.share("mesh", mesh.id)?;
        let (world, name) = (world?, name?);
        let id = with(scene, |asked| {
            Ok(match name {
                Some(name) => asked.scene.add_named(&name, shape.clone(), world)?,
                None => asked.scene.add(shape.clone(), world)?,
            })
        })?;
        out.iter_mut().for_each(|out| out.set(id.into()));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_remove(scene: SceneHandle, instance: Instance) -> i32 {
    see(scene, |scene| {
        let held = held(scene, instance)?;
        scene.remove(instance.into())?;
        Ok(held)
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
        let held = with(scene, |asked| {
            let held = held(&asked.scene, instance)?;
            asked.scene.set_shape(instance.into(), shape.clone())?;
            Ok(held)
        })?;
        drop(held);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_attach(scene: SceneHandle, child: Instance, parent: Instance) -> i32 {
    see(scene, |scene| Ok(scene.attach(child.into(), parent.into())?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_detach(scene: SceneHandle, child: Instance) -> i32 {
    see(scene, |scene| Ok(scene.detach(child.into())?))
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
pub extern "C" fn cbvh_scene_set_groups(
    scene: SceneHandle,
    instance: Instance,
    member: u32,
    meets: u32,
) -> i32 {
    see(scene, |scene| Ok(scene.set_groups(instance.into(), Groups { member, meets })?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_allowed(scene: SceneHandle, a: Instance, b: Instance, allowed: i32) -> i32 {
    see(scene, |scene| Ok(scene.set_allowed(a.into(), b.into(), flag("allowed", allowed)?)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_margin(scene: SceneHandle, instance: Instance, margin: f64) -> i32 {
    see(scene, |scene| Ok(scene.set_margin(instance.into(), margin)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_scene_set_pair_margin(
    scene: SceneHandle,
    a: Instance,
    b: Instance,
    margin: f64,
) -> i32 {
    see(scene, |scene| Ok(scene.set_pair_margin(a.into(), b.into(), margin)?))
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
    let found = || Ok(with(scene, |asked| held(&asked.scene, instance))?.opened()?);
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
    let out = |asked: &mut Asked| unsafe {
        write("stats", stats, || Ok(StatsRow::new(asked.stats.0, asked.stats.1)))
    };
    entry(|| with(scene, out))
}
