//! Pairs of bodies that are near each other, with the derivatives of their signed distances by the joint values.
//!
//! Let A and B be a pair, n its normal, which leads from A to B, and p and q the points of A and B that the answer names. Each joint
//! between them moves one of these points against the other. The signed distance then changes at the rate n . (dq - dp): of two
//! bodies that are apart, n is the direction of the shortest line between them, and turning that line does not change its length to
//! first order. Of two that overlap, p and q meet where B comes free along n, and a move of B along n makes the depth as much less.
//! Joints above both bodies move both alike, and do not count.
//!
//! A joint that turns moves a point x at the rate w x (x - o), where w is its axis and o a point of the axis. The component of that
//! along n is w . ((x - o) x n).

use crate::asker::{Asker, Candidate, boxes_apart, failed};
use crate::error::RobotError;
use crate::frame::{Frame, Point, each};
use crate::model::{Joint, Kind, quaternion_length};
use crate::questions::bodies;
use crate::robot::Robot;
use crate::setting::{Pair, Setting};
use bvh_query::{NumberError, PenetrationOptions, QueryError, SignedDistance};

/// Two bodies that are near each other.
///
/// [`Robot::near_pairs`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NearPair {
    /// The names of both.
    pub bodies: [String; 2],
    /// How far they are apart or, below zero, how deep they overlap, with points, normal and translation turned into the world, which
    /// rounds them. Of bodies with several shapes, these are the nearest two, or those that overlap most.
    pub nearest: SignedDistance,
    /// The derivative of `nearest.distance` by each joint value, in the order of [`Robot::joints`]: metres per radian, or per metre.
    pub gradient: Vec<f64>,
}

