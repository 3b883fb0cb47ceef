//! Certified motions: against the plain walk over cells of time that defines them, to the bit; and against poses along the way.

use crate::common::shapes::{cube, plate, sphere, torus};
use crate::common::{
    Random, Triangle, bake, baked, fcl_pair, note, queriers, random_pose, shared_mesh, translation as at,
};
use bvh_bake::mesh::Mesh;
use bvh_query::{
    Bvh, Motion, MotionAnswer, MotionOptions, NumberError, Polyline, Pose, PoseError, Querier, QueryError,
    RelativePath, RigidPath, displacement, path_reach,
};
use cbvh_testkit::depth::rounds;

/// The definition: cells in the order of time, each decided in its middle.
fn plain(
    querier: &mut Querier,
    (a, b): (&Bvh, &Bvh),
    path: &dyn RigidPath,
    (clearance, tolerance): (f64, f64),
) -> MotionAnswer {
    let hit = |querier: &mut Querier, free_until: f64, touching_at: f64| {
        let nearest = querier.distance(a, b, &path.pose(touching_at)).unwrap();
        MotionAnswer::Hit { free_until, touching_at, nearest }
    };
    if querier.within(a, b, &path.pose(0.0), clearance).unwrap() {
        return hit(querier, 0.0, 0.0);
    }
    let mut undecided: Option<(f64, f64)> = None;
    let mut todo = vec![(0.0, 1.0)];
    while let Some((t0, t1)) = todo.pop() {
        let middle = t0 + (t1 - t0) / 2.0;
        let reach = path_reach(b, path, t0, t1);
        if reach > tolerance / 8.0 {
            todo.extend([(middle, t1), (t0, middle)]);
            continue;
        }
        let pose = path.pose(middle);
        if !querier.within(a, b, &pose, (clearance + reach).next_up()).unwrap() {
            continue;
        }
        if querier.within(a, b, &pose, clearance).unwrap() {
            return hit(querier, undecided.map_or(t0, |(free_until, _)| free_until), middle);
        }
        undecided.get_or_insert((t0, middle));
    }
    let Some((free_until, at)) = undecided else { return MotionAnswer::Free };
    if querier.within(a, b, &path.pose(1.0), clearance).unwrap() {
        return hit(querier, free_until, 1.0);
    }
    let nearest = querier.distance(a, b, &path.pose(at)).unwrap();
    MotionAnswer::Near { free_until, at, nearest }
}

/// A path of a user: B swings on an arm.
struct Pendulum {
    length: f64,
}

impl RigidPath for Pendulum {
    fn pose(&self, t: f64) -> Pose {
        let angle = 2.0 * (t - 0.5);
        let (sine, cosine) = angle.sin_cos();
        let rotation = [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]];
        Pose::new(rotation, [-self.length * sine, 0.0, -self.length * cosine]).unwrap()
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let angle = 2.0 * (t1 - t0);
        (self.length + radius) * (angle * angle / 8.0 + 1e-12)
    }
}

