//! One side of a query: one object of a file, or all of its objects.

use crate::error::{NumberError, QueryError};
use crate::file::bvh::Bvh;
use bvh_format::object::{MAX_RADIUS, Object};
use std::ops::Range;

impl Bvh {
    /// Returns the number of the first object with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.objects().iter().position(|object| object.name() == name)
    }

    /// Returns all objects of the file as one shape, with the radius that the file states, and solid if it says so.
    pub fn all(&self) -> Shape<'_> {
        Selection::all(self.objects()).in_file(self)
    }

    /// Returns one object of the file as a shape, with the radius that the file states, and solid if it says so. Returns
    /// `None` if the file has no object of this number.
    pub fn object(&self, number: usize) -> Option<Shape<'_>> {
        Selection::one(self.objects(), number).map(|selection| selection.in_file(self))
    }
}

/// One side of a query, borrowed from its file: one object, or all objects as one. A `&Bvh` converts into the shape
/// of all its objects.
///
/// ```
/// use bvh_query::{Pose, Querier, Shape};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// # let small = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([1.0; 3])?, &Default::default())?.0)?;
/// let mut querier = Querier::new()?;
/// let shape: Shape<'_> = block.all(); // or one object: block.object(0)
/// assert!(!querier.collide(shape, &small, &Pose::IDENTITY)?); // inside, and no surfaces meet
/// assert!(querier.collide(shape.solid()?, &small, &Pose::IDENTITY)?);
/// assert_eq!(querier.distance(shape.rounded(0.25)?, &small, &Pose::IDENTITY)?.distance, 0.25);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Rounded shapes
/// A shape is a core and a radius: all points at most that far from the triangles of the core. Any mesh may be the core. A
/// triangle whose corners are equal is a point and makes a ball; a triangle whose corners lie on a line is a segment and makes
/// a capsule. Two shapes touch if their cores are no farther apart than the sum of their radii, and their distance is that of
/// the cores less the sum, at least 0. Each addition is rounded to nearest, and the comparison with the sum is exact.
///
/// # Solid shapes
/// Queries are about surfaces. For a solid shape, what is inside counts as well: a shape of which any part is inside a solid
/// one touches it, and their distance is 0. [`Querier::relation`](crate::Querier::relation) and
/// [`Querier::side`](crate::Querier::side) know insides anyway.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    bvh: &'a Bvh,
    selection: Selection,
}

/// What a shape is, apart from its file: some objects, which all have the same radius, and are all solid or none of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Selection {
    first: usize,
    end: usize,
    pub(super) radius: f64,
    pub(super) is_solid: bool,
}

impl Selection {
    /// Selects all objects of a file, with what it states for them.
    pub(super) fn all(objects: &[Object]) -> Self {
        let (radius, is_solid) = rounding(objects);
        Self { first: 0, end: objects.len(), radius, is_solid }
    }

    /// Selects one object of a file, or returns `None` if the file has no object of this number.
    pub(super) fn one(objects: &[Object], number: usize) -> Option<Self> {
        (number < objects.len()).then(|| Self { first: number, end: number + 1, ..Self::all(objects) })
    }

    /// Returns those of the objects of the file that are selected.
    pub(super) fn of<'a>(&self, objects: &'a [Object]) -> &'a [Object] {
        &objects[self.first..self.end]
    }

    pub(super) fn rounded(self, radius: f64) -> Result<Self, QueryError> {
        check_radius(radius)?;
        Ok(Self { radius, ..self })
    }

    /// Returns the shape as a solid, which was checked.
    pub(super) fn solid(self) -> Self {
        Self { is_solid: true, ..self }
    }

    pub(super) fn in_file(self, bvh: &Bvh) -> Shape<'_> {
        Shape { bvh, selection: self }
    }
}

