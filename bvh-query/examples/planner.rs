//! Plans a path for a robot through an environment with RRT-Connect (Kuffner and LaValle, ICRA 2000), each edge of which is
//! certified: free at every moment, not at samples.
//!
//! ```text
//! cargo run --release --example planner
//! ```

#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_bake::{Options, input, to_bytes};
use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Pose, Querier};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// A state: where the robot is.
#[derive(Clone, Copy)]
struct State {
    position: [f64; 3],
    /// A unit quaternion, the real part last.
    rotation: [f64; 4],
}

impl State {
    fn pose(&self) -> Result<Pose, Box<dyn Error>> {
        Ok(Pose::from_quaternion(self.rotation, self.position)?)
    }

    /// A distance of states: how far the origin moves, and how far a corner of a robot of this size turns.
    fn distance(&self, other: &Self, size: f64) -> f64 {
        let moved: f64 = (0..3).map(|k| (self.position[k] - other.position[k]).powi(2)).sum();
        let cosine: f64 = (0..4).map(|k| self.rotation[k] * other.rotation[k]).sum();
        moved.sqrt() + size * cosine.abs().min(1.0).acos()
    }

    /// The state on the path to another one, at a fraction of it.
    fn towards(&self, other: &Self, fraction: f64) -> Self {
        let mix = |from: f64, to: f64| from + fraction * (to - from);
        let cosine: f64 = (0..4).map(|k| self.rotation[k] * other.rotation[k]).sum();
        let sign = if cosine < 0.0 { -1.0 } else { 1.0 };
        let rotation = [0, 1, 2, 3].map(|k| mix(self.rotation[k], sign * other.rotation[k]));
        let length = rotation.iter().map(|value| value * value).sum::<f64>().sqrt();
        Self {
            position: [0, 1, 2].map(|k| mix(self.position[k], other.position[k])),
            rotation: rotation.map(|value| value / length),
        }
    }
}

/// What the planner asks: an environment, a robot, and how near it may come.
struct World {
    environment: Bvh,
    robot: Bvh,
    options: MotionOptions,
    querier: Querier,
    edges: u64,
}

impl World {
    fn is_free(&mut self, from: &State, to: &State) -> Result<bool, Box<dyn Error>> {
        self.edges += 1;
        let path = Motion::between(&from.pose()?, &to.pose()?)?;
        Ok(self.querier.is_free(&self.environment, &self.robot, &path, &self.options)?)
    }
}

/// States that are reached from the first one by free edges: each with the number of the one before it.
struct Tree(Vec<(State, usize)>);

impl Tree {
    /// Goes a step from the nearest state towards a target. Returns the number of the new state, and whether it is the target.
    fn extend(
        &mut self,
        target: &State,
        step: f64,
        size: f64,
        world: &mut World,
    ) -> Result<Option<(usize, bool)>, Box<dyn Error>> {
        let far = |(_, (state, _)): &(usize, &(State, usize))| state.distance(target, size);
        let nearest = self.0.iter().enumerate().min_by(|x, y| far(x).total_cmp(&far(y)));
        let Some((number, &(from, _))) = nearest else { return Ok(None) };
        let distance = from.distance(target, size);
        let to = if distance <= step { *target } else { from.towards(target, step / distance) };
        if !world.is_free(&from, &to)? {
            return Ok(None);
        }
        self.0.push((to, number));
        Ok(Some((self.0.len() - 1, distance <= step)))
    }

    /// Returns the path from the first state to this one.
    fn path(&self, mut number: usize) -> Vec<State> {
        let mut path = vec![self.0[number].0];
        while number > 0 {
            number = self.0[number].1;
            path.push(self.0[number].0);
        }
        path.reverse();
        path
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let testdata = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let bake = |name: &str| -> Result<Bvh, Box<dyn Error>> {
        let mesh = input::read(&testdata.join(name))?;
        Ok(Bvh::from_bytes(to_bytes(&mesh, &Options::default())?.0)?)
    };
    let (environment, robot) = (bake("fclenv.obj")?, bake("fclrob.obj")?);
    let [lo, hi] = environment.objects()[0].bounding_box();
    let size = robot.objects()[0].bounding_sphere().1;
    let options = MotionOptions::new().clearance(0.01 * size);
    let mut world = World { environment, robot, options, querier: Querier::new()?, edges: 0 };

    let mut seed = 7u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut sample = || {
        let position = [0, 1, 2].map(|k| lo[k] + (hi[k] - lo[k]) * random());
        let raw = [(); 4].map(|()| 2.0 * random() - 1.0);
        let length = raw.iter().map(|value| value * value).sum::<f64>().sqrt();
        State { position, rotation: raw.map(|value| value / length) }
    };
    // Two free states at opposite ends.
    let mut ends = Vec::new();
    while ends.len() < 2 {
        let state = sample();
        let share = (state.position[0] - lo[0]) / (hi[0] - lo[0]);
        let is_apart = !world.querier.within(
            &world.environment,
            &world.robot,
            &state.pose()?,
            world.options.clearance,
        )?;
        if is_apart && if ends.is_empty() { share < 0.1 } else { share > 0.9 } {
            ends.push(state);
        }
    }

    let (start, step) = (Instant::now(), 4.0 * size);
    let mut trees = [Tree(vec![(ends[0], 0)]), Tree(vec![(ends[1], 0)])];
    let path = 'planned: loop {
        for (grown, other) in [(0, 1), (1, 0)] {
            let Some((number, _)) = trees[grown].extend(&sample(), step, size, &mut world)? else { continue };
            let target = trees[grown].0[number].0;
            while let Some((met, is_there)) = trees[other].extend(&target, step, size, &mut world)? {
                if is_there {
                    let (mut path, mut back) = (trees[grown].path(number), trees[other].path(met));
                    back.pop();
                    back.reverse();
                    path.extend(back);
                    if grown == 1 {
                        path.reverse();
                    }
                    break 'planned path;
                }
            }
        }
    };
    let seconds = start.elapsed().as_secs_f64();
    println!("{} states, {} edges asked about in {:.1} ms", path.len(), world.edges, 1e3 * seconds);

    // The path as a whole, certified once more.
    let mut free = 0;
    for pair in path.windows(2) {
        let edge = Motion::between(&pair[0].pose()?, &pair[1].pose()?)?;
        let answer = world.querier.motion(&world.environment, &world.robot, &edge, &world.options)?;
        free += usize::from(answer == MotionAnswer::Free);
    }
    println!(
        "{free} of {} edges are free at every moment, {} mesh units from anything",
        path.len() - 1,
        world.options.clearance
    );
    // Planners without such an answer go straight, and look at a pose here and there.
    let straight = Motion::between(&ends[0].pose()?, &ends[1].pose()?)?;
    match world.querier.motion(&world.environment, &world.robot, &straight, &world.options)? {
        MotionAnswer::Free => println!("the straight path would have been free, too"),
        MotionAnswer::Hit { free_until, touching_at, .. } => {
            println!("the straight path is free until {free_until} and ends at {touching_at}");
        }
        MotionAnswer::Near { free_until, at, .. } => {
            println!("the straight path is free until {free_until}, near at {at}")
        }
    }
    Ok(())
}