#[test]
fn answers_are_those_of_the_definition() {
    let random = &mut Random::new(15);
    let shapes: Vec<Bvh> = [cube(), plate(4), sphere(2), torus(12, 6)].iter().map(|t| baked(t)).collect();
    let mut queriers = queriers();
    let mut kinds = [0; 3];
    for round in 0..rounds(60) {
        let mut pick = || if round % 10 == 3 { &shapes[0] } else { &shapes[random.below(shapes.len())] };
        let (a, b) = (pick(), pick());
        let spread = [2.5, 4.0][round as usize % 2];
        let mut pose = || random_pose(random, spread);
        let [start, middle, end] = [pose(), pose(), pose()];
        let (p, d) = (random.point(), random.point());
        // Along a face, at a gap that the tolerance does not resolve.
        let gap = 2.0 + 0.02 * random.signed().abs();
        let path: Box<dyn RigidPath> = match round % 5 {
            0 => Box::new(Motion::screw(&start, p, d, 7.0 * random.signed(), random.signed()).unwrap()),
            1 => Box::new(Polyline::new(&[start, middle, end]).unwrap()),
            3 if a.objects()[0].triangles() == 12 && b.objects()[0].triangles() == 12 => {
                Box::new(Motion::between(&at(-3.0, gap, 0.1), &at(3.0, gap, 0.2)).unwrap())
            }
            2 => Box::new(Pendulum { length: 3.0 * random.signed().abs() }),
            _ => Box::new(Motion::between(&start, &end).unwrap()),
        };
        // A coarse tolerance makes cells few, and near answers likely.
        let tolerance = [0.02, 0.2][random.below(2)];
        let clearance = [0.0, 0.3][random.below(2)];
        let expected = plain(&mut queriers[0], (a, b), &*path, (clearance, tolerance));
        let options = MotionOptions::new().clearance(clearance).tolerance(tolerance);
        for querier in &mut queriers {
            let answer = querier.motion(a, b, &*path, &options).unwrap();
            assert_eq!(answer, expected, "round {round}, {:?}", querier.backend());
            let is_free = querier.is_free(a, b, &*path, &options).unwrap();
            assert_eq!(is_free, expected == MotionAnswer::Free, "round {round}, {:?}", querier.backend());
        }
        kinds[match expected {
            MotionAnswer::Free => 0,
            MotionAnswer::Hit { .. } => 1,
            MotionAnswer::Near { .. } => 2,
        }] += 1;
    }
    assert!(kinds.iter().all(|&count| count > 0), "{kinds:?}");
}

/// Checks an answer by contact in poses along the way. Returns whether it was a hit.
fn check(
    querier: &mut Querier,
    (a, b): (&Bvh, &Bvh),
    path: &dyn RigidPath,
    samples: u32,
    what: &str,
) -> bool {
    let free_until = match querier.motion(a, b, path, &MotionOptions::new()).unwrap() {
        MotionAnswer::Free => 1.0 + f64::EPSILON,
        MotionAnswer::Hit { free_until, touching_at, nearest } => {
            assert!(
                querier.collide(a, b, &path.pose(touching_at)).unwrap(),
                "{what}: no contact at {touching_at}"
            );
            assert_eq!(nearest.distance, 0.0);
            assert!(free_until <= touching_at);
            free_until
        }
        MotionAnswer::Near { free_until, at, nearest } => {
            assert!(nearest.distance > 0.0 && at >= free_until, "{what}");
            free_until
        }
    };
    for step in 0..=samples {
        let t = f64::from(step) / f64::from(samples);
        if t < free_until {
            assert!(!querier.collide(a, b, &path.pose(t)).unwrap(), "{what}: contact at {t} of {free_until}");
        }
    }
    // Just before the end of the free way, too.
    if free_until > 0.0 {
        assert!(!querier.collide(a, b, &path.pose((free_until * (1.0 - 1e-15)).min(1.0))).unwrap(), "{what}");
    }
    free_until <= 1.0
}

#[test]
fn random_motions_are_free_where_they_say_so() {
    let random = &mut Random::new(16);
    let shapes: Vec<Bvh> = [sphere(3), torus(24, 12), plate(4)].iter().map(|t| baked(t)).collect();
    let mut querier = Querier::new().unwrap();
    let (mut hits, mut all) = (0, 0);
    for round in 0..rounds(150) {
        let (a, b) = (&shapes[random.below(shapes.len())], &shapes[random.below(shapes.len())]);
        let (start, end) = (random_pose(random, 3.0), random_pose(random, 3.0));
        let motion = Motion::between(&start, &end).unwrap();
        hits += u32::from(check(&mut querier, (a, b), &motion, 200, &format!("round {round}")));
        all += 1;
    }
    assert!(hits > all / 10 && hits < all, "{hits} of {all}");
}

#[test]
fn random_motions_of_meshes_are_free_where_they_say_so() {
    random_motions(&mut Random::new(19), "fcl", fcl_pair());
}