impl Robot {
    /// Returns the bodies that overlap or are at most `margin` apart, in metres, in the order of [`Robot::pairs`]: how far apart they
    /// are, where, and how that changes with each joint value. Planners that optimise a path use it as a constraint or a cost.
    ///
    /// It is decided exactly which bodies are at most that far apart. The distances are those of
    /// [`Querier::signed_distance`](bvh_query::Querier::signed_distance), with its bounds, and so is what overlaps: a body inside
    /// another one does, unless one of them is not closed. Margins of bodies ([`Robot::set_margin`]) are a part of them.
    ///
    /// The derivatives are those of the points that the answer names. They are exact, but for roundings, where these are the only nearest
    /// points. Where several are equally near, as on parallel faces, the signed distance has a bend: the derivative is that of one of
    /// them, which is a subgradient, and on one side of the bend it is the derivative. Where bodies overlap, it is the derivative of
    /// `distance`, which is an upper bound of the depth, along the way out that was found: a lower
    /// [`relative_gap`](PenetrationOptions::relative_gap) brings it nearer to that of the depth. It is 0 where the normal is, as for
    /// bodies that touch and have no depth. A floating joint has a derivative by each of the four numbers of its quaternion, which is
    /// divided by its length first, so that the derivative along the quaternion itself is 0. A joint that others mimic has the sum of
    /// what all of them contribute.
    ///
    /// Cost: the poses of all links, a comparison of balls for each pair, one of boxes for pairs whose balls are within the margin, and
    /// for those that boxes leave a distance or a depth. Memory is allocated for the answer alone.
    ///
    /// ```
    /// # fn step(robot: &mut cbvh_robot::Robot, joints: &mut [f64]) -> Result<(), cbvh_robot::RobotError> {
    /// // Moves away from all that is nearer than 5 cm.
    /// for pair in robot.near_pairs(joints, 0.05, &Default::default())? {
    ///     let push = 0.05 - pair.nearest.distance;
    ///     joints.iter_mut().zip(&pair.gradient).for_each(|(joint, slope)| *joint += push * slope);
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// The errors of [`Robot::signed_distance`], and [`RobotError::Query`] if the margin is negative, NaN or infinite.
    pub fn near_pairs(
        &mut self,
        joints: &[f64],
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Vec<NearPair>, RobotError> {
        check(margin, options)?;
        self.refresh();
        self.asker.near(&self.setting, joints, margin, options)
    }

    /// Returns the bodies that are near each other for each of many configurations, as [`Robot::collide_many`] does.
    ///
    /// # Errors
    /// The errors of [`Robot::collide_many`] and [`Robot::near_pairs`].
    pub fn near_pairs_many(
        &mut self,
        joints: &[f64],
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Vec<Vec<NearPair>>, RobotError> {
        check(margin, options)?;
        self.many(joints, |asker, setting, joints| asker.near(setting, joints, margin, options))
    }
}

fn check(margin: f64, options: &PenetrationOptions) -> Result<(), QueryError> {
    if !(0.0..f64::INFINITY).contains(&margin) {
        return Err(NumberError::Margin(margin).into());
    }
    options.check()
}

impl Asker {
    fn near(
        &mut self,
        setting: &Setting,
        joints: &[f64],
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Vec<NearPair>, RobotError> {
        self.place(setting, joints)?;
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        let candidate = |(gap, number): (f64, usize)| {
            (gap <= margin).then(|| Candidate {
                bodies: setting.bodies_of(&setting.pairs[number]),
                gap,
                number,
            })
        };
        candidates.extend(self.balls.gaps(&setting.layout, self.slack).into_iter().filter_map(candidate));
        // By bodies, the nearest balls first. The order is already that of the bodies if each has one part.
        candidates.sort_unstable_by(|x, y| {
            x.bodies.cmp(&y.bodies).then(x.gap.total_cmp(&y.gap)).then(x.number.cmp(&y.number))
        });
        let mut found = Vec::new();
        for of_bodies in candidates.chunk_by(|x, y| x.bodies == y.bodies) {
            if let Some((number, nearest)) = self.least(setting, of_bodies, margin, options)? {
                let pair = &setting.pairs[number];
                let nearest = self.in_world(setting, pair, nearest);
                let gradient = self.gradient(setting, pair, joints, &nearest);
                found.push(NearPair { bodies: bodies(setting, number), nearest, gradient });
            }
        }
        self.candidates = candidates;
        Ok(found)
    }

    /// Returns the least signed distance of the parts of two bodies, with its pair, if that is near. Points are in A's frame.
    fn least(
        &mut self,
        setting: &Setting,
        candidates: &[Candidate],
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Option<(usize, SignedDistance)>, RobotError> {
        let mut least: Option<(usize, SignedDistance)> = None;
        for &Candidate { gap, number, .. } in candidates {
            // Once some overlap, only others that do can be less.
            let limit = least.as_ref().map_or(margin, |(_, held)| held.upper.clamp(0.0, margin));
            if gap > limit {
                break;
            }
            let pair = &setting.pairs[number];
            let relative = self.relative(setting, pair);
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
            if boxes_apart(&relative, a, b, self.slack + limit) {
                continue;
            }
            let pose = relative.pose()?;
            let found = self.querier.signed_distance_within(&a.shape, &b.shape, &pose, limit, options);
            if let Some(found) = found.map_err(|source| failed(setting, pair, source))?
                && least.as_ref().is_none_or(|(of, held)| (found.lower, number) < (held.lower, *of))
            {
                least = Some((number, found));
            }
        }
        Ok(least)
    }

    /// Returns the derivative of the signed distance of a pair by each joint value, given the answer in the world.
    fn gradient(&self, setting: &Setting, pair: &Pair, joints: &[f64], of: &SignedDistance) -> Vec<f64> {
        let model = &setting.model;
        let mut gradient = vec![0.0; model.numbers.len()];
        let [a, b] = [pair.a, pair.b].map(|part| setting.parts[part].group);
        let top = model.common(a, b);
        let sides = [(a, of.point_a, of.normal.map(|x| -x)), (b, of.point_b, of.normal)];
        for (group, point, along) in sides {
            for joint in model.between(group, top) {
                let joint = &model.joints[joint];
                let frames = [joint.parent, joint.child].map(|group| &self.groups[group]);
                joint.add_rates(frames, joints, (point, along), &mut gradient);
            }
        }
        gradient
    }
}

impl Joint {
    /// Adds how fast a point that the joint carries moves along a direction, by each number that sets the joint. The frames of its
    /// parent and of its child, the point and the direction are in the world.
    fn add_rates(
        &self,
        [parent, child]: [&Frame; 2],
        numbers: &[f64],
        (point, along): (Point, Point),
        rates: &mut [f64],
    ) {
        // All joints turn about the origin of the child.
        let torque = cross(each(|k| point[k] - child.translation[k]), along);
        let fixed = || {
            let joint = parent.of(&self.origin).turning();
            (joint.find(along), joint.find(torque))
        };
        match &self.kind {
            Kind::Turn { by, axis, .. } => {
                rates[by.number] += by.factor * dot(child.turning().place(*axis), torque);
            }
            Kind::Slide { by, axis } => {
                rates[by.number] += by.factor * dot(child.turning().place(*axis), along);
            }
            &Kind::Planar(first) => {
                let (along, torque) = fixed();
                for (number, rate) in (first..).zip([along[0], along[1], torque[2]]) {
                    rates[number] += rate;
                }
            }
            &Kind::Floating(first) => {
                let (along, torque) = fixed();
                (first..).zip(along).for_each(|(number, rate)| rates[number] += rate);
                let long = quaternion_length(numbers, first);
                let [x, y, z, w] = [3, 4, 5, 6].map(|k| numbers[first + k] / long);
                // A unit quaternion q that changes by d, across q, turns at the rate 2 Im(d q*). What d has along q does not count.
                let turns = [[w, z, -y], [-z, w, x], [y, -x, w], [-x, -y, -z]];
                for (number, turn) in (first + 3..).zip(turns) {
                    rates[number] += 2.0 / long * dot(turn, torque);
                }
            }
        }
    }
}

fn dot(v: Point, w: Point) -> f64 {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

fn cross(v: Point, w: Point) -> Point {
    [v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Base;
    use crate::testing::{ball, robot, slider, tree, values};
    use bvh_query::{Pose, Querier};
    use cbvh_testkit::Random;

    /// Makes boxes and capsules of some of the balls of a tree, and adds a second shape to some of the links.
    fn mixed(random: &mut Random, links: usize) -> String {
        let shapes = ["<sphere radius=\"", "<capsule length=\"0.3\" radius=\"", "<box size=\"0.8 0.6 0"];
        tree(random, links)
            .lines()
            .map(|line| {
                let of = line.replace("<sphere radius=\"", shapes[random.below(shapes.len())]);
                let origin = random.point().map(|x| 0.2 * x);
                let second = format!(
                    "<collision><origin xyz=\"{} {} {}\"/><geometry><sphere radius=\"0.05\"/></geometry></collision></link>",
                    origin[0], origin[1], origin[2]
                );
                if random.below(3) == 0 { of.replace("</link>", &second) + "\n" } else { of + "\n" }
            })
            .collect()
    }

    /// Searches for depths until roundings end that, so that depths are the least ones and not upper bounds.
    fn closely() -> PenetrationOptions {
        PenetrationOptions::new().relative_gap(1e-14)
    }

    /// Returns a robot that is asked about two bodies alone.
    fn alone(robot: &Robot, bodies: &[String; 2]) -> Robot {
        let mut alone = robot.clone();
        for [a, b] in alone.pairs().iter().filter(|pair| *pair != bodies) {
            alone.allow(a, b).unwrap();
        }
        alone
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        const STEP: f64 = 1e-6;
        let random = &mut Random::new(51);
        // Derivatives of bodies that are apart and of those that overlap, by kinds of joints, and those that were not compared.
        let (mut compared, mut by_kind, mut jumps, mut loose) = ([0; 2], [0; 4], 0, 0);
        for round in 0..60 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&mixed(random, 3 + round % 5), base);
            let mut joints = values(random, &robot, 1.0);
            if round % 4 == 3 {
                // Quaternions may have other lengths.
                let is_turn = |name: &String| name[name.len().saturating_sub(3)..].starts_with("/q");
                let places: Vec<usize> = (0..joints.len()).filter(|&k| is_turn(&robot.joints()[k])).collect();
                places.into_iter().for_each(|place| joints[place] *= 1.5);
            }
            let margin = 0.5;
            for pair in robot.near_pairs(&joints, margin, &closely()).unwrap() {
                let now = pair.nearest.distance;
                assert_eq!(pair.gradient.len(), joints.len());
                if now < 0.0 && pair.nearest.upper - now > 1e-9 {
                    // The way out that was found need not be the shortest.
                    loose += 1;
                    continue;
                }
                let mut alone = alone(&robot, &pair.bodies);
                for number in 0..joints.len() {
                    let mut beside = |by: f64| {
                        let mut moved = joints.clone();
                        moved[number] += by;
                        let found = alone.near_pairs(&moved, 9.0, &closely()).unwrap();
                        (moved[number] - joints[number], found[0].nearest.distance)
                    };
                    let [(back, before), (on, after)] = [beside(-STEP), beside(STEP)];
                    let slopes = [(before - now) / back, (after - now) / on];
                    if (slopes[0] - slopes[1]).abs() >= 1e-4 {
                        jumps += 1;
                        continue;
                    }
                    let expected = (after - before) / (on - back);
                    let found = pair.gradient[number];
                    assert!(
                        (found - expected).abs() < 1e-6,
                        "round {round}, {:?} by {}: {found} {expected}\n{:?}",
                        pair.bodies,
                        robot.joints()[number],
                        pair.nearest
                    );
                    compared[usize::from(now < 0.0)] += 1;
                    if found != 0.0 {
                        let kind = robot.setting.model.joints.iter().find_map(|joint| match joint.kind {
                            Kind::Turn { by, .. } => (by.number == number).then_some(0),
                            Kind::Slide { by, .. } => (by.number == number).then_some(1),
                            Kind::Planar(first) => (first..first + 3).contains(&number).then_some(2),
                            Kind::Floating(first) => (first..first + 7).contains(&number).then_some(3),
                        });
                        by_kind[kind.unwrap()] += 1;
                    }
                }
            }
        }
        let all = compared[0] + compared[1];
        assert!(
            compared[0] > 1000 && compared[1] > 100 && jumps + loose < all / 10,
            "{compared:?}, {jumps}, {loose}"
        );
        assert!(by_kind.iter().all(|&kind| kind > 50), "{by_kind:?}");
    }

    /// Returns the least signed distance of all shapes of two bodies, and whether any two are within a margin.
    fn of_all_shapes(
        (robot, querier): (&Robot, &mut Querier),
        joints: &[f64],
        bodies: &[String; 2],
        margin: f64,
    ) -> (SignedDistance, bool) {
        let poses = robot.link_poses(joints).unwrap();
        let placed = |name: &str| {
            let body = robot.body(name).unwrap();
            let link = poses.get(body).copied().unwrap_or(Pose::IDENTITY);
            let shapes = robot.shapes(body).unwrap().into_iter();
            shapes.map(move |(shape, pose)| (shape, pose.then(&link).unwrap())).collect::<Vec<_>>()
        };
        let (mut least, mut is_within): (Option<SignedDistance>, bool) = (None, false);
        for (a, at_a) in placed(&bodies[0]) {
            for (b, at_b) in placed(&bodies[1]) {
                let pose = Pose::relative(&at_a, &at_b).unwrap();
                let of = querier.signed_distance(&a, &b, &pose, &PenetrationOptions::new()).unwrap();
                is_within |= of.lower < 0.0 || querier.within(&a, &b, &pose, margin).unwrap();
                if least.is_none_or(|least| of.lower < least.lower) {
                    let mut of = of;
                    (of.point_a, of.point_b) = (at_a.place(of.point_a), at_a.place(of.point_b));
                    least = Some(of);
                }
            }
        }
        (least.unwrap(), is_within)
    }

    #[test]
    fn near_pairs_are_those_of_all_shapes_pair_by_pair() {
        let (random, mut querier, options) =
            (&mut Random::new(52), Querier::new().unwrap(), PenetrationOptions::new());
        let (mut near, mut far, mut deep) = (0, 0, 0);
        for round in 0..40 {
            let base = [Base::Fixed, Base::Planar, Base::Floating][round % 3];
            let mut robot = robot(&mixed(random, 3 + round % 6), base);
            let room = bvh_bake::shapes::block([6.0, 6.0, 6.0]).unwrap();
            let (room, _) = bvh_bake::to_bytes(&room, &bvh_bake::Options::default()).unwrap();
            let room = bvh_query::Bvh::from_bytes(room).unwrap();
            robot.add_obstacle("room", room, &Pose::IDENTITY).unwrap();
            let joints = values(random, &robot, 1.0);
            let margin = [0.0, 0.1, 0.4][random.below(3)];
            let found = robot.near_pairs(&joints, margin, &options).unwrap();
            let mut found_so_far = found.iter().peekable();
            for bodies in robot.pairs() {
                let (least, is_within) = of_all_shapes((&robot, &mut querier), &joints, &bodies, margin);
                let Some(pair) = found_so_far.next_if(|pair| pair.bodies == bodies) else {
                    assert!(!is_within, "round {round}, {bodies:?}: {least:?}");
                    far += 1;
                    continue;
                };
                assert!(is_within, "round {round}, {bodies:?}: {least:?}");
                let of = &pair.nearest;
                let pairs = [(of.lower, least.lower), (of.distance, least.distance), (of.upper, least.upper)];
                // Searches for depths end within one per cent.
                let tolerance = 1e-9 - 0.02 * of.lower.min(0.0);
                for (found, expected) in pairs {
                    assert!(
                        (found - expected).abs() < tolerance,
                        "round {round}, {bodies:?}: {of:?} {least:?}"
                    );
                }
                if of.lower > 1e-3 {
                    let points = [(of.point_a, least.point_a), (of.point_b, least.point_b)];
                    let off = points.into_iter().flat_map(|(p, q)| each(|k| (p[k] - q[k]).abs()));
                    assert!(off.fold(0.0, f64::max) < 1e-9, "round {round}: {of:?} {least:?}");
                }
                (near, deep) = (near + 1, deep + usize::from(of.upper < 0.0));
            }
            assert!(found_so_far.next().is_none(), "round {round}: {found:?}");
        }
        assert!(near > 100 && far > 100 && deep > 30, "{near} {far} {deep}");
    }

    /// Joints above both bodies do not move them against each other, and touching surfaces without an inside have no normal.
    #[test]
    fn nothing_changes_where_nothing_moves() {
        let text = r#"<robot name="two"><link name="root"/><link name="arm"/>
            <link name="a"><collision><geometry><sphere radius="0.5"/></geometry></collision></link>
            <link name="b"><collision><geometry><sphere radius="0.25"/></geometry></collision></link>
            <joint name="turn" type="continuous"><parent link="root"/><child link="arm"/><axis xyz="0 0 1"/></joint>
            <joint name="left" type="prismatic"><parent link="arm"/><child link="a"/><axis xyz="1 0 0"/>
                <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
            <joint name="right" type="prismatic"><parent link="arm"/><child link="b"/><axis xyz="1 0 0"/>
                <limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="left" multiplier="-2"/></joint></robot>"#;
        let mut robot = robot(text, Base::Planar);
        assert_eq!(robot.joints(), ["base/x", "base/y", "base/theta", "turn", "left"]);
        let near = |robot: &mut Robot, left: f64, margin: f64| {
            robot.near_pairs(&[0.3, 0.1, 0.7, 0.4, left], margin, &PenetrationOptions::new()).unwrap()
        };
        assert_eq!(near(&mut robot, 1.0, 2.0), []);
        // They are 3 |left| apart, less the radii: one joint moves both.
        for (left, expected, slope) in [(1.0, 2.25, 3.0), (-1.0, 2.25, -3.0), (0.2, -0.15, 3.0)] {
            let [pair] = &near(&mut robot, left, 2.5)[..] else { panic!("expected one pair") };
            assert!((pair.nearest.distance - expected).abs() < 1e-9, "{pair:?}");
            assert_eq!(pair.gradient[..4], [0.0; 4]);
            assert!((pair.gradient[4] - slope).abs() < 1e-9, "{pair:?}");
        }
    }

    /// Where a place is not quite rigid, balls and boxes leave out nothing that the exact question finds near, at margins that are much
    /// larger than the shapes.
    #[test]
    fn what_is_not_placed_rigidly_is_found_at_large_margins() {
        let (mut near, mut far) = (0, 0);
        for step in 0..80 {
            let by = [-1.0, 1.0][step % 2] * 2f64.powi(-22);
            let turned = Pose::IDENTITY.rotation().map(|row| row.map(|x| x * (1.0 + by)));
            let mut robot = slider(10.0);
            robot.attach("tool", ball(1e-3), "hand", &Pose::new(turned, [0.0; 3]).unwrap(), &[]).unwrap();
            let at = [10.0 + 1.0 + 1.5e-3 + 1e-8 * (step as f64 - 40.0), 0.0, 0.0];
            robot
                .add_obstacle("ball", ball(5e-4), &Pose::new(*Pose::IDENTITY.rotation(), at).unwrap())
                .unwrap();
            let found = robot.near_pairs(&[0.0], 1.0, &PenetrationOptions::default()).unwrap();
            let (setting, asker) = (robot.setting.clone(), &mut robot.asker);
            asker.place(&setting, &[0.0]).unwrap();
            let pair = &setting.pairs[0];
            let pose = asker.relative(&setting, pair).pose().unwrap();
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
            let expected = asker.querier.within(a, b, &pose, 1.0).unwrap();
            assert_eq!(found.len(), usize::from(expected), "step {step}");
            (near, far) = (near + found.len(), far + usize::from(!expected));
        }
        assert!(near > 10 && far > 10, "{near} {far}");
    }
}
