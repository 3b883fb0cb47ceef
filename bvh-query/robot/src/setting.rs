//! What questions are about: bodies, their shapes where they are, and the pairs that are asked about.

use crate::around::Around;
use crate::balls::Layout;
use crate::cover::{Ball, cover};
use crate::error::RobotError;
use crate::frame::{Frame, Point, departure, length};
use crate::model::Model;
use crate::rod::Rods;
use crate::rod_of::rods_of;
use bvh_query::{OwnedShape, Pose, Querier, QueryError, Shape};
use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

/// A link, an obstacle or an attached object: shapes that do not move against each other.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) name: String,
    pub(crate) is_link: bool,
    /// The link that it is attached to.
    pub(crate) link: Option<usize>,
    /// Where it is: in the frame of that link or, as an obstacle, in the world. A link has the identity.
    pub(crate) pose: Pose,
}

/// A shape of a body.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) body: usize,
    /// The group of links that carries it; 0 of what stands in the world.
    pub(crate) group: usize,
    /// Whether it is an obstacle.
    pub(crate) is_still: bool,
    /// Where it is in the group.
    pub(crate) origin: Frame,
    /// With the margin as a part of its radius.
    pub(crate) shape: OwnedShape,
    /// The shape as it was given.
    pub(crate) bare: OwnedShape,
    pub(crate) margin: f64,
    /// The middle of a ball around it, in its own frame and in the group, and the ball's radius.
    pub(crate) middle: Point,
    pub(crate) centre: Point,
    pub(crate) radius: f64,
    /// The middle of the box around it, in its own frame, and half of the box's sides.
    pub(crate) middle_of_box: Point,
    pub(crate) half: Point,
    /// The sum of both by their absolute coordinates.
    pub(crate) size_of_box: f64,
    /// How far its place in the group is from a rigid one, as a part of lengths; 0 if that is no more than roundings.
    pub(crate) departure: f64,
    /// Of a ball, a capsule or a cylinder.
    pub(crate) rods: Option<Rods>,
    /// Balls that together contain it, in its own frame: computed when they are first needed.
    cover: Arc<OnceLock<Vec<Ball>>>,
    /// The same of what bounds it as an obstacle. Both remain when it moves.
    around: Arc<OnceLock<Around>>,
}

impl Part {
    pub(crate) fn new(
        body: usize,
        (group, is_still): (usize, bool),
        origin: Frame,
        bare: OwnedShape,
        margin: f64,
    ) -> Result<Self, RobotError> {
        let shape = bare.clone().rounded(bare.shape().radius() + margin)?;
        let (middle_of_box, half) = bounds(shape.shape());
        let (middle, radius) = ball(shape.shape());
        let centre = origin.place(middle);
        let size_of_box = middle_of_box.iter().chain(&half).map(|x| x.abs()).sum();
        let rods = rods_of(shape.shape(), &origin);
        Ok(Self {
            body,
            group,
            is_still,
            origin,
            shape,
            bare,
            margin,
            middle,
            centre,
            radius,
            middle_of_box,
            half,
            size_of_box,
            departure: departure_of(&origin),
            rods,
            cover: Arc::default(),
            around: Arc::default(),
        })
    }

    /// Returns balls that together contain the part.
    pub(crate) fn cover(&self, querier: &mut Querier) -> Result<&[Ball], QueryError> {
        if let Some(cover) = self.cover.get() {
            return Ok(cover);
        }
        let cover = cover(&self.shape, querier)?;
        Ok(self.cover.get_or_init(|| cover))
    }

    /// Returns what bounds the part as an obstacle.
    pub(crate) fn around(&self) -> &Around {
        self.around.get_or_init(|| Around::new(self.shape.shape(), &self.middle_of_box, &self.half_of_core()))
    }

    /// Returns half of the sides of the box around its core.
    pub(crate) fn half_of_core(&self) -> Point {
        self.half.map(|half| (half - self.shape.shape().radius()).max(0.0))
    }

    /// Moves it to another place in its group.
    pub(crate) fn place(&mut self, origin: Frame) {
        (self.origin, self.centre) = (origin, origin.place(self.middle));
        self.departure = departure_of(&origin);
        if let Some(rods) = &mut self.rods {
            rods.place(&origin);
        }
    }
}

/// More than how often places that are not quite rigid are used on the way from one shape to another.
pub(crate) const OFF_RIGID: f64 = 8.0;

fn departure_of(origin: &Frame) -> f64 {
    let departure = departure(&origin.rotation);
    if departure < ROUNDED_UP - 1.0 { 0.0 } else { departure }
}

/// Returns the middle of the box around a shape, and half of its sides.
fn bounds(shape: Shape<'_>) -> (Point, Point) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for object in shape.objects() {
        let [low, high] = object.bounding_box();
        for k in 0..3 {
            (lo[k], hi[k]) = (lo[k].min(low[k]), hi[k].max(high[k]));
        }
    }
    let half = [0, 1, 2].map(|k| ((hi[k] - lo[k]) / 2.0 + shape.radius()) * ROUNDED_UP);
    ([0, 1, 2].map(|k| lo[k] + (hi[k] - lo[k]) / 2.0), half)
}

/// Returns a ball around a shape, in the shape's frame.
fn ball(shape: Shape<'_>) -> (Point, f64) {
    let (middle, half) = bounds(shape);
    let corner = length(half.map(|half| half - shape.radius()));
    let tight = match shape.objects() {
        [object] => Some(object.bounding_sphere()).filter(|(_, tight)| *tight < corner),
        _ => None,
    };
    let (middle, radius) = tight.unwrap_or((middle, corner));
    (middle, (radius + shape.radius()) * ROUNDED_UP)
}