#[test]
#[ignore = "needs ../shared"]
fn random_motions_of_large_meshes_are_free_where_they_say_so() {
    let random = &mut Random::new(20);
    for (name_a, name_b) in [("bunny", "bunny"), ("apollo", "apollo"), ("a1", "hand")] {
        let meshes = [name_a, name_b].map(|name| shared_mesh(&format!("{name}.obj")));
        random_motions(random, &format!("{name_a} {name_b}"), meshes);
    }
}

/// Random ways of a pair of meshes past each other and through, each sampled at a thousand poses.
fn random_motions(random: &mut Random, name: &str, meshes: [Mesh; 2]) {
    let [a, b] = meshes.map(|mesh| bake(&mesh, &bvh_bake::Options::default()));
    let sphere = |bvh: &Bvh| bvh.objects()[0].bounding_sphere();
    let ((centre_a, radius_a), (centre_b, radius_b)) = (sphere(&a), sphere(&b));
    // B's middle is somewhere around A's, a little more than both radii away at most.
    let mut place = || {
        let turned = random_pose(random, 1.0);
        let at = random.point().map(|v| 1.1 * (radius_a + radius_b) * v);
        let middle = turned.place(centre_b);
        let shift = [0, 1, 2].map(|k| centre_a[k] + at[k] - (middle[k] - turned.translation()[k]));
        Pose::new(*turned.rotation(), shift).unwrap()
    };
    let mut querier = Querier::new().unwrap();
    let (mut hits, all) = (0, rounds(3) as u32);
    for round in 0..all {
        let motion = Motion::between(&place(), &place()).unwrap();
        let what = format!("{name} {round}");
        hits += u32::from(check(&mut querier, (&a, &b), &motion, 1000, &what));
    }
    assert!(all < 100 || hits > all / 20 && hits < all - all / 20, "{hits} of {all}");
    note(&format!("{name}: {hits} of {all} random motions hit"));
}

