//! Times certain edges of an arm among boxes and cylinders, and prints a hash of all answers, to compare two builds.
//!
//! ```text
//! taskset -c 0 cargo bench --bench edges -- URDF SRDF PACKAGES EDGES [ROUNDS]
//! ```
//!
//! `src/scenes.rs` says what is in EDGES. The fastest of some rounds counts for each scene, after a first one, which is told as well.

use bvh_benches::scenes::{Scene, arm, read};
use bvh_query::MotionOptions;
use cbvh_robot::{Edge, Robot};
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::hint::black_box;
use std::time::Instant;

/// States of an edge that a validator at intervals looks at.
const STATES: usize = 32;

/// Returns how long something takes, in seconds.
fn time(what: impl FnOnce()) -> f64 {
    let start = Instant::now();
    what();
    start.elapsed().as_secs_f64()
}

/// Returns the fastest of some rounds.
fn fastest(rounds: usize, mut what: impl FnMut()) -> f64 {
    (0..rounds).map(|_| time(&mut what)).fold(f64::INFINITY, f64::min)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [urdf, srdf, packages, edges, rounds @ ..] = &arguments[..] else {
        eprintln!("usage: edges URDF SRDF PACKAGES EDGES [ROUNDS]");
        std::process::exit(2);
    };
    let rounds: usize = rounds.first().map_or(5, |rounds| rounds.parse().expect("a number of rounds"));
    let arm = arm([urdf, srdf, packages]);
    let text = std::fs::read_to_string(edges).expect("a file of edges");
    let mut hash = DefaultHasher::new();
    let mut times = [0.0; 6];
    let mut counts = [0usize; 3];
    for Scene { mut robot, configurations, edges, .. } in read(&text, &arm) {
        let ask =
            |robot: &mut Robot, [start, goal]: &[Vec<f64>; 2]| robot.is_free(start, goal).expect("an answer");
        let mut free = Vec::new();
        times[0] += time(|| free = edges.iter().map(|edge| ask(&mut robot, edge)).collect());
        for (place, is_free) in [(1, true), (2, false)] {
            let some: Vec<_> = edges.iter().zip(&free).filter(|(_, free)| **free == is_free).collect();
            counts[place - 1] += some.len();
            times[place] += fastest(rounds, || {
                for (edge, _) in &some {
                    black_box(ask(&mut robot, edge));
                }
            });
        }
        counts[2] += configurations.len();
        let collide = |robot: &mut Robot, joints: &[f64]| robot.collide(joints).expect("an answer");
        times[3] += fastest(rounds, || {
            for joints in &configurations {
                black_box(collide(&mut robot, joints));
            }
        });
        times[4] += fastest(1, || {
            for [start, goal] in &edges {
                for state in 0..STATES {
                    let share = (state as f64 + 0.5) / STATES as f64;
                    let at: Vec<f64> = start.iter().zip(goal).map(|(a, b)| a + share * (b - a)).collect();
                    black_box(collide(&mut robot, &at));
                }
            }
        });
        let options = MotionOptions::default();
        for ([start, goal], free) in edges.iter().zip(&free) {
            let edge = Edge::straight(start, goal).expect("as many values");
            let mut motion = String::new();
            times[5] += time(|| motion = format!("{:?}", robot.motion(&edge, &options).expect("an answer")));
            (free, motion).hash(&mut hash);
        }
        for joints in &configurations {
            collide(&mut robot, joints).hash(&mut hash);
        }
    }
    let [free, hits, asked] = counts.map(|count| count.max(1) as f64);
    let micros = times.map(|seconds| 1e6 * seconds);
    let all = free + hits;
    println!("answers {:016x}; {} edges free, {} not", hash.finish(), counts[0], counts[1]);
    println!(
        "an edge, us: {:.1} in the mean, {:.1} free, {:.1} not free",
        (micros[1] + micros[2]) / all,
        micros[1] / free,
        micros[2] / hits
    );
    println!("an edge the first time: {:.1}; its first hit: {:.1}", micros[0] / all, micros[5] / all);
    println!("a configuration: {:.2}; {STATES} states of an edge: {:.1}", micros[3] / asked, micros[4] / all);
}
