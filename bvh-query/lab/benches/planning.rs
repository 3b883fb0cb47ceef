//! Plans paths of an arm among boxes and cylinders by RRT-Connect, whose edges are certainly free, and times it.
//!
//! ```text
//! taskset -c 1 cargo bench --bench planning -- URDF SRDF PACKAGES EDGES ENDS [SEEDS [PATHS]]
//! ```
//!
//! `src/scenes.rs` says what is in EDGES. ENDS has a line for each scene: its kind and number, and the first joint values of the start
//! and of the goal. PATHS is written for `planning.py`, which checks paths: for each path a line `kind number seed states`, and then a
//! line for each state.
//!
//! The planner works as OMPL's (Kuffner, LaValle, ICRA 2000), with the same range, a fifth of the extent of the space, but with other random
//! numbers. Only the joints with given values move; the fingers, the last joint, are open. Each path is planned twice: with a robot that
//! knows nothing of the scene, and then with the same one, which has kept how far obstacles are away.

use bvh_benches::scenes::{Scene, arm, numbers, read};
use cbvh_robot::Robot;
use cbvh_testkit::Random;
use std::collections::HashMap;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// The longest edge, as a part of the extent of the space.
const RANGE: f64 = 0.2;
/// The joint after those that move: open fingers.
const OPEN: f64 = 0.04;
/// Edges after which no path is expected any more.
const MOST_EDGES: usize = 1 << 20;

/// Configurations that are connected by free edges. The first one is the root.
struct Tree {
    size: usize,
    /// The values of all, one after the other: every new target is compared with all of them.
    values: Vec<f64>,
    /// The configuration at the other end of the edge to each.
    before: Vec<usize>,
}

/// How far a tree has come to a target.
enum Grown {
    Stuck,
    Nearer,
    There,
}

impl Tree {
    fn new(root: &[f64]) -> Self {
        Self { size: root.len(), values: root.to_vec(), before: vec![0] }
    }

    fn at(&self, place: usize) -> &[f64] {
        &self.values[place * self.size..][..self.size]
    }

    fn last(&self) -> usize {
        self.before.len() - 1
    }

    /// Returns the nearest configuration, and how far away it is.
    fn nearest(&self, target: &[f64]) -> (usize, f64) {
        let mut nearest = (0, f64::INFINITY);
        for (place, of) in self.values.chunks_exact(self.size).enumerate() {
            let squared: f64 = of.iter().zip(target).map(|(a, b)| (a - b) * (a - b)).sum();
            if squared < nearest.1 {
                nearest = (place, squared);
            }
        }
        (nearest.0, nearest.1.sqrt())
    }

    fn add(&mut self, values: &[f64], before: usize) {
        self.values.extend_from_slice(values);
        self.before.push(before);
    }

    /// Returns the configurations from the last one back to the root.
    fn back(&self) -> Vec<Vec<f64>> {
        let mut place = self.last();
        let mut path = vec![self.at(place).to_vec()];
        while place != 0 {
            place = self.before[place];
            path.push(self.at(place).to_vec());
        }
        path
    }
}

/// A problem, and what its solution has taken so far.
struct Planner<'a> {
    robot: &'a mut Robot,
    limits: &'a [[f64; 2]],
    range: f64,
    edges: usize,
    /// The time of the questions about edges.
    asked: Duration,
}

impl Planner<'_> {
    fn is_free(&mut self, from: &[f64], to: &[f64]) -> bool {
        let start = Instant::now();
        let is_free = self.robot.is_free(from, to).expect("an answer");
        self.edges += 1;
        self.asked += start.elapsed();
        is_free
    }

    fn grow(&mut self, tree: &mut Tree, target: &[f64]) -> Grown {
        let (near, distance) = tree.nearest(target);
        let from = tree.at(near);
        let is_there = distance <= self.range;
        let to: Vec<f64> = match is_there {
            true => target.to_vec(),
            false => from.iter().zip(target).map(|(a, b)| a + self.range / distance * (b - a)).collect(),
        };
        if !self.is_free(from, &to) {
            return Grown::Stuck;
        }
        tree.add(&to, near);
        if is_there { Grown::There } else { Grown::Nearer }
    }

    /// Returns a path, or none after too many edges.
    fn plan(&mut self, [start, goal]: &[Vec<f64>; 2], random: &mut Random) -> Option<Vec<Vec<f64>>> {
        let mut trees = [start, goal].map(|end| Tree::new(end));
        let mut is_reversed = false;
        while self.edges < MOST_EDGES {
            let target: Vec<f64> =
                self.limits.iter().map(|[low, high]| low + random.unit() * (high - low)).collect();
            let [grown, other] = &mut trees;
            if !matches!(self.grow(grown, &target), Grown::Stuck) {
                let target = grown.at(grown.last()).to_vec();
                let end = loop {
                    match self.grow(other, &target) {
                        Grown::Nearer => {}
                        end => break end,
                    }
                };
                if matches!(end, Grown::There) {
                    let [mut path, rest] = [grown, other].map(|tree| tree.back());
                    path.reverse();
                    path.extend(rest.into_iter().skip(1));
                    if is_reversed {
                        path.reverse();
                    }
                    return Some(path);
                }
            }
            trees.reverse();
            is_reversed = !is_reversed;
        }
        None
    }
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