/// Shapes whose answers are known: what samplers miss and what tolerances invent.
#[test]
fn hard_motions_have_their_answers() {
    let mut querier = Querier::new().unwrap();
    let scaled = |triangles: &[Triangle], by: [f64; 3]| -> Vec<Triangle> {
        triangles.iter().map(|t| t.map(|p| [0, 1, 2].map(|k| p[k] * by[k]))).collect()
    };
    // A bar turns all the way round and sweeps a thin post, which it meets for a ten-thousandth of the time.
    let bar = baked(&scaled(&cube(), [5.0, 1e-3, 1e-3]));
    let post = baked(&scaled(&cube(), [1e-3, 1e-3, 5.0]));
    let turn = |from: f64, radians: f64| {
        let start =
            Pose::from_quaternion([0.0, 0.0, (from / 2.0).sin(), (from / 2.0).cos()], [3.0, 0.0, 0.0])
                .unwrap();
        Motion::screw(&start, [3.0, 0.0, 0.0], [0.0, 0.0, 2.0], radians, 0.0).unwrap()
    };
    let whole = std::f64::consts::TAU;
    let Ok(MotionAnswer::Hit { touching_at, .. }) =
        querier.motion(&post, &bar, &turn(1.0, whole), &MotionOptions::new())
    else {
        panic!("the bar sweeps the post")
    };
    assert!((touching_at - (whole / 2.0 - 1.0) / whole).abs() < 1e-3, "{touching_at}");
    assert_eq!(querier.motion(&post, &bar, &turn(1.0, 0.5), &MotionOptions::new()), Ok(MotionAnswer::Free));

    let block = baked(&cube());
    for size in [1e-30, 1.0, 1e30] {
        let block = baked(&scaled(&cube(), [size; 3]));
        let moves = |from: [f64; 3], to: [f64; 3]| {
            let [from, to] = [from, to].map(|p| at(p[0] * size, p[1] * size, p[2] * size));
            Motion::between(&from, &to).unwrap()
        };
        let ask = |querier: &mut Querier, motion: &Motion| {
            querier.motion(&block, &block, motion, &MotionOptions::new()).unwrap()
        };
        // Straight through, though apart at both ends.
        let through = ask(&mut querier, &moves([-9.0, 0.0, 0.0], [9.0, 0.25, 0.5]));
        assert!(
            matches!(through, MotionAnswer::Hit { free_until, touching_at, .. }
            if free_until <= 7.0 / 18.0 && touching_at >= 7.0 / 18.0 - 1e-15 && touching_at - free_until < 1e-6),
            "{through:?}"
        );
        // Along a wall a millionth of the size away: free, and few steps.
        let slide = ask(&mut querier, &moves([-9.0, 2.000_001, 0.0], [9.0, 2.000_001, 0.5]));
        assert_eq!(slide, MotionAnswer::Free);
        assert!(querier.stats().node_tests < 2000, "{:?}", querier.stats());
        // Contact at the start, and at the end only.
        assert!(matches!(
            ask(&mut querier, &moves([2.0, 0.0, 0.0], [9.0, 0.0, 0.0])),
            MotionAnswer::Hit { free_until: 0.0, touching_at: 0.0, .. }
        ));
        assert!(matches!(
            ask(&mut querier, &moves([9.0, 0.0, 0.0], [2.0, 0.0, 0.0])),
            MotionAnswer::Hit { touching_at: 1.0, .. }
        ));
        // No motion at all.
        assert_eq!(ask(&mut querier, &moves([5.0, 0.0, 0.0], [5.0, 0.0, 0.0])), MotionAnswer::Free);
        assert!(matches!(
            ask(&mut querier, &moves([1.0, 0.0, 0.0], [1.0, 0.0, 0.0])),
            MotionAnswer::Hit { .. }
        ));
    }
    // Along all of a wall of many triangles, at gaps that f32 hardly resolves: free, and few steps.
    let wall = baked(&plate(16));
    for (what, one) in [("block", &block), ("wall", &wall)] {
        let height = if what == "block" { 2.0 } else { 0.0 };
        for gap in [1e-6, 3e-6, 1e-5] {
            let along = Motion::between(&at(-1.0, 0.0, height + gap), &at(1.0, 0.0, height + gap)).unwrap();
            assert_eq!(
                querier.motion(one, one, &along, &MotionOptions::new()),
                Ok(MotionAnswer::Free),
                "{what}"
            );
            let stats = querier.stats();
            assert!(stats.node_tests < 20_000 && stats.exact_tests < 200_000, "{what} {gap}: {stats:?}");
        }
    }
    // A clearance far above the size, beside which the reach of a cell all but vanishes.
    let sheet = baked(&[[[2f64.powi(20), 0.0, 0.0], [2f64.powi(20), 1.0, 0.0], [2f64.powi(20), 0.0, 1.0]]]);
    let spike = baked(&[[[0.0; 3], [-1.0, 0.0, 0.125], [-1.0, 0.125, 0.0]]]);
    let nearer = Motion::between(&at(-0.5, 0.25, 0.25), &at(0.0, 0.25, 0.25)).unwrap();
    let wide = MotionOptions::new().clearance(2f64.powi(20)).tolerance(2f64.powi(-34));
    let answer = querier.motion(&sheet, &spike, &nearer, &wide).unwrap();
    assert!(matches!(answer, MotionAnswer::Hit { touching_at, .. } if touching_at > 0.99), "{answer:?}");
    // A turn of 179.9 degrees beside another block: its corners come as near as its diagonal.
    let most = 179.9f64.to_radians() / 2.0;
    for (x, hits) in [(1.0 + 2f64.sqrt() + 1e-3, false), (1.0 + 2f64.sqrt() - 1e-3, true)] {
        let end = Pose::from_quaternion([0.0, 0.0, most.sin(), most.cos()], [x, 0.0, 0.0]).unwrap();
        let motion = Motion::between(&at(x, 0.0, 0.0), &end).unwrap();
        assert_eq!(check(&mut querier, (&block, &block), &motion, 1000, "turn"), hits);
    }
    // With a clearance, what passes near by is a hit.
    let by = Motion::between(&at(-9.0, 2.1, 0.0), &at(9.0, 2.1, 0.0)).unwrap();
    for (clearance, hits) in [(0.0, false), (0.099, false), (0.101, true)] {
        let answer = querier.motion(&block, &block, &by, &MotionOptions::new().clearance(clearance)).unwrap();
        assert_eq!(matches!(answer, MotionAnswer::Hit { .. }), hits, "{answer:?}");
        assert!(hits || answer == MotionAnswer::Free);
    }
    // Nearer than the tolerance, neither can be told.
    let near = Motion::between(&at(-9.0, 2.0 + 1e-9, 0.0), &at(9.0, 2.0 + 1e-9, 0.0)).unwrap();
    let answer = querier.motion(&block, &block, &near, &MotionOptions::new().tolerance(1e-2)).unwrap();
    assert!(matches!(answer, MotionAnswer::Near { nearest, .. } if nearest.distance <= 1e-2), "{answer:?}");
}