/// More than all roundings of a ball's middle and radius.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

/// Two parts that are asked about, A before B.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    pub(crate) a: usize,
    pub(crate) b: usize,
}

impl Pair {
    /// Returns the sum of the radii of the balls around both parts, and how much nearer to each other they may be than their balls tell
    /// where their places are not rigid. The world, where balls are compared, then differs from the frame of one of them, where shapes
    /// are.
    pub(crate) fn reach(&self, parts: &[Part]) -> f64 {
        let [a, b] = [self.a, self.b].map(|part| &parts[part]);
        let off = |part: &Part| part.departure * (length(part.origin.translation) + length(part.middle));
        (a.radius + b.radius) * (ROUNDED_UP + a.departure + b.departure) + off(a) + off(b)
    }
}

// A file of some hundred KiB may have 2^24 of them.
const _: () = assert!(size_of::<Pair>() <= 16);

/// What does not change while questions are asked: all threads share it.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) model: Arc<Model>,
    pub(crate) parts: Vec<Part>,
    pub(crate) pairs: Vec<Pair>,
    pub(crate) layout: Layout,
    pub(crate) bodies: Vec<Option<Body>>,
}

impl Setting {
    /// Lists the pairs that are asked about: those that can move against each other, but for pairs of bodies that may touch. Pairs of
    /// the same bodies follow each other.
    pub(crate) fn list_pairs(&mut self, allowed: &HashSet<[usize; 2]>) {
        let mut pairs = Vec::new();
        let mut rest = self.parts.as_slice();
        let mut first = 0;
        while let Some(body) = rest.first().map(|part| part.body) {
            let (own, others) = rest.split_at(rest.partition_point(|part| part.body == body));
            let mut start = first + own.len();
            for of_other in others.chunk_by(|one, other| one.body == other.body) {
                if !allowed.contains(&[body, of_other[0].body]) {
                    for (a, one) in (first..).zip(own) {
                        for (b, other) in (start..).zip(of_other) {
                            // An obstacle is asked about with all links, also with those that never move.
                            if one.group != other.group || one.is_still != other.is_still {
                                pairs.push(Pair { a, b });
                            }
                        }
                    }
                }
                start += of_other.len();
            }
            (rest, first) = (others, first + own.len());
        }
        self.place_balls();
        let departure = self.parts.iter().fold(0.0, |most: f64, part| most.max(part.departure));
        let parts = |number: usize| [pairs[number].a, pairs[number].b];
        let reach = |number: usize| pairs[number].reach(&self.parts);
        self.layout.list(pairs.len(), parts, reach, 1.0 + OFF_RIGID * 2.0 * departure);
        self.pairs = pairs;
    }

    /// Takes where the balls around the parts are, after any of them has been moved in its group.
    pub(crate) fn place_balls(&mut self) {
        self.layout
            .place(self.parts.iter().map(|part| ((!part.is_still).then_some(part.group), part.centre)));
    }

    /// Returns the bodies of a pair.
    pub(crate) fn bodies_of(&self, pair: &Pair) -> [usize; 2] {
        [pair.a, pair.b].map(|part| self.parts[part].body)
    }

    /// Returns the names of the bodies of two parts.
    pub(crate) fn names(&self, parts: [usize; 2]) -> [String; 2] {
        parts.map(|part| self.name(part).to_owned())
    }

    /// Returns the name of the body of a part.
    pub(crate) fn name(&self, part: usize) -> &str {
        self.bodies[self.parts[part].body].as_ref().map_or("", |body| &body.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Base;
    use crate::testing::robot;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, Querier};
    use cbvh_testkit::Random;

    /// A block whose pose was computed in `f32` may be larger than the block, and a corner out of the ball around it.
    #[test]
    fn balls_hold_what_is_not_placed_rigidly() {
        let text = "<robot name=\"one\"><link name=\"base\"><collision><geometry><sphere radius=\"1e-8\"/></geometry>\
                    </collision></link></robot>";
        let (bytes, _) = to_bytes(&shapes::block([2.0, 3.0, 4.0]).unwrap(), &Options::default()).unwrap();
        let block = OwnedShape::from(Bvh::from_bytes(bytes).unwrap());
        let (random, mut querier, mut outside) = (&mut Random::new(3), Querier::new().unwrap(), 0);
        let mut robot = robot(text, Base::Floating);
        robot.add_obstacle("block", block.clone(), &Pose::IDENTITY).unwrap();
        for _ in 0..40 {
            let exact = Pose::from_quaternion(random.quaternion(), random.point()).unwrap();
            let rotation = exact.rotation().map(|row| row.map(|entry| f64::from(entry as f32)));
            let pose = Pose::new(rotation, exact.translation()).unwrap();
            robot.set_pose("block", &pose).unwrap();
            let corner = pose.place([1.0, 1.5, 2.0]);
            let outward: Point = std::array::from_fn(|k| corner[k] - pose.translation()[k]);
            let at: Point = std::array::from_fn(|k| corner[k] + 0.5e-8 * outward[k] / length(outward));
            outside += u32::from(length(outward) > length([1.0, 1.5, 2.0]) * ROUNDED_UP + 1e-8);
            let joints = [&at[..], &[0.0, 0.0, 0.0, 1.0]].concat();
            assert!(robot.collide(&joints).unwrap());
            let part = &robot.setting.parts[0];
            let relative = Frame { translation: at, ..Frame::IDENTITY }.relative(&(&pose).into());
            assert!(querier.collide(&part.shape, &block, &relative.pose().unwrap()).unwrap());
        }
        assert!(outside > 5, "{outside}");
    }
}