fn median(of: &[f64]) -> f64 {
    let mut of = of.to_vec();
    of.sort_unstable_by(f64::total_cmp);
    of[of.len() / 2].midpoint(of[(of.len() - 1) / 2])
}

/// Returns the joint values of both ends for each scene, by its kind and number.
fn read_ends(text: &str) -> HashMap<[String; 2], Vec<f64>> {
    let ends = text.lines().map(|line| {
        let [kind, number, values] = &line.splitn(3, ' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
        ([kind, number].map(|word| (*word).to_owned()), numbers(values))
    });
    ends.collect()
}

/// Returns both ends, and the limits of all joint values, which contain them. Lets fingers touch what they grasp there.
fn problem(robot: &mut Robot, values: &[f64]) -> ([Vec<f64>; 2], Vec<[f64; 2]>) {
    let moving = values.len() / 2;
    let ends = [0, moving].map(|from| [&values[from..from + moving], &[OPEN]].concat());
    let mut limits = robot.limits().to_vec();
    limits[moving..].fill([OPEN; 2]);
    for end in &ends {
        for (limits, value) in limits.iter_mut().zip(end) {
            *limits = [limits[0].min(*value), limits[1].max(*value)];
        }
        for [a, b] in robot.pairs_in_contact(end).expect("an answer") {
            robot.allow(&a, &b).expect("bodies");
        }
    }
    (ends, limits)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [urdf, srdf, packages, edges, ends, rest @ ..] = &arguments[..] else {
        eprintln!("usage: planning URDF SRDF PACKAGES EDGES ENDS [SEEDS [PATHS]]");
        std::process::exit(2);
    };
    let seeds: u64 = rest.first().map_or(10, |seeds| seeds.parse().expect("a number of seeds"));
    let mut arm = arm([urdf, srdf, packages]);
    let text = |path: &String| std::fs::read_to_string(path).expect("a file");
    let ends_of = read_ends(&text(ends));
    // The balls of links are made once. Nothing is known of the scenes.
    let home = vec![0.0; arm.joints().len()];
    arm.is_free(&home, &home).expect("an answer");
    let text_of_scenes = text(edges);
    let (mut paths, mut unsolved) = (String::new(), 0);
    let mut names = Vec::new();
    let mut by_scene: [Vec<Vec<f64>>; 4] = Default::default();
    for seed in 1..=seeds {
        for (place, Scene { name, mut robot, .. }) in read(&text_of_scenes, &arm).into_iter().enumerate() {
            let (ends, limits) = problem(&mut robot, &ends_of[&name]);
            let extent = limits.iter().map(|[low, high]| (high - low) * (high - low)).sum::<f64>().sqrt();
            let mut run = || {
                let mut planner = Planner {
                    robot: &mut robot,
                    limits: &limits,
                    range: RANGE * extent,
                    edges: 0,
                    asked: Duration::ZERO,
                };
                let start = Instant::now();
                let path = planner.plan(&ends, &mut Random::new(seed));
                (1e3 * start.elapsed().as_secs_f64(), path, planner.edges as f64, planner.asked.as_secs_f64())
            };
            let (first, ..) = run();
            let (again, path, edges, asked) = run();
            if seed == 1 {
                names.push(name.join(" "));
                by_scene.iter_mut().for_each(|of| of.push(Vec::new()));
            }
            for (of, number) in by_scene.iter_mut().zip([first, again, edges, 1e6 * asked / edges]) {
                of[place].push(number);
            }
            let Some(path) = path else {
                unsolved += 1;
                continue;
            };
            writeln!(paths, "{} {seed} {}", name.join(" "), path.len()).expect("memory");
            for state in path {
                let state: Vec<String> = state[..state.len() - 1].iter().map(f64::to_string).collect();
                writeln!(paths, "{}", state.join(" ")).expect("memory");
            }
        }
    }
    println!(
        "kind number: medians of ms with nothing known, of ms with clearances known, of edges, of us per edge"
    );
    for (place, name) in names.iter().enumerate() {
        let [first, again, edges, each] = [0, 1, 2, 3].map(|kind| median(&by_scene[kind][place]));
        println!("{name}: {first:.2}, {again:.2}, {edges:.0}, {each:.1}");
    }
    for (what, of) in
        ["nothing known, ms", "clearances known, ms", "edges", "us per edge"].iter().zip(&by_scene)
    {
        let all = of.concat();
        let medians: Vec<f64> = of.iter().map(|of| median(of)).collect();
        println!(
            "{what}: of all runs, median {:.3}, mean {:.3}; of the medians of scenes, median {:.3}, mean {:.3}, from {:.3} to {:.3}",
            median(&all),
            mean(&all),
            median(&medians),
            mean(&medians),
            medians.iter().copied().fold(f64::INFINITY, f64::min),
            medians.iter().copied().fold(0.0, f64::max)
        );
    }
    println!("{unsolved} of {} runs without a path", by_scene[0].concat().len());
    if let Some(file) = rest.get(1) {
        std::fs::write(file, paths).expect("a file to write");
    }
}
