"""Which of many poses are free? One call for all of them.

It prints:

    6044 of 10000 poses touch
    most room, 1178.274, at [ 2468.8 -1287.9  1751.5]
"""

import numpy as np

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")

# Ten thousand places with random turns about z: a position and a quaternion each, its real part last.
random = np.random.default_rng(1)
angle = random.uniform(0, 2 * np.pi, 10_000)
turns = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
poses = cbvh.pose(random.uniform([-2500, -2500, -400], [2500, 2500, 2000], (10_000, 3)), turns)

touching = room.collide(robot, poses, parallel=True)  # all cores; the answers are the same without it
print(f"{touching.sum()} of {len(poses)} poses touch")

# Distances of the free ones only, with an array for each field of the answer.
free = poses[~touching]
nearest = room.distance(robot, free, parallel=True)
roomiest = np.argmax(nearest.distance)
print(f"most room, {nearest.distance[roomiest]:.3f}, at {free[roomiest, :3, 3].round(1)}")
