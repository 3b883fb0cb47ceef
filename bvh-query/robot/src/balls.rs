//! The balls around all parts: which pairs of them are near each other, in lanes of parts.

use crate::frame::{Frame, Point};
use crate::lanes::in_lanes;

/// Parts are taken so many at a time.
const LANES: usize = 4;

/// The middles of the balls around some parts, coordinate by coordinate.
type Middles = [[f64; LANES]; 3];

/// The pairs of a part A with `LANES` others.
#[derive(Clone, Debug)]
struct Row {
    a: u32,
    /// The place of the others among all parts, as a multiple of `LANES`.
    others: u32,
    /// The numbers of the pairs. What is no pair has 0.
    numbers: [u32; LANES],
    /// Of each pair, the sum of the radii of both balls, or a little more.
    reaches: [f64; LANES],
    /// A bit for each pair.
    pairs: u8,
}

/// What does not change about the balls from one configuration to another.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// All pairs, by their parts.
    rows: Vec<Row>,
    /// The middles of the balls that stand still. None is farther from the origin along an axis than the number.
    still: Vec<Middles>,
    farthest: f64,
    moving: Vec<Moving>,
    /// How much longer a distance in the world may be in the frame of a part: 1, or more where places are not quite rigid.
    stretch: f64,
}

/// A ball that moves: of a part, with a group, in which its middle is here.
#[derive(Clone, Debug)]
struct Moving {
    part: usize,
    group: usize,
    middle: Point,
}

impl Layout {
    /// Takes where the balls are: the group that moves each, none if it stands still, and its middle there.
    pub(crate) fn place(&mut self, balls: impl ExactSizeIterator<Item = (Option<usize>, Point)>) {
        self.still.resize(balls.len().div_ceil(LANES), [[0.0; LANES]; 3]);
        self.moving.clear();
        self.farthest = 0.0;
        for (part, (group, middle)) in balls.enumerate() {
            if let Some(group) = group {
                self.moving.push(Moving { part, group, middle });
            } else {
                put(&mut self.still, part, middle);
                self.farthest = farther(self.farthest, &middle);
            }
        }
    }

    /// Takes so many pairs: the parts of each, the sum of the radii of its balls or a little more, and how much longer a distance in
    /// the world may be in the frame of a part.
    pub(crate) fn list(
        &mut self,
        count: usize,
        parts: impl Fn(usize) -> [usize; 2],
        reach: impl Fn(usize) -> f64,
        stretch: f64,
    ) {
        self.stretch = stretch;
        let mut order: Vec<u32> = (0..count as u32).collect();
        let of = |number: u32| parts(number as usize);
        order.sort_unstable_by_key(|&number| of(number));
        let rows = order.chunk_by(|&one, &other| {
            let [one, other] = [of(one), of(other)];
            (one[0], one[1] / LANES) == (other[0], other[1] / LANES)
        });
        let rows = rows.map(|numbers| {
            let [a, b] = of(numbers[0]);
            let (a, others) = (a as u32, (b / LANES) as u32);
            let mut row = Row { a, others, numbers: [0; LANES], reaches: [0.0; LANES], pairs: 0 };
            for &number in numbers {
                let lane = of(number)[1] % LANES;
                row.pairs |= 1 << lane;
                row.numbers[lane] = number;
                row.reaches[lane] = reach(number as usize);
            }
            row
        });
        self.rows = rows.collect();
    }
}

fn put(middles: &mut [Middles], part: usize, at: Point) {
    middles[part / LANES].iter_mut().zip(at).for_each(|(of, x)| of[part % LANES] = x);
}

/// Returns the larger of a number and how far a point is from the origin along an axis: infinity if that is not a number.
fn farther(most: f64, point: &Point) -> f64 {
    point.iter().fold(most, |most, x| if x.is_finite() { most.max(x.abs()) } else { f64::INFINITY })
}

/// Where the balls are in a configuration.
#[derive(Default)]
pub(crate) struct Balls {
    middles: Vec<Middles>,
    /// No square of a distance is too large to be a number.
    is_plain: bool,
}

impl Balls {
    /// Goes to a configuration, given the frames of all groups. Returns how far from the origin along an axis any of the balls' middles and
    /// of the frames' origins is.
    pub(crate) fn place(&mut self, layout: &Layout, groups: &[Frame]) -> f64 {
        self.middles.clone_from(&layout.still);
        let mut farthest =
            groups.iter().fold(layout.farthest, |most, group| farther(most, &group.translation));
        for &Moving { part, group, middle } in &layout.moving {
            let at = groups[group].place(middle);
            farthest = farther(farthest, &at);
            put(&mut self.middles, part, at);
        }
        self.is_plain = farthest < 1e150;
        farthest
    }

    pub(crate) fn middle(&self, part: usize) -> Point {
        let of = &self.middles[part / LANES];
        [of[0][part % LANES], of[1][part % LANES], of[2][part % LANES]]
    }

    /// Returns the square of how far the middles of the balls around two parts are apart.
    pub(crate) fn squared_distance(&self, parts: [usize; 2]) -> f64 {
        let [a, b] = parts.map(|part| self.middle(part));
        let [x, y, z] = [0, 1, 2].map(|k| b[k] - a[k]);
        x * x + y * y + z * z
    }

