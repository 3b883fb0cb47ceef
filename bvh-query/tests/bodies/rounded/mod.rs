//! Compares answers about rounded shapes with their definition, in exact arithmetic over all pairs of triangles.

mod all_hits;
mod files;
mod solids;

use crate::common::nearest::point_triangle;
use crate::common::shapes::{cube, outward, plate, soup, sphere, torus};
use crate::common::truth::{self, Surface};
use crate::common::{Random, Triangle, baked, placed, queriers, random_pose, stored, translation};
use bvh_query::{
    Bvh, Contact, Distance, Motion, MotionAnswer, MotionOptions, Pose, Querier, QueryError, Ray, Relation,
    Side, Tracker,
};
use cbvh_testkit::exact::Length;
use std::cmp::Ordering;

/// How far off a witness may be.
const TOLERANCE: f64 = 1e-12;

/// Returns points, segments and triangles on a lattice, on which many distances are whole numbers.
fn lattice_core(random: &mut Random, count: usize) -> Vec<Triangle> {
    let mut point = || [(); 3].map(|()| random.below(9) as f64 - 4.0);
    let mut triangles: Vec<Triangle> = (0..count).map(|_| [point(), point(), point()]).collect();
    for (number, triangle) in triangles.iter_mut().enumerate() {
        match number % 3 {
            0 => *triangle = [triangle[0]; 3],
            1 => triangle[2] = triangle[1],
            _ => {}
        }
    }
    triangles
}

struct Truth {
    a: Vec<Triangle>,
    placed_b: Vec<Triangle>,
    lengths: Vec<(Length, Contact)>,
}

impl Truth {
    fn new(a: &Bvh, b: &Bvh, pose: &Pose) -> Self {
        let [a, b] = [a, b].map(|bvh| Surface::new(stored(bvh)));
        let lengths = truth::Truth::new(&a, &b, pose).lengths();
        Self { placed_b: placed(&b.corners, pose), a: a.corners, lengths }
    }

    fn within(&self, sum: f64) -> Vec<Contact> {
        let near = self.lengths.iter().filter(|(length, ..)| length.compare(sum).is_le());
        near.map(|&(_, pair)| pair).collect()
    }

    fn is_within(&self, sum: f64) -> bool {
        self.lengths.iter().any(|(length, ..)| length.compare(sum).is_le())
    }

    /// Compares the least distance beyond a sum with a number, with slack for the roundings of the sum and the number.
    fn check(&self, answer: &Distance, radii: [f64; 2]) {
        let sum = radii[0] + radii[1];
        assert_eq!(answer.distance == 0.0, self.is_within(sum), "{answer:?} beyond {sum}");
        assert!(answer.lower <= answer.distance && answer.distance <= answer.upper, "{answer:?}");
        let slack = 4.0 * f64::EPSILON * (sum + answer.upper);
        assert!(!self.is_within((sum + answer.lower - slack).max(0.0).next_down()) || answer.lower <= slack);
        assert!(self.is_within(sum + answer.upper + slack), "{answer:?} beyond {sum}");
        let gap = (0..3).map(|k| (answer.point_a[k] - answer.point_b[k]).powi(2)).sum::<f64>().sqrt();
        assert!((gap - answer.distance).abs() < TOLERANCE, "{answer:?}");
        let off = |point, triangles: &mut dyn Iterator<Item = &Triangle>| {
            triangles.map(|triangle| point_triangle(point, triangle)).fold(f64::INFINITY, f64::min)
        };
        let off_a = off(answer.point_a, &mut self.a.iter());
        let off_b = off(answer.point_b, &mut self.placed_b.iter());
        if answer.distance == 0.0 {
            assert!(off_a <= radii[0] + TOLERANCE && off_b <= radii[1] + TOLERANCE, "{answer:?}");
        } else {
            assert!(
                (off_a - radii[0]).abs() < TOLERANCE && (off_b - radii[1]).abs() < TOLERANCE,
                "{answer:?}"
            );
        }
    }
}

/// Vectors of whole length, each with its length and a vector perpendicular to it.
const WHOLE: [([f64; 3], f64, [f64; 3]); 4] = [
    ([1.0, 2.0, 2.0], 3.0, [2.0, 1.0, -2.0]),
    ([2.0, 3.0, 6.0], 7.0, [3.0, -6.0, 2.0]),
    ([0.0, 3.0, 4.0], 5.0, [1.0, 4.0, -3.0]),
    ([1.0, 4.0, 8.0], 9.0, [4.0, -1.0, 0.0]),
];

