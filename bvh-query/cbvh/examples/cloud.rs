//! Does a robot touch what a depth camera saw?
//!
//! It prints:
//!
//! ```text
//! z = 1700: touching false, 502.609 apart
//! z = 1400: touching false, 220.985 apart
//! z = 1100: touching true, 0.000 apart
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Effort, Options, read_meshes, shapes, to_bytes};
use cbvh::{Bvh, OwnedShape, Pose, ProbeBatch, Ray, Scene};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let load = |path: &str| -> Result<Bvh, Box<dyn Error>> {
        Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
    };
    let (room, robot) = (load("testdata/fclenv.obj")?, load("testdata/fclrob.obj")?);

    // Stands for the camera: what 4,096 rays from under the ceiling hit.
    let step = |k: u32| f64::from(k) / 32.0 - 1.0;
    let rays: Vec<Ray> =
        (0..4096).map(|k| Ray::new([-500.0, 1000.0, 2800.0], [step(k % 64), step(k / 64), -1.0])).collect();
    let hits = ProbeBatch::new(&room)?.first_hits(&rays)?;
    let points: Vec<[f64; 3]> = hits.iter().flatten().map(|hit| hit.point).collect();

    // Each point is a ball. The next image becomes another cloud, by Scene::set_shape.
    let cloud = to_bytes(&shapes::cloud(&points), &Options::default().effort(Effort::Quick))?.0;
    let cloud = OwnedShape::from(Bvh::from_bytes(cloud)?).rounded(25.0)?;
    let mut scene = Scene::new()?;
    scene.add_named("cloud", cloud, Pose::IDENTITY)?;
    let robot = scene.add_named("robot", robot, Pose::IDENTITY)?;
    for z in [1700.0, 1400.0, 1100.0] {
        scene.set_pose(robot, Pose::new(*Pose::IDENTITY.rotation(), [0.0, 1500.0, z])?)?;
        let gap = scene.distance()?.ok_or("there are two instances")?.nearest.distance;
        println!("z = {z}: touching {}, {gap:.3} apart", scene.collide()?);
    }
    Ok(())
}
