//! Meshes in memory and the contract that every input keeps.
//!
//! Lengths are in mesh units, whatever those are. A triangle is three vertex numbers; its id is its place in
//! the input, counted over all objects after polygons are triangulated.

use crate::io::excerpt;
use bvh_format::checksum::Hasher;
use bvh_format::object::MAX_COORDINATE;
use rayon::prelude::*;

/// The most triangles that a mesh may have: ids are 32 bits and the last one is kept free.
pub const MAX_TRIANGLES: u64 = u32::MAX as u64 - 1;
/// The most vertices that a mesh may have: vertex numbers are 32 bits.
pub const MAX_VERTICES: u64 = u32::MAX as u64;

/// What a mesh file holds: one object or several.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// The objects, in the order of the file.
    pub objects: Vec<Object>,
}

/// A named set of triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Object {
    /// Its name, possibly empty.
    pub name: String,
    /// Its vertices, in mesh units. Those that no triangle uses may be anything, NaN included.
    pub positions: Vec<[f64; 3]>,
    /// Its triangles, as places in `positions`. They may be degenerate.
    pub triangles: Vec<[u32; 3]>,
    /// The id of each triangle, ascending; no other triangle of the mesh has the same.
    pub triangle_ids: Vec<u32>,
}

/// How a mesh breaks the contract.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// There is nothing to bake.
    #[error("expected at least one triangle, found none")]
    Empty,
    /// There are more triangles than ids.
    #[error("expected at most {MAX_TRIANGLES} triangles, found {0}")]
    TooManyTriangles(u64),
    /// There are more vertices than vertex numbers.
    #[error("expected at most {MAX_VERTICES} vertices, found {0}")]
    TooManyVertices(u64),
    /// An object's ids don't match its triangles.
    #[error(
        "object \"{object}\": expected an id for each of {triangles} triangles, ascending, found {found}"
    )]
    Ids {
        /// The object's name, shortened.
        object: String,
        /// Its triangles.
        triangles: usize,
        /// What its ids are instead.
        found: String,
    },
    /// A triangle names a vertex that isn't there.
    #[error(
        "object \"{object}\", triangle {triangle}: expected vertex numbers below {vertices}, found {found}"
    )]
    Index {
        /// The object's name, shortened.
        object: String,
        /// The triangle's id.
        triangle: u32,
        /// The number of vertices in the object.
        vertices: usize,
        /// The number found.
        found: u32,
    },
    /// A vertex that a triangle uses has a coordinate outside what the format stores.
    #[error(
        "object \"{object}\", triangle {triangle}, vertex {vertex}: expected finite coordinates of at most \
         2^120 in magnitude, found {found}"
    )]
    Coordinate {
        /// The object's name, shortened.
        object: String,
        /// The triangle's id.
        triangle: u32,
        /// The vertex's place in the object.
        vertex: u32,
        /// The coordinate.
        found: f64,
    },
}

impl InputError {
    /// Whether the mesh is too large, rather than wrong.
    pub fn is_limit(&self) -> bool {
        matches!(self, InputError::TooManyTriangles(_) | InputError::TooManyVertices(_))
    }
}

/// Whether the format can store this coordinate.
pub(crate) fn coordinate_fits(coordinate: f64) -> bool {
    // False for NaN.
    coordinate.abs() <= MAX_COORDINATE
}