/// Adds two vectors.
fn sum(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| p[k] + q[k])
}

/// Asks all questions about two rounded cores.
fn check_pair(
    queriers: &mut [Querier],
    (a, b): (&Bvh, &Bvh),
    pose: &Pose,
    radii: [f64; 2],
    tracker: &mut Tracker,
) -> Ordering {
    let truth = Truth::new(a, b, pose);
    let (shape_a, shape_b) = (a.all().rounded(radii[0]).unwrap(), b.all().rounded(radii[1]).unwrap());
    let sum = radii[0] + radii[1];
    let (touching, contacts) = (truth.is_within(sum), truth.within(sum));
    let mut first = None;
    for querier in queriers {
        assert_eq!(querier.collide(shape_a, shape_b, pose).unwrap(), touching, "{}", querier.backend());
        assert_eq!(tracker.collide(querier, shape_a, shape_b, pose).unwrap(), touching);
        let mut found = querier.contacts(shape_a, shape_b, pose).unwrap();
        found.sort_unstable();
        let mut expected = contacts.clone();
        expected.sort_unstable();
        assert_eq!(found, expected, "{}", querier.backend());
        let answer = querier.distance(shape_a, shape_b, pose).unwrap();
        truth.check(&answer, radii);
        assert_eq!(*first.get_or_insert(answer), answer);
        assert_eq!(tracker.distance(querier, shape_a, shape_b, pose).unwrap(), answer);
        for d in [0.0, 1.0, 2.0, 0.3, answer.distance * 0.999, answer.distance * 1.001] {
            let expected = truth.is_within(sum + d);
            assert_eq!(querier.within(shape_a, shape_b, pose, d).unwrap(), expected, "{d}");
            assert_eq!(tracker.within(querier, shape_a, shape_b, pose, d).unwrap(), expected, "{d}");
        }
        let options = bvh_query::DistanceOptions::new().rel_err(0.25).abs_err(0.01);
        let rough = querier.distance_with(shape_a, shape_b, pose, &options).unwrap();
        assert!(
            rough.distance >= answer.distance && rough.distance <= answer.distance * 1.25 + 0.01 + TOLERANCE
        );
        assert_eq!(rough.distance == 0.0, touching);
        let relation = querier.relation(shape_a, shape_b, pose).unwrap();
        assert_eq!(relation == Relation::Touching, touching);
    }
    let exact = truth.lengths.iter().any(|(length, ..)| length.compare(sum).is_eq());
    if exact {
        Ordering::Equal
    } else if touching {
        Ordering::Less
    } else {
        Ordering::Greater
    }
}

#[test]
fn rounded_cores_touch_where_the_sum_of_radii_reaches() {
    let mut queriers = queriers();
    let mut random = Random::new(5);
    let mut seen = [0; 3];
    for round in 0..cbvh_testkit::depth::rounds(60) {
        let [a, b] = [(); 2].map(|()| {
            let count = 1 + random.below(7);
            baked(&lattice_core(&mut random, count))
        });
        let mut tracker = Tracker::new();
        // Two points exactly as far apart as their radii add up to.
        let ((vector, length, _), at) = (WHOLE[round as usize % 4], [3.0, -1.0, 2.0]);
        let [p, q] = [at, sum(at, vector)].map(|point| baked(&[[point; 3]]));
        let order =
            check_pair(&mut queriers, (&p, &q), &Pose::IDENTITY, [length - 0.25, 0.25], &mut Tracker::new());
        assert_eq!(order, Ordering::Equal);
        seen[1] += 1;
        for step in 0..6 {
            let pose = if round % 2 == 0 {
                let [x, y, z] = [(); 3].map(|()| random.below(13) as f64 - 6.0);
                translation(x, y, z)
            } else {
                random_pose(&mut random, 8.0)
            };
            let radii = match step % 6 {
                0..4 => [random.below(5) as f64, random.below(3) as f64],
                4 => [0.5 + random.unit(), 0.0],
                _ => [0.0, 0.0],
            };
            let order = check_pair(&mut queriers, (&a, &b), &pose, radii, &mut tracker);
            seen[(order as i8 + 1) as usize] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count > 20), "{seen:?}: some of each kind, exact touching among them");
}

