//! A shape that owns its file, for scenes, threads and others that outlive the code that opened it.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::shape::{Selection, Shape, rounding};
use bvh_format::rewrite_rounding::with_rounding;
use std::borrow::Cow;

/// A [`Shape`] that keeps its file open. Use it for one object that outlives the code that opened its file; for all
/// objects of a file, a [`Bvh`] is enough. Cloning it copies a pointer. A reference to it converts into a shape, so
/// every query takes it.
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
    pub(super) bvh: Bvh,
    pub(super) selection: Selection,
}

impl OwnedShape {
    /// Returns one object of a file as a shape, or `None` if the file has no object of this number.
    pub fn object(bvh: Bvh, number: usize) -> Option<Self> {
        let selection = Selection::one(bvh.objects(), number)?;
        Some(Self { bvh, selection })
    }

    /// Returns the shape in the form that queries take.
    pub fn shape(&self) -> Shape<'_> {
        self.selection.in_file(&self.bvh)
    }

    /// Returns the shape with a radius: see [`Shape::rounded`].
    ///
    /// # Errors
    /// The errors of [`Shape::rounded`].
    pub fn rounded(self, radius: f64) -> Result<Self, QueryError> {
        Ok(Self { selection: self.selection.rounded(radius)?, ..self })
    }

    /// Returns the shape as a solid: see [`Shape::solid`].
    ///
    /// # Errors
    /// The errors of [`Shape::solid`].
    pub fn solid(self) -> Result<Self, QueryError> {
        self.shape().check_closed()?;
        Ok(self.solid_if(true))
    }

    /// Returns the shape, and as a solid if the argument says so, which the file has promised to be closed.
    pub(crate) fn solid_if(self, is_solid: bool) -> Self {
        if is_solid { Self { selection: self.selection.solid(), ..self } } else { self }
    }

    /// Returns the bytes of a file that states the radius and the solidity of this shape: the file that it is in, or a copy of
    /// it that states others for all of its objects. They are solid only if all of them are closed.
    ///
    /// Cost: nothing, or that of copying the file.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a copy is needed and a mapped file is no longer what it was when it was opened.
    pub fn bytes(&self) -> Result<Cow<'_, [u8]>, QueryError> {
        let bytes = self.bvh.bytes();
        let Selection { radius, is_solid, .. } = self.selection;
        let is_solid = is_solid && self.bvh.all().is_closed().is_ok_and(|is_closed| is_closed);
        if rounding(self.bvh.objects()) == (radius, is_solid) {
            return Ok(Cow::Borrowed(bytes));
        }
        Ok(Cow::Owned(with_rounding(bytes, radius, is_solid)?))
    }

    /// Returns the file that the shape is in.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}

impl From<Bvh> for OwnedShape {
    /// Returns all objects of a file as one shape.
    fn from(bvh: Bvh) -> Self {
        Self { selection: Selection::all(bvh.objects()), bvh }
    }
}

impl<'a> From<&'a OwnedShape> for Shape<'a> {
    fn from(owned: &'a OwnedShape) -> Self {
        owned.shape()
    }
}
