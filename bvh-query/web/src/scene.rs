//! Scenes: placed meshes, each with a number that is never given to another.

use crate::answers;
use crate::arguments::{Answer, bytes, integers, pose_or_identity, poses, refused, same_count, wrong};
use crate::mesh::Mesh;
use bvh_query::{Bvh, Groups, InstanceId, InstanceLabel, OwnedShape, Pose, SceneError, ScenePair};
use js_sys::{Array, Float64Array, Uint8Array, Uint32Array};
use std::collections::HashMap;
use wasm_bindgen::prelude::*;

/// Many placed meshes.
#[wasm_bindgen]
pub struct Scene {
    pub(crate) scene: bvh_query::Scene,
    ids: HashMap<u32, InstanceId>,
    numbers: HashMap<InstanceId, u32>,
    next: u32,
}

impl Scene {
    fn of(scene: bvh_query::Scene) -> Self {
        let mut made = Self { scene, ids: HashMap::new(), numbers: HashMap::new(), next: 0 };
        for id in made.scene.instances().collect::<Vec<_>>() {
            made.enter(id);
        }
        made
    }

    fn enter(&mut self, id: InstanceId) -> u32 {
        let number = self.next;
        self.ids.insert(number, id);
        self.numbers.insert(id, number);
        self.next += 1;
        number
    }

    pub(crate) fn id(&self, number: u32, name: &str) -> Answer<InstanceId> {
        let found = format_args!("expected an instance of the scene, found {number}; was it removed?");
        self.ids.get(&number).copied().ok_or_else(|| wrong(name, found))
    }

    /// Returns the number of an instance of the scene.
    pub(crate) fn number(&self, id: InstanceId) -> u32 {
        self.numbers.get(&id).copied().unwrap_or(u32::MAX)
    }

    pub(crate) fn pair(&self, pair: ScenePair) -> [u32; 2] {
        [self.number(pair.a), self.number(pair.b)]
    }

    /// What an error calls an instance: its name or, without one, its number.
    fn called(&self, instance: &InstanceLabel) -> String {
        let number = || self.number(instance.id).to_string();
        instance.name.as_ref().map_or_else(number, |name| format!("{name:?}"))
    }

    /// Returns the `Error` for a refusal of the scene. It names instances as callers know them.
    pub(crate) fn refused(&self, error: impl Into<SceneError>) -> JsError {
        match error.into() {
            SceneError::Pair { a, b, source } => {
                wrong(&format!("instances {} and {}", self.called(&a), self.called(&b)), source)
            }
            SceneError::Instance { instance, source } => {
                wrong(&format!("instance {}", self.called(&instance)), source)
            }
            SceneError::Pose { instance, source } => {
                wrong(&format!("instance {}", self.called(&instance)), source)
            }
            SceneError::Cycle { child, parent } => {
                let found = format!(
                    "expected one that does not move with {}, found {}",
                    self.called(&child),
                    self.called(&parent)
                );
                wrong("parent", found)
            }
            error => refused(error),
        }
    }

    /// Finds instances by their numbers.
    pub(crate) fn ids(&self, numbers: &Uint32Array, name: &str) -> Answer<Vec<InstanceId>> {
        integers(numbers, name)?.into_iter().map(|number| self.id(number, name)).collect()
    }

    /// The pose of an instance, and its mesh.
    pub(crate) fn placed(&self, number: u32, name: &str) -> Answer<(Pose, OwnedShape)> {
        let id = self.id(number, name)?;
        let pose = self.scene.pose(id).map_err(|error| self.refused(error))?;
        let shape = self.scene.shape(id).map_err(|error| self.refused(error))?;
        Ok((*pose, shape.opened().map_err(refused)?))
    }
}

#[wasm_bindgen]
impl Scene {
    #[wasm_bindgen(constructor)]
    pub fn new() -> Answer<Scene> {
        Ok(Self::of(bvh_query::Scene::new().map_err(refused)?))
    }

    /// Makes a scene of the instances in the bytes of a scene file, which are copied.
    pub fn open(file: &Uint8Array) -> Answer<Scene> {
        let bvh = Bvh::from_bytes(bytes(file, "bytes")?).map_err(refused)?;
        bvh_query::Scene::of_file(bvh).map(Self::of).map_err(refused)
    }

    /// Adds a mesh, at the identity if no pose is given, and returns its number.
    pub fn add(
        &mut self,
        mesh: &Mesh,
        pose: Option<Float64Array>,
        name: Option<String>,
        member: u32,
        meets: u32,
    ) -> Answer<u32> {
        let (pose, shape) = (pose_or_identity(pose.as_ref())?, mesh.shape.clone());
        // Answers have numbers in an `Int32Array`.
        if self.next >= 1 << 31 {
            return Err(wrong("scene", "expected at most 2^31 instances in all, found no number left"));
        }
        let added = match name {
            Some(name) => self.scene.add_named(name, shape, pose),
            None => self.scene.add(shape, pose),
        };
        let id = added.map_err(|error| match error {
            // The instance has no number yet.
            SceneError::Pose { source, .. } => wrong("pose", source),
            error => refused(error),
        })?;
        // This does not fail: the instance is there.
        self.scene.set_groups(id, Groups { member, meets }).map_err(refused)?;
        Ok(self.enter(id))
    }

    pub fn remove(&mut self, number: u32) -> Answer<()> {
        let id = self.id(number, "id")?;
        self.scene.remove(id).map_err(|error| self.refused(error))?;
        self.numbers.remove(&id);
        self.ids.remove(&number);
        Ok(())
    }