#[test]
fn meshes_with_a_radius_are_their_triangles_with_it() {
    let mut queriers = queriers();
    let mut random = Random::new(6);
    let (a, b) = (baked(&soup(60, 1)), baked(&outward(sphere(2))));
    let mut tracker = Tracker::new();
    for _ in 0..cbvh_testkit::depth::rounds(12) {
        let pose = random_pose(&mut random, 2.5);
        let radii = [random.unit() * 0.4, random.unit() * 0.4];
        check_pair(&mut queriers, (&a, &b), &pose, radii, &mut tracker);
    }
}

/// A question that ends early leaves nothing behind that contacts would report again, or look for in other files.
#[test]
fn contacts_do_not_depend_on_the_question_before() {
    let [torus, plate, ball] = [torus(24, 12), plate(6), sphere(3)].map(|triangles| baked(&triangles));
    let (rounded, pose) = (plate.all().rounded(0.25).unwrap(), translation(0.7, 1.0, 0.25));
    let expected = Querier::new().unwrap().contacts(&ball, rounded, &pose).unwrap();
    assert!(expected.len() > 100);
    let mut querier = Querier::new().unwrap();
    for other in [&plate, &torus] {
        for near in [0.1, 0.2, 0.4] {
            let at = translation(0.0, 1.0, 0.25);
            assert!(querier.collide(&ball, other.all().rounded(near).unwrap(), &at).unwrap());
            assert_eq!(querier.contacts(&ball, rounded, &pose).unwrap(), expected);
            assert!(querier.within(&ball, other, &at, near).unwrap());
            assert_eq!(querier.contacts(&ball, rounded, &pose).unwrap(), expected);
        }
    }
}

/// A radius of zero changes no bit of any answer.
#[test]
fn a_radius_of_zero_is_none() {
    let mut queriers = queriers();
    let (a, b) = (baked(&soup(50, 3)), baked(&soup(50, 4)));
    let mut random = Random::new(7);
    for querier in &mut queriers {
        for _ in 0..20 {
            let pose = random_pose(&mut random, 2.0);
            let (round_a, round_b) = (a.all().rounded(0.0).unwrap(), b.all().rounded(-0.0).unwrap());
            let plain = querier.distance(&a, &b, &pose).unwrap();
            let stats = querier.stats();
            assert_eq!(querier.distance(round_a, round_b, &pose).unwrap(), plain);
            assert_eq!(querier.stats(), stats);
            assert_eq!(querier.contacts(round_a, round_b, &pose), querier.contacts(&a, &b, &pose));
        }
    }
}

#[test]
fn wrong_radii_are_refused() {
    let mut queriers = queriers();
    let bvh = baked(&cube());
    for radius in [-1.0, f64::NAN, f64::INFINITY, f64::MAX, -f64::MIN_POSITIVE] {
        assert!(matches!(bvh.all().rounded(radius), Err(QueryError::Number(_))), "{radius}");
    }
    let largest = 2f64.powi(118);
    let (a, b) = (bvh.all().rounded(largest).unwrap(), bvh.all().rounded(largest).unwrap());
    for querier in &mut queriers {
        assert!(querier.within(a, b, &translation(1e30, 0.0, 0.0), f64::MAX).unwrap());
        assert!(querier.collide(a, b, &translation(1e30, 0.0, 0.0)).unwrap());
    }
}

