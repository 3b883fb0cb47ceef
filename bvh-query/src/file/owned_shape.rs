//! A shape that owns its file, for scenes, threads and others that outlive the code that opened it.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::shape::{Shape, check_radius, rounding};
use bvh_format::rewrite_rounding::with_rounding;
use std::borrow::Cow;

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
    radius: f64,
    is_solid: bool,
}

impl OwnedShape {
    /// Returns one object of a file as a shape, or `None` if the file has no object of this number.
    pub fn object(bvh: Bvh, number: usize) -> Option<Self> {
        bvh.object(number)?;
        Some(Self { object: Some(number), ..Self::from(bvh) })
    }

    /// Returns the shape in the form that questions take.
    pub fn shape(&self) -> Shape<'_> {
        let core = match self.object {
            Some(number) => self.bvh.object(number).expect("the number was checked when the shape was made"),
            None => self.bvh.all(),
        };
        core.of_valid(self.radius, self.is_solid)
    }

    /// Returns the shape with a radius: see [`Shape::rounded`].
    ///
    /// # Errors
    /// The errors of [`Shape::rounded`].
    pub fn rounded(self, radius: f64) -> Result<Self, QueryError> {
        check_radius(radius)?;
        Ok(Self { radius, ..self })
    }

    /// Returns the shape as a solid: see [`Shape::solid`].
    ///
    /// # Errors
    /// The errors of [`Shape::solid`].
    pub fn solid(self) -> Result<Self, QueryError> {
        self.shape().solid()?;
        Ok(Self { is_solid: true, ..self })
    }

    /// Returns the shape, and as a solid if the argument says so, which the file has promised to be closed.
    pub(crate) fn solid_if(self, is_solid: bool) -> Self {
        Self { is_solid: self.is_solid || is_solid, ..self }
    }

    /// Returns the shape with a radius and solidity that were checked.
    pub(crate) fn of_valid(self, radius: f64, is_solid: bool) -> Self {
        Self { radius, is_solid, ..self }
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
        let is_solid = self.is_solid && self.bvh.all().is_closed().is_ok_and(|is_closed| is_closed);
        if rounding(self.bvh.objects()) == (self.radius, is_solid) {
            return Ok(Cow::Borrowed(bytes));
        }
        Ok(Cow::Owned(with_rounding(bytes, self.radius, is_solid)?))
    }

    /// Returns the file that the shape is in.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}

impl From<Bvh> for OwnedShape {
    /// Returns all objects of a file as one shape.
    fn from(bvh: Bvh) -> Self {
        let (radius, is_solid) = rounding(bvh.objects());
        Self { bvh, object: None, radius, is_solid }
    }
}

impl<'a> From<&'a OwnedShape> for Shape<'a> {
    fn from(owned: &'a OwnedShape) -> Self {
        owned.shape()
    }
}