/// On any number of threads, a batch has the answers of the querier.
#[test]
#[cfg(feature = "parallel")]
fn batches_of_motions_have_the_same_answers() {
    let random = &mut Random::new(17);
    let (a, b) = (baked(&torus(24, 12)), baked(&sphere(2)));
    let motions: Vec<Motion> = (0..100)
        .map(|_| Motion::between(&random_pose(random, 4.0), &random_pose(random, 4.0)).unwrap())
        .collect();
    let (mut querier, options) = (Querier::new().unwrap(), MotionOptions::new().clearance(0.1));
    let expected: Vec<_> =
        motions.iter().map(|motion| querier.motion(&a, &b, motion, &options).unwrap()).collect();
    let free: Vec<bool> = expected.iter().map(|answer| *answer == MotionAnswer::Free).collect();
    assert!(free.contains(&true) && free.contains(&false));
    for threads in [1, 2] {
        let pool = cbvh_testkit::pool(threads);
        let batch = bvh_query::Batch::new(&a, &b).unwrap();
        assert_eq!(pool.install(|| batch.motions(&motions, &options)), Ok(expected.clone()));
        assert_eq!(pool.install(|| batch.are_free(&motions, &options)), Ok(free.clone()));
    }
}

/// As long as B moves by less than the least distance, it stays apart.
#[test]
fn a_distance_says_how_far_b_may_move() {
    let random = &mut Random::new(18);
    let (a, b) = (baked(&torus(24, 12)), baked(&sphere(2)));
    let mut querier = Querier::new().unwrap();
    let (mut safe, mut near) = (0, 0);
    for _ in 0..400 {
        let pose = random_pose(random, 4.0);
        let distance = querier.distance(&a, &b, &pose).unwrap();
        let end = random_pose(random, 4.0);
        let moved = Motion::between(&pose, &end).unwrap().pose(0.2 * random.signed().abs());
        if displacement(&b, &pose, &moved) < distance.lower {
            assert!(!querier.collide(&a, &b, &moved).unwrap());
            safe += 1;
        } else if !querier.collide(&a, &b, &moved).unwrap() {
            near += 1;
        }
    }
    assert!(safe > 20 && near > 20, "{safe} {near}");
}

/// Comes near for a moment, and then fast, on a path whose bound is lost by then.
struct Dip;

impl RigidPath for Dip {
    fn pose(&self, t: f64) -> Pose {
        let dip = 1.05 * (-((t - 0.5) / 0.02).powi(2)).exp();
        at(3.0 - dip - 40.0 * (t - 0.93).max(0.0), 0.0, 0.0)
    }

    fn sagitta(&self, _radius: f64, t0: f64, t1: f64) -> f64 {
        // The acceleration of the dip is at most 2.1 / 0.02^2.
        if t1 > 0.9 { f64::INFINITY } else { 5250.0 * (t1 - t0).powi(2) / 8.0 + 1e-12 }
    }
}

