//! One side of a query: one object of a file, or all of its objects.

use crate::file::bvh::Bvh;
use bvh_format::object::Object;

impl Bvh {
    /// Returns the number of the first object with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.objects().iter().position(|object| object.name() == name)
    }

    /// Returns all objects of the file as one shape.
    pub fn all(&self) -> Shape<'_> {
        Shape { bvh: self, first: 0, end: self.objects().len() }
    }

    /// Returns one object of the file as a shape, or `None` if the file has no object of this number.
    pub fn object(&self, number: usize) -> Option<Shape<'_>> {
        (number < self.objects().len()).then_some(Shape { bvh: self, first: number, end: number + 1 })
    }
}

/// One side of a question, borrowed from its file: one object, or all objects as one. A `&Bvh` converts into the shape
/// of all its objects.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    bvh: &'a Bvh,
    first: usize,
    end: usize,
}

impl<'a> Shape<'a> {
    /// Returns the file that the shape is in.
    pub fn bvh(&self) -> &'a Bvh {
        self.bvh
    }

    /// Returns the objects of the shape.
    pub fn objects(&self) -> &'a [Object] {
        &self.bvh.objects()[self.first..self.end]
    }

    /// Returns the number of triangles stored for all objects of the shape.
    pub fn triangles(&self) -> u64 {
        self.objects().iter().map(|object| object.triangles()).sum()
    }

    /// Returns what tells this shape from every other one of this process, those of closed files included.
    pub(crate) fn identity(&self) -> (u64, usize, usize) {
        (self.bvh.identity(), self.first, self.end)
    }

    /// Returns the number that its first object has in the file.
    pub(crate) fn first(&self) -> usize {
        self.first
    }

    /// Returns the object that has this number in the file, if it belongs to the shape.
    pub(crate) fn numbered(&self, number: u32) -> Option<&'a Object> {
        self.objects().get((number as usize).checked_sub(self.first)?)
    }
}

impl<'a> From<&'a Bvh> for Shape<'a> {
    fn from(bvh: &'a Bvh) -> Self {
        bvh.all()
    }
}