impl Mesh {
    /// Makes a mesh of one unnamed object whose triangles are numbered in the order given. -0.0 becomes 0.0.
    ///
    /// Nothing is checked: see [`Mesh::check`]. Ids beyond 32 bits wrap, which `check` refuses.
    pub fn from_triangles(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Mesh {
        let triangle_ids = (0..triangles.len()).into_par_iter().map(|id| id as u32).collect();
        let mut mesh =
            Mesh { objects: vec![Object { name: String::new(), positions, triangles, triangle_ids }] };
        mesh.drop_negative_zeros();
        mesh
    }

    /// The number of triangles of all objects.
    pub fn triangle_count(&self) -> u64 {
        self.objects.iter().map(|object| object.triangles.len() as u64).sum()
    }

    /// The number of vertices of all objects, used or not.
    pub fn vertex_count(&self) -> u64 {
        self.objects.iter().map(|object| object.positions.len() as u64).sum()
    }

    /// Makes every -0.0 a 0.0, so that meshes that compare equal bake to equal bytes.
    pub fn drop_negative_zeros(&mut self) {
        for object in &mut self.objects {
            // -0.0 + 0.0 is 0.0; every other number stays as it is.
            object.positions.par_iter_mut().for_each(|position| *position = position.map(|c| c + 0.0));
        }
    }

    /// A checksum of all that a bake takes from it.
    pub(crate) fn checksum(&self) -> u64 {
        let mut hasher = Hasher::default();
        for object in &self.objects {
            let lengths = [object.name.len(), object.positions.len(), object.triangles.len()];
            lengths.iter().for_each(|&length| hasher.update(&(length as u64).to_le_bytes()));
            hasher.update(object.name.as_bytes());
            object.positions.iter().flatten().for_each(|value| hasher.update(&value.to_le_bytes()));
            object.triangles.iter().flatten().for_each(|index| hasher.update(&index.to_le_bytes()));
        }
        hasher.finish()
    }

    /// Checks the contract: between 1 and 2^32 - 2 triangles, at most 2^32 - 1 vertices, ascending ids,
    /// vertex numbers in range, and every coordinate that a triangle uses finite and of at most 2^120 in
    /// magnitude. That ids differ between objects is not checked.
    ///
    /// Cost: one parallel pass over vertices and triangles.
    ///
    /// # Errors
    /// The first breach, by object and triangle.
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
        self.objects.iter().try_for_each(Object::check)
    }

    /// Joins all objects into one unnamed object (one object alone keeps its name), its triangles in the
    /// order of their ids. Vertices are put one after the other; equal ones are not joined.
    pub fn merged(self) -> Mesh {
        if self.objects.len() <= 1 {
            return self;
        }
        let mut whole = Object::default();
        whole.positions.reserve_exact(self.vertex_count() as usize);
        whole.triangles.reserve_exact(self.triangle_count() as usize);
        whole.triangle_ids.reserve_exact(self.triangle_count() as usize);
        for object in self.objects {
            // A mesh that passed `check` has no vertex beyond 32 bits; in any other the number stays out of
            // range.
            let first = u32::try_from(whole.positions.len()).unwrap_or(u32::MAX);
            let moved = object.triangles.iter().map(|corners| corners.map(|v| v.saturating_add(first)));
            whole.triangles.extend(moved);
            whole.positions.extend(object.positions);
            whole.triangle_ids.extend(object.triangle_ids);
        }
        if whole.triangles.len() == whole.triangle_ids.len() && !whole.triangle_ids.is_sorted() {
            let mut pairs: Vec<_> = whole.triangle_ids.into_iter().zip(whole.triangles).collect();
            pairs.par_sort_by_key(|&(id, _)| id);
            (whole.triangle_ids, whole.triangles) = pairs.into_iter().unzip();
        }
        Mesh { objects: vec![whole] }
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
        if let Some(place) = self.triangle_ids.par_windows(2).position_first(|pair| pair[0] >= pair[1]) {
            return Err(ids(format!("{} before {}", self.triangle_ids[place], self.triangle_ids[place + 1])));
        }
        let vertices = self.positions.len();
        let out_of_range = |corner: u32| corner as usize >= vertices;
        if let Some(place) = self.triangles.par_iter().position_first(|t| t.iter().copied().any(out_of_range))
        {
            let found = self.triangles[place].into_iter().find(|&corner| out_of_range(corner));
            return Err(InputError::Index {
                object: object(),
                triangle: self.triangle_ids[place],
                vertices,
                found: found.unwrap_or_default(),
            });
        }
        // Almost always all coordinates fit, and then the triangles need not be looked up.
        if self.positions.par_iter().all(|position| position.iter().all(|&c| coordinate_fits(c))) {
            return Ok(());
        }
        let misfit = |corner: u32| self.positions[corner as usize].into_iter().find(|&c| !coordinate_fits(c));
        let Some(place) =
            self.triangles.par_iter().position_first(|t| t.iter().any(|&corner| misfit(corner).is_some()))
        else {
            return Ok(());
        };
        let first = self.triangles[place].into_iter().find_map(|corner| Some((corner, misfit(corner)?)));
        let (vertex, found) = first.unwrap_or_default();
        Err(InputError::Coordinate { object: object(), triangle: self.triangle_ids[place], vertex, found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