/// A guess that leads to a later contact, at which there is no answer, does not hide the earlier one.
#[test]
fn the_first_hit_is_found_before_what_has_no_answer() {
    let wall = baked(&[[[1.0, -1.0, -1.0], [1.0, 2.0, -1.0], [1.0, -1.0, 2.0]]]);
    let spike = baked(&[[[-1.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]]);
    for querier in &mut queriers() {
        let answer = querier.motion(&wall, &spike, &Dip, &MotionOptions::new());
        let Ok(MotionAnswer::Hit { free_until, touching_at, .. }) = answer else { panic!("{answer:?}") };
        assert!(free_until > 0.4955 && touching_at < 0.4957, "{free_until} {touching_at}");
        assert_eq!(querier.is_free(&wall, &spike, &Dip, &MotionOptions::new()), Ok(false));
    }
}

/// B slides beside a face at a fortieth of the reach of a cell, along eight million cells, none of which is clear.
#[test]
fn a_slide_beside_a_face_takes_few_visits() {
    let (block, gap) = (baked(&cube()), 2.0 + 1e-8);
    let slide = [at(-3.0, gap, 0.1), at(0.5, gap, 0.2)];
    let free = Polyline::new(&slide).unwrap();
    let into = Polyline::new(&[slide[0], slide[1], at(0.5, 1.5, 0.2)]).unwrap();
    for querier in &mut queriers() {
        querier.set_budget(1 << 13);
        let answer = querier.motion(&block, &block, &free, &MotionOptions::new());
        let Ok(MotionAnswer::Near { free_until, at, nearest }) = answer else { panic!("{answer:?}") };
        // The gap is 1e-8 but for the rounding of 2, and a cell is a ten-millionth of the way.
        assert!(nearest.distance > 0.99e-8 && at - free_until < 1e-6, "{answer:?}");
        // The first half of the other path is this one.
        let answer = querier.motion(&block, &block, &into, &MotionOptions::new());
        let Ok(MotionAnswer::Hit { free_until: until, touching_at, .. }) = answer else {
            panic!("{answer:?}")
        };
        assert!((until - free_until / 2.0).abs() < 1e-6 && touching_at > 0.5, "{answer:?}");
    }
}

/// A slide along a face across a gap that no rounded arithmetic resolves has the answer of exact arithmetic, in few visits: boxes in
/// decimal numbers of which one sum is rounded up, far from the origin too, in a scene, and by a path through several poses.
#[test]
fn parts_slide_across_a_gap_of_one_rounding() {
    let block = |low: [f64; 3], high: [f64; 3]| -> Vec<Triangle> {
        let scaled = |p: [f64; 3]| [0, 1, 2].map(|k| if p[k] > 0.0 { high[k] } else { low[k] });
        cube().iter().map(|triangle| triangle.map(scaled)).collect()
    };
    // 0.1 + 0.2 is a rounding more than 0.3, and 1000.2 + 1.7 one more than 1001.9.
    for (low, high, moved) in [(0.1, 0.3, 0.2), (1000.2, 1001.9, 1.7), (32.0, 33.0, 1.0 + 2f64.powi(-46))] {
        assert!(low + moved > high && low + moved < high * (1.0 + 1e-15), "a gap of a rounding");
        for axis in 0..3 {
            let along = (axis + 1) % 3;
            let part = block([low; 3], [high; 3]);
            let [mut inner, mut outer] = [[low; 3], [high; 3]];
            (inner[along], outer[along]) = (low - 2.0, low - 1.9);
            outer[axis] += 0.05;
            let mut stopped = part.clone();
            stopped.extend(block(inner, outer));
            let [free, stopped, slider] = [&part, &stopped, &part].map(|triangles| baked(triangles));
            let place = |by: f64| {
                let mut translation = [0.0; 3];
                (translation[axis], translation[along]) = (moved, by);
                at(translation[0], translation[1], translation[2])
            };
            let slide = Motion::between(&place(2.0), &place(-2.0)).unwrap();
            let through = Polyline::new(&[place(2.0), place(-1.0), place(-2.0)]).unwrap();
            let in_world = RelativePath::new(&Pose::IDENTITY, &slide);
            for querier in &mut queriers() {
                querier.set_budget(1 << 14);
                for path in [&slide as &dyn RigidPath, &through, &in_world] {
                    let answer = querier.motion(&free, &slider, path, &MotionOptions::new());
                    assert!(
                        matches!(answer, Ok(MotionAnswer::Near { nearest, .. }) if nearest.upper < 1e-6),
                        "{answer:?}"
                    );
                    let answer = querier.motion(&stopped, &slider, path, &MotionOptions::new());
                    let Ok(MotionAnswer::Hit { touching_at, .. }) = answer else { panic!("{answer:?}") };
                    let reached = path.pose(touching_at).translation()[along];
                    assert!((reached + 1.9).abs() < 0.2 + 1e-6 && reached < -1.6, "{answer:?}");
                }
                querier.set_budget(u64::MAX);
                let coarse = MotionOptions::new().tolerance(0.02);
                for (name, mesh) in [("free", &free), ("stopped", &stopped)] {
                    let answer = querier.motion(mesh, &slider, &slide, &coarse).unwrap();
                    let expected = plain(querier, (mesh, &slider), &slide, (0.0, 0.02));
                    assert_eq!(answer, expected, "{name}");
                }
            }
        }
    }
}

/// At gaps about as wide as a cell reaches, which is anything from half of an eighth of the tolerance to all of it.
#[test]
fn slides_at_gaps_about_as_wide_as_cells_reach_take_few_visits() {
    let block = baked(&cube());
    let tolerance = MotionOptions::new().tolerance_between(&block, &block);
    let mut found = [0; 2];
    for way in [3.0, 4.0, 5.3, 7.9] {
        for share in [0.4, 0.5, 0.55, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.1] {
            let gap = 2.0 + share * tolerance / 8.0;
            let slide = Motion::between(&at(0.3, gap, -way / 2.0), &at(0.3, gap, way / 2.0)).unwrap();
            for querier in &mut queriers() {
                querier.set_budget(1 << 13);
                let answer = querier.motion(&block, &block, &slide, &MotionOptions::new());
                match answer.unwrap_or_else(|error| panic!("{way} {share}: {error}")) {
                    MotionAnswer::Free => found[0] += 1,
                    MotionAnswer::Near { .. } => found[1] += 1,
                    hit @ MotionAnswer::Hit { .. } => panic!("{hit:?}"),
                }
                querier.set_budget(u64::MAX);
                let coarse = querier.motion(&block, &block, &slide, &MotionOptions::new().tolerance(0.02));
                assert_eq!(coarse.unwrap(), plain(querier, (&block, &block), &slide, (0.0, 0.02)), "{way}");
            }
        }
    }
    assert!(found.iter().all(|&count| count > 10), "{found:?}");
}

#[test]
fn numbers_that_mean_nothing_are_refused() {
    let (mut querier, block) = (Querier::new().unwrap(), baked(&cube()));
    let motion = Motion::between(&at(9.0, 0.0, 0.0), &at(-9.0, 0.0, 0.0)).unwrap();
    let mut refused = |options: MotionOptions| match querier.motion(&block, &block, &motion, &options) {
        Err(QueryError::Number(wrong)) => wrong,
        other => panic!("{other:?}"),
    };
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(matches!(refused(MotionOptions::new().clearance(wrong)), NumberError::Clearance(_)));
        assert!(matches!(refused(MotionOptions::new().tolerance(wrong)), NumberError::Tolerance(_)));
    }
    assert_eq!(refused(MotionOptions::new().tolerance(0.0)), NumberError::Tolerance(0.0));
    assert_eq!(refused(MotionOptions::new().tolerance(1e-18)), NumberError::Unresolved(1e-18));
    // A path of a user whose bound is no number leaves nothing certain.
    struct Unbounded(f64);
    impl RigidPath for Unbounded {
        fn pose(&self, t: f64) -> Pose {
            at(9.0 + t, 0.0, 0.0)
        }
        fn sagitta(&self, _radius: f64, _t0: f64, _t1: f64) -> f64 {
            self.0
        }
    }
    for wrong in [f64::NAN, -1.0, f64::INFINITY] {
        let answer = querier.motion(&block, &block, &Unbounded(wrong), &MotionOptions::new());
        assert!(matches!(answer, Err(QueryError::Number(NumberError::Unresolved(_)))), "{answer:?}");
    }
    let bent = querier.motion(&block, &block, &Unbounded(1e-9), &MotionOptions::new());
    assert_eq!(bent, Ok(MotionAnswer::Free));
    querier.set_budget(10);
    let answer = querier.motion(&block, &block, &motion, &MotionOptions::new());
    assert_eq!(answer, Err(QueryError::Budget { visits: 10 }));
    let half = Pose::from_quaternion([0.0, 0.0, 1.0, 0.0], [0.0; 3]).unwrap();
    assert!(matches!(Motion::between(&Pose::IDENTITY, &half), Err(PoseError::HalfTurn(_))));
}