impl<'a> Shape<'a> {
    /// Returns the file that the shape is in.
    pub fn bvh(&self) -> &'a Bvh {
        self.bvh
    }

    /// Returns the objects of the shape.
    pub fn objects(&self) -> &'a [Object] {
        self.selection.of(self.bvh.objects())
    }

    /// Returns the numbers that these objects have in the file.
    pub fn object_numbers(&self) -> Range<usize> {
        self.selection.first..self.selection.end
    }

    /// Returns the number of triangles stored for all objects of the shape.
    pub fn triangles(&self) -> u64 {
        self.objects().iter().map(|object| object.triangles()).sum()
    }

    /// Returns the shape with a radius in mesh units, which replaces the one it has. The cores stay as they are.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the radius is negative, NaN or above 2^118.
    pub fn rounded(self, radius: f64) -> Result<Self, QueryError> {
        Ok(Self { selection: self.selection.rounded(radius)?, ..self })
    }

    /// Returns the shape as a solid: what is inside it touches it.
    ///
    /// # Errors
    /// [`QueryError::NotClosed`] if an object of the shape is not closed and consistently oriented, so that it has no inside, with its
    /// open edges ([`Bvh::open_edges`]), which takes some tenths of a second at most;
    /// [`QueryError::NoTopology`] if the file was baked without topology; [`QueryError::Damaged`] if that is damaged.
    pub fn solid(self) -> Result<Self, QueryError> {
        self.check_closed()?;
        Ok(Self { selection: self.selection.solid(), ..self })
    }

    /// Returns whether all objects of the shape are closed. This never counts open edges, as the error of [`Shape::solid`] does.
    ///
    /// Cost: that of [`Bvh::is_closed`] for each object.
    ///
    /// # Errors
    /// The errors of [`Bvh::is_closed`].
    pub fn is_closed(self) -> Result<bool, QueryError> {
        Ok(self.first_open()?.is_none())
    }

    /// Refuses a shape without an inside.
    pub(crate) fn check_closed(self) -> Result<(), QueryError> {
        self.first_open()?.map_or(Ok(()), |object| Err(self.bvh.not_closed(object)))
    }

    /// Returns the number of the first object that is not closed.
    fn first_open(self) -> Result<Option<usize>, QueryError> {
        for number in self.object_numbers() {
            if !self.bvh.topology(number)?.closed {
                return Ok(Some(number));
            }
        }
        Ok(None)
    }

    /// Returns how far a vertex may be from the one that was given to the baker, in mesh units. Answers are about the mesh as it
    /// is stored. It is the mesh that was given, and this is 0, unless vertices were quantised, rounded or welded on purpose, or
    /// lay below 2^-180.
    pub fn max_move(&self) -> f64 {
        self.objects().iter().map(Object::max_move).fold(0.0, f64::max)
    }

    /// Returns the radius, in mesh units.
    pub fn radius(&self) -> f64 {
        self.selection.radius
    }

    /// Returns whether what is inside the shape touches it.
    pub fn is_solid(&self) -> bool {
        self.selection.is_solid
    }

    /// Returns the shape with a larger radius: the sum of the present one and a margin that was checked, rounded to nearest.
    pub(crate) fn with_margin(self, margin: f64) -> Self {
        let selection = Selection { radius: self.radius() + margin, ..self.selection };
        Self { selection, ..self }
    }

    /// Returns what tells this shape from every other one of this process, those of closed files included.
    pub(crate) fn identity(&self) -> (u64, usize, usize) {
        (self.bvh.identity(), self.selection.first, self.selection.end)
    }

    /// Returns the number that its first object has in the file.
    pub(crate) fn first(&self) -> usize {
        self.selection.first
    }

    /// Returns the object that has this number in the file, if it belongs to the shape.
    pub(crate) fn numbered(&self, number: u32) -> Option<&'a Object> {
        self.objects().get((number as usize).checked_sub(self.first())?)
    }
}

/// Returns the radius of the objects of a file, and whether they are solid: the same for all.
pub(super) fn rounding(objects: &[Object]) -> (f64, bool) {
    objects.first().map_or((0.0, false), |object| (object.radius(), object.is_solid()))
}

/// Refuses an invalid radius.
pub(crate) fn check_radius(radius: f64) -> Result<(), QueryError> {
    if (0.0..=MAX_RADIUS).contains(&radius) { Ok(()) } else { Err(NumberError::Radius(radius).into()) }
}

impl<'a> From<&'a Bvh> for Shape<'a> {
    fn from(bvh: &'a Bvh) -> Self {
        bvh.all()
    }
}
