//! Where the middles of balls are at some moments of a motion, and bounds of their paths in between.

use crate::edge::{Bounds, Edge, Turning, value};
use crate::frame::{Point, each, length};
use crate::model::{Kind, Model};
use crate::screen::Screen;
use crate::setting::Setting;
use crate::states::{LANES, Points, States};

/// The moments between equal steps of a motion, its start and its end.
#[derive(Default)]
pub(crate) struct Moments {
    pub(crate) steps: usize,
    states: States,
    /// The middles of balls at all moments, row by row, and for which motion they were placed.
    points: Vec<Points>,
    placed: Vec<u32>,
    question: u32,
    /// How each group moves, and whether one gets too far or turns too often for the roundings here.
    pub(crate) moves: Vec<Move>,
    pub(crate) is_far: bool,
}

/// Bounds of the middles of a group's balls.
#[derive(Clone, Copy, Default)]
pub(crate) struct Move {
    acceleration: f64,
    pub(crate) rounding: f64,
}

/// The most steps of a motion: as many as a mask has bits.
const MOST_STEPS: usize = 64;
/// A step is short enough if the chord is off by this part of the radius of a small ball.
const OFF: f64 = 0.4;
/// Far more than the roundings of a step of a chain, of its sine and cosine, and of a ball's middle.
const ROUNDING: f64 = 1.0 / (1u64 << 38) as f64;
/// More than the relative error of arithmetic with bounds.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;
/// Motions that reach farther are left to the questions about pairs, which refuse those that reach too far.
const MOST_REACH: f64 = (1u128 << 100) as f64;
/// So do motions of larger angles, in radians.
const MOST_ANGLE: f64 = (1u64 << 30) as f64;

impl Moments {
    /// Goes to the moments between the steps of a motion. Returns the number of steps.
    pub(crate) fn start(
        &mut self,
        screen: &Screen,
        setting: &Setting,
        edge: &Edge,
        bounds: &[[Bounds; 2]],
    ) -> usize {
        let model = &*setting.model;
        let fastest = self.follow(screen, model, bounds);
        let short = OFF * screen.finest;
        let mut steps = (0..=MOST_STEPS.ilog2()).map(|level| 1usize << level);
        let steps =
            steps.find(|steps| fastest / (8.0 * (steps * steps) as f64) <= short).unwrap_or(MOST_STEPS);
        self.steps = steps;
        self.make_room(screen, model, steps + 1);
        let time = |state: usize| state as f64 / steps as f64;
        for (number, of) in edge.coefficients.iter().enumerate() {
            self.states.set(number, |state| value(of, time(state)));
        }
        for joint in &model.joints {
            if let Kind::Floating(first) = joint.kind {
                let turning = Turning::of(edge, first);
                for k in 0..4 {
                    self.states.set(first + 3 + k, |state| turning.at(time(state))[k]);
                }
            }
        }
        self.states.place(model);
        steps
    }

    /// Bounds how the groups move. Returns the largest acceleration.
    fn follow(&mut self, screen: &Screen, model: &Model, bounds: &[[Bounds; 2]]) -> f64 {
        self.moves.clear();
        self.is_far = false;
        let mut fastest = 0.0f64;
        for group in 0..model.groups.len() {
            let mut reach = screen.reach[group];
            let (mut speed, mut of) = (0.0, Move { acceleration: 0.0, rounding: ROUNDING * reach });
            for joint in model.above(group) {
                let [turn, slide] = &bounds[joint];
                of.acceleration += 2.0 * turn.rate * speed
                    + (turn.rate * turn.rate + turn.acceleration) * reach
                    + slide.acceleration;
                speed += turn.rate * reach + slide.rate;
                reach += length(model.joints[joint].origin.translation) + slide.way;
                of.rounding += ROUNDING * (reach * (1.0 + turn.terms) + slide.terms);
                self.is_far |= is_more(turn.terms, MOST_ANGLE);
            }
            of.acceleration *= ROUNDED_UP;
            self.is_far |= is_too_far(reach);
            fastest = fastest.max(of.acceleration);
            self.moves.push(of);
        }
        fastest
    }

    /// Makes room for the balls at some moments.
    fn make_room(&mut self, screen: &Screen, model: &Model, moments: usize) {
        self.states.start(model, moments);
        self.points.resize(screen.balls.len() * self.states.rows, Points::default());
        self.placed.resize(screen.balls.len(), 0);
        self.question = self.question.wrapping_add(1);
        if self.question == 0 {
            self.placed.fill(0);
            self.question = 1;
        }
    }

    /// Places the middle of a ball of a group at all moments.
    #[inline]
    pub(crate) fn place(&mut self, group: usize, ball: usize, middle: Point) {
        if self.placed[ball] != self.question {
            self.placed[ball] = self.question;
            let to = &mut self.points[ball * self.states.rows..][..self.states.rows];
            self.states.points(group, middle, to);
        }
    }

    /// Returns where the middle of a ball is, which has been placed.
    #[inline]
    pub(crate) fn at(&self, ball: usize, moment: usize) -> Point {
        let points = &self.points[ball * self.states.rows + moment / LANES];
        each(|k| points[k][moment % LANES])
    }

    /// Returns how far the path of a middle is at most from the chord of some steps.
    pub(crate) fn off(&self, group: usize, steps: f64) -> f64 {
        let time = steps / self.steps as f64;
        self.moves[group].acceleration * (time * time / 8.0)
    }
}

/// Returns whether something reaches too far from the origin, or nobody knows how far.
pub(crate) fn is_too_far(reach: f64) -> bool {
    is_more(reach, MOST_REACH)
}

/// Returns whether a number is more than another one, or none.
fn is_more(number: f64, than: f64) -> bool {
    number > than || number.is_nan()
}
