//! What may come near: balls around parts, against each other and against what stands still, in many states or on a whole motion.
//!
//! Everything that the screen leaves out is certainly farther apart than a limit. What it keeps may be: questions about shapes
//! decide. So the screen never affects an answer.
//!
//! On a motion, the middle of each ball follows a path, which is cut into steps of equal time. With a bound A of its acceleration, it
//! leaves the chord of a step of length h by at most A h^2 / 8, and the middle of a step by at most the longer way to both of its ends
//! and the same of its halves. Balls of both sides and steps are halved where that is worth most.

use crate::clearances::Clearances;
use crate::cover::Ball;
use crate::frame::length;
use crate::setting::{OFF_RIGID, Part, Setting};
use bvh_query::{MotionOptions, Querier, QueryError};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Arc, OnceLock};

/// What is computed of a setting when it is first needed, and shared by all who ask about it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Screens {
    screen: OnceLock<Arc<Screen>>,
    fields: OnceLock<Arc<Vec<Clearances>>>,
}

impl Screens {
    /// Forgets where obstacles stand.
    pub(crate) fn forget_places(&mut self) {
        self.fields = OnceLock::new();
    }

    /// Returns the screen of the pairs, and the clearances of what stands still.
    pub(crate) fn of(
        &self,
        setting: &Setting,
        querier: &mut Querier,
    ) -> Result<(&Screen, &[Clearances]), QueryError> {
        let screen = match self.screen.get() {
            Some(screen) => screen,
            None => {
                let screen = Arc::new(Screen::new(setting, querier)?);
                self.screen.get_or_init(|| screen)
            }
        };
        Ok((screen, self.fields.get_or_init(|| Arc::new(screen.fields(setting)))))
    }
}

/// What is computed once of a setting: the balls of its parts, and which pairs are asked about how. It does not depend on where
/// obstacles stand.
#[derive(Debug, Default)]
pub(crate) struct Screen {
    pub(crate) parts: Vec<Screened>,
    /// Of all parts, in the frames of their groups.
    pub(crate) balls: Vec<Ball>,
    /// Balls of about this radius are not divided.
    pub(crate) finest: f64,
    /// The parts that stand still which some part is asked about, for each field of clearances.
    fields: Vec<Vec<usize>>,
    /// Pairs of parts that both move.
    pub(crate) mutual: Vec<usize>,
    /// How far the balls of each group reach from its origin.
    pub(crate) reach: Vec<f64>,
}

/// A part with its balls.
#[derive(Debug, Default)]
pub(crate) struct Screened {
    pub(crate) group: usize,
    /// The ball around all of it.
    pub(crate) root: usize,
    /// The field of what it may meet of what stands still, and the pairs, in the order of the field's parts. None if there are too many
    /// fields.
    pub(crate) field: Option<usize>,
    pub(crate) pairs: Vec<usize>,
    /// The largest default tolerance of a pair with it.
    pub(crate) tolerance: f64,
    /// See [`Part::departure`].
    pub(crate) departure: f64,
}

/// The most fields of clearances. Links that differ in what they may touch have fields of their own.
const MOST_FIELDS: usize = 4;

impl Screen {
    pub(crate) fn new(setting: &Setting, querier: &mut Querier) -> Result<Self, QueryError> {
        let mut screen = Self { reach: vec![0.0; setting.model.groups.len()], ..Self::default() };
        let mut largest = 0.0f64;
        for part in setting.parts.iter().filter(|part| part.group != 0) {
            largest = largest.max(part.cover(querier)?[0].radius);
        }
        let finest = FINEST * largest;
        screen.finest = if finest > 0.0 { finest } else { 1.0 };
        for part in &setting.parts {
            let root = screen.balls.len();
            let &Part { group, departure, .. } = part;
            screen.parts.push(Screened { group, root, departure, ..Screened::default() });
            if !part.is_still {
                let cover = part.cover(querier)?;
                screen.take(part, cover, finest);
            }
        }
        screen.list(setting);
        Ok(screen)
    }

    /// Takes the balls of a part, but for those that are too small.
    fn take(&mut self, part: &Part, cover: &[Ball], finest: f64) {
        let first = self.balls.len();
        self.balls.push(cover[0]);
        let mut next = first;
        while let Some(&ball) = self.balls.get(next) {
            let centre = part.origin.place(ball.centre);
            // Where the place of a part is not quite rigid, lengths depend on the frame in which they are computed.
            let size = length(part.origin.translation) + length(ball.centre) + ball.radius;
            let radius = ball.radius + OFF_RIGID * part.departure * size;
            let reach = &mut self.reach[part.group];
            *reach = reach.max(length(centre));
            let from = ball.children as usize;
            let children = if from == 0 || ball.radius <= finest { 0 } else { self.balls.len() as u32 };
            if children != 0 {
                self.balls.extend_from_slice(&cover[from..from + 2]);
            }
            self.balls[next] = Ball { centre, radius, children };
            next += 1;
        }
    }

    /// Lists the pairs of each part with what stands still, and those of parts that both move.
    fn list(&mut self, setting: &Setting) {
        let options = MotionOptions::default();
        let mut still = vec![Vec::new(); setting.parts.len()];
        for (number, pair) in setting.pairs.iter().enumerate() {
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
            let tolerance = options.tolerance_between(&a.shape, &b.shape);
            for part in [pair.a, pair.b] {
                let screened = &mut self.parts[part];
                screened.tolerance = screened.tolerance.max(tolerance);
            }
            let mover = match [a.group == 0, b.group == 0] {
                [false, false] => {
                    self.mutual.push(number);
                    continue;
                }
                [true, false] => pair.b,
                [false, true] => pair.a,
                // An obstacle, and a link that never moves.
                [true, true] if a.is_still => pair.b,
                [true, true] => pair.a,
            };
            self.parts[mover].pairs.push(number);
            still[mover].push(pair.a + pair.b - mover);
        }
        let mut fields: HashMap<Vec<usize>, usize> = HashMap::new();
        for (part, still) in still.into_iter().enumerate().filter(|(_, still)| !still.is_empty()) {
            let next = fields.len();
            let field = match fields.entry(still) {
                Entry::Occupied(field) => Some(*field.get()),
                Entry::Vacant(place) if next < MOST_FIELDS => Some(*place.insert(next)),
                Entry::Vacant(_) => None,
            };
            self.parts[part].field = field;
        }
        let mut of: Vec<_> = fields.into_iter().collect();
        of.sort_unstable_by_key(|(_, field)| *field);
        self.fields = of.into_iter().map(|(still, _)| still).collect();
    }

    /// Returns the fields of clearances, which hold nothing yet.
    pub(crate) fn fields(&self, setting: &Setting) -> Vec<Clearances> {
        self.fields.iter().map(|still| Clearances::new(setting, still, CELL * self.finest)).collect()
    }
}

/// Balls that are this part of the largest one around a part are not divided.
const FINEST: f64 = 0.12;
/// The side of a small cell, as a part of the radius of a small ball.
const CELL: f64 = 0.6;
