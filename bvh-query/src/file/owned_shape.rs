//! A shape that owns its file, for scenes, threads and others that outlive the code that opened it.

use crate::file::bvh::Bvh;
use crate::file::shape::Shape;

/// A [`Shape`] that keeps its file open. Use it for one object that outlives the code that opened its file; for all
/// objects of a file, a [`Bvh`] is enough. Cloning it copies a pointer. A reference to it converts into a shape, so
/// every question takes it.
///
/// ```
/// use bvh_query::{Bvh, OwnedShape, Pose, Querier};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let bvh = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// let shape = OwnedShape::from(bvh);
/// let other = shape.clone();
/// let mut querier = Querier::new()?;
/// let touching = std::thread::spawn(move || querier.collide(&other, &other, &Pose::IDENTITY));
/// assert!(touching.join().unwrap()?);
/// assert_eq!(shape.shape().triangles(), 1);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct OwnedShape {
    bvh: Bvh,
    /// The number of one object; `None` for all of the file.
    object: Option<usize>,
}

impl OwnedShape {
    /// Returns one object of a file as a shape, or `None` if the file has no object of this number.
    pub fn object(bvh: Bvh, number: usize) -> Option<Self> {
        bvh.object(number)?;
        Some(Self { bvh, object: Some(number) })
    }

    /// Returns the shape in the form that questions take.
    pub fn shape(&self) -> Shape<'_> {
        // The number was checked when the shape was made.
        self.object.and_then(|number| self.bvh.object(number)).unwrap_or_else(|| self.bvh.all())
    }

    /// Returns the file that the shape is in.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}

impl From<Bvh> for OwnedShape {
    /// Returns all objects of a file as one shape.
    fn from(bvh: Bvh) -> Self {
        Self { bvh, object: None }
    }
}

impl<'a> From<&'a OwnedShape> for Shape<'a> {
    fn from(owned: &'a OwnedShape) -> Self {
        owned.shape()
    }
}
