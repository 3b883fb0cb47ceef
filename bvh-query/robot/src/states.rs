//! Where all groups of links are in many states at once: kinematics in lanes.
//!
//! These places only serve filters. They are off by some roundings more than those of [`Model::place`], which filters charge.

use crate::frame::{Frame, each};
use crate::lanes::in_lanes;
use crate::model::{Kind, Model, Value};

/// States are placed so many at a time.
pub(crate) const LANES: usize = 4;

/// A number in each of some states.
pub(crate) type Row = [f64; LANES];

/// A point in each of some states.
pub(crate) type Points = [Row; 3];

/// A frame in each of some states: the rotation by rows, and the translation.
#[derive(Clone, Copy)]
struct Frames {
    rotation: [[Row; 3]; 3],
    translation: Points,
}

/// The frames of groups in some states.
#[derive(Default)]
pub(crate) struct States {
    pub(crate) count: usize,
    /// How many rows hold them.
    pub(crate) rows: usize,
    /// Of each group, row by row.
    frames: Vec<Frames>,
    /// The numbers of the joints, each in all states, row by row.
    numbers: Vec<Row>,
}

impl States {
    /// Starts with some states, of which each number has yet to be set.
    pub(crate) fn start(&mut self, model: &Model, count: usize) {
        self.count = count;
        self.rows = count.div_ceil(LANES);
        self.numbers.resize(model.numbers.len() * self.rows, [0.0; LANES]);
        self.frames.resize(model.groups.len() * self.rows, STILL);
    }

    /// Sets a joint number in all states. Lanes after the last state have its value.
    pub(crate) fn set(&mut self, number: usize, value: impl Fn(usize) -> f64) {
        let last = self.count - 1;
        for (row, to) in self.numbers[number * self.rows..][..self.rows].iter_mut().enumerate() {
            *to = lanes(|lane| value((row * LANES + lane).min(last)));
        }
    }

    /// Places all groups.
    pub(crate) fn place(&mut self, model: &Model) {
        in_lanes(|| self.place_in_lanes(model));
    }

    #[inline(always)]
    fn place_in_lanes(&mut self, model: &Model) {
        let rows = self.rows;
        self.frames[..rows].fill(STILL);
        for joint in &model.joints {
            for row in 0..rows {
                let parent = self.frames[joint.parent * rows + row];
                let value = |by: &Value| {
                    let numbers = &self.numbers[by.number * rows + row];
                    lanes(|lane| by.factor * numbers[lane] + by.offset)
                };
                self.frames[joint.child * rows + row] = match &joint.kind {
                    Kind::Turn { by, turns, .. } => {
                        parent.of(&turned(turns, &value(by)), &each(|k| [joint.origin.translation[k]; LANES]))
                    }
                    Kind::Slide { by, axis } => {
                        let Frame { rotation, translation } = joint.origin;
                        let axis = Frame { rotation, translation: [0.0; 3] }.place(*axis);
                        let way = value(by);
                        let at = each(|k| lanes(|lane| translation[k] + way[lane] * axis[k]));
                        parent.of(&each(|i| each(|j| [rotation[i][j]; LANES])), &at)
                    }
                    Kind::Planar(_) | Kind::Floating(_) => {
                        let numbers = &self.numbers;
                        parent.each(|lane, parent| {
                            let values: Vec<f64> = (0..model.numbers.len())
                                .map(|number| numbers[number * rows + row][lane])
                                .collect();
                            parent.of(&joint.at(&values))
                        })
                    }
                };
            }
        }
    }

    /// Places a point of a group in all states, row by row.
    pub(crate) fn points(&self, group: usize, point: [f64; 3], to: &mut [Points]) {
        in_lanes(|| {
            for (frames, to) in self.frames[group * self.rows..][..self.rows].iter().zip(to) {
                *to = frames.place(&each(|k| [point[k]; LANES]));
            }
        });
    }
}

const STILL: Frames = {
    let (zero, one) = ([0.0; LANES], [1.0; LANES]);
    Frames { rotation: [[one, zero, zero], [zero, one, zero], [zero, zero, one]], translation: [zero; 3] }
};

impl Frames {
    #[inline(always)]
    fn place(&self, point: &Points) -> Points {
        let of = |k: usize| {
            let row = &self.rotation[k];
            lanes(|lane| {
                row[0][lane] * point[0][lane]
                    + row[1][lane] * point[1][lane]
                    + row[2][lane] * point[2][lane]
                    + self.translation[k][lane]
            })
        };
        each(of)
    }

    /// Returns these frames with others in front of them.
    #[inline(always)]
    fn of(&self, rotation: &[[Row; 3]; 3], translation: &Points) -> Self {
        let of = |i: usize, j: usize| {
            let row = &self.rotation[i];
            lanes(|lane| {
                row[0][lane] * rotation[0][j][lane]
                    + row[1][lane] * rotation[1][j][lane]
                    + row[2][lane] * rotation[2][j][lane]
            })
        };
        let rotation = each(|i| each(|j| of(i, j)));
        Self { rotation, translation: self.place(translation) }
    }

