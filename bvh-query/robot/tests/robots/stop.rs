//! Checks that a flag stops questions about robots: before they begin, from another thread, and in clones; and that answers are complete
//! afterwards.

use crate::questions::{block, cell, random_values};
use bvh_query::{Backend, MotionOptions, PenetrationOptions, Pose, QueryError, Stop};
use cbvh_robot::{Base, Edge, Robot, RobotError};
use cbvh_testkit::Random;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

fn flag(is_set: bool) -> Arc<AtomicBool> {
    Arc::new(AtomicBool::new(is_set))
}

fn stopped<T>(answer: Result<T, RobotError>) -> bool {
    matches!(answer, Err(RobotError::Query(QueryError::Stopped)))
}

/// All answers about some rows, as text.
fn all(robot: &mut Robot, rows: &[Vec<f64>]) -> Result<String, RobotError> {
    let (flat, options) = (rows.concat(), MotionOptions::new());
    let edges: Vec<Edge> = rows.windows(2).map(|of| Edge::straight(&of[0], &of[1]).unwrap()).collect();
    let path = rows.iter().map(Vec::as_slice);
    let found = (
        robot.collide_many(&flat)?,
        robot.distance_many(&flat)?,
        robot.pairs_in_contact_many(&flat)?,
        robot.near_pairs_many(&flat, 0.2, &PenetrationOptions::new())?,
        robot.are_free(&edges, &options)?,
        robot.motions(&edges, &options)?,
        robot.first_hit(path, &options)?,
    );
    Ok(format!("{found:?}"))
}

#[test]
fn a_question_that_is_stopped_does_not_begin() {
    let mut robot = cell(Base::Fixed);
    let q = random_values(&mut Random::new(1), &robot);
    let (edge, depth) = (Edge::straight(&q, &q).unwrap(), PenetrationOptions::new());
    let stop = flag(true);
    robot.set_stop(Some(stop.clone()));
    let refuses = |robot: &mut Robot| {
        assert!(stopped(robot.collide(&q)));
        assert!(stopped(robot.collide_many(&[&q[..], &q].concat())));
        assert!(stopped(robot.distance(&q)));
        assert!(stopped(robot.signed_distance(&q, &depth)));
        assert!(stopped(robot.pairs_in_contact(&q)));
        assert!(stopped(robot.pairs_inside(&q)));
        assert!(stopped(robot.near_pairs(&q, 0.1, &depth)));
        assert!(stopped(robot.is_free(&q, &q)));
        assert!(stopped(robot.motion(&edge, &MotionOptions::new())));
        assert!(stopped(robot.motions(&[edge.clone(), edge.clone()], &MotionOptions::new())));
        assert!(stopped(robot.allow_frequent(10, 0.5)));
    };
    refuses(&mut robot);
    refuses(&mut robot.clone());
    let mut other = cell(Base::Fixed);
    other.clone_from(&robot);
    refuses(&mut other);
    robot.set_backend(Backend::Scalar);
    refuses(&mut robot);
    stop.store(false, Ordering::Relaxed);
    let expected = cell(Base::Fixed).distance(&q).unwrap();
    assert_eq!(robot.distance(&q).unwrap(), expected);
    assert_eq!(other.distance(&q).unwrap(), expected);
    stop.store(true, Ordering::Relaxed);
    robot.set_stop(None);
    assert_eq!(robot.distance(&q).unwrap(), expected);
}

#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads here")]
fn another_thread_stops_questions_under_way() {
    let random = &mut Random::new(2);
    let rows: Vec<_> = (0..40).map(|_| random_values(random, &cell(Base::Fixed))).collect();
    let expected = all(&mut cell(Base::Fixed), &rows).unwrap();
    // One robot for all: what questions that were stopped leave must not affect the answers of later ones.
    let (mut robot, stop, mut ended) = (cell(Base::Fixed), flag(false), 0);
    for after in [1usize, 10, 30, 60, 100, 150, 200, 300, 500, 1000, 2000] {
        let (of_thread, reads) = (stop.clone(), AtomicUsize::new(0));
        let stop_later = move || {
            if reads.fetch_add(1, Ordering::Relaxed) == after {
                let stop = of_thread.clone();
                std::thread::spawn(move || stop.store(true, Ordering::Relaxed)).join().unwrap();
            }
            of_thread.is_set()
        };
        robot.set_stop(Some(Arc::new(stop_later)));
        for threads in [1, 2] {
            cbvh_testkit::pool(threads).install(|| {
                let found = all(&mut robot, &rows);
                if stop.is_set() {
                    assert!(stopped(found), "after {after}");
                    ended += 1;
                } else {
                    assert_eq!(found.unwrap(), expected);
                }
            });
        }
        stop.store(false, Ordering::Relaxed);
        assert_eq!(all(&mut robot, &rows).unwrap(), expected, "after {after}");
    }
    assert!(ended >= 10, "{ended}");
}

/// What is kept of the surroundings is computed within questions, of which some are stopped.
#[test]
fn what_is_kept_stays_right_when_questions_are_stopped() {
    let random = &mut Random::new(3);
    let surrounded = || {
        let mut robot = cell(Base::Fixed);
        let random = &mut Random::new(4);
        for number in 0..20 {
            let at = random.point().map(|x| 0.9 * x);
            let pose = Pose::from_quaternion(random.quaternion(), at).unwrap();
            robot.add_obstacle(format!("block{number}"), block([0.1, 0.05, 0.2]), &pose).unwrap();
        }
        robot
    };
    let (mut fresh, mut robot) = (surrounded(), surrounded());
    let (mut ended, mut free) = (0, 0);
    for round in 0..150 {
        let [from, to] = [(); 2].map(|()| random_values(random, &fresh));
        let reads = AtomicUsize::new(0);
        robot.set_stop(Some(Arc::new(move || reads.fetch_add(1, Ordering::Relaxed) >= round % 40)));
        ended += u32::from(stopped(robot.is_free(&from, &to)));
        robot.set_stop(None);
        let expected = fresh.is_free(&from, &to).unwrap();
        assert_eq!(robot.is_free(&from, &to).unwrap(), expected);
        free += u32::from(expected);
    }
    assert!(ended > 30 && (5..145).contains(&free), "{ended} {free}");
}
