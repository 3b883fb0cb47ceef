"""First steps with numpy alone: a robot of testdata in its environment.

    python examples/first_steps.py
"""

import pathlib
import tempfile

import numpy as np

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"

with tempfile.TemporaryDirectory() as folder:
    # Bake once; the second time, nothing is done. Mapped files need no memory of their own.
    walls = cbvh.bake_files(TESTDATA / "fclenv.obj", f"{folder}/walls.cbvh")
    robot = cbvh.bake_files(TESTDATA / "fclrob.obj", f"{folder}/robot.cbvh")
    print(f"{walls.triangle_count} triangles of walls, {robot.triangle_count} of the robot")

    # Poses of the robot in the frame of the walls (body to world): a rotation and a translation in mesh units.
    poses = np.tile(np.eye(4), (1000, 1, 1))
    poses[:, :3, :3] = [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]
    poses[:, :3, 3] = np.linspace([300, -1600, -500], [300, -1600, 1500], 1000)

    touch = walls.collide(robot, poses)
    apart = walls.distance(robot, poses)
    print(f"it touches the walls in {touch.sum()} of {len(poses)} poses")
    print(f"in the first one it is {apart.distance[0]} away, certainly {apart.lower[0]:.12g} to {apart.upper[0]:.12g}")

    # The motion from the first pose to the last, at every moment.
    answer = walls.motion(robot, cbvh.Motion.between(poses[0], poses[-1]))
    print(f"the motion gives {answer.kind.name} and is certainly free until {answer.free_until:.9f}")

    # Points, rays, and many placed meshes at once.
    print(f"a wall below the origin is {walls.first_hits([0, 0, 0], [0, 0, -1]).t} away")
    scene = cbvh.Scene()
    # Robots are asked about with walls, not with each other.
    scene.add(walls, name="walls", member=1, meets=2)
    ids = [scene.add(robot, pose, member=2, meets=1) for pose in poses[::100]]
    print(f"{len(scene.pairs_in_contact())} pairs of {len(scene)} instances touch")
    scene.set_poses(ids, poses[1::100])
    found = scene.distance()
    assert found is not None
    print(f"after they moved, the nearest pair is {found.nearest.distance} apart")