    /// Makes others of them, one by one.
    fn each(&self, of: impl Fn(usize, Frame) -> Frame) -> Self {
        let mut made = *self;
        for lane in 0..LANES {
            let rotation = self.rotation.map(|row| row.map(|row| row[lane]));
            let frame = of(lane, Frame { rotation, translation: self.translation.map(|row| row[lane]) });
            for i in 0..3 {
                for j in 0..3 {
                    made.rotation[i][j][lane] = frame.rotation[i][j];
                }
                made.translation[i][lane] = frame.translation[i];
            }
        }
        made
    }
}

/// Returns a number for each lane.
#[inline(always)]
fn lanes(of: impl Fn(usize) -> f64) -> Row {
    let mut row = [0.0; LANES];
    for lane in 0..LANES {
        row[lane] = of(lane);
    }
    row
}

/// Returns the rotations of a joint that turns: see [`Kind::turn`].
#[inline(always)]
fn turned([still, first, second]: &[[[f64; 3]; 3]; 3], angles: &Row) -> [[Row; 3]; 3] {
    let [mut sines, mut cosines] = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        [sines[lane], cosines[lane]] = sine_and_cosine(angles[lane]);
    }
    let of = |i: usize, j: usize| {
        lanes(|lane| still[i][j] + sines[lane] * first[i][j] + (1.0 - cosines[lane]) * second[i][j])
    };
    each(|i| each(|j| of(i, j)))
}

/// Returns the sine and the cosine of an angle of up to 2^30 radians, to within 2^-42 and 2^-52 of the angle, without a branch, so
/// that lanes are computed together. The angle is brought to within an eighth of a turn by multiples of a quarter, which are exact up to a million radians; there, the
/// first terms left out of both series are below 2^-45.
#[inline(always)]
pub(crate) fn sine_and_cosine(angle: f64) -> [f64; 2] {
    /// A number whose last bit is worth 1: what is added to it is rounded to a whole number.
    const WHOLE: f64 = (3u64 << 51) as f64;
    /// A quarter of a turn, with so few bits that its multiples are exact, and the rest.
    const QUARTER: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
    let quarters = angle * std::f64::consts::FRAC_2_PI + WHOLE;
    let number = quarters.to_bits();
    let whole = quarters - WHOLE;
    let rest = (angle - whole * QUARTER[0]) - whole * QUARTER[1];
    let square = rest * rest;
    let sine = rest
        * (1.0
            + square
                * (-1.0 / 6.0
                    + square
                        * (1.0 / 120.0
                            + square
                                * (-1.0 / 5040.0
                                    + square
                                        * (1.0 / 362_880.0
                                            + square
                                                * (-1.0 / 39_916_800.0
                                                    + square * (1.0 / 6_227_020_800.0)))))));
    let cosine = 1.0
        + square
            * (-0.5
                + square
                    * (1.0 / 24.0
                        + square
                            * (-1.0 / 720.0
                                + square
                                    * (1.0 / 40320.0
                                        + square
                                            * (-1.0 / 3_628_800.0
                                                + square
                                                    * (1.0 / 479_001_600.0 - square / 87_178_291_200.0))))));
    let is_odd = number & 1 == 1;
    let [a, b] = if is_odd { [cosine, sine] } else { [sine, cosine] };
    // The sine is negative in the third and fourth quarter, the cosine in the second and third.
    let sign = |bit: u64, value: f64| f64::from_bits(value.to_bits() ^ bit << 63);
    [sign(number >> 1 & 1, a), sign((number >> 1 ^ number) & 1, b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Base;
    use crate::testing::{robot, tree, values};
    use cbvh_testkit::Random;

    #[test]
    fn sines_and_cosines_are_those_of_libm() {
        let random = &mut Random::new(41);
        for round in 0..200_000 {
            let angle = [1.0, 10.0, 1e3, 1e6, 1e9][round % 5] * random.signed();
            let (sine, cosine) = libm::sincos(angle);
            let [s, c] = sine_and_cosine(angle);
            let off = 2f64.powi(-42) + if angle.abs() > 1e6 { 2f64.powi(-52) * angle.abs() } else { 0.0 };
            assert!((s - sine).abs() < off && (c - cosine).abs() < off, "{angle}: {s} {c}");
        }
    }

    #[test]
    fn states_are_those_of_kinematics() {
        let random = &mut Random::new(42);
        for round in 0..60 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let robot = robot(&tree(random, 2 + round % 9), base);
            let model = &robot.setting.model;
            let count = 1 + random.below(20);
            let of: Vec<Vec<f64>> = (0..count).map(|_| values(random, &robot, 3.0)).collect();
            let mut states = States::default();
            states.start(model, count);
            for number in 0..model.numbers.len() {
                states.set(number, |state| of[state][number]);
            }
            states.place(model);
            let mut frames = Vec::new();
            let mut points = vec![[[0.0; LANES]; 3]; states.rows];
            for (state, of) in of.iter().enumerate() {
                model.place(of, &mut frames);
                for (group, frame) in frames.iter().enumerate() {
                    let point = random.point();
                    states.points(group, point, &mut points);
                    let expected = frame.place(point);
                    for k in 0..3 {
                        let found = points[state / LANES][k][state % LANES];
                        assert!((found - expected[k]).abs() < 1e-11, "{found} {}", expected[k]);
                    }
                }
            }
        }
    }
}