/// At a time without a relative pose, neither a hit nor a free path is certain.
#[test]
fn poses_too_far_apart_for_a_relative_one_are_no_contact() {
    /// A body in its place, but for a part of the time.
    struct Lost {
        home: f64,
        far: f64,
        times: [f64; 2],
    }
    impl RigidPath for Lost {
        fn pose(&self, t: f64) -> Pose {
            let [from, to] = self.times;
            at(if (from..to).contains(&t) { self.far } else { self.home }, 0.0, 0.0)
        }
        fn sagitta(&self, _radius: f64, t0: f64, t1: f64) -> f64 {
            let [from, to] = self.times;
            if t1 < from || t0 >= to { 1e-9 } else { f64::INFINITY }
        }
    }
    let block = baked(&cube());
    for times in [[0.0, 0.25], [0.4, 0.6], [0.9, 2.0]] {
        let a = Lost { home: 0.0, far: -2f64.powi(120), times };
        let b = Lost { home: 9.0, far: 2f64.powi(120), times };
        let path = RelativePath::new(&a, &b);
        for querier in &mut queriers() {
            let answer = querier.motion(&block, &block, &path, &MotionOptions::new());
            let is_refused = matches!(answer, Err(QueryError::Number(NumberError::Unresolved(_))));
            assert!(is_refused, "{times:?}: {answer:?}");
            let is_free = querier.is_free(&block, &block, &path, &MotionOptions::new());
            let is_refused = matches!(is_free, Err(QueryError::Number(NumberError::Unresolved(_))));
            assert!(is_refused, "{times:?}: {is_free:?}");
        }
    }
}

