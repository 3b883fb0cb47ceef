"""Is a path free at every moment?

It prints:

    edges: [ True  True False]
    with a clearance of 800: [ True False False]
    path: True
    samples: True  at every moment: False
"""

import numpy as np

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")

# Edges of a planner: the origin moves on a line, and the body turns by the shorter angle. One call for all of them.
waypoints = cbvh.pose([[0, 0, 5000], [500, 0, 5000], [500, 0, 3900], [500, 0, -400]], [0, 0, 0, 1])
edges = cbvh.Motion.between(waypoints[:-1], waypoints[1:])
print("edges:", room.is_free(robot, edges))
print("with a clearance of 800:", room.is_free(robot, edges, clearance=800))

# The first three waypoints as one path.
print("path:", room.is_free(robot, cbvh.Polyline(waypoints[:3])))

# A thin plate, flown through between two samples: samples miss it, and this does not.
plate, ball = cbvh.box([2, 2, 0.001]), cbvh.sphere(0.005)
way = cbvh.Motion.between(cbvh.pose([0, 0, 1]), cbvh.pose([0, 0, -1]))
samples = way.pose(np.linspace(0, 1, 100))
print("samples:", not plate.collide(ball, samples).any(), " at every moment:", plate.is_free(ball, way))
