//! A placed shape, for questions about probes.

use crate::file::bvh::Bvh;
use crate::file::owned_shape::OwnedShape;
use crate::file::shape::Shape;
use crate::numerics::PROBE_ERROR;
use crate::pose::Pose;
use crate::pose::frames::{inverse, turn};
use bvh_format::object::Object;

/// A shape and its pose, for queries about points, rays and segments that are given in the world.
///
/// A `&Bvh` or a [`Shape`] converts into the shape in its own frame. [`Shape::at`] places it by a pose, and probes are
/// then given in the world. The query is then about the stored vertices as [`Pose::place`] places them, as in
/// queries about pairs of meshes.
///
/// ```
/// use bvh_query::{PlacedShape, Pose, Querier, Side};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut querier = Querier::new()?;
/// let placed: PlacedShape<'_> = block.all().at(&Pose::new(*Pose::IDENTITY.rotation(), [10.0, 0.0, 0.0])?);
/// assert_eq!(querier.side(placed, [10.5, 0.0, 0.0])?, Side::Inside); // in the world
/// assert_eq!(querier.side(&block, [0.5, 0.0, 0.0])?, Side::Inside); // in its own frame
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PlacedShape<'a> {
    pub(crate) shape: Shape<'a>,
    /// From the shape to the frame of the probes; none if they have one frame.
    pub(crate) pose: Option<Pose>,
    /// The place of the instance in a scene; 0 without one.
    pub(crate) instance: u32,
}

impl<'a> Shape<'a> {
    /// Returns the shape placed by a pose: see [`PlacedShape`].
    pub fn at(self, pose: &Pose) -> PlacedShape<'a> {
        PlacedShape { shape: self, pose: Some(*pose), instance: 0 }
    }
}

impl<'a> From<Shape<'a>> for PlacedShape<'a> {
    // Where this is inlined, nobody copies the 328 bytes of the result. Other crates inline it only if told to.
    #[inline]
    fn from(shape: Shape<'a>) -> Self {
        Self { shape, pose: None, instance: 0 }
    }
}

impl<'a> From<&'a Bvh> for PlacedShape<'a> {
    #[inline]
    fn from(bvh: &'a Bvh) -> Self {
        bvh.all().into()
    }
}

impl<'a> From<&'a OwnedShape> for PlacedShape<'a> {
    #[inline]
    fn from(shape: &'a OwnedShape) -> Self {
        shape.shape().into()
    }
}

/// The transform from the frame of the probes to that of an object, around its origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntoObject {
    rotation: Option<[[f64; 3]; 3]>,
    /// What is subtracted before the object is turned back, and after.
    translation: [f64; 3],
    origin: [f64; 3],
    /// The object's box around its origin.
    pub(crate) bounds: [[f64; 3]; 2],
    /// The largest side of the box.
    pub(crate) size: f64,
    /// The sum of the magnitudes of all that.
    magnitude: f64,
    /// How far vertices are from their offsets.
    left_out: f64,
}

impl IntoObject {
    // Pages load one copy.
    #[cfg_attr(not(all(target_arch = "wasm32", target_os = "unknown")), inline(always))]
    pub(crate) fn new(pose: Option<&Pose>, object: &Object) -> Self {
        let (record, origin) = (object.record(), object.origin());
        let mut bounds = [[0.0; 3]; 2];
        for axis in 0..3 {
            bounds[0][axis] = f64::from(record.box_lo[axis].get());
            bounds[1][axis] = f64::from(record.box_hi[axis].get());
        }
        let translation = pose.map_or([0.0; 3], |pose| pose.translation());
        let mut sums = [0.0; 3];
        for axis in 0..3 {
            sums[axis] = origin[axis].abs()
                + bounds[0][axis].abs()
                + (bounds[1][axis].abs() + translation[axis].abs());
        }
        let magnitude = sums[0] + sums[1] + sums[2];
        let side = |k: usize| bounds[1][k] - bounds[0][k];
        let size = side(0).max(side(1)).max(side(2));
        let (rotation, left_out) = (pose.map(|pose| inverse(pose.rotation())), object.volumes().left_out);
        Self { rotation, translation, origin, bounds, size, magnitude, left_out }
    }

    /// Returns where a point is.
    #[inline(always)]
    pub(crate) fn point(&self, point: [f64; 3]) -> [f64; 3] {
        let from = [0, 1, 2].map(|k| point[k] - self.translation[k]);
        let turned = self.direction(from);
        [0, 1, 2].map(|k| turned[k] - self.origin[k])
    }

    /// Returns what a direction is.
    #[inline(always)]
    pub(crate) fn direction(&self, direction: [f64; 3]) -> [f64; 3] {
        self.rotation.as_ref().map_or(direction, |rotation| turn(rotation, direction))
    }

    /// Returns the axis of the probes' frame that leads most along one of the object's, and whether it leads up or down where
    /// that does.
    pub(super) fn nearest_axis(&self, axis: usize, ascends: bool) -> (usize, bool) {
        let Some(rotation) = &self.rotation else { return (axis, ascends) };
        let row = &rotation[axis];
        let nearest = (1..3).fold(0, |best, k| if row[k].abs() > row[best].abs() { k } else { best });
        (nearest, ascends == (row[nearest] > 0.0))
    }

    /// Returns a box around the object's origin that contains another shape.
    pub(in crate::query) fn bounds_of(&self, other: &PlacedShape<'_>) -> [[f64; 3]; 2] {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for object in other.shape.objects() {
            let [low, high] = object.bounding_box();
            let middle = [0, 1, 2].map(|k| low[k] + (high[k] - low[k]) / 2.0);
            let half = [0, 1, 2].map(|k| (high[k] - low[k]) / 2.0);
            let placed = other.pose.map_or(middle, |pose| pose.place(middle));
            let centre = self.point(placed);
            // The columns of the rotation from the other shape to the object.
            let axes = [0, 1, 2].map(|k| {
                let mut axis = [0.0; 3];
                axis[k] = 1.0;
                self.direction(other.pose.map_or(axis, |pose| pose.rotation().map(|row| row[k])))
            });
            let size: f64 = half.iter().sum();
            // For roundings: see the numerics in the specification.
            let spare = size / (1 << 16) as f64
                + 16.0 * self.error(placed.iter().map(|v| v.abs()).sum::<f64>() + size);
            for k in 0..3 {
                let reach = (0..3).map(|j| axes[j][k].abs() * half[j]).sum::<f64>() + spare;
                (lo[k], hi[k]) = (lo[k].min(centre[k] - reach), hi[k].max(centre[k] + reach));
            }
        }
        [lo, hi]
    }

    /// Returns a bound on the error of points, and of placed vertices and their offsets seen from the object, for probes whose
    /// coordinates have magnitudes of this sum.
    #[inline(always)]
    pub(crate) fn error(&self, magnitude: f64) -> f64 {
        PROBE_ERROR * (self.magnitude + magnitude) + self.left_out
    }
}