    /// Lists the numbers of all pairs whose balls are no farther apart than a distance.
    pub(crate) fn list_near(&self, layout: &Layout, distance: f64, near: &mut Vec<usize>) {
        near.clear();
        in_lanes(|| {
            for row in &layout.rows {
                let squares = self.squared_distances(row);
                let mut bits = 0u8;
                for k in 0..LANES {
                    let reach = row.reaches[k] + distance;
                    let is_far = (reach * reach - squares[k]).to_bits() >> 63;
                    bits |= (is_far as u8) << k;
                }
                bits = if self.is_plain { !bits & row.pairs } else { row.pairs };
                while bits != 0 {
                    near.push(row.numbers[bits.trailing_zeros() as usize] as usize);
                    bits &= bits - 1;
                }
            }
        });
    }

    /// Returns for each pair how far apart its balls are at least, also in the frame of a part whose place is not quite rigid, and its
    /// number; below zero for balls that meet.
    pub(crate) fn gaps(&self, layout: &Layout, slack: f64) -> Vec<(f64, usize)> {
        let mut gaps = Vec::with_capacity(LANES * layout.rows.len());
        in_lanes(|| {
            for row in &layout.rows {
                let squares = self.squared_distances(row);
                let mut of = [0.0; LANES];
                for k in 0..LANES {
                    let gap = squares[k].sqrt() - row.reaches[k] - slack;
                    of[k] = if self.is_plain { gap.min(gap / layout.stretch) } else { f64::NEG_INFINITY };
                }
                let pairs = (0..LANES).filter(|&k| row.pairs >> k & 1 == 1);
                gaps.extend(pairs.map(|k| (of[k], row.numbers[k] as usize)));
            }
        });
        gaps
    }

    #[inline(always)]
    fn squared_distances(&self, row: &Row) -> [f64; LANES] {
        let at = self.middle(row.a as usize);
        let others = &self.middles[row.others as usize];
        let mut squares = [0.0; LANES];
        for (at, others) in at.iter().zip(others) {
            for k in 0..LANES {
                let way = others[k] - at;
                squares[k] += way * way;
            }
        }
        squares
    }
}

#[cfg(test)]
mod tests {
    use crate::asker::Asker;
    use crate::frame::length;
    use crate::options::Base;
    use crate::testing::{ball, robot, slider, tree, values};
    use bvh_query::{PenetrationOptions, Pose};
    use cbvh_testkit::Random;

    /// Pairs are near and gaps are as wide as the balls say one by one, also of what has been moved.
    #[test]
    fn near_pairs_are_those_of_balls_one_by_one() {
        let (random, mut asker) = (&mut Random::new(61), Asker::new().unwrap());
        let (mut near, mut far) = (0, 0);
        for round in 0..60 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&tree(random, 2 + round % 9), base);
            for number in 0..random.below(12) {
                let name = format!("ball{number}");
                let at = |random: &mut Random| {
                    Pose::from_quaternion([0.0, 0.0, 0.0, 1.0], random.point()).unwrap()
                };
                match number % 3 {
                    0 => robot.attach(&name, ball(0.3), "link1", &at(random), &[]).unwrap(),
                    _ => robot.add_obstacle(&name, ball(0.4), &at(random)).unwrap(),
                }
                robot.refresh();
                robot.set_pose(&name, &at(random)).unwrap();
            }
            robot.refresh();
            let joints = values(random, &robot, 1.0);
            let setting = &*robot.setting;
            asker.place(setting, &joints).unwrap();
            let distance = [0.0, 0.3][round % 2];
            let mut found = Vec::new();
            asker.balls.list_near(&setting.layout, distance, &mut found);
            found.sort_unstable();
            let mut gaps = asker.balls.gaps(&setting.layout, 0.0);
            gaps.sort_unstable_by_key(|gap| gap.1);
            let mut expected = Vec::new();
            for (number, pair) in setting.pairs.iter().enumerate() {
                let [a, b] =
                    [pair.a, pair.b].map(|part| asker.frame(setting, part).place(setting.parts[part].middle));
                let gap = length([0, 1, 2].map(|k| b[k] - a[k])) - pair.reach(&setting.parts);
                assert!(gap.abs() > 1e-9 && (gap - distance).abs() > 1e-9);
                assert!((gap - gaps[number].0).abs() < 1e-12 && gaps[number].1 == number);
                if gap <= distance {
                    expected.push(number);
                }
            }
            assert_eq!(found, expected, "round {round}");
            near += found.len();
            far += setting.pairs.len() - found.len();
        }
        assert!(near > 150 && far > 1000, "{near} {far}");
    }

    /// Where squares of distances are too large to be numbers, nothing is found that is not there.
    #[test]
    fn what_is_too_far_to_compare_is_not_near() {
        let mut robot = slider(0.0);
        robot.attach("tool", ball(0.1), "hand", &Pose::IDENTITY, &[]).unwrap();
        let at = Pose::from_quaternion([0.0, 0.0, 0.0, 1.0], [0.15, 0.0, 0.0]).unwrap();
        robot.add_obstacle("ball", ball(0.1), &at).unwrap();
        assert!(robot.collide(&[0.1]).unwrap());
        for far in [1e9, 1e149, 1e150, 1e154, 1e155, 1e200, 1e308, f64::MAX] {
            for at in [[far], [-far]] {
                assert!(!robot.collide(&at).unwrap_or(false));
                assert!(robot.pairs_in_contact(&at).is_ok_and(|pairs| pairs.is_empty()));
                assert!(robot.near_pairs(&at, 1.0, &PenetrationOptions::new()).unwrap().is_empty());
                let distance = robot.distance(&at);
                assert!(distance.is_err() || far == 1e9 && distance.unwrap().unwrap().nearest.lower > 9e8);
            }
        }
    }
}