    /// Replaces the mesh of an instance.
    #[wasm_bindgen(js_name = setMesh)]
    pub fn set_mesh(&mut self, number: u32, mesh: &Mesh) -> Answer<()> {
        let id = self.id(number, "id")?;
        self.scene.set_shape(id, mesh.shape.clone()).map_err(|error| self.refused(error))
    }

    pub fn attach(&mut self, child: u32, parent: u32) -> Answer<()> {
        let (child, parent) = (self.id(child, "child")?, self.id(parent, "parent")?);
        self.scene.attach(child, parent).map_err(|error| self.refused(error))
    }

    pub fn detach(&mut self, child: u32) -> Answer<()> {
        let id = self.id(child, "child")?;
        self.scene.detach(id).map_err(|error| self.refused(error))
    }

    pub fn parent(&self, child: u32) -> Answer<Option<u32>> {
        let found = self.scene.parent(self.id(child, "child")?).map_err(|error| self.refused(error))?;
        Ok(found.map(|(parent, _)| self.number(parent)))
    }

    /// Moves as many instances as there are poses, or none.
    #[wasm_bindgen(js_name = setPoses)]
    pub fn set_poses(&mut self, numbers: &Uint32Array, array: &Float64Array) -> Answer<()> {
        let (ids, poses) = (self.ids(numbers, "ids")?, poses(array, "poses")?);
        same_count("poses", poses.len(), "ids", ids.len())?;
        self.scene.set_poses(ids.into_iter().zip(poses)).map_err(|error| self.refused(error))
    }

    /// The poses of instances.
    pub fn poses(&self, numbers: &Uint32Array) -> Answer<Float64Array> {
        let of = |id| self.scene.pose(id).copied().map_err(|error| self.refused(error));
        let found = self.ids(numbers, "ids")?.into_iter().map(of).collect::<Answer<Vec<Pose>>>()?;
        Ok(answers::poses(&found))
    }

    /// The groups that an instance is in, and those that it meets.
    pub fn groups(&self, number: u32) -> Answer<JsValue> {
        let groups = self.scene.groups(self.id(number, "id")?).map_err(|error| self.refused(error))?;
        Ok(answers::ids([groups.member, groups.meets].into_iter()))
    }

    #[wasm_bindgen(js_name = setGroups)]
    pub fn set_groups(&mut self, number: u32, member: u32, meets: u32) -> Answer<()> {
        let id = self.id(number, "id")?;
        self.scene.set_groups(id, Groups { member, meets }).map_err(|error| self.refused(error))
    }

    #[wasm_bindgen(js_name = setAllowed)]
    pub fn set_allowed(&mut self, a: u32, b: u32, allowed: bool) -> Answer<()> {
        let (first, second) = (self.id(a, "a")?, self.id(b, "b")?);
        self.scene.set_allowed(first, second, allowed).map_err(|error| self.refused(error))
    }

    /// The pairs that may touch, the lower number of each first, in ascending order.
    pub fn allowed(&self) -> JsValue {
        let mut allowed: Vec<[u32; 2]> = self.scene.allowed().map(|pair| self.pair(pair)).collect();
        allowed.iter_mut().for_each(|pair| pair.sort_unstable());
        allowed.sort_unstable();
        answers::ids(allowed.into_iter().flatten())
    }

    #[wasm_bindgen(js_name = setMargin)]
    pub fn set_margin(&mut self, number: u32, margin: f64) -> Answer<()> {
        let id = self.id(number, "id")?;
        self.scene.set_margin(id, margin).map_err(|error| self.refused(error))
    }

    pub fn margin(&self, number: u32) -> Answer<f64> {
        self.scene.margin(self.id(number, "id")?).map_err(|error| self.refused(error))
    }

    #[wasm_bindgen(js_name = setPairMargin)]
    pub fn set_pair_margin(&mut self, a: u32, b: u32, margin: f64) -> Answer<()> {
        let (first, second) = (self.id(a, "a")?, self.id(b, "b")?);
        self.scene.set_pair_margin(first, second, margin).map_err(|error| self.refused(error))
    }

    #[wasm_bindgen(js_name = pairMargin)]
    pub fn pair_margin(&self, a: u32, b: u32) -> Answer<f64> {
        let (first, second) = (self.id(a, "a")?, self.id(b, "b")?);
        self.scene.pair_margin(first, second).map_err(|error| self.refused(error))
    }

    pub fn find(&self, name: &str) -> Option<u32> {
        self.scene.find(name).map(|id| self.number(id))
    }

    pub fn name(&self, number: u32) -> Answer<Option<String>> {
        let found = self.scene.name(self.id(number, "id")?).map_err(|error| self.refused(error))?;
        Ok(found.map(str::to_owned))
    }

    /// A new handle to the mesh of an instance.
    pub fn mesh(&self, number: u32) -> Answer<Mesh> {
        Ok(Mesh { shape: self.placed(number, "id")?.1 })
    }

    /// The numbers of all instances, in their order.
    pub fn instances(&self) -> JsValue {
        answers::ids(self.scene.instances().map(|id| self.number(id)))
    }

    #[wasm_bindgen(js_name = setTracking)]
    pub fn set_tracking(&mut self, tracking: bool) {
        self.scene.set_tracking(tracking);
    }
}

/// Numbers of pairs, and what is found of each.
pub(crate) fn beside(pairs: impl Iterator<Item = [u32; 2]>, found: JsValue) -> Array {
    [answers::ids(pairs.flatten()), found].into_iter().collect()
}
