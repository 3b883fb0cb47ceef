//! Defines meshes in memory and the contract that every input keeps.
//!
//! Lengths are in mesh units, whatever these are. A triangle consists of three vertex numbers. Its id is its place in
//! the input, counted over all objects after polygons have been triangulated.

pub use crate::error::InputError;
use crate::error::excerpt;
use crate::limits::coordinate_fits;
pub use crate::limits::{MAX_TRIANGLES, MAX_VERTICES};
use crate::threads;
pub use bvh_format::instances::Instance;
use bvh_format::object::MAX_RADIUS;
use std::collections::{HashMap, HashSet};

/// The most instances of a scene: their numbers have 32 bits.
const MAX_INSTANCES: u64 = u32::MAX as u64;

/// The content of a mesh file: one object or several.
///
/// ```
/// use bvh_bake::mesh::Mesh;
///
/// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let square = Mesh::from_triangles(corners, vec![[0, 1, 2], [0, 2, 3]]);
/// square.check()?;
/// assert_eq!((square.triangle_count(), square.vertex_count()), (2, 4));
/// # Ok::<(), bvh_bake::mesh::InputError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// The objects, in the order of the file.
    pub objects: Vec<Object>,
    /// The poses of objects in the world. With instances, each object has its own frame and gets its own tree, and the
    /// file is a scene. Without instances, there is no world.
    pub instances: Vec<Instance>,
    /// What the reader of a file did that the file's author may not expect, such as bytes that it left out: one line each, for
    /// people. A bake puts them into its report.
    pub warnings: Vec<String>,
}

/// A named set of triangles.
///
/// ```
/// use bvh_bake::mesh::{Mesh, Object};
/// use bvh_bake::{Options, to_bytes};
///
/// let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let left = Object { name: "left".into(), positions, triangles: vec![[0, 1, 2]], triangle_ids: vec![0] };
/// let right = Object { name: "right".into(), triangle_ids: vec![1], ..left.clone() };
/// let mesh = Mesh { objects: vec![left, right], ..Mesh::default() };
/// let (_, report) = to_bytes(&mesh, &Options::default().split_objects(true))?;
/// assert_eq!(report.file.objects, 2); // otherwise, both are one
/// # Ok::<(), bvh_bake::BakeError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Object {
    /// The name, which may be empty.
    pub name: String,
    /// The vertices, in mesh units. Vertices that no triangle uses may have any value, including NaN.
    pub positions: Vec<[f64; 3]>,
    /// The triangles, as indices into `positions`. They may be degenerate.
    pub triangles: Vec<[u32; 3]>,
    /// The id of each triangle, in ascending order. No other triangle of the mesh has the same id.
    pub triangle_ids: Vec<u32>,
}

