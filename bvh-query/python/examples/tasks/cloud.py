"""Does a robot touch what a depth camera saw? A cloud of points, replaced with each image.

It prints:

    38429 points: touching False, 354.218 apart, nearest to [-454. 1107.  910.]
    38373 points: touching False, 86.934 apart, nearest to [-440. 1109.  910.]
    38379 points: touching True, 0.000 apart
"""

import numpy as np

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
scene = cbvh.Scene()
scene.add(cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh"), name="robot")
scene.add(cbvh.cloud(np.zeros((1, 3))), name="cloud")

for frame, height in enumerate([1700.0, 1400.0, 1100.0]):
    # Stands for the camera: what 40,000 rays from under the ceiling hit.
    rays = np.random.default_rng(frame).normal(size=(40_000, 3)) * [1, 1, 0.2] - [0, 0, 1]
    points = room.first_hits([-500, 1000, 2800], rays).point
    points = points[np.isfinite(points).all(axis=1)]

    # Each point is a ball, whose radius closes the gaps between points.
    scene.set_mesh("cloud", cbvh.cloud(points, 20.0))
    scene.set_pose("robot", cbvh.pose([0, 1500, height]))
    nearest = scene.distance().nearest
    print(f"{len(points)} points: touching {scene.collide()}, {nearest.distance:.3f} apart", end="")
    print(f", nearest to {points[nearest.triangle_b].round()}" if nearest.distance > 0 else "")