/// A ball on a line meets another where their centres are as far apart as the radii add up to.
#[test]
fn balls_hit_each_other_on_time() {
    let mut queriers = queriers();
    let point = baked(&[[[0.0; 3]; 3]]);
    let mut random = Random::new(8);
    for _ in 0..cbvh_testkit::depth::rounds(40) {
        let radii = [0.1 + random.unit(), 0.1 + random.unit()];
        let (from, to) = (random.point().map(|x| 4.0 * x), random.point().map(|x| 4.0 * x));
        let (a, b) = (point.all().rounded(radii[0]).unwrap(), point.all().rounded(radii[1]).unwrap());
        let pose = |at: [f64; 3]| translation(at[0], at[1], at[2]);
        let path = Motion::between(&pose(from), &pose(to)).unwrap();
        // |from + t v|^2 = (r + s)^2
        let v = [0, 1, 2].map(|k| to[k] - from[k]);
        let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        let (c, half, square) = (dot(from, from) - (radii[0] + radii[1]).powi(2), dot(from, v), dot(v, v));
        let discriminant = half * half - square * c;
        let first = if c <= 0.0 { 0.0 } else { (-half - discriminant.sqrt()) / square };
        let is_hit = c <= 0.0 || discriminant >= 0.0 && (0.0..=1.0).contains(&first);
        let mut answers = Vec::new();
        for querier in &mut queriers {
            let answer = querier.motion(a, b, &path, &MotionOptions::new()).unwrap();
            match answer {
                MotionAnswer::Hit { free_until, touching_at, nearest } => {
                    assert!(
                        is_hit && free_until <= first + 1e-9 && touching_at >= first - 1e-9,
                        "{first} {answer:?}"
                    );
                    assert!(touching_at - first < 1e-3 && nearest.distance == 0.0, "{first} {answer:?}");
                }
                MotionAnswer::Free => assert!(!is_hit, "{first}"),
                MotionAnswer::Near { nearest, .. } => assert!(nearest.distance < 1e-4, "{answer:?}"),
            }
            let is_free = querier.is_free(a, b, &path, &MotionOptions::new()).unwrap();
            assert_eq!(is_free, answer == MotionAnswer::Free);
            answers.push(answer);
        }
        assert!(answers.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

/// Points about rounded cores, exactly on their surfaces among them.
#[test]
fn points_are_on_their_side_of_rounded_cores() {
    let mut queriers = queriers();
    let mut random = Random::new(9);
    let mut seen = [0; 3];
    for round in 0..cbvh_testkit::depth::rounds(100) {
        let core = lattice_core(&mut random, 1 + round as usize % 5);
        let (vector, length, _) = WHOLE[round as usize % 4];
        let is_exact = round % 3 == 0;
        let core = if is_exact { vec![core[0]] } else { core };
        let bvh = baked(&core);
        let (point, radius) = if is_exact {
            (sum(core[0][0], vector), length)
        } else {
            ([(); 3].map(|()| random.below(19) as f64 - 9.0), 1.0 + random.below(5) as f64)
        };
        let shape = bvh.all().rounded(radius).unwrap();
        let lengths: Vec<Length> =
            core.iter().map(|triangle| Length::between(triangle, &[point; 3])).collect();
        let order = lengths.iter().map(|length| length.compare(radius)).min().unwrap();
        for querier in &mut queriers {
            let expected = [Side::Inside, Side::On, Side::Outside][(order as i8 + 1) as usize];
            assert_eq!(querier.side(shape, point).unwrap(), expected);
            let closest = querier.closest_point(shape, point, f64::INFINITY).unwrap().unwrap();
            assert_eq!(closest.distance == 0.0, order.is_le());
            let slack = 4.0 * f64::EPSILON * (radius + closest.upper);
            assert!(lengths.iter().any(|length| length.compare(radius + closest.upper + slack).is_le()));
            assert!(
                lengths.iter().all(|length| length.compare(radius + closest.lower - slack).is_ge())
                    || closest.lower == 0.0
            );
            for limit in [0.0, 1.0, 2.0] {
                let near = lengths.iter().any(|length| length.compare(radius + limit).is_le());
                assert_eq!(querier.closest_point(shape, point, limit).unwrap().is_some(), near);
            }
            let signed = querier.signed_point_distance(shape, point, f64::INFINITY).unwrap().unwrap();
            let least =
                core.iter().map(|triangle| point_triangle(point, triangle)).fold(f64::INFINITY, f64::min);
            assert!((signed.value().unwrap() - (least - radius)).abs() < TOLERANCE, "{signed:?}");
        }
        seen[(order as i8 + 1) as usize] += 1;
    }
    assert!(seen.iter().all(|&count| count > 5), "{seen:?}");
}

/// Rays and segments about rounded cores, tangents among them.
#[test]
fn rays_hit_rounded_cores_exactly() {
    let mut queriers = queriers();
    let mut random = Random::new(10);
    let mut seen = [0; 3];
    for round in 0..cbvh_testkit::depth::rounds(300) {
        let core = lattice_core(&mut random, 1 + round as usize % 4);
        let radius = 1.0 + random.below(4) as f64;
        let mut origin = [(); 3].map(|()| random.below(25) as f64 - 12.0);
        let mut direction = [(); 3].map(|()| random.below(5) as f64 - 2.0);
        if direction == [0.0; 3] {
            direction = [0.0, 0.0, 1.0];
        }
        // No core is farther away than this, and all numbers stay exact.
        let (vector, length, tangent) = WHOLE[round as usize % 4];
        let is_tangent = round % 5 == 0;
        let core = if is_tangent { vec![core[0]] } else { core };
        let bvh = baked(&core);
        let radius = if is_tangent { length } else { radius };
        let shape = bvh.all().rounded(radius).unwrap();
        if is_tangent {
            (origin, direction) = (sum(sum(core[0][0], vector), tangent.map(|x| -2.0 * x)), tangent);
        }
        let until = if is_tangent || round % 3 == 0 { 64.0 } else { random.below(8) as f64 };
        let end = [0, 1, 2].map(|k| origin[k] + until * direction[k]);
        let segment = [origin, end, end];
        let lengths: Vec<Length> = core.iter().map(|triangle| Length::between(triangle, &segment)).collect();
        let order = lengths.iter().map(|length| length.compare(radius)).min().unwrap();
        let ray = Ray::new(origin, direction).until(until);
        let distance = |t: f64| {
            let point = [0, 1, 2].map(|k| origin[k] + t * direction[k]);
            core.iter().map(|triangle| point_triangle(point, triangle)).fold(f64::INFINITY, f64::min)
        };
        for querier in &mut queriers {
            assert_eq!(querier.any_hit(shape, &ray).unwrap(), order.is_le(), "{core:?} {ray:?} {radius}");
            assert_eq!(querier.segment_hit(shape, origin, end).unwrap(), order.is_le());
            let first = querier.first_hit(shape, &ray).unwrap();
            assert_eq!(first.is_some(), order.is_le());
            if let Some(hit) = first {
                assert!(hit.lower <= hit.t && hit.t <= hit.upper && hit.upper <= until, "{hit:?}");
                for part in (0..20).filter(|_| hit.t > 0.0) {
                    let outside = distance(hit.lower * f64::from(part) / 20.0);
                    assert!(outside >= radius - TOLERANCE, "{outside} {radius} {hit:?}");
                }
                assert!(hit.lower == 0.0 && hit.t == 0.0 || distance(hit.lower) >= radius - TOLERANCE);
                if order.is_lt() {
                    assert!(distance(hit.t) <= radius + 1e-9, "{hit:?} {radius} {}", distance(hit.t));
                }
            }
            if round % 3 == 0 {
                let endless = Ray::new(origin, direction);
                assert_eq!(querier.any_hit(shape, &endless).unwrap(), order.is_le());
                assert_eq!(querier.first_hit(shape, &endless).unwrap().is_some(), order.is_le());
            }
            assert_eq!(
                querier.all_hits(shape, &ray).unwrap().first().map(|hit| hit.t),
                first.map(|hit| hit.t)
            );
        }
        seen[(order as i8 + 1) as usize] += 1;
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}: tangents among them");
}

/// Cores much smaller than their radii, and much larger; and far away.
#[test]
fn radii_of_any_size_have_answers() {
    let mut queriers = queriers();
    let tiny = |x: f64| [[0.0, 0.0, 0.0], [x, 0.0, 0.0], [0.0, x, 0.0]];
    for core in [[[0.0; 3]; 3], tiny(1e-30), tiny(1.0), tiny(1e30)] {
        let bvh = baked(&[core]);
        for radius in [1e-60, 1e-30, 1.0, 1e10, 1e30, 2f64.powi(116)] {
            let shape = bvh.all().rounded(radius).unwrap();
            let size = radius + core[1][0];
            for querier in &mut queriers {
                // From beside the core, along the axis that the triangle has no extent in.
                for (from, is_hit) in [(4.0 * size, true), (-4.0 * size, false)] {
                    let ray = Ray::new([0.0, 0.0, from], [0.0, 0.0, -1.0]);
                    let hit = querier.first_hit(shape, &ray).unwrap();
                    assert_eq!(hit.is_some(), is_hit, "{core:?} {radius} from {from}");
                    assert_eq!(querier.any_hit(shape, &ray).unwrap(), is_hit);
                    if let Some(hit) = hit {
                        let expected = from - radius;
                        assert!((hit.t - expected).abs() <= 1e-9 * from, "{core:?} {radius}: {hit:?}");
                        assert!(
                            hit.lower <= expected * (1.0 + 1e-15) && expected * (1.0 - 1e-15) <= hit.upper
                        );
                    }
                    let end = [0.0, 0.0, -from];
                    assert!(querier.segment_hit(shape, [0.0, 0.0, from], end).unwrap());
                }
                let beside = Ray::new([-4.0 * size, 1.5 * size, 0.0], [1.0, 0.0, 0.0]);
                let (above, reach) = (1.5 * size, core[2][1] + radius);
                assert_eq!(querier.any_hit(shape, &beside).unwrap(), above <= reach, "{core:?} {radius}");
                assert_eq!(querier.side(shape, [0.0, 0.0, radius / 2.0]).unwrap(), Side::Inside);
                assert_eq!(querier.side(shape, [0.0, 0.0, radius]).unwrap(), Side::On);
                assert_eq!(querier.side(shape, [0.0, 0.0, 2.0 * radius]).unwrap(), Side::Outside);
                let closest = querier.closest_point(shape, [0.0, 0.0, 3.0 * radius], f64::INFINITY);
                assert!((closest.unwrap().unwrap().distance - 2.0 * radius).abs() <= 1e-15 * radius);
                let pose = translation(0.0, 0.0, 2.0 * radius);
                assert!(querier.collide(shape, shape, &pose).unwrap(), "{core:?} {radius}");
                let pose = translation(0.0, 0.0, 3.0 * radius);
                assert!(!querier.collide(shape, shape, &pose).unwrap(), "{core:?} {radius}");
                let found = querier.distance(shape, shape, &pose).unwrap();
                assert!((found.distance - radius).abs() <= 1e-14 * radius, "{core:?} {radius}: {found:?}");
            }
        }
    }
}

/// Rays that graze long slivers: all before `lower` is outside, and at `upper` the ray is inside, unless it only grazes.
#[test]
fn bounds_of_hits_hold_for_slivers() {
    let mut queriers = queriers();
    let mut random = Random::new(11);
    let mut hits = 0;
    for _ in 0..cbvh_testkit::depth::rounds(400) {
        let (from, along) = (random.point().map(|x| 500.0 * x), random.point().map(|x| 1000.0 * x));
        let thin = 10f64.powi(-(random.below(12) as i32));
        let corner = |share: f64, random: &mut Random| {
            let off = random.point();
            [0, 1, 2].map(|k| f64::from((from[k] + share * along[k] + thin * off[k]) as f32))
        };
        let core = [corner(0.0, &mut random), corner(1.0, &mut random), corner(random.unit(), &mut random)];
        let bvh = baked(&[core]);
        let radius = 10f64.powi(-(random.below(4) as i32));
        let shape = bvh.all().rounded(radius).unwrap();
        // Past a point of the sliver, about as far away as the radius.
        let share = random.unit();
        let goal = [0, 1, 2].map(|k| core[0][k] + share * (core[1][k] - core[0][k]));
        let away = random.point().map(|x| radius * x * (1.0 + 1e-9 * random.signed()));
        let direction = random.point();
        let origin = [0, 1, 2].map(|k| goal[k] + away[k] - 3.0 * direction[k]);
        let ray = Ray::new(origin, direction);
        let exactly = |t: f64| {
            let point = [0, 1, 2].map(|k| origin[k] + t * direction[k]);
            Length::between(&core, &[point; 3])
        };
        let mut first = None;
        for querier in &mut queriers {
            let hit = querier.first_hit(shape, &ray).unwrap();
            assert_eq!(hit, *first.get_or_insert(hit), "{}", querier.backend());
            assert_eq!(querier.any_hit(shape, &ray).unwrap(), hit.is_some());
        }
        let Some(hit) = first.flatten() else { continue };
        hits += 1;
        // Three terms of up to 1,000 are each rounded twice: 2^-52 of 3,000.
        let slack = 1e-12;
        for part in 0..=10 {
            let before = exactly(hit.lower * f64::from(part) / 10.0);
            assert!(hit.lower == 0.0 || before.compare(radius - slack).is_ge(), "{core:?} {ray:?} {hit:?}");
        }
        assert!(hit.lower <= hit.t && hit.t <= hit.upper, "{hit:?}");
    }
    assert!(hits > 100, "{hits}");
}