/// Paths that break their promise: answers about them are as wrong as they are, but they end.
#[test]
fn a_path_that_jumps_keeps_no_question_busy() {
    struct Jump {
        to: f64,
        sagitta: f64,
    }
    impl RigidPath for Jump {
        fn pose(&self, t: f64) -> Pose {
            at(if t < 0.3 { 9.0 } else { self.to }, 0.0, 0.0)
        }
        fn sagitta(&self, _radius: f64, _t0: f64, _t1: f64) -> f64 {
            self.sagitta
        }
    }
    let block = baked(&cube());
    for querier in &mut queriers() {
        querier.set_budget(1 << 20);
        for (to, sagitta) in
            [(0.0, 0.0), (-9.0, 0.0), (0.0, 1e-3), (0.0, f64::INFINITY), (8.0, f64::INFINITY)]
        {
            let jump = Jump { to, sagitta };
            let answer = querier.motion(&block, &block, &jump, &MotionOptions::new());
            let is_unresolved = matches!(answer, Err(QueryError::Number(NumberError::Unresolved(_))));
            assert!(is_unresolved, "{to}: {answer:?}");
            let is_free = querier.is_free(&block, &block, &jump, &MotionOptions::new());
            assert!(!matches!(is_free, Err(QueryError::Budget { .. })), "{to}: {is_free:?}");
        }
    }
}
