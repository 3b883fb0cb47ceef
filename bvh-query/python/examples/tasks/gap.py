"""How far apart are two meshes, and where are they nearest?

It prints:

    60.5 apart, certainly from 60.500000000000 to 60.500000000007
    on the room [  316.  -2237.    -14.5] and on the robot [  316. -2237.   -75.]
    in the robot's frame [-500. -395.  425.]
    on the triangle [[-500.0, -395.0, 425.0], [500.0, -395.0, 425.0], [462.0, -203.600006, 425.0]]
    no nearer than 55.0 at most 10 % off: True
"""

import numpy as np

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")
pose = np.array([[0.6, -0.8, 0, 300], [0.8, 0.6, 0, -1600], [0, 0, 1, -500], [0, 0, 0, 1]])

nearest = room.distance(robot, pose)
print(f"{nearest.distance} apart, certainly from {nearest.lower:.12f} to {nearest.upper:.12f}")
print("on the room", nearest.point_a, "and on the robot", nearest.point_b)

# The point of the robot in its own frame, and the corners of its triangle there.
print("in the robot's frame", (np.linalg.inv(pose) @ [*nearest.point_b, 1])[:3].round(3))
print("on the triangle", robot.triangles[nearest.triangle_b].tolist())

# Where an error is allowed, a query may stop sooner. The lower bound stays certified.
rough = room.distance(robot, pose, rel_err=0.1)
print("no nearer than", round(rough.lower, 3), "at most 10 % off:", rough.distance <= 1.1 * nearest.lower)