impl Mesh {
    /// Makes a mesh of one unnamed object whose triangles are numbered in the given order. -0.0 becomes 0.0.
    ///
    /// The function checks nothing: see [`Mesh::check`]. Ids beyond 32 bits wrap, which `check` refuses.
    pub fn from_triangles(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Mesh {
        let triangle_ids = (0..triangles.len()).map(|id| id as u32).collect();
        let object = Object { name: String::new(), positions, triangles, triangle_ids };
        let mut mesh = Mesh { objects: vec![object], ..Mesh::default() };
        mesh.drop_negative_zeros();
        mesh
    }

    /// Returns the number of triangles of all objects.
    pub fn triangle_count(&self) -> u64 {
        self.objects.iter().map(|object| object.triangles.len() as u64).sum()
    }

    /// Returns the number of vertices of all objects, whether used or not.
    pub fn vertex_count(&self) -> u64 {
        self.objects.iter().map(|object| object.positions.len() as u64).sum()
    }

    /// Replaces every -0.0 by 0.0, so that meshes that compare equal bake to equal bytes.
    pub fn drop_negative_zeros(&mut self) {
        for object in &mut self.objects {
            // -0.0 + 0.0 is 0.0; every other number stays as it is.
            threads::change(&mut object.positions, |_, position| *position = position.map(|c| c + 0.0));
        }
    }

    /// Checks the contract: between 1 and 2^32 - 2 triangles, at most 2^32 - 1 vertices, ascending ids, vertex numbers
    /// in range, and every coordinate that a triangle uses finite and of at most 2^120 in magnitude. The function does
    /// not check that ids differ between objects.
    ///
    /// Cost: one parallel pass over vertices and triangles.
    ///
    /// # Errors
    /// Returns the first breach, by object and triangle.
    pub fn check(&self) -> Result<(), InputError> {
        match self.triangle_count() {
            0 => return Err(InputError::Empty),
            count if count > MAX_TRIANGLES => return Err(InputError::TooManyTriangles(count)),
            _ => {}
        }
        let vertices = self.vertex_count();
        if vertices > MAX_VERTICES {
            return Err(InputError::TooManyVertices(vertices));
        }
        self.objects.iter().try_for_each(Object::check)?;
        check_instances(&self.instances, self.objects.len())
    }

    /// Gives each object that has no instance one where it stands, with its name.
    pub(crate) fn place_all(&mut self) {
        let mut placed = vec![false; self.objects.len()];
        self.instances.iter().for_each(|instance| placed[instance.object as usize] = true);
        for (number, object) in self.objects.iter().enumerate().filter(|&(number, _)| !placed[number]) {
            let instance = Instance { name: object.name.clone(), ..Instance::of_object(number as u32) };
            self.instances.push(instance);
        }
    }

    /// Leaves out objects without triangles, and their instances.
    pub(crate) fn drop_empty_objects(&mut self) {
        let is_full: Vec<bool> = self.objects.iter().map(|object| !object.triangles.is_empty()).collect();
        renumber(&mut self.instances, &is_full);
        self.objects.retain(|object| !object.triangles.is_empty());
    }

    /// Joins all objects into one unnamed object, with the triangles in the order of their ids. A single object keeps
    /// its name. Instances are left out: the objects are joined in their own coordinates, not at their places in the
    /// world. The vertices of the objects are appended one after the other; equal vertices are not joined.
    pub fn merged(mut self) -> Mesh {
        self.instances.clear();
        if self.objects.len() <= 1 {
            return self;
        }
        let mut whole = Object::default();
        whole.positions.reserve_exact(self.vertex_count() as usize);
        whole.triangles.reserve_exact(self.triangle_count() as usize);
        whole.triangle_ids.reserve_exact(self.triangle_count() as usize);
        for object in self.objects {
            // A mesh that passed `check` has no vertex beyond 32 bits. In any other mesh, the number stays out of
            // range.
            let first = u32::try_from(whole.positions.len()).unwrap_or(u32::MAX);
            let moved = object.triangles.iter().map(|corners| corners.map(|v| v.saturating_add(first)));
            whole.triangles.extend(moved);
            whole.positions.extend(object.positions);
            whole.triangle_ids.extend(object.triangle_ids);
        }
        if whole.triangles.len() == whole.triangle_ids.len() && !whole.triangle_ids.is_sorted() {
            let mut pairs: Vec<_> = whole.triangle_ids.into_iter().zip(whole.triangles).collect();
            pairs.sort_by_key(|&(id, _)| id);
            (whole.triangle_ids, whole.triangles) = pairs.into_iter().unzip();
        }
        Mesh { objects: vec![whole], instances: Vec::new(), warnings: self.warnings }
    }
}

impl Object {
    fn check(&self) -> Result<(), InputError> {
        let object = || excerpt(self.name.as_bytes());
        let ids =
            |found: String| InputError::Ids { object: object(), triangles: self.triangles.len(), found };
        if self.triangle_ids.len() != self.triangles.len() {
            return Err(ids(format!("{} ids", self.triangle_ids.len())));
        }
        let ids_after = self.triangle_ids.get(1..).unwrap_or_default();
        if let Some(place) =
            threads::first(ids_after.len(), |place| self.triangle_ids[place] >= ids_after[place])
        {
            return Err(ids(format!("{} before {}", self.triangle_ids[place], self.triangle_ids[place + 1])));
        }
        let vertices = self.positions.len();
        let out_of_range = |corner: u32| corner as usize >= vertices;
        let triangles = &self.triangles;
        if let Some(place) =
            threads::first(triangles.len(), |place| triangles[place].iter().copied().any(out_of_range))
        {
            let found = self.triangles[place].into_iter().find(|&corner| out_of_range(corner));
            return Err(InputError::Index {
                object: object(),
                triangle: self.triangle_ids[place],
                vertices,
                found: found.unwrap_or_default(),
            });
        }
        // All coordinates almost always fit, and then the triangles need no check.
        let is_misfit = |vertex: usize| !self.positions[vertex].iter().all(|&c| coordinate_fits(c));
        if threads::first(vertices, is_misfit).is_none() {
            return Ok(());
        }
        let misfit = |corner: u32| self.positions[corner as usize].into_iter().find(|&c| !coordinate_fits(c));
        let has_misfit = |place: usize| triangles[place].iter().any(|&corner| misfit(corner).is_some());
        let Some(place) = threads::first(triangles.len(), has_misfit) else {
            return Ok(());
        };
        let first = self.triangles[place].into_iter().find_map(|corner| Some((corner, misfit(corner)?)));
        let (vertex, found) = first.unwrap_or_default();
        Err(InputError::Coordinate { object: object(), triangle: self.triangle_ids[place], vertex, found })
    }
}

/// Leaves out the instances of objects that are not kept, and numbers the objects of the others anew.
pub(crate) fn renumber(instances: &mut Vec<Instance>, is_kept: &[bool]) {
    let mut numbers = Vec::with_capacity(is_kept.len());
    let mut next = 0;
    for &kept in is_kept {
        numbers.push(next);
        next += u32::from(kept);
    }
    instances.retain(|instance| is_kept[instance.object as usize]);
    instances.iter_mut().for_each(|instance| instance.object = numbers[instance.object as usize]);
}

/// Gives instances whose name is taken another one: the name, a point, and the least number from 2 that makes it new.
pub(crate) fn tell_apart(instances: &mut [Instance]) {
    let mut taken: HashSet<String> = instances.iter().map(|instance| instance.name.clone()).collect();
    let mut met: HashMap<String, u32> = HashMap::new();
    for instance in instances.iter_mut().filter(|instance| !instance.name.is_empty()) {
        let times = met.entry(instance.name.clone()).or_insert(0);
        *times += 1;
        while *times > 1 {
            let name = format!("{}.{times}", instance.name);
            if taken.insert(name.clone()) {
                instance.name = name;
                break;
            }
            *times += 1;
        }
    }
}

pub(crate) fn check_instances(instances: &[Instance], objects: usize) -> Result<(), InputError> {
    if instances.len() as u64 > MAX_INSTANCES {
        return Err(InputError::TooManyInstances(instances.len() as u64));
    }
    let mut names = HashSet::new();
    let mut bytes = 0u64;
    for (number, instance) in instances.iter().enumerate() {
        let wrong = |expected: &str, found: String| InputError::Instance {
            number,
            name: excerpt(instance.name.as_bytes()),
            expected: expected.to_owned(),
            found,
        };
        bytes += instance.name.len() as u64;
        if bytes > u64::from(u32::MAX) {
            return Err(wrong("names of fewer than 2^32 bytes together", bytes.to_string()));
        }
        if instance.object as usize >= objects {
            return Err(wrong(&format!("an object below {objects}"), instance.object.to_string()));
        }
        if !(0.0..=MAX_RADIUS).contains(&instance.margin) {
            return Err(wrong("a margin from 0 to 2^118", format!("{:e}", instance.margin)));
        }
        if let Some((expected, found)) = instance.pose_fault() {
            return Err(wrong(expected, format!("{found:e}")));
        }
        if !instance.name.is_empty() && !names.insert(&instance.name) {
            return Err(wrong("a name of its own", "a second instance of this name".to_owned()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_are_checked() {
        let mut mesh = one();
        mesh.instances = vec![Instance::of_object(0); 3];
        assert_eq!(mesh.check(), Ok(()));
        let refused = |edit: fn(&mut Vec<Instance>)| {
            let mut mesh = mesh.clone();
            edit(&mut mesh.instances);
            mesh.check().unwrap_err().to_string()
        };
        assert_eq!(refused(|all| all[2].object = 1), "instance 2 \"\": expected an object below 1, found 1");
        let said = refused(|all| all[1].rotation[0][0] = 2.0);
        assert_eq!(said, "instance 1 \"\": expected a rotation within 2^-23 of orthonormal, found 3e0");
        let said = refused(|all| all.iter_mut().for_each(|instance| instance.name = "arm".into()));
        assert_eq!(
            said,
            "instance 1 \"arm\": expected a name of its own, found a second instance of this name"
        );
    }

    #[test]
    fn instances_of_one_name_are_told_apart() {
        let named = |name: &str| Instance { name: name.to_owned(), ..Instance::of_object(0) };
        let mut all = ["arm", "", "arm", "arm.2", "", "arm", "arm.2"].map(named);
        tell_apart(&mut all);
        assert_eq!(all.map(|instance| instance.name), ["arm", "", "arm.3", "arm.2", "", "arm.4", "arm.2.2"]);
    }

    #[test]
    fn instances_follow_their_objects() {
        let mut mesh = one();
        mesh.objects.insert(0, Object::default());
        mesh.instances = [1, 0, 1].map(Instance::of_object).to_vec();
        mesh.drop_empty_objects();
        assert_eq!(mesh.instances, [0, 0].map(Instance::of_object));
        mesh.objects.push(Object { name: "last".into(), ..mesh.objects[0].clone() });
        mesh.place_all();
        assert_eq!(mesh.instances.len(), 3);
        assert_eq!((mesh.instances[2].object, mesh.instances[2].name.as_str()), (1, "last"));
    }

    fn one() -> Mesh {
        Mesh::from_triangles(vec![[0.0; 3], [1.0, -0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]])
    }

    #[test]
    fn negative_zero_is_zero() {
        assert_eq!(one().objects[0].positions[1][1].to_bits(), 0);
    }

    #[test]
    fn the_contract_is_checked() {
        assert_eq!(one().check(), Ok(()));
        assert_eq!(Mesh::default().check(), Err(InputError::Empty));
        let mut mesh = one();
        mesh.objects[0].positions.push([f64::NAN; 3]);
        assert_eq!(mesh.check(), Ok(()), "no triangle uses the NaN");
        mesh.objects[0].triangles[0][1] = 3;
        let said = mesh.check().unwrap_err().to_string();
        assert!(said.contains("triangle 0, vertex 3") && said.ends_with("found NaN"), "{said}");
        mesh.objects[0].triangles[0][1] = 4;
        assert!(matches!(mesh.check(), Err(InputError::Index { found: 4, .. })));
        mesh.objects[0].triangle_ids.clear();
        assert!(matches!(mesh.check(), Err(InputError::Ids { .. })));
    }

    #[test]
    fn the_largest_coordinate_is_two_to_the_120() {
        let mut mesh = one();
        mesh.objects[0].positions[0][0] = -(2f64.powi(120));
        assert_eq!(mesh.check(), Ok(()));
        mesh.objects[0].positions[0][0] = mesh.objects[0].positions[0][0].next_down();
        assert!(matches!(mesh.check(), Err(InputError::Coordinate { vertex: 0, .. })));
    }

    #[test]
    fn merging_keeps_ids_and_sorts_by_them() {
        let (mut a, b) = (one(), one());
        a.objects.extend(b.objects);
        a.objects[0].triangle_ids = vec![7];
        let merged = a.merged();
        assert_eq!(merged.objects.len(), 1);
        assert_eq!(merged.objects[0].triangle_ids, [0, 7]);
        assert_eq!(merged.objects[0].triangles, [[3, 4, 5], [0, 1, 2]]);
        assert_eq!(merged.check(), Ok(()));
    }
}
