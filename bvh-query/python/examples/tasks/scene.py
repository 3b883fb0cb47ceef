"""Which of many placed meshes touch, frame by frame?

It prints:

    frame 0: touching: []; room and robot 0 are 480.500 apart
    frame 1: touching: []; room and robot 0 are 480.500 apart
    frame 2: touching: []; robot 0 and robot 2 are 190.000 apart
    frame 3: touching: ['robot 0 and robot 2']; robot 0 and robot 2 are 0.000 apart
"""

import numpy as np

import cbvh

scene = cbvh.Scene()
scene.tracking = True  # earlier results about each pair save time where little moves; no answer changes
FIXED, MOVING = 1, 2
scene.add(cbvh.bake_files("testdata/fclenv.obj", "room.cbvh"), name="room", member=FIXED, meets=MOVING)
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")
ids = [scene.add(robot, name=f"robot {k}", member=MOVING, meets=FIXED | MOVING) for k in range(3)]
scene.add(cbvh.box([200, 200, 200]), cbvh.pose([0, 0, 600]), name="load", member=MOVING, meets=FIXED)
scene.attach("load", "robot 0")  # moves with it from now on
scene.set_allowed("robot 0", "robot 1")  # may touch

for frame in range(4):
    # The first one stands, and the others come from both sides.
    scene.set_poses(ids, cbvh.pose([[2000, 0, 900], [2000, 300 * frame - 1800, 900], [2000, 2000 - 300 * frame, 900]]))
    pairs = [f"{scene.name(a)} and {scene.name(b)}" for a, b in scene.pairs_in_contact()]
    nearest = scene.distance()
    a, b = scene.name(nearest.a), scene.name(nearest.b)
    print(f"frame {frame}: touching: {pairs}; {a} and {b} are {nearest.nearest.distance:.3f} apart")
