"""Is a robot's motion between two configurations free at every moment?

It prints:

    free: False
    HIT: free until 0.370788, then ('forearm', 'post') touch at [-0.2067  0.8     0.      0.    ]
    edges: [ True  True  True]
"""

import numpy as np

import cbvh

arm = cbvh.Robot.from_urdf("testdata/robot/robot.urdf")
arm.allow_frequent(share=0.1)
arm.add_obstacle(cbvh.box([0.1, 0.1, 1.0]), cbvh.pose([0.5, 0, 0.5]), name="post")

# Straight in joint space; links follow their arcs.
start, goal = arm.q(waist=-0.8, shoulder=0.8), arm.q(waist=0.8, shoulder=0.8)
print("free:", arm.is_free(start, goal))
hit = arm.motion(start, goal)
print(f"{hit.kind}: free until {hit.free_until:.6f}, then {hit.bodies} touch at", hit.joints.round(4))

# Round the post, with the arm drawn in: the edges of a path in one call, and with a clearance of 2 cm.
drawn_in = arm.q(waist=-0.8, shoulder=-0.2, elbow=0.9), arm.q(waist=0.8, shoulder=-0.2, elbow=0.9)
path = np.array([start, *drawn_in, goal])
print("edges:", arm.is_free(path[:-1], path[1:], clearance=0.02, parallel=True))
